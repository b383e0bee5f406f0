//! The pieces of work of learning from fixes, measured in the same way as those of the networks.

use core::hint::black_box;

use firmware::fix::{Fix, OBSERVATIONS};
use firmware::inputs::OWN;
use firmware::learn::bank::{Bank, Gates, Scratch};
use firmware::learn::prior::{All, Layers, NAV, Shapes, amplitudes};
use firmware::learn::rehearsal::{Bets, Coast, FixError};
use firmware::learn::{Antenna, Settings};
use firmware::nav::Navigator;
use lrnn_nostd::Rational;
use lrnn_nostd::learn::kalman::{
    AllWeights, Correction, Kalman, OUTPUTS, ParameterSet, Prior, Transition,
};

use crate::navigation::{RATE, navigator, sample};
use crate::work::WorkResult;

/// A step of both networks of the largest hypothesis, with their exact gradients and the rows of
/// the Jacobian: 126 weights and 6 biases.
#[derive(Clone, Debug)]
pub struct LearnerStepWork(All<f32>);

/// A fix of a hypothesis with N parameters: the covariance over a second, and six scalar updates.
#[derive(Clone, Debug)]
pub struct FixWork<L: ParameterSet, const N: usize, const PACKED: usize> {
    filter: Kalman<L, NAV, N, PACKED, Rational>,
    block: Transition<NAV>,
}

/// [`FixWork`] of the largest hypothesis.
pub type LearnerFixWork = FixWork<AllWeights, 132, 8778>;

/// A second of all hypotheses: covariances, fix, step of the networks.
#[derive(Clone, Debug)]
pub struct LearnerSecondWork {
    bank: Bank,
    scratch: Scratch,
}

/// A second of K more coasts of the rehearsals, each of eight shadow navigators: their start from
/// the hypotheses' estimates, their propagation over the second, their end at a fix with scores and
/// bets. A coast lasts for 5 to 300 s and starts and ends only once in them.
#[derive(Clone, Debug)]
pub struct ShadowSecondWork<const K: usize> {
    bank: Bank,
    coasts: [Coast; K],
    bets: Bets,
    block: Transition<NAV>,
}

/// A second and a fix of the filter of lever arm and delay, and the navigator's innovation at the
/// fix.
#[derive(Clone, Debug)]
pub struct AntennaSecondWork {
    antenna: Antenna,
    navigator: Navigator,
    block: Transition<NAV>,
}

const ERROR_SIGMA: [f32; NAV] = [1e-4, 1e-4, 1e-3, 0.05, 0.05, 0.05, 1.0, 1.0, 1.0];
const VARIANCE: [f32; OBSERVATIONS] = [1.0, 1.0, 2.25, 2.5e-3, 2.5e-3, 2.5e-3];

/// The transition of a second at rest, level. The optimiser does not see that most of it is 0.
fn second() -> Transition<NAV> {
    let unit = |i: usize, j: usize| f32::from(u8::from(i == j));
    let mut block = Transition::ZEROED;
    block.phi = core::array::from_fn(|i| core::array::from_fn(|j| unit(i, j)));
    block.time = 1.0;
    let [_, _, _, north, east, _, p_north, p_east, p_down] = &mut block.phi;
    (north[1], east[0]) = (9.8, -9.8);
    (p_north[3], p_east[4], p_down[5]) = (1.0, 1.0, 1.0);
    for (i, row) in block.gamma.iter_mut().enumerate() {
        match i {
            0..3 => row[i] = 1.0,
            3..6 => row[i] = -1.0,
            _ => row[i - 3] = -0.5,
        }
    }
    for (i, row) in block.q.iter_mut().enumerate() {
        row[i] = match i {
            0..3 => 2e-12,
            3..6 => 4e-8,
            _ => 1e-8,
        };
    }
    black_box(block)
}

fn inputs([x, y, z]: [f32; 3]) -> [[f32; 3]; 2] {
    [[x * 1e-3, y * 1e-3, z * 1e-3], [x * 0.01, y * 0.01, -9.8]]
}

/// Networks of the built-in shape, driven by their own triads.
fn shapes() -> Shapes {
    let sheet = Settings::MEDIUM.sheet;
    Shapes::new(&sheet.nets(1.0), &sheet, &OWN).complete()
}

fn prior<L: ParameterSet, const N: usize>() -> Prior<NAV, N> {
    let sheet = Settings::MEDIUM.sheet;
    let nets = shapes().driven;
    let reach = nets.each_ref().map(amplitudes);
    sheet.prior::<L, N>(Layers::Driven(&nets, &reach), 0.1, ERROR_SIGMA, [1e-7; NAV])
}

impl LearnerStepWork {
    /// All zeros, to be initialised in place, because it is too large to move.
    pub const ZEROED: Self = Self(All::ZEROED);

    /// Initialises at rest.
    pub fn begin(&mut self) {
        let prior = prior::<AllWeights, 132>();
        self.0.init(&shapes().driven, &prior);
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.0.step(inputs(input));
        let [x, y, z, ..] = *self.0.model().estimate();
        ([x, y, z], self.0.model().is_healthy())
    }
}

impl<L: ParameterSet, const N: usize, const PACKED: usize> FixWork<L, N, PACKED> {
    /// All zeros, to be initialised in place, because it is too large to move.
    pub const ZEROED: Self = Self {
        filter: Kalman::ZEROED,
        block: Transition::ZEROED,
    };

    /// Initialises at rest, with one step of the networks.
    pub fn begin(&mut self) {
        let prior = prior::<L, N>();
        self.filter.init(&shapes().driven, &prior);
        self.filter.step(inputs([1.0, -1.0, 0.5]));
        self.block = second();
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.filter.propagate(&self.block, &Correction::NONE);
        for (k, variance) in VARIANCE.into_iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            let innovation = self.filter.innovation(i, input[k % 3] * 1e-3, variance);
            self.filter.score(innovation, 25.0);
            self.filter.update(i, innovation);
        }
        self.filter.finish_update();
        let [x, y, z, ..] = *self.filter.error_state();
        ([x, y, z], self.filter.is_healthy())
    }
}

impl LearnerSecondWork {
    /// All zeros, to be initialised in place, because it is too large to move.
    pub const ZEROED: Self = Self {
        bank: Bank::ZEROED,
        scratch: Scratch::ZEROED,
    };

    /// Initialises at rest.
    pub fn begin(&mut self) {
        let sheet = Settings::MEDIUM.sheet;
        let of = (&sheet, &OWN);
        self.bank
            .begin(of, &shapes(), 1.0, ERROR_SIGMA, Gates::USUAL);
        self.scratch.block = second();
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.bank
            .propagate_mean(&self.scratch.block, &Correction::NONE);
        self.bank.propagate_covariance(&mut self.scratch);
        let [x, y, z] = input.map(|x| x * 1e-3);
        let refused = self.bank.fix(&[x, y, z, x, y, z], &VARIANCE, true);
        self.bank.step(inputs(input));
        let [x, y, z, ..] = *self.bank.estimate_of(5);
        let good = (0..6).all(|h| self.bank.is_healthy(h)) && refused == 0;
        ([x, y, z], good)
    }
}

impl<const K: usize> ShadowSecondWork<K> {
    /// All zeros, to be initialised in place, because it is too large to move.
    pub const ZEROED: Self = Self {
        bank: Bank::ZEROED,
        coasts: [Coast::NONE; K],
        bets: Bets::ZEROED,
        block: Transition::ZEROED,
    };

    /// Initialises at rest.
    pub fn begin(&mut self) {
        let sheet = Settings::MEDIUM.sheet;
        let of = (&sheet, &OWN);
        self.bank
            .begin(of, &shapes(), 1.0, ERROR_SIGMA, Gates::USUAL);
        self.block = second();
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        let [x, y, _] = input;
        let error = FixError {
            first: 6,
            off: [x, y],
            sigma: 1.0,
        };
        let mut good = true;
        self.bets.passes(1.0);
        for coast in &mut self.coasts {
            coast.start(&self.bank);
            let applied = Correction {
                estimate: [x * 1e-6; OUTPUTS],
                maps: [[[x * 1e-3; 3]; 3]; 2],
            };
            coast.moves(&self.block, &applied);
            let scores = coast.ends(&error, 1.0);
            coast.feed_back(&[y * 1e-3; NAV]);
            good &= scores.is_some();
            if let Some(scores) = scores {
                self.bets.takes(&scores, 1.0);
            }
        }
        (input, good)
    }
}

impl AntennaSecondWork {
    /// Never `None`: the configuration is valid.
    pub fn new() -> Option<Self> {
        let settings = Settings {
            lever_arm_sigma: 1.0,
            fix_age_sigma: 0.1,
            ..Settings::MEDIUM
        };
        let mut antenna = Antenna::ZEROED;
        antenna.begin(&settings, 1.0);
        let mut rest = [[0.0; NAV]; NAV];
        for (i, (row, sigma)) in rest.iter_mut().zip(ERROR_SIGMA).enumerate() {
            row[i] = sigma * sigma;
        }
        let by = [[0.0; OUTPUTS]; NAV];
        antenna.navigates(&by, &rest, &[0.0; OUTPUTS], None);
        let mut navigator = navigator(RATE, None)?;
        (0..RATE).for_each(|_| navigator.sample(&sample([1.0, -2.0, 3.0], RATE)));
        Some(Self {
            antenna,
            navigator,
            block: second(),
        })
    }

    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.antenna.interval(&self.block, &Correction::NONE);
        let fix = Fix {
            position: self.navigator.state().position,
            velocity: input.map(|x| f64::from(x * 1e-3)),
            ..Fix::EMPTY
        };
        let sigma = self.antenna.age_sigma();
        let innovation = self
            .navigator
            .antenna_innovation(&fix, self.antenna.age(), sigma);
        self.antenna.fix(&innovation, &VARIANCE);
        let good = self.antenna.update(&self.block).is_some();
        self.antenna.feed_back(&[0.0; NAV]);
        (self.antenna.arm(), good && self.antenna.estimates())
    }
}
