//! Observations of a gyro's error, which a rest shows, and of the velocity along the vehicle's
//! axes, which its wheels show. Both depend on several of the navigator's errors.

use super::hypothesis::Hypothesis;
use super::{Bank, Gates, NAV};
use crate::fix::OBSERVATIONS;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{Innovation, OUTPUTS, TRIADS};

/// Axes of the gyros, and of the vehicle.
pub(super) const AXES: usize = OUTPUTS / TRIADS;

/// An observation of several errors together.
#[derive(Debug, Clone, Copy)]
pub struct Row<T = f32> {
    /// Of a gyro at rest, its error by the mean rate, less the Earth's rotation by the navigator's
    /// attitude, rad/s. Of wheels, the navigator's velocity less theirs, m/s.
    pub z: T,
    /// What the navigator's errors add to that.
    pub by: [T; NAV],
    /// Variance of the observation itself.
    pub variance: T,
}

impl<T: Real> Row<T> {
    /// By a hypothesis. `output`: the sensor whose error this is; [`OUTPUTS`]: none.
    fn innovation(&self, output: usize, by: &mut dyn Hypothesis<T>) -> Innovation<T> {
        by.innovation_of_output(output, &self.by, self.z, self.variance)
    }
}

impl<T: Real> Bank<T> {
    /// A rest has shown the errors of the gyros. They score and teach as a fix does, and are
    /// refused as outliers as its components are. `counts`: whether a refusal counts towards
    /// [`Gates::escape`].
    #[inline(never)]
    pub fn rest(&mut self, shown: &[Row<T>; AXES], counts: bool) {
        let Gates {
            squared_ratio,
            escape,
            ..
        } = self.gates;
        for (k, row) in shown.iter().enumerate() {
            let mut outlier = true;
            self.each(|h| {
                let innovation = row.innovation(k, h);
                h.score(innovation, squared_ratio);
                outlier &= innovation.squared_ratio() > squared_ratio || !h.is_healthy();
            });
            let refused = self.refused.get_mut(OBSERVATIONS + k);
            if refused.is_some_and(|of| of.accepts(row.z.is_finite(), outlier, counts, escape)) {
                self.learn_row(k, row);
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
    }

    /// Wheels have shown the velocity forward, right and down. What is an outlier for the
    /// hypothesis that is followed neither scores nor teaches: wheels may slip for as long as they
    /// like, and a hypothesis that knows little would believe them.
    #[inline(never)]
    pub fn wheels(&mut self, shown: &[Row<T>; AXES]) {
        let cap = self.gates.squared_ratio;
        let followed = 1 << self.navigating();
        for row in shown {
            let mut accepts = false;
            self.some(followed, |h| {
                accepts = row.innovation(OUTPUTS, h).squared_ratio() <= cap && h.is_healthy();
            });
            if accepts {
                self.each(|h| {
                    let innovation = row.innovation(OUTPUTS, h);
                    h.score(innovation, cap);
                });
                self.learn_row(OUTPUTS, row);
            }
        }
        self.each(|h| h.finish_update());
        self.choose();
    }

    fn learn_row(&mut self, output: usize, row: &Row<T>) {
        let &Row {
            z,
            ref by,
            variance,
        } = row;
        let followed = 1 << self.navigating();
        let mut gains = None;
        self.some(followed, |h| {
            gains = Some(h.update_output(output, by, z, variance));
        });
        if let Some(gains) = gains {
            self.considered.row(output, by, &gains);
        }
        self.some(!followed, |h| {
            h.update_output(output, by, z, variance);
        });
    }
}
