//! The paper's rule (eq. 7-13) as printed: each parameter has its own step size, which grows while
//! its gradient keeps its sign.
//!
//! ```text
//! lambda(s) = sign( dE/dtheta(s) dE/dtheta(s-1) )          (10)
//! eta(s)    = eta(s-1) + eps lambda(s) eta(s-1)            (8, 9)
//! theta    <- theta - eta(s) dE/dtheta(s)                  (7, 11-13)
//! ```
//!
//! Equation (7) prints "Delta = -eta = dE/dtheta" where a product is meant. Nothing guards this
//! rule. With one eps for growing and shrinking it diverges on many tasks after some tens of
//! passes. Use [`super::Guarded`] where that matters.

use crate::learn::{Batch, Rule};
use crate::real::Real;
use crate::shape::{Feedback, Kind, NEURONS, PARAMS};
use crate::weights::Weights;

/// One number for each kind of parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepSizes<T = f32> {
    /// Rate for R: eta or eps_1.
    pub feedback: T,
    /// Rate for W: gamma or eps_2.
    pub feed_forward: T,
    /// Rate for b: zeta or eps_3.
    pub bias: T,
}

impl<T: Real> StepSizes<T> {
    /// The same value for all three.
    pub const fn uniform(value: T) -> Self {
        Self {
            feedback: value,
            feed_forward: value,
            bias: value,
        }
    }

    /// The value for this kind.
    #[inline]
    pub fn of(&self, kind: Kind) -> T {
        match kind {
            Kind::Feedback => self.feedback,
            Kind::FeedForward => self.feed_forward,
            Kind::Bias => self.bias,
        }
    }

    /// The values for all parameters.
    pub(crate) fn per_parameter(&self) -> [T; PARAMS] {
        core::array::from_fn(|index| self.of(Kind::of(index)))
    }
}

/// The printed rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Paper<T = f32> {
    eps: [T; PARAMS],
    steps: [T; PARAMS],
    last: [T; PARAMS],
    batch: Batch<T>,
}

impl<T: Real> Paper<T> {
    /// `steps` are eta(0), gamma(0), zeta(0) > 0 for a gradient summed over the pass; `eps` are the
    /// constants eps_1..3 in [0, 1].
    pub fn new(steps: StepSizes<T>, eps: StepSizes<T>) -> Self {
        let (eps, steps) = (eps.per_parameter(), steps.per_parameter());
        Self {
            eps,
            steps,
            last: [T::ZERO; PARAMS],
            batch: Batch::new(),
        }
    }

    /// eta(s), gamma(s), zeta(s) in parameter order.
    pub fn steps(&self) -> &[T; PARAMS] {
        &self.steps
    }

    /// E and dE/dtheta of the last pass.
    pub fn batch(&self) -> &Batch<T> {
        &self.batch
    }
}

impl<T: Real> Rule<T> for Paper<T> {
    fn start(&mut self, _: &Weights<T>) {}

    fn begin(&mut self) {
        self.batch.reset();
    }

    #[inline]
    fn residual(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T) {
        self.batch.add(psi, r, weight);
    }

    /// Every finite pass is accepted. After a pass that overflowed the weights stay as they are:
    /// the rule has diverged. In the first pass there is no earlier gradient and lambda = 0, as for
    /// a product that underflows.
    fn end<F: Feedback>(&mut self, candidate: &mut Weights<T>, valid: bool) -> (T, bool) {
        let cost = self.batch.cost;
        if !(valid && cost.is_finite()) {
            return (cost, false);
        }
        let (mut next, mut not_finite) = (candidate.to_array(), T::ZERO);
        // Loops by index: at opt-level "z" each of several iterators side by side is a call.
        for i in 0..PARAMS {
            let (g, eta) = (self.batch.gradient[i], &mut self.steps[i]);
            let lambda = (g * self.last[i]).sign();
            *eta += self.eps[i] * lambda * *eta;
            next[i] -= *eta * g;
            self.last[i] = g;
            not_finite += next[i] * T::ZERO; // 0 for a finite value, NaN otherwise
        }
        // A non-finite gradient makes its parameter non-finite.
        let accepted = not_finite == T::ZERO;
        if accepted {
            candidate.set_all(&next);
        }
        (cost, accepted)
    }

    fn best(&self) -> Option<Weights<T>> {
        None
    }
}
