//! Guesses of the attitude, improved in turn, and when the best one is believed.

use super::{InMotion, LEAST, SearchStep};
use crate::align::motion::pass::{ACCEL, CONSTANTS, GYRO, Row};
use crate::align::motion::window::Node;
use crate::align::motion::{BAD_RESIDUAL, GOOD_RESIDUAL, MAX_HEADING, MAX_TILT, PASSES};
use crate::nav::vector::{
    Q, V, add, cross, dot, from_rotvec, product, renormalised, rotated, scale,
};

/// Guesses of the heading, all around.
pub const GUESSES: usize = 4;
/// Time over which the force is taken for gravity's reaction, s.
const LEVEL_S: f32 = 3.0;
/// Largest step of a guess, rad.
const STEP: f32 = 0.5;
/// A guess has come to its end when it moves by less, rad.
const STANDS: f32 = 0.02;
/// Passes that a guess must have made.
const LEAST_PASSES: u16 = 5;
/// Passes after which a contradiction is one.
const PATIENCE: u16 = 12;
/// Rounds in a row that refusals add at most.
const MOST_PASSES: u32 = 40;
/// Two guesses are the same attitude up to this angle, rad.
const SAME: f32 = 0.15;
/// Another guess is ruled out when it is less likely by so much, as twice a logarithm: by e^9.
const RULED_OUT: f32 = 18.0;
/// Largest distance of a constant from its assumed value, in assumed standard deviations.
const ASSUMED: f32 = 5.0;
/// Of the observations, those that are spent on what is estimated.
const SPENT: f32 = 15.0;
/// Observations that what the receiver says of its noise counts for.
const TOLD: f32 = 10.0;
/// The receiver's errors last: they are never believed to be smaller than this share of what it
/// says, variances.
const LEAST_NOISE: f32 = 0.25;

/// A guess: the attitude at the window's beginning, and all that stays the same.
#[derive(Debug, Clone, Copy)]
pub struct Guess {
    pub q: Q,
    pub constants: [f32; CONSTANTS],
    /// Twice the negative logarithm of its likelihood.
    cost: f32,
    /// How far the last pass moved it, rad.
    step: f32,
    passes: u16,
}

impl Guess {
    pub const NONE: Guess = Guess {
        q: [1.0, 0.0, 0.0, 0.0],
        constants: [0.0; CONSTANTS],
        cost: f32::INFINITY,
        step: f32::INFINITY,
        passes: 0,
    };

    /// The angle to another one, rad.
    fn angle(&self, other: &Guess) -> f32 {
        let [w, x, y, z] = other.q;
        let [c, a, b, d] = product(self.q, [w, -x, -y, -z]);
        2.0 * libm::atan2(libm::sqrt(a * a + b * b + d * d), c.abs()) as f32
    }

    /// Moves by the estimate of a pass, at most [`STEP`].
    fn moves(&mut self, x: &Row) {
        let [a, b, c] = [x[0], x[1], x[2]];
        let size = libm::sqrtf(a * a + b * b + c * c);
        let share = if size > STEP { STEP / size } else { 1.0 };
        let turn = [a, b, c].map(|x| f64::from(x * share));
        self.q = renormalised(product(from_rotvec(turn), self.q));
        for (constant, x) in self.constants.iter_mut().zip(x).skip(GYRO) {
            *constant += x * share;
        }
        self.step = size;
        self.passes = self.passes.saturating_add(1);
    }

    /// The first interval of the window is forgotten.
    fn slides(&mut self, node: &Node) {
        let bias = [0, 1, 2].map(|i| f64::from(self.constants[GYRO + i] * node.time));
        let turn = add(node.turn.map(f64::from), scale(bias, -1.0));
        self.q = renormalised(product(self.q, from_rotvec(turn)));
    }
}

impl InMotion {
    /// The window forgets its first interval.
    #[inline(never)]
    pub(super) fn slide(&mut self) {
        let Some(gone) = self.window.slide() else {
            return;
        };
        for guess in &mut self.guesses {
            guess.slides(&gone);
        }
        if let SearchStep::Good(_, next) = &mut self.stage {
            *next = next.saturating_sub(1);
        }
        self.given = self
            .given
            .and_then(|(heading, at)| Some((heading, at.checked_sub(1)?)));
    }

    /// All guesses are improved by what is in the window now.
    pub(super) fn begin_round(&mut self) {
        self.stage = SearchStep::Waits;
        if self.window.nodes().len() < LEAST {
            return;
        }
        if !self.guessing {
            self.guess();
        }
        self.upto = self.window.nodes().len();
        self.begin_pass(0);
        self.stage = SearchStep::Guess(0, 0);
    }

    /// Guesses all around, with the force of the first seconds for gravity's reaction.
    #[inline(never)]
    fn guess(&mut self) {
        let mut q = [1.0, 0.0, 0.0, 0.0];
        let (mut sum, mut time) = ([0.0; 3], 0.0);
        for node in self.window.nodes() {
            sum = add(sum, rotated(q, node.gain.map(f64::from)));
            q = product(q, from_rotvec(node.turn.map(f64::from)));
            time += node.time;
            if time >= LEVEL_S {
                break;
            }
        }
        let size = libm::sqrt(dot(sum, sum));
        if size <= 1.0 || size.is_nan() {
            return;
        }
        let level = shortest(scale(sum, 1.0 / size));
        debug_assert!(dot(rotated(level, sum), UP) > 0.0);
        for (k, guess) in self.guesses.iter_mut().enumerate() {
            let heading = core::f64::consts::TAU * k as f64 / GUESSES as f64;
            *guess = Guess {
                q: product(from_rotvec([0.0, 0.0, heading]), level),
                ..Guess::NONE
            };
        }
        self.guessing = true;
    }

    #[inline(never)]
    fn begin_pass(&mut self, guess: usize) {
        self.wild = None;
        let Some(guess) = self.guesses.get(guess) else {
            return;
        };
        let assumed = self.assumed();
        if let Some(next) = self.window.nodes().first() {
            let from = (guess.q, &guess.constants);
            self.pass.begin(from, (self.window.first(), next), &assumed);
        }
    }

    /// Advances by one interval.
    pub(super) fn step(&mut self) {
        let (SearchStep::Guess(guess, at) | SearchStep::Best(guess, at)) = self.stage else {
            return;
        };
        let goes_on = self.interval(at);
        let next = at + 1;
        self.stage = match self.stage {
            SearchStep::Guess(..) if goes_on => SearchStep::Guess(guess, next),
            SearchStep::Best(..) if goes_on => SearchStep::Best(guess, next),
            SearchStep::Guess(..) => self.end_guess(guess),
            _ => self.end_round(guess, at),
        };
    }

    /// One interval of a pass. False: there is none.
    #[inline(never)]
    fn interval(&mut self, at: usize) -> bool {
        let nodes = self.window.nodes().get(..self.upto).unwrap_or_default();
        let Some(node) = nodes.get(at) else {
            return false;
        };
        let assumed = self.assumed();
        self.pass.interval(node, &self.earth, &assumed);
        self.pass.observe(node, &assumed);
        if self.pass.is_wild() {
            self.wild = Some(at);
        }
        if let Some((heading, _)) = self.given.filter(|(_, given)| *given == at) {
            let variance = heading.sigma * heading.sigma;
            self.pass
                .heading(self.config.forward, heading.angle, variance);
        }
        true
    }

    /// A pass about a guess is over: what comes next.
    #[inline(never)]
    fn end_guess(&mut self, index: usize) -> SearchStep {
        if let Some(guess) = self.guesses.get_mut(index) {
            guess.cost = self.pass.cost;
            guess.moves(&self.pass.x);
            let whole = guess.q.iter().all(|x| x.is_finite()) && guess.cost.is_finite();
            if !whole {
                self.guessing = false;
                return SearchStep::Waits;
            }
        }
        let next = index + 1;
        if next < GUESSES {
            self.begin_pass(next);
            return SearchStep::Guess(next, 0);
        }
        let best = self.best();
        self.begin_pass(best);
        SearchStep::Best(best, 0)
    }

    /// The most likely guess.
    fn best(&self) -> usize {
        let mut best = 0;
        let mut least = f32::INFINITY;
        for (k, guess) in self.guesses.iter().enumerate() {
            if guess.cost < least {
                (best, least) = (k, guess.cost);
            }
        }
        best
    }

    /// The best guess has been gone over once more: judges it.
    #[inline(never)]
    fn end_round(&mut self, best: usize, next: usize) -> SearchStep {
        let Some(guess) = self.guesses.get_mut(best) else {
            return SearchStep::Waits;
        };
        let (cost, pass) = (guess.cost, &self.pass);
        guess.moves(&pass.x);
        guess.cost = pass.cost;
        // by what the receiver says
        self.residual = pass.fit.residual() * self.noise;
        let passes = guess.passes;
        let squares = self.residual * pass.fit.count;
        let noise = (TOLD + squares) / (TOLD + (pass.fit.count - SPENT).max(0.0));
        if passes >= PATIENCE && self.residual > BAD_RESIDUAL {
            self.refuse();
            return SearchStep::Waits;
        }
        let settled = passes >= LEAST_PASSES && guess.step < STANDS;
        if let (true, Some(at)) = (settled, self.wild) {
            // the fixes have jumped: what was before is of no use
            self.passes = 0;
            for _ in 0..=at {
                self.slide();
            }
            return SearchStep::Waits;
        }
        let good = self.wild.is_none() && self.is_good(best, cost);
        let least = if self.window.first().speed_sigma[0].is_finite() {
            1.0
        } else {
            LEAST_NOISE
        };
        self.noise = noise.clamp(least, GOOD_RESIDUAL);
        self.passes = if good {
            self.passes.saturating_add(1)
        } else {
            0
        };
        // of many attempts one agrees by chance: each that was refused asks for one round more
        let refused = self.refused.min(MOST_PASSES) as u8;
        if self.passes >= PASSES + refused {
            SearchStep::Good(best, next)
        } else {
            SearchStep::Waits
        }
    }

    fn is_good(&mut self, best: usize, cost: f32) -> bool {
        let pass = &self.pass;
        let sigma = |i: usize| libm::sqrtf(pass.variance(&pass.attitude_row(i)));
        let (tilt, heading) = (sigma(0).max(sigma(1)), sigma(2));
        self.heading_sigma = heading;
        let Some(guess) = self.guesses.get(best) else {
            return false;
        };
        let unique = self.guesses.iter().all(|other| {
            let ruled_out = other.passes >= LEAST_PASSES && other.cost > cost + RULED_OUT;
            ruled_out || guess.angle(other) < SAME
        });
        unique
            && guess.passes >= LEAST_PASSES
            && guess.step < STANDS
            && heading <= MAX_HEADING
            && tilt <= MAX_TILT
            && self.residual <= GOOD_RESIDUAL
            && self.pass.fit.recent * self.noise <= GOOD_RESIDUAL
            && self.fits(guess)
    }

    /// Whether what was found is as large as was assumed. The gyros' biases may be larger.
    fn fits(&self, guess: &Guess) -> bool {
        let assumed = self.assumed();
        let pairs = guess.constants.iter().zip(&assumed.sigma).skip(ACCEL);
        pairs.fold(true, |all, (x, sigma)| all & (x.abs() <= ASSUMED * sigma))
    }

    /// Sensors and fixes contradict each other.
    fn refuse(&mut self) {
        let refused = self.refused.saturating_add(1);
        self.rolls = self.config.rolls && !self.rolls;
        self.gap();
        self.refused = refused;
    }
}

/// Gravity's reaction points up.
const UP: V = [0.0, 0.0, -1.0];

/// The shortest rotation that turns a unit vector up.
fn shortest(v: V) -> Q {
    if 1.0 + dot(v, UP) < 1e-3 {
        // nearly down: first half a turn about another axis
        let half = [0.0, 1.0, 0.0, 0.0];
        return product(from_above(rotated(half, v)), half);
    }
    from_above(v)
}

/// Rotation from a direction that is not down.
fn from_above(v: V) -> Q {
    let w = 1.0 + dot(v, UP);
    let [x, y, z] = cross(v, UP);
    let k = 1.0 / libm::sqrt(w * w + x * x + y * y + z * z);
    [w * k, x * k, y * k, z * k]
}
