//! Whether anything shows the azimuth, and what happens when nothing does.

use super::begin::{anchor, begin, free};
use super::filter::{ERRORS, Filter, Match, unit};
use super::given::{Given, Matrix, given_biases};
use crate::fix::Fix;
use crate::nav::Navigator;
use crate::nav::vector::narrow;

/// The velocity has changed by so many standard deviations when it shows a heading.
const SIGNAL: f32 = 12.0;
/// Fixes in motion after which an azimuth that is not seen is looked for anew.
const PATIENCE: u16 = 30;

impl Filter {
    /// An azimuth that nothing shows is looked for anew after some time: until then the navigator's
    /// drift and noise have blurred what the filter believes about it. The tilt and the biases
    /// stay.
    pub(super) fn watch(&mut self, navigator: &mut Navigator, seen: &Match<'_>) -> bool {
        let [n, e, _] = narrow(seen.fix.velocity);
        let [low, high] = self.range;
        self.range = [
            [low[0].min(n), low[1].min(e)],
            [high[0].max(n), high[1].max(e)],
        ];
        if self.velocity != [0.0; 2] {
            self.moving = self.moving.saturating_add(1);
        }
        let found = self.has_signal(seen.fix) && self.heading_sigma().is_finite();
        let patience = if self.has_signal(seen.fix) { 4 } else { 1 } * PATIENCE;
        if self.moving < patience || found {
            return true;
        }
        self.look_anew(navigator, seen)
    }

    /// The azimuth is free again.
    #[inline(never)]
    fn look_anew(&mut self, navigator: &mut Navigator, seen: &Match<'_>) -> bool {
        let [n, e, _] = narrow(seen.fix.velocity);
        let unit = unit(seen.config);
        let mut level: Matrix = [[0.0; ERRORS]; ERRORS];
        (level[0][0], level[1][1]) = (1.0, 1.0);
        let mut given = Given::ZEROED;
        if !given_biases(&self.kalman, &level, &unit, &mut given) {
            return false;
        }
        let mut rest = free();
        for (row, known) in rest.iter_mut().zip(given.rest).take(2) {
            [row[0], row[1]] = [known[0], known[1]];
        }
        begin(&mut self.kalman, &given.by, &rest);
        self.velocity = anchor(seen.fix);
        self.range = [[n, e]; 2];
        self.moving = 0;
        (self.course, self.heading) = (false, false);
        let [x, y, _] = narrow(navigator.state().velocity);
        navigator.feed_back(&[0.0, 0.0, 0.0, x - n, y - e, 0.0, 0.0, 0.0, 0.0])
    }

    /// The vehicle's velocity has changed by far more than the receiver's noise, or a heading was
    /// given.
    pub fn has_signal(&self, fix: &Fix) -> bool {
        let [[n0, e0], [n1, e1]] = self.range;
        let [.., n, e, _] = fix.sigmas;
        self.heading || libm::hypotf(n1 - n0, e1 - e0) > SIGNAL * n.max(e)
    }
}
