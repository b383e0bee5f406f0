//! Learning from position and velocity fixes, without reference increments ("way C"): the weights are states of the Kalman filter
//! that aids a navigation.
//!
//! A navigator somewhere else integrates increments from which the errors e_0 have been taken, and gives for each block of time the
//! transition Phi of its X errors, the effect Gamma of a constant error of the six sensors, and the noise Q. A [`Kalman`] holds what
//! one *hypothesis* about the sensors makes of that: its estimate e = b + y(theta), and the error x of that navigator as the hypothesis
//! sees it. So any number of hypotheses share one navigator, and their predictions of the same fixes are compared.
//!
//! ```text
//! x+ = Phi x + Gamma (e_0 - e),    d(x)+ = Phi d(x) + Gamma J d(theta) + noise
//! innovation = z - x_i,            log-likelihood += -1/2 (innovation^2 / s + ln s)
//! ```
//!
//! The navigator need not navigate: with X = 6 sums of sensor errors, Phi = I and Gamma = I dt, an observation of x is the reference
//! sum over a window, known late ("way B"), and [`Kalman::restart`] begins the next window.
//!
//! Errors are estimate minus truth. With [`Biases`] this is the classical filter, with [`Nothing`] the aided navigator that believes
//! its sensors. Each fix is predicted before anything is learnt from it, so the difference of two hypotheses' log-likelihoods is a
//! test on held-back data: if the simpler one is true, it exceeds ln k with a probability below 1/k at any time (Ville's inequality).

mod covariance;
mod model;
mod packed;

pub use covariance::{Covariance, Innovation, Passage};
pub use model::{
    AllWeights, Biases, Blank, DiagonalWeights, ErrorModel, Learns, Nothing, OutputWeights,
};
pub use packed::{ABSORB_PARTS, HELD, Row};

use crate::activation::{Activation, Identity, Rational};
use crate::infer::Net;
use crate::real::Real;
use crate::shape::{Full, NEURONS};

/// Gyros and accelerometers.
pub const TRIADS: usize = 2;
/// Outputs of the two networks together.
pub const OUTPUTS: usize = TRIADS * NEURONS;
/// Parts of a [`Kalman::spread`].
pub const PARTS: usize = OUTPUTS + 2;

/// Navigation over one block of time, linearised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition<const X: usize, T = f32> {
    /// dx(end)/dx(start).
    pub phi: [[T; X]; X],
    /// dx(end)/de for errors e (rad/s, m/s^2) that are left in the increments' *estimate*: + where too much was taken out.
    pub gamma: [[T; OUTPUTS]; X],
    /// Covariance that the sensors' white noise adds.
    pub q: [[T; X]; X],
    /// Length of the block, s.
    pub time: T,
}

/// Standard deviations that a hypothesis starts from, what they may not fall below, and how the parameters wander.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<const X: usize, const N: usize, T = f32> {
    /// Of the navigator's errors.
    pub outer: [T; X],
    /// Of the parameters around their start (see [`ErrorModel::sigmas`]).
    pub parameters: [T; N],
    /// Random walk of each parameter, unit per sqrt(s).
    pub walk: [T; N],
    /// Least standard deviation of the navigator's errors: the rounding of the navigator.
    pub outer_floor: [T; X],
    /// Least standard deviation of a parameter, as a share of its prior.
    pub floor: T,
}

fn square<T: Real>(value: T) -> T {
    value * value
}

/// One hypothesis: what it estimates, how sure it is, and how well it has predicted so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Kalman<
    L: Learns,
    const X: usize,
    const N: usize,
    const PACKED: usize,
    H = Rational,
    T: Real = f32,
> {
    model: ErrorModel<L, N, H, T>,
    covariance: Covariance<X, N, PACKED, T>,
    /// x.
    x: [T; X],
    prior: Prior<X, N, T>,
    log_likelihood: f64,
    healthy: bool,
}

impl<L: Learns, const X: usize, const N: usize, const PACKED: usize, H: Activation, T: Real>
    Kalman<L, X, N, PACKED, H, T>
{
    /// To be begun: all zeros, so that a static one takes no room in flash.
    pub const BLANK: Self = Self {
        model: ErrorModel::BLANK,
        covariance: Covariance::BLANK,
        x: [T::ZERO; X],
        prior: Prior {
            outer: [T::ZERO; X],
            parameters: [T::ZERO; N],
            walk: [T::ZERO; N],
            outer_floor: [T::ZERO; X],
            floor: T::ZERO,
        },
        log_likelihood: 0.0,
        healthy: false,
    };

    /// Starts with the navigator believed right.
    pub fn new(model: ErrorModel<L, N, H, T>, prior: Prior<X, N, T>) -> Self {
        let mut new = Self::BLANK;
        new.believe(prior);
        Self { model, ..new }
    }

    /// [`Kalman::new`] where it stands: a large one should not be moved over the stack.
    pub fn begin(&mut self, nets: [Net<H, Identity, Full, T>; TRIADS], prior: Prior<X, N, T>) {
        self.model.begin(nets);
        self.believe(prior);
    }

    fn believe(&mut self, prior: Prior<X, N, T>) {
        self.covariance.begin(&prior.outer, &prior.parameters);
        self.x = [T::ZERO; X];
        self.prior = prior;
        self.log_likelihood = 0.0;
        self.healthy = true;
    }

    /// The networks take one block of inputs; their estimate holds for the next one.
    pub fn step(&mut self, inputs: [[T; NEURONS]; TRIADS]) {
        self.model.step(inputs);
    }

    /// Takes the errors over a block through which the navigator took out `applied` (rad/s, m/s^2).
    pub fn predict(&mut self, block: &Transition<X, T>, applied: &[T; OUTPUTS]) {
        self.carry(block, applied);
        let mut passage = Passage::BLANK;
        for part in 0..PARTS {
            self.spread(part, block, &mut passage);
        }
    }

    /// [`Self::predict`] of the means alone; the covariance has to follow.
    pub fn carry(&mut self, block: &Transition<X, T>, applied: &[T; OUTPUTS]) {
        let mut excess = *applied;
        for (excess, &own) in excess.iter_mut().zip(self.model.estimate()) {
            *excess -= own;
        }
        let last = self.x;
        for i in 0..X {
            self.x[i] = packed::dot(&block.phi[i], &last) + packed::dot(&block.gamma[i], &excess);
        }
    }

    /// Part 0 .. [`PARTS`] of [`Self::predict`] of the covariance, in order, each a fraction of the work.
    pub fn spread(
        &mut self,
        part: usize,
        block: &Transition<X, T>,
        passage: &mut Passage<X, OUTPUTS, T>,
    ) {
        let model = &self.model;
        let jacobian = &model.rows();
        match part {
            0 => *passage = self.covariance.leave(&block.phi, jacobian),
            1..=OUTPUTS => self
                .covariance
                .pass(part - 1, &block.gamma, jacobian, passage),
            _ => {
                let walk = self.prior.walk.map(|walk| square(walk) * block.time);
                self.covariance
                    .arrive(&block.phi, &block.gamma, &block.q, &walk, passage);
            }
        }
    }

    /// What an observation of the navigator's error `i` would be off by.
    pub fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T> {
        let expected = self.x.get(i).copied().unwrap_or(T::ZERO);
        Innovation {
            value: z - expected,
            variance: self.covariance.variance(i) + variance,
        }
    }

    /// Learns from an observation of the navigator's error `i`. What it changes in the parameters' own covariance is held back until
    /// [`HELD`] observations are together and the next comes, [`Self::absorb`] is called, or it is needed.
    pub fn observe(&mut self, i: usize, innovation: Innovation<T>) {
        let mut theta = [T::ZERO; N];
        self.covariance
            .observe_outer(i, innovation, &mut self.x, &mut theta);
        self.model.subtract(&theta);
    }

    /// The next of [`ABSORB_PARTS`] parts of what has been held back; whether there is more.
    pub fn absorb(&mut self) -> bool {
        self.covariance.absorb()
    }

    /// Counts how probable this hypothesis made an observation; what lies further out than the ratio `cap` counts as if it lay there,
    /// so that one outlier decides nothing.
    pub fn weigh(&mut self, innovation: Innovation<T>, cap: T) {
        let ratio = innovation.squared_ratio();
        let ratio = if ratio < cap { ratio } else { cap };
        let variance = innovation.variance.to_f64();
        self.log_likelihood -=
            0.5 * (ratio.to_f64() + libm::log(core::f64::consts::TAU * variance));
    }

    /// After the updates of a fix: floors, and whether all is still finite.
    pub fn settle(&mut self) {
        let outer = self.prior.outer_floor.map(square);
        let floor = self.prior.floor;
        let least = self.prior.parameters.map(|sigma| square(floor * sigma));
        self.covariance.floor(&outer, &least);
        self.healthy &= self.model.is_healthy()
            && self.covariance.is_finite()
            && crate::real::all_finite(&self.x)
            && self.log_likelihood.is_finite();
    }

    /// The navigator has been corrected by `e`.
    pub fn fed_back(&mut self, e: &[T; X]) {
        for (x, &e) in self.x.iter_mut().zip(e) {
            *x -= e;
        }
    }

    /// The stream begins anew: the networks' states as at power-on; what has been learnt stays.
    pub fn restart_nets(&mut self) {
        self.model.restart();
    }

    /// A new navigator with these standard deviations, believed right; what has been learnt stays. After a new alignment, and at the
    /// start of each window of way B.
    pub fn restart(&mut self, outer: &[T; X]) {
        self.x = [T::ZERO; X];
        self.covariance.restart_outer(outer);
    }

    /// A new navigator whose initial errors are `by` times what the sensors' errors left in its increments were, of which `applied` had
    /// been taken out, plus others of covariance `rest`: an alignment at standstill. What has been learnt stays.
    pub fn derive(&mut self, by: &[[T; OUTPUTS]; X], rest: &[[T; X]; X], applied: &[T; OUTPUTS]) {
        self.derive_means(by, applied);
        let mut passage = Passage::BLANK;
        for part in 0..PARTS {
            self.derive_spread(part, by, rest, &mut passage);
        }
    }

    /// [`Self::derive`] of the means alone; the covariance has to follow.
    pub fn derive_means(&mut self, by: &[[T; OUTPUTS]; X], applied: &[T; OUTPUTS]) {
        let mut left = *self.model.estimate();
        for (left, &applied) in left.iter_mut().zip(applied) {
            *left -= applied;
        }
        for i in 0..X {
            self.x[i] = packed::dot(&by[i], &left);
        }
    }

    /// Part 0 .. [`PARTS`] of [`Self::derive`] of the covariance, in order, each a fraction of the work.
    pub fn derive_spread(
        &mut self,
        part: usize,
        by: &[[T; OUTPUTS]; X],
        rest: &[[T; X]; X],
        passage: &mut Passage<X, OUTPUTS, T>,
    ) {
        let model = &self.model;
        match part {
            0 => self.covariance.derive_outer(),
            1..=OUTPUTS => {
                let against = by.map(|row| row.map(|value| -value));
                self.covariance
                    .pass(part - 1, &against, &model.rows(), passage);
            }
            _ => self.covariance.derived(by, rest, passage),
        }
    }

    /// Less is known of the navigator than was believed: adds variance to its errors.
    pub fn inflate(&mut self, variance: &[T; X]) {
        self.covariance.inflate(variance);
    }

    /// x: the navigator's error.
    pub fn outer(&self) -> &[T; X] {
        &self.x
    }

    /// What it estimates.
    pub fn model(&self) -> &ErrorModel<L, N, H, T> {
        &self.model
    }

    /// How sure it is.
    pub fn covariance(&self) -> &Covariance<X, N, PACKED, T> {
        &self.covariance
    }

    /// Natural logarithm of the probability density of all observations weighed so far.
    pub fn log_likelihood(&self) -> f64 {
        self.log_likelihood
    }

    /// False once an overflow or a non-finite number has been seen; such a hypothesis must not be used.
    pub fn is_healthy(&self) -> bool {
        self.healthy
    }
}
