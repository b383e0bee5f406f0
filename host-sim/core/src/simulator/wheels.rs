//! Speed by the wheels of a simulated vehicle.
//!
//! The axle is where the IMU is. Its wheels slip in proportion to the acceleration, as tyres do
//! below their limit; they lock or spin in spells; and a vehicle's bus may report the speed without
//! its sign.

use crate::inertial::session::EPOCH_S;
use crate::inertial::sins::NavState;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::Deserialize;

/// Errors of the reported speed. Table `[wheels]` of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WheelSpec {
    /// Error of the scale: circumference, pressure, percent, -20 to 20.
    pub scale_percent: f64,
    /// White noise of a reported speed, m/s, 0 to 10.
    pub noise_mps: f64,
    /// Resolution of a reported speed, m/s, 0 to 10.
    pub resolution_mps: f64,
    /// Slower wheels are reported as standing, m/s, 0 to 10.
    pub least_mps: f64,
    /// Slip, percent for each m/s2 of acceleration along the vehicle, 0 to 10.
    pub slip_percent: f64,
    /// Spells in an hour in which wheels lock (braking) or spin by a half (else), 0 to 3600.
    pub spells_per_h: f64,
    /// Length of a spell, s, 1 to 60.
    pub spell_s: f64,
    /// The sign of the speed is lost: reverse counts as forward.
    pub unsigned: bool,
}

impl Default for WheelSpec {
    /// A passenger car's bus (assumed).
    fn default() -> Self {
        Self {
            scale_percent: 1.0,
            noise_mps: 0.02,
            resolution_mps: 0.02,
            least_mps: 0.1,
            slip_percent: 0.5,
            spells_per_h: 0.0,
            spell_s: 1.0,
            unsigned: false,
        }
    }
}

impl WheelSpec {
    /// The reported speed at each epoch, m/s.
    pub fn speeds(&self, truth: &[NavState], rng: &mut impl Rng) -> Vec<f64> {
        let forward = |state: &NavState| (state.q_bn.inverse() * state.velocity).x;
        let mut spell: Option<(f64, f64)> = None;
        let mut before = truth.first().map_or(0.0, forward);
        let mut report = |state: &NavState| {
            let speed = forward(state);
            let acceleration = (speed - before) / EPOCH_S;
            before = speed;
            if rng.random::<f64>() < self.spells_per_h * EPOCH_S / 3600.0 {
                let factor = if acceleration < 0.0 { 0.0 } else { 1.5 };
                spell = Some((factor, self.spell_s));
            }
            let factor = spell.map_or(1.0, |(factor, _)| factor);
            spell = spell
                .map(|(factor, left)| (factor, left - EPOCH_S))
                .filter(|(_, left)| *left > 0.0);
            let slip = 1.0 + 0.01 * (self.slip_percent * acceleration + self.scale_percent);
            let noise: f64 = StandardNormal.sample(rng);
            let turns = speed * slip * factor;
            if turns.abs() < self.least_mps {
                return 0.0;
            }
            let reported = turns + self.noise_mps * noise;
            let reported = match self.resolution_mps {
                step if step > 0.0 => (reported / step).round() * step,
                _ => reported,
            };
            if self.unsigned {
                reported.abs()
            } else {
                reported
            }
        };
        truth.iter().map(&mut report).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use nalgebra::{UnitQuaternion, Vector3};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn drive(speeds: &[f64]) -> Vec<NavState> {
        let q_bn = UnitQuaternion::from_euler_angles(0.0, 0.1, 0.7);
        let state = |v: &f64| NavState {
            velocity: q_bn * Vector3::new(*v, 0.0, 0.0),
            q_bn,
            position: Geodetic {
                lat: 0.5,
                lon: 0.1,
                h: 50.0,
            },
        };
        speeds.iter().map(state).collect()
    }

    #[test]
    fn wheels_slip_lock_and_lose_their_sign() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let exact = WheelSpec {
            scale_percent: 2.0,
            noise_mps: 0.0,
            resolution_mps: 0.0,
            slip_percent: 1.0,
            ..WheelSpec::default()
        };
        let near = |a: Vec<f64>, b: &[f64]| {
            assert!(
                a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9),
                "{a:?} {b:?}"
            );
        };
        let truth = drive(&[0.0, 0.05, 10.0, 10.0, -3.0, -3.0]);
        let slips = [0.0, 0.0, 10.0 * 1.1195, 10.2, -3.0 * 0.89, -3.06];
        near(exact.speeds(&truth, &mut rng), &slips);
        let unsigned = WheelSpec {
            unsigned: true,
            ..exact
        };
        near(unsigned.speeds(&truth, &mut rng), &slips.map(f64::abs));
        // brakes: locked for three seconds
        let always = WheelSpec {
            spells_per_h: 3600.0,
            ..exact
        };
        let truth = drive(&[10.0, 8.0, 9.0]);
        near(
            always.speeds(&truth, &mut rng),
            &[15.3, 0.0, 9.0 * 1.03 * 1.5],
        );
    }
}
