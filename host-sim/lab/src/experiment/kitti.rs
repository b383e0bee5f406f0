//! The road drives of KITTI: each half is used once for learning and once for judging.

use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Begins, Settings, Split, judge};
use host_core::error::Error;
use host_core::inertial::ekf::InitialSigma;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::kitti::SIGMAS;
use host_unit::Unit;
use host_unit::scenario::network::NetworkSpec;

/// Name of the preset of the recorded RT3003.
pub const UNIT: &str = "kitti";

/// Settings of the replay with a unit like that of the drives.
///
/// # Errors
/// A unit that no device accepts.
pub fn settings(unit: &Unit) -> Result<Settings, Error> {
    Ok(Settings {
        assumptions: Assumptions::of(unit),
        device: Device::of_unit(unit)?,
        start_sigma: Some(InitialSigma {
            tilt: 0.05 * DEG,
            heading: 0.1 * DEG,
            velocity: SIGMAS[3],
            position: SIGMAS[0],
        }),
        begins: Begins::Reference,
        promoted_only: false,
        network: NetworkSpec::short(),
        times_s: vec![10, 20, 30, 40, 50],
    })
}

/// Learns on the first half and judges on the second, also with the halves exchanged.
///
/// # Errors
/// As [`judge`].
pub fn replay(name: &str, session: &Session, unit: &Unit) -> Result<Vec<Outcome>, Error> {
    let (settings, n) = (settings(unit)?, session.epochs());
    [Split::forward(n, n / 2), Split::exchanged(n, n / 2)]
        .iter()
        .filter(|split| !split.judge.is_empty() && !split.learn.is_empty())
        .filter_map(|split| judge(&format!("kitti-{name}"), session, split, &settings).transpose())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::outcome::table;
    use host_core::inertial::free_inertial::from_reference;
    use host_io::recordings::kitti::{DRIVES, session};
    use test_bench::recordings::recorded;

    fn drive_of(drive: &str, skip: usize) -> Option<Session> {
        let path = recorded(&format!("kitti-2011_09_30_drive_{drive}.csv.gz"))?;
        Some(session(&path, skip).unwrap())
    }

    /// At 60 s and at the end 11/36, 5/12, 27/144 and 30/166 m were measured elsewhere with
    /// displaced time stamps. With corrected time stamps most of the ends are better.
    #[test]
    fn free_inertial_errors_are_the_known_ones() {
        let known = [[9.5, 29.5], [4.8, 11.8], [32.7, 98.2], [29.3, 157.7]];
        for ((drive, skip), want) in DRIVES.into_iter().zip(known) {
            let Some(session) = drive_of(drive, skip) else {
                return;
            };
            let free = from_reference(&session);
            let end = session.epochs();
            let got = [60, end].map(|t| free.position[t].xy().norm());
            println!("{drive}: {got:.1?} m at 60 and {end} s");
            for (got, want) in got.iter().zip(want) {
                assert!((got / want - 1.0).abs() < 0.05, "{drive}: {got} {want}");
            }
        }
    }

    #[test]
    fn both_halves_teach_and_are_judged() {
        let unit = Unit::preset(UNIT).unwrap();
        let all: Vec<Outcome> = DRIVES
            .into_iter()
            .filter_map(|(drive, skip)| {
                Some(replay(drive, &drive_of(drive, skip)?, &unit).unwrap())
            })
            .flatten()
            .collect();
        println!("{}", table(&all));
        assert!(
            all.iter()
                .all(|o| o.rows.len() == 40 && o.rows.iter().all(|r| r.horizontal_m.is_finite()))
        );
    }
}
