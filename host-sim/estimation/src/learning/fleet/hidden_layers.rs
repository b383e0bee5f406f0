//! The common shape of all units of a type: the two hidden layers of a network, in standard
//! deviations from a start.
//!
//! The features of a drive are the outputs `y_2` of the second layer, step by step, as
//! [`lrnn_nostd::Net`] computes them. The contribution of a feature to the error is a weight of
//! the output layer, which belongs to the unit.

use lrnn_nostd::{Full, Identity, Layer, NEURONS, Net, Normalisation, Rational, State, Weights};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Number of parameters of the two hidden layers.
pub const HIDDEN: usize = 42;
/// Time constants of slow units in the starts, s: from minutes to that of a potted coil.
const SLOW_S: [[f64; 3]; 2] = [[150.0, 500.0, 1500.0], [0.0, 300.0, 1200.0]];

/// Time constants of an inner location whose temperature follows the thermometer, s.
const INNER_S: [f64; 2] = [400.0, 1200.0];
/// Number of starts that are not random.
pub const STARTS: usize = 6;

/// Inputs or features of one second.
pub type Three = [f64; NEURONS];

/// A network of the fit.
type Exact = Net<Rational, Identity, Full, f64>;

/// Two hidden layers about a start.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenLayers {
    start: [f64; HIDDEN],
    sigma: [f64; HIDDEN],
    /// Whether it starts in the steady state of its first input.
    settles: bool,
    /// Standard deviations from the start.
    pub z: [f64; HIDDEN],
}

impl HiddenLayers {
    /// A start: its layers, and the standard deviation of each weight.
    fn about([first, second]: [Layer<f64>; 2], [far, farther]: [Layer<f64>; 2]) -> Self {
        let flat = |one, two| {
            let all = Weights {
                layers: [one, two, Weights::zero().layers[2]],
            };
            let mut out = [0.0; HIDDEN];
            out.iter_mut().zip(all.iter()).for_each(|(o, x)| *o = x);
            out
        };
        Self {
            start: flat(first, second),
            sigma: flat(far, farther),
            settles: false,
            z: [0.0; HIDDEN],
        }
    }

    /// The hidden layers.
    pub fn layers(&self) -> [Layer<f64>; 2] {
        let [first, second, _] = self.weights().layers;
        [first, second]
    }

    fn weights(&self) -> Weights<f64> {
        let value = |i: usize| match (self.start.get(i), self.sigma.get(i), self.z.get(i)) {
            (Some(start), Some(sigma), Some(z)) => start + sigma * z,
            _ => 0.0,
        };
        Weights::from_fn(value)
    }

    /// The features at the start of each second. If the feedback overflows they keep their values.
    pub fn features(&self, inputs: &[Three]) -> Vec<Three> {
        let net = Exact::new(self.weights(), Normalisation::identity());
        let mut state = State::new();
        if let (true, Some(first)) = (self.settles, inputs.first()) {
            net.settle(&mut state, *first);
        }
        let second = |state: &State<f64>| state.layers()[1];
        let mut out = Vec::with_capacity(inputs.len() + 1);
        out.push(second(&state));
        for input in inputs {
            let _ = net.step(&mut state, *input);
            out.push(second(&state));
        }
        out
    }

    /// The starts of a fit: `further` of them are drawn at random about the others. `settles`: they
    /// begin in their steady state.
    pub fn starts(further: usize, settles: bool) -> Vec<Self> {
        let mut out = vec![
            fast(),
            kinks(),
            slow(SLOW_S[0]),
            slow(SLOW_S[1]),
            inner(INNER_S[0]),
            inner(INNER_S[1]),
        ];
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for k in 0..further {
            let mut next = out[k % STARTS].clone();
            for (start, sigma) in next.start.iter_mut().zip(&next.sigma) {
                let z: f64 = StandardNormal.sample(&mut rng);
                *start += sigma * z;
            }
            out.push(next);
        }
        out.iter_mut().for_each(|shape| shape.settles = settles);
        out
    }
}

/// A matrix with this diagonal.
fn diagonal(d: Three) -> [[f64; NEURONS]; NEURONS] {
    let mut out = [[0.0; NEURONS]; NEURONS];
    for (i, (row, value)) in out.iter_mut().zip(d).enumerate() {
        row[i] = value;
    }
    out
}

fn layer(w: [[f64; 3]; 3], r: [[f64; 3]; 3], b: Three) -> Layer<f64> {
    Layer { w, r, b }
}

/// A start that is nearly linear, without memory.
fn fast() -> HiddenLayers {
    HiddenLayers::about(
        [
            layer(diagonal([0.5; 3]), diagonal([0.0; 3]), [0.0; 3]),
            layer(diagonal([1.0; 3]), diagonal([0.0; 3]), [0.0; 3]),
        ],
        [
            layer([[0.5; 3]; 3], [[0.2; 3]; 3], [0.5; 3]),
            layer([[0.5; 3]; 3], [[0.2; 3]; 3], [0.5; 3]),
        ],
    )
}

/// A start with kinks at two values of the first input, beside the second and third input.
fn kinks() -> HiddenLayers {
    let w = [[1.5, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 0.5, 0.5]];
    HiddenLayers::about(
        [
            layer(w, diagonal([0.0; 3]), [-1.0, 1.0, 0.0]),
            layer(diagonal([1.0; 3]), diagonal([0.0; 3]), [0.0; 3]),
        ],
        [
            layer([[1.0; 3]; 3], [[0.2; 3]; 3], [1.0; 3]),
            layer([[0.5; 3]; 3], [[0.2; 3]; 3], [0.5; 3]),
        ],
    )
}

/// Units of the second layer that follow the first input with these time constants, s; 0: the
/// third and second input without delay. A slow unit works at the small amplitude at which its leak
/// outweighs the cubic term of tanh (`firmware::learn::prior`).
fn slow(times: Three) -> HiddenLayers {
    let mut second = layer([[0.0; 3]; 3], diagonal([0.0; 3]), [0.0; 3]);
    let mut far = layer([[0.5; 3]; 3], [[0.0; 3]; 3], [0.5; 3]);
    for (i, time) in times.into_iter().enumerate() {
        if time == 0.0 {
            second.w[i] = [0.5, 0.0, 1.0];
            far.r[i][i] = 0.2;
            continue;
        }
        let leak = 1.0 / time;
        let gain = leak * leak.sqrt();
        second.w[i][0] = gain;
        second.r[i][i] = 1.0 - leak;
        far.w[i] = [gain; 3];
        far.r[i] = [0.3 * leak; 3];
        far.b[i] = 0.3 * gain;
    }
    HiddenLayers::about(
        [
            layer(diagonal([0.5; 3]), diagonal([0.0; 3]), [0.0; 3]),
            second,
        ],
        [layer([[0.5; 3]; 3], [[0.2; 3]; 3], [0.5; 3]), far],
    )
}

/// A unit of the first layer follows the first input with this time constant, s, as an inner
/// location follows a thermometer. The second layer has a linear function of it, and a nonlinear
/// one. The third function is one of the inputs without delay.
fn inner(time: f64) -> HiddenLayers {
    const AMPLITUDE: f64 = 0.01;
    let leak = 1.0 / time;
    let w = [
        [leak * AMPLITUDE, 0.0, 0.0],
        [0.5, 0.0, 0.0],
        [0.0, 0.5, 0.5],
    ];
    let r = diagonal([1.0 - leak, 0.0, 0.0]);
    let gain = 0.5 / AMPLITUDE;
    let second = [[gain, 0.0, 0.0], [2.0 * gain, 0.0, 0.0], [0.0, 0.5, 1.0]];
    let own = leak * AMPLITUDE;
    HiddenLayers::about(
        [
            layer(w, r, [0.0; 3]),
            layer(second, diagonal([0.0; 3]), [0.0, 0.8, 0.0]),
        ],
        [
            layer(
                [[own; 3], [0.5; 3], [0.5; 3]],
                diagonal([0.3 * leak, 0.2, 0.2]),
                [0.3 * own, 0.5, 0.5],
            ),
            layer(
                [[gain, 0.5, 0.5], [gain, 0.5, 0.5], [gain, 0.5, 0.5]],
                [[0.2; 3]; 3],
                [0.5; 3],
            ),
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The features are those of the network itself: with the identity as output layer its output
    /// is the feature, one step later.
    #[test]
    fn features_are_what_the_network_computes() {
        for shape in HiddenLayers::starts(STARTS, false) {
            let mut weights = shape.weights();
            weights.layers[2].w = diagonal([1.0; 3]);
            let net = Exact::new(weights, Normalisation::identity());
            let inputs: Vec<Three> = (0..50)
                .map(|k| [0.02 * f64::from(k), (f64::from(k) * 0.3).sin(), 0.5])
                .collect();
            let features = shape.features(&inputs);
            let mut state = State::new();
            assert_eq!(features.len(), inputs.len() + 1);
            assert_eq!(features[0], [0.0; 3]);
            for (input, feature) in inputs.iter().zip(&features[1..]) {
                assert_eq!(net.step(&mut state, *input).output, *feature);
            }
        }
    }

    /// From every start each input reaches a feature: no start is dead.
    #[test]
    fn every_input_reaches_the_features() {
        for (number, shape) in HiddenLayers::starts(STARTS, false).iter().enumerate() {
            let last = |input: usize| {
                let one = |x: f64| {
                    let mut u = [0.1; 3];
                    u[input] = x;
                    shape.features(&[u; 200]).last().copied().unwrap()
                };
                let [a, b] = [0.1, 0.3].map(one);
                a.iter()
                    .zip(b)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max)
            };
            let reached = (0..3).filter(|&input| last(input) > 1e-5).count();
            assert!(reached >= 1, "start {number}");
            let all: f64 = shape.sigma.iter().sum();
            assert!(all > 0.0);
        }
    }

    #[test]
    fn slow_units_follow_within_their_time() {
        let shape = slow([150.0, 500.0, 1500.0]);
        let features = shape.features(&[[1.0, 0.0, 0.0]; 6000]);
        let end = features.last().unwrap();
        for (i, time) in [150, 500, 1500].into_iter().enumerate() {
            let share = features[time][i] / end[i];
            assert!((0.55..0.75).contains(&share), "{time} s: {share}");
        }
    }
}
