//! Several hypotheses about the sensors, tried on the same fixes; the one that has proved itself runs.
//!
//! From "the sensors are right" over six biases to networks with narrow and wide priors: which of them fits a unit is not known
//! beforehand, so each predicts every fix before it learns from it, and the sum of its log-likelihoods tells. One is *running*: its
//! estimate is taken out of the increments. It is replaced by another only when that one beats it, and beats "no correction", by
//! more than [`Gates::evidence`]; and given up for "no correction" when it no longer does.

use super::prior::{All, Datasheet, LearnerNet, NAV};
use lrnn_nostd::learn::kalman::{
    Biases, ErrorModel, Innovation, Kalman, Nothing, OUTPUTS, OutputWeights, Prior, TRIADS,
    Transition,
};
use lrnn_nostd::{Rational, Real};

/// Observations of a fix: position (north, east, down, m), then velocity (m/s).
pub const OBSERVATIONS: usize = 6;
/// Hypotheses.
pub const HYPOTHESES: usize = 6;
/// The one that believes the sensors.
pub const NOTHING: usize = 0;
/// Greatest contribution of the networks of hypotheses 2, 3, 4 and 5, in units of the bias.
const OUTPUT: [f64; 4] = [0.1, 0.3, 1.0, 0.1];

/// When an observation is refused and when a hypothesis is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates<T = f32> {
    /// An observation further out than this in squared standard deviations, for every hypothesis, is refused.
    pub squared_ratio: T,
    /// After so many refusals of an observation in a row it is believed.
    pub escape: u8,
    /// By how much the log-likelihood must be better than that of "no correction": ln of the odds against chance.
    pub evidence: f64,
    /// By how much it must be better than the running hypothesis'.
    pub better: f64,
    /// Hypotheses that take part, one bit each. Without [`NOTHING`] the best of the others runs, proved or not.
    pub enabled: u8,
}

/// What they are called.
pub const NAMES: [&str; HYPOTHESES] = [
    "nothing",
    "biases",
    "output weights, narrow prior",
    "output weights",
    "output weights, wide prior",
    "all weights",
];

/// All hypotheses.
pub const ALL: u8 = (1 << HYPOTHESES) - 1;

impl<T: Real> Default for Gates<T> {
    /// 5 sigma; 10 fixes; less than one wrong promotion in a hundred.
    fn default() -> Self {
        Self {
            squared_ratio: T::from_f64(25.0),
            escape: 10,
            evidence: 4.6,
            better: 1.0,
            enabled: ALL,
        }
    }
}

/// What a bank needs of any hypothesis.
trait Hypothesis<T: Real> {
    fn step(&mut self, inputs: [[T; 3]; TRIADS]);
    fn predict(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]);
    fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T>;
    fn weigh(&mut self, innovation: Innovation<T>, cap: T);
    fn observe(&mut self, i: usize, innovation: Innovation<T>);
    fn settle(&mut self);
    fn fed_back(&mut self, e: &[T; NAV]);
    fn restart(&mut self, outer: &[T; NAV]);
    fn derive(&mut self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV], applied: &[T; OUTPUTS]);
    fn outer(&self) -> &[T; NAV];
    fn estimate(&self) -> &[T; OUTPUTS];
    fn nets(&self) -> [LearnerNet<T>; TRIADS];
    fn log_likelihood(&self) -> f64;
    fn is_healthy(&self) -> bool;
}

impl<L, const N: usize, const PACKED: usize, T> Hypothesis<T>
    for Kalman<L, NAV, N, PACKED, Rational, T>
where
    L: lrnn_nostd::learn::kalman::Learns,
    T: Real,
{
    fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        Kalman::step(self, inputs);
    }
    fn predict(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        Kalman::predict(self, block, applied);
    }
    fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T> {
        Kalman::innovation(self, i, z, variance)
    }
    fn weigh(&mut self, innovation: Innovation<T>, cap: T) {
        Kalman::weigh(self, innovation, cap);
    }
    fn observe(&mut self, i: usize, innovation: Innovation<T>) {
        Kalman::observe(self, i, innovation);
    }
    fn settle(&mut self) {
        Kalman::settle(self);
    }
    fn fed_back(&mut self, e: &[T; NAV]) {
        Kalman::fed_back(self, e);
    }
    fn restart(&mut self, outer: &[T; NAV]) {
        Kalman::restart(self, outer);
    }
    fn derive(&mut self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV], applied: &[T; OUTPUTS]) {
        Kalman::derive(self, by, rest, applied);
    }
    fn outer(&self) -> &[T; NAV] {
        Kalman::outer(self)
    }
    fn estimate(&self) -> &[T; OUTPUTS] {
        self.model().estimate()
    }
    fn nets(&self) -> [LearnerNet<T>; TRIADS] {
        self.model().nets()
    }
    fn log_likelihood(&self) -> f64 {
        Kalman::log_likelihood(self)
    }
    fn is_healthy(&self) -> bool {
        Kalman::is_healthy(self)
    }
}

type Mixed<T> = Kalman<OutputWeights, NAV, 24, 300, Rational, T>;

/// The hypotheses over one navigator.
#[derive(Clone, Debug)]
pub struct Bank<T: Real = f32> {
    nothing: Kalman<Nothing, NAV, 0, 0, Rational, T>,
    biases: Kalman<Biases, NAV, 6, 21, Rational, T>,
    mixed: [Mixed<T>; 3],
    all: All<T>,
    gates: Gates<T>,
    /// Standard deviation of an error that [`NOTHING`] has no parameter for.
    unmodelled: [T; OUTPUTS],
    refused: [u8; OBSERVATIONS],
    running: usize,
}

impl<T: Real> Bank<T> {
    /// Hypotheses about sensors of this datasheet; networks step once a block of `block_s` (s). `outer` are the standard deviations of
    /// the navigator's errors, in the order of [`NAV`].
    #[must_use]
    pub fn new(sheet: &Datasheet<T>, block_s: f64, outer: [T; NAV], gates: Gates<T>) -> Self {
        let nets = sheet.nets(block_s);
        let floor = outer_floor();
        let mixed = |output| {
            let prior = sheet.prior::<OutputWeights, 24>(block_s, output, outer, floor);
            Kalman::new(ErrorModel::new(nets), prior)
        };
        let [narrow, middle, wide, all] = OUTPUT;
        Self {
            nothing: Kalman::new(
                ErrorModel::new(nets),
                sheet.prior::<Nothing, 0>(block_s, 0.0, outer, floor),
            ),
            biases: Kalman::new(
                ErrorModel::new(nets),
                sheet.prior::<Biases, 6>(block_s, 0.0, outer, floor),
            ),
            mixed: [mixed(narrow), mixed(middle), mixed(wide)],
            all: Kalman::new(ErrorModel::new(nets), all_prior(sheet, block_s, all, outer)),
            gates,
            unmodelled: [
                sheet.gyro_bias,
                sheet.gyro_bias,
                sheet.gyro_bias,
                sheet.accel_bias,
                sheet.accel_bias,
                sheet.accel_bias,
            ],
            refused: [0; OBSERVATIONS],
            running: NOTHING,
        }
    }

    fn get(&self, index: usize) -> &dyn Hypothesis<T> {
        let [narrow, middle, wide] = &self.mixed;
        match index {
            1 => &self.biases,
            2 => narrow,
            3 => middle,
            4 => wide,
            5 => &self.all,
            _ => &self.nothing,
        }
    }

    fn each(&mut self, mut act: impl FnMut(&mut dyn Hypothesis<T>)) {
        let enabled = self.gates.enabled;
        let [narrow, middle, wide] = &mut self.mixed;
        let all: [&mut dyn Hypothesis<T>; HYPOTHESES] = [
            &mut self.nothing,
            &mut self.biases,
            narrow,
            middle,
            wide,
            &mut self.all,
        ];
        for (index, hypothesis) in all.into_iter().enumerate() {
            if enabled >> index & 1 == 1 {
                act(hypothesis);
            }
        }
    }

    /// Mean rate (rad/s) and specific force (m/s^2) of the block that has ended, as measured; the estimates are for the next one.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        self.each(|h| h.step(inputs));
    }

    /// The navigator has been through a block with `applied` (rad/s, m/s^2) taken out.
    pub fn predict(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        self.each(|h| h.predict(block, applied));
    }

    /// Takes a fix: `z`, navigator minus fix, and its variances. Gives what was refused, one bit an observation.
    pub fn fix(&mut self, z: &[T; OBSERVATIONS], variance: &[T; OBSERVATIONS]) -> u8 {
        let cap = self.gates.squared_ratio;
        let mut bits = 0;
        for k in 0..OBSERVATIONS {
            let (i, z, variance) = (index(k), z[k], variance[k]);
            let mut outlier = true;
            self.each(|h| {
                let innovation = h.innovation(i, z, variance);
                h.weigh(innovation, cap);
                let inside = innovation.squared_ratio() <= cap && h.is_healthy();
                outlier &= !inside;
            });
            let believed = !outlier || self.refused[k] >= self.gates.escape;
            // never a number that is none
            if believed && z.is_finite() {
                self.refused[k] = 0;
                self.each(|h| h.observe(i, h.innovation(i, z, variance)));
            } else {
                self.refused[k] = self.refused[k].saturating_add(1);
                bits |= 1 << k;
            }
        }
        self.each(|h| h.settle());
        self.choose();
        bits
    }

    /// Log-likelihood of one that may run.
    fn standing(&self, index: usize) -> f64 {
        let hypothesis = self.get(index);
        let enabled = self.gates.enabled >> index & 1 == 1;
        if enabled && (index == NOTHING || hypothesis.is_healthy()) {
            hypothesis.log_likelihood()
        } else {
            f64::NEG_INFINITY
        }
    }

    /// Promotion and rollback.
    fn choose(&mut self) {
        let (nothing, running) = (self.standing(NOTHING), self.standing(self.running));
        let mut best = (NOTHING, nothing + self.gates.evidence);
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
        let e = *self.get(self.running).outer();
        self.each(|h| h.fed_back(&e));
        e
    }

    /// A new navigator; what has been learnt stays.
    pub fn restart(&mut self, outer: &[T; NAV]) {
        self.each(|h| h.restart(outer));
    }

    /// A new navigator that was aligned at standstill: its initial errors are `by` (rad, m/s, m for 1 rad/s or 1 m/s^2) times what the
    /// sensors' errors then were, of which `applied` had been taken out, plus others of covariance `rest`. What has been learnt stays.
    pub fn align(
        &mut self,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        applied: &[T; OUTPUTS],
    ) {
        self.each(|h| h.derive(by, rest, applied));
        let mut all = *rest;
        for i in 0..NAV {
            for j in 0..NAV {
                for k in 0..OUTPUTS {
                    let sigma = self.unmodelled[k];
                    all[i][j] += by[i][k] * by[j][k] * (sigma * sigma);
                }
            }
        }
        self.nothing.derive(by, &all, applied);
    }

    /// Index of the running hypothesis: 0 nothing, 1 biases, 2 to 4 output weights with narrow to wide priors, 5 all weights.
    #[must_use]
    pub fn running(&self) -> usize {
        self.running
    }

    /// Log-likelihood of a hypothesis, relative to [`NOTHING`]'s.
    #[must_use]
    pub fn evidence(&self, index: usize) -> f64 {
        self.get(index).log_likelihood() - self.nothing.log_likelihood()
    }

    /// Whether a hypothesis is finite.
    #[must_use]
    pub fn is_healthy(&self, index: usize) -> bool {
        self.get(index).is_healthy()
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
fn outer_floor<T: Real>() -> [T; NAV] {
    let [a, v, p] = [1e-7, 1e-5, 1e-4].map(T::from_f64);
    [a, a, a, v, v, v, p, p, p]
}

fn all_prior<T: Real>(
    sheet: &Datasheet<T>,
    block_s: f64,
    output: f64,
    outer: [T; NAV],
) -> Prior<NAV, 132, T> {
    sheet.prior::<lrnn_nostd::learn::kalman::AllWeights, 132>(block_s, output, outer, outer_floor())
}
