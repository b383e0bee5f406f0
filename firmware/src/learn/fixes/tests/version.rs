//! Whatever changes a bit of what the learner computes raises its version.

use core::f64::consts::TAU;
use std::fmt::Write as _;

use super::motion::Trip;
use super::*;
use crate::align::motion::tests::world::{self, CONSUMER, STIM300};
use crate::configuration::VehicleKind;
use crate::fix::NOT_MEASURED;
use crate::learn::bank::HYPOTHESES;
use crate::learn::fixes::drive::{self, Drive, Odometer, Receiver, Road};
use crate::learn::settings::Wheels as Mounted;

/// Each second minute at rest.
const STOPS: Road = Road {
    speed: |t| moving(t) * 8.0 * (1.0 - libm::cos(t * TAU / 60.0)),
    heading: |t| {
        let turns =
            0.9 * (1.0 - libm::cos(t * TAU / 30.0)) + 0.3 * (1.0 - libm::cos(t * TAU / 12.0));
        0.7 + moving(t) * turns
    },
    sway: 0.0,
    axle: 1.5,
};

fn moving(t: f64) -> f64 {
    f64::from(u8::from(t.rem_euclid(120.0) < 60.0))
}

const MEMS: [[f64; 3]; 2] = [[6e-3, -9e-3, 4e-3], [0.1, -0.06, 0.08]];
/// The biases after a step.
const OTHERS: [[f64; 3]; 2] = [[-5e-3, 7e-3, -8e-3], [-0.1, 0.12, -0.05]];

/// Everything that the learner shows. Rust prints floats so that each bit counts.
fn shown(text: &mut String, learner: &mut FixLearner) {
    let (report, winner, next) = (
        learner.report(),
        learner.winner(),
        learner.for_next_power_on(),
    );
    let (rest, solution, trials) = (learner.rest(), learner.solution(), learner.trials());
    write!(
        text,
        "{report:?} {winner:?} {next:?} {rest:?} {solution:?} {trials:?}"
    )
    .unwrap();
    for index in 0..HYPOTHESES {
        let bank = learner.bank();
        let estimate = bank.estimate_of(index);
        write!(text, "{estimate:?} {:?}", bank.maps_of(index)).unwrap();
    }
}

/// Three drives of a car with a MEMS unit, whose memory goes from one to the next by its stored
/// bytes: an antenna with lever arm and delay, wheels, stops, errors in proportion, a silence of
/// the receiver. Before the third the biases have stepped; it has more fixes, and wrong ones.
fn car_with_memory(text: &mut String) {
    let mounted = Mounted {
        lever_arm: [0.5, 0.2, 0.8],
        axes: Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
        ahead: 0.0,
        scale: 0.03,
        noise: 0.03,
        delay: 0.05,
    };
    let settings = Settings {
        wheels: Some(mounted),
        lever_arm: [1.0, 0.5, -1.0],
        lever_arm_sigma: 0.3,
        fix_age_sigma: 0.05,
        ..drive::mems()
    };
    let receiver = Receiver {
        arm: [1.2, 0.4, -1.1],
        memory: 20.0,
        ..Receiver::GOOD
    };
    let mut stored = Vec::new();
    for (seed, biases, hz) in [(21, MEMS, 1), (22, MEMS, 1), (23, OTHERS, 5)] {
        let mut memory = memory();
        let receiver = Receiver { hz, ..receiver };
        let mut drive = Drive::new(&mut memory, settings, STOPS, receiver, biases, seed);
        drive.ratios[0][2][2] = 8e-3;
        drive.ratios[1][0][0] = 2e-4;
        drive.ratios[2][0][0] = -5e-3;
        drive.wheels = Some(Odometer {
            scale: 1.02,
            slip: |_| 1.0,
            ahead: 0.0,
            delay: 0.05,
        });
        drive.learner.recall(&stored);
        drive.begin_unaligned();
        for _ in 0..40 {
            drive.seconds(10);
            shown(text, &mut drive.learner);
        }
        drive.receiver.sigmas = [NOT_MEASURED; OBSERVATIONS];
        drive.seconds(20);
        shown(text, &mut drive.learner);
        drive.receiver = receiver;
        drive.seconds(20);
        shown(text, &mut drive.learner);
        if hz > 1 {
            drive.receiver.errors = [60.0, 3.0];
            drive.seconds(5);
            shown(text, &mut drive.learner);
            drive.receiver = receiver;
            drive.seconds(30);
            shown(text, &mut drive.learner);
        }
        let report = drive.learner.report();
        assert!(report.navigates && report.rests > 0, "{report:?}");
        assert!(
            drive.learner.winner().is_some(),
            "nothing has proved itself"
        );
        stored = vec![0; drive.learner.remember()];
        assert!(!stored.is_empty(), "the drive teaches");
        drive.learner.write_memory(0, &mut stored);
        let mut other = super::memory();
        let mut next = FixLearner::new(&mut other, settings);
        next.recall(&stored);
        let [of, by] = [&drive.learner, &next].map(|learner| learner.remembered.unit.values());
        assert_eq!(of, by, "the bytes hold all of it");
        write!(text, "{stored:?}").unwrap();
    }
}

/// Starts in motion, by the kind of vehicle, and a heading of two antennas.
fn starts_in_motion(text: &mut String) {
    use VehicleKind::{Air, Land, Ship};
    let trips = [
        (world::car as world::Motion, CONSUMER, Land, None),
        (world::ship, STIM300, Ship, Some(0.01)),
        (world::aircraft, STIM300, Air, None),
    ];
    for (motion, errors, kind, antenna) in trips {
        let mut memory = memory();
        let mut trip = Trip::new(&mut memory, motion, errors, kind, 3);
        trip.antenna = antenna;
        for second in 0..80 {
            trip.run(1, second == 60);
            shown(text, &mut trip.learner);
        }
        assert!(trip.learner.report().navigates);
    }
}

#[test]
fn every_bit_is_of_this_version() {
    let mut text = String::new();
    car_with_memory(&mut text);
    starts_in_motion(&mut text);
    let digest = fnv(text.bytes().map(u64::from));
    let expected = (3, 0x57cb_1750_d83c_8021);
    let found = (crate::learn::VERSION, digest);
    assert_eq!(found, expected, "{digest:#x}: raise the version, too");
}
