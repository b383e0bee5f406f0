//! Of campaigns as a whole.

use super::*;
use crate::inertial::session::Session;
use crate::unit::Unit;
use std::cell::OnceCell;

/// One run of the group `all` with the default scenario.
pub(super) fn of_one_run() -> Campaign {
    Campaign {
        scenario: Scenario::load("medium").unwrap(),
        runs: 1,
        shard: (0, 1),
        models: vec![ErrorModelName::All.into()],
        out: PathBuf::new(),
        resume: false,
        schemes: Vec::new(),
        ablation: false,
        tuning_units: 1,
        drives: vec![0],
        fixes: true,
    }
}

/// Results of one unit are not mixed with those of another, whatever differs between them.
#[test]
fn the_fingerprint_contains_the_unit() {
    let with = |unit: Unit| {
        let mut scenario = Scenario::default();
        scenario.set_unit("u.toml", unit);
        Campaign {
            scenario,
            runs: 1,
            shard: (0, 1),
            models: vec![ErrorModelName::All.into()],
            out: PathBuf::new(),
            resume: false,
            schemes: Vec::new(),
            ablation: false,
            tuning_units: 1,
            drives: vec![0],
            fixes: true,
        }
        .fingerprint()
    };
    let medium = with(Unit::default());
    assert_eq!(medium, with(Unit::default()));
    let mut noisier = Unit::default();
    noisier.gyro.angle_random_walk_dpsqrth *= 1.000_001;
    assert_ne!(medium, with(noisier));
    let derived = Unit {
        simulation: None,
        ..Unit::default()
    };
    assert_ne!(medium, with(derived));
}

/// The campaign's steps against steps of one sample on the same samples. All random numbers
/// follow from the number of the run alone.
#[test]
fn long_steps_do_not_change_the_errors() {
    let campaign = of_one_run();
    let imu = campaign.imu();
    let mut judged = 0;
    campaign
        .sessions(&imu, 5, |_, case| {
            let fine = Session {
                gather: 1,
                ..case.session.clone()
            };
            let fine = Case {
                session: &fine,
                increments: &OnceCell::new(),
                ..*case
            };
            for (name, scheme) in &SCHEMES[..2] {
                let [a, b] = [case, &fine].map(|c| {
                    crate::experiment::results::Row::of(&scheme(c).unwrap(), "", 22).unwrap()
                });
                let apart = (a.d_lat_m - b.d_lat_m).hypot(a.d_lon_m - b.d_lon_m);
                assert!(
                    apart < 0.01 * b.horizontal_m,
                    "{name}: {apart} of {} m",
                    b.horizontal_m
                );
                judged += 1;
            }
            Ok(())
        })
        .unwrap();
    assert_eq!(judged, 4);
    assert_eq!(Seeds::of(5), Seeds::of(5));
    assert_ne!(Seeds::of(5), Seeds::of(6));
}
