use super::*;
use firmware::learn::bank::ZERO_CORRECTION;
use host_core::inertial::free_inertial::free_inertial;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::DEG;
use host_core::simulator::gnss::{AntennaPrior, GnssSpec};
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_core::simulator::session::{SessionConfig, simulate};
use host_core::simulator::truth::Truth;
use nalgebra::Matrix3;

/// A short session: 150 s at rest, 250 s of driving.
fn session(model: ErrorModelName, seed: u64) -> (Session, Assumptions) {
    let imu = ImuSpec::preset("medium").unwrap();
    (
        session_and_truth(model, seed).0,
        Assumptions::of_simulated(&imu),
    )
}

/// A session of a simulated unit with the receiver's defaults, and its true drive.
fn session_and_truth(model: ErrorModelName, seed: u64) -> (Session, Truth) {
    with_receiver(&GnssSpec::default(), model, seed)
}

/// [`session_and_truth`] with this receiver.
fn with_receiver(gnss: &GnssSpec, model: ErrorModelName, seed: u64) -> (Session, Truth) {
    driven(gnss, model, seed, 850.0)
}

/// [`with_receiver`] with a drive of `drive_s` seconds.
fn driven(gnss: &GnssSpec, model: ErrorModelName, seed: u64, drive_s: f64) -> (Session, Truth) {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 50;
    let spec = imu.error_model(model);
    let config = SessionConfig {
        gnss,
        start: Geodetic {
            lat: 28.2 * DEG,
            lon: 112.9 * DEG,
            h: 60.0,
        },
        ..SessionConfig::new(&spec, [150.0, drive_s], [seed, seed, seed])
    };
    simulate(&config)
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
    let gnss = GnssSpec::default();
    let (session, _) = driven(&gnss, ErrorModelName::Linear, 5, 2250.0);
    let assumptions = Assumptions::of_simulated(&ImuSpec::preset("medium").unwrap());
    let learnt = learn(&session, &assumptions, Gates::default(), None, 400).unwrap();
    // the evidence is found before the proof by rehearsals
    assert_eq!(learnt.running, ZERO_CORRECTION);
    assert!(learnt.evidence[1] > 100.0);
    let learnt = learn(&session, &assumptions, Gates::default(), None, 2400).unwrap();
    assert_ne!(learnt.running, ZERO_CORRECTION);
}

/// Without a candidate in force, the samples of the free-inertial part are unchanged.
#[test]
fn the_zero_correction_changes_no_sample() {
    let (session, assumptions) = session(ErrorModelName::Noise, 11);
    let learnt = learn(&session, &assumptions, Gates::default(), None, 300).unwrap();
    let got = learnt.free_inertial(&session, &assumptions, 300);
    let increments = session.increments();
    let want = free_inertial(&session, &increments, learnt.nav, 300, session.epochs());
    assert_eq!((got.position, got.velocity), (want.position, want.velocity));
}

/// A map takes its matrix times each sample off the next one, without fixes as well.
#[test]
fn a_map_corrects_the_free_inertial_part() {
    let (session, assumptions) = session(ErrorModelName::Noise, 11);
    let mut learnt = learn(&session, &assumptions, Gates::default(), None, 300).unwrap();
    let map = [
        [3e-4, -2e-4, 1e-4],
        [1e-4, 2e-4, -3e-4],
        [-1e-4, 4e-4, 2e-4],
    ];
    learnt.nets.maps = [map, map];
    let got = learnt.free_inertial(&session, &assumptions, 300);
    let matrix = Matrix3::from_fn(|i, j| f64::from(map[i][j]));
    let of = |increment: &Increment| Increment {
        dtheta: increment.dtheta - matrix * increment.dtheta,
        dv: increment.dv - matrix * increment.dv,
    };
    let end = |increments: &[Increment]| {
        let free = free_inertial(&session, &increments, learnt.nav, 300, session.epochs());
        *free.position.last().unwrap()
    };
    let raw = session.increments();
    let corrected: Vec<_> = raw.iter().map(of).collect();
    let (without, want) = (end(&raw), end(&corrected));
    let got = *got.position.last().unwrap();
    let (moved, off) = ((without - want).norm(), (got - want).norm());
    assert!(moved > 100.0 && off < 0.05 * moved, "{off} of {moved}");
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
            let mut fix = due(&session, epoch).unwrap().1;
            fix.velocity[0] += off;
            let before = device.report();
            device.fix(&fix);
            device.learner.end(); // at a block's end it would wait
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

/// The antenna is 3 m ahead of the IMU, 1 m to its right and 2 m above it. The fixes are moved
/// there by the true attitude and the true rate, in this crate's own arithmetic. A device with this
/// configuration finds no errors of its noisy sensors. One without it takes the antenna's motion in
/// curves for errors.
#[test]
fn the_lever_arm_is_taken_into_account() {
    let arm = Vector3::new(3.0, 1.0, -2.0);
    let imu = ImuSpec::preset("medium").unwrap();
    let (mut session, truth) = session_and_truth(ErrorModelName::Noise, 12);
    let assumptions = Assumptions::of_simulated(&imu);
    let n = truth.samples_per_epoch;
    for (epoch, fix) in session.fixes.iter_mut().enumerate() {
        let Some(fix) = fix else { continue };
        // rate at the epoch: the two samples around it
        let [before, after] = [epoch * n, epoch * n + 1]
            .map(|at| truth.increments[at.clamp(1, truth.increments.len()) - 1].dtheta);
        let rate = (before + after) / (2.0 * truth.dt);
        let q_bn = truth.epochs[epoch].q_bn;
        let offset = q_bn * arm;
        let here = fix.position;
        let radius = 6_378_137.0;
        fix.position.lat += offset.x / radius;
        fix.position.lon += offset.y / (radius * here.lat.cos());
        fix.position.h -= offset.z;
        fix.velocity += q_bn * rate.cross(&arm);
    }
    let run = |lever_arm: [f32; 3]| {
        let mut memory = Box::new(FixMemory::ZEROED);
        let settings = Settings {
            lever_arm,
            ..settings(&session, &assumptions, Gates::default())
        };
        let nets = [Nets::NONE.gyro, Nets::NONE.accel];
        let compensator = compensator(&session, &nets, &assumptions);
        let mut device = Device::new(&mut memory, settings, compensator);
        let learnt = taught(&mut device, &session, &assumptions, None, 400).unwrap();
        let at = session.reference[400].position;
        let off = [
            (learnt.nav.position.lat - at.lat) * 6.37e6,
            (learnt.nav.position.lon - at.lon) * 6.37e6 * at.lat.cos(),
            learnt.nav.position.h - at.h,
        ];
        let off = off.iter().map(|m| m * m).sum::<f64>().sqrt();
        (learnt.running, device.report().refused, off)
    };
    let known = run([3.0, 1.0, -2.0]);
    let ignored = run([0.0; 3]);
    assert!(known.1 < 5 && known.2 < 1.5, "{known:?}");
    assert!(ignored.1 > 20 && ignored.2 > 2.5, "{ignored:?}");
    // the supposed errors of the sensors are not proven by rehearsals
    assert_eq!((known.0, ignored.0), (ZERO_CORRECTION, ZERO_CORRECTION));
}

/// Fixes are 0.4 s late, and the device is configured for 0.1 s. With a configured standard
/// deviation it finds the rest. Without one it trusts the configured delay, and takes the rest for
/// errors.
#[test]
fn a_false_latency_is_found_as_far_as_it_is_doubted() {
    let found = |sigma_s: f64| {
        let gnss = GnssSpec {
            latency_s: Some(0.4),
            assumed_antenna: AntennaPrior {
                age_s: [0.1, sigma_s],
                ..AntennaPrior::default()
            },
            ..GnssSpec::default()
        };
        let (session, _) = with_receiver(&gnss, ErrorModelName::Noise, 12);
        let assumptions = Assumptions::of_simulated(&ImuSpec::preset("medium").unwrap());
        let mut rest = (0.0, 0.0);
        with_device(&session, &assumptions, |device| {
            let known = device.report().antenna;
            rest = (known.fix_delay, known.fix_delay_sigma);
        });
        rest
    };
    let (rest, sigma) = found(0.2);
    assert!(sigma > 0.0 && sigma < 0.03, "{sigma}");
    assert!((rest - 0.3).abs() < 4.0 * sigma, "{rest} {sigma}");
    assert_eq!(found(0.0), (0.0, 0.0));
}
