//! Settings of the networks' training.

use serde::{Deserialize, Serialize};

/// Learning rules of `lrnn-nostd`, by which the weights of the next pass are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Gauss-Newton with a prior on each weight: some ten passes.
    GaussNewton,
    /// The paper's step sizes, with a check: a pass that increases the cost is undone. It takes
    /// hundreds of passes and has no prior.
    Guarded,
    /// The paper's rule as printed (eq. 7-13).
    Paper,
}

/// Settings of the networks' training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NetworkSpec {
    /// Epochs (s) in a reference window, >= 1.
    pub window_s: u32,
    /// Learning rule.
    pub rule: Rule,
    /// Passes over the learning part, >= 1.
    pub passes: u32,
    /// First step of the gradient rules, relative to the mean over windows, > 0.
    pub first_step: f64,
    /// Standard deviation of each weight around its start, > 0. This prior keeps 63 parameters from
    /// fitting noise.
    pub weight_sigma: f64,
    /// Time over which the errors of neighbouring references are correlated, s, > 0.
    pub correlation_s: f64,
    /// Share of the learning session, at its end, that no network learns from and that decides
    /// whether one is used; 0.05 to 0.5.
    pub held_back: f64,
    /// Seed of the first weights.
    pub seed: u64,
}

impl Default for NetworkSpec {
    fn default() -> Self {
        Self {
            window_s: 10,
            rule: Rule::GaussNewton,
            passes: 12,
            first_step: 0.1,
            weight_sigma: 0.3,
            correlation_s: 300.0,
            held_back: 0.2,
            seed: 1,
        }
    }
}

impl NetworkSpec {
    /// Settings for recordings of a few minutes: windows of one second.
    #[must_use]
    pub fn short() -> Self {
        Self {
            window_s: 1,
            correlation_s: 10.0,
            ..Self::default()
        }
    }
}
