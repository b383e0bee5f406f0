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
//! 8             a combination of the others, made anew for each fix, to be observed
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

use super::given::given_biases;
use super::level::Levelled;
use super::observe::{self, Row};
use super::{Config, LEAST_FIXES};
use crate::control::Way;
use crate::fix::{Fix, Heading};
use crate::nav::earth::{Local, OMEGA_IE};
use crate::nav::vector::{Q, V, V32, add, dot, narrow, rotated, scale};
use crate::nav::{self, Navigator};
use lrnn_nostd::learn::kalman::{Biases, Kalman, OUTPUTS, Prior, Transition};
use lrnn_nostd::{Net, Normalisation, Weights};

/// Number of errors.
pub const ERRORS: usize = 9;
/// Index of `1 - c`, of `-s`, and of the combination.
pub const COSINE: usize = 6;
pub const SINE: usize = 7;
pub const COMBINED: usize = 8;

/// The bank's filter of six biases.
pub type Biased = Kalman<Biases, ERRORS, OUTPUTS, 21>;

/// Standard deviation of a velocity before its first observation, m/s.
const ANY_VELOCITY: f32 = 2.0;
/// The vertical velocity is used when the tilt is known better than this, rad: it loses a share of
/// gravity by the square of the tilt.
const VERTICAL_TILT: f32 = 0.03;
/// The tilt times the accelerometers' bias is left out of the linear equations. It would be taken
/// for knowledge of the biases, which is prevented by a noise of the vertical velocity that it
/// causes in this time, s.
const VERTICAL_S: f32 = 60.0;
/// What the times of the fixes may be wrong, s: an acceleration makes a velocity of it (assumed).
const TIMING_S: f32 = 0.03;
/// An observation farther from its prediction than this many standard deviations is not believed.
const GATE: f32 = 25.0;
/// A change of velocity stands out of the noise by so many standard deviations.
pub const STANDS_OUT: f32 = 5.0;
/// Fixes over which the innovations are averaged.
const MEMORY: u16 = 20;
/// The velocity has changed by so many standard deviations when it shows a heading.
const SIGNAL: f32 = 12.0;
/// Fixes in motion after which an azimuth that is not seen is looked for anew.
const PATIENCE: u16 = 30;
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
    /// Where the forward axis pointed in `w`, horizontally, and the heading given for it.
    pub given: Option<([f32; 2], Heading)>,
    /// Attitude and receiver's velocity at the last fix.
    pub last: (Q, V),
}

/// What the transition must know of the time since the last fix.
struct Step {
    /// The velocities of `H` at its beginning and end.
    before: [f32; 2],
    after: [f32; 2],
    /// The receiver's horizontal velocity beside that of `H`.
    beside: [f32; 2],
    /// Change of the receiver's velocity.
    change: f32,
    /// Change of the azimuth, rad.
    turn: f32,
    /// Horizontal Earth rate, rad/s.
    earth: f32,
    /// What the navigator's frame turned about down for 1 m/s to its east, rad.
    bent: f32,
    /// Horizontal velocity in `w`, m/s.
    velocity: [f32; 2],
    /// Variance in proportion to the motion: attitude, velocity.
    scale: [f32; 2],
}

/// The filter.
#[derive(Debug, Clone)]
pub struct Filter {
    kalman: Biased,
    /// The horizontal velocity of `H`.
    velocity: [f32; 2],
    fixes: u16,
    /// Seconds of standstill in a row at the last fix.
    still: bool,
    residual: f32,
    /// An observation of the last fix was too far from its prediction.
    doubted: bool,
    course: bool,
    heading: bool,
    /// Least and greatest velocity of the receiver, and fixes in motion, since the azimuth is
    /// looked for.
    range: [[f32; 2]; 2],
    moving: u16,
}

impl Filter {
    /// For a navigator with this attitude in `w` and the velocity of the fix.
    pub fn new(config: &Config, levelled: &Levelled, q_bw: Q, fix: &Fix) -> Filter {
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
        let mut kalman = Biased::ZEROED;
        kalman.init([net; 2], prior);
        let (by, rest) = first(levelled, q_bw);
        begin(&mut kalman, &by, &rest);
        let [n, e, _] = narrow(fix.velocity);
        Filter {
            kalman,
            velocity: anchor(fix),
            fixes: 0,
            still: false,
            residual: 1.0,
            doubted: false,
            course: false,
            heading: false,
            range: [[n, e]; 2],
            moving: 0,
        }
    }

    /// The time since the last fix, and the fix. False: a number is not finite, or the navigator
    /// does not take the correction.
    pub fn fix(
        &mut self,
        navigator: &mut Navigator,
        passed: &nav::Transition,
        seen: &Match<'_>,
    ) -> bool {
        let state = *navigator.state();
        let step = self.step(&state, passed, seen);
        let z = navigator.innovation(seen.fix, seen.age[0]);
        let rotation = observe::rotation(seen.last.0, state.q_bn);
        let sight = observe::Sight {
            forward: rotated(state.q_bn, seen.config.forward.map(f64::from)),
            azimuth: self.azimuth(),
            rate: libm::sqrtf(dot(narrow(rotation), narrow(rotation))) / passed.time,
            phi_down: self.kalman.covariance().variance(2),
        };
        let still = seen.still && self.still;
        self.still = seen.still;
        let row = if still {
            Some(observe::no_turn(rotation))
        } else {
            observe::course(seen, &sight)
        };
        let before = self.kalman.covariance().variance(3);
        self.propagate(passed, &step, row.as_ref(), navigator, seen.known);
        self.velocity = step.after;
        self.doubted = false;
        let nis = self.observe(&z.velocity, &step, passed, seen, row.as_ref(), &sight);
        self.forget(&step, seen.fix, before);
        self.kalman.finish_update();
        if !self.kalman.is_healthy() {
            return false;
        }
        self.fixes = self.fixes.saturating_add(1);
        if self.fixes > 1 {
            let n = (self.fixes - 1).min(MEMORY);
            self.residual += (nis - self.residual) / f32::from(n);
        }
        self.correct(navigator, z.position, seen) && self.watch(navigator, seen)
    }

    /// An azimuth that nothing shows is looked for anew after some time: until then the navigator's
    /// drift and noise have blurred what the filter believes about it. The tilt and the biases
    /// stay.
    fn watch(&mut self, navigator: &mut Navigator, seen: &Match<'_>) -> bool {
        let [n, e, _] = narrow(seen.fix.velocity);
        let [low, high] = &mut self.range;
        for (i, v) in [n, e].into_iter().enumerate() {
            low[i] = low[i].min(v);
            high[i] = high[i].max(v);
        }
        if self.velocity != [0.0; 2] {
            self.moving = self.moving.saturating_add(1);
        }
        let found = self.has_signal(seen.fix) && self.heading_sigma().is_finite();
        let patience = if self.has_signal(seen.fix) { 4 } else { 1 } * PATIENCE;
        if self.moving < patience || found {
            return true;
        }
        let unit = unit(seen.config);
        let level: [[f32; ERRORS]; ERRORS] = core::array::from_fn(|i| {
            core::array::from_fn(|j| f32::from(u8::from(i == j && i < 2)))
        });
        let Some(given) = given_biases(&self.kalman, &level, &unit) else {
            return false;
        };
        let mut rest = free();
        for (row, known) in rest.iter_mut().zip(given.rest).take(2) {
            row[..2].copy_from_slice(&known[..2]);
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

    fn step(&self, state: &nav::State, passed: &nav::Transition, seen: &Match<'_>) -> Step {
        let here = Local::at(state.position.latitude, state.position.height);
        let [n, e, _] = narrow(seen.fix.velocity);
        let [x, y, _] = narrow(state.velocity);
        let after = anchor(seen.fix);
        let bent = passed.time * (here.sin / (here.cos * here.n_h)) as f32;
        let rotation = narrow(observe::rotation(seen.last.0, state.q_bn));
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

    fn propagate(
        &mut self,
        passed: &nav::Transition,
        step: &Step,
        row: Option<&Row>,
        navigator: &Navigator,
        known: &[f32; OUTPUTS],
    ) {
        let (block, shift) = transition(passed, step, row);
        let [[a, b, c], [d, e, f]] = navigator.estimate();
        let mut applied = [a, b, c, d, e, f];
        for (applied, known) in applied.iter_mut().zip(known) {
            *applied -= known;
        }
        self.kalman.propagate(&block, &applied);
        self.kalman.feedback(&shift);
    }

    /// All observations of a fix; the mean of their normalised innovations squared.
    fn observe(
        &mut self,
        z: &V32,
        step: &Step,
        passed: &nav::Transition,
        seen: &Match<'_>,
        row: Option<&Row>,
        sight: &observe::Sight,
    ) -> f32 {
        let [.., n, e, d] = seen.fix.sigmas;
        let late = libm::hypotf(TIMING_S, seen.age[1]);
        // what age and lever arm may be wrong makes a velocity of the motion
        let swing = seen.config.lever_arm_sigma * sight.rate;
        let timing = libm::hypotf(late * step.change / passed.time, swing);
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
        if let Some(row) = row {
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
            for (i, z) in [(COSINE, z[0]), (SINE, z[1])] {
                let own = self.kalman.covariance().variance(i);
                take(match observe::floored(own, variance, variance) {
                    Some(variance) => self.update(i, z, variance),
                    None => self.compare(i, z, variance),
                });
            }
            self.heading = true;
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
        self.doubted |= !(ratio <= GATE);
        ratio.min(GATE)
    }

    /// An observation of the last fix was too far from its prediction.
    pub fn is_doubted(&self) -> bool {
        self.doubted
    }

    /// Corrects the navigator by what the filter has found; its place is the fix's.
    fn correct(&mut self, navigator: &mut Navigator, place: V32, seen: &Match<'_>) -> bool {
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

    /// The velocity of `H`, north and east, m/s.
    pub fn velocity(&self) -> [f32; 2] {
        self.velocity
    }

    /// The filter, for the hand-over.
    pub fn kalman(&self) -> &Biased {
        &self.kalman
    }

    /// Estimates of cosine and sine.
    pub fn azimuth(&self) -> [f32; 2] {
        let [.., cosine, sine, _] = *self.kalman.error_state();
        [1.0 - cosine, -sine]
    }

    /// Whether no heading has been given yet.
    pub fn wants_heading(&self) -> bool {
        !self.heading
    }

    /// Fixes used.
    pub fn fixes(&self) -> u16 {
        self.fixes
    }

    /// Mean normalised innovation squared.
    pub fn residual(&self) -> f32 {
        if self.fixes < LEAST_FIXES {
            0.0
        } else {
            self.residual
        }
    }

    /// What has given the heading.
    pub fn way(&self) -> Way {
        match (self.heading, self.course) {
            (true, _) => Way::Heading,
            (_, true) => Way::Course,
            _ => Way::Velocity,
        }
    }

    /// Standard deviations of the tilt and of the attitude about down in `w`, rad.
    pub fn attitude_sigma(&self) -> (f32, f32) {
        let of = |i| self.kalman.covariance().variance(i);
        (libm::sqrtf(of(0).max(of(1))), libm::sqrtf(of(2)))
    }

    /// Root of `c^2 + s^2`, and its standard deviation.
    pub fn norm(&self) -> (f32, f32) {
        let [c, s] = self.azimuth();
        let norm = libm::hypotf(c, s);
        let mut row = [0.0; ERRORS];
        (row[COSINE], row[SINE]) = (c / norm, s / norm);
        (norm, self.sigma_of(&row))
    }

    /// Standard deviation of the heading, rad. Infinite while the norm may be 0.
    pub fn heading_sigma(&self) -> f32 {
        let (norm, sigma) = self.norm();
        if !(norm > 3.0 * sigma) {
            return f32::INFINITY;
        }
        let mut row = azimuth_row(self.azimuth());
        row[2] -= 1.0;
        self.sigma_of(&row)
    }

    /// Standard deviation of a combination of the errors.
    fn sigma_of(&self, row: &[f32; ERRORS]) -> f32 {
        let all = self.kalman.covariance().errors();
        let variance = row.iter().zip(all).fold(0.0, |sum, (&a, of)| {
            let inner = of.iter().zip(row).fold(0.0, |sum, (p, b)| sum + p * b);
            sum + a * inner
        });
        libm::sqrtf(variance.max(0.0))
    }
}

/// Standard deviations of the biases.
pub fn unit(config: &Config) -> [f32; OUTPUTS] {
    let [g, a] = config.bias;
    [g, g, g, a, a, a]
}

/// The error of the azimuth, estimate minus truth, by the errors of cosine and sine.
pub fn azimuth_row([c, s]: [f32; 2]) -> [f32; ERRORS] {
    let per = 1.0 / (c * c + s * s);
    let mut row = [0.0; ERRORS];
    // the state holds 1 - c and -s, whose errors are the negative of those of c and s, and the
    // state is truth where the estimate has been taken out
    (row[COSINE], row[SINE]) = (-s * per, c * per);
    row
}

/// The velocity of `H`: none when the receiver's may be none.
fn anchor(fix: &Fix) -> [f32; 2] {
    let [n, e, _] = narrow(fix.velocity);
    let [.., sn, se, _] = fix.sigmas;
    if libm::hypotf(n, e) <= STANDS_OUT * sn.max(se) {
        [0.0; 2]
    } else {
        [n, e]
    }
}

/// The filter's errors at its beginning. c is as likely 1 as -1, so that the mean of 1 - c is 1.
fn begin(kalman: &mut Biased, by: &[[f32; OUTPUTS]; ERRORS], rest: &[[f32; ERRORS]; ERRORS]) {
    let applied = *kalman.model().estimate();
    kalman.align(by, rest, &applied);
    let mut shift = [0.0; ERRORS];
    shift[COSINE] = -1.0;
    kalman.feedback(&shift);
}

/// Covariance of errors at the beginning but the tilt: velocity, cosine and sine are free, and
/// about down `w` is where the navigator is.
fn free() -> [[f32; ERRORS]; ERRORS] {
    let v = ANY_VELOCITY * ANY_VELOCITY;
    let variance = [0.0, 0.0, 1e-8, v, v, v, 1.0, 1.0, 1.0];
    let mut rest = [[0.0; ERRORS]; ERRORS];
    for (i, variance) in variance.into_iter().enumerate() {
        rest[i][i] = variance;
    }
    rest
}

/// Errors of a level attitude: tilt by the accelerometers' bias and the gyros' drift since the
/// middle of the levelling, and what the receiver did not tell. Velocity, cosine and sine are free.
fn first(levelled: &Levelled, q_bw: Q) -> ([[f32; OUTPUTS]; ERRORS], [[f32; ERRORS]; ERRORS]) {
    let mut by = [[0.0; OUTPUTS]; ERRORS];
    let (half, lean) = (-0.5 * levelled.time, 1.0 / levelled.gravity);
    let rows = [
        ([half, 0.0, 0.0], [0.0, lean, 0.0]),
        ([0.0, half, 0.0], [-lean, 0.0, 0.0]),
    ];
    let [w, x, y, z] = q_bw;
    for (by, (gyro, accel)) in by.iter_mut().zip(rows) {
        // a row times C is C' times it
        let back = |v: V32| narrow(rotated([w, -x, -y, -z], v.map(f64::from)));
        let ([a, b, c], [d, e, f]) = (back(gyro), back(accel));
        *by = [a, b, c, d, e, f];
    }
    // the tilt that the receiver's acceleration shows: phi = [e, -n] in w, which is the
    // acceleration in north and east less H (1 - c, -s), with a mean of zero
    let [n, e] = levelled.slope;
    let lean = [[-e, n], [n, e]];
    let tilt = levelled.tilt;
    let mut rest = free();
    for i in 0..2 {
        rest[i][i] = tilt;
    }
    for i in 0..2 {
        for j in 0..2 {
            (rest[i][COSINE + j], rest[COSINE + j][i]) = (lean[i][j], lean[i][j]);
            rest[i][j] += lean[i][0] * lean[j][0] + lean[i][1] * lean[j][1];
        }
    }
    (by, rest)
}

/// The transition of the nine errors, and by how much their means move less: a shift for
/// [`Kalman::feedback`].
fn transition(
    passed: &nav::Transition,
    step: &Step,
    row: Option<&Row>,
) -> (Transition<ERRORS>, [f32; ERRORS]) {
    let mut to = Transition::ZEROED;
    to.time = passed.time;
    let (sin, cos) = (libm::sinf(step.turn), libm::cosf(step.turn));
    let azimuth = [[cos, -sin], [sin, cos]];
    let mut shift = [0.0; ERRORS];
    (shift[COSINE], shift[SINE]) = (cos - 1.0, sin);
    let h = |[n, e]: [f32; 2]| [[n, e], [e, -n]];
    for i in 0..6 {
        let mut from = passed.phi[i];
        if i == 2 {
            // the frame's own turn is part of the azimuth
            from[4] += step.bent;
        }
        let free = from_earth(passed, step, i);
        for j in 0..2 {
            let velocity = from[3] * h(step.before)[0][j] + from[4] * h(step.before)[1][j];
            to.phi[i][COSINE + j] = velocity + free[j];
        }
        to.phi[i][..6].copy_from_slice(&from[..6]);
        to.gamma[i] = passed.gamma[i];
        to.q[i][..6].copy_from_slice(&passed.q[i][..6]);
        to.q[i][i] += step.scale[usize::from(i >= 3)];
    }
    for i in 0..2 {
        let after = h(step.after)[i];
        for j in 0..2 {
            let moved = after[0] * azimuth[0][j] + after[1] * azimuth[1][j];
            to.phi[3 + i][COSINE + j] -= moved;
            to.phi[COSINE + i][COSINE + j] = azimuth[i][j];
        }
        shift[3 + i] = -(after[0] * shift[COSINE] + after[1] * shift[SINE]);
    }
    if let Some(row) = row {
        combine(&mut to, &mut shift, row);
    }
    (to, shift)
}

/// Effect of `1 - c` and `-s` on error `i` by the Earth's rate that was assumed about the wrong
/// axis.
fn from_earth(passed: &nav::Transition, step: &Step, i: usize) -> [f32; 2] {
    let (time, earth) = (passed.time, step.earth);
    let by_axis = |axis: usize| {
        let turned = passed.phi[i][axis];
        if i < 3 {
            // the mean over the time
            0.5 * time * (turned + f32::from(u8::from(i == axis)))
        } else {
            0.5 * time * turned
        }
    };
    let mut effect = [earth * by_axis(0), -earth * by_axis(1)];
    if i == 5 {
        let [x, y] = step.velocity;
        effect[0] -= 2.0 * time * earth * y;
        effect[1] -= 2.0 * time * earth * x;
    }
    effect
}

/// The last error becomes a combination of the others after the transition.
fn combine(to: &mut Transition<ERRORS>, shift: &mut [f32; ERRORS], row: &Row) {
    let parts = [
        (2, row.phi_down),
        (COSINE, row.azimuth[0]),
        (SINE, row.azimuth[1]),
    ];
    let mut combined = [0.0; ERRORS];
    for (i, factor) in parts {
        for (sum, value) in combined.iter_mut().zip(to.phi[i]) {
            *sum += factor * value;
        }
        shift[COMBINED] += factor * shift[i];
    }
    combined[2] -= row.before;
    to.phi[COMBINED] = combined;
    to.gamma[COMBINED] = to.gamma[2].map(|value| row.phi_down * value);
    for i in 0..6 {
        let value = row.phi_down * to.q[2][i];
        (to.q[COMBINED][i], to.q[i][COMBINED]) = (value, value);
    }
    to.q[COMBINED][COMBINED] = row.phi_down * row.phi_down * to.q[2][2];
}
