//! What a rest shows: the gyros' errors themselves.

use super::{Bank, NAV};
use crate::fix::OBSERVATIONS;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{OUTPUTS, TRIADS};

/// Axes of the gyros.
pub(super) const AXES: usize = OUTPUTS / TRIADS;

/// What a rest shows of one gyro.
#[derive(Debug, Clone, Copy)]
pub struct AtRest<T = f32> {
    /// Its error by the mean rate, less the Earth's rotation by the navigator's attitude, rad/s.
    pub error: T,
    /// What the navigator's errors add to that: its attitude's.
    pub by: [T; NAV],
}

impl<T: Real> Bank<T> {
    /// A rest has shown the errors of the gyros, each with this variance. They score and teach as a
    /// fix does, and are refused as outliers as its components are.
    #[inline(never)]
    pub fn rest(&mut self, shown: &[AtRest<T>; AXES], variance: T) {
        for (k, shown) in shown.iter().enumerate() {
            if self.accepts_of_rest(k, shown, variance) {
                self.learn_of_rest(k, shown, variance);
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
    }

    fn accepts_of_rest(&mut self, k: usize, shown: &AtRest<T>, variance: T) -> bool {
        let cap = self.gates.squared_ratio;
        let &AtRest { error, ref by } = shown;
        let mut outlier = true;
        self.each(|h| {
            let innovation = h.innovation_of_output(k, by, error, variance);
            h.score(innovation, cap);
            outlier &= innovation.squared_ratio() > cap || !h.is_healthy();
        });
        let escape = self.gates.escape;
        let refused = self.refused.get_mut(OBSERVATIONS + k);
        refused.is_some_and(|of| of.accepts(error.is_finite(), outlier, true, escape))
    }

    fn learn_of_rest(&mut self, k: usize, shown: &AtRest<T>, variance: T) {
        let &AtRest { error, ref by } = shown;
        let followed = 1 << self.navigating();
        let mut gains = None;
        self.some(followed, |h| {
            gains = Some(h.update_output(k, by, error, variance));
        });
        if let Some(gains) = gains {
            self.considered.rest(k, by, &gains);
        }
        self.some(!followed, |h| {
            h.update_output(k, by, error, variance);
        });
    }
}
