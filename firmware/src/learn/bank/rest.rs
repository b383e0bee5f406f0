//! What a rest shows: the gyros' errors themselves.

use super::{Bank, Refusals};
use crate::fix::OBSERVATIONS;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{OUTPUTS, TRIADS};

/// Axes of the gyros.
pub(super) const AXES: usize = OUTPUTS / TRIADS;

impl<T: Real> Bank<T> {
    /// A rest has shown the errors of the gyros, rad/s, each with this variance. They score and
    /// teach as a fix does, and are refused as outliers as its observations are.
    #[inline(never)]
    pub fn rest(&mut self, z: &[T; AXES], variance: T) {
        for (k, &z) in z.iter().enumerate() {
            if self.accepts_of_rest(k, z, variance) {
                self.learn_of_rest(k, z, variance);
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
    }

    fn accepts_of_rest(&mut self, k: usize, z: T, variance: T) -> bool {
        let cap = self.gates.squared_ratio;
        let mut outlier = true;
        self.each(|h| {
            let innovation = h.innovation_of_output(k, z, variance);
            h.score(innovation, cap);
            outlier &= innovation.squared_ratio() > cap || !h.is_healthy();
        });
        let escape = self.gates.escape;
        let refused = self.refused.get_mut(OBSERVATIONS + k);
        refused.is_some_and(|of: &mut Refusals| of.accepts(z.is_finite(), outlier, true, escape))
    }

    fn learn_of_rest(&mut self, k: usize, z: T, variance: T) {
        let followed = 1 << self.navigating();
        let mut gains = None;
        self.some(followed, |h| {
            let innovation = h.innovation_of_output(k, z, variance);
            gains = Some(h.update_output(k, innovation));
        });
        if let Some(gains) = gains {
            self.considered.rest(k, &gains);
        }
        self.some(!followed, |h| {
            let innovation = h.innovation_of_output(k, z, variance);
            h.update_output(k, innovation);
        });
    }
}
