use super::*;
use crate::inertial::units::DEG;
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::{ErrorModelName, ImuSpec};
use crate::simulator::session::{SessionConfig, simulate};
use firmware::learn::bank::ZERO_CORRECTION;

/// A short session: 150 s at rest, 250 s of driving.
fn session(model: ErrorModelName, seed: u64) -> (Session, Assumptions) {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 50;
    let spec = imu.error_model(model);
    let config = SessionConfig {
        imu: &spec,
        gnss: &GnssSpec::default(),
        start: Geodetic {
            lat: 28.2 * DEG,
            lon: 112.9 * DEG,
            h: 60.0,
        },
        heading: 1.0,
        standstill_s: 150.0,
        drive_s: 250.0,
        segments: None,
        vibration: 1.0,
        unit: seed,
        turn_on: seed,
        drive: seed,
    };
    (simulate(&config).0, Assumptions::of(&imu))
}

/// Calls `act` with a device that has learnt from the first 300 fixes.
fn with_device(session: &Session, assumptions: &Assumptions, act: impl FnOnce(&mut Device<'_>)) {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut device = device(&mut memory, session, assumptions, Gates::default());
    assert!(taught(&mut device, session, assumptions, None, 300).is_some());
    act(&mut device);
}

#[test]
fn noise_alone_promotes_nothing() {
    for seed in 0..6 {
        let (session, assumptions) = session(ErrorModelName::Noise, 10 + seed);
        let learnt = learn(&session, &assumptions, Gates::default(), None, 400).unwrap();
        assert_eq!(learnt.running, ZERO_CORRECTION);
        assert_eq!(learnt.estimate, [[0.0; 3]; 2]);
        let evidence = &learnt.evidence[ZERO_CORRECTION + 1..];
        assert!(evidence.iter().all(|evidence| *evidence < 0.0));
    }
}

#[test]
fn real_biases_are_promoted() {
    let (session, assumptions) = session(ErrorModelName::Linear, 5);
    let learnt = learn(&session, &assumptions, Gates::default(), None, 400).unwrap();
    assert_ne!(learnt.running, ZERO_CORRECTION);
    assert!(learnt.evidence[learnt.running] > 100.0);
}

/// Where nothing is in force, the samples of the free-inertial part pass unchanged.
#[test]
fn the_zero_correction_changes_no_sample() {
    let (session, assumptions) = session(ErrorModelName::Noise, 11);
    let learnt = learn(&session, &assumptions, Gates::default(), None, 300).unwrap();
    let got = learnt.free_inertial(&session, &assumptions, 300);
    let increments = session.increments();
    let want = free_inertial(&session, &increments, learnt.nav, 300, session.epochs());
    assert_eq!((got.position, got.velocity), (want.position, want.velocity));
}

#[test]
fn an_outlier_moves_nothing_and_a_lasting_jump_is_believed() {
    let (session, assumptions) = session(ErrorModelName::Noise, 3);
    with_device(&session, &assumptions, |device| {
        let mut epoch = 300;
        let mut refuses = |off: f64| {
            let n = session.samples_per_epoch();
            let second = &session.counts[epoch * n..(epoch + 1) * n];
            second.iter().for_each(|counts| device.sample(&raw(counts)));
            epoch += 1;
            let mut fix = fix(&session, epoch);
            fix.velocity[0] += off;
            let before = device.report();
            device.fix(&fix);
            let learnt = device.learnt().unwrap();
            assert!(learnt.evidence.iter().all(|evidence| evidence.is_finite()));
            let after = device.report();
            assert_eq!(after.fixes, before.fixes + 1);
            after.refused > before.refused
        };
        assert!(refuses(f64::NAN));
        assert!(refuses(50.0));
        assert!(!refuses(0.0));
        let refused = (0..17).take_while(|_| refuses(50.0)).count();
        assert_eq!(refused, 10);
    });
}
