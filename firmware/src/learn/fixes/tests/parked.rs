//! Sensors whose biases walk, parked or straight on for an hour, then under way.

use super::super::drive::{Drive, Receiver, Road, mems};
use super::*;
use crate::learn::unit;

/// Heading in town, which stays as it is between two times, s.
fn turns(t: f64, [from, until]: [f64; 2]) -> f64 {
    let t = t.min(from) + (t - until).max(0.0);
    1.6 * libm::sin(t * 0.13)
}
/// Ten minutes in town, parked for two hours, in town again.
const PARKS: Road = Road {
    speed: |t| {
        let ramp = |at: f64| ((t - at) / 10.0).clamp(0.0, 1.0);
        12.0 * (1.0 - ramp(600.0) + ramp(7800.0))
    },
    heading: |t| turns(t, [610.0, 7800.0]),
    ..TOWN
};
/// Ten minutes in town, 50 straight on, in town again.
const STRAIGHT_ON: Road = Road {
    speed: |_| 30.0,
    heading: |t| turns(t, [600.0, 3600.0]),
    ..TOWN
};
const TOWN: Road = Road {
    speed: |_| 12.0,
    heading: |t| turns(t, [f64::INFINITY; 2]),
    sway: 0.0,
    axle: 0.0,
};
const BIASES: [[f64; 3]; 2] = [[6e-3, -9e-3, 4e-3], [0.1, -0.06, 0.08]];

/// Where nothing shows the heading, the learner says how well it still knows it. Afterwards it
/// finds it again, and refuses no fix.
#[test]
fn the_heading_is_as_good_as_is_said_where_little_shows_it() {
    let mut memory = memory();
    for (name, road, receiver, until, worst) in [
        ("parked with fixes", PARKS, Receiver::GOOD, 7800, 0.02),
        ("parked without", PARKS, Receiver::NONE, 7800, 0.02),
        ("straight on", STRAIGHT_ON, Receiver::GOOD, 3600, 1.0),
    ] {
        let mut squares = 0.0;
        for seed in 1..=6 {
            let mut drive = Drive::new(&mut memory, mems(), road, Receiver::GOOD, BIASES, seed);
            drive.walks_as_the_datasheet_says();
            drive.seconds(620);
            drive.receiver = receiver;
            drive.seconds(until - 620);
            let [error, sigma] = drive.heading().expect(name);
            assert!(sigma < worst, "{name} {seed}: {sigma}");
            squares += (error / sigma).powi(2) / 6.0;
            print!("{name} {seed}: {error:.3} of {sigma:.3} rad, ");
            drive.receiver = Receiver::GOOD;
            drive.seconds(300);
            let report = drive.learner.report();
            let [later, sigma] = drive.heading().expect(name);
            println!("later {later:.4} of {sigma:.4} rad");
            assert!(
                later.abs() < 0.03 && report.refused == 0,
                "{name}: {report:?}"
            );
            assert!(later.abs() < 4.0 * sigma, "{name} {seed}: {later} {sigma}");
        }
        // a chi-square of six degrees of freedom by six: 0.1 % on both sides
        assert!((0.06..3.75).contains(&squares), "{name}: {squares}");
    }
}

/// A navigator that believes a wrong heading is given up, with what it has learnt, and the next one
/// is right.
#[test]
fn a_navigator_that_has_lost_its_way_is_given_up() {
    let mut memory = memory();
    for (seed, wrong) in [(1, 1.2), (2, 1.8), (3, 2.8), (4, -2.2)] {
        let mut drive = Drive::new(&mut memory, mems(), TOWN, Receiver::GOOD, BIASES, seed);
        drive.seconds(300);
        let mut state = drive.learner.nav().unwrap();
        let turn = [libm::cos(0.5 * wrong), 0.0, 0.0, libm::sin(0.5 * wrong)];
        state.q_bn = nav::vector::product(turn, state.q_bn);
        let sigmas = [1e-4, 1e-4, 1e-3, 0.05, 0.05, 0.05, 1.0, 1.0, 1.0];
        drive.learner.navigate_from(state, &sigmas).unwrap();
        drive.seconds(400);
        let before = drive.learner.report();
        drive.seconds(300);
        let after = drive.learner.report();
        let [error, sigma] = drive.heading().unwrap();
        println!(
            "{wrong}: {error:.4} of {sigma:.4} rad, {:?}",
            drive.bias_errors()
        );
        assert!(after.refused_alignments > 0, "{wrong}: {after:?}");
        assert!(
            error.abs() < 0.01 && after.refused == before.refused,
            "{wrong}: {error} {after:?}"
        );
        assert!(
            drive.bias_errors()[..3]
                .iter()
                .all(|bias| bias.abs() < 0.02)
        );
    }
}

/// What a lost navigator has taught is not stored while fixes contradict it; what this drive had
/// stored before is taken back, and the learner goes on from what it knew at power-on.
#[test]
fn what_a_lost_navigator_has_stored_is_taken_back() {
    let bytes = |drive: &Drive| {
        let mut bytes = [0; unit::LEN];
        drive.learner.write_memory(0, &mut bytes);
        bytes
    };
    let mut memory = memory();
    let mut drive = Drive::new(&mut memory, mems(), TOWN, Receiver::GOOD, BIASES, 1);
    drive.seconds(600);
    drive.learner.next_drive();
    let known = bytes(&drive);
    drive.begin_unaligned();
    drive.seconds(600);
    assert_eq!(drive.learner.remember(), unit::LEN);
    assert!(bytes(&drive) != known && !drive.learner.report().withdraws);
    let mut state = drive.learner.nav().unwrap();
    let turn = [libm::cos(0.9), 0.0, 0.0, libm::sin(0.9)];
    state.q_bn = nav::vector::product(turn, state.q_bn);
    let sigmas = [1e-4, 1e-4, 1e-3, 0.05, 0.05, 0.05, 1.0, 1.0, 1.0];
    drive.learner.navigate_from(state, &sigmas).unwrap();
    drive.seconds(15);
    let mut in_doubt = 15;
    while drive.learner.report().refused_alignments == 0 {
        assert_eq!(drive.learner.remember(), 0, "after {in_doubt} s");
        assert!(in_doubt < 300, "it is given up");
        drive.seconds(1);
        in_doubt += 1;
    }
    assert!(drive.learner.report().withdraws);
    let means = |drive: &Drive| drive.learner.bank().estimate_of(1).map(f64::from);
    let errors = BIASES.as_flattened().iter().zip(means(&drive));
    for (bias, mean) in errors.take(3) {
        assert!(
            (bias - mean).abs() < 1e-3,
            "as it was known: {mean} of {bias}"
        );
    }
    assert_eq!(drive.learner.remember(), unit::LEN);
    assert!(bytes(&drive) == known && !drive.learner.report().withdraws);
    drive.seconds(400);
    let errors = &drive.bias_errors()[..3];
    assert!(errors.iter().all(|bias| bias.abs() < 0.02), "{errors:?}");
}

/// A receiver that is four times worse than it says is no lost navigator, nor is one that is
/// displaced.
#[test]
fn a_bad_receiver_is_no_lost_navigator() {
    let mut memory = memory();
    let worse = Receiver {
        errors: [6.0, 0.2],
        ..Receiver::GOOD
    };
    let lasting = Receiver {
        errors: [20.0, 0.05],
        memory: 60.0,
        ..Receiver::GOOD
    };
    for receiver in [worse, lasting] {
        let mut drive = Drive::new(&mut memory, mems(), TOWN, receiver, BIASES, 1);
        drive.seconds(3000);
        let report = drive.learner.report();
        println!("{report:?}");
        assert!(
            report.refused > 20 && report.refused_alignments == 0,
            "{report:?}"
        );
    }
}
