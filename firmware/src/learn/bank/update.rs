//! The time update over an interval, a fix at its end, and the start of a new navigator, of all
//! hypotheses.

use super::considered::Sizes;
use super::{Bank, HYPOTHESES, MAP, NAV, OUTPUTS, STORED, TRIADS, ZERO_CORRECTION, index};
use crate::align::motion::BiasObservations;
use crate::fix::OBSERVATIONS;
use crate::nav::proportional::ProportionalEffects;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{Correction, Transition, Workspace};

/// Memory of the updates, too large for the stack.
#[derive(Clone, Debug)]
pub struct Scratch<T: Real = f32> {
    /// The last interval. While a navigator starts, `gamma` are its errors by the sensors' errors,
    /// `q` is the covariance of its others, and `phi` that of both if the alignment has estimated
    /// the sensors' errors.
    pub block: Transition<NAV, T>,
    /// What errors in proportion to the motion add to the variances of attitude and velocity in the
    /// interval, beyond `q`, for hypotheses that do not estimate them.
    pub in_proportion: [T; NAV],
    /// Memory for the update of one covariance after the other.
    pub workspace: Workspace<NAV, OUTPUTS, T>,
}

impl<T: Real> Scratch<T> {
    /// All zeros, so that a static one takes no room in flash.
    pub const ZEROED: Self = Self {
        block: Transition::ZEROED,
        in_proportion: [T::ZERO; NAV],
        workspace: Workspace::ZEROED,
    };
}

/// Whether an alignment has estimated the sensors' errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Estimated {
    Sensors,
    Nothing,
}

const _: () = assert!(OBSERVATIONS == OUTPUTS);

impl<T: Real> Bank<T> {
    /// The navigator has passed an interval with the correction `applied`: propagates the means.
    /// [`Bank::propagate_covariance`] must follow.
    pub fn propagate_mean(&mut self, block: &Transition<NAV, T>, applied: &Correction<T>) {
        self.each(|h| h.propagate_mean(block, applied));
    }

    /// Propagates the covariances over the interval in `scratch`.
    pub fn propagate_covariance(&mut self, scratch: &mut Scratch<T>) {
        let Scratch {
            block,
            in_proportion,
            workspace,
        } = scratch;
        self.each(|h| h.propagate_covariance(block, workspace));
        self.some(!(1 << MAP), |h| h.inflate(in_proportion));
    }

    /// What the sensors feel at rest from now on, rad/s and m/s^2.
    pub fn set_rest(&mut self, rest: [[f32; 3]; TRIADS]) {
        let rest = rest.map(|of| of.map(|x| T::from_f64(f64::from(x))));
        self.each(|h| h.set_rest(rest));
    }

    /// A fix at the end of the interval: estimate minus fix and its variances, m and m/s. An
    /// observation of infinite variance is not measured: it neither scores nor teaches. `counts`:
    /// a refusal is one more in a row ([`super::Gates::escape`]). Gives the refused observations,
    /// one bit each.
    pub fn fix(&mut self, z: &[T; OBSERVATIONS], variance: &[T; OBSERVATIONS], counts: bool) -> u8 {
        let mut refused = 0;
        for (k, (&z, &variance)) in z.iter().zip(variance).enumerate() {
            if !variance.is_finite() {
                continue;
            }
            if self.accepts(k, z, variance, counts) {
                self.learn(k, z, variance);
            } else {
                refused |= 1 << k;
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
        refused
    }

    /// A new navigator that was aligned. Its initial errors are `gamma` of `scratch` (rad, m/s, m
    /// for 1 rad/s or 1 m/s^2) times the sensors' errors during the alignment, and others of
    /// covariance `q`. What was learnt stays.
    pub fn align(&mut self, scratch: &mut Scratch<T>) {
        self.align_means(&scratch.block.gamma, &[T::ZERO; OUTPUTS]);
        self.align_covariances(scratch, Estimated::Nothing);
    }

    /// A new navigator from an alignment that has estimated the sensors' errors too: `applied`. Its
    /// errors are in `scratch`. First the hypotheses learn what was `observed` of the sensors, as
    /// from a fix of a navigator whose errors are the observed ones. That counts for none of them,
    /// because all of them profit.
    pub fn start(
        &mut self,
        scratch: &mut Scratch<T>,
        applied: &[T; OUTPUTS],
        observed: &BiasObservations,
    ) {
        let to = |x: f32| T::from_f64(f64::from(x));
        let mut by = [[T::ZERO; OUTPUTS]; NAV];
        for (k, row) in observed.rows.iter().enumerate() {
            if let Some(of) = by.get_mut(index(k)) {
                *of = row.map(to);
            }
        }
        self.align_means(&by, &observed.from.map(to));
        let nothing = [[T::ZERO; NAV]; NAV];
        self.each(|h| h.align_covariance(&by, &nothing, &mut scratch.workspace));
        for (k, (&z, &variance)) in observed.z.iter().zip(&observed.variance).enumerate() {
            if variance.is_finite() {
                self.learn(k, to(z), to(variance));
            }
        }
        self.each(|h| h.finish_update());
        self.align_means(&scratch.block.gamma, applied);
        self.believe_alignment();
        self.align_covariances(scratch, Estimated::Sensors);
    }

    /// The networks' step with these inputs.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        if self.settles {
            self.some(self.fresh, |h| h.settle(inputs));
        }
        self.fresh = 0;
        self.each(|h| h.step(inputs));
    }

    /// Errors in proportion to what the sensors feel are considered, of this size.
    pub fn considers(&mut self, of: &Sizes) {
        self.considered.begin(of);
    }

    /// Their effect over the interval in `scratch`.
    pub fn feels(&mut self, block: &Transition<NAV, T>, felt: &ProportionalEffects) {
        self.considered.interval(block, felt);
    }

    /// All hypotheses learn from observation `k`.
    fn learn(&mut self, k: usize, z: T, variance: T) {
        let i = index(k);
        let gains = self.get(self.navigating()).gains(i, variance);
        self.considered.fix(i, &gains);
        self.each(|h| h.update(i, h.innovation(i, z, variance)));
    }

    fn align_means(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]) {
        self.believed = false;
        self.each(|h| h.align_mean(by, applied));
    }

    /// After [`Bank::align_means`], when `applied` was estimated by the alignment: the zero
    /// correction has no parameters for the sensors' errors, but it does not deny them. It believes
    /// the alignment as it is.
    fn believe_alignment(&mut self) {
        self.believed = true;
        let nothing = [[T::ZERO; OUTPUTS]; NAV];
        self.some(1 << ZERO_CORRECTION | 1 << STORED, |h| {
            h.align_mean(&nothing, &[T::ZERO; OUTPUTS]);
        });
    }

    fn align_covariances(&mut self, scratch: &mut Scratch<T>, estimated: Estimated) {
        let Scratch {
            block, workspace, ..
        } = scratch;
        let (by, rest) = (&block.gamma, &block.q);
        for which in 0..HYPOTHESES {
            let rest = match (which, estimated) {
                (ZERO_CORRECTION | STORED, Estimated::Sensors) => block.phi,
                (ZERO_CORRECTION | STORED, Estimated::Nothing) => self.unmodelled(by, rest),
                _ => *rest,
            };
            self.some(1 << which, |h| h.align_covariance(by, &rest, workspace));
        }
        self.considered.clear();
    }
}

#[cfg(test)]
mod tests;
