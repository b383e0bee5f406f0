//! The YAML of imu_calib: `SM`, nine numbers row by row, and `bias`. It applies `SM z - bias`.

use super::kalibr::{document, numbers};
use super::{Triad, plausible, rows, text, wrong};
use host_core::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Reads the text.
pub(super) fn read(file: &Path, text: &str) -> Result<Triad, Error> {
    let document = document(file, text)?;
    let list = |key: &str, count: usize| {
        let remedy =
            "give 'SM' with 9 numbers and 'bias' with 3, as imu_calib writes them".to_owned();
        let node = document.as_mapping_get(key);
        let found = node.and_then(numbers).unwrap_or_default();
        match found.len() == count {
            true => Ok(found),
            false => {
                let problem = format!("has {} numbers instead of {count}", found.len());
                Err(wrong(file, key, problem, remedy))
            }
        }
    };
    let matrix = Matrix3::from_row_slice(&list("SM", 9)?);
    plausible(file, "SM", &matrix)?;
    let bias = Vector3::from_row_slice(&list("bias", 3)?);
    Triad::of_after(matrix, &bias)
        .ok_or_else(|| wrong(file, "SM", "cannot be inverted", "calibrate again"))
}

/// The text of a calibration.
#[must_use]
pub fn write(triad: &Triad) -> String {
    let after = triad.matrix * triad.bias;
    let bias: Vec<String> = after.iter().map(|x| text(*x)).collect();
    format!(
        "SM: [{}]\nbias: [{}]\n",
        rows(&triad.matrix, ", ").join(",\n     "),
        bias.join(", ")
    )
}
