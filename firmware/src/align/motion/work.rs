//! What a fix leads to, in parts of some ten thousand instructions.

use super::begin::first;
use super::filter::{ERRORS, Filter, Match, View};
use super::level::Levelled;
use super::start::{self, Place, Shown, Start, Turned};
use super::transition::Step;
use super::{
    BAD_RESIDUAL, FAR_M, FARS, GOOD_RESIDUAL, InMotion, LEAST_FIXES, LINEAR, MAX_HEADING, MAX_NORM,
    MAX_TILT, NORM_FAILS, NORM_FLOOR, PASSES,
};
use crate::align::standstill::Sensors;
use crate::control::Way;
use crate::fix::{Fix, Heading};
use crate::nav::vector::{Q, V, product, rotated, scale};
use crate::nav::{self, Beginning, Innovation, Navigator};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// The part that is next.
#[derive(Debug, Clone)]
enum Part {
    /// The first fix: the navigator, and its levelling.
    Begin,
    Navigate(Beginning),
    BeginLevel,
    /// Whether the fix is near, and the navigator's way to it.
    Near,
    Pass,
    /// Levelling: what was gained, taken from this state; the level attitude, from which the
    /// navigator and then the filter begin.
    Gained(nav::State),
    Level(nav::State),
    Turn(nav::State, Levelled),
    Restart(Beginning, Q, Levelled),
    Filter(Q, Levelled),
    Errors(Q, Levelled),
    BeginErrors,
    /// How the vehicle has moved, and what the navigator shows.
    Look,
    Move(Innovation),
    See(Innovation, Step, V),
    Means(View),
    Propagate(View),
    Observe(View),
    /// With the mean of the normalised innovations squared.
    Finish(View, f32),
    Correct(View),
    /// The azimuth is looked for anew.
    Watch,
    Free,
    Anew,
    Judge,
    /// From where the navigator starts.
    Start,
    Place(Turned),
    Uncertain(Place),
    Found(nav::State),
}

/// A fix whose work is not done.
#[derive(Debug, Clone)]
pub struct Pending {
    fix: Fix,
    age: [f32; 2],
    still: bool,
    part: Part,
}

impl Pending {
    /// As [`InMotion::put`] takes it. `begins`: the first one. `still`: the vehicle stands, and
    /// does not turn.
    pub fn new(fix: &Fix, age: [f32; 2], still: bool, begins: bool) -> Pending {
        Pending {
            fix: *fix,
            age,
            still,
            part: if begins { Part::Begin } else { Part::Near },
        }
    }
}

/// A [`Start`] whose matrices are in the scratch memory: `by` in `gamma`, `rest` in `q`, `all` in
/// `phi`.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// State at the end of the last sample.
    pub state: nav::State,
    /// The alignment's estimate of the sensors' errors, rad/s and m/s2.
    pub applied: [f32; OUTPUTS],
    /// What the fixes have shown of them.
    pub shown: Shown,
    /// What gave the heading.
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

    /// The whole of it, with the scratch memory of [`InMotion::work`].
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

impl InMotion {
    /// A fix is not computed yet, or what it has led to is not taken: samples must wait.
    #[inline]
    pub fn is_pending(&self) -> bool {
        self.pending.is_some() || self.found.is_some()
    }

    /// The last fix has led to a start, which is not taken.
    pub fn has_found(&self) -> bool {
        self.found.is_some()
    }

    /// What the last fix has led to, once.
    pub fn take_found(&mut self) -> Option<Found> {
        self.found.take()
    }

    /// One part of the work. `scratch` is memory that nobody else writes from [`InMotion::put`]
    /// until the work is done. True: there is more. [`InMotion::take_found`] follows.
    pub fn work(&mut self, scratch: &mut Transition<ERRORS>) -> bool {
        if let Some(mut pending) = self.pending.take() {
            let takes = matches!(
                pending.part,
                Part::Begin | Part::Navigate(_) | Part::BeginLevel | Part::Near | Part::Pass
            );
            let next = if takes {
                self.take(&pending, scratch)
            } else {
                self.part(&pending, scratch)
            };
            if let Some(part) = next {
                pending.part = part;
                self.pending = Some(pending);
            } else if let (false, Some(navigator)) = (takes, &self.navigator) {
                self.last = (navigator.state().q_bn, pending.fix.velocity);
            }
        }
        self.pending.is_some()
    }

    /// One part; `None`: there is no other.
    #[inline(never)]
    fn part(&mut self, pending: &Pending, scratch: &mut Transition<ERRORS>) -> Option<Part> {
        let fix = &pending.fix;
        match pending.part {
            Part::Look if self.filter.is_none() => return self.gained(scratch.time),
            Part::Gained(_)
            | Part::Level(_)
            | Part::Turn(..)
            | Part::Restart(..)
            | Part::Filter(..)
            | Part::Errors(..)
            | Part::BeginErrors => return self.level(pending, scratch),
            Part::Judge => return self.judge(fix),
            _ => {}
        }
        let (Some(filter), Some(navigator)) = (&mut self.filter, &mut self.navigator) else {
            return None;
        };
        let given = self.given.filter(|_| filter.wants_heading());
        let seen = Match {
            config: &self.config,
            known: &self.known,
            fix,
            age: pending.age,
            still: pending.still,
            given: given.map(|given| {
                let drift = self.config.bias[0] * given.age;
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
            last: self.last,
        };
        match pending.part {
            Part::Look => Some(Part::Move(navigator.innovation(fix, pending.age[0]))),
            Part::Move(z) => {
                let (step, rotation) = filter.moves(navigator, scratch.time, &seen);
                Some(Part::See(z, step, rotation))
            }
            Part::See(z, step, rotation) => {
                let moved = (step, rotation);
                Some(Part::Means(filter.look(
                    navigator,
                    scratch.time,
                    z,
                    moved,
                    &seen,
                )))
            }
            Part::Means(view) => {
                filter.propagate_mean(navigator, scratch, &view, &seen);
                Some(Part::Propagate(view))
            }
            Part::Propagate(view) => {
                filter.propagate_covariance(scratch);
                Some(Part::Observe(view))
            }
            Part::Observe(view) => Some(Part::Finish(view, filter.observe(&view, &seen))),
            Part::Finish(view, nis) => {
                if filter.finish(&view, nis, fix) {
                    return Some(Part::Correct(view));
                }
                self.gap();
                None
            }
            Part::Correct(view) => {
                if !filter.correct(navigator, &view, &seen) {
                    self.gap();
                    return None;
                }
                Some(Part::Watch)
            }
            Part::Watch => Some(if filter.watch(fix) {
                Part::Free
            } else {
                Part::Judge
            }),
            Part::Free => {
                if filter.look_anew(&seen, scratch) {
                    return Some(Part::Anew);
                }
                self.gap();
                None
            }
            Part::Anew => {
                if filter.is_anew(navigator, &seen, scratch) {
                    return Some(Part::Judge);
                }
                self.gap();
                None
            }
            Part::Start => start::turned(filter, navigator, fix).map(Part::Place),
            Part::Place(of) => {
                let place = start::place(filter, navigator, &of, &seen);
                Some(Part::Uncertain(place))
            }
            Part::Uncertain(place) => {
                let finite = start::errors(filter, &place, &seen, scratch);
                finite.then_some(Part::Found(place.state))
            }
            Part::Found(state) => {
                self.found = start::found(filter, state, &seen, self.time);
                None
            }
            _ => None,
        }
    }

    /// A fix is taken; `None`: it is not used further.
    #[inline(never)]
    fn take(&mut self, pending: &Pending, scratch: &mut Transition<ERRORS>) -> Option<Part> {
        let fix = &pending.fix;
        if let Part::Begin = pending.part {
            let state = nav::State {
                position: fix.position,
                velocity: [0.0; 3],
                q_bn: [1.0, 0.0, 0.0, 0.0],
            };
            return Beginning::new(state).ok().map(Part::Navigate);
        }
        if let Part::Navigate(state) = &pending.part {
            self.navigator = Navigator::begin(&self.config.navigator, state).ok();
            return Some(Part::BeginLevel);
        }
        if let Part::BeginLevel = pending.part {
            self.begin_level(fix);
            return None;
        }
        let navigator = self.navigator.as_mut()?;
        if let Part::Near = pending.part {
            let [n, e, d] = navigator.innovation(fix, pending.age[0]).position;
            let near = libm::hypotf(n, e).max(d.abs()) < FAR_M;
            if fix.has(0..2) && !near {
                // one wild fix is left out; if they go on, the first one was wild
                self.far += 1;
                if self.far > FARS {
                    self.gap();
                }
                return None;
            }
            self.far = 0;
            return Some(Part::Pass);
        }
        *scratch = navigator.take_transition();
        if navigator.faults().lost {
            self.gap();
            return None;
        }
        self.time += f64::from(scratch.time);
        if let Some(given) = &mut self.given {
            given.age += scratch.time;
        }
        Some(Part::Look)
    }

    /// Levelling: adds what the navigator has gained in `time` seconds.
    #[inline(never)]
    fn gained(&mut self, time: f32) -> Option<Part> {
        let state = self.navigator.as_ref()?.state();
        self.level.add(&state, time);
        Some(Part::Gained(state))
    }

    /// The other parts of levelling.
    #[inline(never)]
    fn level(&mut self, pending: &Pending, scratch: &mut Transition<ERRORS>) -> Option<Part> {
        let fix = &pending.fix;
        let (level, navigator) = (&mut self.level, self.navigator.as_mut()?);
        match pending.part.clone() {
            Part::Gained(state) => {
                let [x, y, z] = state.velocity.map(|v| v as f32);
                navigator.feed_back(&[0.0, 0.0, 0.0, x, y, z, 0.0, 0.0, 0.0]);
                Some(Part::Level(state))
            }
            Part::Level(state) => {
                let sensors = Sensors {
                    noise: [
                        self.config.navigator.noise.gyro,
                        self.config.navigator.noise.accel,
                    ],
                    bias: self.config.bias,
                };
                if let Some(levelled) = level.solve(fix, &sensors) {
                    return Some(Part::Turn(state, levelled));
                }
                if level.is_useless(&sensors) {
                    self.begin_level(fix);
                }
                None
            }
            Part::Turn(state, levelled) => {
                let q_bn = product(levelled.turn, state.q_bn);
                let state = nav::State {
                    position: state.position,
                    velocity: fix.velocity,
                    q_bn,
                };
                let state = Beginning::new(state).ok()?;
                Some(Part::Restart(state, q_bn, levelled))
            }
            Part::Restart(state, q_bn, levelled) => {
                navigator.restart(&state);
                Some(Part::Filter(q_bn, levelled))
            }
            Part::Filter(q_bn, levelled) => {
                let [a, b, c, d, e, f] = self.known;
                navigator.set_estimate([a, b, c], [d, e, f]);
                if let Some(given) = &mut self.given {
                    given.forward = rotated(levelled.turn, given.forward);
                }
                let filter = self.filter.insert(Filter::ZEROED);
                filter.begin(&self.config, fix);
                Some(Part::Errors(q_bn, levelled))
            }
            Part::Errors(q_bn, levelled) => {
                (scratch.gamma, scratch.q) = first(&levelled, q_bn);
                Some(Part::BeginErrors)
            }
            Part::BeginErrors => {
                if let Some(filter) = &mut self.filter {
                    filter.begin_errors(scratch);
                }
                None
            }
            _ => None,
        }
    }

    /// Whether the attitude is known well enough, and whether the fixes contradict it.
    fn judge(&mut self, fix: &Fix) -> Option<Part> {
        let filter = self.filter.as_ref()?;
        let (tilt, phi_down) = filter.attitude_sigma();
        let linear = tilt < LINEAR && phi_down < LINEAR;
        if !linear {
            self.begin_level(fix);
            return None;
        }
        let fixes = filter.fixes();
        if fixes >= LEAST_FIXES && filter.residual() > BAD_RESIDUAL {
            self.refuse(fix);
            return None;
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
            return None;
        }
        if self.passes < PASSES {
            return None;
        }
        self.passes = 0;
        Some(Part::Start)
    }
}
