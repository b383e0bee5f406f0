//! Allan deviation of recorded or simulated sensors, and the noise coefficients it shows (IEEE 647
//! and 952, annex C).
//!
//! [`columns`] reads a file into [`Column`]s, which wait in [`store`]. [`analyse`] finds the
//! coefficients of one [`Series`] of increments, and [`findings`] gathers the results, which
//! `report::allan` shows. Module `deviation`
//! estimates the Allan variance, `covariance` its uncertainty, and `fit` the coefficients with
//! their intervals. Module `outliers` leaves out single bad samples, `rounding` finds the shortest
//! time at which pulses are noise.

pub mod columns;
mod covariance;
mod deviation;
pub mod findings;
mod fit;
mod gravity;
mod outliers;
mod rounding;
pub mod store;

pub use fit::{Analysis, Coefficient, Deviation, analyse};
pub use outliers::Outliers;
pub use store::Column;

use host_core::error::Error;
use host_core::inertial::earth::Local;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, UG};
use host_core::list::Writer;
use host_core::simulator::imu::{Imu, ImuSpec};
use host_io::recordings::columns::IMU;
use serde::Serialize;
use store::IN_MEMORY;

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
///
/// # Errors
/// A long simulation needs temporary files, and they cannot be written.
pub fn at_rest(spec: &ImuSpec, duration_s: u32, seed: u64) -> Result<Vec<Column>, Error> {
    let here = Local::at(std::f64::consts::FRAC_PI_4, 0.0);
    let dt = 1.0 / f64::from(spec.rate_hz);
    let perfect = Increment {
        dtheta: here.omega_ie() * dt,
        dv: -here.gravity() * dt,
    };
    let lsb = Imu::lsb(spec);
    let mut imu = Imu::new(spec, seed, seed);
    let named = IMU[1..].iter().enumerate();
    let column = |(i, name): (usize, &&str)| Column {
        name: (*name).to_owned(),
        kind: if i < 3 { Kind::Gyro } else { Kind::Accel },
        rate_hz: f64::from(spec.rate_hz),
        scale: if i < 3 { lsb.rad } else { lsb.mps },
        values: Writer::new(IN_MEMORY),
    };
    let mut columns: Vec<Column> = named.map(column).collect();
    for _ in 0..u64::from(duration_s) * u64::from(spec.rate_hz) {
        let (counts, _) = imu.measure(&perfect);
        let counts = counts.dtheta.into_iter().chain(counts.dv);
        for (column, count) in columns.iter_mut().zip(counts) {
            column.values.push(f64::from(count))?;
        }
    }
    Ok(columns)
}

#[cfg(test)]
mod columns_tests;
#[cfg(test)]
mod python_test;
#[cfg(test)]
mod tests;
