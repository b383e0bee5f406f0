//! The learner on the true motions of the alignment in motion: starts, losses, gaps, headings.

use super::*;
use crate::align::motion::tests::world::{self, CONSUMER, Errors, LASER, Motion, STIM300, World};
use crate::compensator::{Compensator, Limit};
use crate::configuration::VehicleKind;
use crate::control::HeadingSource;

/// Samples a second.
const RATE: u32 = 100;

/// A learner under way in a world.
pub(super) struct Trip<'m> {
    pub(super) learner: FixLearner<'m>,
    compensator: (Compensator, crate::compensator::State),
    world: World,
    number: u32,
    /// Change of a fix.
    spoil: fn(&mut Fix),
    /// Receiver's time at the start, ms of the week.
    week_ms: u32,
    /// Two antennas measure the heading with this constant error.
    pub(super) antenna: Option<f64>,
}

impl<'m> Trip<'m> {
    pub(super) fn new(
        memory: &'m mut Memory,
        motion: Motion,
        errors: Errors,
        kind: VehicleKind,
        seed: u64,
    ) -> Trip<'m> {
        let limit = Limit {
            gyro: 1.0,
            accel: 1.0,
        };
        let nets = Nets::NONE;
        let (lsb, period) = (world::LSB, world::SAMPLE_S);
        let compensator =
            Compensator::new(nets.gyro, nets.accel, lsb, period, RATE as u16, limit).unwrap();
        let [gyro_bias, accel_bias] = errors.bias.map(|x| x as f32);
        let [gyro, accel] = errors.noise.map(|x| x as f32);
        let mut settings = Settings {
            noise: nav::Noise { gyro, accel },
            vehicle: kind,
            fix_age_s: 0.0,
            ..Settings::MEDIUM
        };
        (settings.sheet.gyro_bias, settings.sheet.accel_bias) = (gyro_bias, accel_bias);
        settings.sheet.scale = errors.scale.map(|x| x as f32);
        settings.sheet.misalignment = settings.sheet.scale;
        let mut learner = FixLearner::new(memory, settings);
        learner.begin(&nets, compensator.scale());
        Trip {
            learner,
            compensator: (compensator, crate::compensator::State::default()),
            world: World::new(motion, 0.8, errors, seed),
            number: u32::MAX,
            spoil: |_| {},
            week_ms: 0,
            antenna: None,
        }
    }

    /// Runs for a number of seconds; without samples if `lost`.
    pub(super) fn run(&mut self, seconds: u32, lost: bool) {
        for _ in 0..seconds {
            for _ in 0..RATE {
                self.number = self.number.wrapping_add(1);
                let counts = self.world.sample();
                if lost {
                    continue;
                }
                let sample = RawSample::Counts {
                    gyro: counts.dtheta,
                    accel: counts.dv,
                };
                self.learner.sample(self.number, &sample);
                let (compensator, state) = &mut self.compensator;
                if let Some(block) = compensator.accumulate(state, &sample) {
                    self.learner.block(self.number, &block);
                }
            }
            let mut fix = self.world.fix();
            (self.spoil)(&mut fix);
            fix.time_ms = (fix.time_ms + self.week_ms) % 604_800_000;
            fix.heading = self.antenna.map(|off| Heading {
                angle: (self.world.heading() + off) as f32,
                sigma: 0.03,
            });
            if !lost {
                self.learner.fix(self.number, &fix);
            }
        }
    }

    /// Until it navigates; how many seconds that took.
    fn start(&mut self, at_most: u32) -> Option<u32> {
        (1..=at_most).find(|_| {
            self.run(1, false);
            self.learner.report().navigates
        })
    }

    /// The largest error of the heading over so many seconds, in its standard deviations.
    fn worst(&mut self, seconds: u32) -> f64 {
        (0..seconds).fold(0.0, |worst, _| {
            self.run(1, false);
            let report = self.learner.report();
            assert!(report.navigates, "{}: {report:?}", self.world.time);
            let [error, sigma] = self.heading();
            worst.max(error.abs() / sigma)
        })
    }

    /// Error of the heading and what the learner says of it, rad.
    fn heading(&mut self) -> [f64; 2] {
        let q = self.learner.nav().expect("it navigates").q_bn;
        let [.., error] = world::error(q, self.world.attitude());
        [error, f64::from(self.learner.report().heading_sigma)]
    }
}

/// The learner starts with any sensor, and stays within what it says of its heading.
#[test]
fn it_starts_in_motion_and_stays_there() {
    use VehicleKind::{Air, Land, Ship};
    let cases: [(&str, Motion, Errors, VehicleKind); 6] = [
        ("car, consumer", world::car, CONSUMER, Land),
        ("car, STIM300", world::car, STIM300, Land),
        ("ship, STIM300", world::ship, STIM300, Ship),
        ("ship, consumer", world::ship, CONSUMER, Ship),
        ("aircraft, STIM300", world::aircraft, STIM300, Air),
        ("aircraft, consumer", world::aircraft, CONSUMER, Air),
    ];
    let mut memory = memory();
    for (name, motion, errors, kind) in cases {
        for seed in 1..=4 {
            let mut trip = Trip::new(&mut memory, motion, errors, kind, seed);
            let after = trip.start(150).expect(name);
            let started = *trip.learner.started().expect(name);
            assert!(f64::from(after) - 1.0 <= started.time_s && started.sigmas[2] <= 0.2);
            assert!(matches!(
                started.way,
                HeadingSource::Velocity | HeadingSource::Course
            ));
            // what the alignment has learnt is not lost: the claim begins where it ended
            let [off, claimed] = trip.heading();
            assert!(
                off.abs() < 4.0 * claimed && claimed < 2.0 * f64::from(started.sigmas[2]),
                "{name} {seed}: {off:.3} of {claimed:.3}, {:.3} before",
                started.sigmas[2]
            );
            let worst = trip.worst(60);
            let report = trip.learner.report();
            let [later, sigma] = trip.heading();
            println!(
                "{name} {seed}: {after} s, {:.3} rad; a minute later {later:.3} of {sigma:.3} rad, \
                 at worst {worst:.1} sigma; hypothesis {}, {:?}",
                started.sigmas[2],
                trip.learner.bank().leading(),
                report.way
            );
            assert!(
                worst < 4.0 && report.refused_alignments == 0,
                "{name} {seed}"
            );
        }
    }
}

/// A standstill that will show north is waited for, as before; the car only drives off after it.
#[test]
fn a_sensor_that_finds_north_waits_for_it() {
    let mut memory = memory();
    let mut trip = Trip::new(&mut memory, late, LASER, VehicleKind::Land, 1);
    let after = trip.start(110).expect("it stands for 150 s");
    assert!((100..=104).contains(&after), "{after}");
    assert_eq!(trip.learner.report().way, HeadingSource::Gyrocompass);
    // one that drives off before does not wait for another standstill
    let mut trip = Trip::new(&mut memory, world::car, LASER, VehicleKind::Land, 1);
    let after = trip.start(40).expect("it drives off after 20 s");
    assert!(after < 30 && trip.learner.report().way != HeadingSource::Gyrocompass);
}

/// Silence while driving: the navigator is lost, and comes back in motion.
#[test]
fn it_comes_back_in_motion_after_a_silence() {
    let mut memory = memory();
    for (errors, kind, motion) in [
        (STIM300, VehicleKind::Land, world::car as Motion),
        (CONSUMER, VehicleKind::Land, world::car),
        (STIM300, VehicleKind::Ship, world::ship),
    ] {
        for seed in 1..=3 {
            let mut trip = Trip::new(&mut memory, motion, errors, kind, seed);
            trip.start(60).expect("it starts");
            trip.run(30, false);
            let leads = trip.learner.bank().leading();
            let learnt = *trip.learner.bank().estimate();
            trip.learner.silence();
            assert!(!trip.learner.report().navigates);
            assert_eq!(trip.learner.bank().leading(), leads);
            assert_eq!(*trip.learner.bank().estimate(), learnt);
            let after = trip.start(100).expect("it comes back");
            let worst = trip.worst(30);
            println!("{kind:?} {seed}: back after {after} s, at worst {worst:.1} sigma");
            assert!(worst < 4.0, "{seed}: {worst}");
        }
    }
}

/// A laser gyro that has stood for 150 s is aligned; then the car drives off.
fn late(t: f64) -> (world::V, world::V) {
    world::car(t - 130.0)
}

/// A gap is bridged while the motion before it leaves the attitude known: at rest for seconds, in a
/// turn not. A minute is too long in any case.
#[test]
fn gaps_are_bridged_by_what_the_vehicle_did_before() {
    let mut memory = memory();
    // the car turns with 0.4 rad/s at 193 s
    for (at, seconds, bridged) in [(125, 5, true), (125, 60, false), (193, 5, false)] {
        for seed in 1..=3 {
            let mut trip = Trip::new(&mut memory, late, LASER, VehicleKind::Land, seed);
            trip.run(at, false);
            assert!(trip.learner.report().navigates);
            trip.run(seconds, true);
            trip.run(2, false);
            let report = trip.learner.report();
            assert_eq!(report.navigates, bridged, "{at} {seconds} {seed}");
            if !bridged {
                let after = trip.start(60).expect("it comes back");
                println!("gap of {seconds} s at {at} s: back after {after} s");
            }
            let worst = trip.worst(20);
            assert!(worst < 4.0, "{at} {seconds} {seed}: {worst}");
            assert_eq!(trip.learner.report().refused_alignments, 0);
        }
    }
}

/// East before north: while the car drives straight on that is a heading as good as any. The first
/// turn shows that it was wrong.
#[test]
fn a_mirrored_receiver_is_found_out_in_the_first_turn() {
    let mut memory = memory();
    for seed in 1..=4 {
        let mut trip = Trip::new(&mut memory, world::car, STIM300, VehicleKind::Land, seed);
        trip.spoil = |fix| fix.velocity.swap(0, 1);
        trip.run(60, false);
        let report = trip.learner.report();
        assert!(!report.navigates, "{seed}: {report:?}");
        assert!(report.refused_alignments > 0, "{seed}: {report:?}");
    }
}

/// A receiver without vertical velocity and height aligns. One without any velocity does so later,
/// by positions that are good to a decimetre.
#[test]
fn values_may_be_missing() {
    let mut memory = memory();
    type Spoils = (fn(&mut Fix), u32);
    let of: [Spoils; 2] = [
        (|fix| fix.sigmas[2] = f32::INFINITY, 60),
        (|fix| fix.sigmas[3..].fill(f32::INFINITY), 60),
    ];
    for (spoil, at_most) in of {
        for seed in 1..=4 {
            let mut errors = STIM300;
            let [.., position] = &mut errors.receiver;
            *position = 0.1;
            let mut trip = Trip::new(&mut memory, world::car, errors, VehicleKind::Land, seed);
            trip.spoil = spoil;
            let after = trip.start(at_most).expect("it starts");
            let [error, sigma] = trip.heading();
            println!("{seed}: {after} s, {error:.3} of {sigma:.3} rad");
            assert!(
                error.abs() < 4.0 * sigma,
                "{seed}: {error:.3} of {sigma:.3}"
            );
            let worst = trip.worst(60);
            assert!(worst < 4.0, "{seed}: {worst}");
        }
    }
    let mut trip = Trip::new(&mut memory, world::car, STIM300, VehicleKind::Land, 1);
    trip.spoil = |fix| {
        fix.velocity[2] = f64::NAN;
        (fix.sigmas[5], fix.position.height) = (f32::INFINITY, f64::NAN);
        fix.sigmas[2] = f32::INFINITY;
    };
    trip.start(60)
        .expect("two components of velocity are enough");
    let [error, sigma] = trip.heading();
    assert!(error.abs() < 4.0 * sigma);
}

/// With a given heading, or one that two antennas measure, it starts at rest.
#[test]
fn a_given_heading_is_believed_as_far_as_it_says() {
    let mut memory = memory();
    for (errors, given) in [(STIM300, true), (STIM300, false), (CONSUMER, true)] {
        for seed in 1..=6 {
            let mut trip = Trip::new(&mut memory, world::car, errors, VehicleKind::Land, seed);
            let heading = |angle: f64| Heading {
                angle: angle as f32,
                sigma: 0.03,
            };
            let truth = trip.world.heading();
            assert_eq!(
                trip.learner.heading(heading(0.0)),
                Err(Reason::NotAvailable)
            );
            trip.run(2, false);
            for (angle, sigma) in [(f32::NAN, 0.1), (7.0, 0.1), (1.0, 0.0), (1.0, 2.0)] {
                let refused = trip.learner.heading(Heading { angle, sigma });
                assert_eq!(refused, Err(Reason::Range));
            }
            let off = 0.03 * [1.0, -1.5, 0.3, 2.0, -0.2, 0.8][seed as usize - 1];
            if given {
                trip.learner.heading(heading(truth + off)).unwrap();
            } else {
                trip.antenna = Some(off);
            }
            let after = trip.start(17).expect("at rest");
            let started = *trip.learner.started().unwrap();
            assert_eq!(started.way, HeadingSource::Heading);
            let [error, _] = trip.heading();
            println!(
                "{given} {seed}: after {after} s, {error:.3} of {:.3}",
                started.sigmas[2]
            );
            assert!(error.abs() < 3.0 * f64::from(started.sigmas[2]));
            assert!(started.sigmas[2] > 0.025, "its error may stay the same");
            assert_eq!(trip.learner.heading(heading(0.0)), Err(Reason::Alignment));
        }
    }
}

/// A week of the receiver that ends during the alignment changes no bit, with positions alone
/// either.
#[test]
fn the_end_of_a_week_does_not_change_the_start() {
    let mut memory = memory();
    let mut outcome = |spoil, week_ms| {
        let mut errors = STIM300;
        let [.., position] = &mut errors.receiver;
        *position = 0.1;
        let mut trip = Trip::new(&mut memory, world::car, errors, VehicleKind::Land, 2);
        (trip.spoil, trip.week_ms) = (spoil, week_ms);
        trip.run(80, false);
        let started = *trip.learner.started().expect("it navigates");
        assert!(started.time_s > 22.0, "{started:?}");
        (started, trip.learner.nav(), trip.learner.report())
    };
    let all: [fn(&mut Fix); 2] = [|_| {}, |fix| fix.sigmas[3..].fill(f32::INFINITY)];
    for spoil in all {
        assert_eq!(outcome(spoil, 0), outcome(spoil, 604_778_000));
    }
}
