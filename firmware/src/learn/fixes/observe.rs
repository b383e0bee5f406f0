//! Processing of a fix: its age, its weight, whether the vehicle stands, and the observation that
//! the hypotheses get.

use super::FixLearner;
use super::take::{Compared, Fresh, Looked};
use crate::fix::{Fix, NOT_MEASURED, OBSERVATIONS, Position, ms_since};
use crate::nav;

/// Fixes closer to each other than this share a weight, ms: errors of receivers last for seconds,
/// so that all fixes of a second together weigh like one.
const FIX_MS: u32 = 900;
/// Fixes closer to each other than this are not all used, ms: at most five in a second.
const LEAST_MS: u32 = 180;
/// A fix waits no longer than this, s: samples are missing, or its time does not come.
const LONGEST_WAIT_S: f64 = 0.2;
/// A second, ms.
const SECOND_MS: f32 = 1000.0;
/// A vehicle that is faster by the receiver does not stand, m/s.
pub(super) const STANDS_MPS: f32 = 0.3;
/// A vehicle that is faster by the receiver is under way, m/s: no creeping (assumed).
const UNDER_WAY_MPS: f32 = 2.0;
/// Seconds after which a standstill is believed, and the standard deviation of its velocity, m/s
/// (as in `host_sim::learning::teacher`).
pub(super) const STILL_S: u32 = 3;
pub(super) const STILL_MPS: f32 = 0.01;
/// Weight of the velocity that may have been gained since: a departure always has the same sign, so
/// its errors do not average out as those of sway do (assumed).
pub(super) const DEPARTURE: f32 = 10.0;
/// A motion beyond so many standard deviations is one.
const SURE: f32 = 5.0;
/// Fixes whose mean velocity is taken.
const MEAN: f32 = 20.0;
/// Fixes in a row by which a vehicle that aligns itself by command moves nevertheless.
const MOVES: u8 = 5;

/// The receiver's mean velocity while the sensors are at rest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mean {
    velocity: [f32; 3],
    fixes: f32,
    /// Fixes in a row that show motion.
    moving: u8,
}

impl Mean {
    /// One more fix, whose velocity has the standard deviation `sigma`. The result is the size of
    /// the mean and its own standard deviation, m/s.
    fn takes(&mut self, velocity: &[f64; 3], sigma: f32) -> [f32; 2] {
        self.fixes = (self.fixes + 1.0).min(MEAN);
        for (mean, now) in self.velocity.iter_mut().zip(velocity) {
            *mean += (*now as f32 - *mean) / self.fixes;
        }
        let [n, e, d] = self.velocity;
        let size = libm::sqrtf(n * n + e * e + d * d);
        [size, sigma / libm::sqrtf(self.fixes)]
    }
}

/// Position at which the vehicle came to a standstill, by a receiver that measures no velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct StopPosition {
    position: Position,
    /// Number of the sample before it: the receiver's time may jump.
    number: u32,
}

impl Fresh {
    /// The fix; of a vehicle that stands, its velocity is zero.
    pub fn at_rest(&self) -> Fix {
        let at_rest = |sigma| self.fix.at_rest(sigma);
        self.stands.map_or(self.fix, at_rest)
    }
}

impl FixLearner<'_> {
    /// A fix that arrived after sample `number`.
    #[inline(never)]
    pub(super) fn look_at(&mut self, number: u32, fix: &Fix) -> Looked {
        self.looked_at(number, fix).unwrap_or(Looked::Unused)
    }

    /// `None`: the fix is not used.
    fn looked_at(&mut self, number: u32, fix: &Fix) -> Option<Looked> {
        let stream = self.samples.stream?;
        let least = self.memory.antenna.age();
        // an estimate of the age goes on by itself when the pulse stays away
        let keeps = self.memory.antenna.age_sigma() == 0.0;
        let age = self
            .fix_times
            .age
            .of(number, fix, stream.period_s, least, keeps);
        self.memory.antenna.jumps(self.fix_times.age.sooner_s());
        let since = self
            .fix_times
            .last_fix_ms
            .map(|last| ms_since(last, fix.time_ms));
        let enough = if self.navigation.course.navigates() {
            LEAST_MS
        } else {
            FIX_MS
        };
        if since.is_some_and(|ms| ms < enough) || fix.sigmas == [NOT_MEASURED; OBSERVATIONS] {
            return None;
        }
        self.navigation.align.as_ref()?;
        let waited = f64::from(self.number().wrapping_sub(number)) * stream.period_s;
        let Some(age) = age.filter(|_| waited <= LONGEST_WAIT_S) else {
            self.tally.late = self.tally.late.saturating_add(1);
            return None;
        };
        let age = age + waited as f32;
        self.fix_times.last_fix_ms = Some(fix.time_ms);
        let fresh = Fresh {
            fix: *fix,
            age,
            stands: self.stands(fix),
        };
        if !self.navigation.course.navigates() {
            return Some(Looked::Start(fresh));
        }
        let fix = fresh.at_rest();
        let mut variance = fix.sigmas.map(|sigma| sigma * sigma);
        let close = since.filter(|ms| *ms < FIX_MS);
        if let Some(ms) = close {
            variance = variance.map(|variance| variance * (SECOND_MS / ms as f32));
        }
        Some(Looked::Compare(Compared { fix, age, variance }))
    }

    /// Compares the navigator with the fix: estimate minus fix, and whether its refusals count.
    #[inline(never)]
    pub(super) fn compare(&mut self, compared: &Compared) -> Option<([f32; OBSERVATIONS], bool)> {
        let &Compared {
            ref fix,
            age,
            variance,
        } = compared;
        if let Some(stream) = &self.samples.stream {
            self.fix_times.pending.observed(stream);
        }
        let navigator = self.navigation.course.navigator()?;
        let z = if self.memory.antenna.estimates() {
            let sigma = if fix.age.is_some() {
                0.0
            } else {
                self.memory.antenna.age_sigma()
            };
            let mut innovation = navigator.antenna_innovation(fix, age, sigma);
            if fix.age.is_some() {
                innovation.age_is_known();
            }
            self.memory.antenna.fix(&innovation, &variance);
            if let (Some(_), Some(least)) = (fix.age, self.fix_times.age.measured_s()) {
                self.memory.antenna.measured(least);
            }
            innovation.z
        } else {
            let nav::Innovation { position, velocity } = navigator.innovation(fix, age);
            let ([a, b, c], [d, e, f]) = (position, velocity);
            [a, b, c, d, e, f]
        };
        self.tally.used = self.tally.used.saturating_add(1);
        Some((z, self.counts_refusals(fix)))
    }

    /// Refusals count once in a second, however many fixes it has.
    fn counts_refusals(&mut self, fix: &Fix) -> bool {
        let since = self
            .fix_times
            .counted_ms
            .map(|last| ms_since(last, fix.time_ms));
        let counts = since.is_none_or(|ms| ms >= FIX_MS);
        if counts {
            self.fix_times.counted_ms = Some(fix.time_ms);
        }
        self.memory.antenna.counts_refusals(counts);
        counts
    }

    /// Whether the vehicle stands, by receiver and sensors together: the standard deviation of its
    /// velocity, m/s, if that is better than the receiver's.
    ///
    /// Sensors alone do not distinguish a standstill from smooth motion. So the receiver's mean
    /// velocity must be zero too, as far as it is known, and what is not known of it is admitted.
    fn stands(&mut self, fix: &Fix) -> Option<f32> {
        let align = self.navigation.align.as_mut()?;
        let still = align.still() >= STILL_S;
        if !still {
            self.motion.rest = None;
            let moving = self.motion.mean.moving;
            self.motion.mean = Mean {
                moving,
                ..Mean::default()
            };
        }
        let standing = libm::hypotf(STILL_MPS, DEPARTURE * align.gain_mps());
        let Some((speed, velocity, sigma)) = speed(fix) else {
            let stands = still && self.rests(fix);
            return Some(standing).filter(|_| stands);
        };
        let fast = speed > STANDS_MPS.max(SURE * sigma);
        self.motion.mean.moving = if fast { self.motion.mean.moving + 1 } else { 0 };
        if self.motion.mean.moving >= MOVES && align.is_commanded() {
            // nothing can be aligned at standstill here
            self.motion.mean.moving = 0;
            self.tally.alignments = self.tally.alignments.saturating_add(1);
            align.restart(false);
        }
        self.motion.mean.moving %= MOVES;
        if fast && speed > UNDER_WAY_MPS {
            align.is_under_way();
        } else if fast {
            align.moves();
        }
        if fast {
            return None;
        }
        if !still {
            return None;
        }
        let [mean, unknown] = self.motion.mean.takes(&velocity, sigma);
        if mean > SURE * unknown {
            align.moves();
            return None;
        }
        align.is_right();
        let standing = libm::hypotf(standing, libm::hypotf(mean, unknown));
        Some(standing).filter(|standing| *standing < sigma)
    }

    /// Whether the vehicle rests by its positions alone: they agree for so long that a motion would
    /// have shown.
    fn rests(&mut self, fix: &Fix) -> bool {
        let Fix {
            position,
            sigmas: [north, east, ..],
            ..
        } = *fix;
        let sure = SURE * core::f32::consts::SQRT_2 * north.max(east);
        let Some(stream) = self.samples.stream.filter(|_| sure.is_finite()) else {
            return false;
        };
        let number = self.number();
        let Some(rest) = self.motion.rest else {
            self.motion.rest = Some(StopPosition { position, number });
            return false;
        };
        let [n, e, _] = position.ned_from(&rest.position);
        if libm::hypotf(n as f32, e as f32) > sure {
            self.motion.rest = None;
            if let Some(align) = &mut self.navigation.align {
                align.moves();
            }
            return false;
        }
        let time = number.wrapping_sub(rest.number) as f32 * stream.period_s as f32;
        STANDS_MPS * time > sure
    }
}

/// Speed and velocity by the receiver and their standard deviation, m/s; of two components where
/// down is not measured.
fn speed(fix: &Fix) -> Option<(f32, [f64; 3], f32)> {
    let [.., north, east, down] = fix.sigmas;
    let [n, e, d] = fix.velocity;
    if fix.has(3..OBSERVATIONS) {
        Some((
            nav::speed(&fix.velocity),
            [n, e, d],
            down.max(north).max(east),
        ))
    } else if fix.has(3..OBSERVATIONS - 1) {
        Some((nav::speed(&[n, e, 0.0]), [n, e, 0.0], north.max(east)))
    } else {
        None
    }
}

#[cfg(test)]
mod tests;
