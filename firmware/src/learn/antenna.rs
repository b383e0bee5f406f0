//! Where the antenna is and how old its fixes are: lever arm and delay as states of a filter.
//!
//! Both are configured with a standard deviation. An error `d` of the two (estimate minus truth,
//! lever arm in the sensor's axes, then the age of a fix) makes every fix seem wrong by `M d`,
//! where `M` follows from the motion ([`AntennaInnovation::by`]): a lever arm shows in turns, a
//! delay where the velocity changes. On a straight line at constant speed neither can be separated
//! from the navigator's own errors `x`, and both stay as uncertain as they were.
//!
//! One filter estimates `d` for all hypotheses. It has six biases as the hypothesis `biases`, so
//! that it does not take the sensors' errors for the antenna's. Since [`Kalman`] observes one state
//! at a time, its navigation errors are those of the antenna:
//!
//! ```text
//! y = x + M d,    z = y + noise
//! y+ = Phi y + (M+ - Phi M) d + Gamma e + noise,    d+ = d + noise
//! ```
//!
//! The hypotheses then get the fix as it would be without `d`: `z - M d`, with the variance `M P_d
//! M'` of what is left of `d` added, several times, to the fix's own. At the end of a block `d`
//! moves into the navigator's lever arm and into the age of the fixes.
//!
//! If both are known exactly, nothing of this runs.

mod equations;
mod estimate;
mod update;

pub use estimate::AntennaEstimate;

use super::age::MAX_AGE_S;
use super::bank::{self, Refusals};
use super::prior::{Datasheet, Layers, NAV};
use super::settings::Settings;
use crate::fix::OBSERVATIONS;
use crate::nav::{ANTENNA, AntennaInnovation};
use lrnn_nostd::Rational;
use lrnn_nostd::Weights;
use lrnn_nostd::learn::kalman::{
    Biases, Correction, Kalman, OUTPUTS, Prior, Transition, Workspace,
};

/// Navigation errors as the antenna sees them, lever arm, age.
const STATES: usize = NAV + ANTENNA;
const PACKED: usize = OUTPUTS * (OUTPUTS + 1) / 2;
type Filter = Kalman<Biases, STATES, OUTPUTS, PACKED, Rational>;
/// Effect of an antenna's errors on each observation.
type Effect = [[f32; ANTENNA]; OBSERVATIONS];

/// Neither is ever known better than this, m and s (assumed: the antenna's centre of phase, the
/// jitter of the receiver).
const FLOOR: [f32; ANTENNA] = [0.01, 0.01, 0.01, 0.002];

/// Estimates lever arm and age.
#[derive(Debug, Clone)]
pub struct Antenna {
    filter: Filter,
    workspace: Workspace<STATES, OUTPUTS>,
    /// Configured standard deviations.
    sigma: [f32; ANTENNA],
    /// The estimate in use: lever arm in the sensor's axes, m, and least age, s.
    arm: [f32; 3],
    age: f32,
    mounting: [f32; 4],
    /// M of the mean, and of the covariance, which follows in [`Antenna::update`].
    effect: Effect,
    before: Effect,
    /// The fix: estimate minus fix, and its variance.
    fix: ([f32; OBSERVATIONS], [f32; OBSERVATIONS]),
    /// Variance by which the age has changed at once, s2.
    jump: f32,
    /// An interval has passed, and a fix is at its end.
    moved: bool,
    fixed: bool,
    refused: [Refusals; OBSERVATIONS],
    counts: bool,
    measured: Option<f32>,
    /// The filter has begun; it has failed.
    begun: bool,
    failed: bool,
    estimate: AntennaEstimate,
}

impl Antenna {
    /// All zeros. Call [`Antenna::begin_nothing`] or [`Antenna::configure`] before use.
    pub const ZEROED: Antenna = Antenna {
        filter: Filter::ZEROED,
        workspace: Workspace::ZEROED,
        sigma: [0.0; ANTENNA],
        arm: [0.0; 3],
        age: 0.0,
        mounting: [0.0; 4],
        effect: [[0.0; ANTENNA]; OBSERVATIONS],
        before: [[0.0; ANTENNA]; OBSERVATIONS],
        fix: ([0.0; OBSERVATIONS], [0.0; OBSERVATIONS]),
        jump: 0.0,
        moved: false,
        fixed: false,
        refused: [Refusals::NONE; OBSERVATIONS],
        counts: false,
        measured: None,
        begun: false,
        failed: false,
        estimate: AntennaEstimate {
            lever_arm: [0.0; 3],
            lever_arm_sigma: [0.0; 3],
            fix_delay: 0.0,
            fix_delay_sigma: 0.0,
        },
    };

    /// The antenna is unknown, and nothing is to be estimated.
    pub fn begin_nothing(&mut self) {
        *self = Antenna::ZEROED;
        self.mounting = [1.0, 0.0, 0.0, 0.0];
        self.counts = true;
        self.estimate = AntennaEstimate::NONE;
    }

    /// Takes the configured values until it begins. In place: it is too large to be moved over the
    /// stack.
    pub fn configure(&mut self, settings: &Settings) {
        let [x, y, z] = [settings.lever_arm_sigma; 3];
        self.begin_nothing();
        self.sigma = [x, y, z, settings.fix_age_sigma];
        (self.arm, self.age) = (settings.lever_arm, settings.fix_age_s);
        self.mounting = settings.mounting;
        self.report();
    }

    /// Begins from the configured values. The biases are those of the datasheet.
    #[inline(never)]
    pub fn begin(&mut self, settings: &Settings, block_s: f64) {
        self.configure(settings);
        if self.estimates() {
            let prior = self.prior(&settings.sheet);
            self.filter.init(&settings.sheet.nets(block_s), &prior);
            self.begun = true;
        }
    }

    fn prior(&self, sheet: &Datasheet) -> Prior<STATES, OUTPUTS> {
        let of: Prior<NAV, OUTPUTS> = sheet.prior::<Biases, OUTPUTS>(
            Layers::Time(&Weights::zero()),
            0.0,
            [1.0; NAV],
            bank::error_floor(),
        );
        let mut floor = FLOOR;
        for (floor, sigma) in floor.iter_mut().zip(self.sigma) {
            *floor = floor.min(sigma);
        }
        Prior {
            error_sigma: joined(&of.error_sigma, &self.sigma),
            parameter_sigma: of.parameter_sigma,
            walk: of.walk,
            error_floor: joined(&of.error_floor, &floor),
            parameter_floor: of.parameter_floor,
        }
    }

    /// Whether anything is to be estimated.
    pub fn estimates(&self) -> bool {
        !self.failed && self.sigma.iter().any(|sigma| *sigma > 0.0)
    }

    /// The lever arm to be used, the sensor's axes, m.
    pub fn arm(&self) -> [f32; 3] {
        self.arm
    }

    /// The least age of a fix, s.
    pub fn age(&self) -> f32 {
        self.age
    }

    /// Standard deviation of that age, s.
    pub fn age_sigma(&self) -> f32 {
        libm::sqrtf(self.variance(NAV + ANTENNA - 1))
    }

    /// Estimates, for reading. They are those of the last finished fix.
    pub fn estimate(&self) -> AntennaEstimate {
        self.estimate
    }

    fn variance(&self, i: usize) -> f32 {
        if self.estimates() {
            self.filter.covariance().variance(i)
        } else {
            0.0
        }
    }

    /// The age has changed at once by something like this, s: fixes come sooner than any before.
    pub fn jumps(&mut self, by: f32) {
        self.jump += by * by;
    }

    /// A new navigator with errors `by` times the sensors' errors that were left after `applied`
    /// had been subtracted, plus others of covariance `rest`. When it was started at a fix,
    /// `innovation` is the observation of that fix: its errors are then those of the fix, as seen
    /// by the antenna.
    pub fn navigates(
        &mut self,
        by: &[[f32; OUTPUTS]; NAV],
        rest: &[[f32; NAV]; NAV],
        applied: &[f32; OUTPUTS],
        innovation: Option<&AntennaInnovation>,
    ) {
        self.take();
        self.moved = false;
        self.effect = innovation.map_or([[0.0; ANTENNA]; OBSERVATIONS], |innovation| innovation.by);
        self.before = self.effect;
        if !self.estimates() {
            return;
        }
        let mut all = [[0.0; STATES]; STATES];
        let old = self.filter.covariance().errors();
        for (i, (row, old)) in all.iter_mut().zip(old).enumerate() {
            match rest.get(i) {
                Some(rest) => equations::copy(row, rest),
                None => row
                    .iter_mut()
                    .zip(old)
                    .skip(NAV)
                    .for_each(|(to, of)| *to = *of),
            }
        }
        let mut through = [[0.0; OUTPUTS]; STATES];
        for (to, of) in through.iter_mut().zip(by) {
            *to = *of;
        }
        self.filter.align(&through, &all, applied);
    }

    /// Variance of the antenna's part in each observation.
    fn spread(&self) -> [f32; OBSERVATIONS] {
        let p = self.filter.covariance().errors();
        self.effect.map(|row| {
            let mut sum = 0.0;
            for (a, p) in row.iter().zip(p.iter().skip(NAV)) {
                for (b, p) in row.iter().zip(p.iter().skip(NAV)) {
                    sum += a * p * b;
                }
            }
            sum.max(0.0)
        })
    }

    /// Variances of a new navigator's errors that come from lever arm and age.
    pub fn unknown(&self) -> [f32; OBSERVATIONS] {
        if self.estimates() {
            self.spread()
        } else {
            [0.0; OBSERVATIONS]
        }
    }

    /// The navigator has passed an interval with the correction `applied`, whose maps are taken for
    /// right. The covariance follows in [`Antenna::update`], which gets the same interval.
    pub fn interval(&mut self, block: &Transition<NAV>, applied: &Correction) {
        if self.estimates() {
            let applied = Correction {
                estimate: applied.estimate,
                ..Correction::NONE
            };
            self.filter
                .propagate_mean(&self.moves(Some(block)), &applied);
            self.moved = true;
        }
    }

    /// A fix at the end of the last interval.
    pub fn fix(&mut self, innovation: &AntennaInnovation, variance: &[f32; OBSERVATIONS]) {
        let d = self.error();
        let mut moves = [0.0; STATES];
        for (k, (to, of)) in innovation.by.iter().zip(&self.effect).enumerate() {
            let change = product(of, &d) - product(to, &d);
            if let Some(entry) = moves.get_mut(state(k)) {
                *entry = change;
            }
        }
        self.filter.feedback(&moves);
        self.effect = innovation.by;
        self.fix = (innovation.z, *variance);
        for (variance, nonlinearity) in self.fix.1.iter_mut().zip(innovation.nonlinearity) {
            *variance += nonlinearity;
        }
        self.fixed = true;
    }

    /// The least age as a time pulse has measured it, s, with the last fix.
    pub fn measured(&mut self, least_s: f32) {
        self.measured = Some(least_s);
    }

    /// Whether refusals of the last fix count.
    pub fn counts_refusals(&mut self, counts: bool) {
        self.counts = counts;
    }

    /// Adds variance to the navigator's errors.
    pub fn inflate(&mut self, variance: &[f32; NAV]) {
        if self.estimates() {
            self.filter.inflate(&joined(variance, &[0.0; ANTENNA]));
        }
    }

    /// Drops the last interval and fix.
    pub fn clear(&mut self) {
        (self.moved, self.fixed) = (false, false);
        self.measured = None;
    }

    /// The navigator has been corrected by `error`, and is then to use [`Antenna::arm`].
    pub fn feed_back(&mut self, error: &[f32; NAV]) {
        if self.estimates() {
            self.filter.feedback(&joined(error, &[0.0; ANTENNA]));
            self.take();
        }
    }

    /// d: estimate minus truth of lever arm and age.
    fn error(&self) -> [f32; ANTENNA] {
        let [.., x, y, z, age] = *self.filter.error_state();
        [x, y, z, age]
    }

    /// Moves d into the estimate in use. The age stays in the range of ages.
    fn take(&mut self) {
        let [x, y, z, age] = self.error();
        for (arm, error) in self.arm.iter_mut().zip([x, y, z]) {
            *arm -= error;
        }
        let now = (self.age - age).clamp(0.0, MAX_AGE_S);
        let d = [x, y, z, self.age - now];
        self.age = now;
        let mut moves = joined(&[0.0; NAV], &d);
        for (k, row) in self.effect.iter().enumerate() {
            if let Some(entry) = moves.get_mut(state(k)) {
                *entry = product(row, &d);
            }
        }
        self.filter.feedback(&moves);
    }
}

/// The navigation error that observation `k` sees: position first, then velocity.
fn state(k: usize) -> usize {
    if k < 3 { 6 + k } else { k }
}

fn product(row: &[f32; ANTENNA], d: &[f32; ANTENNA]) -> f32 {
    row.iter().zip(d).fold(0.0, |sum, (a, b)| sum + a * b)
}

fn joined(errors: &[f32; NAV], antenna: &[f32; ANTENNA]) -> [f32; STATES] {
    let mut all = [0.0; STATES];
    let both = errors.iter().chain(antenna);
    all.iter_mut().zip(both).for_each(|(to, of)| *to = *of);
    all
}

#[cfg(test)]
mod tests;
