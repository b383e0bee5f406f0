//! Processing of a fix.

use super::begin::first;
use super::filter::{ERRORS, Filter, Match};
use super::level::Levelled;
use super::start::{self, Shown, Start};
use super::{
    BAD_RESIDUAL, Config, FAR_M, FARS, GOOD_RESIDUAL, Given, LEAST_FIXES, LINEAR, MAX_HEADING,
    MAX_NORM, MAX_TILT, Matching, NORM_FAILS, NORM_FLOOR, PASSES, measured,
};
use crate::align::standstill::Sensors;
use crate::control::Way;
use crate::fix::{Fix, Heading};
use crate::nav::vector::{Q, V, product, rotated, scale};
use crate::nav::{self, Beginning, Navigator};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// A [`Start`] whose matrices are in the scratch memory: `by` in `gamma`, `rest` in `q`, `all` in
/// `phi`.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// State at the end of the last sample.
    pub state: nav::State,
    /// The alignment's estimate of the sensors' errors, rad/s and m/s2.
    pub applied: [f32; OUTPUTS],
    /// Observations of them by the fixes.
    pub shown: Shown,
    /// Source of the heading.
    pub way: Way,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes.
    pub residual: f32,
    /// How long the alignment took, s.
    pub time_s: f64,
}

impl Found {
    /// Standard deviations of the errors, that of the sensors included.
    #[must_use]
    pub fn sigmas(scratch: &Transition<ERRORS>) -> [f32; ERRORS] {
        core::array::from_fn(|i| libm::sqrtf(scratch.phi[i][i].max(0.0)))
    }

    /// The whole of it, with the scratch memory of [`InMotion::fix`](super::InMotion::fix).
    pub fn start(&self, scratch: &Transition<ERRORS>) -> Start {
        Start {
            state: self.state,
            by: scratch.gamma,
            rest: scratch.q,
            applied: self.applied,
            shown: self.shown,
            all: scratch.phi,
            way: self.way,
            heading_sigma: self.heading_sigma,
            residual: self.residual,
            time_s: self.time_s,
        }
    }
}

/// A fix that is taken.
#[derive(Debug, Clone, Copy)]
struct Taken {
    fix: Fix,
    /// Before the last sample: seconds and their standard deviation.
    age: [f32; 2],
    /// The vehicle stands, and does not turn.
    still: bool,
}

impl Matching {
    /// Takes a fix that was valid `age` before the last sample: seconds and their standard
    /// deviation. `still`: the vehicle stands, and the fix says so. A fix without a horizontal
    /// velocity is not used, nor is one without a position before the first with one.
    ///
    /// Gives the attitude when it is known well enough; its matrices are in `scratch` then.
    pub fn fix(
        &mut self,
        fix: &Fix,
        age: [f32; 2],
        still: bool,
        scratch: &mut Transition<ERRORS>,
    ) -> Option<Found> {
        if !fix.has(3..5) {
            return None;
        }
        let fix = measured(fix);
        if self.navigator.is_none() {
            if fix.has(0..2) {
                self.begin(&fix);
            }
            return None;
        }
        if !(self.is_near(&fix, age[0]) && self.take_interval(scratch)) {
            return None;
        }
        let still = still && self.config.stands;
        let found = self.follow(&Taken { fix, age, still }, scratch);
        if let Some(navigator) = &self.navigator {
            self.last = (navigator.state().q_bn, fix.velocity);
        }
        found
    }

    /// The first fix: the navigator, and its levelling.
    fn begin(&mut self, fix: &Fix) {
        let state = nav::State {
            position: fix.position,
            velocity: [0.0; 3],
            q_bn: [1.0, 0.0, 0.0, 0.0],
        };
        self.navigator = Navigator::new(self.config.navigator, state).ok();
        self.begin_level(fix);
    }

    /// Whether the fix is near. One wild fix is left out; if they go on, the first one was wild.
    fn is_near(&mut self, fix: &Fix, age: f32) -> bool {
        let Some(navigator) = &self.navigator else {
            return false;
        };
        let [n, e, d] = navigator.innovation(fix, age).position;
        let near = libm::hypotf(n, e).max(d.abs()) < FAR_M;
        if fix.has(0..2) && !near {
            self.far += 1;
            if self.far > FARS {
                self.gap();
            }
            return false;
        }
        self.far = 0;
        true
    }

    /// Changes of the navigator's errors since the last fix. False: it is lost.
    #[inline(never)]
    fn take_interval(&mut self, scratch: &mut Transition<ERRORS>) -> bool {
        let Some(navigator) = &mut self.navigator else {
            return false;
        };
        *scratch = navigator.take_transition();
        if navigator.faults().lost {
            self.gap();
            return false;
        }
        self.time += f64::from(scratch.time);
        if let Some(given) = &mut self.given {
            given.age += scratch.time;
        }
        true
    }

    fn follow(&mut self, taken: &Taken, scratch: &mut Transition<ERRORS>) -> Option<Found> {
        if self.filter.is_none() {
            self.level(&taken.fix, scratch);
            return None;
        }
        self.matches(taken, scratch)?;
        if !self.judge(&taken.fix) {
            return None;
        }
        self.hand_over(taken, scratch)
    }

    /// Levelling: what was gained, and the level attitude, from which navigator and filter begin.
    #[inline(never)]
    fn level(&mut self, fix: &Fix, scratch: &mut Transition<ERRORS>) {
        let Some(navigator) = &mut self.navigator else {
            return;
        };
        let state = navigator.state();
        self.level.add(&state, scratch.time);
        let [x, y, z] = state.velocity.map(|v| v as f32);
        navigator.feed_back(&[0.0, 0.0, 0.0, x, y, z, 0.0, 0.0, 0.0]);
        let noise = &self.config.navigator.noise;
        let sensors = Sensors {
            noise: [noise.gyro, noise.accel],
            bias: self.config.bias,
        };
        match self.level.solve(fix, &sensors) {
            Some(levelled) => _ = self.begin_filter(fix, &state, &levelled, scratch),
            None if self.level.is_useless(&sensors) => self.begin_level(fix),
            None => {}
        }
    }

    /// Navigator and filter begin from a level attitude.
    #[inline(never)]
    fn begin_filter(
        &mut self,
        fix: &Fix,
        state: &nav::State,
        levelled: &Levelled,
        scratch: &mut Transition<ERRORS>,
    ) -> Option<()> {
        let navigator = self.navigator.as_mut()?;
        let q_bn = product(levelled.turn, state.q_bn);
        let state = nav::State {
            position: state.position,
            velocity: fix.velocity,
            q_bn,
        };
        navigator.restart(&Beginning::new(state).ok()?);
        let [a, b, c, d, e, f] = self.known;
        navigator.set_estimate([a, b, c], [d, e, f]);
        if let Some(given) = &mut self.given {
            given.forward = rotated(levelled.turn, given.forward);
        }
        let filter = self.filter.insert(Filter::ZEROED);
        filter.begin(&self.config, fix);
        (scratch.gamma, scratch.q) = first(levelled, q_bn);
        filter.begin_errors(scratch);
        Some(())
    }

    /// Matching: how the vehicle has moved, what the navigator shows, and what follows for both.
    /// `None`: the alignment restarts.
    #[inline(never)]
    fn matches(&mut self, taken: &Taken, scratch: &mut Transition<ERRORS>) -> Option<()> {
        let (config, known, given, last) = (&self.config, &self.known, self.given, self.last);
        let (filter, navigator) = (self.filter.as_mut()?, self.navigator.as_mut()?);
        let seen = |filter: &Filter| seen(config, known, (given, last), taken, filter);
        let z = navigator.innovation(&taken.fix, taken.age[0]);
        let moved = filter.moves(navigator, scratch.time, &seen(filter));
        let view = filter.look(navigator, scratch.time, z, moved, &seen(filter));
        filter.propagate_mean(navigator, scratch, &view, &seen(filter));
        filter.propagate_covariance(scratch);
        let nis = filter.observe(&view, &seen(filter));
        let goes_on = filter.finish(&view, nis, &taken.fix)
            && filter.correct(navigator, &view, &seen(filter))
            // the azimuth may be searched for again
            && (!filter.watch(&taken.fix)
                || filter.free_azimuth(&seen(filter), scratch)
                    && filter.restart_azimuth(navigator, &seen(filter), scratch));
        if !goes_on {
            self.gap();
            return None;
        }
        Some(())
    }

    /// Hands over the state from which the navigator starts.
    #[inline(never)]
    fn hand_over(&mut self, taken: &Taken, scratch: &mut Transition<ERRORS>) -> Option<Found> {
        let (config, known, given, last) = (&self.config, &self.known, self.given, self.last);
        let (filter, navigator) = (self.filter.as_mut()?, self.navigator.as_mut()?);
        let seen = |filter: &Filter| seen(config, known, (given, last), taken, filter);
        let turned = start::turned(filter, navigator, &taken.fix)?;
        let place = start::place(filter, navigator, &turned, &seen(filter));
        let finite = start::errors(filter, &place, &seen(filter), scratch);
        if !finite {
            return None;
        }
        start::found(filter, place.state, &seen(filter), self.time)
    }

    /// Whether the attitude is known well enough, and whether the fixes contradict it.
    fn judge(&mut self, fix: &Fix) -> bool {
        let Some(filter) = &self.filter else {
            return false;
        };
        let (tilt, phi_down) = filter.attitude_sigma();
        let linear = tilt < LINEAR && phi_down < LINEAR;
        if !linear {
            self.begin_level(fix);
            return false;
        }
        let fixes = filter.fixes();
        if fixes >= LEAST_FIXES && filter.residual() > BAD_RESIDUAL {
            self.refuse(fix);
            return false;
        }
        let (norm, norm_sigma) = filter.norm();
        let good = fixes >= LEAST_FIXES
            && filter.heading_sigma() <= MAX_HEADING
            && tilt <= MAX_TILT
            && norm_sigma <= MAX_NORM
            && filter.has_signal(fix)
            && !filter.is_doubted()
            && filter.residual() <= GOOD_RESIDUAL;
        let is_one = (norm - 1.0).abs() <= 3.0 * libm::hypotf(norm_sigma, NORM_FLOOR);
        self.passes = if good && is_one { self.passes + 1 } else { 0 };
        self.norm_fails = if good && !is_one {
            self.norm_fails + 1
        } else {
            0
        };
        if self.norm_fails >= NORM_FAILS {
            self.refuse(fix);
            return false;
        }
        if self.passes < PASSES {
            return false;
        }
        self.passes = 0;
        true
    }
}

/// Data with which a fix is matched. A heading that was given counts while the filter wants one.
fn seen<'a>(
    config: &'a Config,
    known: &'a [f32; OUTPUTS],
    (given, last): (Option<Given>, (Q, V)),
    taken: &'a Taken,
    filter: &Filter,
) -> Match<'a> {
    let given = given.filter(|_| filter.wants_heading());
    Match {
        config,
        known,
        fix: &taken.fix,
        age: taken.age,
        still: taken.still,
        given: given.map(|given| {
            let drift = config.bias[0] * given.age;
            let [x, y, _] = scale(given.forward, 1.0);
            let sigma = libm::hypotf(given.heading.sigma, drift);
            (
                [x as f32, y as f32],
                Heading {
                    sigma,
                    ..given.heading
                },
            )
        }),
        last,
    }
}
