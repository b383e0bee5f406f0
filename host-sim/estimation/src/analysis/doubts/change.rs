//! What the files of a recording may say wrongly, as a change of their values.

use host_io::recordings::record::TimedFix;
use nalgebra::{Matrix3, Vector3};

/// For north, east and down: which of the given north, east and down it is, and with which sign.
pub(super) type Order = [(usize, f64); 3];

/// For latitude and longitude: which of the given ones it is, and with which factor.
pub(super) type LatLonOrder = [(usize, f64); 2];

const IDENTITY: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

/// A change of all values of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Change {
    /// Times of the fixes: factor, then what is added, s.
    pub(super) fix_time: [f64; 2],
    pub(super) position: LatLonOrder,
    /// Factor of the heights.
    pub(super) height: f64,
    pub(super) order: Order,
    /// Factor of the velocities.
    pub(super) speed: f64,
    /// Turn and scale the values of gyros and accelerometers.
    pub(super) gyro: Matrix3<f64>,
    pub(super) accel: Matrix3<f64>,
}

impl Change {
    /// Nothing changes.
    pub(super) const NONE: Self = Self {
        fix_time: [1.0, 0.0],
        position: [(0, 1.0), (1, 1.0)],
        height: 1.0,
        order: [(0, 1.0), (1, 1.0), (2, 1.0)],
        speed: 1.0,
        gyro: IDENTITY,
        accel: IDENTITY,
    };

    /// This change after another one.
    pub(super) fn after(&self, first: &Self) -> Self {
        let [factor, offset] = self.fix_time;
        Self {
            fix_time: [
                factor * first.fix_time[0],
                factor * first.fix_time[1] + offset,
            ],
            position: self.position.map(|(of, factor)| {
                let (of, other) = first.position[of];
                (of, factor * other)
            }),
            height: self.height * first.height,
            order: self.order.map(|(of, sign)| {
                let (of, other) = first.order[of];
                (of, sign * other)
            }),
            speed: self.speed * first.speed,
            gyro: self.gyro * first.gyro,
            accel: self.accel * first.accel,
        }
    }

    /// Whether it is one of the clock of the fixes.
    pub(super) fn is_of_clock(&self) -> bool {
        let [factor, offset] = self.fix_time;
        factor != 1.0 || offset != 0.0
    }

    pub(super) fn time(&self, t: f64) -> f64 {
        let [factor, offset] = self.fix_time;
        t * factor + offset
    }

    pub(super) fn rate(&self, rate: &Vector3<f64>) -> Vector3<f64> {
        self.gyro * rate
    }

    pub(super) fn force(&self, force: &Vector3<f64>) -> Vector3<f64> {
        self.accel * force
    }

    pub(super) fn fix(&self, fix: &TimedFix) -> TimedFix {
        let mut sigmas = fix.sigmas;
        for (axis, (of, _)) in self.order.iter().enumerate() {
            sigmas[3 + axis] = fix.sigmas[3 + of];
        }
        let given = [fix.lat_deg, fix.lon_deg];
        let [lat_deg, lon_deg] = self.position.map(|(of, factor)| given[of] * factor);
        TimedFix {
            time: self.time(fix.time),
            lat_deg,
            lon_deg,
            height_m: fix.height_m * self.height,
            velocity: self
                .order
                .map(|(of, sign)| fix.velocity[of] * sign * self.speed),
            sigmas,
        }
    }
}
