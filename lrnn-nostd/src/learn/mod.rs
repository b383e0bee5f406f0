//! Learning in passes over a batch, with the exact gradient. Every update rule is used in the same
//! way:
//!
//! ```text
//! learner.begin_pass();
//! for each step {
//!     learner.step(input, dt);
//!     if a reference is due { learner.reference(sum, weight); }
//! }
//! let pass = learner.end_pass();   // cost of the candidate; the rule has set the next candidate
//! ... repeat, then  learner.proposal()    // the weights learnt
//! ```
//!
//! A [`Learner`] works on its own copy of a network and never changes the original.

mod batch;
mod gauss_newton;
mod guarded;
pub mod kalman;
mod paper;
mod ud_covariance;
mod window;

pub use batch::Batch;
pub use gauss_newton::GaussNewton;
pub use guarded::Guarded;
pub use paper::{Paper, StepSizes};
pub use ud_covariance::UdCovariance;
pub use window::Window;

use crate::activation::{Activation, Identity, Rational};
use crate::gradient::Sensitivities;
use crate::infer::{Fault, Net, Step};
use crate::real::Real;
use crate::shape::{Feedback, Full, NEURONS, PARAMS};
use crate::state::State;
use crate::weights::Weights;

/// The rule by which a pass changes the weights: [`Paper`], [`Guarded`] or [`GaussNewton`].
pub trait Rule<T: Real> {
    /// Sets the weights of the first pass.
    fn start(&mut self, weights: &Weights<T>);

    /// Clears the sums of the last pass.
    fn begin(&mut self);

    /// Adds one closed window: E += weight/2 sum_j r_j^2, with `psi` = dr/dtheta.
    fn residual(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T);

    /// Judges the pass made with `candidate` and replaces it by the weights of the next pass.
    /// `valid` is false when the network or its sensitivities overflowed. Returns E and whether the
    /// pass was accepted.
    fn end<F: Feedback>(&mut self, candidate: &mut Weights<T>, valid: bool) -> (T, bool);

    /// The weights to propose; `None` for a rule that keeps only its candidate.
    fn best(&self) -> Option<Weights<T>>;
}

/// The result of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Pass<T = f32> {
    /// E of the weights this pass was made with (eq. 3, over windows): 1/2 sum weight r^2; without
    /// a unit, or in (network units s)^2 where all weights are 1.
    pub cost: T,
    /// Whether the rule took these weights as its new starting point; otherwise it went back.
    pub accepted: bool,
    /// Number of windows closed by a reference.
    pub windows: u32,
    /// Number of steps with any [`Fault`]. An overflow makes the whole pass void, a non-finite
    /// input does not.
    pub faults: u32,
}

/// Learns the weights of one network in passes over a batch, by the rule `U`.
///
/// ```
/// use lrnn_nostd::learn::{Guarded, Learner, StepSizes};
/// use lrnn_nostd::{Net, Normalisation, Weights};
///
/// let weights = Weights::from_fn(|i| 0.02 * (i % 7) as f32 - 0.06);
/// let net: Net = Net::new(weights, Normalisation::identity());
/// // Any rule is used like this one.
/// let mut learner: Learner<_> = Learner::new(&net, Guarded::new(StepSizes::uniform(0.01)));
/// let mut costs = [0.0; 40];
/// for cost in &mut costs {
///     learner.begin_pass();
///     for k in 0..100 {
///         let input = [(0.3 * k as f32).sin(), 0.0, 0.0];
///         let step = learner.step(input, 0.1); // s
///         assert_eq!(step.fault, None);
///         if k % 5 == 4 {
///             learner.reference([0.1, 0.0, -0.05], 1.0); // the sum over these five steps
///         }
///     }
///     *cost = learner.end_pass().cost;
/// }
/// assert!(costs[39] < 0.1 * costs[0], "{costs:?}");
/// let learnt: Net = Net::new(learner.proposal(), net.normalisation);
/// # assert!(learnt.weights.is_finite());
/// ```
#[derive(Clone, Debug)]
pub struct Learner<U, H = Rational, O = Identity, F = Full, T = f32> {
    net: Net<H, O, F, T>,
    state: State<T>,
    sens: Sensitivities<T>,
    window: Window<T>,
    windows: u32,
    faults: u32,
    valid: bool,
    rule: U,
}

impl<U: Rule<T>, H: Activation, O: Activation, F: Feedback, T: Real> Learner<U, H, O, F, T> {
    /// Starts from the weights of `net`, which is copied.
    pub fn new(net: &Net<H, O, F, T>, mut rule: U) -> Self {
        rule.start(&net.weights);
        Self {
            net: Net::new(net.weights, net.normalisation),
            state: State::new(),
            sens: Sensitivities::new(),
            window: Window::new(),
            windows: 0,
            faults: 0,
            valid: true,
            rule,
        }
    }

    /// Starts a pass: state, sensitivities and all sums are 0.
    pub fn begin_pass(&mut self) {
        self.state.reset();
        self.sens.reset();
        self.window.reset();
        self.windows = 0;
        self.faults = 0;
        self.valid = true;
        self.rule.begin();
    }

    /// One step of the candidate network. `input` is in physical units; `dt`, in s, is the time for
    /// which its output applies.
    #[inline]
    pub fn step(&mut self, input: [T; NEURONS], dt: T) -> Step<T> {
        let step = self
            .net
            .step_gradient(&mut self.state, &mut self.sens, input);
        self.window.add(&step.output, &self.sens, dt);
        if let Some(fault) = step.fault {
            self.faults = self.faults.saturating_add(1);
            self.valid &= fault == Fault::NonFiniteInput;
        }
        step
    }

    /// Closes the window of the steps since the last reference. `sum` is the true error summed over
    /// it (physical units times s, so rad or m/s). `weight` >= 0 is the inverse variance of its
    /// noise, 1/(network units s)^2, or 1. A sum or weight that is not finite makes the pass one
    /// that is not accepted. A window of one step with dt = 1 s is the paper's per-sample target.
    /// Nothing is learnt of an axis whose `output_scale` is 0.
    #[inline]
    pub fn reference(&mut self, sum: [T; NEURONS], weight: T) {
        let r = self.window.residual(&sum, &self.net.normalisation);
        self.window.leave_out(&self.net.normalisation);
        self.rule.residual(self.window.psi(), &r, weight);
        self.window.reset();
        self.windows = self.windows.saturating_add(1);
    }

    /// Drops the window since the last reference, for example after a gap in the reference.
    pub fn skip(&mut self) {
        self.window.reset();
    }

    /// Ends the pass; a window that is still open is dropped. The next pass runs with new candidate
    /// weights.
    pub fn end_pass(&mut self) -> Pass<T> {
        let (cost, accepted) = self.rule.end::<F>(&mut self.net.weights, self.valid);
        Pass {
            cost,
            accepted,
            windows: self.windows,
            faults: self.faults,
        }
    }

    /// The weights learnt so far: those of the best pass for a guarded rule, those of the next
    /// candidate for [`Paper`].
    pub fn proposal(&self) -> Weights<T> {
        self.rule.best().unwrap_or(self.net.weights)
    }

    /// The weights of the running or next pass.
    pub fn candidate(&self) -> &Weights<T> {
        &self.net.weights
    }

    /// The update rule, to inspect its sums and steps.
    pub fn rule(&self) -> &U {
        &self.rule
    }
}
