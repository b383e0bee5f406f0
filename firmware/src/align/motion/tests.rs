//! Alignments in motion on true motions of [`world`].

mod positions;
pub(crate) mod world;

use super::*;
use crate::fix::{Fix, Heading};
use crate::nav::Noise;

use std::vec::Vec;
use world::{CONSUMER, Errors, LASER, Motion, SAMPLE_S, STIM300, World};

const DEG: f64 = core::f64::consts::PI / 180.0;
pub(crate) fn config(errors: &Errors, rolls: bool) -> Config {
    let [g, a] = errors.noise.map(|x| x as f32);
    let noise = Noise { gyro: g, accel: a };
    Config {
        navigator: nav::Config::new(world::LSB, SAMPLE_S, noise),
        bias: errors.bias.map(|x| x as f32),
        walk: errors.bias.map(|x| x as f32 * 0.05 / 60.0),
        scale: errors.scale.map(|x| x as f32),
        forward: [1.0, 0.0, 0.0],
        lever_arm_sigma: 0.0,
        rolls,
        stands: rolls,
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    time: f64,
    /// Heading error and its standard deviation, rad.
    heading: [f64; 2],
    /// Squared error of attitude and velocity over its covariance.
    nees: f64,
    way: HeadingSource,
}

/// A vehicle with its sensors and its configuration.
#[derive(Clone, Copy)]
struct Case {
    motion: Motion,
    latitude: f64,
    errors: Errors,
    config: Config,
}

impl Case {
    /// A land vehicle if it `rolls`.
    fn new(motion: Motion, errors: Errors, rolls: bool) -> Case {
        Case {
            motion,
            latitude: 0.8,
            errors,
            config: config(&errors, rolls),
        }
    }

    /// The unit file gives this share of the biases.
    fn sheet(mut self, share: f32) -> Case {
        self.config.bias = self.config.bias.map(|bias| bias * share);
        self
    }

    /// Runs at most `until` seconds; `spoil` may change a fix.
    fn run(
        &self,
        seed: u64,
        until: u32,
        spoil: impl Fn(&mut Fix, f64),
    ) -> (Option<Outcome>, Progress) {
        let mut world = World::new(self.motion, self.latitude, self.errors, seed);
        let mut align = InMotion::new(self.config, [0.0; 6]);
        let mut still = 0;
        for _ in 0..until {
            for _ in 0..SAMPLES {
                align.sample(&world.sample());
            }
            let mut fix = world.fix();
            still = if world.velocity() == [0.0; 3] {
                still + 1
            } else {
                0
            };
            // as the learner does
            let rest = (still > 3).then_some(0.01);
            spoil(&mut fix, world.time);
            let mut scratch = Transition::ZEROED;
            if let Some(found) = align.fix(&fix, rest, [0.0; 2], &mut scratch) {
                return (Some(outcome(&found, &scratch, &world)), align.progress());
            }
        }
        (None, align.progress())
    }

    /// All of these seeds start, each with a heading within 4 of its standard deviations, and the
    /// mean of the normalised squared errors does not exceed what chance allows.
    fn starts(&self, name: &str, seeds: u64, until: u32) -> Vec<Outcome> {
        let (mut all, mut refused) = (Vec::new(), 0);
        for seed in 1..=seeds {
            let (outcome, progress) = self.run(seed, until, |_, _| {});
            let outcome = outcome.unwrap_or_else(|| panic!("{name} {seed}: {progress:?}"));
            let [error, sigma] = outcome.heading;
            assert!(error.abs() <= 4.0 * sigma, "{name} {seed}: {outcome:?}");
            assert!(sigma <= f64::from(MAX_HEADING));
            refused += progress.refused;
            all.push(outcome);
        }
        let n = all.len() as f64;
        let nees = all.iter().map(|o| o.nees).sum::<f64>() / n;
        let z = all
            .iter()
            .map(|o| (o.heading[0] / o.heading[1]).powi(2))
            .sum::<f64>()
            / n;
        let last = all.iter().fold(0.0_f64, |last, o| last.max(o.time));
        let sigma = all.iter().map(|o| o.heading[1]).sum::<f64>() / n / DEG;
        println!(
            "{name}: after {last:.0} s, sigma {sigma:.2} deg, squared heading error {z:.2} of its \
             variance, squared error {nees:.1} of 6"
        );
        assert!(f64::from(refused) <= 0.1 * n, "{name}: {refused} refused");
        // six degrees of freedom: mean 6, variance 12; the bounds are at 4 sigma
        assert!(nees < 6.0 + 4.0 * (12.0 / n).sqrt(), "{name}: {nees}");
        assert!(z < 1.0 + 4.0 * (2.0 / n).sqrt(), "{name}: {z}");
        all
    }
}

/// Samples of a second.
const SAMPLES: usize = (1.0 / SAMPLE_S) as usize;

fn outcome(start: &AlignedState, scratch: &Transition<ERRORS>, world: &World) -> Outcome {
    let [a, b, c] = world::error(start.state.q_bn, world.attitude());
    let (got, truth) = (start.state.velocity, world.velocity());
    let [d, e, f] = core::array::from_fn(|i| got[i] - truth[i]);
    Outcome {
        time: world.time,
        heading: [c, f64::from(start.heading_sigma)],
        nees: squared(&scratch.phi, [a, b, c, d, e, f]),
        way: start.way,
    }
}

/// `e' P^-1 e` with the first six rows and columns of a covariance, by elimination.
fn squared(p: &[[f32; 9]; 9], mut e: [f64; 6]) -> f64 {
    let mut p: [[f64; 6]; 6] =
        core::array::from_fn(|i| core::array::from_fn(|j| f64::from(p[i][j])));
    for k in 0..6 {
        for i in k + 1..6 {
            let factor = p[i][k] / p[k][k];
            let row = p[k];
            for (entry, of) in p[i].iter_mut().zip(row).skip(k) {
                *entry -= factor * of;
            }
            e[i] -= factor * e[k];
        }
    }
    (0..6).map(|k| e[k] * e[k] / p[k][k]).sum()
}

#[test]
fn a_car_with_any_sensor_starts_when_it_drives_off() {
    for (name, errors) in [
        ("consumer", CONSUMER),
        ("STIM300", STIM300),
        ("laser", LASER),
    ] {
        let case = Case::new(world::car, errors, true);
        let all = case.starts(&format!("car, {name}"), 30, 40);
        assert!(all.iter().all(|o| o.time > 20.0));
        let north = Case {
            latitude: 85.0 * DEG,
            ..case
        };
        north.starts(&format!("car at 85 deg, {name}"), 20, 40);
    }
}

#[test]
fn a_car_that_reverses_out_first_is_not_taken_for_its_mirror_image() {
    let case = Case::new(world::reversing, CONSUMER, true);
    case.starts("reversing", 30, 60);
}

#[test]
fn a_ship_in_waves_starts_in_a_turn() {
    for (name, errors) in [("consumer", CONSUMER), ("STIM300", STIM300)] {
        let case = Case::new(world::ship, errors, false);
        let all = case.starts(&format!("ship, {name}"), 40, 120);
        assert!(all.iter().all(|o| o.way == HeadingSource::Velocity));
    }
}

#[test]
fn an_aircraft_in_banked_turns_from_the_start_is_levelled_first() {
    for (name, errors) in [("consumer", CONSUMER), ("STIM300", STIM300)] {
        let case = Case::new(world::aircraft, errors, false);
        case.starts(&format!("aircraft, {name}"), 30, 120);
    }
}

/// Biases of a third, a tenth or ten times the unit file's neither keep a vehicle from starting nor
/// falsify its start.
#[test]
fn biases_far_from_the_unit_file_do_not_falsify_the_start() {
    for (name, motion, rolls, until) in [
        ("car", world::car as Motion, true, 60),
        ("reversing", world::reversing, true, 60),
        ("ship", world::ship, false, 120),
        ("aircraft", world::aircraft, false, 120),
    ] {
        for (of, errors) in [("consumer", CONSUMER), ("STIM300", STIM300)] {
            for share in [0.3, 0.1, 10.0] {
                let case = Case::new(motion, errors, rolls).sheet(share);
                case.starts(&format!("{name}, {of}, {share} of the biases"), 30, until);
            }
        }
    }
}

/// Straight on for ever: neither velocities nor the course, which may be reversed, give a heading.
#[test]
fn a_straight_drive_at_constant_speed_gives_no_heading() {
    for rolls in [false, true] {
        for (errors, latitude) in [(CONSUMER, 0.8), (STIM300, 0.8), (LASER, 85.0 * DEG)] {
            let case = Case {
                latitude,
                ..Case::new(world::straight, errors, rolls)
            };
            for seed in 1..=3 {
                let (outcome, progress) = case.run(seed, 900, |_, _| {});
                assert!(outcome.is_none(), "{rolls} {outcome:?} {progress:?}");
            }
        }
    }
}

/// A car whose forward axis is not where the configuration says starts by its velocities.
#[test]
fn a_wrong_mounting_is_found_out() {
    let mut sideways = Case::new(world::car, STIM300, true);
    sideways.config.forward = [0.0, 1.0, 0.0];
    for seed in 1..=8 {
        let (outcome, progress) = sideways.run(seed, 300, |_, _| {});
        let outcome = outcome.unwrap_or_else(|| panic!("{seed}: {progress:?}"));
        let [error, sigma] = outcome.heading;
        assert!(
            outcome.way == HeadingSource::Velocity,
            "{seed}: {outcome:?}"
        );
        assert!(error.abs() <= 4.0 * sigma, "{seed}: {outcome:?}");
    }
}

/// Where nobody knows the forward axis, the heading comes from the velocities alone, at once. A
/// heading of the vehicle that is given is none of the sensor.
#[test]
fn an_unknown_mounting_makes_no_heading_of_the_course() {
    let mut unknown = Case::new(world::car, STIM300, true);
    unknown.config.forward = [0.0; 3];
    let wrong: fn(&mut Fix, f64) = |fix, _| {
        fix.heading = Some(Heading {
            angle: 2.0,
            sigma: 0.03,
        });
    };
    for seed in 1..=8 {
        let (outcome, progress) = unknown.run(seed, 300, wrong);
        let outcome = outcome.unwrap_or_else(|| panic!("{seed}: {progress:?}"));
        let [error, sigma] = outcome.heading;
        assert_eq!(
            (outcome.way, progress.refused),
            (HeadingSource::Velocity, 0),
            "{seed}"
        );
        assert!(error.abs() <= 4.0 * sigma, "{seed}: {outcome:?}");
    }
}

/// Positions that jump, as those among houses do, do not keep a receiver with velocities from
/// aligning: nothing of the velocities before a jump is lost.
#[test]
fn positions_that_jump_do_no_harm_beside_velocities() {
    let jumps: fn(&mut Fix, f64) = |fix, time| {
        let side = f64::from(u8::from(((time / 5.0) as u32).is_multiple_of(2)));
        fix.position = fix.position.displaced([40.0 * side, -60.0 * side, 0.0]);
    };
    for (name, motion, rolls) in [
        ("car", world::car as Motion, true),
        ("ship", world::ship, false),
    ] {
        let case = Case::new(motion, STIM300, rolls);
        for seed in 1..=8 {
            let (outcome, progress) = case.run(seed, 60, jumps);
            let outcome = outcome.unwrap_or_else(|| panic!("{name} {seed}: {progress:?}"));
            let [error, sigma] = outcome.heading;
            assert!(error.abs() <= 4.0 * sigma, "{name} {seed}: {outcome:?}");
            assert_eq!(progress.refused, 0, "{name} {seed}");
        }
    }
}

/// Data that contradicts itself is refused and never starts the navigator.
#[test]
fn contradictions_are_refused() {
    let car = Case::new(world::car, STIM300, true);
    let doubled: fn(&mut Fix, f64) = |fix, _| fix.velocity = fix.velocity.map(|v| 2.0 * v);
    let frozen: fn(&mut Fix, f64) = |fix, time| {
        if time > 22.0 {
            fix.velocity = [1.0, 0.4, 0.0];
        }
    };
    for (name, case, spoil) in [
        ("another unit", car, Some(doubled)),
        ("frozen", car, Some(frozen)),
    ] {
        for seed in 1..=8 {
            let (outcome, progress) = case.run(seed, 300, |fix, time| {
                if let Some(spoil) = spoil {
                    spoil(fix, time);
                }
            });
            assert!(outcome.is_none(), "{name} {seed}: {outcome:?}");
            assert!(progress.refused > 0, "{name} {seed}: {progress:?}");
        }
    }
}
