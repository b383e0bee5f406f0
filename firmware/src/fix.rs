//! A fix of a satellite receiver: position and velocity with their accuracy, and when they were
//! valid.

use core::f64::consts::PI;
use serde::{Deserialize, Serialize};

/// Values that a fix observes: position (north, east, down, m), then velocity (m/s).
pub const OBSERVATIONS: usize = 6;

/// Geodetic position on the WGS-84 ellipsoid.
///
/// One unit in the last place of an f64 longitude is 3 nm. Even if each of the 1.7 million
/// navigation steps of 24 h rounded the same way, that would amount to 2.5 mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Position {
    /// Latitude, rad, positive north.
    pub latitude: f64,
    /// Longitude, rad, positive east, -pi to pi.
    pub longitude: f64,
    /// Ellipsoidal height, m.
    pub height: f64,
}

impl Position {
    /// Whether the angles are in their ranges and the height is between -10 and 100 km.
    #[must_use]
    #[inline(never)]
    pub fn is_plausible(&self) -> bool {
        self.latitude.abs() <= PI / 2.0
            && self.longitude.abs() <= PI
            && (-1e4..=1e5).contains(&self.height)
    }
}

/// A GPS week, ms.
pub const WEEK_MS: u32 = 604_800_000;

/// Time from one time of the week to a later one, ms: less than a week, whether one ends in between
/// or not.
#[must_use]
pub fn ms_since(then_ms: u32, now_ms: u32) -> u32 {
    let [then, now] = [then_ms, now_ms].map(|ms| ms % WEEK_MS);
    (WEEK_MS - then + now) % WEEK_MS
}

/// Standard deviation of a value that a receiver does not measure, or whose accuracy it does not
/// give.
pub const NOT_MEASURED: f32 = f32::INFINITY;

/// A fix that the receiver vouches for. It may lack any of its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Position.
    pub position: Position,
    /// Velocity over ground, north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Standard deviations along an axis, in the order of [`OBSERVATIONS`], > 0; [`NOT_MEASURED`]
    /// for a value that means nothing.
    pub sigmas: [f32; OBSERVATIONS],
    /// Heading of the vehicle by two antennas.
    pub heading: Option<Heading>,
    /// Time of validity, ms of the GPS week.
    pub time_ms: u32,
    /// Arrival of the first byte of its first message, by the board's clock, microseconds.
    pub arrived_us: u64,
    /// Samples of the sensor that came after that byte and before the fix was complete. Its age is
    /// counted from the arrival, and this is added.
    pub waited: u32,
    /// Its age at the last sample before it was complete, s, by the receiver's time pulse: exact,
    /// whatever delay is configured. `None` without a pulse.
    pub age: Option<f32>,
}

/// Direction of the vehicle's forward axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Heading {
    /// Clockwise from true north, rad.
    pub angle: f32,
    /// Standard deviation of the heading, rad, > 0.
    pub sigma: f32,
}

impl Fix {
    /// Nothing is measured.
    pub const EMPTY: Fix = Fix {
        position: Position {
            latitude: 0.0,
            longitude: 0.0,
            height: 0.0,
        },
        velocity: [0.0; 3],
        sigmas: [NOT_MEASURED; OBSERVATIONS],
        heading: None,
        time_ms: 0,
        arrived_us: 0,
        waited: 0,
        age: None,
    };

    /// Speed and the standard deviation of an axis, m/s, if all of the velocity is measured.
    #[must_use]
    pub fn speed(&self) -> Option<(f32, f32)> {
        let [n, e, d] = self.velocity.map(|v| v as f32);
        let [.., sigma_n, sigma_e, sigma_d] = self.sigmas;
        let speed = libm::sqrtf(n * n + e * e + d * d);
        let sigma = sigma_n.max(sigma_e).max(sigma_d);
        self.has(3..6).then_some((speed, sigma))
    }

    /// The fix of a vehicle that stands: its velocity is zero, with this standard deviation, m/s.
    #[must_use]
    pub fn at_rest(&self, sigma: f32) -> Fix {
        let mut fix = *self;
        fix.velocity = [0.0; 3];
        let [.., x, y, z] = &mut fix.sigmas;
        [*x, *y, *z] = [sigma; 3];
        fix
    }

    /// Whether all of these values are measured.
    #[must_use]
    pub fn has(&self, values: core::ops::Range<usize>) -> bool {
        let mut sigmas = self.sigmas.get(values).unwrap_or_default().iter();
        sigmas.all(|sigma| sigma.is_finite())
    }
}
