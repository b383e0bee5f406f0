//! The IMU YAML of Kalibr, before a calibration (noise alone) and after one (`imu0` with the
//! matrices of the model scale-misalignment). Kalibr models
//!
//! ```text
//! z_a = M_a f + b_a        z_g = M_g C_gyro_i w + A f + b_g
//! ```
//!
//! and leaves the biases out of the file, because it estimates them over time.

use super::{ForeignCalibration, Triad, plausible, rows, text, wrong};
use host_core::error::Error;
use nalgebra::Matrix3;
use saphyr::{LoadableYamlNode, Yaml};
use std::path::Path;

/// White noise and walk of the biases; gyros (rad/s/sqrt(Hz), rad/s2/sqrt(Hz)), accelerometers
/// (m/s2/sqrt(Hz), m/s3/sqrt(Hz)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Samples a second, if given.
    pub rate_hz: Option<f64>,
    /// Noise density and random walk of the gyros.
    pub gyro: [f64; 2],
    /// Those of the accelerometers.
    pub accel: [f64; 2],
}

/// Keys of the noise.
const KEYS: [&str; 4] = [
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "accelerometer_noise_density",
    "accelerometer_random_walk",
];

/// The first document of a YAML text. Lines of OpenCV's header are left out.
pub(super) fn document<'a>(file: &Path, text: &'a str) -> Result<Yaml<'a>, Error> {
    let rest = match text.strip_prefix('%') {
        Some(rest) => rest.split_once('\n').map_or("", |(_, rest)| rest),
        None => text,
    };
    let fault =
        |problem: String| wrong(file, "YAML", problem, "give the file that the tool writes");
    let documents = Yaml::load_from_str(rest).map_err(|e| fault(format!("is damaged: {e}")))?;
    let first = documents.into_iter().next();
    first.ok_or_else(|| fault("is empty".into()))
}

fn number(node: &Yaml<'_>) -> Option<f64> {
    let whole = || node.as_integer().map(|x| x as f64);
    let text = || node.as_str().and_then(|text| text.parse().ok());
    let value = node.as_floating_point().or_else(whole).or_else(text);
    value.filter(|x| x.is_finite())
}

/// All numbers of a list, or of the lists in it.
pub(super) fn numbers(node: &Yaml<'_>) -> Option<Vec<f64>> {
    let row = |node: &Yaml<'_>| -> Option<Vec<f64>> {
        match node.as_sequence() {
            Some(row) => row.iter().map(number).collect(),
            None => Some(vec![number(node)?]),
        }
    };
    let rows: Option<Vec<Vec<f64>>> = node.as_sequence()?.iter().map(row).collect();
    rows.map(|rows| rows.concat())
}

/// Reads the text.
pub(super) fn read(file: &Path, text: &str) -> Result<ForeignCalibration, Error> {
    let document = document(file, text)?;
    let imu = document.as_mapping_get("imu0").unwrap_or(&document);
    let mut notes = vec![];
    let noise = noise(file, imu)?;
    let accel = matrix(file, imu, "accelerometers", "M")?;
    let gyro = matrix(file, imu, "gyroscopes", "M")?;
    let turn = matrix(file, imu, "gyroscopes", "C_gyro_i")?.unwrap_or_else(Matrix3::identity);
    let by_force = matrix(file, imu, "gyroscopes", "A")?;
    if accel.is_none() && gyro.is_none() && noise.is_none() {
        let remedy = format!("give an IMU YAML of Kalibr, with {}", KEYS.join(", "));
        return Err(wrong(file, KEYS[0], "is not there, nor a matrix M", remedy));
    }
    if accel.is_some() || gyro.is_some() {
        notes.push("Kalibr's file has no biases: they are taken as 0".into());
    }
    if let Some(a) = by_force.filter(|a| a.amax() > 0.0) {
        notes.push(format!(
            "the gyros' g-sensitivity A, up to {:.2e} rad/s per m/s2, is not used",
            a.amax()
        ));
    }
    let triad = |key: &'static str, m: Option<Matrix3<f64>>| {
        let inverted = m.map(|m| {
            plausible(file, key, &m)?;
            let remedy = "calibrate again";
            let matrix = m.try_inverse();
            let matrix = matrix.ok_or_else(|| wrong(file, key, "cannot be inverted", remedy))?;
            Ok(Triad {
                matrix,
                ..Triad::none()
            })
        });
        inverted.transpose()
    };
    Ok(ForeignCalibration {
        tool: "Kalibr",
        accel: triad("accelerometers.M", accel)?,
        gyro: triad("gyroscopes.M", gyro.map(|m| m * turn))?,
        noise,
        notes,
    })
}

fn noise(file: &Path, imu: &Yaml<'_>) -> Result<Option<Noise>, Error> {
    if KEYS.iter().all(|key| imu.as_mapping_get(key).is_none()) {
        return Ok(None);
    }
    let value = |key: &str| {
        let found = imu.as_mapping_get(key).and_then(number);
        let problem = "is not there as a number above 0";
        let remedy = format!("give {}", KEYS.join(", "));
        let found = found.filter(|x| *x > 0.0);
        found.ok_or_else(|| wrong(file, key, problem, remedy))
    };
    let [a, b, c, d] = KEYS.map(value);
    let rate_hz = imu.as_mapping_get("update_rate").and_then(number);
    Ok(Some(Noise {
        rate_hz: rate_hz.filter(|rate| *rate > 0.0),
        gyro: [a?, b?],
        accel: [c?, d?],
    }))
}

fn matrix(
    file: &Path,
    imu: &Yaml<'_>,
    table: &str,
    key: &str,
) -> Result<Option<Matrix3<f64>>, Error> {
    let Some(node) = imu
        .as_mapping_get(table)
        .and_then(|t| t.as_mapping_get(key))
    else {
        return Ok(None);
    };
    let found = numbers(node).unwrap_or_default();
    if found.len() != 9 {
        let problem = format!("has {} numbers instead of 9", found.len());
        let remedy = "give three rows of three numbers";
        return Err(wrong(file, &format!("{table}.{key}"), problem, remedy));
    }
    Ok(Some(Matrix3::from_row_slice(&found)))
}

/// The text of a calibration and of a sensor's noise. Calibrations that cannot be inverted are left
/// out.
#[must_use]
pub fn write(accel: Option<&Triad>, gyro: Option<&Triad>, noise: &Noise, about: &str) -> String {
    let mut out = format!("# {about}\n# biases are not part of this form\n");
    let values = noise.gyro.into_iter().chain(noise.accel);
    for (key, value) in KEYS.iter().zip(values) {
        out += &format!("{key}: {}\n", text(value));
    }
    if let Some(rate) = noise.rate_hz {
        out += &format!("update_rate: {}\n", text(rate));
    }
    out += "rostopic: /imu\ntime_offset: 0.0\n";
    let lines = |m: &Matrix3<f64>| {
        let rows = rows(m, ", ").map(|row| format!("  - [{row}]\n"));
        rows.concat()
    };
    let forward = |triad: Option<&Triad>| triad.and_then(|t| t.matrix.try_inverse());
    let (accel, gyro) = (forward(accel), forward(gyro));
    if accel.is_some() || gyro.is_some() {
        out += "model: scale-misalignment\n";
    }
    if let Some(m) = accel {
        out += &format!("accelerometers:\n  M:\n{}", lines(&m));
    }
    if let Some(m) = gyro {
        let (one, zero) = (Matrix3::identity(), Matrix3::zeros());
        out += &format!(
            "gyroscopes:\n  M:\n{}  A:\n{}  C_gyro_i:\n{}",
            lines(&m),
            lines(&zero),
            lines(&one)
        );
    }
    out
}
