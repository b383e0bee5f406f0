//! Several hypotheses about the sensors, tried on the same fixes; the one that has proved itself runs.
//!
//! From "the sensors are right" over six biases to networks with narrow and wide priors: which of them fits a unit is not known
//! beforehand, so each predicts every fix before it learns from it, and the sum of its log-likelihoods tells. One is *running*: its
//! estimate is taken out of the increments. It is replaced by another only when that one beats it, and beats "no correction", by
//! more than [`Gates::evidence`]; and given up for "no correction" when it no longer does.

mod gates;
mod hypothesis;
mod parts;
mod table;

pub use gates::Gates;
pub use parts::Work;
pub use table::{ALL, HYPOTHESES, KEYS, NAMES, ZERO_CORRECTION};

use super::prior::{Datasheet, LearnerNet, NAV};
use crate::fix::OBSERVATIONS;
use hypothesis::Hypothesis;
use lrnn_nostd::learn::kalman::{OUTPUTS, TRIADS, Transition};
use lrnn_nostd::{Real, State};
use table::Hypotheses;

/// The hypotheses over one navigator.
#[derive(Clone, Debug)]
pub struct Bank<T: Real = f32> {
    hypotheses: Hypotheses<T>,
    gates: Gates<T>,
    /// Standard deviation of an error that [`ZERO_CORRECTION`] has no parameter for.
    unmodelled: [T; OUTPUTS],
    refused: [u8; OBSERVATIONS],
    running: usize,
}

impl<T: Real> Bank<T> {
    /// Hypotheses about sensors of this datasheet; networks step once a block of `block_s` (s). `error_sigma` are the standard deviations of
    /// the navigator's errors, in the order of [`NAV`].
    #[must_use]
    pub fn new(sheet: &Datasheet<T>, block_s: f64, error_sigma: [T; NAV], gates: Gates<T>) -> Self {
        let mut bank = Self::ZEROED;
        bank.begin(sheet, block_s, error_sigma, gates);
        bank
    }

    /// To be begun: all zeros, so that a static one takes no room in flash.
    pub const ZEROED: Self = Self {
        hypotheses: Hypotheses::ZEROED,
        gates: Gates {
            squared_ratio: T::ZERO,
            escape: 0,
            evidence: 0.0,
            better: 0.0,
            enabled: 0,
        },
        unmodelled: [T::ZERO; OUTPUTS],
        refused: [0; OBSERVATIONS],
        running: ZERO_CORRECTION,
    };

    /// [`Bank::new`] where it stands: it should not be moved over the stack.
    pub fn begin(
        &mut self,
        sheet: &Datasheet<T>,
        block_s: f64,
        error_sigma: [T; NAV],
        gates: Gates<T>,
    ) {
        let (nets, floor) = (sheet.nets(block_s), error_floor());
        self.hypotheses
            .begin(nets, sheet, block_s, error_sigma, floor);
        let [g, a] = [sheet.gyro_bias, sheet.accel_bias];
        self.unmodelled = [g, g, g, a, a, a];
        self.gates = gates;
        self.refused = [0; OBSERVATIONS];
        self.running = ZERO_CORRECTION;
    }

    fn get(&self, index: usize) -> &dyn Hypothesis<T> {
        self.hypotheses.get(index)
    }

    fn each(&mut self, act: impl FnMut(&mut dyn Hypothesis<T>)) {
        self.some(ALL, act);
    }

    /// Those of the bits `which` that take part.
    fn some(&mut self, which: u8, act: impl FnMut(&mut dyn Hypothesis<T>)) {
        self.hypotheses.each_of(self.gates.enabled & which, act);
    }

    /// Mean rate (rad/s) and specific force (m/s^2) of the block that has ended, as measured; the estimates are for the next one.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        self.each(|h| h.step(inputs));
    }

    /// The navigator has been through a block with `applied` (rad/s, m/s^2) taken out.
    pub fn propagate(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        self.each(|h| h.propagate(block, applied));
    }

    /// Takes a fix: `z`, navigator minus fix, and its variances. Gives what was refused, one bit an observation.
    pub fn fix(&mut self, z: &[T; OBSERVATIONS], variance: &[T; OBSERVATIONS]) -> u8 {
        let mut bits = 0;
        for k in 0..OBSERVATIONS {
            let (z, variance) = (z[k], variance[k]);
            if self.believes(k, z, variance) {
                let i = index(k);
                self.each(|h| h.update(i, h.innovation(i, z, variance)));
            } else {
                bits |= 1 << k;
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
        bits
    }

    /// Weighs the hypotheses by observation `k`, before anything is learnt from it; whether it is to be learnt from.
    fn believes(&mut self, k: usize, z: T, variance: T) -> bool {
        let (i, cap) = (index(k), self.gates.squared_ratio);
        let mut outlier = true;
        self.each(|h| {
            let innovation = h.innovation(i, z, variance);
            h.score(innovation, cap);
            let inside = innovation.squared_ratio() <= cap && h.is_healthy();
            outlier &= !inside;
        });
        let Some(refused) = self.refused.get_mut(k) else {
            return false;
        };
        // never a number that is none
        let believed = z.is_finite() && (!outlier || *refused >= self.gates.escape);
        *refused = if believed {
            0
        } else {
            refused.saturating_add(1)
        };
        believed
    }

    /// Log-likelihood of one that may run.
    fn standing(&self, index: usize) -> f64 {
        let hypothesis = self.get(index);
        let enabled = self.gates.enabled >> index & 1 == 1;
        if enabled && (index == ZERO_CORRECTION || hypothesis.is_healthy()) {
            hypothesis.log_likelihood()
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Promotion and rollback.
    fn choose(&mut self) {
        let (nothing, running) = (self.standing(ZERO_CORRECTION), self.standing(self.running));
        let mut best = (ZERO_CORRECTION, nothing + self.gates.evidence);
        for index in 0..HYPOTHESES {
            let own = self.standing(index);
            if own > best.1 {
                best = (index, own);
            }
        }
        // the running one stays until another is clearly better or it has lost against nothing at all
        if best.1 > running + self.gates.better || running < nothing {
            self.running = best.0;
        }
    }

    /// What to take out of the increments of the next block: the running hypothesis' estimate, rad/s and m/s^2.
    #[must_use]
    pub fn estimate(&self) -> &[T; OUTPUTS] {
        self.get(self.running).estimate()
    }

    /// The same of any hypothesis.
    #[must_use]
    pub fn estimate_of(&self, index: usize) -> &[T; OUTPUTS] {
        self.get(index).estimate()
    }

    /// The navigator's error as the running hypothesis sees it; the caller takes it out of the navigator.
    pub fn feed_back(&mut self) -> [T; NAV] {
        let e = *self.get(self.running).error_state();
        self.each(|h| h.feedback(&e));
        e
    }

    /// Less is known of the navigator than was believed: adds variance to its errors.
    pub fn inflate(&mut self, variance: &[T; NAV]) {
        self.each(|h| h.inflate(variance));
    }

    /// The stream begins anew: the networks' states as at power-on; what has been learnt stays.
    pub fn reset_networks(&mut self) {
        self.each(|h| h.reset_networks());
    }

    /// A new navigator that was aligned at standstill: its initial errors are `by` (rad, m/s, m for 1 rad/s or 1 m/s^2) times what the
    /// sensors' errors then were, of which `applied` had been taken out, plus others of covariance `rest`. What has been learnt stays.
    pub fn align(
        &mut self,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        applied: &[T; OUTPUTS],
    ) {
        self.each(|h| h.align(by, rest, applied));
        let all = self.unmodelled(by, rest);
        self.hypotheses
            .each_of(1 << ZERO_CORRECTION, |h| h.align(by, &all, applied));
    }

    /// The rest for [`ZERO_CORRECTION`], which has no parameter for what `by` tells.
    fn unmodelled(&self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV]) -> [[T; NAV]; NAV] {
        let mut all = *rest;
        for (row, own) in all.iter_mut().zip(by) {
            for (entry, other) in row.iter_mut().zip(by) {
                for ((&a, &b), sigma) in own.iter().zip(other).zip(self.unmodelled) {
                    *entry += a * b * (sigma * sigma);
                }
            }
        }
        all
    }

    /// Index of the running hypothesis: 0 nothing, 1 biases, 2 to 4 output weights with narrow to wide priors, 5 all weights.
    #[must_use]
    pub fn running(&self) -> usize {
        self.running
    }

    /// Log-likelihood of a hypothesis, relative to [`ZERO_CORRECTION`]'s.
    #[must_use]
    pub fn evidence(&self, index: usize) -> f64 {
        self.get(index).log_likelihood() - self.get(ZERO_CORRECTION).log_likelihood()
    }

    /// Whether a hypothesis is finite.
    #[must_use]
    pub fn is_healthy(&self, index: usize) -> bool {
        self.get(index).is_healthy()
    }

    /// States of the running hypothesis' networks.
    #[must_use]
    pub fn states(&self) -> [State<T>; TRIADS] {
        *self.get(self.running).states()
    }

    /// The running hypothesis' networks, its biases folded in.
    #[must_use]
    pub fn nets(&self) -> [LearnerNet<T>; TRIADS] {
        self.get(self.running).nets()
    }
}

/// State observed by observation `k`: position first, then velocity.
fn index(k: usize) -> usize {
    if k < 3 { 6 + k } else { k }
}

/// What f32 arithmetic and an imperfect navigator leave: rad, m/s, m (assumed, far below any sensor's).
fn error_floor<T: Real>() -> [T; NAV] {
    let [a, v, p] = [1e-7, 1e-5, 1e-4].map(T::from_f64);
    [a, a, a, v, v, v, p, p, p]
}
