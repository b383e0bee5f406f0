//! The filter of the matching: linear in cosine and sine of the azimuth.
//!
//! It is the bank's filter of six biases with another meaning of the nine errors, so that it takes
//! no room in flash. The navigator assumes that its frame `w` points north, `c = 1` and `s = 0`.
//! Errors are estimate minus truth, as everywhere:
//!
//! ```text
//! 0..3  phi     attitude error in w; about down it is 0 at the beginning, because w is defined so
//! 3..6  u       dv - H (1 - c, -s): error of the velocity as the receiver shows it
//! 6, 7          1 - c and -s
//! 8             a combination of the others, recomputed for each fix, to be observed
//! ```
//!
//! With the receiver's velocity `V` and `H = [Vn Ve; Ve -Vn]` the true velocity in `w` is
//! `V - H (1 - c, -s)`. So the navigator's velocity minus the receiver's is an observation of `u`,
//! whatever the azimuth. `H` changes from fix to fix; the transition has the difference.
//!
//! `V` has noise, and so has `H`: it would be taken for a motion that the navigator does not see,
//! which means `c = s = 0`. That is taken back after each fix ([`Filter::forget`]), and a velocity
//! that may be zero does not enter `H` at all ([`anchor`]).
//!
//! The Earth's rotation points where the frame is thought to point. Its error `W cos(latitude)
//! (1 - c, -(-s))` turns the attitude, and adds a Coriolis acceleration to the vertical. The
//! frame's own rotation about down, which follows from the east velocity, is wrong too: the azimuth
//! changes by it ([`Step::turn`]).

use super::Config;
use super::begin::{anchor, begin};
use super::observe::{self, Row};
use super::transition::{Step, transition};
use crate::fix::{Fix, Heading};
use crate::nav::earth::{Local, OMEGA_IE};
use crate::nav::vector::{Q, V, add, dot, narrow, rotated, scale};
use crate::nav::{self, Innovation, Navigator};
use lrnn_nostd::learn::kalman::{
    Biases, Correction, Kalman, OUTPUTS, Prior, Transition, Workspace,
};
use lrnn_nostd::{Net, Normalisation, Weights};

/// Number of errors.
pub const ERRORS: usize = 9;
/// Index of `1 - c`, of `-s`, and of the combination.
pub const COSINE: usize = 6;
pub const SINE: usize = 7;
pub const COMBINED: usize = 8;

/// The bank's filter of six biases.
pub type Biased = Kalman<Biases, ERRORS, OUTPUTS, 21>;

/// The vertical velocity is used when the tilt is known better than this, rad: it loses a share of
/// gravity by the square of the tilt.
const VERTICAL_TILT: f32 = 0.03;
/// The tilt times the accelerometers' bias is left out of the linear equations. It would be taken
/// for knowledge of the biases, which is prevented by a noise of the vertical velocity that it
/// causes in this time, s.
const VERTICAL_S: f32 = 60.0;
/// Errors of the times of the fixes, s: an acceleration makes a velocity of it (assumed).
const TIMING_S: f32 = 0.03;
/// An observation farther from its prediction than this, in squared standard deviations, is not
/// believed.
const GATE: f32 = 25.0;
/// A change of velocity stands out of the noise by so many standard deviations.
pub const STANDS_OUT: f32 = 5.0;
/// Fixes over which the innovations are averaged.
const MEMORY: u16 = 20;
/// Floors of the errors: attitude, velocity, cosine and sine.
const FLOOR: [f32; 3] = [1e-6, 1e-4, 1e-4];

/// A fix, and what is known beside it.
#[derive(Debug, Clone, Copy)]
pub struct Match<'a> {
    pub config: &'a Config,
    /// Errors of the sensors known before.
    pub known: &'a [f32; OUTPUTS],
    pub fix: &'a Fix,
    /// Age of the fix and its standard deviation, s.
    pub age: [f32; 2],
    /// The vehicle stands, and does not turn.
    pub still: bool,
    /// Direction of the forward axis in `w`, horizontally, and the heading given for it.
    pub given: Option<([f32; 2], Heading)>,
    /// Attitude and receiver's velocity at the last fix.
    pub last: (Q, V),
}

/// The navigator's state at a fix, passed from one part of the work to the next.
#[derive(Debug, Clone, Copy)]
pub struct View {
    step: Step,
    z: nav::Innovation,
    row: Option<Row>,
    sight: observe::Sight,
    /// Variance of `u` at the last fix.
    before: f32,
    /// Time since then, s.
    time: f32,
}

/// The filter.
#[derive(Debug, Clone)]
pub struct Filter {
    pub(super) kalman: Biased,
    /// The horizontal velocity of `H`.
    pub(super) velocity: [f32; 2],
    pub(super) fixes: u16,
    /// Seconds of standstill in a row at the last fix.
    pub(super) still: bool,
    pub(super) residual: f32,
    /// An observation of the last fix was too far from its prediction.
    pub(super) doubted: bool,
    pub(super) course: bool,
    pub(super) heading: bool,
    /// Least and greatest velocity of the receiver, and fixes in motion, since the azimuth is
    /// looked for.
    pub(super) range: [[f32; 2]; 2],
    pub(super) moving: u16,
}

impl Filter {
    /// All zeros. Call [`Filter::begin`] before use.
    pub const ZEROED: Filter = Filter {
        kalman: Biased::ZEROED,
        velocity: [0.0; 2],
        fixes: 0,
        still: false,
        residual: 0.0,
        doubted: false,
        course: false,
        heading: false,
        range: [[0.0; 2]; 2],
        moving: 0,
    };

    /// Begins with the velocity of the fix. In place: it is too large to be moved over the stack.
    /// [`Filter::begin_errors`] must follow.
    #[inline(never)]
    pub fn begin(&mut self, config: &Config, fix: &Fix) {
        let [gyro, accel] = config.bias;
        let [gyro_walk, accel_walk] = config.walk;
        let triads = |g: f32, a: f32| [g, g, g, a, a, a];
        let [a, v, c] = FLOOR;
        let prior = Prior {
            error_sigma: [1.0; ERRORS],
            parameter_sigma: triads(gyro, accel),
            walk: triads(gyro_walk, accel_walk),
            error_floor: [a, a, a, v, v, v, c, c, c],
            parameter_floor: 1e-3,
        };
        let net = Net::new(Weights::zero(), Normalisation::identity());
        self.kalman.init(&[net; 2], &prior);
        let [n, e, _] = narrow(fix.velocity);
        self.velocity = anchor(fix);
        self.residual = 1.0;
        self.range = [[n, e]; 2];
    }

    /// The errors of [`super::begin::first`], in `gamma` and `q`.
    #[inline(never)]
    pub fn begin_errors(&mut self, errors: &Transition<ERRORS>) {
        begin(&mut self.kalman, &errors.gamma, &errors.q);
    }

    /// The first part of a fix: how the vehicle has moved in `time` seconds since the last one, and
    /// its rotation. [`Filter::look`], [`Filter::propagate_mean`],
    /// [`Filter::propagate_covariance`], [`Filter::observe`], [`Filter::finish`] and
    /// [`Filter::correct`] must follow.
    #[inline(never)]
    pub fn moves(&self, navigator: &Navigator, time: f32, seen: &Match<'_>) -> (Step, V) {
        let state = navigator.state();
        let rotation = observe::rotation(seen.last.0, state.q_bn);
        (self.step(&state, time, rotation, seen), rotation)
    }

    /// The navigator's state, `time` seconds after the last fix; `z` is its innovation.
    #[inline(never)]
    pub fn look(
        &mut self,
        navigator: &Navigator,
        time: f32,
        z: Innovation,
        (step, rotation): (Step, V),
        seen: &Match<'_>,
    ) -> View {
        let state = navigator.state();
        let sight = observe::Sight {
            forward: rotated(state.q_bn, seen.config.forward.map(f64::from)),
            azimuth: self.azimuth(),
            rate: libm::sqrtf(dot(narrow(rotation), narrow(rotation))) / time,
            phi_down: self.kalman.covariance().variance(2),
        };
        let still = seen.still && self.still;
        self.still = seen.still;
        let row = if still {
            Some(observe::no_turn(rotation))
        } else {
            observe::course(seen, &sight)
        };
        View {
            step,
            z,
            row,
            sight,
            before: self.kalman.covariance().variance(3),
            time,
        }
    }

    /// The means over the time since the last fix. `passed` is that of the navigator's errors, and
    /// is then that of this filter's.
    #[inline(never)]
    pub fn propagate_mean(
        &mut self,
        navigator: &Navigator,
        passed: &mut Transition<ERRORS>,
        view: &View,
        seen: &Match<'_>,
    ) {
        let (block, shift) = transition(passed, &view.step, view.row.as_ref());
        let [[a, b, c], [d, e, f]] = navigator.estimate();
        let mut applied = [a, b, c, d, e, f];
        for (applied, known) in applied.iter_mut().zip(seen.known) {
            *applied -= known;
        }
        let applied = Correction {
            estimate: applied,
            ..Correction::NONE
        };
        self.kalman.propagate_mean(&block, &applied);
        self.kalman.feedback(&shift);
        *passed = block;
        self.velocity = view.step.after;
    }

    /// The covariance over the time since the last fix.
    pub fn propagate_covariance(&mut self, block: &Transition<ERRORS>) {
        let mut workspace = Workspace::ZEROED;
        (self.kalman).propagate_covariance(block, &mut workspace);
    }

    /// The end of a fix, with the mean of its normalised innovations squared. False: a number is
    /// not finite.
    #[inline(never)]
    pub fn finish(&mut self, view: &View, nis: f32, fix: &Fix) -> bool {
        self.forget(&view.step, fix, view.before);
        self.kalman.finish_update();
        if !self.kalman.is_healthy() {
            return false;
        }
        self.fixes = self.fixes.saturating_add(1);
        if self.fixes > 1 {
            let n = (self.fixes - 1).min(MEMORY);
            self.residual += (nis - self.residual) / f32::from(n);
        }
        true
    }

    fn step(&self, state: &nav::State, time: f32, rotation: V, seen: &Match<'_>) -> Step {
        let here = Local::at(state.position.latitude, state.position.height);
        let [n, e, _] = narrow(seen.fix.velocity);
        let [x, y, _] = narrow(state.velocity);
        let after = anchor(seen.fix);
        let bent = time * (here.sin / (here.cos * here.n_h)) as f32;
        let rotation = narrow(rotation);
        let turned = libm::sqrtf(dot(rotation, rotation));
        let change = narrow(add(seen.fix.velocity, scale(seen.last.1, -1.0)));
        let changed = libm::sqrtf(dot(change, change));
        let [gyro, accel] = seen.config.scale;
        Step {
            before: self.velocity,
            after,
            beside: [n - after[0], e - after[1]],
            change: changed,
            turn: bent * (0.5 * (e + seen.last.1[1] as f32) - y),
            earth: (OMEGA_IE * here.cos) as f32,
            bent,
            velocity: [x, y],
            scale: [gyro * turned, accel * changed].map(|x| x * x),
        }
    }

    /// All observations of a fix; the mean of their normalised innovations squared.
    #[inline(never)]
    pub fn observe(&mut self, view: &View, seen: &Match<'_>) -> f32 {
        let View {
            step, sight, time, ..
        } = view;
        let z = &view.z.velocity;
        self.doubted = false;
        let [.., n, e, d] = seen.fix.sigmas;
        let late = libm::hypotf(TIMING_S, seen.age[1]);
        // what age and lever arm may be wrong makes a velocity of the motion
        let swing = seen.config.lever_arm_sigma * sight.rate;
        let timing = libm::hypotf(late * step.change / time, swing);
        let square = |x: f32| x * x;
        // the part beside H is turned by the estimate of the azimuth
        let [x, y] = step.beside;
        let [c, s] = self.azimuth();
        let turned = [c * x + s * y, c * y - s * x];
        let of = |i| self.kalman.covariance().variance(i);
        let unknown = (x * x + y * y) * of(COSINE).max(of(SINE));
        let level = square(n.max(e)) + square(timing) + unknown;
        let (mut sum, mut count) = (0.0, 0.0);
        let mut take = |ratio: f32| {
            sum += ratio;
            count += 1.0;
        };
        take(self.update(3, z[0] + x - turned[0], level));
        take(self.update(4, z[1] + y - turned[1], level));
        let tilt = self.attitude_sigma().0;
        if d.is_finite() && tilt < VERTICAL_TILT {
            let second = VERTICAL_S * tilt * seen.config.bias[1];
            take(self.update(5, z[2], square(d) + square(timing) + square(second)));
        }
        if let Some(row) = &view.row {
            let p = self.kalman.covariance().variance(COMBINED);
            if let Some(variance) = row.variance(p) {
                take(self.update(COMBINED, row.z, variance));
                self.course |= row.course;
            } else {
                // it must fit although it shows nothing new
                take(self.compare(COMBINED, row.z, row.white + row.constant));
            }
        }
        let antenna = seen.fix.heading.map(|heading| {
            let [x, y, _] = narrow(sight.forward);
            ([x, y], heading)
        });
        for (forward, heading) in antenna.into_iter().chain(seen.given) {
            let Some((z, variance)) = observe::heading(forward, &heading, sight.phi_down) else {
                continue;
            };
            // its error may stay the same: many know no more than one
            let before = self.doubted;
            self.doubted = false;
            for (i, z) in [(COSINE, z[0]), (SINE, z[1])] {
                let own = self.kalman.covariance().variance(i);
                take(match observe::floored(own, variance, variance) {
                    Some(variance) => self.update(i, z, variance),
                    None => self.compare(i, z, variance),
                });
            }
            self.heading |= !self.doubted;
            self.doubted |= before;
        }
        sum / count
    }

    /// Takes back what the noise of `H` has pretended to show: observations of `c = s = 0`, by an
    /// observation of the same with a negative variance. `before`: variance of `u` at the last fix.
    fn forget(&mut self, step: &Step, fix: &Fix, before: f32) {
        let [.., n, e, _] = fix.sigmas;
        let noise = n.max(e) * n.max(e);
        if step.after == [0.0; 2] {
            return;
        }
        let shown = 2.0 * noise / (noise + before);
        for i in [COSINE, SINE] {
            let own = self.kalman.covariance().variance(i);
            // never less than was known at the beginning
            let shown = shown.min(0.5 / own).min(1.0 / own - 1.0);
            if shown > 0.0 {
                let innovation =
                    self.kalman
                        .innovation(i, f32::from(u8::from(i == COSINE)), -1.0 / shown);
                self.kalman.update(i, innovation);
            }
        }
    }

    /// One observation; its normalised innovation squared.
    fn update(&mut self, i: usize, z: f32, variance: f32) -> f32 {
        let innovation = self.kalman.innovation(i, z, variance);
        if innovation.squared_ratio() <= GATE {
            self.kalman.update(i, innovation);
        }
        self.doubt(innovation.squared_ratio())
    }

    /// The normalised innovation squared of an observation that is not used.
    fn compare(&mut self, i: usize, z: f32, variance: f32) -> f32 {
        self.doubt(self.kalman.innovation(i, z, variance).squared_ratio())
    }

    fn doubt(&mut self, ratio: f32) -> f32 {
        self.doubted |= ratio.is_nan() || ratio > GATE;
        ratio.min(GATE)
    }

    /// An observation of the last fix was too far from its prediction.
    pub fn is_doubted(&self) -> bool {
        self.doubted
    }

    /// Corrects the navigator by the filter's estimates; its position is the fix's. False: it does
    /// not take the correction.
    #[inline(never)]
    pub fn correct(&mut self, navigator: &mut Navigator, view: &View, seen: &Match<'_>) -> bool {
        let place = view.z.position;
        let x = *self.kalman.error_state();
        let [a, b, c, n, e, d, cosine, sine, _] = x;
        let [vn, ve] = self.velocity;
        let v = [n + vn * cosine + ve * sine, e + ve * cosine - vn * sine];
        let place = if seen.fix.has(0..2) { place } else { [0.0; 3] };
        let down = if seen.fix.has(2..3) { place[2] } else { 0.0 };
        let good = navigator.feed_back(&[a, b, c, v[0], v[1], d, place[0], place[1], down]);
        self.kalman
            .feedback(&[a, b, c, v[0], v[1], d, 0.0, 0.0, 0.0]);
        let mut estimate = *self.kalman.model().estimate();
        for (estimate, known) in estimate.iter_mut().zip(seen.known) {
            *estimate += known;
        }
        let [a, b, c, d, e, f] = estimate;
        good && navigator.set_estimate([a, b, c], [d, e, f])
    }
}

/// Standard deviations of the biases.
pub fn unit(config: &Config) -> [f32; OUTPUTS] {
    let [g, a] = config.bias;
    [g, g, g, a, a, a]
}
