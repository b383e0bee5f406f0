//! An alignment in progress.

mod judge;

use super::pass::{
    ACCEL, AGE, ARM, Assumed, CONSTANTS, Earth, GYRO, Pass, Row, SPIN, VELOCITY, product_of,
};
use super::regression::{Regression, bias_observations, regress_on_biases};
use super::window::{Window, WindowFix};
use super::{AlignedState, Config, ERRORS, FAR_M, Progress, TIMING_S};
use crate::control::HeadingSource;
use crate::fix::{Fix, Heading, Position};
use crate::nav::State;
use crate::nav::earth::Local;
use crate::nav::gather::Gather;
use crate::nav::vector::{add, from_rotvec, narrow, product, renormalised, rotated, scale};
use crate::sample::Counts;
use judge::{GUESSES, Guess};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// A pass advances by an interval in this time, s.
const STEP_S: f32 = 2e-3;
/// Intervals before guesses begin.
const LEAST: usize = 4;
/// Longest time without a fix, s.
const LONGEST_S: f32 = 5.0;
/// The biases may be larger than the unit file's by this: datasheets give the typical one at best,
/// and sensors age.
const WIDE: f32 = 10.0;
/// But their standard deviation is hardly larger than this, 3 deg/s and 0.02 g (assumed), and no
/// larger than twice that whatever the unit file says.
const WIDEST: [f32; 2] = [0.05, 0.2];
/// The smallest prior of a lever arm, m, and of what is in proportion, so that nothing is exact.
const SOME: [f32; 2] = [0.02, 1e-5];
/// Standard deviation of a height that the receiver does not measure, m.
const ANY_HEIGHT: f32 = 100.0;

/// The computation in progress.
#[derive(Debug, Clone, Copy, PartialEq)]
enum SearchStep {
    /// Nothing until the next fix.
    Waits,
    /// A guess, and the next interval of its pass.
    Guess(usize, usize),
    /// The best guess once more, to be judged.
    Best(usize, usize),
    /// The best guess is good: the next fix starts with it. The next interval of its pass.
    Good(usize, usize),
}

/// An alignment in motion.
#[derive(Debug, Clone)]
pub struct InMotion {
    config: Config,
    /// Errors of the sensors that are known already, rad/s and m/s2.
    known: [f32; OUTPUTS],
    gather: Option<Gather>,
    origin: Option<Position>,
    earth: Earth,
    window: Window,
    guesses: [Guess; GUESSES],
    pass: Pass,
    stage: SearchStep,
    /// The last interval at whose end the fix was too far from the best guess.
    wild: Option<usize>,
    /// Intervals that the guesses are compared over.
    upto: usize,
    /// Time that has not been used for steps, s.
    credit: f32,
    /// Whether the guesses have begun.
    guessing: bool,
    /// The receiver's noise by what it tells, variances.
    noise: f32,
    /// Largest standard deviation of the fixes' ages, s.
    age_sigma: f32,
    /// A heading that was given, and the interval after which.
    given: Option<(Heading, usize)>,
    heading_sigma: f32,
    residual: f32,
    /// Rounds in a row that passed all tests.
    passes: u8,
    refused: u32,
    /// The course counts.
    rolls: bool,
    /// Since the beginning, s.
    time: f64,
}

impl InMotion {
    /// Waits for the first fix. `known`: errors of the sensors that have been learnt before, rad/s
    /// and m/s2.
    #[must_use]
    pub fn new(config: Config, known: [f32; OUTPUTS]) -> Self {
        Self {
            config,
            known,
            gather: None,
            origin: None,
            earth: Earth {
                gravity: 0.0,
                rate: [0.0; 3],
                bent: [0.0; 2],
            },
            window: Window::EMPTY,
            guesses: [Guess::NONE; GUESSES],
            pass: Pass::ZEROED,
            stage: SearchStep::Waits,
            wild: None,
            upto: 0,
            credit: 0.0,
            guessing: false,
            noise: 1.0,
            age_sigma: 0.0,
            given: None,
            heading_sigma: f32::INFINITY,
            residual: 0.0,
            passes: 0,
            refused: 0,
            rolls: config.rolls,
            time: 0.0,
        }
    }

    /// Takes one uncorrected sample.
    pub fn sample(&mut self, counts: &Counts) {
        let Some(gather) = &mut self.gather else {
            return;
        };
        gather.sample(counts);
        if gather.is_full() {
            let piece = gather.end();
            self.window.piece(&piece);
        }
        let sample_s = self.config.navigator.sample_s;
        self.time += sample_s;
        self.credit += sample_s as f32;
        while self.credit >= STEP_S {
            self.credit -= STEP_S;
            self.step();
        }
    }

    /// The samples are interrupted: restarts. The count of refused alignments stays.
    #[inline(never)]
    pub fn gap(&mut self) {
        (self.gather, self.origin, self.given) = (None, None, None);
        self.window = Window::EMPTY;
        self.stage = SearchStep::Waits;
        self.guessing = false;
        self.noise = 1.0;
        self.heading_sigma = f32::INFINITY;
        (self.residual, self.passes, self.time) = (0.0, 0, 0.0);
    }

    /// A heading of the vehicle that somebody knows, valid now. Without effect where the mounting
    /// is unknown.
    pub fn heading(&mut self, heading: Heading) {
        if self.origin.is_some() && self.knows_forward() {
            self.given = Some((heading, self.window.nodes().len()));
        }
    }

    /// Whether the vehicle's forward axis is known.
    #[must_use]
    pub fn knows_forward(&self) -> bool {
        self.config.forward != [0.0; 3]
    }

    /// Whether the alignment has begun: a given heading then stays in use.
    #[must_use]
    pub fn has_begun(&self) -> bool {
        self.origin.is_some()
    }

    /// Progress of the alignment.
    #[must_use]
    pub fn progress(&self) -> Progress {
        let way = match (self.guessing, self.given) {
            (false, _) => HeadingSource::None,
            (true, Some(_)) => HeadingSource::Heading,
            (true, None) if self.pass.course => HeadingSource::Course,
            (true, None) => HeadingSource::Velocity,
        };
        Progress {
            way,
            heading_sigma: self.heading_sigma,
            residual: self.residual,
            refused: self.refused,
        }
    }

    /// Takes a fix that was valid `age` before the last sample: seconds and their standard
    /// deviation. `rest`: the vehicle stands, and its velocity has this standard deviation, m/s. A
    /// fix with neither a position nor a horizontal velocity is not used, nor is one without a
    /// position before the first with one.
    ///
    /// Gives the attitude when it is known well enough; its matrices are in `scratch` then.
    #[inline(never)]
    pub fn fix(
        &mut self,
        fix: &Fix,
        rest: Option<f32>,
        age: [f32; 2],
        scratch: &mut Transition<ERRORS>,
    ) -> Option<AlignedState> {
        let fix = &measured(fix);
        self.end_piece();
        if self.window.open_s() > LONGEST_S {
            self.gap();
        }
        let located = fix.has(0..2);
        if !(located || fix.has(3..5)) {
            return None;
        }
        let origin = match self.origin {
            Some(origin) => origin,
            None if located => self.begin(fix)?,
            None => return None,
        };
        let at = if located {
            narrow(fix.position.ned_from(&origin))
        } else {
            [0.0; 3]
        };
        let near = libm::hypotf(at[0], at[1]) < FAR_M;
        if !near {
            self.gap();
            return None;
        }
        self.age_sigma = self.age_sigma.max(age[1]);
        let [n, e, d, vn, ve, vd] = fix.sigmas;
        let place = WindowFix {
            at,
            sigma: [n.max(e), d],
            velocity: narrow(fix.velocity),
            speed_sigma: [vn.max(ve), vd],
            age: age[0],
            rest: rest.filter(|_| self.config.stands).unwrap_or(f32::INFINITY),
        };
        if self.window.is_full() && self.is_free() {
            self.slide();
        }
        if !self.window.fix(&place) {
            return None;
        }
        // at the end of the interval that the fix has closed
        let closed = self.window.nodes().len().checked_sub(1);
        if let Some((heading, at)) = fix.heading.zip(closed).filter(|_| self.knows_forward()) {
            self.given = Some((heading, at));
        }
        if let SearchStep::Good(_, next) = self.stage {
            // the navigator starts at a position
            if !located {
                return None;
            }
            let found = self.hand_over(fix, age[0], next, scratch);
            self.begin_round();
            return found;
        }
        if self.stage == SearchStep::Waits {
            self.begin_round();
        }
        None
    }

    /// Whether no pass goes over the window.
    fn is_free(&self) -> bool {
        matches!(self.stage, SearchStep::Waits | SearchStep::Good(..))
    }

    /// The first fix.
    fn begin(&mut self, fix: &Fix) -> Option<Position> {
        let mut gather = Gather::new(
            self.config.navigator.lsb,
            self.config.navigator.sample_s,
            self.config.navigator.piece_samples,
        );
        let [a, b, c, d, e, f] = self.known;
        gather.set_estimate([[a, b, c], [d, e, f]]);
        self.gather = Some(gather);
        let height = if fix.has(2..3) {
            fix.position.height
        } else {
            0.0
        };
        let here = Local::at(fix.position.latitude, height);
        let [n, _, d] = here.omega_ie();
        self.earth = Earth {
            gravity: here.g as f32,
            rate: [n as f32, 0.0, d as f32],
            bent: [(1.0 / here.n_h) as f32, (here.sin / here.cos) as f32],
        };
        self.origin = Some(fix.position);
        self.origin
    }

    fn end_piece(&mut self) {
        if let Some(gather) = self.gather.as_mut().filter(|gather| !gather.is_empty()) {
            let piece = gather.end();
            self.window.piece(&piece);
        }
    }

    /// What is assumed of sensors and receiver.
    #[inline(never)]
    fn assumed(&self) -> Assumed {
        let config = &self.config;
        let noise = &config.navigator.noise;
        let [gyro, accel] = core::array::from_fn(|i| {
            let (bias, widest) = (config.bias[i], WIDEST[i]);
            (WIDE * bias).min(bias.clamp(widest, 2.0 * widest))
        });
        let mut sigma = [0.0; CONSTANTS];
        for i in 0..3 {
            sigma[GYRO + i] = gyro;
            sigma[SPIN + i] = config.scale[0].max(SOME[1]);
            sigma[ACCEL + i] = accel;
            sigma[ARM + i] = config.lever_arm_sigma.max(SOME[0]);
        }
        sigma[AGE] = libm::hypotf(TIMING_S, self.age_sigma);
        Assumed {
            sigma,
            noise: [noise.gyro, noise.accel],
            ratio: config.scale,
            arm: config.navigator.lever_arm,
            scale: self.noise,
            forward: if self.rolls { config.forward } else { [0.0; 3] },
        }
    }

    /// Hands over the state at the last sample from which the navigator starts.
    #[inline(never)]
    fn hand_over(
        &mut self,
        fix: &Fix,
        age: f32,
        next: usize,
        scratch: &mut Transition<ERRORS>,
    ) -> Option<AlignedState> {
        let assumed = self.assumed();
        let nodes = self.window.nodes();
        for node in nodes.get(next..)? {
            self.pass.interval(node, &self.earth, &assumed);
            self.pass.observe(node, &assumed);
        }
        let rest = self.window.rest();
        if rest.time > 0.0 {
            self.pass.interval(&rest, &self.earth, &assumed);
        }
        let rows: [Row; 3] = core::array::from_fn(|i| self.pass.attitude_row(i));
        let pass = &self.pass;
        let phi = core::array::from_fn(|i| f64::from(product_of(&rows[i], &pass.x)));
        let q_bn = renormalised(product(from_rotvec(phi), pass.q));
        let velocity = pass.estimated_velocity().map(f64::from);
        let arm = scale(self.config.navigator.lever_arm.map(f64::from), -1.0);
        let ahead = scale(velocity, f64::from(age.clamp(0.0, 1.0)));
        let position = (fix.position).displaced(add(ahead, rotated(q_bn, arm)));
        let unit = core::array::from_fn(|j| assumed.sigma[constant(j)]);
        let mut estimate: [f32; OUTPUTS] = core::array::from_fn(|j| pass.constant(constant(j)));
        let [heading_sigma, residual] = [libm::sqrtf(pass.variance(&rows[2])), self.residual];
        if !errors(pass, &rows, &unit, fix, scratch) {
            return None;
        }
        let mut observed = bias_observations(&of_biases(pass), &estimate, &unit)?;
        for (estimate, known) in estimate.iter_mut().zip(self.known) {
            *estimate += known;
        }
        observed.from = self.known;
        Some(AlignedState {
            state: State {
                position,
                velocity,
                q_bn,
            },
            applied: estimate,
            observed,
            way: self.progress().way,
            heading_sigma,
            residual,
            time_s: self.time,
        })
    }
}

/// A fix without numbers that mean nothing.
fn measured(fix: &Fix) -> Fix {
    let mut fix = *fix;
    if !fix.has(2..3) {
        fix.position.height = 0.0;
    }
    if !fix.has(5..6) {
        fix.velocity[2] = 0.0;
    }
    fix
}

/// Index of a sensor's bias among the constants.
fn constant(j: usize) -> usize {
    if j < 3 { GYRO + j } else { ACCEL + j - 3 }
}

/// Covariance of the biases.
#[inline(never)]
fn of_biases(pass: &Pass) -> [[f32; OUTPUTS]; OUTPUTS] {
    core::array::from_fn(|i| core::array::from_fn(|j| pass.p[constant(i)][constant(j)]))
}

/// The errors of attitude and velocity in the firmware's signs, estimate minus truth with `C_est =
/// (I - phi x) C_true`, and those of the position by the fix, into the scratch memory.
#[inline(never)]
fn errors(
    pass: &Pass,
    rows: &[Row; 3],
    unit: &[f32; OUTPUTS],
    fix: &Fix,
    scratch: &mut Transition<ERRORS>,
) -> bool {
    let mut xx = [[0.0; ERRORS]; ERRORS];
    let mut xt = [[0.0; OUTPUTS]; ERRORS];
    for i in 0..3 {
        for j in 0..3 {
            xx[i][j] = pass.covariance(&rows[i], &rows[j]);
            // truth minus reference is minus the error of a velocity, but phi itself
            let across = -product_of(&rows[i], &pass.p[VELOCITY + j]);
            (xx[i][3 + j], xx[3 + j][i]) = (across, across);
            xx[3 + i][3 + j] = pass.p[VELOCITY + i][VELOCITY + j];
        }
        xt[i] = core::array::from_fn(|j| -product_of(&rows[i], &pass.p[constant(j)]));
        xt[3 + i] = core::array::from_fn(|j| pass.p[VELOCITY + i][constant(j)]);
    }
    let regression = Regression {
        by: &mut scratch.gamma,
        rest: &mut scratch.q,
        all: &mut scratch.phi,
    };
    if !regress_on_biases((&xx, &xt, &of_biases(pass)), unit, regression) {
        return false;
    }
    for (k, sigma) in fix.sigmas.iter().take(3).enumerate() {
        let sigma = if sigma.is_finite() {
            *sigma
        } else {
            ANY_HEIGHT
        };
        scratch.q[6 + k][6 + k] = sigma * sigma;
        scratch.phi[6 + k][6 + k] = sigma * sigma;
    }
    true
}
