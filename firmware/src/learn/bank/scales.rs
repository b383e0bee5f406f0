//! Scale errors that are a clock's.

use super::{Bank, MAP};
use lrnn_nostd::Real;

/// Largest scale error that all three gyros may have in common.
const OF_CLOCK: f64 = 0.005;
/// Scale errors are the same if each is within this share of their mean (assumed): of independent
/// errors of 1 % 1 set in 70 is, of 3 % 1 in 57.
const ALIKE: f64 = 0.25;

impl<T: Real> Bank<T> {
    /// Whether the gyros' three axes have the same scale error by [`MAP`], more than half a per
    /// cent, and the fixes confirm the map. Sensors are not that alike, but a wrong time base makes
    /// them so: of a step taken for 2.43 ms instead of 2.5 a map of -8 % was learnt.
    #[must_use]
    pub fn has_equal_scales(&self) -> bool {
        let [[[x, ..], [_, y, _], [.., z]], _] = self.maps_of(MAP);
        let scales = [x, y, z].map(T::to_f64);
        let mean = scales.iter().sum::<f64>() / 3.0;
        let equal = |scale: &f64| (scale - mean).abs() <= ALIKE * mean.abs();
        mean.abs() > OF_CLOCK
            && scales.iter().all(equal)
            && self.score(MAP) > self.score(self.biases()) + self.gates.evidence
    }

    /// The map takes part no longer.
    pub fn give_up_map(&mut self) {
        self.gates.enabled &= !(1 << MAP);
    }
}
