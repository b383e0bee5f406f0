//! When an observation is refused and when a hypothesis is trusted.

use super::NAV;
use super::table::ALL;
use lrnn_nostd::Real;

/// Limits at which an observation is refused and a hypothesis is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates<T = f32> {
    /// An observation is refused when its squared distance, in squared standard deviations, is
    /// greater than this for every hypothesis.
    pub squared_ratio: T,
    /// After this many refusals of an observation in a row, once in a second, it is accepted.
    pub escape: u8,
    /// Least log-likelihood above that of the zero correction: ln of the odds against chance.
    pub evidence: f64,
    /// Least log-likelihood above the running hypothesis'.
    pub better: f64,
    /// Hypotheses that take part, one bit each. Without [`super::ZERO_CORRECTION`] the best of the
    /// others runs, whatever its evidence.
    pub enabled: u8,
}

/// Number of refusals of an observation in a row, and whether it is believed nevertheless.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refusals {
    times: u8,
    believed: bool,
}

impl Refusals {
    /// None yet.
    pub const NONE: Refusals = Refusals {
        times: 0,
        believed: false,
    };

    /// Whether an observation is accepted: one that is finite and no outlier, or comes after
    /// `escape` refusals in a row. Refusals count once in a second (`counts`), and what is believed
    /// nevertheless is believed until that second is over.
    pub fn accepts(&mut self, finite: bool, outlier: bool, counts: bool, escape: u8) -> bool {
        if counts && self.believed {
            *self = Refusals::NONE;
        }
        if finite && !outlier {
            *self = Refusals::NONE;
        } else if finite && self.times >= escape {
            self.believed = true;
        } else {
            self.times = self.times.saturating_add(u8::from(counts));
            return false;
        }
        true
    }
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

/// State observed by observation `k`: position first, then velocity.
pub(super) fn index(k: usize) -> usize {
    if k < 3 { 6 + k } else { k }
}

/// Floor of the navigator's errors, left by f32 arithmetic and an imperfect navigator: rad, m/s, m
/// (assumed; far below the effect of any sensor).
pub(in crate::learn) fn error_floor<T: Real>() -> [T; NAV] {
    let [a, v, p] = [1e-7, 1e-5, 1e-4].map(T::from_f64);
    [a, a, a, v, v, v, p, p, p]
}
