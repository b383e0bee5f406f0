//! The scheme with zero-velocity updates: `ekf6` continues as a filter after the fixes end, with
//! the zero velocity of the vehicle's stops as its only measurement. Stops are detected from the
//! samples alone.

use super::schemes::Case;
use super::statistics::median;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::gnss::{Fix, NOT_MEASURED};
use host_core::inertial::session::Session;
use host_estimation::learning::aiding::{ZERO_VELOCITY_MPS, roughness};
use nalgebra::Vector3;

/// Its number among the classical filters.
const EKF6: usize = 0;
/// Standard deviation of the height that damps the vertical channel, m.
const HEIGHT_M: f64 = 1.0;
/// A vehicle stands in a second if the variance of the samples in it, and in the seconds before and
/// after it, is at most this many times the median of that in the standstill.
const ROUGHER: f64 = 3.0;

/// The scheme `zupt`.
pub(super) fn zupt(case: &Case<'_>) -> Option<FreeInertial> {
    let (session, increments, until) = (case.session, case.increments(), case.until);
    let walk = case.knows.assumptions.datasheet_walk();
    let mut filter = case.bench.best(case, EKF6, walk)?.0.clone();
    let standing = standing(session, until);
    let n = session.steps_per_epoch();
    let mut out = FreeInertial::default();
    out.note(session, &filter.sins.nav, until, until);
    for (k, stands) in (until..).zip(standing) {
        for increment in &increments[k * n..(k + 1) * n] {
            filter.step(increment, session.step_s());
        }
        let below = (filter.sins.nav.q_bn * session.reference_arm).z;
        let mut site = filter.sins.nav.position;
        site.h = session.reference[k + 1].position.h + below;
        let velocity = if stands {
            ZERO_VELOCITY_MPS
        } else {
            NOT_MEASURED
        };
        let none = NOT_MEASURED;
        let sigmas = [none, none, HEIGHT_M, velocity, velocity, velocity];
        let _ = filter.take(Some(&Fix::new(site, Vector3::zeros(), sigmas)));
        out.note(session, &filter.sins.nav, until, k + 1);
    }
    Some(out)
}

/// Whether the vehicle stands, second by second from second `from` on: a slow start or stop is
/// smooth, so the two seconds beside a rough one do not count.
fn standing(session: &Session, from: usize) -> Vec<bool> {
    let roughness = |second: usize| roughness(session, second);
    let epochs = session.epochs();
    let standstill: Vec<[f64; 2]> = (0..session.standstill.min(epochs)).map(roughness).collect();
    let limits = [0, 1].map(|triad| {
        let mut standstill: Vec<f64> = standstill.iter().map(|r| r[triad]).collect();
        ROUGHER * median(&mut standstill)
    });
    let first = from.saturating_sub(2);
    let quiet = |second: usize| {
        let [dtheta, dv] = roughness(second);
        dtheta <= limits[0] && dv <= limits[1]
    };
    let quiet: Vec<bool> = (first..epochs).map(quiet).collect();
    let around =
        |k: usize| &quiet[k.saturating_sub(2).max(first) - first..(k + 3).min(epochs) - first];
    (from..epochs)
        .map(|k| around(k).iter().all(|quiet| *quiet))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Campaign, tests};
    use host_core::simulator::imu::ErrorModelName;

    /// No second counts in which the true vehicle moves, and nearly all count in which it has stood
    /// for some seconds. Engine and wind rock it at up to 2 cm/s.
    #[test]
    fn stops_are_detected_from_samples() {
        let campaign: Campaign = tests::of_one_run();
        let (mut found, mut all) = (0, 0);
        let each = |group, case: &Case<'_>| {
            if group != ErrorModelName::All.into() {
                return Ok(());
            }
            let speed = |k: usize| case.session.reference[k].velocity.norm();
            let standing = standing(case.session, 0);
            let judged = case.session.standstill + 5..standing.len() - 5;
            for (k, stands) in standing.iter().enumerate() {
                if !judged.contains(&k) {
                    continue;
                }
                if *stands {
                    let fast = speed(k).max(speed(k + 1));
                    assert!(fast < 0.05, "second {k}: {fast} m/s");
                }
                if (k - 4..k + 6).all(|k| speed(k) < 0.02) {
                    (found, all) = (found + usize::from(*stands), all + 1);
                }
            }
            Ok(())
        };
        campaign.sessions(&campaign.imu(), 3, each).unwrap();
        assert!(all > 50 && 10 * found > 8 * all, "{found} of {all} s");
    }

    #[test]
    fn stops_bound_the_error() {
        let campaign: Campaign = tests::of_one_run();
        let each = |group, case: &Case<'_>| {
            if group == ErrorModelName::All.into() {
                let end = |free: FreeInertial| free.position.last().unwrap().xy().norm();
                let [with, without] = ["zupt", "ekf6"].map(|name| {
                    let mut schemes = crate::campaign::SCHEMES.iter();
                    let (_, scheme) = schemes.find(|(known, _)| *known == name).unwrap();
                    end(scheme(case).unwrap())
                });
                println!("{with} m, {without} m without stops");
                assert!(with < 0.1 * without, "{with} {without}");
            }
            Ok(())
        };
        campaign.sessions(&campaign.imu(), 3, each).unwrap();
    }
}
