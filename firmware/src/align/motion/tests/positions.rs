//! Alignments by positions on true motions of [`world`].

use super::world::{self, CONSUMER, Errors, Motion, SAMPLE_S, STIM300, World};
use super::{DEG, config};
use crate::align::motion::{InMotion, Progress};
use crate::fix::{Fix, NOT_MEASURED};
use crate::nav::Transition;
use std::vec::Vec;

/// A receiver of a decimetre without velocities.
const RECEIVER: [f64; 3] = [0.1, 0.15, 0.1];
/// Gyros of 2 deg/s.
const COARSE: Errors = Errors {
    bias: [2.0 * DEG, 0.2],
    ..CONSUMER
};

/// A car whose sensors are turned by 100 deg about the vertical.
fn turned_car(t: f64) -> (world::V, world::V) {
    let ([yaw, pitch, roll], v) = world::car(t);
    ([yaw + 100.0 * DEG, pitch, roll], v)
}

/// A small car that swings from side to side at 1 m/s, and never stands.
fn toy(t: f64) -> (world::V, world::V) {
    let yaw = 0.9 * (0.8 * t).sin() + 0.1 * t;
    let (sin, cos) = yaw.sin_cos();
    let speed = 0.9 + 0.15 * (0.3 * t).sin();
    ([yaw + 2.0, 0.05, -0.1], [speed * cos, speed * sin, 0.0])
}

fn parked(_: f64) -> (world::V, world::V) {
    ([0.4, 0.02, 0.01], [0.0; 3])
}

/// Time, heading error and its standard deviation (rad), squared tilt error over its variance, and
/// the errors of the gyros' biases, rad/s.
#[derive(Debug)]
struct Started {
    time: f64,
    heading: [f64; 2],
    tilt: f64,
    bias: [f64; 3],
}

/// A vehicle, its sensors, and the biases by the unit file as a share of the true ones.
struct Case {
    motion: Motion,
    errors: Errors,
    sheet: f64,
    every: usize,
}

impl Case {
    fn new(motion: Motion, errors: Errors) -> Case {
        Case {
            motion,
            errors: Errors {
                receiver: RECEIVER,
                ..errors
            },
            sheet: 1.0,
            every: 1,
        }
    }

    fn run(
        &self,
        seed: u64,
        until: usize,
        spoil: fn(&mut Fix, f64),
    ) -> (Option<Started>, Progress) {
        let mut world = World::new(self.motion, 0.8, self.errors, seed);
        let mut config = config(&self.errors, true);
        config.bias = config.bias.map(|bias| bias * self.sheet as f32);
        let mut align = InMotion::new(config, [0.0; 6]);
        let samples = (1.0 / SAMPLE_S) as usize * self.every;
        let mut scratch = Transition::ZEROED;
        let mut still = 0;
        for _ in 0..until / self.every {
            for _ in 0..samples {
                align.sample(&world.sample());
            }
            let mut fix = world.fix();
            fix.sigmas[3..].fill(NOT_MEASURED);
            spoil(&mut fix, world.time);
            still = if world.velocity() == [0.0; 3] {
                still + 1
            } else {
                0
            };
            let rest = (still > 3).then_some(0.01);
            let Some(found) = align.fix(&fix, rest, [0.0; 2], &mut scratch) else {
                continue;
            };
            let [a, b, c] = world::error(found.state.q_bn, world.attitude());
            let [p, q] = [0, 1].map(|i| f64::from(scratch.phi[i][i]));
            return (
                Some(Started {
                    time: world.time,
                    heading: [c, f64::from(found.heading_sigma)],
                    tilt: 0.5 * (a * a / p + b * b / q),
                    bias: core::array::from_fn(|i| f64::from(found.applied[i]) - world.bias[0][i]),
                }),
                align.progress(),
            );
        }
        (None, align.progress())
    }

    /// All seeds start within `until` s, as well as they claim.
    fn starts(&self, name: &str, seeds: u64, until: usize) -> Vec<Started> {
        let mut all = Vec::new();
        for seed in 1..=seeds {
            let (started, progress) = self.run(seed, until, |_, _| {});
            let started = started.unwrap_or_else(|| panic!("{name} {seed}: {progress:?}"));
            let [error, sigma] = started.heading;
            assert!(error.abs() <= 4.0 * sigma, "{name} {seed}: {started:?}");
            all.push(started);
        }
        let n = all.len() as f64;
        let mean = |of: fn(&Started) -> f64| all.iter().map(of).sum::<f64>() / n;
        let heading = mean(|s| (s.heading[0] / s.heading[1]).powi(2));
        let (tilt, sigma) = (mean(|s| s.tilt), mean(|s| s.heading[1]) / DEG);
        let last = all.iter().fold(0.0_f64, |last, s| last.max(s.time));
        println!(
            "{name}: after {:.0} to {last:.0} s, sigma {sigma:.2} deg, squared errors of heading \
             {heading:.2} and tilt {tilt:.2}",
            all.iter().fold(f64::INFINITY, |first, s| first.min(s.time))
        );
        // one and two degrees of freedom; the bounds are at 4 sigma
        assert!(heading < 1.0 + 4.0 * (2.0 / n).sqrt(), "{name}: {heading}");
        assert!(tilt < 1.0 + 4.0 * (1.0 / n).sqrt(), "{name}: {tilt}");
        all
    }
}

#[test]
fn a_car_starts_however_its_sensors_are_mounted() {
    for (name, motion) in [("car", world::car as Motion), ("turned car", turned_car)] {
        for (sensors, errors) in [
            ("coarse", COARSE),
            ("consumer", CONSUMER),
            ("STIM300", STIM300),
        ] {
            // it drives off after 20 s
            Case::new(motion, errors).starts(&format!("{name}, {sensors}"), 10, 50);
        }
    }
    Case::new(world::reversing, CONSUMER).starts("reversing", 10, 60);
}

#[test]
fn a_toy_car_of_one_metre_a_second_starts() {
    Case::new(toy, COARSE).starts("toy car, coarse", 20, 40);
    Case::new(toy, CONSUMER).starts("toy car, consumer", 20, 40);
    let slow = Case {
        every: 2,
        ..Case::new(toy, CONSUMER)
    };
    slow.starts("toy car, a fix every 2 s", 10, 60);
}

#[test]
fn aircraft_and_ships_start() {
    Case::new(world::aircraft, CONSUMER).starts("aircraft, consumer", 10, 90);
    Case::new(world::ship, STIM300).starts("ship, STIM300", 10, 120);
}

/// Biases that are ten times as large as the unit file says, or a tenth, are found.
#[test]
fn biases_far_from_the_unit_file_are_found() {
    for (sheet, until) in [(0.1, 60), (10.0, 60)] {
        for (name, motion) in [("toy", toy as Motion), ("turned car", turned_car)] {
            let case = Case {
                sheet,
                ..Case::new(motion, COARSE)
            };
            for started in case.starts(&format!("{name}, {sheet} of the biases"), 20, until) {
                let [x, y, _] = started.bias;
                assert!(x.abs().max(y.abs()) < 0.5 * DEG, "{started:?}"); // of 2 deg/s
            }
        }
    }
}

/// What shows no heading gives none.
#[test]
fn a_vehicle_that_does_not_manoeuvre_does_not_start() {
    for (name, motion) in [("straight", world::straight as Motion), ("parked", parked)] {
        for errors in [COARSE, CONSUMER, STIM300] {
            for seed in 1..=3 {
                let (started, progress) = Case::new(motion, errors).run(seed, 300, |_, _| {});
                assert!(started.is_none(), "{name} {seed}: {started:?} {progress:?}");
            }
        }
    }
}

/// Positions that contradict the sensors never start the navigator.
#[test]
fn contradictions_do_not_start() {
    let doubled: fn(&mut Fix, f64) = |fix, _| {
        fix.position.latitude = 2.0 * fix.position.latitude - 0.8;
        fix.position.longitude = 2.0 * fix.position.longitude - 0.4;
    };
    let frozen: fn(&mut Fix, f64) = |fix, time| {
        if time > 12.0 {
            fix.position.latitude = 0.8;
            fix.position.longitude = 0.4;
        }
    };
    for (name, spoil) in [("doubled", doubled), ("frozen", frozen)] {
        for (motion, errors) in [(turned_car as Motion, CONSUMER), (world::car, STIM300)] {
            for seed in 1..=4 {
                let (started, progress) = Case::new(motion, errors).run(seed, 200, spoil);
                assert!(started.is_none(), "{name} {seed}: {started:?} {progress:?}");
            }
        }
    }
}

/// Errors of the receiver that last for seconds, as large as the white ones beside them. With a fix
/// each 0.3 s the heading is off by up to 4.7 of its standard deviations, so that one a second is
/// used.
#[test]
fn errors_that_last_do_not_falsify_the_heading() {
    let wanders: fn(&mut Fix, f64) = |fix, time| {
        let wave = |a: f64, b: f64| 0.1 * ((a * time).sin() + (b * time + 1.0).cos());
        let off = [wave(0.4, 1.1), wave(0.7, 1.6), wave(0.3, 1.3)];
        fix.position = fix.position.displaced(off);
        for sigma in &mut fix.sigmas[..3] {
            *sigma *= core::f32::consts::SQRT_2;
        }
    };
    for (name, motion) in [("toy", toy as Motion), ("turned car", turned_car)] {
        for errors in [COARSE, CONSUMER] {
            for seed in 1..=10 {
                let (found, progress) = Case::new(motion, errors).run(seed, 60, wanders);
                let found = found.unwrap_or_else(|| panic!("{name} {seed}: {progress:?}"));
                let [error, sigma] = found.heading;
                assert!(error.abs() <= 4.0 * sigma, "{name} {seed}: {found:?}");
            }
        }
    }
}

/// A receiver that drifts by metres while the vehicle stands is found out: the heading is right.
#[test]
fn a_drift_of_the_receiver_does_not_falsify_the_heading() {
    let drifts: fn(&mut Fix, f64) = |fix, time| {
        let share = ((time - 12.0) / 4.0).clamp(0.0, 1.0);
        fix.position = fix
            .position
            .displaced([1.2 * share, -0.5 * share, -1.6 * share]);
    };
    let mut started = 0;
    for seed in 1..=10 {
        let case = Case::new(turned_car, COARSE);
        let (found, progress) = case.run(seed, 90, drifts);
        let Some(found) = found else {
            continue;
        };
        started += 1;
        let [error, sigma] = found.heading;
        assert!(error.abs() <= 4.0 * sigma, "{seed}: {found:?} {progress:?}");
    }
    assert!(started >= 8, "{started}");
}

/// Without noise the attitude is the true one, whatever the biases and however far the vehicle
/// turns between two fixes: the equations are exact.
#[test]
fn exact_data_give_the_attitude() {
    for (name, motion) in [("toy", toy as Motion), ("car", world::car)] {
        for bias in [[0.0; 2], CONSUMER.bias] {
            for seed in 1..=4 {
                let errors = Errors {
                    bias,
                    noise: [0.0; 2],
                    scale: [0.0; 2],
                    receiver: [0.1, 0.1, 1e-4],
                };
                let mut world = World::new(motion, 0.8, errors, seed);
                let mut align = InMotion::new(config(&CONSUMER, true), [0.0; 6]);
                let mut scratch = Transition::ZEROED;
                let found = (0..60).find_map(|_| {
                    for _ in 0..100 {
                        align.sample(&world.sample());
                    }
                    let mut fix = world.fix();
                    fix.sigmas = [0.05, 0.05, 0.05, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED];
                    align.fix(&fix, None, [0.0; 2], &mut scratch)
                });
                let found = found.unwrap_or_else(|| panic!("{name} {seed}"));
                let [.., heading] = world::error(found.state.q_bn, world.attitude());
                // an accelerometer's bias and the tilt are told apart by turns only
                let most = if bias[0] == 0.0 { 0.05 } else { 1.0 };
                let off = heading.abs() / DEG;
                println!("{name} {seed}: {off:.3} deg");
                assert!(off < most, "{name} {seed}: {off} deg");
            }
        }
    }
}
