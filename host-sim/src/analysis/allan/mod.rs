//! Allan deviation of recorded or simulated sensors, and the noise coefficients it shows (IEEE 647
//! and 952, annex C).
//!
//! [`columns`] reads a file into [`Series`] of increments, [`analyse`] finds the coefficients of
//! each, and [`findings`] gathers the results, which `report::allan` shows. Module `deviation`
//! estimates the Allan variance, `covariance` its uncertainty, and `fit` the coefficients with
//! their intervals. Module `rounding` finds the shortest time at which pulses are noise.

pub mod columns;
mod covariance;
mod deviation;
pub mod findings;
mod fit;
mod rounding;

pub use fit::{Analysis, Coefficient, Deviation, analyse};

use crate::inertial::earth::Local;
use crate::inertial::sins::Increment;
use crate::inertial::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, UG};
use crate::recordings::columns::IMU;
use crate::simulator::imu::{Imu, ImuSpec};
use serde::Serialize;

/// The kind of a sensor, which determines the units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Angle increments in rad.
    Gyro,
    /// Velocity increments in m/s.
    Accel,
}

/// Increments of one axis at a constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of the column in the file.
    pub column: String,
    /// Gyro or accelerometer.
    pub kind: Kind,
    /// Samples per second.
    pub rate_hz: f64,
    /// Increment over each sample interval, rad or m/s.
    pub increments: Vec<f64>,
}

/// Symbols and names of the five noises.
const NOISES: [(&str, &str); 5] = [
    ("Q", "quantisation"),
    ("N", "random walk"),
    ("B", "bias instability"),
    ("K", "rate random walk"),
    ("R", "rate ramp"),
];

impl Kind {
    /// Unit of the deviation, and its value in rad/s or m/s2.
    #[must_use]
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::Gyro => ("deg/h", DEG_PER_H),
            Self::Accel => ("ug", UG),
        }
    }

    /// Units of Q, N, B, K, R, and their values in SI.
    #[must_use]
    pub fn coefficient_units(self) -> [(&'static str, f64); 5] {
        match self {
            Self::Gyro => [
                ("arcsec", ARCSEC),
                ("deg/sqrt(h)", DEG_PER_SQRT_H),
                ("deg/h", DEG_PER_H),
                ("deg/h/sqrt(h)", DEG_PER_H / 60.0),
                ("deg/h^2", DEG_PER_H / 3600.0),
            ],
            Self::Accel => [
                ("m/s", 1.0),
                ("ug/sqrt(Hz)", UG),
                ("ug", UG),
                ("ug/sqrt(h)", UG / 60.0),
                ("ug/h", UG / 3600.0),
            ],
        }
    }
}

/// Output of a simulated IMU that stands level at 45 degrees of latitude, nose to the north, for
/// `duration_s` seconds.
#[must_use]
pub fn at_rest(spec: &ImuSpec, duration_s: u32, seed: u64) -> Vec<Series> {
    let here = Local::at(std::f64::consts::FRAC_PI_4, 0.0);
    let dt = 1.0 / f64::from(spec.rate_hz);
    let perfect = Increment {
        dtheta: here.omega_ie() * dt,
        dv: -here.gravity() * dt,
    };
    let lsb = Imu::lsb(spec);
    let mut imu = Imu::new(spec, seed, seed);
    let samples = (duration_s * spec.rate_hz) as usize;
    let mut increments = [(); 6].map(|()| Vec::with_capacity(samples));
    for _ in 0..samples {
        let (counts, _) = imu.measure(&perfect);
        for i in 0..3 {
            increments[i].push(f64::from(counts.dtheta[i]) * lsb.rad);
            increments[i + 3].push(f64::from(counts.dv[i]) * lsb.mps);
        }
    }
    let named = IMU[1..].iter().zip(increments).enumerate();
    let series = named.map(|(i, (column, increments))| Series {
        column: (*column).to_owned(),
        kind: if i < 3 { Kind::Gyro } else { Kind::Accel },
        rate_hz: f64::from(spec.rate_hz),
        increments,
    });
    series.collect()
}

#[cfg(test)]
mod columns_tests;
#[cfg(test)]
mod python_test;
#[cfg(test)]
mod tests;
