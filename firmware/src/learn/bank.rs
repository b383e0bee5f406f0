//! Several hypotheses about the sensors, tried on the same fixes. The one with the most evidence
//! leads.
//!
//! The hypotheses range from "the sensors are right" over six biases to networks with narrow and
//! wide priors. It is not known beforehand which of them fits a unit. So each predicts every fix
//! before it learns from it, and the sum of its log-likelihoods is its evidence. One hypothesis
//! *leads*: the learner's own navigator subtracts its estimate. Another one takes its place when it
//! beats the leading one by [`Gates::better`] and the zero correction by [`Gates::evidence`]. A
//! leading hypothesis that falls below the zero correction is given up.
//!
//! Evidence believes the noise model. So it ranks the hypotheses, but no correction comes into
//! force by it: that takes [rehearsals](super::rehearsal).

mod considered;
mod gates;
mod hypothesis;
mod row;
mod scales;
mod table;
mod update;

pub(super) use considered::Sizes;
pub use gates::Gates;
pub(super) use gates::Refusals;
pub use row::Row;
pub use table::{
    ALL, CURVED, DRIVEN, EXTENDING, HYPOTHESES, KEYS, MAP, NAMES, REMEMBERED, REMEMBERING,
    SIX_BIASES, STEP, STEPPED, STEPS, STORED, WITH_NETWORKS, ZERO_CORRECTION,
};
pub use update::Scratch;

use super::prior::{Datasheet, Layers, LearnerNet, NAV, Shapes};
use crate::fix::OBSERVATIONS;
use crate::inputs::settles;
use crate::inputs::{Inputs, OWN};
use considered::Considered;
pub(super) use gates::error_floor;
use gates::index;
use hypothesis::Hypothesis;
use lrnn_nostd::learn::kalman::{Correction, FixedWeights, Maps, OUTPUTS, TRIADS};
use lrnn_nostd::{Real, State, Weights};
use table::Hypotheses;

/// Observations that can be refused.
const REFUSED: usize = OBSERVATIONS + row::AXES;

/// The hypotheses over one navigator.
#[derive(Clone, Debug)]
pub struct Bank<T: Real = f32> {
    hypotheses: Hypotheses<T>,
    considered: Considered<T>,
    gates: Gates<T>,
    /// Standard deviation of a sensor error, for which [`ZERO_CORRECTION`] has no parameter.
    unmodelled: [T; OUTPUTS],
    /// Of each component of a fix, and of each gyro at rest.
    refused: [Refusals; REFUSED],
    leading: usize,
    /// Hypotheses that have not fallen behind the best after the last fix; one bit each.
    open: u8,
    /// The alignment has estimated the sensors' errors: see [`Self::navigating`].
    believed: bool,
    /// Networks that begin in the steady state of their inputs have not stepped yet; one bit for
    /// each hypothesis.
    fresh: u8,
    /// The networks' inputs follow something that was there before power-on: see
    /// [`lrnn_nostd::Net::settle`].
    settles: bool,
}

impl<T: Real> Bank<T> {
    /// Hypotheses about sensors of this datasheet. The networks step once a block of `block_s`
    /// seconds. `error_sigma` are the standard deviations of the navigator's errors, in the order
    /// of [`NAV`].
    #[must_use]
    pub fn new(sheet: &Datasheet<T>, block_s: f64, error_sigma: [T; NAV], gates: Gates<T>) -> Self {
        let mut bank = Self::ZEROED;
        let shapes = Shapes::new(&sheet.nets(block_s), sheet, &OWN).complete();
        bank.begin((sheet, &OWN), &shapes, block_s, error_sigma, gates);
        bank
    }

    /// A bank that waits for [`Bank::begin`]. All zeros, so that a static one takes no room in
    /// flash.
    pub const ZEROED: Self = Self {
        hypotheses: Hypotheses::ZEROED,
        considered: Considered::ZEROED,
        gates: Gates {
            squared_ratio: T::ZERO,
            escape: 0,
            evidence: 0.0,
            better: 0.0,
            enabled: 0,
        },
        unmodelled: [T::ZERO; OUTPUTS],
        refused: [Refusals::NONE; REFUSED],
        leading: ZERO_CORRECTION,
        open: 0,
        believed: false,
        fresh: 0,
        settles: false,
    };

    /// [`Bank::new`] in place: a bank should not be moved over the stack. `shapes`: the first
    /// networks of the hypotheses that are driven by these inputs; all that they reach is found
    /// ([`Shapes::reach`]).
    #[inline(never)]
    pub fn begin(
        &mut self,
        (sheet, inputs): (&Datasheet<T>, &Inputs),
        shapes: &Shapes<T>,
        block_s: f64,
        error_sigma: [T; NAV],
        gates: Gates<T>,
    ) {
        self.begins((sheet, inputs), gates);
        self.begin_some(ALL, sheet, shapes, block_s, error_sigma);
    }

    /// The first part of [`Bank::begin`]. [`Bank::begin_some`] must follow for each hypothesis.
    pub fn begins(&mut self, (sheet, inputs): (&Datasheet<T>, &Inputs), gates: Gates<T>) {
        let [g, a] = [sheet.gyro_bias, sheet.accel_bias];
        self.unmodelled = [g, g, g, a, a, a];
        self.gates = gates;
        self.gates.enabled &= !(1 << STORED);
        self.settles = settles(inputs);
        if !self.settles {
            self.gates.enabled &= !(1 << CURVED); // no temperature that could rule
        }
        self.refused = [Refusals::NONE; REFUSED];
        self.leading = ZERO_CORRECTION;
        self.open = self.gates.enabled;
        self.believed = false;
        self.fresh = table::SETTLING;
    }

    /// The hypotheses in the bits `which` begin.
    #[inline(never)]
    pub fn begin_some(
        &mut self,
        which: u8,
        sheet: &Datasheet<T>,
        shapes: &Shapes<T>,
        block_s: f64,
        error_sigma: [T; NAV],
    ) {
        let all = (sheet, shapes, block_s);
        self.hypotheses
            .begin(which, all, error_sigma, error_floor());
        self.some(which & 1 << STEPPED, |h| h.believe(libm::log(STEPS)));
    }

    /// Whether this is [`STORED`], and takes part: [`Bank::begin_stored`] has begun it.
    pub fn takes_part_as_stored(&self, index: usize) -> bool {
        index == STORED && self.takes_part(STORED)
    }

    /// After [`Bank::begin`]: what was known of the unit when the last drive ended, by
    /// [`Bank::remember`]. `ages`: by how much each variance has grown since, as a share of its
    /// prior. `evidence`: of the others of [`REMEMBERING`] against [`SIX_BIASES`] so far.
    /// `has_map`: values of [`MAP`] are among them, else zeros are in their place. False: a value
    /// cannot be, and the hypothesis that it belongs to stays as it was.
    #[inline(never)]
    pub fn recall(&mut self, values: &[T], ages: T, evidence: [f64; 3], has_map: bool) -> bool {
        let taken = self.hypotheses.recall(values, ages, has_map);
        if taken {
            for (index, evidence) in REMEMBERING.into_iter().skip(1).zip(evidence) {
                self.some(1 << index, |h| h.believe(evidence));
            }
            let scores = self.scores();
            self.note_open(&scores);
        }
        taken
    }

    /// Gives what [`REMEMBERING`] know of the unit: [`REMEMBERED`] values each.
    pub fn remember(&mut self, put: &mut dyn FnMut(T)) {
        let remembering = self.remembering().iter().fold(0, |bits, of| bits | 1 << of);
        self.hypotheses.each_of(remembering, |h| h.remember(put));
    }

    /// [`REMEMBERING`], with the likelier of both kinds of biases.
    pub fn remembering(&self) -> [usize; 4] {
        [self.biases(), DRIVEN, CURVED, MAP]
    }

    /// The likelier of [`SIX_BIASES`] and [`STEPPED`], which remember the same.
    pub fn biases(&self) -> usize {
        if self.score(STEPPED) > self.score(SIX_BIASES) {
            STEPPED
        } else {
            SIX_BIASES
        }
    }

    /// Second moments of the biases of this turn-on about zero, of [`REMEMBERING`].
    pub fn turn_on_moments(&self, index: usize) -> [T; OUTPUTS] {
        self.get(index).turn_on_moments()
    }

    /// After [`Bank::begin`]: the hypothesis [`STORED`] takes part, with these networks and maps.
    #[inline(never)]
    pub fn begin_stored(
        &mut self,
        (nets, maps): (&[LearnerNet<T>; TRIADS], &Maps<T>),
        sheet: &Datasheet<T>,
        error_sigma: [T; NAV],
    ) {
        self.hypotheses.begin_stored(nets, maps, || {
            sheet.prior::<FixedWeights, 0>(
                Layers::Time(&Weights::zero()),
                0.0,
                error_sigma,
                error_floor(),
            )
        });
        self.gates.enabled |= 1 << STORED;
        self.open |= 1 << STORED;
    }

    /// Whether a hypothesis takes part.
    #[must_use]
    pub fn takes_part(&self, index: usize) -> bool {
        self.gates.enabled >> index & 1 == 1
    }

    fn get(&self, index: usize) -> &dyn Hypothesis<T> {
        self.hypotheses.get(index)
    }

    fn each(&mut self, act: impl FnMut(&mut dyn Hypothesis<T>)) {
        self.some(ALL, act);
    }

    /// The hypotheses in the bits `which` that take part.
    fn some(&mut self, which: u8, act: impl FnMut(&mut dyn Hypothesis<T>)) {
        self.hypotheses.each_of(self.gates.enabled & which, act);
    }

    /// Scores the hypotheses by observation `k` before they learn from it. True: it is no outlier,
    /// and they may learn from it. `counts`: a refusal is one more in a row.
    fn accepts(&mut self, k: usize, z: T, variance: T, counts: bool) -> bool {
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
        refused.accepts(z.is_finite(), outlier, counts, self.gates.escape)
    }

    /// Log-likelihood of a hypothesis; minus infinity for one that may not be used.
    #[must_use]
    pub fn score(&self, index: usize) -> f64 {
        let hypothesis = self.get(index);
        if self.takes_part(index) && hypothesis.is_healthy() {
            hypothesis.log_likelihood()
        } else {
            f64::NEG_INFINITY
        }
    }

    fn scores(&self) -> [f64; HYPOTHESES] {
        core::array::from_fn(|index| self.score(index))
    }

    /// Notes which have not fallen behind the best one of `scores`.
    fn note_open(&mut self, scores: &[f64; HYPOTHESES]) {
        let best = (scores.iter()).fold(f64::NEG_INFINITY, |best, score| best.max(*score));
        let open =
            |(index, score): (usize, &f64)| u8::from(*score >= best - self.gates.evidence) << index;
        self.open = scores.iter().enumerate().map(open).sum();
    }

    /// Whether "the sensors are right" takes part. Without it the best of the others is used,
    /// whatever it has proved: for measurements.
    #[must_use]
    pub fn doubts(&self) -> bool {
        self.takes_part(ZERO_CORRECTION)
    }

    /// Selects the leading hypothesis.
    fn choose(&mut self) {
        let scores = self.scores();
        self.note_open(&scores);
        let of = |index: usize| scores.get(index).copied().unwrap_or(f64::NEG_INFINITY);
        let (zero, leading) = (of(ZERO_CORRECTION), of(self.leading));
        if self.doubts() && !self.get(ZERO_CORRECTION).is_healthy() {
            // nothing is left to compare with
            self.leading = ZERO_CORRECTION;
            return;
        }
        let mut best = (ZERO_CORRECTION, zero + self.gates.evidence);
        for (index, score) in scores.into_iter().enumerate() {
            if score > best.1 {
                best = (index, score);
            }
        }
        // the leading one stays until another is clearly better, or it falls below the zero
        // correction
        if best.1 > leading + self.gates.better || leading < zero {
            self.leading = best.0;
        }
    }

    /// The leading hypothesis' estimate, rad/s and m/s^2.
    #[must_use]
    pub fn estimate(&self) -> &[T; OUTPUTS] {
        self.get(self.leading).estimate()
    }

    /// The estimate of any hypothesis: what it would subtract from the next block.
    #[must_use]
    pub fn estimate_of(&self, index: usize) -> &[T; OUTPUTS] {
        self.get(index).estimate()
    }

    /// The hypothesis that the device's own navigator follows: the leading one. As long as that is
    /// the zero correction, and the alignment has estimated the sensors' errors, it is
    /// [`Self::biases`]: an alignment in motion with sensors of 0.5 deg/s holds for a second only
    /// without them. The output still has no correction then.
    fn navigating(&self) -> usize {
        let biases = self.biases();
        let usable = self.takes_part(biases) && self.is_healthy(biases);
        if self.leading == ZERO_CORRECTION && self.believed && usable {
            biases
        } else {
            self.leading
        }
    }

    /// What any hypothesis subtracts: its estimate for the next block, and its maps.
    #[must_use]
    pub fn correction_of(&self, index: usize) -> Correction<T> {
        let of = self.get(index);
        Correction {
            estimate: *of.estimate(),
            maps: *of.maps(),
        }
    }

    /// The estimate of any hypothesis without its maps' part: its networks' output.
    #[must_use]
    pub fn output_of(&self, index: usize) -> [T; OUTPUTS] {
        self.get(index).output()
    }

    /// The maps of a hypothesis.
    #[must_use]
    pub fn maps_of(&self, index: usize) -> Maps<T> {
        *self.get(index).maps()
    }

    /// Correction that the device's own navigator is to subtract.
    #[must_use]
    pub fn navigating_correction(&self) -> Correction<T> {
        self.correction_of(self.navigating())
    }

    /// Estimate that the device's own navigator is to subtract, rad/s and m/s^2.
    #[must_use]
    pub fn navigating_estimate(&self) -> &[T; OUTPUTS] {
        self.get(self.navigating()).estimate()
    }

    /// The navigator's error by the hypothesis that it follows.
    #[must_use]
    pub fn error_state(&self) -> &[T; NAV] {
        self.get(self.navigating()).error_state()
    }

    /// The navigator's error by any hypothesis.
    #[must_use]
    pub fn error_state_of(&self, index: usize) -> &[T; NAV] {
        self.get(index).error_state()
    }

    /// Standard deviation of one of the navigator's errors by the hypothesis that it follows;
    /// `index` is in the order of [`NAV`].
    #[must_use]
    pub fn error_sigma(&self, index: usize) -> T {
        let of = self.get(self.navigating());
        of.innovation(index, T::ZERO, T::ZERO).variance.sqrt()
    }

    /// As [`Self::error_sigma`], but no smaller than what any hypothesis says that has not yet
    /// fallen behind by the last finished fix: its own standard deviation and its difference to the
    /// one that is followed. So it holds too while the choice among them is open. The biases alone
    /// always count: in a traffic jam laws of time fit the fixes better by far, and are wrong.
    /// Errors that none of them estimates are in it (`considered`).
    #[must_use]
    pub fn error_doubt(&self, index: usize) -> T {
        let at = |of: &dyn Hypothesis<T>| of.error_state().get(index).copied().unwrap_or(T::ZERO);
        let here = at(self.get(self.navigating()));
        let mut doubt = self.error_sigma(index);
        let counts = self.open | 1 << SIX_BIASES;
        for h in (0..HYPOTHESES).filter(|h| counts >> h & 1 == 1) {
            let of = self.get(h);
            let (variance, off) = (
                of.innovation(index, T::ZERO, T::ZERO).variance,
                at(of) - here,
            );
            let sigma = (variance + off * off).sqrt();
            doubt = if sigma > doubt { sigma } else { doubt };
        }
        (doubt * doubt + self.considered.variance(index)).sqrt()
    }

    /// The errors in proportion to what the sensors feel.
    #[cfg(test)]
    pub(super) fn considered(&self) -> &Considered<T> {
        &self.considered
    }

    /// Gives [`Bank::error_state`]. The caller subtracts it from the navigator.
    pub fn feed_back(&mut self) -> [T; NAV] {
        let e = *self.error_state();
        self.each(|h| h.feedback(&e));
        e
    }

    /// Adds variance to the navigator's errors.
    pub fn inflate(&mut self, variance: &[T; NAV]) {
        self.each(|h| h.inflate(variance));
    }

    /// The stream restarts: the networks' states are those of power-on; what was learnt stays.
    pub fn reset_networks(&mut self) {
        self.each(|h| h.reset_networks());
        self.fresh = table::SETTLING;
    }

    /// The covariance `rest` for [`ZERO_CORRECTION`], which has no parameters for the part `by`.
    fn unmodelled(&self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV]) -> [[T; NAV]; NAV] {
        let mut all = *rest;
        for (row, of_row) in all.iter_mut().zip(by) {
            for (entry, of_column) in row.iter_mut().zip(by) {
                for ((&a, &b), sigma) in of_row.iter().zip(of_column).zip(self.unmodelled) {
                    *entry += a * b * (sigma * sigma);
                }
            }
        }
        all
    }

    /// Index of the leading hypothesis in [`NAMES`]; 0 is the zero correction.
    #[must_use]
    pub fn leading(&self) -> usize {
        self.leading
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

    /// States of a hypothesis' networks.
    #[must_use]
    pub fn states_of(&self, index: usize) -> [State<T>; TRIADS] {
        *self.get(index).states()
    }

    /// Standard deviations of the six biases, as the hypothesis that has nothing else knows them.
    #[must_use]
    pub fn bias_sigma(&self) -> [T; OUTPUTS] {
        self.get(self.biases()).bias_sigma()
    }

    /// The networks of a hypothesis that belong to the unit, without the biases of this turn-on.
    #[must_use]
    pub fn unit_nets_of(&self, index: usize) -> [LearnerNet<T>; TRIADS] {
        self.get(index).unit_nets()
    }

    /// Estimate of the present output: [`Bank::output_of`] without the biases of this turn-on.
    #[must_use]
    pub fn unit_estimate_of(&self, index: usize) -> [T; OUTPUTS] {
        self.get(index).unit_estimate()
    }

    /// A hypothesis' networks, its biases folded in.
    #[must_use]
    pub fn nets_of(&self, index: usize) -> [LearnerNet<T>; TRIADS] {
        self.get(index).nets()
    }
}
