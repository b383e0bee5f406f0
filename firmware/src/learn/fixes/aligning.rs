//! The alignment in motion, fed with the learner's fixes, and how the navigator starts from it.

use super::FixLearner;
use super::course::Course;
use super::start::Starting;
use super::take::Fresh;
use crate::align::motion::{self, AlignedState, InMotion};
use crate::align::{Align, MAX_NORTH};
use crate::configuration::VehicleKind;
use crate::fix::Fix;
use crate::learn::quantise::divisor;
use crate::nav;

/// A standstill of this length may become one that shows north, s.
const STANDS_S: f64 = 3.0;

impl FixLearner<'_> {
    /// The alignment in motion takes a fix, and starts the navigator when it is good enough. It
    /// waits for a standstill that will show north.
    pub(super) fn align_in_motion(&mut self, fresh: &Fresh) -> Option<()> {
        let Fresh { fix, age, stands } = *fresh;
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
        let found = motion.fix(&fix, stands, [age, sigma], &mut self.memory.scratch.block)?;
        if self.waits(&fix) {
            return None;
        }
        let variance = AlignedState::sigmas(&self.memory.scratch.block).map(|sigma| sigma * sigma);
        self.navigate_since(&Starting {
            number: self.number(),
            way: found.way,
            residual: found.residual,
            at: Some((fresh.at_rest(), age)),
            known: Some((found.applied, found.observed)),
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
            && Align::predicted_heading(&sensors, latitude, self.settings.align_s) <= MAX_NORTH
    }
}
