//! Fixes that come often, or lack some of their values.

use super::*;
use crate::learn::fixes::Memory;
use crate::learn::fixes::drive::{Drive, Receiver, Road};
use crate::learn::{Learner, Settings};

const PERFECT: [[f64; 3]; 2] = [[0.0; 3]; 2];
const BIASED: [[f64; 3]; 2] = [[2e-6, -1.5e-6, 1e-6], [3e-3, -4e-3, 2e-3]];

fn memory() -> Box<Memory> {
    Box::new(Memory::ZEROED)
}

/// Errors of the biases in units of the datasheet, and of position (m) and velocity (m/s): root
/// mean squares over some drives.
fn errors(receiver: Receiver) -> [f64; 3] {
    let mut squares = [0.0; 3];
    for seed in 0..5 {
        let mut memory = memory();
        let settings = Settings::MEDIUM;
        let mut drive = Drive::new(
            &mut memory,
            settings,
            Road::TOWN,
            receiver,
            BIASED,
            40 + seed,
        );
        drive.seconds(100);
        for _ in 0..10 {
            drive.seconds(10);
            let [position, velocity] = drive.error();
            squares[1] += position * position / 50.0;
            squares[2] += velocity * velocity / 50.0;
        }
        squares[0] += drive.bias_errors().iter().map(|e| e * e).sum::<f64>() / 30.0;
        let report = drive.learner.report();
        let usable = 200 * receiver.hz.min(5);
        assert!(
            report.fixes.abs_diff(usable) <= 5,
            "{receiver:?} {report:?}"
        );
        assert_ne!(drive.learner.bank().leading(), 0);
    }
    squares.map(f64::sqrt)
}

/// Many fixes in a second are not as many independent ones: whether the receiver's errors are white
/// or last for seconds, the estimates are not worse than with one fix a second.
#[test]
fn fixes_at_any_rate_teach_what_they_deserve() {
    for memory in [0.0, 5.0] {
        let at = |hz| {
            errors(Receiver {
                hz,
                memory,
                ..Receiver::GOOD
            })
        };
        let one = at(1);
        for hz in [5, 10, 20] {
            let many = at(hz);
            for (many, one) in many.iter().zip(one) {
                assert!(*many < 1.3 * one, "{memory} s, {hz} Hz: {many} {one}");
            }
        }
    }
}

/// Twenty wrong fixes in a second are no better reason to believe them than one.
#[test]
fn a_burst_of_wrong_fixes_is_refused_for_as_long_as_one_a_second() {
    let refusals = |hz: u32| {
        let mut memory = memory();
        let receiver = Receiver {
            hz,
            ..Receiver::GOOD
        };
        let mut drive = Drive::new(
            &mut memory,
            Settings::MEDIUM,
            Road::TOWN,
            receiver,
            PERFECT,
            8,
        );
        drive.seconds(60);
        drive.receiver.arm = [0.0, 0.0, -300.0];
        drive.seconds(8);
        let [position, _] = drive.error();
        assert!(position < 5.0, "{hz}: {position}");
        drive.seconds(10);
        drive.error()[0]
    };
    // after ten seconds they are believed
    assert!(refusals(1) > 6.0);
    assert!(refusals(20) > 6.0);
}

/// Position only, velocity only, velocity without its vertical component.
#[test]
fn what_is_measured_is_used() {
    let all = Receiver::GOOD.sigmas;
    for lacks in [3..6, 0..3, 5..6, 2..3] {
        let mut sigmas = all;
        sigmas[lacks.clone()].fill(NOT_MEASURED);
        let receiver = Receiver {
            sigmas,
            ..Receiver::GOOD
        };
        for (biases, learns) in [(PERFECT, false), (BIASED, true)] {
            let mut memory = memory();
            let settings = Settings::MEDIUM;
            let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, biases, 9);
            drive.seconds(300);
            let report = drive.learner.report();
            let [position, velocity] = drive.error();
            assert_eq!((report.refused, report.fixes), (0, 300), "{lacks:?}");
            let leads = drive.learner.bank().leading();
            assert_eq!(leads != 0, learns, "{lacks:?} {report:?}");
            assert!(
                velocity < 0.15 && position < 12.0,
                "{lacks:?} {position} {velocity}"
            );
        }
    }
}

/// A quiet cruise looks like a standstill to the sensors. Without a velocity only the positions can
/// tell, and a standstill is believed when they have had the time to.
#[test]
fn without_a_velocity_a_quiet_cruise_is_no_standstill() {
    let mut sigmas = Receiver::GOOD.sigmas;
    sigmas[3..].fill(NOT_MEASURED);
    let receiver = Receiver {
        sigmas,
        ..Receiver::GOOD
    };
    const SLOW: Road = Road {
        speed: |_| 1.0,
        ..Road::STRAIGHT
    };
    const STOPPED: Road = Road {
        speed: |_| 0.0,
        ..Road::STRAIGHT
    };
    for (road, still) in [(Road::STRAIGHT, false), (SLOW, false), (STOPPED, true)] {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, Settings::MEDIUM, road, receiver, PERFECT, 10);
        drive.seconds(150);
        let report = drive.learner.report();
        let [_, velocity] = drive.error();
        assert_eq!((report.winner, report.refused), (0, 0));
        assert_eq!(report.still_s > 30, still, "{report:?}");
        // a standstill is known to centimetres a second, positions of 1.5 m tell less
        assert!(velocity < if still { 0.02 } else { 0.2 }, "{velocity}");
    }
}

/// A fix that arrives close to a block's end waits, and one that arrives elsewhere does not. Each
/// is used once, and waiting costs no accuracy.
#[test]
fn a_fix_beside_the_end_of_a_block_waits() {
    const WORK: u32 = 5; // samples in 50 ms
    for arrives in [1, 4, 5, 6, 50, 94, 95, 96, 99] {
        let receiver = Receiver {
            delay: f64::from(arrives) * 0.01,
            ..Receiver::GOOD
        };
        let mut memory = memory();
        let settings = Settings::MEDIUM;
        let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, PERFECT, 11);
        drive.pulse = true;
        drive.seconds(5);
        let mut used = drive.learner.tally.used;
        let first = used;
        for sample in 0..20 * 100 {
            drive.sample();
            let now = drive.learner.tally.used;
            if now == used {
                continue;
            }
            used = now;
            let into = drive.learner.number() % 100 + 1;
            let beside = !(WORK..=100 - WORK).contains(&arrives);
            let wanted = if beside { WORK } else { arrives };
            assert!(into.abs_diff(wanted) <= 1, "{arrives} {sample}: {into}");
        }
        assert_eq!(used - first, 20, "{arrives}");
        let [position, velocity] = drive.error();
        assert!(
            position < 3.0 && velocity < 0.2,
            "{arrives}: {position} {velocity}"
        );
    }
}

/// A receiver that measures no velocity: the vehicle rests after a time at one position. The
/// samples count that time, whether the receiver's time passes the week's end or jumps.
#[test]
fn rest_is_timed_by_the_samples() {
    use crate::fix::Position;
    use crate::learn::fixes::drive::HZ;
    use crate::sample::RawSample;
    const WEEK_MS: u32 = 604_800_000;
    let none = NOT_MEASURED;
    let at = |time_ms| Fix {
        position: Position::default(),
        velocity: [0.0; 3],
        sigmas: [1.0, 1.0, 1.5, none, none, none],
        time_ms,
        arrived_us: 0,
        waited: 0,
        age: None,
        heading: None,
    };
    for [first, second] in [
        [1000, 2000],
        [WEEK_MS - 500, 500],
        [100_000, 50_000],
        [100_000, 1_100_000],
    ] {
        let mut memory = memory();
        let settings = Settings::MEDIUM;
        let mut drive = Drive::new(
            &mut memory,
            settings,
            Road::TOWN,
            Receiver::GOOD,
            PERFECT,
            1,
        );
        let learner = &mut drive.learner;
        let still = RawSample::Counts {
            gyro: [0; 3],
            accel: [0; 3],
        };
        let mut number = 0;
        let mut stands = |seconds| {
            for _ in 0..seconds * HZ {
                number += 1;
                learner.sample(number, &still);
            }
            learner.rests(&at(if number <= HZ { first } else { second }))
        };
        assert!(!stands(1), "the first");
        assert!(!stands(1), "{first} {second}: after a second");
        // 5 sqrt(2) m at 0.3 m/s are 23.6 s
        assert!(!stands(22), "{first} {second}: after 23 s");
        assert!(stands(1), "{first} {second}: after 24 s");
    }
}
