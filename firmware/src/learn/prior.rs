//! Prior knowledge of the sensors: from the datasheet, the same for every unit.

mod reach;

pub use reach::{amplitudes, is_alive, spread};

use crate::inputs::{Inputs, REFERENCE_DEGC, Source};
use lrnn_nostd::learn::kalman::{AllWeights, ErrorModel, Maps, ParameterSet, Prior};
use lrnn_nostd::{Activation, Identity, Net, Normalisation, Rational, Real, Weights};

/// Navigation errors: attitude (rad), velocity (m/s), position (m), each north, east, down.
pub const NAV: usize = 9;

/// A network of the learner.
pub type LearnerNet<T> = Net<Rational, Identity, lrnn_nostd::Full, T>;

/// The sensors' errors to be expected by the datasheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Datasheet<T = f32> {
    /// Standard deviation of a gyro's bias, all its causes together, rad/s, > 0.
    pub gyro_bias: T,
    /// Standard deviation of an accelerometer's bias, m/s^2, > 0.
    pub accel_bias: T,
    /// Random walk of a bias in an hour, as a share of its standard deviation; gyros,
    /// accelerometers.
    pub walk_per_hour: [T; 2],
    /// Mean input of the accelerometers, m/s^2, the sensor's axes: gravity's reaction.
    pub gravity: [T; 3],
    /// Largest usual rate, rad/s, and largest usual change of specific force, m/s^2, > 0.
    pub range: [T; 2],
    /// Share of the bias that is new at every turn-on: standard deviation as a share of that of the
    /// bias; gyros, accelerometers; above 0, below 1. It is where the learner begins: it learns the
    /// scatter of its own unit.
    pub turn_on: [T; 2],
    /// Scale factor errors of gyros and accelerometers, as ratios, >= 0.
    pub scale: [T; 2],
    /// Misalignments of gyros and accelerometers, rad, >= 0.
    pub misalignment: [T; 2],
}

/// [`Datasheet::turn_on`] where the datasheet does not state it. Consumer units repeat to 0.01 to
/// 0.1 of their bias from session to session, mostly to 0.02, apart from steps.
pub const TURN_ON: [f32; 2] = [0.04, 0.1];

impl Datasheet<f32> {
    /// Sensors of these biases (rad/s, m/s^2) in a land vehicle.
    #[must_use]
    pub const fn land_vehicle(gyro_bias: f32, accel_bias: f32) -> Self {
        Self {
            gyro_bias,
            accel_bias,
            walk_per_hour: [0.05; 2],
            gravity: [0.0, 0.0, -9.8],
            range: [0.2, 2.0],
            turn_on: TURN_ON,
            scale: [0.0; 2],
            misalignment: [0.0; 2],
        }
    }

    /// Random walk of a gyro's bias, rad/s/sqrt(s).
    #[must_use]
    pub fn gyro_walk(&self) -> f32 {
        let [gyro, _] = self.walk_per_hour;
        self.gyro_bias * gyro / 60.0 // the root of an hour
    }

    /// This datasheet in another number type.
    #[must_use]
    pub fn cast<T: Real>(&self) -> Datasheet<T> {
        let to = |x: f32| T::from_f64(f64::from(x));
        Datasheet {
            gyro_bias: to(self.gyro_bias),
            accel_bias: to(self.accel_bias),
            walk_per_hour: self.walk_per_hour.map(to),
            gravity: self.gravity.map(to),
            range: self.range.map(to),
            turn_on: self.turn_on.map(to),
            scale: self.scale.map(to),
            misalignment: self.misalignment.map(to),
        }
    }
}

/// Time constants of the second layer's leaky units, s: their transient from power-on spans warm-up
/// curves.
const TIME_CONSTANTS_S: [f64; 3] = [150.0, 500.0, 1500.0];

/// First weights of layer 1, drawn once between -0.5 and 0.5 (W) and between -0.3 and 0.3 (b).
const W1: [[f64; 3]; 3] = [
    [0.31, -0.22, 0.44],
    [-0.41, 0.12, 0.27],
    [0.08, 0.47, -0.35],
];
const B1: [f64; 3] = [0.17, -0.08, -0.26];

/// Use of the input by the hidden layers of a hypothesis' networks.
#[derive(Clone, Copy, Debug)]
pub enum Layers<'n, T> {
    /// None: their slow units, started at power-on, measure the time since then. The standard
    /// deviations of their weights when their path may add 1 ([`weights`]).
    Time(&'n Weights<T>),
    /// Three functions of the inputs, which [`Inputs`] chooses: the networks, and what their units
    /// reach ([`amplitudes`]).
    Driven(&'n [LearnerNet<T>; 2], &'n [[f64; 3]; 2]),
}

/// First weights, and the standard deviation of each around them when its path may add `output`, in
/// units of the output scale.
///
/// The second layer's units are slow, `y(k) = tanh((1 - leak) y(k-1) + leak a)`. They follow `a`
/// within their time constant only while `a^2 << 3 leak`; otherwise the cubic term of tanh pulls
/// harder than the leak. So a slow unit works at a small amplitude, and the weights that read it
/// may be correspondingly larger. `block_s` is the time of a step.
#[must_use]
pub fn weights<T: Real>(block_s: f64, output: f64) -> [Weights<T>; 2] {
    let to = T::from_f64;
    let (mut first, mut sigma) = (Weights::zero(), Weights::zero());
    let [input, slow, _] = &mut first.layers;
    let [input_sigma, slow_sigma, top_sigma] = &mut sigma.layers;
    input.w = W1.map(|row| row.map(to));
    input.b = B1.map(to);
    input_sigma.w = [[to(0.3); 3]; 3];
    input_sigma.r = [[to(0.2); 3]; 3];
    input_sigma.b = [to(0.3); 3];
    for (i, time) in TIME_CONSTANTS_S.iter().enumerate() {
        let leak = block_s / time;
        let amplitude = 0.5 * Real::sqrt(leak);
        slow.r[i][i] = to(1.0 - leak);
        slow.b[i] = to(leak * amplitude);
        slow_sigma.w[i] = [to(leak * amplitude); 3];
        slow_sigma.r[i] = [to(0.1 * leak); 3];
        slow_sigma.b[i] = to(0.3 * leak * amplitude);
        for row in &mut top_sigma.w {
            row[i] = to(output / amplitude);
        }
    }
    [first, sigma]
}

/// First weight of a unit from its own input. An input of 1 in network units, the largest usual
/// one, is in the bend of the activation, so the units can learn curvature from data, and small
/// inputs pass in proportion.
const GAIN: f64 = 0.5;
/// Where an input is followed again, the later unit of the first layer has the first weight `gain`
/// and the bias `bend`. In the second layer it has the first weight `curve`, and the straight unit
/// takes away what is straight.
struct Bent {
    gain: f64,
    bend: f64,
    curve: f64,
}
/// What is left is 0.3 of the square of the input: with gain and bend as they are its cubic part is
/// none, and at an input of 2 it is a tenth less.
const SQUARE: Bent = Bent {
    gain: 0.6,
    bend: 0.33,
    curve: -3.5,
};
/// What is left is odd: 0.3 of the cube of a small input.
const CUBE: Bent = Bent {
    gain: 1.0,
    bend: 0.0,
    curve: -2.0,
};
/// The networks that the hypotheses driven by inputs begin with.
#[derive(Clone, Debug, PartialEq)]
pub struct Shapes<T: Real = f32> {
    /// Each unit follows an input of its own.
    pub driven: [LearnerNet<T>; 2],
    /// As `driven`, but instead of the last input that is not of the thermometer there is the
    /// square of the temperature.
    pub curved: [LearnerNet<T>; 2],
    /// Reach of the units of both ([`amplitudes`]): see [`Shapes::reach`].
    reaches: [[[f64; 3]; 2]; 2],
}

impl<T: Real> Shapes<T> {
    /// Before the learner has begun.
    pub const NONE: Self = {
        let net = Net::new(Weights::zero(), Normalisation::identity());
        Self {
            driven: [net; 2],
            curved: [net; 2],
            reaches: [[[0.0; 3]; 2]; 2],
        }
    };

    /// Parts of [`Shapes::reach`].
    pub const REACHES: usize = 4;

    /// Computes the reach of all units.
    #[must_use]
    pub fn complete(mut self) -> Self {
        (0..Self::REACHES).for_each(|part| self.reach(part));
        self
    }

    /// Finds what the units of one network reach, some ten thousand instructions. To be called for
    /// all of [`Shapes::REACHES`].
    pub fn reach(&mut self, part: usize) {
        let nets = self.driven.iter().chain(&self.curved);
        let reaches = self.reaches.as_flattened_mut().iter_mut();
        if let Some((net, reach)) = nets.zip(reaches).nth(part) {
            *reach = amplitudes(net);
        }
    }

    /// Reach of the units of `driven` and of `curved`.
    #[must_use]
    pub fn reaches(&self) -> &[[[f64; 3]; 2]; 2] {
        &self.reaches
    }

    /// The built-in shapes for these inputs, or the shape of a type of sensor, if `given` has one:
    /// hidden layers that are alive. Then both are `given`. Networks that were learnt with one of
    /// the built-in shapes stay, and so do the scales of any that are alive.
    #[must_use]
    pub fn new(given: &[LearnerNet<T>; 2], sheet: &Datasheet<T>, inputs: &Inputs) -> Self {
        let mut all = Self::NONE;
        let scales = sheet.driven_normalisation(inputs);
        let given = given.iter().zip(scales).zip(inputs);
        for (((net, scales), which), (driven, curved)) in
            given.zip(all.driven.iter_mut().zip(&mut all.curved))
        {
            let is_given = is_alive(&net.weights) && net.weights.is_finite();
            let scales = if is_given { net.normalisation } else { scales };
            *driven = Net::new(wired(columns(which)), scales);
            *curved = Net::new(wired(curved_columns(which)), scales);
            if is_given {
                let (own, bent) = (same_hidden(net, driven), same_hidden(net, curved));
                if own || !bent {
                    *driven = *net;
                }
                if bent || !own {
                    *curved = *net;
                }
            }
        }
        all
    }

    /// Networks with this output and nothing else, in units of the output scale of `driven`.
    #[must_use]
    pub fn constant(&self, output: &[[T; 3]; 2]) -> [LearnerNet<T>; 2] {
        let mut nets = self.driven;
        for (net, output) in nets.iter_mut().zip(output) {
            net.weights = Weights::zero();
            let [_, _, top] = &mut net.weights.layers;
            top.b = *output;
        }
        nets
    }

    /// The networks of gyros and accelerometers, first the driven ones, then the curved ones.
    pub fn iter(&self) -> impl Iterator<Item = &LearnerNet<T>> {
        self.driven.iter().chain(&self.curved)
    }
}

fn same_hidden<T: Real>(one: &LearnerNet<T>, other: &LearnerNet<T>) -> bool {
    let [a, b, _] = &one.weights.layers;
    let [c, d, _] = &other.weights.layers;
    a == c && b == d
}

/// The input that each unit of the second layer follows: its own, or the first that is the same.
fn columns(which: &[Source; 3]) -> [usize; 3] {
    core::array::from_fn(|i| {
        let first = which.iter().position(|one| which.get(i) == Some(one));
        first.unwrap_or(i)
    })
}

/// [`columns`] where the temperature is followed once more instead of an input that is not of the
/// thermometer, if there are both.
fn curved_columns(which: &[Source; 3]) -> [usize; 3] {
    let mut columns = columns(which);
    let temperature = which.iter().position(|one| *one == Source::Temperature);
    let other = which.iter().rposition(|one| !one.needs_thermometer());
    if let (Some(temperature), Some(other)) = (temperature, other)
        && let Some(column) = columns.get_mut(other)
    {
        *column = temperature;
    }
    columns
}

/// First weights of networks whose second layer's units follow these inputs, so the gradient by
/// each of them is non-zero as soon as the output layer is. The same input once more gives its
/// square; a third time its cube.
#[must_use]
fn wired<T: Real>(columns: [usize; 3]) -> Weights<T> {
    let to = T::from_f64;
    let mut first = Weights::zero();
    let [input, middle, _] = &mut first.layers;
    for (i, column) in columns.into_iter().enumerate() {
        let mut before = columns.iter().take(i);
        let straight = before.position(|one| *one == column);
        let Bent { gain, bend, curve } = if before.any(|one| *one == column) {
            CUBE
        } else {
            SQUARE
        };
        let at = Rational::apply(to(bend));
        let from = input.w.get_mut(i).and_then(|row| row.get_mut(column));
        let (Some(from), Some(into)) = (from, middle.w.get_mut(i)) else {
            continue;
        };
        match straight.and_then(|unit| into.get_mut(unit)) {
            None => {
                *from = to(GAIN);
                into[i] = T::ONE;
            }
            Some(less) => {
                *from = to(gain);
                *less = to(-curve * gain / GAIN) * Rational::slope(at);
                into[i] = to(curve);
                input.b[i] = to(bend);
                middle.b[i] = to(-curve) * at;
            }
        }
    }
    first
}

impl<T: Real> Datasheet<T> {
    /// Scales of the two networks: output in units of the bias.
    #[must_use]
    pub fn normalisation(&self) -> [Normalisation<T>; 2] {
        let [rate, force] = self.range.map(|range| [T::ONE / range; 3]);
        [
            Normalisation {
                input_offset: [T::ZERO; 3],
                input_scale: rate,
                output_scale: [self.gyro_bias; 3],
            },
            Normalisation {
                input_offset: self.gravity,
                input_scale: force,
                output_scale: [self.accel_bias; 3],
            },
        ]
    }

    /// Normalisation of networks that are driven by these inputs: each is near 1 at the most that
    /// is usual.
    #[must_use]
    pub fn driven_normalisation(&self, inputs: &Inputs) -> [Normalisation<T>; 2] {
        let (to, [rate, force]) = (T::from_f64, self.range.map(|range| T::ONE / range));
        let [x, y, z] = self.gravity;
        let of = |source: Source| match source {
            Source::RateX | Source::RateY | Source::RateZ | Source::RateMagnitude => {
                (T::ZERO, rate)
            }
            Source::ForceX => (x, force),
            Source::ForceY => (y, force),
            Source::ForceZ => (z, force),
            Source::Temperature => (to(f64::from(REFERENCE_DEGC)), to(1.0 / SPAN_K)),
            Source::TemperatureRate => (T::ZERO, to(1.0 / SPAN_KPS)),
            Source::Vibration => (T::ZERO, to(1.0 / VIBRATION)),
        };
        let mut out = self.normalisation();
        for (scales, which) in out.iter_mut().zip(inputs) {
            scales.input_offset = which.map(|source| of(source).0);
            scales.input_scale = which.map(|source| of(source).1);
        }
        out
    }

    /// Networks before any learning: their output is zero.
    #[must_use]
    pub fn nets(&self, block_s: f64) -> [LearnerNet<T>; 2] {
        let [first, _] = weights(block_s, 0.0);
        self.normalisation().map(|scales| Net::new(first, scales))
    }

    /// The prior of a hypothesis whose networks may add `output` times the bias. `error_sigma` as
    /// in [`Prior`]. Where biases of the unit are learnt beside those of the turn-on, both together
    /// are the datasheet's.
    #[must_use]
    pub fn prior<L: ParameterSet, const N: usize>(
        &self,
        layers: Layers<'_, T>,
        output: f64,
        error_sigma: [T; NAV],
        error_floor: [T; NAV],
    ) -> Prior<NAV, N, T> {
        let mut bias = [self.gyro_bias, self.accel_bias];
        let mut walk = [T::ZERO; 2];
        for ((walk, bias), in_hour) in walk.iter_mut().zip(bias).zip(self.walk_per_hour) {
            *walk = bias * (in_hour * T::from_f64(1.0 / 60.0));
        }
        let [g, a] = walk;
        let mut of_time = Weights::zero();
        if let Layers::Time(at_one) = layers {
            of_time = *at_one;
            let [_, _, top] = &mut of_time.layers;
            let output = T::from_f64(output);
            top.w = top.w.map(|row| row.map(|w| w * output));
        }
        let mut sigma = [of_time; 2];
        let triads = sigma.iter_mut().zip(&mut bias).zip(self.turn_on);
        for (k, ((sigma, bias), new)) in triads.enumerate() {
            let mut of_unit = 0.0;
            if L::OUTPUT_BIAS.is_some() {
                *bias *= new;
                of_unit = libm::sqrt(1.0 - new.to_f64() * new.to_f64());
            }
            if let Layers::Driven(nets, reach) = layers {
                *sigma = spread(&nets[k], &reach[k], output, of_unit);
            }
        }
        let bias = bias.map(|bias| [bias; 3]);
        Prior {
            error_sigma,
            parameter_sigma: ErrorModel::<L, N, Rational, T>::sigmas(bias, &self.maps(), &sigma),
            walk: [g, g, g, a, a, a],
            error_floor,
            parameter_floor: T::from_f64(FLOOR),
        }
    }
}

impl<T: Real> Datasheet<T> {
    /// Standard deviations of the elements of both maps.
    fn maps(&self) -> Maps<T> {
        let least = T::from_f64(LEAST_MAP);
        let at_least = |sigma: T| if sigma > least { sigma } else { least };
        core::array::from_fn(|k| {
            let (scale, misalignment) = (at_least(self.scale[k]), at_least(self.misalignment[k]));
            core::array::from_fn(|i| {
                core::array::from_fn(|j| if i == j { scale } else { misalignment })
            })
        })
    }
}

/// Standard deviation of an element of a map at least: far below what any sensor has.
const LEAST_MAP: f64 = 1e-8;

/// Deviation from [`REFERENCE_DEGC`], K, rate, K/s, and vibration, (m/s2)^2, that are 1 in network
/// units: a unit in a vehicle (assumed).
const SPAN_K: f64 = 30.0;
const SPAN_KPS: f64 = 1.0 / 60.0;
const VIBRATION: f64 = 1.0;

/// The standard deviation of a parameter never falls below this share of its prior (assumed; far
/// below what any drive reaches).
const FLOOR: f64 = 1e-4;

/// All weights together.
pub type All<T> = lrnn_nostd::learn::kalman::Kalman<AllWeights, NAV, 132, 8778, Rational, T>;

#[cfg(test)]
mod tests;
