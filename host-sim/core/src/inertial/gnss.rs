//! A fix of a GNSS receiver.

use crate::inertial::earth::Geodetic;
use nalgebra::Vector3;
use std::ops::Range;

/// Standard deviation of a value that a fix does not have. A filter gives it no weight.
pub const NOT_MEASURED: f64 = f64::INFINITY;
/// Standard deviations of a start where a fix has no value of its own (assumed): m, m/s.
const UNKNOWN: [f64; 2] = [10.0, 1.0];

/// One fix, and its age at the epoch that uses it. It may lack any of its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Position of the antenna.
    pub position: Geodetic,
    /// Its velocity, NED, m/s.
    pub velocity: Vector3<f64>,
    /// Standard deviations: position north, east, down, m, then velocity, m/s; each above 0, and
    /// [`NOT_MEASURED`] for a value that was not measured.
    pub sigmas: [f64; 6],
    /// Time from the validity of the fix to its epoch, s. Negative: shortly after it.
    pub age_s: f64,
}

impl Fix {
    /// A fix that was valid at its epoch.
    #[must_use]
    pub fn new(position: Geodetic, velocity: Vector3<f64>, sigmas: [f64; 6]) -> Self {
        Self {
            position,
            velocity,
            sigmas,
            age_s: 0.0,
        }
    }

    /// Whether all these values (0 to 2 position, 3 to 5 velocity) are measured.
    #[must_use]
    pub fn has(&self, values: Range<usize>) -> bool {
        has(&self.sigmas, values)
    }

    /// Standard deviations of a start from this fix. Values that it lacks have wide ones.
    #[must_use]
    pub fn start_sigmas(&self) -> [f64; 6] {
        let sigma = |i: usize| match self.sigmas[i] {
            sigma if sigma.is_finite() => sigma,
            _ => UNKNOWN[i / 3],
        };
        std::array::from_fn(sigma)
    }
}

/// Whether all these values are measured, by their standard deviations.
#[must_use]
pub fn has(sigmas: &[f64; 6], values: Range<usize>) -> bool {
    let mut these = sigmas.get(values).unwrap_or_default().iter();
    these.all(|sigma| sigma.is_finite())
}
