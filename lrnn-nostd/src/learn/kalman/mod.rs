//! Learning from position and velocity fixes, without reference increments ("way C"). The weights
//! are states of the Kalman filter that aids a navigator.
//!
//! A navigator elsewhere integrates increments from which the error estimates e_0 have been
//! subtracted. For each block of time it supplies the transition Phi of its X errors, the effect
//! Gamma of a constant error of the six sensors, and the process noise Q. One [`Kalman`] filter
//! belongs to one *hypothesis* about the sensors. It holds the estimate e = b + y(theta), and the
//! navigator's error x as this hypothesis sees it. Any number of hypotheses can therefore share one
//! navigator, and their predictions of the same fixes can be compared.
//!
//! ```text
//! x+ = Phi x + Gamma (e_0 - e),    d(x)+ = Phi d(x) + Gamma J d(theta) + noise
//! innovation = z - x_i,            log-likelihood += -1/2 (innovation^2 / s + ln s)
//! ```
//!
//! The filter also works without navigation. With X = 6 sums of sensor errors, Phi = I and Gamma =
//! I dt, an observation of x is the reference sum over a window, known late ("way B").
//! [`Kalman::reset_errors`] then begins the next window.
//!
//! Errors are estimate minus truth. With [`Biases`] this is the classical filter. With
//! [`NoParameters`] it is the aided navigator that trusts its sensors. Each fix is predicted before
//! anything is learnt from it, so the difference between two hypotheses' log-likelihoods is a test
//! on held-out data: if the simpler one is true, it exceeds ln k with a probability below 1/k at
//! any time (Ville's inequality).
//!
#![doc = include_str!("example.md")]

mod blocks;
mod covariance;
mod deferred;
mod model;
mod output;
mod packed;
mod parameters;
mod remember;
mod row;
#[cfg(test)]
mod tests;

pub use covariance::{Covariance, Innovation, Workspace};
pub use deferred::MAX_DEFERRED;
pub use model::{ErrorModel, Maps};
pub use parameters::{
    AllWeights, Biases, DiagonalWeights, FixedWeights, NoParameters, OutputWeights, ParameterSet,
    UnitBiases, UnitMap, UnitOutput, Zeroed,
};
pub use row::Rows;

use crate::activation::{Activation, Identity, Rational};
use crate::infer::Net;
use crate::real::Real;
use crate::shape::{Full, NEURONS};

/// Sensor triads: gyros and accelerometers.
pub const TRIADS: usize = 2;
/// Outputs of the two networks together.
pub const OUTPUTS: usize = TRIADS * NEURONS;
/// Elements of the two maps together.
pub const PROPORTIONAL: usize = TRIADS * NEURONS * NEURONS;
/// Outputs and elements of the maps.
const CAUSES: usize = OUTPUTS + PROPORTIONAL;
/// The navigation equations over one block of time, linearised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition<const X: usize, T = f32> {
    /// dx(end)/dx(start).
    pub phi: [[T; X]; X],
    /// dx(end)/de for sensor errors e (rad/s, m/s^2) that remain in the *estimate* of the
    /// increments. The sign is + where too much was subtracted.
    pub gamma: [[T; OUTPUTS]; X],
    /// dx(end)/dm for an error m in proportion that remains in the estimate: of axis `i` of triad
    /// `k` by what the triad feels along axis `j` beyond its input at rest
    /// ([`ErrorModel::set_rest`]), at `9 k + 3 i + j`, per 1. Signs as in `gamma`.
    pub proportional: [[T; PROPORTIONAL]; X],
    /// Covariance that the sensors' white noise adds over the block.
    pub q: [[T; X]; X],
    /// Length of the block, s.
    pub time: T,
}

impl<const X: usize, T: Real> Transition<X, T> {
    /// All zeros: memory that is filled in later.
    pub const ZEROED: Self = Self {
        phi: [[T::ZERO; X]; X],
        gamma: [[T::ZERO; OUTPUTS]; X],
        proportional: [[T::ZERO; PROPORTIONAL]; X],
        q: [[T::ZERO; X]; X],
        time: T::ZERO,
    };
}

/// Assumptions of a hypothesis before it has learnt anything: initial standard deviations, lower
/// limits for them, and the random walk of the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<const X: usize, const N: usize, T = f32> {
    /// Initial standard deviations of the navigator's errors.
    pub error_sigma: [T; X],
    /// Initial standard deviations of the parameters around their first values (see
    /// [`ErrorModel::sigmas`]).
    pub parameter_sigma: [T; N],
    /// Random walk of the bias of each output, rad/s or m/s^2 per sqrt(s). Weights do not walk.
    pub walk: [T; OUTPUTS],
    /// Smallest standard deviation of the navigator's errors; covers the rounding of the navigator.
    pub error_floor: [T; X],
    /// Smallest standard deviation of a parameter, as a fraction of its prior.
    pub parameter_floor: T,
}

/// What is subtracted from the sensors: an estimate of their errors, rad/s and m/s^2, which holds
/// for what they feel at rest, and maps for what they feel beyond that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<T = f32> {
    /// Errors at rest, rad/s and m/s^2.
    pub estimate: [T; OUTPUTS],
    /// Errors in proportion, as ratios.
    pub maps: Maps<T>,
}

impl<T: Real> Correction<T> {
    /// Nothing.
    pub const NONE: Self = Self {
        estimate: [T::ZERO; OUTPUTS],
        maps: [[[T::ZERO; NEURONS]; NEURONS]; TRIADS],
    };
}

impl<const X: usize, T: Real> Transition<X, T> {
    /// Moves the navigator's error `x`, or the difference between two navigators, over the block,
    /// in which the first has subtracted `first` and the second `second`.
    pub fn moves(&self, x: &mut [T; X], first: &Correction<T>, second: &Correction<T>) {
        let mut excess = first.estimate;
        for (excess, &own) in excess.iter_mut().zip(&second.estimate) {
            *excess -= own;
        }
        let last = *x;
        for i in 0..X {
            x[i] = row::dot(&self.phi[i], &last) + row::dot(&self.gamma[i], &excess);
        }
        if first.maps == second.maps {
            return;
        }
        let own = second.maps.as_flattened().as_flattened();
        for (x, by) in x.iter_mut().zip(&self.proportional) {
            let excess = first.maps.as_flattened().as_flattened().iter().zip(own);
            for ((&first, &second), &by) in excess.zip(by) {
                *x += by * (first - second);
            }
        }
    }

    /// Effects of the outputs and of the elements of the maps.
    fn of_causes(&self) -> [[T; CAUSES]; X] {
        let mut all = [[T::ZERO; CAUSES]; X];
        for ((all, gamma), proportional) in all.iter_mut().zip(&self.gamma).zip(&self.proportional)
        {
            for (place, &value) in all.iter_mut().zip(gamma.iter().chain(proportional)) {
                *place = value;
            }
        }
        all
    }
}

/// The unit matrix.
fn unit<T: Real>() -> [[T; NEURONS]; NEURONS] {
    let mut unit = [[T::ZERO; NEURONS]; NEURONS];
    for (i, row) in unit.iter_mut().enumerate() {
        row[i] = T::ONE;
    }
    unit
}

fn square<T: Real>(value: T) -> T {
    value * value
}

/// The filter of one hypothesis: its estimate, its covariance, and how well it has predicted the
/// fixes so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Kalman<
    L: ParameterSet,
    const X: usize,
    const N: usize,
    const PACKED: usize,
    H = Rational,
    T: Real = f32,
> {
    model: ErrorModel<L, N, H, T>,
    covariance: Covariance<X, N, PACKED, T>,
    /// x: the navigator's error as this hypothesis sees it.
    x: [T; X],
    prior: Prior<X, N, T>,
    log_likelihood: f64,
    /// Product of the variances (times 2 pi) whose logarithm is not yet in the log-likelihood.
    density: f64,
    healthy: bool,
}

impl<L: ParameterSet, const X: usize, const N: usize, const PACKED: usize, H: Activation, T: Real>
    Kalman<L, X, N, PACKED, H, T>
{
    /// All zeros, so that a static variable takes no room in flash. Call [`Kalman::init`] before
    /// use.
    pub const ZEROED: Self = Self {
        model: ErrorModel::ZEROED,
        covariance: Covariance::ZEROED,
        x: [T::ZERO; X],
        prior: Prior {
            error_sigma: [T::ZERO; X],
            parameter_sigma: [T::ZERO; N],
            walk: [T::ZERO; OUTPUTS],
            error_floor: [T::ZERO; X],
            parameter_floor: T::ZERO,
        },
        log_likelihood: 0.0,
        density: 0.0,
        healthy: false,
    };

    /// A new filter. The navigator's error is assumed to be zero, with the prior's standard
    /// deviations.
    pub fn new(model: ErrorModel<L, N, H, T>, prior: Prior<X, N, T>) -> Self {
        let mut new = Self::ZEROED;
        new.begin_prior(&prior);
        new.begin_covariance();
        Self { model, ..new }
    }

    /// As [`Kalman::new`], but in place: a large filter should not be moved across the stack. What
    /// the triads feel at rest stays, as with [`ErrorModel::init`].
    pub fn init(&mut self, nets: &[Net<H, Identity, Full, T>; TRIADS], prior: &Prior<X, N, T>) {
        self.begin(nets);
        self.begin_prior(prior);
        self.begin_covariance();
    }

    /// The first part of [`Self::init`]. [`Self::begin_prior`] and [`Self::begin_covariance`] must
    /// follow.
    pub fn begin(&mut self, nets: &[Net<H, Identity, Full, T>; TRIADS]) {
        self.model.init(nets);
    }

    /// The last part of [`Self::init`].
    pub fn begin_covariance(&mut self) {
        let Prior {
            error_sigma,
            parameter_sigma,
            ..
        } = &self.prior;
        self.covariance.init(error_sigma, parameter_sigma);
    }

    /// The second part of [`Self::init`].
    pub fn begin_prior(&mut self, prior: &Prior<X, N, T>) {
        self.x = [T::ZERO; X];
        self.prior = *prior;
        self.log_likelihood = 0.0;
        self.density = 1.0;
        self.healthy = true;
    }

    /// Steps the networks with one block of inputs. Their estimate applies to the next block.
    pub fn step(&mut self, inputs: [[T; NEURONS]; TRIADS]) {
        self.model.step(inputs);
    }

    /// Time update over one block, during which the navigator subtracted `applied`.
    pub fn propagate(&mut self, block: &Transition<X, T>, applied: &Correction<T>) {
        self.propagate_mean(block, applied);
        let mut workspace = Workspace::ZEROED;
        self.propagate_covariance(block, &mut workspace);
    }

    /// The mean only of [`Self::propagate`]; the covariance must follow.
    pub fn propagate_mean(&mut self, block: &Transition<X, T>, applied: &Correction<T>) {
        let own = Correction {
            estimate: *self.model.estimate(),
            maps: *self.model.maps(),
        };
        block.moves(&mut self.x, applied, &own);
    }

    /// The covariance only of [`Self::propagate`].
    pub fn propagate_covariance(
        &mut self,
        block: &Transition<X, T>,
        workspace: &mut Workspace<X, OUTPUTS, T>,
    ) {
        let mut walk = [T::ZERO; N];
        let of_triad = N / TRIADS;
        for (output, &of_bias) in self.prior.walk.iter().enumerate() {
            let at = output / NEURONS * of_triad + output % NEURONS;
            if let (true, Some(walk)) = (L::BIASES, walk.get_mut(at)) {
                *walk = square(of_bias) * block.time;
            }
        }
        let jacobian = &self.model.jacobian();
        let Transition { phi, gamma, q, .. } = block;
        if L::MAP == 0 {
            (self.covariance).propagate(jacobian, phi, gamma, q, &walk, workspace);
        } else {
            self.propagate_causes(block, &walk);
        }
    }

    /// [`Self::propagate_covariance`] of a set that learns maps. By itself: its memory is on the
    /// stack.
    #[inline(never)]
    fn propagate_causes(&mut self, block: &Transition<X, T>, walk: &[T; N]) {
        let [gyros, accels] = self.model.jacobian();
        let unit = unit();
        let [a, b, c, d, e, f] = ErrorModel::<L, N, H, T>::of_maps(&unit);
        let jacobian = [gyros, accels, a, b, c, d, e, f];
        let mut workspace = Workspace::<X, CAUSES, T>::ZEROED;
        let Transition { phi, q, .. } = block;
        let gamma = block.of_causes();
        (self.covariance).propagate(&jacobian, phi, &gamma, q, walk, &mut workspace);
    }

    /// The innovation of an observation `z` of the navigator's error `i`.
    pub fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T> {
        let expected = self.x.get(i).copied().unwrap_or(T::ZERO);
        Innovation {
            value: z - expected,
            variance: self.covariance.variance(i) + variance,
        }
    }

    /// Gains of an observation of the navigator's error `i`: of the navigator's errors, and of the
    /// estimate of the sensors', which takes its own off.
    pub fn gains(&self, i: usize, variance: T) -> ([T; X], [T; OUTPUTS]) {
        let (errors, cross) = (self.covariance.errors(), self.covariance.cross());
        let (Some(of_x), Some(of_theta)) = (errors.get(i), cross.get(i)) else {
            return ([T::ZERO; X], [T::ZERO; OUTPUTS]);
        };
        let per = T::ONE / (self.covariance.variance(i) + variance);
        let of_e = row::of_outputs(&self.model.jacobian(), of_theta, per);
        (of_x.map(|value| per * value), of_e)
    }

    /// Measurement update with an observation of the navigator's error `i`. The change of the
    /// parameters' own covariance is deferred until [`MAX_DEFERRED`] observations have been
    /// collected and the next one arrives, or until the covariance is needed.
    pub fn update(&mut self, i: usize, innovation: Innovation<T>) {
        let mut theta = [T::ZERO; N];
        self.covariance
            .update_error(i, innovation, &mut self.x, &mut theta);
        self.model.subtract(&theta);
    }

    /// Adds the log-density that this hypothesis gave to an observation to its log-likelihood. A
    /// squared ratio above `cap` counts as `cap`, so that a single outlier decides nothing.
    pub fn score(&mut self, innovation: Innovation<T>, cap: T) {
        let ratio = innovation.squared_ratio();
        let ratio = if ratio < cap { ratio } else { cap };
        self.log_likelihood -= 0.5 * ratio.to_f64();
        self.density *= core::f64::consts::TAU * innovation.variance.to_f64();
        if !(1e-200..1e200).contains(&self.density) {
            self.add_density();
        }
    }

    /// One logarithm for several observations: it is most of the cost of a score.
    fn add_density(&mut self) {
        self.log_likelihood -= 0.5 * libm::log(self.density);
        self.density = 1.0;
    }

    /// Ends the measurement updates of a fix: applies the variance floors and checks that every
    /// value is finite.
    pub fn finish_update(&mut self) {
        self.add_density();
        let error = self.prior.error_floor.map(square);
        let floor = self.prior.parameter_floor;
        let least = self
            .prior
            .parameter_sigma
            .map(|sigma| square(floor * sigma));
        self.covariance.floor(&error, &least);
        self.healthy &= self.model.is_healthy()
            && self.covariance.is_finite()
            && crate::real::all_finite(&self.x)
            && self.log_likelihood.is_finite();
    }

    /// Feedback: the navigator has been corrected by `e`, which is no longer part of its error.
    pub fn feedback(&mut self, e: &[T; X]) {
        for (x, &e) in self.x.iter_mut().zip(e) {
            *x -= e;
        }
    }

    /// What the triads feel at rest: see [`ErrorModel::set_rest`].
    pub fn set_rest(&mut self, rest: [[T; NEURONS]; TRIADS]) {
        self.model.set_rest(rest);
    }

    /// Maps that are as they are: see [`ErrorModel::set_maps`].
    pub fn set_maps(&mut self, maps: &Maps<T>) {
        self.model.set_maps(maps);
    }

    /// The networks begin in the steady state of these inputs: see [`ErrorModel::settle`].
    pub fn settle(&mut self, inputs: [[T; NEURONS]; TRIADS]) {
        self.model.settle(inputs);
    }

    /// Resets the networks to their power-on state, for a stream that starts again. Learnt
    /// parameters stay.
    pub fn reset_networks(&mut self) {
        self.model.reset();
    }

    /// Resets the navigator's errors to zero with these standard deviations; learnt parameters
    /// stay. For a new alignment, and at the start of each window of way B.
    pub fn reset_errors(&mut self, sigma: &[T; X]) {
        self.x = [T::ZERO; X];
        self.covariance.reset_errors(sigma);
    }

    /// Resets the navigator's errors to those of an alignment at standstill. They are `by` times
    /// the sensor errors that remained in its increments after `applied` was subtracted, plus
    /// independent errors of covariance `rest`. Learnt parameters stay.
    pub fn align(&mut self, by: &[[T; OUTPUTS]; X], rest: &[[T; X]; X], applied: &[T; OUTPUTS]) {
        self.align_mean(by, applied);
        let mut workspace = Workspace::ZEROED;
        self.align_covariance(by, rest, &mut workspace);
    }

    /// The mean only of [`Self::align`]; the covariance must follow.
    pub fn align_mean(&mut self, by: &[[T; OUTPUTS]; X], applied: &[T; OUTPUTS]) {
        let mut left = *self.model.estimate();
        for (left, &applied) in left.iter_mut().zip(applied) {
            *left -= applied;
        }
        for i in 0..X {
            self.x[i] = row::dot(&by[i], &left);
        }
    }

    /// The covariance only of [`Self::align`].
    pub fn align_covariance(
        &mut self,
        by: &[[T; OUTPUTS]; X],
        rest: &[[T; X]; X],
        workspace: &mut Workspace<X, OUTPUTS, T>,
    ) {
        (self.covariance).align(&self.model.jacobian(), by, rest, workspace);
    }

    /// Adds variance to the navigator's errors, when less is known about them than the filter
    /// assumed.
    pub fn inflate(&mut self, variance: &[T; X]) {
        self.covariance.inflate(variance);
    }

    /// x: the estimated error of the navigator.
    pub fn error_state(&self) -> &[T; X] {
        &self.x
    }

    /// The error model: biases and networks.
    pub fn model(&self) -> &ErrorModel<L, N, H, T> {
        &self.model
    }

    /// The covariance of the navigator's errors and of the parameters.
    pub fn covariance(&self) -> &Covariance<X, N, PACKED, T> {
        &self.covariance
    }

    /// Natural logarithm of the probability density of all observations scored so far.
    pub fn log_likelihood(&self) -> f64 {
        if self.density == 1.0 {
            return self.log_likelihood;
        }
        self.log_likelihood - 0.5 * libm::log(self.density)
    }

    /// Adds to [`Self::log_likelihood`] what earlier drives have shown.
    pub fn believe(&mut self, log_likelihood: f64) {
        self.log_likelihood += log_likelihood;
    }

    /// False after an overflow or a non-finite number; such a hypothesis must not be used.
    pub fn is_healthy(&self) -> bool {
        self.healthy
    }
}
