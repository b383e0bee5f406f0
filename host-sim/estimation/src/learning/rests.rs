//! How well the device finds rests from its samples alone: its own detector against a known speed.

use firmware::align::Align;
use firmware::learn::Settings;
use firmware::sample::{Counts, Lsb};
use host_core::inertial::sins::NavState;
use serde::{Deserialize, Serialize};

/// A vehicle stands if it moves slower than this, m/s, and turns less than this in a second, rad.
const STANDS_MPS: f64 = 0.1;
const STANDS_RAD: f64 = 0.01;
/// It is under way above this speed, m/s.
const UNDER_WAY_MPS: f64 = 1.0;

/// Seconds in which the vehicle stood or was under way, and in which the device saw a rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Rests {
    /// Seconds at whose beginning and end the vehicle stood.
    pub standing_s: u32,
    /// Seconds of [`Self::standing_s`] in which the device detected a rest.
    pub found_s: u32,
    /// Seconds in which the vehicle was under way.
    pub moving_s: u32,
    /// Seconds of [`Self::moving_s`] in which the device detected a rest.
    pub false_s: u32,
}

impl Rests {
    /// Share of the standing time that was found; `None`: it never stood.
    #[must_use]
    pub fn found(&self) -> Option<f64> {
        (self.standing_s > 0).then(|| f64::from(self.found_s) / f64::from(self.standing_s))
    }

    /// Seconds of a minute under way that were taken for a rest; `None`: it was never under way.
    #[must_use]
    pub fn false_per_minute(&self) -> Option<f64> {
        (self.moving_s > 0).then(|| 60.0 * f64::from(self.false_s) / f64::from(self.moving_s))
    }

    /// The sums of two such counts.
    #[must_use]
    pub fn and(self, other: &Self) -> Self {
        Self {
            standing_s: self.standing_s + other.standing_s,
            found_s: self.found_s + other.found_s,
            moving_s: self.moving_s + other.moving_s,
            false_s: self.false_s + other.false_s,
        }
    }
}

/// The device's detector without a receiver, and what it has found.
pub struct Detector {
    align: Align,
    before: Option<NavState>,
    rests: Rests,
    /// The speed of the wheels is reported once a second.
    wheels: bool,
}

impl Detector {
    /// For samples of this count value, one every `dt` seconds.
    #[must_use]
    pub fn new(settings: &Settings, lsb: Lsb, dt: f64) -> Self {
        Self {
            align: Align::new(settings.sensors(), lsb, dt),
            before: None,
            rests: Rests::default(),
            wheels: false,
        }
    }

    /// The same with wheels whose speed is reported once a second, and which stand below
    /// 0.1 m/s.
    #[must_use]
    pub fn with_wheels(settings: &Settings, lsb: Lsb, dt: f64) -> Self {
        Self {
            wheels: true,
            ..Self::new(settings, lsb, dt)
        }
    }

    /// A sample.
    pub fn sample(&mut self, counts: &Counts) {
        self.align.sample(counts);
    }

    /// A second is over, at the end of which this is the vehicle's true state.
    pub fn second(&mut self, truth: &NavState) {
        if self.wheels {
            self.align.wheels(truth.velocity.norm() < STANDS_MPS);
        }
        let Some(before) = self.before.replace(*truth) else {
            return;
        };
        let speeds = [before.velocity.norm(), truth.velocity.norm()];
        let turn = before.q_bn.angle_to(&truth.q_bn);
        let [slower, faster] = [speeds[0].min(speeds[1]), speeds[0].max(speeds[1])];
        let rests = self.align.rest().is_some();
        let of = &mut self.rests;
        if faster < STANDS_MPS && turn < STANDS_RAD {
            of.standing_s += 1;
            of.found_s += u32::from(rests);
        } else if slower > UNDER_WAY_MPS {
            of.moving_s += 1;
            of.false_s += u32::from(rests);
        }
    }

    /// What it has found so far.
    #[must_use]
    pub fn rests(&self) -> Rests {
        self.rests
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::earth::Geodetic;
    use nalgebra::{UnitQuaternion, Vector3};

    #[test]
    fn seconds_are_counted_by_the_speed_at_both_ends() {
        let lsb = Lsb {
            rad: 1e-8,
            mps: 1e-6,
        };
        let mut detector = Detector::new(&Settings::MEDIUM, lsb, 0.01);
        let state = NavState {
            position: Geodetic {
                lat: 0.8,
                lon: 0.1,
                h: 0.0,
            },
            velocity: Vector3::zeros(),
            q_bn: UnitQuaternion::identity(),
        };
        let mut seconds = |speeds: &[f64]| {
            for mps in speeds {
                for _ in 0..100 {
                    detector.sample(&Counts {
                        dtheta: [0; 3],
                        dv: [0, 0, -98_070],
                    });
                }
                detector.second(&NavState {
                    velocity: Vector3::new(*mps, 0.0, 0.0),
                    ..state
                });
            }
            detector.rests()
        };
        let stands = seconds(&[0.0; 5]);
        assert_eq!(
            (stands.standing_s, stands.found_s, stands.moving_s),
            (4, 4, 0)
        );
        // it looks the same to the sensors
        let cruises = seconds(&[0.5, 2.0, 2.0, 2.0]);
        assert_eq!((cruises.moving_s, cruises.false_s), (2, 2));
        assert_eq!(
            (cruises.found(), cruises.false_per_minute()),
            (Some(1.0), Some(60.0))
        );
        assert_eq!(Rests::default().found(), None);
        assert_eq!(cruises.and(&stands).standing_s, 8);
    }
}
