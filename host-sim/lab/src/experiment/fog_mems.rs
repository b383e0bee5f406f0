//! The MEMS recording with a FOG navigator as its reference: learning on one part and judging on
//! the other, also with the parts exchanged.

use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Begins, Settings, Split, judge};
use host_core::error::Error;
use host_core::inertial::ekf::InitialSigma;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::fog_mems::SIGMAS;
use host_unit::Unit;
use host_unit::scenario::network::NetworkSpec;

/// Name of the preset of the recorded MEMS unit.
pub const UNIT: &str = "fog-mems";

/// Settings of the replay with a unit like that of the recording.
///
/// # Errors
/// A unit that no device accepts.
pub fn settings(unit: &Unit) -> Result<Settings, Error> {
    Ok(Settings {
        assumptions: Assumptions::of(unit),
        device: Device::of_unit(unit)?,
        start_sigma: Some(InitialSigma {
            tilt: 0.3 * DEG,
            heading: 0.5 * DEG,
            velocity: SIGMAS[3],
            position: SIGMAS[0],
        }),
        begins: Begins::Smoothed,
        promoted_only: false,
        network: NetworkSpec::short(),
        times_s: vec![10, 20, 30, 40],
    })
}

/// All cases: 30, 50 and 70 s of learning, forward and with the roles exchanged.
///
/// # Errors
/// As [`judge`].
pub fn replay(session: &Session, unit: &Unit) -> Result<Vec<Outcome>, Error> {
    let (settings, n) = (settings(unit)?, session.epochs());
    [30, 50, 70]
        .iter()
        .flat_map(|&t| [Split::forward(n, t), Split::exchanged(n, t)])
        .filter(|split| !split.judge.is_empty() && !split.learn.is_empty())
        .filter_map(|split| judge("fog-mems", session, &split, &settings).transpose())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::outcome::table;
    use test_bench::recordings::fog_mems as recorded;

    #[test]
    fn every_scheme_learns_in_every_case() {
        let Some(session) = recorded() else { return };
        let all = replay(&session, &Unit::preset(UNIT).unwrap()).unwrap();
        println!("{}", table(&all));
        assert_eq!(all.len(), 6);
        for o in &all {
            println!("{}: {}", o.case, o.notes.join(" "));
            let last = o.rows.iter().map(|r| r.t_s).max().unwrap();
            let raw = o.horizontal("raw", last).unwrap();
            for scheme in [
                "ls-bias", "ls-3x3", "ekf6", "ekf12", "ekf24", "rnn", "device",
            ] {
                let left = o.horizontal(scheme, last).unwrap() / raw;
                // 70 s are too short for rehearsals to prove anything
                if scheme == "device" {
                    assert!((left - 1.0).abs() < 1e-9, "{}: {left}", o.case);
                    continue;
                }
                // all start from one state, whose tilt is not that of each scheme's biases
                assert!(left < 0.6, "{}, {scheme}: {left} of raw", o.case);
            }
        }
    }
}
