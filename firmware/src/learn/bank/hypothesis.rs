//! What a bank needs of any hypothesis, whatever it learns.

use super::super::prior::{LearnerNet, NAV};
use lrnn_nostd::learn::kalman::{Innovation, Kalman, Learns, OUTPUTS, Passage, TRIADS, Transition};
use lrnn_nostd::{Rational, Real, State};

/// What a bank needs of any hypothesis.
pub trait Hypothesis<T: Real> {
    fn step(&mut self, inputs: [[T; 3]; TRIADS]);
    fn predict(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]);
    fn carry(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]);
    fn spread(
        &mut self,
        part: usize,
        block: &Transition<NAV, T>,
        passage: &mut Passage<NAV, OUTPUTS, T>,
    );
    fn inflate(&mut self, variance: &[T; NAV]);
    fn restart_nets(&mut self);
    fn states(&self) -> &[State<T>; TRIADS];
    fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T>;
    fn weigh(&mut self, innovation: Innovation<T>, cap: T);
    fn observe(&mut self, i: usize, innovation: Innovation<T>);
    fn absorb(&mut self) -> bool;
    fn settle(&mut self);
    fn fed_back(&mut self, e: &[T; NAV]);
    fn derive(&mut self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV], applied: &[T; OUTPUTS]);
    fn derive_means(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]);
    fn derive_spread(
        &mut self,
        part: usize,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        passage: &mut Passage<NAV, OUTPUTS, T>,
    );
    fn outer(&self) -> &[T; NAV];
    fn estimate(&self) -> &[T; OUTPUTS];
    fn nets(&self) -> [LearnerNet<T>; TRIADS];
    fn log_likelihood(&self) -> f64;
    fn is_healthy(&self) -> bool;
}

impl<L, const N: usize, const PACKED: usize, T> Hypothesis<T>
    for Kalman<L, NAV, N, PACKED, Rational, T>
where
    L: Learns,
    T: Real,
{
    fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        Kalman::step(self, inputs);
    }
    fn predict(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        Kalman::predict(self, block, applied);
    }
    fn carry(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        Kalman::carry(self, block, applied);
    }
    fn spread(
        &mut self,
        part: usize,
        block: &Transition<NAV, T>,
        passage: &mut Passage<NAV, OUTPUTS, T>,
    ) {
        Kalman::spread(self, part, block, passage);
    }
    fn inflate(&mut self, variance: &[T; NAV]) {
        Kalman::inflate(self, variance);
    }
    fn restart_nets(&mut self) {
        Kalman::restart_nets(self);
    }
    fn states(&self) -> &[State<T>; TRIADS] {
        self.model().states()
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
    fn absorb(&mut self) -> bool {
        Kalman::absorb(self)
    }
    fn settle(&mut self) {
        Kalman::settle(self);
    }
    fn fed_back(&mut self, e: &[T; NAV]) {
        Kalman::fed_back(self, e);
    }
    fn derive(&mut self, by: &[[T; OUTPUTS]; NAV], rest: &[[T; NAV]; NAV], applied: &[T; OUTPUTS]) {
        Kalman::derive(self, by, rest, applied);
    }
    fn derive_means(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]) {
        Kalman::derive_means(self, by, applied);
    }
    fn derive_spread(
        &mut self,
        part: usize,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        passage: &mut Passage<NAV, OUTPUTS, T>,
    ) {
        Kalman::derive_spread(self, part, by, rest, passage);
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
