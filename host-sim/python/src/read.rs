//! `read`: a recording of any form that the program reads.

use crate::errors::{raised, refused};
use crate::long::interruptible;
use crate::recording::Recording;
use host_reading::open;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};
use std::path::PathBuf;

/// An option of the program from an argument of Python: `imu_topic="/imu"` is
/// `--imu-topic=/imu`, True is the option alone, and several values are joined by commas.
fn option(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
    let name = format!("--{}", name.replace('_', "-"));
    if let Ok(set) = value.cast::<PyBool>() {
        return Ok(set.is_true().then_some(name));
    }
    if value.is_none() {
        return Ok(None);
    }
    let several = value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>();
    let text = match several {
        true => {
            let each = value.try_iter()?.map(|one| Ok(one?.str()?.to_string()));
            each.collect::<PyResult<Vec<_>>>()?.join(",")
        }
        false => value.str()?.to_string(),
    };
    Ok(Some(format!("{name}={text}")))
}

/// Reads a recording of any form that `host-sim replay` takes, and recognises the form as
/// `host-sim report` does: an MCAP file or the folder of a bag, a ULog, a UBX or NovAtel log, the
/// folder of an EuRoC recording, the header.toml of CSV files or its folder, and IMU and fixes of
/// KF-GINS as path and second.
///
/// options: what the file does not contain, by the names of the options of `host-sim replay FORM`
/// with `_` for `-`, such as standstill_s=120, mounting="y x -z", imu_topic="/imu". True: an
/// option without a value; a list: values that the program takes with commas.
#[pyfunction]
#[pyo3(signature = (path, second=None, **options))]
pub fn read(
    py: Python<'_>,
    path: PathBuf,
    second: Option<PathBuf>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Recording> {
    let mut words = Vec::new();
    for (name, value) in options.into_iter().flatten() {
        let name: String = name.extract()?;
        words.extend(option(&name, &value)?);
    }
    let from: Vec<PathBuf> = [path].into_iter().chain(second).collect();
    if from.iter().any(|path| path.as_os_str().is_empty()) {
        return Err(refused("path", "is empty", "give a file or a folder"));
    }
    let opened = interruptible(py, move || open(&from, &words))?.map_err(raised)?;
    Ok(Recording {
        record: opened.record,
        says: opened.says,
        unit: opened.unit,
        form: opened.form,
    })
}
