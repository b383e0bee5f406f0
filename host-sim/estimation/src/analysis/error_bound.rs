//! The error bound of a session: the largest change of a free-inertial position by corrections
//! within their limits.

use firmware::compensator::Limit;
use firmware::error_bound::{ErrorBound, LATITUDE, TIMES_S};
use host_core::inertial::session::Session;
use host_core::inertial::units::{DEG_PER_H, UG};

/// The worst effect, in this session, of corrections by the device within its limit, and a sentence
/// that states it.
#[must_use]
pub fn error_bound(session: &Session, limit: Limit) -> (ErrorBound, String) {
    let speed = session.reference.iter().map(|s| s.velocity.xy().norm());
    let begins = session.reference.first();
    let bound = ErrorBound {
        limit,
        speed: speed.fold(0.0, f64::max) as f32,
        latitude: begins.map_or(LATITUDE, |state| state.position.lat),
        words: 1.0, // every sample of a recording arrives once
    };
    let most = bound.table().into_iter().zip(TIMES_S);
    let most: Vec<String> = most
        .map(|(metres, t)| format!("{} within {} min", length(metres), t / 60))
        .collect();
    let text = format!(
        "corrections within their limits of {:.3} deg/h and {:.0} ug, whatever the networks say, \
         add to a position at most {} of an alignment with them",
        f64::from(bound.limit.gyro) / DEG_PER_H,
        f64::from(bound.limit.accel) / UG,
        most.join(", ")
    );
    (bound, text)
}

/// A length in words.
fn length(metres: u32) -> String {
    match metres {
        m if m < 10_000 => format!("{m} m"),
        m => format!("{} km", m.div_ceil(1000)),
    }
}

#[cfg(test)]
mod search;

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::free_inertial::free_inertial;
    use host_core::inertial::sins::Increment;
    use host_core::simulator::imu::ErrorModelName;
    use host_core::simulator::session::{SessionConfig, simulate};
    use host_unit::scenario::Scenario;
    use nalgebra::Vector3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The part of the bound without the alignment. Perfect sensors with corrections of a limit's
    /// size on every axis: constant in the body,
    /// constant over the ground (where turns do not average them out), reversed at random times.
    /// None may reach the bound, and the worst must come near it, or the bound would be useless.
    #[test]
    fn no_correction_within_the_limits_passes_the_bound() {
        let scenario = Scenario::default();
        let mut imu = scenario.imu_spec();
        imu.rate_hz = 20;
        let spec = imu.error_model(ErrorModelName::Noise);
        let config = SessionConfig {
            imu: &spec,
            gnss: &scenario.gnss,
            start: scenario.start(),
            heading: 1.0,
            standstill_s: 10.0,
            drive_s: 1330.0,
            segments: None,
            vibration: scenario.vibration,
            unit: 1,
            turn_on: 1,
            drive: 1,
        };
        let session = simulate(&config).0;
        let limit = scenario.unit().configuration().unwrap().correction.limit;
        let (bound, _) = error_bound(&session, limit);
        let limit = [bound.limit.gyro, bound.limit.accel].map(f64::from);
        let increments = session.increments();
        let n = session.steps_per_epoch();
        let free = |increments: &[Increment]| {
            free_inertial(&session, &increments, session.reference[0], 0, 1330)
        };
        let plain = free(&increments);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut nearest = [0.0f64; 5];
        for trial in 0..24 {
            let mut sign = || if rng.random() { 1.0 } else { -1.0 };
            let [g, a] = limit.map(|l| Vector3::new(sign(), sign(), sign()) * l * session.step_s());
            let flip = rng.random_range(0..2000);
            let pushed: Vec<Increment> = increments
                .iter()
                .enumerate()
                .map(|(k, w)| {
                    let q = session.reference[(k / n).min(1330)].q_bn;
                    // every component of a vector of this length is within the limit
                    let ground = |v: Vector3<f64>, l: f64| {
                        let v = q.inverse() * v;
                        v * (l * session.step_s() / v.amax())
                    };
                    let (g, a) = match trial % 3 {
                        0 => (g, a),
                        1 => (ground(g, limit[0]), ground(a, limit[1])),
                        _ if k / n < flip => (g, a),
                        _ => (-g, -a),
                    };
                    Increment {
                        dtheta: w.dtheta + g,
                        dv: w.dv + a,
                    }
                })
                .collect();
            let got = free(&pushed);
            for (nearest, t) in nearest.iter_mut().zip(TIMES_S) {
                let apart = (got.position[t as usize] - plain.position[t as usize]).xy();
                *nearest = nearest.max(apart.norm() / bound.unaligned(f64::from(t)));
            }
        }
        println!("share of the bound that was reached: {nearest:.2?}");
        assert!(
            nearest.iter().all(|&share| share < 1.0 && share > 0.5),
            "{nearest:?}"
        );
    }
}
