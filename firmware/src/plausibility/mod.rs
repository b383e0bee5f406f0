//! Compares the configuration of the sensor with what the device measures.
//!
//! A wrong rate, unit, range or mounting makes every correction wrong by the same factor and
//! teaches the learner nonsense, and nothing in the frames shows it. Three things outside the
//! sensor do: the board's clock ([`rate`]), gravity, and the rotation of the Earth ([`rest`]). The
//! application steps aside while one of them disagrees.
//!
//! This module holds the rules only. It gets block means, counters, speeds and times, and returns
//! bits of [`fault`]. The desktop uses the same rules to warn about a recording.

pub mod holes;
pub mod rate;
pub mod rest;

use crate::configuration::{Configuration, Triad, VehicleKind};
use crate::units::{DEGREE, G};
use crate::wire::command::fault;
use holes::HoleWatch;
use libm::sqrtf;
use rate::RateWatch;
use rest::RestCheck;

/// The faults that a device steps aside for: it corrects nothing and learns nothing.
pub const ASIDE: u32 = fault::RATE | AT_REST;
/// Faults that are judged at rest.
pub const AT_REST: u32 = fault::GRAVITY | fault::EARTH_RATE | fault::AXES;

/// Rotation of the Earth, rad/s (WGS 84).
pub const EARTH: f32 = 7.292_115e-5;
/// Distance of the specific force at rest from gravity that is always allowed, as a share.
pub const FORCE_SHARE: f32 = 0.05;
/// A deviation of so many standard deviations is not explained by the datasheet.
const SIGMAS: f32 = 5.0;
/// Cosine of the largest tilt of a vehicle at rest, 30 degrees: a slope of 58 %.
const TILT: f32 = 0.866;
/// Most by which the attitude changes while the specific force is steady ([`rest`]), rad.
const SWAY: f32 = rest::STEADY;
/// A ship at anchor swings, and the receiver calls it at rest: so much rate is allowed, rad/s.
const SWING: f32 = 0.5 * DEGREE as f32;

/// Values that the checks expect of the unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Compare the samples' rate with the clock.
    pub check_rate: bool,
    /// Direction of the specific force at rest, which points up, in sensor axes; length 1. Zero
    /// where the mounting is unknown: then nothing is said of the axes.
    pub up: [f32; 3],
    /// Kind of the vehicle.
    pub vehicle: VehicleKind,
    /// Gyros, as in [`Configuration`].
    pub gyro: Triad,
    /// Accelerometers likewise.
    pub accel: Triad,
}

impl Expected {
    /// Values expected by a configuration.
    #[must_use]
    pub fn of(configuration: &Configuration) -> Expected {
        Expected {
            check_rate: configuration.correction.check_rate,
            up: configuration.direction([0.0, 0.0, -1.0]),
            vehicle: configuration.vehicle.kind,
            gyro: configuration.gyro,
            accel: configuration.accel,
        }
    }

    /// Largest distance of the specific force at rest from gravity, as a share: [`FORCE_SHARE`], or
    /// what bias and scale factor of the datasheet explain if that is more.
    #[must_use]
    pub fn force_share(&self) -> f32 {
        let Triad {
            bias_turn_on,
            bias_in_run,
            scale,
            ..
        } = self.accel;
        let sheet = SIGMAS * ((bias_turn_on + bias_in_run) / G as f32 + scale);
        sheet.clamp(FORCE_SHARE, 0.5)
    }

    /// Largest error of a gyro axis at rest, averaged over `seconds`, rad/s.
    #[must_use]
    pub fn rate_error(&self, seconds: f32) -> f32 {
        let Triad {
            bias_turn_on,
            bias_in_run,
            white_noise,
            g_sensitivity,
            ..
        } = self.gyro;
        let noise = white_noise / sqrtf(seconds);
        SIGMAS * (bias_turn_on + bias_in_run + g_sensitivity * G as f32 + noise)
    }
}

/// Means of the samples over a time at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Means {
    /// Length of the mean, s, > 0.
    pub seconds: f32,
    /// Rate, rad/s.
    pub rate: [f32; 3],
    /// Standard deviation of the mean rate by the scatter of the blocks, rad/s.
    pub scatter: [f32; 3],
    /// Specific force, m/s2.
    pub force: [f32; 3],
}

impl Means {
    /// What disagrees with physics: bits of [`fault`], of [`AT_REST`].
    ///
    /// A triad that reads exactly zero is not there and is not judged.
    #[must_use]
    pub fn judge(&self, expected: &Expected) -> u32 {
        let size = norm(self.force);
        let mut faults = 0;
        if size > 0.0 {
            if (size / G as f32 - 1.0).abs() > expected.force_share() {
                faults |= fault::GRAVITY;
            }
            let along: f32 = self
                .force
                .iter()
                .zip(&expected.up)
                .map(|(f, u)| f * u)
                .sum();
            if expected.up != [0.0; 3] && along < TILT * size {
                faults |= fault::AXES;
            }
        }
        if norm(self.rate) > 0.0 && (self.turns(expected) || self.is_too_still(expected)) {
            faults |= fault::EARTH_RATE;
        }
        faults
    }

    /// More rate than the Earth, the datasheet and the sway of the vehicle explain.
    fn turns(&self, expected: &Expected) -> bool {
        let swing = match expected.vehicle {
            VehicleKind::Ship => SWING,
            VehicleKind::Land | VehicleKind::Air => 0.0,
        };
        let most = EARTH + expected.rate_error(self.seconds) + SWAY / self.seconds + swing;
        let axes = self.rate.iter().zip(&self.scatter);
        axes.fold(false, |any, (rate, scatter)| {
            any | (rate.abs() > most + scatter)
        })
    }

    /// Less rate than the Earth's. Only gyros whose bias does not hide the Earth can show it, and
    /// only if all three are there.
    fn is_too_still(&self, expected: &Expected) -> bool {
        let least = EARTH - expected.rate_error(self.seconds);
        expected.vehicle != VehicleKind::Ship
            && !self.rate.contains(&0.0)
            && norm(self.rate) + norm(self.scatter) < least
    }
}

/// Length of a vector.
fn norm([x, y, z]: [f32; 3]) -> f32 {
    sqrtf(x * x + y * y + z * z)
}

/// All checks of a device.
#[derive(Debug)]
pub struct Plausibility {
    /// The rate.
    pub rate: RateWatch,
    /// Frames that are missing without a trace.
    pub holes: HoleWatch,
    /// Check of the measurements at rest; `None` without a configuration.
    pub rest: Option<RestCheck>,
}

impl Plausibility {
    /// With the values expected by the configuration; `None`: no fault is ever raised.
    #[must_use]
    pub fn new(expected: Option<Expected>) -> Plausibility {
        Plausibility {
            rate: RateWatch::new(expected.is_some_and(|expected| expected.check_rate)),
            holes: HoleWatch::new(expected.is_some_and(|expected| expected.check_rate)),
            rest: expected.map(RestCheck::new),
        }
    }
}

#[cfg(test)]
mod tests;
