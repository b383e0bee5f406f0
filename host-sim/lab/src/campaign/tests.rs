//! Tests of whole campaigns.

use super::bench::Bench;
use super::*;
use host_core::inertial::session::Session;
use host_unit::Unit;
use std::cell::OnceCell;

/// One run of the group `all` with the default scenario.
pub(super) fn of_one_run() -> Campaign {
    let scenario = Scenario::load("medium").unwrap();
    Campaign::single(scenario, &[ErrorModelName::All])
}

/// Results of units that differ in any value are not mixed.
#[test]
fn the_fingerprint_contains_the_unit() {
    let with = |unit: Unit| {
        let mut scenario = Scenario::default();
        scenario.set_unit("u.toml", unit);
        Campaign::single(scenario, &[ErrorModelName::All]).fingerprint()
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

/// The campaign's steps give the same errors as steps of one sample. All random numbers depend on
/// the number of the run alone.
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
                bench: &Bench::default(),
                ..*case
            };
            for (name, scheme) in &SCHEMES[..2] {
                let [a, b] = [case, &fine].map(|c| {
                    crate::experiment::results::Row::of(&scheme(c).unwrap(), "", 22 * 60).unwrap()
                });
                let apart = (a.d_north_m - b.d_north_m).hypot(a.d_east_m - b.d_east_m);
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

/// A campaign's drive is that of the scenario's vehicle, which stands for 300 s first. The same
/// vehicle is in the fingerprint.
#[test]
fn any_vehicle_that_can_stand_goes_on_the_drives() {
    let road = of_one_run().fingerprint();
    for (vehicle, fastest) in [
        ("train", 39.0..41.0),
        ("traffic", 10.0..16.0),
        ("hand-held", 1.0..2.5),
        ("standing", 0.0..0.05),
    ] {
        let mut campaign = of_one_run();
        campaign.scenario.set_vehicle(vehicle).unwrap();
        assert_ne!(campaign.fingerprint(), road);
        let imu = campaign.imu();
        let mut judged = 0;
        let judge = |_: Group, case: &Case<'_>| {
            let session = case.session;
            let speed = |epoch: usize| session.reference[epoch].velocity.norm();
            assert_eq!(session.standstill, 300, "{vehicle}");
            assert!((0..300).all(|epoch| speed(epoch) < 0.05), "{vehicle}");
            let most = (300..session.epochs()).map(speed).fold(0.0, f64::max);
            assert!(fastest.contains(&most), "{vehicle}: {most}");
            judged += 1;
            Ok(())
        };
        campaign.sessions(&imu, 3, judge).unwrap();
        assert_eq!(judged, 2, "{vehicle}");
    }
}
