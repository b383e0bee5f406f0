//! The text of imu_tk: misalignment matrix T and scale matrix K, row by row, and bias B. It applies
//! `T K (z - B)`.

use super::{Triad, plausible, rows, text, wrong};
use host_core::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Numbers of the text.
const NUMBERS: usize = 21;

/// Reads the text.
pub(super) fn read(file: &Path, text: &str) -> Result<Triad, Error> {
    let remedy = "give the file that CalibratedTriad::save of imu_tk writes: 9 numbers of the \
                  misalignment matrix, 9 of the scale matrix, 3 of the bias";
    let words = text.split_whitespace();
    let numbers: Vec<f64> = words
        .map(|word| {
            let number = word.parse().ok().filter(|x: &f64| x.is_finite());
            let is = format!(
                "has '{}', which is not a number",
                word.chars().take(20).collect::<String>()
            );
            number.ok_or_else(|| wrong(file, "imu_tk", is, remedy))
        })
        .collect::<Result<_, _>>()?;
    if numbers.len() != NUMBERS {
        let problem = format!("has {} numbers instead of {NUMBERS}", numbers.len());
        return Err(wrong(file, "imu_tk", problem, remedy));
    }
    let misalignment = Matrix3::from_row_slice(&numbers[..9]);
    let scale = Matrix3::from_row_slice(&numbers[9..18]);
    let matrix = misalignment * scale;
    plausible(file, "scale matrix", &matrix)?;
    Ok(Triad {
        matrix,
        bias: Vector3::from_row_slice(&numbers[18..]),
    })
}

/// The text of a calibration. The scale factors are the diagonal, so T has ones there.
#[must_use]
pub fn write(triad: &Triad) -> String {
    let diagonal = triad.matrix.diagonal();
    let misalignment = Matrix3::from_fn(|i, j| triad.matrix[(i, j)] / diagonal[j]);
    let scale = Matrix3::from_diagonal(&diagonal);
    let matrix = |m: &Matrix3<f64>| rows(m, " ").join("\n");
    let bias: Vec<String> = triad.bias.iter().map(|x| text(*x)).collect();
    format!(
        "{}\n\n{}\n\n{}\n\n",
        matrix(&misalignment),
        matrix(&scale),
        bias.join("\n")
    )
}
