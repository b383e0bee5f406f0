//! The MEMS recording with a FOG navigator as its reference: learnt on one part and judged on the
//! other, and the other way round.

use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Settings, Split, judge};
use crate::inertial::ekf::{InitialSigma, Noise, Prior};
use crate::inertial::session::Session;
use crate::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, PPM, UG, UG_PER_SQRT_HZ};
use crate::learning::teacher::{Assumptions, IN_RUN};
use crate::learning::window::NetworkSpec;
use crate::recordings::fog_mems::SIGMAS;

/// What may be expected of a MEMS IMU of unknown make (assumed: 1000 deg/h and 20 mg).
#[must_use]
pub fn settings() -> Settings {
    Settings {
        assumptions: Assumptions {
            prior: Prior {
                gyro_bias: 1000.0 * DEG_PER_H,
                accel_bias: 20_000.0 * UG,
                walk_per_hour: 0.5,
                scale: [3000.0 * PPM, 3000.0 * PPM],
                misalignment: [0.3 * DEG, 0.3 * DEG],
            },
            noise: Noise {
                gyro: 0.5 * DEG_PER_SQRT_H,
                accel: 200.0 * UG_PER_SQRT_HZ,
            },
            in_run: IN_RUN,
            limit: None,
        },
        start_sigma: Some(InitialSigma {
            tilt: 0.3 * DEG,
            heading: 0.5 * DEG,
            velocity: SIGMAS[3],
            position: SIGMAS[0],
        }),
        promoted_only: false,
        network: NetworkSpec::short(),
        times_s: vec![10, 20, 30, 40],
    }
}

/// All cases: 30, 50 and 70 s of learning, forward and with the roles exchanged. `told`: of the
/// sensors, instead of [`settings`].
#[must_use]
pub fn replay(session: &Session, told: Option<Assumptions>) -> Vec<Outcome> {
    let (mut settings, n) = (settings(), session.epochs());
    settings.assumptions = told.unwrap_or(settings.assumptions);
    [30, 50, 70]
        .iter()
        .flat_map(|&t| [Split::forward(n, t), Split::exchanged(n, t)])
        .filter(|split| !split.judge.is_empty() && !split.learn.is_empty())
        .filter_map(|split| judge("fog-mems", session, &split, &settings))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::outcome::table;
    use crate::recordings::fog_mems::tests::recorded;

    #[test]
    fn every_scheme_learns_in_every_case() {
        let Some(session) = recorded() else { return };
        let all = replay(&session, None);
        println!("{}", table(&all));
        assert_eq!(all.len(), 6);
        for o in &all {
            println!("{}: {}", o.case, o.notes.join(" "));
            let last = o.rows.iter().map(|r| r.t_s).max().unwrap();
            let raw = o.horizontal("raw", last).unwrap();
            for scheme in [
                "ls-bias",
                "ls-3x3",
                "ekf6",
                "ekf12",
                "ekf24",
                "rnn",
                "rnn-kalman",
            ] {
                let left = o.horizontal(scheme, last).unwrap() / raw;
                assert!(left < 0.25, "{}, {scheme}: {left} of raw", o.case);
            }
        }
        // after 50 s of fixes and 40 s without: 0.59 times the best classical filter, 0.75 times
        // with the parts exchanged
        for o in all
            .iter()
            .filter(|o| o.case.contains("49 s") || o.case.contains("0-50 s"))
        {
            let at = |scheme: &str| o.horizontal(scheme, 40).unwrap();
            let best = at("ekf6").min(at("ekf12")).min(at("ekf24"));
            let got = at("rnn-kalman");
            assert!(got < 0.8 * best && got < 0.06 * at("raw"), "{got} {best}");
        }
    }
}
