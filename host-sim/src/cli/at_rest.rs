//! Reads a recording of sensors at rest, of any form, for `allan` and `unit`.

use host_core::error::Error;
use host_estimation::analysis::allan::Column;
use host_estimation::analysis::allan::columns::{Choice, load};
use host_io::recordings::record::Record;
use host_io::recordings::{euroc, generic, kfgins};
use host_reading::form::{self, Form};
use host_reading::open;
use nalgebra::Rotation3;
use std::path::{Path, PathBuf};

/// Samples at rest that were read.
pub(super) enum AtRest {
    /// Samples with times.
    Record(Box<Record>),
    /// Columns of a CSV, and notes on it.
    Columns(Vec<Column>, Vec<String>),
}

/// Reads `file`, or the file that `header` names if there is none. `choice` is asked for where the
/// file is a CSV without a header.toml; `options` are those of `replay`. With `fixes`, a
/// header.toml's fixes are read, too, if they can be.
pub(super) fn read(
    file: Option<&Path>,
    header: Option<&Path>,
    choice: impl FnOnce() -> Result<Choice, Error>,
    options: &[String],
    fixes: bool,
) -> Result<AtRest, Error> {
    let record = |record: Record| Ok(AtRest::Record(Box::new(record)));
    let csv = |header: &Path, files: &[PathBuf]| {
        let all = fixes.then(|| generic::read_with_truth(header, files, None).ok());
        all.flatten()
            .map_or_else(|| generic::samples(header, files, None), Ok)
    };
    if let Some(header) = header {
        let files: Vec<PathBuf> = file.into_iter().map(Path::to_path_buf).collect();
        return record(csv(header, &files)?);
    }
    let file = file.unwrap_or(Path::new(""));
    let of_columns = match form::of(&[file.to_path_buf()]) {
        Ok(Form::Replay("csv", _, files)) => {
            let header = files.first().map_or(file, PathBuf::as_path);
            return record(csv(header, &[])?);
        }
        Ok(Form::Replay("euroc", ..)) => {
            return record(euroc::at_rest(file, Rotation3::identity())?);
        }
        Ok(Form::Replay("mcap" | "ulog" | "ubx" | "novatel", ..)) => {
            return record(open(&[file.to_path_buf()], options)?.record);
        }
        Ok(_) => true,
        Err(missing @ Error::Missing { .. }) => return Err(missing),
        Err(_) => !kfgins::is_imu(file),
    };
    if !of_columns {
        return record(kfgins::samples(file)?);
    }
    let mut notes = Vec::new();
    let columns = load(file, &choice()?, &mut notes)?;
    Ok(AtRest::Columns(columns, notes))
}
