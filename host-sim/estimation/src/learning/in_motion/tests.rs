use super::*;
use host_core::inertial::gnss::NOT_MEASURED;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::units::DEG;
use host_unit::Unit;
use test_bench::recordings::simulated;

fn assumptions() -> Assumptions {
    Assumptions::of(&Unit::default())
}

const LAND: VehicleKnowledge = VehicleKnowledge {
    vehicle: Kind::Land,
    forward: true,
    heading: None,
};

/// Attitude error north, east, down over its standard deviation.
fn errors(session: &Session, found: &Aligned) -> [f64; 3] {
    let truth = &session.reference[found.epoch];
    let error = (found.start.nav.q_bn * truth.q_bn.inverse()).scaled_axis();
    let sigma = found.start.sigma;
    [
        error.x / sigma.tilt,
        error.y / sigma.tilt,
        error.z / sigma.heading,
    ]
}

#[test]
fn a_road_drive_gives_the_attitude_within_its_sigmas() {
    for seed in 1..=6 {
        let session = simulated(10.0, 200.0, seed);
        let found = align(&session, &(0..210), LAND, &assumptions()).unwrap();
        let errors = errors(&session, &found);
        println!("{seed}: {errors:.2?} {found:?}");
        assert!(errors.iter().all(|e| e.abs() < 4.0), "{seed}: {errors:?}");
        assert!(found.start.sigma.heading < 0.11 && found.epoch > 10);
        // it can begin anywhere
        let later = align(&session, &(60..210), LAND, &assumptions()).unwrap();
        assert!(later.epoch > 60);
        assert!(errors.iter().all(|e| e.abs() < 4.0), "{seed}: {errors:?}");
    }
}

#[test]
fn positions_alone_do_too_and_a_rough_heading_helps() {
    let mut session = simulated(10.0, 300.0, 2);
    for fix in session.fixes.iter_mut().flatten() {
        fix.velocity.fill(f64::NAN);
        fix.sigmas = [0.05, 0.05, 0.1, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED];
        // positions of this accuracy
    }
    let exact: Vec<_> = session.reference.iter().map(|s| s.position).collect();
    for (fix, position) in session.fixes.iter_mut().zip(exact) {
        fix.as_mut().unwrap().position = position;
    }
    let found = align(&session, &(0..310), LAND, &assumptions()).unwrap();
    let errors = errors(&session, &found);
    assert!(errors.iter().all(|e| e.abs() < 4.0), "{errors:?}");
    let heading = to_euler(&session.reference[1].q_bn).2;
    let known = VehicleKnowledge {
        heading: Some([heading, 5.0 * DEG]),
        ..LAND
    };
    let helped = align(&session, &(0..310), known, &assumptions()).unwrap();
    assert!(helped.epoch <= found.epoch);
}

#[test]
fn what_does_not_move_does_not_align() {
    let session = simulated(100.0, 1.0, 1);
    let why = align(&session, &(0..95), LAND, &assumptions());
    assert!(why.is_err(), "{why:?}");
    // fixes of another drive
    let mut session = simulated(10.0, 200.0, 1);
    session.fixes = simulated(10.0, 200.0, 2).fixes;
    let why = align(&session, &(0..210), LAND, &assumptions());
    assert!(why.is_err(), "{why:?}");
}
