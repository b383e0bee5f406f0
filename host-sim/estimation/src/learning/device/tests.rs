mod bytes;

use super::*;
use crate::learning::teacher::Assumptions;
use crate::learning::window::{normalisation, start};
use firmware::configuration::VehicleKind;
use firmware::control::Mode;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::InitialSigma;
use host_core::inertial::session::{Outage, Session, Start};
use host_core::inertial::units::DEG;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_core::simulator::session::{SessionConfig, simulate};
use lrnn_nostd::Net;
use nalgebra::Vector3;

/// A standstill of 150 s, then a drive of the same unit on another day for each `day`.
fn session(drive_s: f64, day: u64) -> Session {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 50;
    let imu = imu.error_model(ErrorModelName::Linear);
    let config = SessionConfig {
        start: Geodetic {
            lat: 28.2 * DEG,
            lon: 112.9 * DEG,
            h: 60.0,
        },
        ..SessionConfig::new(&imu, [150.0, drive_s], [5, day, day])
    };
    simulate(&config).0
}

fn of_medium() -> Device {
    Device::of_unit(&host_unit::Unit::default()).unwrap()
}

/// Networks with this constant output, in units of the datasheet's bias.
fn constant(output: f32) -> Nets {
    let assumptions = Assumptions::of(&host_unit::Unit::default());
    let [gyro, accel] = normalisation(&assumptions).map(|normalisation| {
        let mut net = Net::new(start(0, 1.0).weights, normalisation);
        net.weights.layers[2].b = [output; 3];
        net
    });
    Nets {
        gyro,
        accel,
        ..Nets::NONE
    }
}

/// In the drive in which it learns the device changes no sample, and says since when and what. What
/// it has stored corrects from the next power-on on, toward the sensor's true error.
#[test]
fn what_is_learnt_acts_from_the_next_power_on() {
    let mut device = of_medium();
    let first = session(2250.0, 5);
    let learnt = device.drive_session(&first, first.epochs());
    assert!(!learnt.changed && learnt.in_force_since().is_none());
    assert!(*learnt.corrected == *first.counts);
    let course_of_first = course(&learnt, &device, &Nets::NONE);
    let says = &course_of_first.says;
    println!("{says}; stored at {:?} s", learnt.stored_s);
    assert!(says.starts_with("corrects nothing; has proved"), "{says}");
    assert!(says.ends_with("stored it for the next power-on"), "{says}");
    let (since, _) = learnt.diary.proved().unwrap();
    assert!(learnt.stored_s.iter().any(|stored| *stored > since as f64));

    let before = device.stored().0;
    let second = session(60.0, 6);
    let coast = device.clone().drive_session(&second, 0);
    assert!(coast.changed);
    assert_eq!(coast.given, 0);
    let since = coast.in_force_since().unwrap();
    assert!(since <= 2, "{since}");
    let truth = second.systematic.as_ref().unwrap();
    let [_, accel] = coast.correction.last().unwrap();
    let error = truth.last().unwrap().dv;
    let corrected = Vector3::from(accel.map(f64::from));
    assert!(
        (error - corrected).norm() < 0.5 * error.norm(),
        "{error} {corrected}"
    );
    let says = course(&coast, &device, &before).says;
    assert!(says.ends_with("has had no fix to learn from"), "{says}");
}

/// A correction reaches three biases of the datasheet and no more.
#[test]
fn the_devices_own_limit_holds() {
    let mut device = of_medium();
    device.store_nets(&constant(8.0));
    let session = session(10.0, 1);
    let drive = device.drive_session(&session, session.epochs());
    let limit = device.configuration().correction.limit;
    let prior = Assumptions::of(&host_unit::Unit::default()).prior;
    let three = [prior.gyro_bias, prior.accel_bias].map(|bias| 3.0 * bias as f32);
    let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-5;
    assert!(
        near(limit.gyro, three[0]) && near(limit.accel, three[1]),
        "{limit:?}"
    );
    let [gyro, accel] = drive.correction.last().unwrap();
    assert!(gyro.iter().all(|rate| near(*rate, limit.gyro)), "{gyro:?}");
    assert!(
        accel.iter().all(|force| near(*force, limit.accel)),
        "{accel:?}"
    );
}

/// The unit's vehicle, activation and limits stay; what the samples of a session already have does
/// not: mounting and lever arm. A new unit file is in mode bypass, and the device is judged in
/// learn.
#[test]
fn the_configuration_is_the_units() {
    let mut unit = host_unit::Unit::default();
    unit.vehicle.kind = host_unit::around::Kind::Ship;
    unit.receiver.heading_offset_deg = 90.0;
    let of = unit.configuration().unwrap();
    let mut session = session(10.0, 1);
    session.lever_arm = Vector3::new(1.0, -2.0, 0.5);
    session.antenna_sigmas = [0.25, 0.0];
    let found = configured(&of, &session);
    assert_eq!(found.vehicle.kind, VehicleKind::Ship);
    assert_eq!(found.correction.limit, of.correction.limit);
    assert_eq!(found.receiver.lever_arm, [1.0, -2.0, 0.5]);
    assert_eq!(found.receiver.lever_arm_sigma, 0.25);
    assert_eq!(found.receiver.heading_offset, 0.0);
    assert_eq!(
        (of.correction.mode, found.correction.mode),
        (Mode::Bypass, Mode::Learn)
    );
    let mut frozen = of.clone();
    frozen.correction.mode = Mode::Frozen;
    assert_eq!(configured(&frozen, &session).correction.mode, Mode::Frozen);
}

/// A device that knows its attitude by nothing says that it waits for it, and one that has just
/// begun how far its proof is.
#[test]
fn a_device_says_what_it_waits_for() {
    let mut standing = session(120.0, 3);
    standing
        .fixes
        .iter_mut()
        .skip(2)
        .for_each(|fix| *fix = None);
    standing.standstill = 0;
    let mut device = of_medium();
    let drive = device.drive_session(&standing, standing.epochs());
    let says = course(&drive, &device, &Nets::NONE).says;
    assert!(says.contains("waits for its alignment"), "{says}");
    let short = session(120.0, 3);
    let drive = device.drive_session(&short, short.epochs());
    let says = course(&drive, &device, &Nets::NONE).says;
    assert!(says.contains("has proved nothing: \""), "{says}");
    assert!(
        says.contains("is the nearest, proof ") && says.contains(" of 100 after "),
        "{says}"
    );
}

/// Missing samples that end the navigation are named with their time and what they have cost, and
/// a drive without any names none.
#[test]
fn a_device_says_what_an_interruption_cost() {
    let mut session = session(420.0, 3);
    let mut device = of_medium();
    let whole = device.clone().drive_session(&session, session.epochs());
    assert_eq!(whole.diary.proofs.interruptions, []);
    session.outages = vec![Outage {
        epochs: 400..412,
        resume: Start {
            nav: session.reference[412],
            sigma: InitialSigma {
                tilt: 1e-3,
                heading: 1e-3,
                velocity: 0.1,
                position: 1.0,
            },
        },
    }];
    let drive = device.drive_session(&session, session.epochs());
    let [of] = &drive.diary.proofs.interruptions[..] else {
        panic!("{:?}", drive.diary.proofs.interruptions);
    };
    assert_eq!(of.why.as_deref(), Some("a gap of 12.00 s at 400.0 s"));
    assert!((400.0..=413.0).contains(&of.t_s), "{of:?}");
    let course = course(&drive, &device, &Nets::NONE);
    assert!(
        course.says.contains("a gap of 12.00 s at 400.0 s"),
        "{course:?}"
    );
    if let Some((again, proof)) = of.again {
        assert!(again > of.t_s && proof <= of.proof.max(45), "{of:?}");
    }
}

/// Biases that are large against the unit file are named with their size; others are not.
#[test]
fn a_device_names_biases_that_are_too_large() {
    let session = session(240.0, 3);
    let as_it_is = of_medium();
    for (share, named) in [(1.0, false), (0.1, true)] {
        let mut configuration = as_it_is.configuration().clone();
        configuration.gyro.bias_turn_on *= share;
        configuration.gyro.bias_in_run *= share;
        let mut device = Device::new(&configuration);
        let drive = device.drive_session(&session, session.epochs());
        let says = course(&drive, &device, &Nets::NONE).says;
        assert_eq!(says.contains("the gyros' biases, "), named, "{says}");
    }
}
