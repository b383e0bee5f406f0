//! Whether anything shows the azimuth, and what happens when nothing does.

use super::begin::{anchor, begin, free};
use super::filter::{ERRORS, Filter, Match, unit};
use super::given::{Given, Matrix, given_biases, of_biases};
use crate::fix::Fix;
use crate::nav::Navigator;
use crate::nav::vector::narrow;
use lrnn_nostd::learn::kalman::Transition;

/// The velocity has changed by so many standard deviations when it shows a heading.
const SIGNAL: f32 = 12.0;
/// Fixes in motion after which an unobserved azimuth is searched for again.
const PATIENCE: u16 = 30;

impl Filter {
    /// An azimuth that nothing shows is searched for again after some time: until then the
    /// navigator's drift and noise have blurred what the filter believes about it. The tilt and the
    /// biases stay.
    ///
    /// True: search again, by [`Filter::free_azimuth`] and [`Filter::restart_azimuth`].
    pub(super) fn watch(&mut self, fix: &Fix) -> bool {
        let [n, e, _] = narrow(fix.velocity);
        let [low, high] = self.range;
        self.range = [
            [low[0].min(n), low[1].min(e)],
            [high[0].max(n), high[1].max(e)],
        ];
        if self.velocity != [0.0; 2] {
            self.moving = self.moving.saturating_add(1);
        }
        let found = self.has_signal(fix) && self.heading_sigma().is_finite();
        let patience = if self.has_signal(fix) { 4 } else { 1 } * PATIENCE;
        self.moving >= patience && !found
    }

    /// The errors of an azimuth that is free again, in `scratch`. False: the covariance is not
    /// positive.
    #[inline(never)]
    pub(super) fn free_azimuth(
        &mut self,
        seen: &Match<'_>,
        scratch: &mut Transition<ERRORS>,
    ) -> bool {
        let unit = unit(seen.config);
        let mut level: Matrix = [[0.0; ERRORS]; ERRORS];
        (level[0][0], level[1][1]) = (1.0, 1.0);
        let given = Given {
            by: &mut scratch.gamma,
            rest: &mut scratch.q,
            all: &mut scratch.phi,
        };
        let covariance = self.kalman.covariance();
        let joint = (
            covariance.errors(),
            covariance.cross(),
            &of_biases(&self.kalman),
        );
        given_biases(joint, &level, &unit, given)
    }

    /// The azimuth is free again, with the errors in `scratch`. False: the navigator does not take
    /// the velocity of the fix.
    #[inline(never)]
    pub(super) fn restart_azimuth(
        &mut self,
        navigator: &mut Navigator,
        seen: &Match<'_>,
        scratch: &Transition<ERRORS>,
    ) -> bool {
        let [n, e, _] = narrow(seen.fix.velocity);
        let mut rest = free();
        for (row, known) in rest.iter_mut().zip(scratch.q).take(2) {
            [row[0], row[1]] = [known[0], known[1]];
        }
        begin(&mut self.kalman, &scratch.gamma, &rest);
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
