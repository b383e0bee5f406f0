//! What is known of the sensors before any learning: from the datasheet, the same for every unit.

use lrnn_nostd::learn::kalman::{AllWeights, ErrorModel, ParameterSet, Prior};
use lrnn_nostd::{Identity, Net, Normalisation, Rational, Real, Weights};

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
}

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
        }
    }

    /// The same in another number type.
    #[must_use]
    pub fn cast<T: Real>(&self) -> Datasheet<T> {
        let to = |x: f32| T::from_f64(f64::from(x));
        Datasheet {
            gyro_bias: to(self.gyro_bias),
            accel_bias: to(self.accel_bias),
            walk_per_hour: self.walk_per_hour.map(to),
            gravity: self.gravity.map(to),
            range: self.range.map(to),
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

    /// Networks before any learning: their output is zero.
    #[must_use]
    pub fn nets(&self, block_s: f64) -> [LearnerNet<T>; 2] {
        let [first, _] = weights(block_s, 0.0);
        self.normalisation().map(|scales| Net::new(first, scales))
    }

    /// The prior of a hypothesis whose networks may add `output` times the bias. `error_sigma` as
    /// in [`Prior`].
    #[must_use]
    pub fn prior<L: ParameterSet, const N: usize>(
        &self,
        block_s: f64,
        output: f64,
        error_sigma: [T; NAV],
        error_floor: [T; NAV],
    ) -> Prior<NAV, N, T> {
        let [_, sigma] = weights(block_s, output);
        let bias = [self.gyro_bias, self.accel_bias];
        let mut walk = bias.map(|sigma| [sigma; 3]);
        for (triad, in_hour) in walk.iter_mut().zip(self.walk_per_hour) {
            let share = in_hour * T::from_f64(1.0 / 60.0);
            *triad = triad.map(|sigma| sigma * share);
        }
        Prior {
            error_sigma,
            parameter_sigma: ErrorModel::<L, N, Rational, T>::sigmas(bias.map(|b| [b; 3]), &sigma),
            walk: ErrorModel::<L, N, Rational, T>::sigmas(walk, &Weights::zero()),
            error_floor,
            parameter_floor: T::from_f64(FLOOR),
        }
    }
}

/// The standard deviation of a parameter never falls below this share of its prior (assumed; far
/// below what any drive reaches).
const FLOOR: f64 = 1e-4;

/// All weights together.
pub type All<T> = lrnn_nostd::learn::kalman::Kalman<AllWeights, NAV, 132, 8778, Rational, T>;
