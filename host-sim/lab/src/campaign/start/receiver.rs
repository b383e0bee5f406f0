//! The receiver of a trial: fixes of the antenna at any rate, with a delay.

use firmware::fix::{Fix, NOT_MEASURED, Position};
use host_core::inertial::sins::NavState;
use host_core::simulator::gnss::{GnssSpec, antenna};
use host_core::simulator::truth::Truth;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// Parameters of the receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// Fixes a second.
    pub rate_hz: u32,
    /// Delay from validity to arrival, s. `None`: as configured in the unit.
    pub delay_s: Option<f64>,
    /// Lever arm from the IMU to the antenna, forward, right, down, m. `None`: as configured in the
    /// unit.
    pub lever_arm: Option<[f64; 3]>,
    /// Whether the fixes lack the vertical velocity.
    pub horizontal_velocity: bool,
    /// Whether the fixes lack all of the velocity.
    pub positions_only: bool,
    /// Noise.
    pub noise: GnssSpec,
}

impl Default for Receiver {
    fn default() -> Self {
        Self {
            rate_hz: 1,
            delay_s: None,
            lever_arm: None,
            horizontal_velocity: false,
            positions_only: false,
            noise: GnssSpec::default(),
        }
    }
}

/// Position and velocity of the antenna at an epoch.
fn at_epoch(truth: &Truth, epoch: usize, arm: &Vector3<f64>) -> NavState {
    let sample = (epoch * truth.samples_per_epoch) as f64;
    antenna(truth, &truth.epochs[epoch], sample, arm)
}

/// A fix, and when it arrives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) fix: Fix,
    /// Sample after which it arrives.
    pub(super) sample: usize,
}

/// All fixes of a journey in the order of arrival: at every epoch but the first.
pub(super) fn fixes(
    receiver: &Receiver,
    [delay_s, arm @ ..]: [f64; 4],
    truth: &Truth,
    rng: &mut ChaCha8Rng,
) -> Vec<Sent> {
    let arm = Vector3::from(arm);
    let late = (delay_s / truth.dt).round() as usize;
    let epoch_ms = 1000.0 * truth.samples_per_epoch as f64 * truth.dt;
    let fix = |epoch: usize| {
        let measured = receiver.noise.fix(&at_epoch(truth, epoch, &arm), rng);
        let mut sigmas = receiver.noise.sigmas().map(|sigma| sigma as f32);
        let mut velocity: [f64; 3] = measured.velocity.into();
        if receiver.horizontal_velocity {
            (sigmas[5], velocity[2]) = (NOT_MEASURED, 0.0);
        }
        if receiver.positions_only {
            sigmas[3..].fill(NOT_MEASURED);
            velocity.fill(0.0);
        }
        let sample = epoch * truth.samples_per_epoch + late;
        let time_ms = (epoch as f64 * epoch_ms).round() as u32;
        Sent {
            fix: Fix {
                position: Position {
                    latitude: measured.position.lat,
                    longitude: measured.position.lon,
                    height: measured.position.h,
                },
                velocity,
                sigmas,
                time_ms,
                arrived_us: (sample as f64 * truth.dt * 1e6).round() as u64,
                ..Fix::EMPTY
            },
            sample,
        }
    };
    (1..truth.epochs.len()).map(fix).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::earth::Geodetic;
    use host_core::simulator::truth::{Journey, Vehicle};
    use rand::SeedableRng;

    /// The antenna's velocity is the derivative of its position, in a turning vehicle too.
    #[test]
    fn the_antenna_moves_as_its_positions_do() {
        let journey = Journey {
            start: Geodetic {
                lat: 0.8,
                lon: 0.1,
                h: 100.0,
            },
            heading: 1.0,
            standstill_s: 0.0,
            drive_s: 120.0,
            segments: None,
            vibration: 0.0,
            dt: 0.01,
            epochs_per_s: 100,
        };
        let city = Vehicle::City(host_core::simulator::truth::City::default());
        let truth = city.truth(&journey, &mut ChaCha8Rng::seed_from_u64(1));
        let arm = Vector3::new(2.0, -1.0, -1.5);
        let mut differs = 0.0_f64;
        for k in 1..truth.epochs.len() - 1 {
            let [before, now, after] = [k - 1, k, k + 1].map(|k| at_epoch(&truth, k, &arm));
            let moved = after.position.ned_from(&before.position) / 0.02;
            assert!((moved - now.velocity).norm() < 5e-3, "{k}");
            differs = differs.max((now.velocity - truth.epochs[k].velocity).norm());
        }
        assert!(differs > 0.5, "{differs}");
    }
}
