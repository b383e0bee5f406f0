//! Proofs by rehearsals, by chance and in drives.

mod bets;
mod coasts;
mod lasting;
mod rules;

use super::bets::MOST;
use super::coast::Coast;
use super::*;
use crate::learn::fixes::Memory;
use crate::learn::fixes::drive::{Drive, HZ, LSB, Receiver, Road};
use crate::learn::{Learner, Settings};
use crate::nav::{self, Navigator};

const PERFECT: [[f64; 3]; 2] = [[0.0; 3]; 2];
/// Three to four standard deviations of the datasheet.
const BIASED: [[f64; 3]; 2] = [[6e-6, -4.5e-6, 3e-6], [9e-3, -12e-3, 6e-3]];

/// An error that is not a number is the worst there is, whichever shadow has it.
#[test]
fn what_is_not_finite_loses() {
    let seen = |off| FixError {
        first: 6,
        off,
        sigma: 1.0,
    };
    let mut coast = Coast::NONE;
    let all = |of: Scores, is: f32| {
        let mut each = of.gains.into_iter().chain(of.extending);
        each.all(|score| score == is)
    };
    assert!(all(coast.scores(&seen([3.0, 4.0])), 0.0));
    assert!(all(coast.scores(&seen([f32::NAN, 4.0])), -MOST));
    coast.feed_back(&[f32::NAN; NAV]);
    assert!(all(coast.scores(&seen([3.0, 4.0])), -MOST));
}

/// Largest difference of a shadow's horizontal position to that of a second navigator which
/// subtracts the same correction from the same samples, and their distance to the navigator without
/// it, m: 300 s of driving, with all errors of the sensors of one size in units of the datasheet,
/// and elements of the maps of one size.
fn shadow_and_navigator(size: f64, element: f32) -> [f64; 2] {
    let settings = Settings::MEDIUM;
    let [g, a] =
        [settings.sheet.gyro_bias, settings.sheet.accel_bias].map(|of| size * f64::from(of));
    let biases = [[g, -g, g], [a, -a, a]];
    let mut memory = Box::new(Memory::ZEROED);
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, Receiver::GOOD, biases, 3);
    let noise = nav::Noise {
        gyro: settings.noise.gyro,
        accel: settings.noise.accel,
    };
    let config = nav::Config::new(LSB, 1.0 / f64::from(HZ), noise);
    let start = drive.learner.nav().expect("it navigates");
    let [mut own, mut second] = [(); 2].map(|()| Navigator::new(config, start).expect("valid"));
    let mut correction = Correction {
        maps: [[[element, -element, element]; 3]; 2],
        ..Correction::NONE
    };
    for (place, bias) in correction.estimate.iter_mut().zip(biases.as_flattened()) {
        *place = *bias as f32;
    }
    assert!(second.set_correction(&correction));
    let mut coast = Coast::NONE;
    let [shadow, ..] = &mut coast.shadows;
    shadow.correction = correction;
    let mut found = [0.0_f64; 2];
    for k in 0..300 {
        for i in 0..HZ {
            let counts = drive.counts(f64::from(k * HZ + i) / f64::from(HZ));
            own.sample(&counts);
            second.sample(&counts);
        }
        let mut block = own.take_transition();
        block.proportional = own.proportional_effects().of_maps(block.time);
        own.clear_proportional();
        coast.moves(&block, &Correction::NONE);
        let [shadow, ..] = &coast.shadows;
        let [.., n, e, _] = shadow.off.map(f64::from);
        let [north, east, _] = second.state().position.ned_from(&own.state().position);
        let off = libm::hypot(north - n, east - e);
        let apart = libm::hypot(north, east);
        found = [found[0].max(off), found[1].max(apart)];
    }
    found
}

/// The shadow is as good as a second navigator: within some
/// ten-thousandths of what the correction changes.
#[test]
fn a_shadow_is_a_second_navigator() {
    for (size, element, most, least) in [
        (1.0, 0.0, 0.02, 100.0),
        (4.0, 0.0, 0.1, 400.0),
        (0.0, 1e-4, 0.1, 30.0),
    ] {
        let [off, apart] = shadow_and_navigator(size, element);
        println!("{size} {element}: {off} m of {apart} m");
        assert!(
            off < most && apart > least,
            "{size} {element}: {off} of {apart}"
        );
    }
}

fn driven(receiver: Receiver, biases: [[f64; 3]; 2], seed: u64, then: impl FnOnce(&mut Drive<'_>)) {
    let mut memory = Box::new(Memory::ZEROED);
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, receiver, biases, seed);
    drive.seconds(1200);
    then(&mut drive);
}

/// Real errors prove themselves, and what is in force stays when the navigator is lost.
#[test]
fn real_errors_are_proved_and_outlive_the_navigator() {
    driven(Receiver::GOOD, BIASED, 5, |drive| {
        let report = drive.learner.report();
        assert!(report.winner > 0 && report.promotions > 0, "{report:?}");
        let nets = drive.learner.winner().map(|winner| winner.nets);
        drive.learner.silence();
        let after = drive.learner.report();
        assert_eq!(
            (after.winner, after.rollbacks),
            (report.winner, report.rollbacks)
        );
        assert!(!after.navigates && drive.learner.winner().map(|winner| winner.nets) == nets);
    });
}

/// A receiver that is late, displaced, coloured, or five times less accurate than configured:
/// hypotheses have evidence then, but nothing proves itself with perfect sensors.
#[test]
fn a_wrong_receiver_proves_nothing() {
    let wrong = [
        Receiver {
            delay: 0.6,
            ..Receiver::GOOD
        },
        Receiver {
            arm: [3.0, -2.0, 1.0],
            ..Receiver::GOOD
        },
        Receiver {
            errors: [3.0, 0.1],
            memory: 40.0,
            ..Receiver::GOOD
        },
        Receiver {
            errors: [7.5, 0.25],
            ..Receiver::GOOD
        },
    ];
    for (k, receiver) in wrong.into_iter().enumerate() {
        for seed in 0..3 {
            driven(receiver, PERFECT, 70 + seed, |drive| {
                let report = drive.learner.report();
                assert_eq!((report.winner, report.promotions), (0, 0), "{k} {seed}");
                assert!(drive.learner.rehearsal().counts()[5] > 2);
            });
        }
    }
}
