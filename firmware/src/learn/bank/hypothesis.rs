//! What a bank needs of any hypothesis, whatever it learns.

use super::super::prior::{LearnerNet, NAV};
use super::considered::Gains;
use lrnn_nostd::learn::kalman::{
    Correction, Innovation, Kalman, Maps, OUTPUTS, ParameterSet, TRIADS, Transition, Workspace,
};
use lrnn_nostd::{Rational, Real, State};

/// Interface of a hypothesis for the bank.
pub trait Hypothesis<T: Real> {
    fn step(&mut self, inputs: [[T; 3]; TRIADS]);
    fn propagate_mean(&mut self, block: &Transition<NAV, T>, applied: &Correction<T>);
    fn propagate_covariance(
        &mut self,
        block: &Transition<NAV, T>,
        workspace: &mut Workspace<NAV, OUTPUTS, T>,
    );
    fn inflate(&mut self, variance: &[T; NAV]);
    fn set_rest(&mut self, rest: [[T; 3]; TRIADS]);
    fn maps(&self) -> &Maps<T>;
    fn reset_networks(&mut self);
    fn states(&self) -> &[State<T>; TRIADS];
    fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T>;
    fn score(&mut self, innovation: Innovation<T>, cap: T);
    fn gains(&self, i: usize, variance: T) -> Gains<T>;
    fn update(&mut self, i: usize, innovation: Innovation<T>);
    fn innovation_of_output(&mut self, k: usize, by: &[T; NAV], z: T, variance: T)
    -> Innovation<T>;
    fn update_output(&mut self, k: usize, by: &[T; NAV], z: T, variance: T) -> Gains<T>;
    fn finish_update(&mut self);
    fn feedback(&mut self, e: &[T; NAV]);
    fn align_mean(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]);
    fn align_covariance(
        &mut self,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        workspace: &mut Workspace<NAV, OUTPUTS, T>,
    );
    fn error_state(&self) -> &[T; NAV];
    fn estimate(&self) -> &[T; OUTPUTS];
    fn output(&self) -> [T; OUTPUTS];
    fn nets(&self) -> [LearnerNet<T>; TRIADS];
    fn log_likelihood(&self) -> f64;
    fn is_healthy(&self) -> bool;
    fn bias_sigma(&self) -> [T; OUTPUTS];
    fn settle(&mut self, inputs: [[T; 3]; TRIADS]);
    fn unit_nets(&self) -> [LearnerNet<T>; TRIADS];
    fn unit_estimate(&self) -> [T; OUTPUTS];
    fn remember(&mut self, put: &mut dyn FnMut(T));
    fn turn_on_moments(&self) -> [T; OUTPUTS];
    fn believe(&mut self, evidence: f64);
}

impl<L, const N: usize, const PACKED: usize, T> Hypothesis<T>
    for Kalman<L, NAV, N, PACKED, Rational, T>
where
    L: ParameterSet,
    T: Real,
{
    fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        Kalman::step(self, inputs);
    }
    fn propagate_mean(&mut self, block: &Transition<NAV, T>, applied: &Correction<T>) {
        Kalman::propagate_mean(self, block, applied);
    }
    fn propagate_covariance(
        &mut self,
        block: &Transition<NAV, T>,
        workspace: &mut Workspace<NAV, OUTPUTS, T>,
    ) {
        Kalman::propagate_covariance(self, block, workspace);
    }
    fn inflate(&mut self, variance: &[T; NAV]) {
        Kalman::inflate(self, variance);
    }
    fn set_rest(&mut self, rest: [[T; 3]; TRIADS]) {
        Kalman::set_rest(self, rest);
    }
    fn maps(&self) -> &Maps<T> {
        self.model().maps()
    }
    fn reset_networks(&mut self) {
        Kalman::reset_networks(self);
    }
    fn states(&self) -> &[State<T>; TRIADS] {
        self.model().states()
    }
    fn innovation(&self, i: usize, z: T, variance: T) -> Innovation<T> {
        Kalman::innovation(self, i, z, variance)
    }
    fn score(&mut self, innovation: Innovation<T>, cap: T) {
        Kalman::score(self, innovation, cap);
    }
    fn gains(&self, i: usize, variance: T) -> Gains<T> {
        Kalman::gains(self, i, variance)
    }
    fn update(&mut self, i: usize, innovation: Innovation<T>) {
        Kalman::update(self, i, innovation);
    }
    fn innovation_of_output(
        &mut self,
        k: usize,
        by: &[T; NAV],
        z: T,
        variance: T,
    ) -> Innovation<T> {
        Kalman::innovation_of_output(self, k, by, z, variance)
    }
    fn update_output(&mut self, k: usize, by: &[T; NAV], z: T, variance: T) -> Gains<T> {
        Kalman::update_output(self, k, by, z, variance)
    }
    fn finish_update(&mut self) {
        Kalman::finish_update(self);
    }
    fn feedback(&mut self, e: &[T; NAV]) {
        Kalman::feedback(self, e);
    }
    fn align_mean(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]) {
        Kalman::align_mean(self, by, applied);
    }
    fn align_covariance(
        &mut self,
        by: &[[T; OUTPUTS]; NAV],
        rest: &[[T; NAV]; NAV],
        workspace: &mut Workspace<NAV, OUTPUTS, T>,
    ) {
        Kalman::align_covariance(self, by, rest, workspace);
    }
    fn error_state(&self) -> &[T; NAV] {
        Kalman::error_state(self)
    }
    fn estimate(&self) -> &[T; OUTPUTS] {
        self.model().estimate()
    }
    fn output(&self) -> [T; OUTPUTS] {
        self.model().output()
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
    fn bias_sigma(&self) -> [T; OUTPUTS] {
        Kalman::bias_sigma(self)
    }
    fn settle(&mut self, inputs: [[T; 3]; TRIADS]) {
        Kalman::settle(self, inputs);
    }
    fn unit_nets(&self) -> [LearnerNet<T>; TRIADS] {
        self.model().unit_nets()
    }
    fn unit_estimate(&self) -> [T; OUTPUTS] {
        let mut estimate = self.model().output();
        let biases = self.model().biases().as_flattened();
        for (estimate, &bias) in estimate.iter_mut().zip(biases) {
            *estimate -= bias;
        }
        estimate
    }
    fn remember(&mut self, put: &mut dyn FnMut(T)) {
        Kalman::remember(self, put);
    }
    fn turn_on_moments(&self) -> [T; OUTPUTS] {
        Kalman::turn_on_moments(self)
    }
    fn believe(&mut self, evidence: f64) {
        Kalman::believe(self, evidence);
    }
}
