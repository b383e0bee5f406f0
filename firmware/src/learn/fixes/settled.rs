//! Whether an estimate has settled: it has not moved by more than its standard deviation for some
//! minutes.

use crate::learn::{SETTLED_AFTER_S, SETTLED_S};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// See the module.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settled {
    /// Where it was when it moved last.
    anchor: [f32; OUTPUTS],
    /// Time since then, and since the navigator's start, s.
    since_s: f32,
    navigated_s: f32,
}

impl Settled {
    /// Time passes.
    pub fn passes(&mut self, time_s: f32) {
        self.since_s += time_s;
        self.navigated_s += time_s;
    }

    /// The estimate after a fix, and its standard deviations.
    pub fn looks(&mut self, estimate: &[f32; OUTPUTS], sigma: &[f32; OUTPUTS]) {
        let near = |((now, then), sigma): ((&f32, &f32), &f32)| (now - then).abs() <= *sigma;
        if !estimate.iter().zip(&self.anchor).zip(sigma).all(near) {
            self.anchor = *estimate;
            self.moves();
        }
    }

    /// It has moved.
    pub fn moves(&mut self) {
        self.since_s = 0.0;
    }

    pub fn is_settled(&self) -> bool {
        self.since_s >= SETTLED_S && self.navigated_s >= SETTLED_AFTER_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_settles_when_it_stays_and_not_before_five_minutes() {
        let mut settled = Settled::default();
        let sigma = [1.0; OUTPUTS];
        let mut second = |estimate: f32| {
            settled.passes(1.0);
            settled.looks(&[estimate; OUTPUTS], &sigma);
            settled.is_settled()
        };
        let first = (1..=600).find(|_| second(5.0));
        assert_eq!(first, Some(300));
        assert!(second(5.9));
        assert!(!second(6.1), "it has moved by more than its sigma");
        let again = (1..=600).find(|_| second(6.1));
        assert_eq!(again, Some(180));
        assert!(!second(f32::NAN));
    }
}
