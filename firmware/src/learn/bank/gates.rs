//! When an observation is refused and when a hypothesis is trusted.

use super::table::ALL;
use lrnn_nostd::Real;

/// When an observation is refused and when a hypothesis is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates<T = f32> {
    /// An observation is refused when its squared distance, in squared standard deviations, is
    /// greater than this for every hypothesis.
    pub squared_ratio: T,
    /// After this many refusals of an observation in a row it is accepted.
    pub escape: u8,
    /// By how much the log-likelihood must exceed that of the zero correction: ln of the odds
    /// against chance.
    pub evidence: f64,
    /// By how much it must exceed the running hypothesis'.
    pub better: f64,
    /// Hypotheses that take part, one bit each. Without [`super::ZERO_CORRECTION`] the best of the
    /// others runs, whatever its evidence.
    pub enabled: u8,
}

impl Gates {
    /// 5 sigma; 10 fixes; less than one wrong promotion in a hundred.
    pub const USUAL: Gates = Gates {
        squared_ratio: 25.0,
        escape: 10,
        evidence: 4.6,
        better: 1.0,
        enabled: ALL,
    };
}

impl<T: Real> Default for Gates<T> {
    /// [`Gates::USUAL`].
    fn default() -> Self {
        let Gates {
            squared_ratio,
            escape,
            evidence,
            better,
            enabled,
        } = Gates::USUAL;
        Self {
            squared_ratio: T::from_f64(f64::from(squared_ratio)),
            escape,
            evidence,
            better,
            enabled,
        }
    }
}
