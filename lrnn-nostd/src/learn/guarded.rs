//! The paper's rule with a guard: a pass that raises E is undone, and all step sizes are cut.

use crate::learn::{Batch, Rule, StepSizes};
use crate::real::Real;
use crate::shape::{Feedback, NEURONS, PARAMS};
use crate::weights::Weights;

/// Equations (7)-(13) with eps_up for lambda = +1 and eps_down for lambda = -1, and with the guard.
/// E of the accepted passes never rises.
#[derive(Clone, Debug, PartialEq)]
pub struct Guarded<T = f32> {
    eps_up: T,
    eps_down: T,
    steps: [T; PARAMS],
    batch: Batch<T>,
    /// The last accepted pass, from which each candidate starts.
    best: Weights<T>,
    best_batch: Option<Batch<T>>,
}

impl<T: Real> Guarded<T> {
    /// `steps` are the first step sizes (> 0, for a gradient summed over the pass). Steps that are
    /// too large are halved once per pass. eps_up = 0.05, eps_down = 0.5.
    pub fn new(steps: StepSizes<T>) -> Self {
        let steps = steps.per_parameter();
        Self {
            eps_up: T::from_f64(0.05),
            eps_down: T::from_f64(0.5),
            steps,
            batch: Batch::new(),
            best: Weights::zero(),
            best_batch: None,
        }
    }

    /// The step sizes in parameter order.
    pub fn steps(&self) -> &[T; PARAMS] {
        &self.steps
    }

    /// eta(s) = eta(s-1) (1 + eps_up) while the gradient keeps its sign, eta(s-1) (1 - eps_down)
    /// when it changes.
    fn adapt(&mut self, last: &[T; PARAMS]) {
        for ((eta, g), last) in self.steps.iter_mut().zip(&self.batch.gradient).zip(last) {
            let lambda = g.sign() * last.sign();
            let eps = if lambda > T::ZERO {
                self.eps_up
            } else {
                self.eps_down
            };
            *eta += eps * lambda * *eta;
        }
    }
}

impl<T: Real> Rule<T> for Guarded<T> {
    fn start(&mut self, weights: &Weights<T>) {
        self.best = *weights;
        self.best_batch = None;
    }

    fn begin(&mut self) {
        self.batch.reset();
    }

    #[inline]
    fn residual(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T) {
        self.batch.add(psi, r, weight);
    }

    fn end<F: Feedback>(&mut self, candidate: &mut Weights<T>, valid: bool) -> (T, bool) {
        let cost = self.batch.cost;
        let lower = self
            .best_batch
            .as_ref()
            .is_none_or(|best| cost <= best.cost);
        let accepted = valid && lower && self.batch.is_finite();
        if accepted {
            if let Some(best) = self.best_batch.take() {
                self.adapt(&best.gradient);
            }
            self.best = *candidate;
            self.best_batch = Some(self.batch);
        } else {
            self.steps = self.steps.map(|eta| eta * (T::ONE - self.eps_down));
        }
        let mut next = self.best.to_array();
        if let Some(best) = &self.best_batch {
            for ((theta, &eta), &g) in next.iter_mut().zip(&self.steps).zip(&best.gradient) {
                *theta -= eta * g;
            }
        }
        candidate.set_all(&next);
        (cost, accepted)
    }

    fn best(&self) -> Option<Weights<T>> {
        Some(self.best)
    }
}
