//! Calibrations of a sensor triad in the forms of other tools.
//!
//! All forms say the same of a measured vector z and the true one f, in another order:
//!
//! | form | what it applies | matrix | bias |
//! |---|---|---|---|
//! | this program's device | `f = z - M z - b` | subtracted | after it |
//! | imu_tk ([`tk`]) | `f = T K (z - B)` | misalignment times scale | before it, in units of z |
//! | imu_calib ([`sm`]) | `f = S z - B` | scale and misalignment | after it |
//! | Kalibr ([`kalibr`]) | `z = M f + b` | from the true to the measured | not in its file |
//!
//! [`Triad`] has the order of imu_tk, `f = C (z - B)`. The signs of non-orthogonality are those of
//! the elements: imu_tk's angles `mis_yz`, `mis_zx` and `mis_xy` are the negative elements (0, 1),
//! (1, 2) and (2, 0) of T, the others positive ones.

pub mod kalibr;
pub mod sm;
pub mod tk;

use host_core::error::Error;
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// A calibration `f = C (z - B)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triad {
    /// C.
    pub matrix: Matrix3<f64>,
    /// B, in units of the measured vector.
    pub bias: Vector3<f64>,
}

impl Triad {
    /// A calibration that changes nothing.
    #[must_use]
    pub fn none() -> Self {
        Self {
            matrix: Matrix3::identity(),
            bias: Vector3::zeros(),
        }
    }

    /// The device's map M and bias b: `f = z - M z - b`.
    #[must_use]
    pub fn device(&self) -> (Matrix3<f64>, Vector3<f64>) {
        (Matrix3::identity() - self.matrix, self.matrix * self.bias)
    }

    /// Of `f = C z - b`, the bias after the matrix.
    fn of_after(matrix: Matrix3<f64>, bias: &Vector3<f64>) -> Option<Self> {
        let bias = matrix.try_inverse()? * bias;
        Some(Self { matrix, bias })
    }
}

/// A calibration of another tool.
#[derive(Debug, Clone, PartialEq)]
pub struct ForeignCalibration {
    /// The tool.
    pub tool: &'static str,
    /// Accelerometers, m/s2.
    pub accel: Option<Triad>,
    /// Gyros, rad/s.
    pub gyro: Option<Triad>,
    /// White noise and walk, if the form has them.
    pub noise: Option<kalibr::Noise>,
    /// What the form does not hold, or is not used.
    pub notes: Vec<String>,
}

/// Reads a calibration of the accelerometers whose form its text shows: YAML with `SM` is
/// imu_calib's, other YAML Kalibr's, plain numbers are imu_tk's.
///
/// # Errors
/// The file cannot be read, has none of these forms, or numbers that are no calibration.
pub fn read(file: &Path) -> Result<ForeignCalibration, Error> {
    let text = std::fs::read_to_string(file).map_err(|e| Error::reading(file, e))?;
    let accel = |tool, accel| ForeignCalibration {
        tool,
        accel: Some(accel),
        gyro: None,
        noise: None,
        notes: vec![],
    };
    let named = |word: &str| text.lines().any(|line| line.trim_start().starts_with(word));
    match () {
        () if named("SM:") => Ok(accel("imu_calib", sm::read(file, &text)?)),
        () if text.contains(':') => kalibr::read(file, &text),
        () => Ok(accel("imu_tk", tk::read(file, &text)?)),
    }
}

/// A fault of a calibration file.
fn wrong(file: &Path, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::Scenario {
        file: file.to_path_buf(),
        line: None,
        key: key.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// A matrix that is not far from one, as those of sensors in SI are.
fn plausible(file: &Path, key: &str, matrix: &Matrix3<f64>) -> Result<(), Error> {
    let off = (matrix - Matrix3::identity()).amax();
    if off.is_finite() && off < 0.5 {
        return Ok(());
    }
    let problem = format!("is {off:.3} off the unit matrix, more than sensors in SI units");
    let remedy = "calibrate rates in rad/s and forces in m/s2, not raw counts";
    Err(wrong(file, key, problem, remedy))
}

/// A number in the fewest digits that read back the same.
fn text(value: f64) -> String {
    format!("{value:?}")
}

/// The rows of a matrix, each with its numbers joined by `between`.
fn rows(matrix: &Matrix3<f64>, between: &str) -> [String; 3] {
    std::array::from_fn(|i| {
        let row: Vec<String> = matrix.row(i).iter().map(|x| text(*x)).collect();
        row.join(between)
    })
}

#[cfg(test)]
mod tests;
