//! The alignment in motion, fed with the learner's fixes, and how the navigator starts from it.

use super::FixLearner;
use super::course::Course;
use super::start::Starting;
use crate::align::Align;
use crate::align::motion::{self, Found, InMotion, MAX_HEADING};
use crate::configuration::VehicleKind;
use crate::fix::{Fix, Position, ms_since};
use crate::learn::quantise::divisor;
use crate::nav;
use crate::nav::vector::scale as times;

/// A standstill of this length may become one that shows north, s.
const STANDS_S: f64 = 3.0;
/// The longest time between two positions that give a velocity, s.
const BETWEEN_S: f32 = 1.5;
/// The largest age of a velocity, s: that of the navigator.
const OLDEST_S: f32 = 1.0;

/// Position of the vehicle by a receiver without velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    position: Position,
    sigmas: [f32; 3],
    time_ms: u32,
}

impl Seen {
    fn of(fix: &Fix) -> Seen {
        let [n, e, d, ..] = fix.sigmas;
        Seen {
            position: fix.position,
            sigmas: [n, e, d],
            time_ms: fix.time_ms,
        }
    }

    /// Position and mean velocity halfway between this and a fix, with its age. The fix has a
    /// position.
    fn halfway(&self, fix: &Fix, age: f32) -> Option<(Fix, f32)> {
        let time = ms_since(self.time_ms, fix.time_ms) as f32 * 1e-3;
        let age = age + 0.5 * time;
        if !(time > 0.0 && time <= BETWEEN_S && age <= OLDEST_S) {
            return None;
        }
        let way = fix.position.ned_from(&self.position);
        let mut between = *fix;
        between.position = self.position.displaced(times(way, 0.5));
        between.velocity = times(way, 1.0 / f64::from(time));
        let [a, b, c, velocity @ ..] = &mut between.sigmas;
        let now = [*a, *b, *c];
        for ((to, now), before) in velocity.iter_mut().zip(now).zip(self.sigmas) {
            *to = libm::hypotf(now, before) / time;
        }
        Some((between, age))
    }
}

impl FixLearner<'_> {
    /// The velocity of a fix without one, from its position and the one before.
    fn with_velocity(&mut self, fix: &Fix, age: f32) -> Option<(Fix, f32)> {
        if fix.has(3..5) || !fix.has(0..2) {
            self.navigation.seen = None;
            return Some((*fix, age));
        }
        let before = self.navigation.seen.replace(Seen::of(fix))?;
        before.halfway(fix, age)
    }

    /// The alignment in motion takes a fix, and starts the navigator when it is good enough. It
    /// waits for a standstill that will show north. `still`: the vehicle stands.
    pub(super) fn align_in_motion(&mut self, fix: &Fix, age: f32, still: bool) -> Option<()> {
        let (fix, age) = &self.with_velocity(fix, age)?;
        let age = *age;
        let (stream, scale) = (self.samples.stream?, self.samples.scale?);
        let known = *self.memory.bank.navigating_estimate();
        let settings = &self.settings;
        let sheet = &settings.sheet;
        if let Course::Waits = self.navigation.course {
            let mut config = nav::Config::new(scale.lsb, stream.period_s, settings.noise);
            config.lever_arm = self.memory.antenna.arm();
            config.piece_samples = divisor(stream.block_samples, config.piece_samples);
            let bias = [sheet.gyro_bias, sheet.accel_bias];
            let walk = |i: usize| bias[i] * sheet.walk_per_hour[i] / 60.0;
            let config = motion::Config {
                navigator: config,
                bias,
                walk: [walk(0), walk(1)],
                scale: settings.in_proportion(),
                forward: settings.forward,
                lever_arm_sigma: settings.lever_arm_sigma,
                rolls: settings.vehicle == VehicleKind::Land,
                stands: settings.vehicle != VehicleKind::Ship,
            };
            self.navigation.course = Course::Aligns(InMotion::new(config, known));
        }
        let motion = self.navigation.course.motion_mut()?;
        let sigma = if fix.age.is_some() {
            0.0
        } else {
            self.memory.antenna.age_sigma()
        };
        let found = motion.fix(fix, [age, sigma], still, &mut self.scratch.block)?;
        if self.waits(fix) {
            return None;
        }
        let variance = Found::sigmas(&self.scratch.block).map(|sigma| sigma * sigma);
        self.navigate_since(&Starting {
            number: self.number(),
            way: found.way,
            residual: found.residual,
            at: Some((*fix, age)),
            known: Some((found.applied, found.shown)),
            ..Starting::new(found.state, variance)
        })
    }

    /// The vehicle stands, and this will show north.
    fn waits(&self, fix: &Fix) -> bool {
        let Some(align) = &self.navigation.align else {
            return false;
        };
        let sensors = self.settings.sensors();
        let latitude = fix.position.latitude;
        (align.gathered() >= STANDS_S || align.is_solved())
            && Align::predicted_heading(&sensors, latitude, self.settings.align_s) <= MAX_HEADING
    }
}
