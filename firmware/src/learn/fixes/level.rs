//! What level force shows of the heading.
//!
//! An error of the heading shows by the level force alone. On a straight road that force is noise
//! and the errors of the tilt, and taken for a true one it would seem to show the heading more and
//! more. So it counts in the errors' dynamics as far as it exceeds what may be wrong with it
//! (shrinkage by James and Stein, 1961), and the rest as noise.

use super::FixLearner;
use crate::nav::Transition;

/// Index of the heading's error in the navigator's errors; gravity, m/s2, for the doubt of level
/// force.
const DOWN: usize = 2;
const GRAVITY: f32 = 9.8;
/// Level force counts from so much of the variance of its errors on (assumed).
const SURE: f32 = 6.0;
/// A heading that is known less well than this is given up when the vehicle turns or brakes, rad:
/// the errors' dynamics are linear, and an alignment in motion then finds the heading (assumed).
const MAX_HEADING: f32 = 0.4;

impl FixLearner<'_> {
    /// Shrinks the effect of level force on the heading's errors in an interval.
    pub(super) fn shrink_level_force(&mut self, block: &mut Transition) {
        let bank = &self.memory.bank;
        let [north, east] = [0, 1].map(|i| GRAVITY * bank.error_sigma(i) * block.time);
        let white = self.settings.noise.accel;
        let doubt = SURE * (north * north + east * east + 2.0 * white * white * block.time);
        let [by_north, by_east] = [block.phi[3][DOWN], block.phi[4][DOWN]];
        let force = by_north * by_north + by_east * by_east;
        let believed = if force > doubt {
            1.0 - doubt / force
        } else {
            0.0
        };
        let heading = bank.error_sigma(DOWN).min(1.0);
        self.navigation.astray = heading > MAX_HEADING && believed > 0.5;
        for (i, by) in [(3, by_north), (4, by_east)] {
            let left = (1.0 - believed) * by * heading;
            block.q[i][i] += left * left;
            block.phi[i][DOWN] *= believed;
            block.phi[i + 3][DOWN] *= believed;
        }
    }
}
