//! A session's fixes for a filter, with the position and time of their validity.
//!
//! A filter processes the fix of an epoch at the end of that epoch. A fix that was valid earlier,
//! or at an antenna that is not at the IMU, is moved to the IMU and to that time by the filter's
//! own attitude, rate and motion. So the innovation is that at the fix's own time and position, and
//! only the navigator's error is taken as constant over the age of the fix, at most one epoch. The
//! device's learner does the same.

use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{Aided, Record};
use host_core::inertial::gnss::{Fix, NOT_MEASURED};
use host_core::inertial::motion::Motion;
use host_core::inertial::session::{EPOCH_S, Session, Start, to_si};
use host_core::inertial::sins::NavState;
use nalgebra::Vector3;

/// Standard deviation of the velocity of a vehicle that is known to stand, m/s: people and wind
/// sway it (assumed).
pub const ZERO_VELOCITY_MPS: f64 = 0.01;
/// Time over which the rate at a fix is averaged, s.
const RATE_S: f64 = 0.05;

/// The fix of an epoch. While the vehicle is known to stand, its velocity is zero, whatever the
/// receiver measures.
#[must_use]
pub fn fix_at(session: &Session, epoch: usize) -> Option<Fix> {
    let fix = session.fixes.get(epoch).copied().flatten();
    if epoch >= session.standstill {
        return fix;
    }
    let nothing = || {
        let site = session.nearest_fix(epoch).position;
        Fix::new(site, Vector3::zeros(), [NOT_MEASURED; 6])
    };
    let mut fix = fix.unwrap_or_else(nothing);
    fix.velocity = Vector3::zeros();
    fix.sigmas[3..].fill(ZERO_VELOCITY_MPS);
    Some(fix)
}

/// An epoch that a filter has processed.
#[derive(Debug)]
pub(crate) enum Passed {
    /// An epoch with the fix at its end, as measured by a receiver at the IMU at that time.
    Epoch(Option<Fix>),
    /// An epoch without samples.
    Outage(Record),
}

/// Processes epoch `k` in the filter. `fix` is that of the epoch's end.
pub(crate) fn pass(
    filter: &mut Aided,
    session: &Session,
    increments: &dyn Motion,
    k: usize,
    fix: Option<Fix>,
) -> Passed {
    if let Some(outage) = session.outage(k) {
        let Start { nav, sigma } = &outage.resume;
        return Passed::Outage(filter.lose(EPOCH_S, *nav, sigma));
    }
    Passed::Epoch(approach(filter, session, increments, k, fix))
}

/// Processes the increments of epoch `k` in the filter.
fn approach(
    filter: &mut Aided,
    session: &Session,
    increments: &dyn Motion,
    k: usize,
    fix: Option<Fix>,
) -> Option<Fix> {
    let n = session.steps_per_epoch();
    let epoch = increments.epoch(k, n);
    let moved = fix.filter(|fix| fix.age_s != 0.0 || session.lever_arm != Vector3::zeros());
    let Some(fix) = moved else {
        epoch.iter().for_each(|w| filter.step(w, session.step_s()));
        return fix;
    };
    let share = (1.0 - fix.age_s / EPOCH_S) * n as f64;
    let at = (share.max(0.0) as usize).min(n - 1);
    let mut around = [filter.sins.nav; 2];
    for (step, increment) in epoch.iter().enumerate() {
        if step == at {
            around[0] = filter.sins.nav;
        }
        filter.step(increment, session.step_s());
        if step == at {
            around[1] = filter.sins.nav;
        }
    }
    let then = between(&around, share - at as f64);
    let half = (0.5 * RATE_S / session.step_s()) as usize;
    let near = &epoch[at.saturating_sub(half)..(at + half + 1).min(n)];
    let turned: Vector3<f64> = near.iter().map(|w| w.dtheta).sum();
    let rate = turned / (near.len() as f64 * session.step_s());
    Some(at_the_imu(fix, session, (&then, &rate), &filter.sins.nav))
}

/// The state at a share of the step between two states. Shares above 1 extrapolate.
fn between([a, b]: &[NavState; 2], share: f64) -> NavState {
    let mix = |x: f64, y: f64| x + (y - x) * share;
    NavState {
        position: Geodetic {
            lat: mix(a.position.lat, b.position.lat),
            lon: mix(a.position.lon, b.position.lon),
            h: mix(a.position.h, b.position.h),
        },
        velocity: a.velocity.lerp(&b.velocity, share),
        q_bn: b.q_bn,
    }
}

/// A fix of the antenna at the time of `then`, moved to the IMU at the time of `now`. `rate`: that
/// of the body, rad/s. A known velocity of the vehicle is already that of the IMU.
fn at_the_imu(
    mut fix: Fix,
    session: &Session,
    (then, rate): (&NavState, &Vector3<f64>),
    now: &NavState,
) -> Fix {
    let arm = &session.lever_arm;
    let moved = now.position.ned_from(&then.position) - then.q_bn * arm;
    fix.position = fix.position.displaced(&moved);
    if fix.velocity != Vector3::zeros() {
        fix.velocity += now.velocity - then.velocity - then.q_bn * rate.cross(arm);
    }
    fix.age_s = 0.0;
    fix
}

/// Variance of the samples of a second, the one before and the one after it, of both triads.
#[must_use]
pub fn roughness(session: &Session, second: usize) -> [f64; 2] {
    let n = session.samples_per_epoch();
    let around = second.saturating_sub(1) * n..((second + 2) * n).min(session.counts.len());
    let around = session.counts.block(around);
    let si: Vec<_> = around.iter().map(|c| to_si(c, &session.lsb)).collect();
    let dtheta = variance(si.iter().map(|w| w.dtheta));
    [dtheta, variance(si.iter().map(|w| w.dv))]
}

/// Mean square of the distance from the mean.
fn variance(of: impl Iterator<Item = Vector3<f64>> + Clone) -> f64 {
    let n = of.clone().count() as f64;
    let mean = of.clone().sum::<Vector3<f64>>() / n;
    of.map(|x| (x - mean).norm_squared()).sum::<f64>() / n
}
