//! `host-sim unit calibration`.

use super::outputs::{Calibration, Outputs};
use crate::cli::options::refused;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::units::{DEG_PER_H, DEG_PER_SQRT_H, PPM, UG, UG_PER_SQRT_HZ};
use host_estimation::analysis::standing::Number;
use host_io::recordings::calibration::{ForeignCalibration, Triad, kalibr, read};
use host_unit::Unit;
use std::path::PathBuf;

/// Arguments of `unit calibration`.
#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    /// Calibration of Kalibr (IMU YAML), imu_tk (text) or imu_calib (YAML); imu_tk's of the
    /// accelerometers
    file: PathBuf,
    /// imu_tk's of the gyros
    #[arg(long, value_name = "FILE")]
    gyro: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

impl Args {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.outputs.check()?;
        let mut found = read(&self.file)?;
        if let Some(file) = &self.gyro {
            let gyro = read(file)?;
            if gyro.tool != "imu_tk" {
                let remedy = "leave it out: the one file of this tool has all of it";
                return Err(refused(
                    "--gyro",
                    format!("is a file of {}", gyro.tool),
                    remedy,
                ));
            }
            found.gyro = gyro.accel;
        }
        let unit = self.outputs.unit()?;
        println!("{}: calibration of {}", self.file.display(), found.tool);
        let triads = [
            ("accelerometers", &found.accel, UG, "ug"),
            ("gyros", &found.gyro, DEG_PER_H, "deg/h"),
        ];
        for (name, triad, si, unit) in triads {
            if let Some(triad) = triad {
                say(name, triad, si, unit);
            }
        }
        found.notes.iter().for_each(|note| println!("- {note}"));
        let numbers = unit.map(|(_, unit)| numbers(&found, &unit));
        self.outputs.write(&Calibration {
            accel: found.accel,
            gyro: found.gyro,
            numbers: numbers.unwrap_or_default(),
            about: vec![format!(
                "With the calibration of {} in {}",
                found.tool,
                self.file.display()
            )],
        })
    }
}

/// Prints map and bias in the device's order.
fn say(name: &str, triad: &Triad, si: f64, unit: &str) {
    let (map, bias) = triad.device();
    println!("{name}: f = z - M z - b");
    for i in 0..3 {
        let row: Vec<String> = map
            .row(i)
            .iter()
            .map(|x| format!("{:+.0}", x / PPM))
            .collect();
        println!("  M {} ppm   b {:+.1} {unit}", row.join(" "), bias[i] / si);
    }
}

/// The numbers of a unit file: the largest of the axes.
fn numbers(found: &ForeignCalibration, unit: &Unit) -> Vec<Number> {
    let tool = found.tool;
    let number = |key, value: f64, preset| Number {
        key,
        unit: "",
        value: value.max(1e-6),
        measured: Some(value),
        preset,
        source: format!("measured: by {tool}, the largest of the axes"),
    };
    let mut all = vec![];
    let (g, a) = (&unit.gyro, &unit.accel);
    let keys = [
        (
            &found.accel,
            [
                "accel.bias_turn_on_ug",
                "accel.scale_ppm",
                "accel.misalignment_mrad",
            ],
            UG,
            [a.bias_turn_on_ug, a.scale_ppm, a.misalignment_mrad],
        ),
        (
            &found.gyro,
            [
                "gyro.bias_turn_on_dph",
                "gyro.scale_ppm",
                "gyro.misalignment_mrad",
            ],
            DEG_PER_H,
            [g.bias_turn_on_dph, g.scale_ppm, g.misalignment_mrad],
        ),
    ];
    for (triad, keys, si, preset) in keys {
        let Some(triad) = triad else { continue };
        let (map, bias) = triad.device();
        let beside = map - nalgebra::Matrix3::from_diagonal(&map.diagonal());
        let sizes = [
            bias.amax() / si,
            map.diagonal().amax() / PPM,
            beside.amax() * 1e3,
        ];
        // what a calibration leaves is not known, so it counts as what the base says
        let each = keys.into_iter().zip(sizes).zip(preset);
        all.extend(
            each.map(|((key, size), preset)| number(key, rounded(size.hypot(preset)), preset)),
        );
    }
    let Some(kalibr::Noise { gyro, accel, .. }) = found.noise else {
        return all;
    };
    let hour = 60.0;
    for (key, value, preset) in [
        (
            "gyro.angle_random_walk_dpsqrth",
            gyro[0] / DEG_PER_SQRT_H,
            g.angle_random_walk_dpsqrth,
        ),
        (
            "gyro.bias_in_run_dph",
            gyro[1] * hour / DEG_PER_H,
            g.bias_in_run_dph,
        ),
        (
            "accel.velocity_random_walk_ugpsqrthz",
            accel[0] / UG_PER_SQRT_HZ,
            a.velocity_random_walk_ugpsqrthz,
        ),
        (
            "accel.bias_in_run_ug",
            accel[1] * hour / UG,
            a.bias_in_run_ug,
        ),
    ] {
        all.push(Number {
            source: format!("source: {tool}'s file"),
            ..number(key, rounded(value), preset)
        });
    }
    all
}

/// To four figures.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
