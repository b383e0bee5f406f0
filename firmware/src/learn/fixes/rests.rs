//! What rests teach, with and without a receiver: the gyros' errors, and that the velocity is zero.
//!
//! The mean rate of a rest of `T` seconds is the gyros' error and the Earth's rotation. Its own
//! errors are white noise, the angles by which a standing vehicle sways at both ends, and what is
//! not known of the Earth's rotation in the sensor's axes:
//!
//! ```text
//! variance = noise^2 / T + walk^2 T / 2 + 2 sway^2 / T^2 + unknown^2
//! ```
//!
//! The bias itself walks. So the mean is of the last seconds of the rest only, as many as make the
//! first two terms equal, and a rest that lasts teaches anew each time that so many have passed. It
//! does not if the gyros are known so well that what is not known of the Earth's rotation, the same
//! each time, would count twice.
//!
//! While nothing navigates, nothing is known of the Earth's rotation: what a rest teaches then is
//! no better than that. While the navigator runs, its attitude gives it: with `C_est = (I - phi x)
//! C_true`, the mean rate less `C_est' w` is the gyros' error and `C' (w x phi)`. That part is in
//! the observation, because the attitude of a gyrocompass has errors by the same gyros: what looked
//! like the Earth's rotation there must not be news here.
//!
//! Until then a rest teaches each time that it knows a quarter more. What it has taught already
//! must not count twice: with the mean m and the information I = 1 / variance, before and now, the
//! news are
//!
//! ```text
//! z = (I m - I_0 m_0) / (I - I_0)       variance 1 / (I - I_0)
//! ```
//!
//! What gravity adds to a gyro by its g-sensitivity counts as its bias, as everywhere here.
//! Accelerometers learn nothing directly: their mean is gravity on an unknown tilt.

use super::FixLearner;
use super::observe::{DEPARTURE, STANDS_MPS, STILL_MPS, STILL_S};
use crate::align::{Align, Rest};
use crate::configuration::VehicleKind;
use crate::fix::{NOT_MEASURED, OBSERVATIONS};
use crate::learn::Resting;
use crate::learn::bank::Row;
use crate::learn::prior::NAV;
use crate::learn::quantise::split;
use crate::nav;
use crate::nav::earth::{Local, OMEGA_IE};
use crate::nav::vector::{V32, add, cross, narrow, rotated, scale};

/// Sway of a standing vehicle by people and wind, rad (assumed, as in
/// `host_sim::learning::teacher`).
const SWAY: f32 = 1e-4;
/// How much more vibration adds to a mean than white noise of its scatter would: it has low
/// frequencies as well (assumed).
const COLOUR: f32 = 4.0;
/// Shortest mean of a rest that teaches, s: a vehicle on a smooth road turns evenly for little
/// longer than that and what is left out of it (assumed).
const LEAST_S: f32 = 3.0;
/// Information, in units of what has been taught, from which a rest teaches again.
const MORE: f32 = 1.25;
/// What is not known of the Earth's rotation while the attitude is known, rad/s, beside the second
/// order of the attitude's error.
const LEAST_UNKNOWN: f32 = 1e-8;
/// A vehicle stands if the navigator's velocity is less than this, m/s, and so many standard
/// deviations.
const STANDS_SIGMAS: f32 = 5.0;
/// No rest while the navigator is faster than this, m/s, until the sensors have been at rest for so
/// long, s; and than this, ever (assumed).
const FAST_MPS: f32 = 3.0;
const LONG_S: f32 = 30.0;
const FASTEST_MPS: f32 = 10.0;
/// Standard deviations of noise beyond which a mean is an error.
const SURE: f32 = 3.0;
/// Time without a fix from which a rest shows the velocity, s; and between two of its observations.
const ALONE_S: f32 = 2.0;
const EVERY_S: f32 = 1.0;

/// Information on the gyros' errors from the rest in progress.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rests {
    /// Information, s2/rad2, and mean error of the gyros, rad/s.
    information: f32,
    mean: V32,
    /// Time of the mean and of the rest, s, and doubt of the mean, rad/s: see [`Resting`].
    seconds: f32,
    stood_s: f32,
    doubt: f32,
    /// Before the first rest: mean and variance of each gyro's error.
    before: Option<[V32; 2]>,
    /// Rests that have taught.
    number: u32,
    /// Time since the last fix, and since the last observation of the velocity, s.
    since_fix_s: f32,
    since_zero_s: f32,
}

/// Mean of a rest.
#[derive(Debug, Clone, Copy)]
struct RestMean {
    /// Errors of the gyros, rad/s.
    mean: V32,
    /// Variance by noise, walk and sway, and what is not known of the Earth's rotation, rad/s.
    noise: f32,
    unknown: f32,
    /// Time of the mean, and of the rest, s.
    seconds: f32,
    stood_s: f32,
}

/// News of a rest: errors of the gyros, rad/s, and the variance of each.
#[derive(Debug, Clone, Copy, PartialEq)]
struct News {
    errors: V32,
    variance: f32,
}

impl Rests {
    /// Rests that have taught.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Time since the last fix, s.
    pub fn since_fix_s(&self) -> f32 {
        self.since_fix_s
    }

    /// A fix was used.
    pub fn fix(&mut self) {
        self.since_fix_s = 0.0;
    }

    /// The rest in progress, less the Earth's rotation as far as it is known. `known`: standard
    /// deviation of the gyro's error that is known least, rad/s.
    fn rest(&mut self, rest: Option<RestMean>, known: f32) -> Option<News> {
        let Some(RestMean {
            mean,
            noise,
            unknown,
            seconds,
            stood_s,
        }) = rest
        else {
            (self.information, self.seconds, self.stood_s) = (0.0, 0.0, 0.0);
            return None;
        };
        if stood_s < self.stood_s {
            self.information = 0.0; // another one
        }
        // the mean is of a time that has not taught yet
        let again = stood_s >= self.stood_s + seconds;
        let before = if again && known * known > 2.0 * unknown * unknown {
            0.0
        } else {
            self.information
        };
        let information = 1.0 / (noise + unknown * unknown);
        let more = information - before;
        if !(more > (MORE - 1.0) * before && information.is_finite()) {
            return None;
        }
        if self.information == 0.0 {
            self.number = self.number.saturating_add(1);
        }
        let news = |i: usize| (information * mean[i] - before * self.mean[i]) / more;
        let errors = core::array::from_fn(news);
        (self.information, self.mean) = (information, mean);
        (self.seconds, self.stood_s) = (seconds, stood_s);
        self.doubt = unknown + SURE * libm::sqrtf(noise);
        Some(News {
            errors,
            variance: 1.0 / more,
        })
    }
}

impl FixLearner<'_> {
    /// A block has ended: a rest in progress teaches. The interval up to now must be processed.
    pub(super) fn learn_from_rest(&mut self) {
        if let Some(stream) = &self.samples.stream {
            self.motion.rests.since_fix_s += stream.block_s();
            self.motion.rests.since_zero_s += stream.block_s();
        }
        if self.settings.vehicle == VehicleKind::Ship {
            return;
        }
        let rest = self
            .navigation
            .align
            .as_ref()
            .and_then(Align::rest)
            .filter(|rest| rest.seconds >= LEAST_S && self.may_stand(rest.stood_s));
        let of_gyros = rest.map(|rest| self.of_gyros(&rest));
        if self.motion.rests.before.is_none() && of_gyros.is_some() {
            let bank = &self.memory.bank;
            let [mean, _] = split(bank.estimate_of(bank.biases()));
            let [sigma, _] = split(&bank.bias_sigma());
            self.motion.rests.before = Some([mean, sigma.map(|sigma| sigma * sigma)]);
        }
        let [gyros, _] = split(&self.memory.bank.bias_sigma());
        let known = gyros.into_iter().fold(0.0, f32::max);
        if let Some(News { errors, variance }) = self.motion.rests.rest(of_gyros, known) {
            let by = self.by_attitude();
            let shown: [Row; 3] = core::array::from_fn(|i| Row {
                z: errors[i],
                by: by[i],
                variance,
            });
            // refusals count beside fixes only: no number of even turns is a rest
            let counts = self.motion.rests.since_fix_s < ALONE_S;
            self.memory.bank.rest(&shown, counts);
        }
        self.learn_from_zero_velocity();
    }

    /// Whether the navigator's velocity may be zero after `stood_s` seconds; true while nothing
    /// navigates. A navigator that knows little would take any smooth cruise for a rest.
    fn may_stand(&self, stood_s: f32) -> bool {
        let Some(navigator) = self.navigation.course.navigator() else {
            return true;
        };
        let bank = &self.memory.bank;
        let velocity = narrow(navigator.state().velocity);
        let most = if stood_s < LONG_S {
            FAST_MPS
        } else {
            FASTEST_MPS
        };
        let mut axes = velocity.into_iter().enumerate();
        axes.all(|(i, v)| {
            let doubt = STANDS_SIGMAS * bank.error_doubt(3 + i);
            v.abs() <= STANDS_MPS.max(doubt.min(most))
        })
    }

    /// What an error of the navigator adds to the mean rate less the Earth's rotation, for each
    /// gyro.
    fn by_attitude(&self) -> [[f32; NAV]; 3] {
        let mut by = [[0.0; NAV]; 3];
        if let Some(navigator) = self.navigation.course.navigator() {
            let nav::State { position, q_bn, .. } = navigator.state();
            let [w, x, y, z] = q_bn;
            let earth = Local::at(position.latitude, position.height).omega_ie();
            for axis in 0..3 {
                let mut phi = [0.0; 3];
                phi[axis] = 1.0;
                let adds = rotated([w, -x, -y, -z], cross(earth, phi));
                for (by, adds) in by.iter_mut().zip(narrow(adds)) {
                    by[axis] = adds;
                }
            }
        }
        by
    }

    /// Time of the rest in progress, s; 0 without one.
    pub(super) fn rest_s(&self) -> u32 {
        let rest = self.navigation.align.as_ref().and_then(Align::rest);
        rest.map_or(0, |rest| rest.stood_s as u32)
    }

    /// What the rest in progress has taught.
    pub(super) fn resting(&self) -> Option<Resting> {
        let Rests {
            information,
            mean,
            doubt,
            before,
            ..
        } = self.motion.rests;
        let [memory, variance] = before.filter(|_| information > 0.0)?;
        // of this rest alone: an earlier one may have been none
        let gyro = core::array::from_fn(|i| {
            let share = information * variance[i] / (1.0 + information * variance[i]);
            memory[i] + share * (mean[i] - memory[i])
        });
        Some(Resting { gyro, doubt })
    }

    /// Errors of the gyros by a rest.
    fn of_gyros(&self, rest: &Rest) -> RestMean {
        let (earth, unknown) = self.earth_rate();
        let white = self.settings.noise.gyro;
        let sample_s = self.samples.stream.map_or(0.0, |stream| stream.period_s) as f32;
        let vibration = rest.scatter * rest.scatter / 3.0 * sample_s * COLOUR;
        let noise = (white * white).max(vibration);
        let sway = SWAY / rest.seconds;
        let walk = self.settings.sheet.gyro_walk();
        RestMean {
            mean: add(rest.rate, scale(earth, -1.0)),
            noise: noise / rest.seconds + 0.5 * walk * walk * rest.seconds + 2.0 * sway * sway,
            unknown,
            seconds: rest.seconds,
            stood_s: rest.stood_s,
        }
    }

    /// The Earth's rotation in the sensor's axes as far as it is known, and what is not known of
    /// it, rad/s.
    fn earth_rate(&self) -> (V32, f32) {
        let earth = OMEGA_IE as f32;
        let Some(navigator) = self.navigation.course.navigator() else {
            return ([0.0; 3], earth);
        };
        let nav::State { position, q_bn, .. } = navigator.state();
        let [w, x, y, z] = q_bn;
        let rate = Local::at(position.latitude, position.height).omega_ie();
        let doubt = self.memory.bank.error_doubt(2).min(1.0);
        let unknown = (earth * doubt * doubt).max(LEAST_UNKNOWN);
        (narrow(rotated([w, -x, -y, -z], rate)), unknown)
    }

    /// While no fixes come, a standstill shows the velocity.
    fn learn_from_zero_velocity(&mut self) -> Option<()> {
        let align = self.navigation.align.as_ref()?;
        let rest_s = align.rest().map_or(0.0, |rest| rest.stood_s);
        let stands = rest_s >= STILL_S as f32 && self.may_stand(rest_s);
        let rests = &mut self.motion.rests;
        if !stands || rests.since_fix_s < ALONE_S || rests.since_zero_s < EVERY_S {
            return None;
        }
        rests.since_zero_s = 0.0;
        let sigma = libm::hypotf(STILL_MPS, DEPARTURE * align.gain_mps());
        let navigator = self.navigation.course.navigator()?;
        let [north, east, down] = narrow(navigator.state().velocity);
        let z: [f32; OBSERVATIONS] = [0.0, 0.0, 0.0, north, east, down];
        let (none, sigma) = (NOT_MEASURED, sigma * sigma);
        let variance: [f32; OBSERVATIONS] = [none, none, none, sigma, sigma, sigma];
        let (bank, rehearsal) = (&mut self.memory.bank, &mut self.memory.rehearsal);
        rehearsal.fix(&z, &variance);
        // refusals do not count: no number of quiet moments makes a vehicle stand
        bank.fix(&z, &variance, false);
        rehearsal.start(bank);
        self.choose();
        Some(())
    }
}

#[cfg(test)]
mod tests;
