//! The learner on a vehicle whose receiver is not as configured. The drives have their own
//! kinematics (`fixes::drive`).

use super::*;
use crate::learn::fixes::Memory;
use crate::learn::fixes::drive::{Drive, Receiver, Road};
use crate::learn::{Learner, Report};

const PERFECT: [[f64; 3]; 2] = [[0.0; 3]; 2];
/// Biases of about the datasheet's size, rad/s and m/s2.
const BIASED: [[f64; 3]; 2] = [[2e-6, -1.5e-6, 1e-6], [3e-3, -4e-3, 2e-3]];
const ARM: [f64; 3] = [4.0, -1.5, -2.6]; // 5 m

/// Antenna at the sensors, 0.1 s; neither is certain.
fn unsure() -> Settings {
    Settings {
        lever_arm_sigma: 3.0,
        fix_age_sigma: 0.3,
        ..Settings::MEDIUM
    }
}

fn receiver(arm: [f64; 3], delay: f64) -> Receiver {
    Receiver {
        arm,
        delay,
        ..Receiver::GOOD
    }
}

fn memory() -> Box<Memory> {
    Box::new(Memory::ZEROED)
}

/// Errors of what is known, in its standard deviations.
fn off(estimate: &AntennaEstimate, receiver: &Receiver) -> [f64; ANTENNA] {
    let [x, y, z] = [0, 1, 2].map(|i| {
        (f64::from(estimate.lever_arm[i]) - receiver.arm[i])
            / f64::from(estimate.lever_arm_sigma[i])
    });
    let delay = f64::from(estimate.fix_delay) - receiver.delay;
    [x, y, z, delay / f64::from(estimate.fix_delay_sigma)]
}

/// Drives for 300 s and gives the report and the error of position and velocity.
fn driven(settings: Settings, receiver: Receiver, biases: [[f64; 3]; 2]) -> (Report, [f64; 2]) {
    let mut memory = memory();
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, biases, 3);
    drive.seconds(300);
    (drive.learner.report(), drive.error())
}

#[test]
fn lever_arm_and_delay_are_found_and_nothing_else_is_learnt_from_them() {
    for (arm, delay) in [
        ([0.0; 3], 0.1),
        ([1.5, 0.7, -1.1], 0.1), // 2 m
        (ARM, 0.1),
        ([0.0; 3], 0.15),
        ([0.0; 3], 0.2),
        ([0.0; 3], 0.5),
        ([0.0; 3], 0.9),
        (ARM, 0.5),
    ] {
        let receiver = receiver(arm, delay);
        let (report, [position, velocity]) = driven(unsure(), receiver, PERFECT);
        let estimate = report.antenna;
        assert!(
            off(&estimate, &receiver).iter().all(|d| d.abs() < 3.0),
            "{receiver:?} {estimate:?}"
        );
        let [x, y, z] = estimate.lever_arm_sigma;
        assert!(
            x < 0.2 && y < 0.1 && z < 0.5 && estimate.fix_delay_sigma < 0.01,
            "{estimate:?}"
        );
        assert_eq!(
            (report.winner, report.promotions, report.refused),
            (0, 0, 0),
            "{receiver:?}"
        );
        assert!(
            position < 2.0 && velocity < 0.05,
            "{receiver:?} {position} {velocity}"
        );
    }
}

/// The vehicle stands, the device aligns itself, and then it drives off. At rest, neither shows.
#[test]
fn it_starts_from_rest() {
    const LATER: Road = Road {
        speed: |t| {
            let begun = ((t - 130.0) / 10.0).clamp(0.0, 1.0);
            begun * begun * (3.0 - 2.0 * begun) * (Road::TOWN.speed)(t)
        },
        heading: |t| (Road::TOWN.heading)((t - 130.0).max(0.0)),
        sway: 0.0,
        axle: 0.0,
    };
    let mut memory = memory();
    let receiver = receiver(ARM, 0.5);
    let mut drive = Drive::new(&mut memory, unsure(), LATER, receiver, PERFECT, 6);
    drive.learner.restart();
    drive.seconds(120);
    let report = drive.learner.report();
    assert!(
        report.navigates && report.antenna.lever_arm_sigma.iter().all(|m| *m > 2.9),
        "{report:?}"
    );
    let here = drive.error()[0];
    assert!(
        (3.0..8.0).contains(&here),
        "the antenna is 5 m away: {here}"
    );
    drive.seconds(300);
    let report = drive.learner.report();
    assert!(
        off(&report.antenna, &receiver)
            .iter()
            .all(|d| d.abs() < 3.0),
        "{report:?}"
    );
    assert_eq!((report.winner, report.promotions), (0, 0), "{report:?}");
    // nothing has shown how high the antenna is
    let [position, velocity] = drive.error();
    assert!(position < 4.0 && velocity < 0.1, "{position} {velocity}");
    assert!(report.antenna.lever_arm_sigma[2] > 1.0, "{report:?}");
}

/// The purpose of the filter: when wrong values are believed, they are taken for errors of the
/// sensors. Such errors have more evidence than none, but they do not prove themselves.
#[test]
fn believed_wrongly_they_are_taken_for_errors_of_the_sensors() {
    for receiver in [receiver(ARM, 0.1), receiver([0.0; 3], 0.5)] {
        let mut memory = memory();
        let settings = Settings::MEDIUM;
        let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, PERFECT, 3);
        drive.seconds(300);
        assert_ne!(drive.learner.bank().leading(), 0, "{receiver:?}");
        let report = drive.learner.report();
        assert_eq!((report.winner, report.promotions), (0, 0), "{receiver:?}");
    }
}

/// Estimating lever arm and delay costs the biases accuracy, but not much: 1.3 times the errors
/// over 12 drives, more or less in each.
#[test]
fn biases_are_learnt_nearly_as_well_as_with_a_known_antenna() {
    let run = |settings, receiver| {
        let mut squares = 0.0;
        for seed in 0..4 {
            let mut memory = memory();
            let mut drive = Drive::new(
                &mut memory,
                settings,
                Road::TOWN,
                receiver,
                BIASED,
                20 + seed,
            );
            drive.seconds(300);
            assert_ne!(drive.learner.bank().leading(), 0);
            squares += drive.bias_errors().iter().map(|e| e * e).sum::<f64>();
        }
        squares.sqrt()
    };
    let with_known_antenna = run(Settings::MEDIUM, receiver([0.0; 3], 0.1));
    let found = run(unsure(), receiver(ARM, 0.5));
    assert!(
        found < 1.8 * with_known_antenna,
        "{found} {with_known_antenna}"
    );
}

/// On a straight line at constant speed neither is observable. The position at the start is not
/// better known than the antenna's.
#[test]
fn on_a_straight_line_nothing_is_claimed() {
    let mut memory = memory();
    let receiver = receiver(ARM, 0.5);
    let mut drive = Drive::new(&mut memory, unsure(), Road::STRAIGHT, receiver, PERFECT, 4);
    let state = drive.learner.nav().unwrap();
    let sigmas = [1e-4, 1e-4, 1e-3, 0.05, 0.05, 0.05, 50.0, 50.0, 50.0];
    drive.learner.navigate_from(state, &sigmas).unwrap();
    drive.seconds(300);
    let report = drive.learner.report();
    let estimate = report.antenna;
    assert!(
        estimate.lever_arm_sigma.iter().all(|sigma| *sigma > 2.9),
        "{estimate:?}"
    );
    assert!(estimate.fix_delay_sigma > 0.28, "{estimate:?}");
    assert!(
        off(&estimate, &receiver).iter().all(|d| d.abs() < 3.0),
        "{estimate:?}"
    );
    let moved = estimate.lever_arm.iter().all(|m| m.abs() < 1.0);
    assert!(
        moved && (estimate.fix_delay - 0.1).abs() < 0.1,
        "{estimate:?}"
    );
    assert_eq!((report.winner, report.refused), (0, 0));
}

/// The configured values may be off by some of their standard deviations: the fixes outweigh them.
#[test]
fn a_wrong_prior_is_outvoted() {
    let settings = Settings {
        lever_arm_sigma: 2.0,
        fix_age_sigma: 0.1,
        ..Settings::MEDIUM
    };
    for (arm, delay) in [([15.0, 0.0, 0.0], 0.1), (ARM, 0.9)] {
        let receiver = receiver(arm, delay);
        let (report, _) = driven(settings, receiver, PERFECT);
        let estimate = report.antenna;
        assert!(
            off(&estimate, &receiver).iter().all(|d| d.abs() < 3.0),
            "{receiver:?} {estimate:?}"
        );
        assert_eq!((report.winner, report.promotions), (0, 0), "{receiver:?}");
    }
}

/// One of them may be known exactly.
#[test]
fn what_is_known_exactly_stays() {
    let arm = Settings {
        fix_age_sigma: 0.0,
        ..unsure()
    };
    let (report, _) = driven(arm, receiver(ARM, 0.1), PERFECT);
    let estimate = report.antenna;
    assert_eq!((estimate.fix_delay, estimate.fix_delay_sigma), (0.1, 0.0));
    assert!(
        (f64::from(estimate.lever_arm[0]) - ARM[0]).abs() < 0.3,
        "{estimate:?}"
    );
    let delay = Settings {
        lever_arm_sigma: 0.0,
        ..unsure()
    };
    let (report, _) = driven(delay, receiver([0.0; 3], 0.5), PERFECT);
    let estimate = report.antenna;
    assert_eq!(
        (estimate.lever_arm, estimate.lever_arm_sigma),
        ([0.0; 3], [0.0; 3])
    );
    assert!((estimate.fix_delay - 0.5).abs() < 0.02, "{estimate:?}");
}

#[test]
fn the_lever_arm_is_reported_in_body_axes() {
    // the sensor's y points left, its z up
    let settings = Settings {
        lever_arm: [1.0, -2.0, 3.0],
        mounting: [0.0, 1.0, 0.0, 0.0],
        ..Settings::MEDIUM
    };
    let mut antenna = Antenna::ZEROED;
    antenna.configure(&settings);
    assert_eq!(antenna.estimate().lever_arm, [1.0, 2.0, -3.0]);
}

/// A time pulse measures the age, whatever is configured.
#[test]
fn with_a_time_pulse_the_age_is_known() {
    let mut memory = memory();
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(
        &mut memory,
        settings,
        Road::TOWN,
        receiver([0.0; 3], 0.13),
        PERFECT,
        3,
    );
    drive.pulse = true;
    drive.seconds(200);
    let report = drive.learner.report();
    assert_eq!((report.winner, report.refused), (0, 0));
    // where the delay is a state, it follows, and goes on when the pulses stay away
    let mut memory = self::memory();
    let receiver = receiver(ARM, 0.6);
    let mut drive = Drive::new(&mut memory, unsure(), Road::TOWN, receiver, PERFECT, 3);
    drive.pulse = true;
    drive.seconds(200);
    let report = drive.learner.report();
    assert_eq!((report.winner, report.refused), (0, 0));
    let estimate = report.antenna;
    assert!((estimate.fix_delay - 0.6).abs() < 0.006, "{estimate:?}");
    assert!(estimate.fix_delay_sigma < 0.005, "{estimate:?}");
    assert!(
        (f64::from(estimate.lever_arm[0]) - ARM[0]).abs() < 0.3,
        "{estimate:?}"
    );
}

/// A receiver that becomes faster: its earliest fixes were not the least age.
#[test]
fn a_delay_that_falls_is_followed() {
    let mut memory = memory();
    let slow = receiver([0.0; 3], 0.4);
    let mut drive = Drive::new(&mut memory, unsure(), Road::TOWN, slow, PERFECT, 3);
    drive.seconds(150);
    assert!((drive.learner.report().antenna.fix_delay - 0.4).abs() < 0.03);
    drive.receiver.delay = 0.12;
    drive.seconds(150);
    let report = drive.learner.report();
    assert!(
        off(&report.antenna, &drive.receiver)
            .iter()
            .all(|d| d.abs() < 3.0),
        "{report:?}"
    );
    assert!((report.antenna.fix_delay - 0.12).abs() < 0.03, "{report:?}");
    assert_eq!(report.winner, 0);
}

/// Errors of the receiver that last for seconds or a minute do not make it claim too much.
#[test]
fn lasting_errors_of_the_receiver_stay_within_what_is_claimed() {
    for (memory_s, errors) in [(5.0, [1.5, 0.05]), (20.0, [1.5, 0.05]), (60.0, [3.0, 0.08])] {
        let mut squares = 0.0;
        for seed in 0..4 {
            let receiver = Receiver {
                memory: memory_s,
                errors,
                ..receiver(ARM, 0.5)
            };
            let mut memory = memory();
            let mut drive = Drive::new(&mut memory, unsure(), Road::TOWN, receiver, PERFECT, seed);
            drive.seconds(300);
            let off = off(&drive.learner.report().antenna, &receiver);
            assert!(off.iter().all(|d| d.abs() < 3.0), "{memory_s} s: {off:?}");
            squares += off.iter().map(|d| d * d).sum::<f64>() / 16.0;
        }
        assert!(squares < 1.5 * 1.5, "{memory_s} s: {squares}");
    }
}
