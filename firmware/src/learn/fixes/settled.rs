//! Whether an estimate has settled: fixes have not moved it by more than its standard deviation for
//! some minutes.

use crate::learn::{SETTLED_AFTER_S, SETTLED_S};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Time that a fix counts for at most, s: where none come, nothing could move the estimate.
const FIX_S: f32 = 2.0;

/// An estimate that has settled before has done so again after this time, s: fixes have proved once
/// that it is not made by an error of theirs that lasts.
const AGAIN_S: f32 = 60.0;

/// See the module.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settled {
    /// Estimate when it moved last, and its standard deviations then.
    anchor: [f32; OUTPUTS],
    sigma: [f32; OUTPUTS],
    /// Time with fixes since then, s.
    since_s: f32,
    /// Time since the navigator's start and since the last fix, s.
    navigated_s: f32,
    fix_s: f32,
    /// Whether it has settled since the navigator's start.
    once: bool,
}

impl Settled {
    /// Time passes.
    pub fn passes(&mut self, time_s: f32) {
        self.navigated_s += time_s;
        self.fix_s += time_s;
    }

    /// The estimate after a fix, and its standard deviations.
    pub fn looks(&mut self, estimate: &[f32; OUTPUTS], sigma: &[f32; OUTPUTS]) {
        self.since_s += core::mem::take(&mut self.fix_s).min(FIX_S);
        let near = |((now, then), sigma): ((&f32, &f32), &f32)| (now - then).abs() <= *sigma;
        if !estimate.iter().zip(&self.anchor).zip(&self.sigma).all(near) {
            (self.anchor, self.sigma) = (*estimate, *sigma);
            self.moves();
        }
        self.once |= self.is_settled();
    }

    /// Notes that the estimate has moved.
    pub fn moves(&mut self) {
        self.since_s = 0.0;
    }

    pub fn is_settled(&self) -> bool {
        self.since_s >= SETTLED_S && self.navigated_s >= SETTLED_AFTER_S
    }

    /// It has settled, or has settled before and has stayed for a minute again: a law is learnt bit
    /// by bit as the temperature changes, and what is known later is better.
    pub fn is_settled_again(&self) -> bool {
        self.is_settled() || self.once && self.since_s >= AGAIN_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn second(settled: &mut Settled, estimate: f32) -> bool {
        settled.passes(1.0);
        settled.looks(&[estimate; OUTPUTS], &[1.0; OUTPUTS]);
        settled.is_settled()
    }

    #[test]
    fn an_estimate_settles_when_it_stays_and_not_before_five_minutes() {
        let mut settled = Settled::default();
        let first = (1..=600).find(|_| second(&mut settled, 5.0));
        assert_eq!(first, Some(300));
        assert!(second(&mut settled, 5.9));
        assert!(
            !second(&mut settled, 6.1),
            "it has moved by more than its sigma"
        );
        let again = (1..=600).find(|_| second(&mut settled, 6.1));
        assert_eq!(again, Some(180));
        assert!(!second(&mut settled, f32::NAN));
    }

    #[test]
    fn what_has_settled_once_settles_sooner() {
        let mut settled = Settled::default();
        let again = |settled: &mut Settled| {
            let all = (1..=600).map(|k| {
                second(settled, 5.0);
                (k, settled.is_settled_again())
            });
            all.filter(|(_, is)| *is).map(|(k, _)| k).next()
        };
        assert_eq!(again(&mut settled), Some(300));
        settled.moves();
        assert_eq!(again(&mut settled), Some(60));
    }

    #[test]
    fn time_without_fixes_settles_nothing() {
        let mut settled = Settled::default();
        for _ in 0..200 {
            settled.passes(10.0);
        }
        assert!(!second(&mut settled, 5.0) && !second(&mut settled, 5.0));
    }
}
