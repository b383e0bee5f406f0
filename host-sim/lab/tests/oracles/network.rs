//! A second, plain implementation of the network and its gradient in f64, to check `lrnn-nostd`.
//!
//! It shares no code and no method with `lrnn-nostd`. The network is evaluated on dual numbers (a
//! value and its 63 partial derivatives), which gives the gradient. So there is no recursion for
//! sensitivities that could contain the same mistake.

use std::ops::{Add, Mul};

/// Parameters of a network, in the order layer by layer: W row by row, R row by row, b.
pub const PARAMETERS: usize = 63;
const PER_LAYER: usize = 21;

/// A value and its derivatives by all parameters.
#[derive(Debug, Clone, Copy)]
pub struct Dual {
    /// Value.
    pub value: f64,
    /// Partial derivatives.
    pub d: [f64; PARAMETERS],
}

impl Dual {
    /// A constant.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self {
            value,
            d: [0.0; PARAMETERS],
        }
    }

    fn parameter(value: f64, index: usize) -> Self {
        let mut out = Self::constant(value);
        out.d[index] = 1.0;
        out
    }

    fn tanh(self) -> Self {
        let y = self.value.tanh();
        let slope = 1.0 / self.value.cosh().powi(2);
        Self {
            value: y,
            d: self.d.map(|d| slope * d),
        }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            d: std::array::from_fn(|i| self.d[i] + other.d[i]),
        }
    }
}

impl Mul for Dual {
    type Output = Self;
    #[expect(
        clippy::suspicious_arithmetic_impl,
        reason = "the product rule is a sum"
    )]
    fn mul(self, other: Self) -> Self {
        let d = std::array::from_fn(|i| self.d[i] * other.value + self.value * other.d[i]);
        Self {
            value: self.value * other.value,
            d,
        }
    }
}

/// The network with tanh in the hidden layers and identity at the output.
#[derive(Debug, Clone)]
pub struct Network {
    theta: Vec<Dual>,
    y: [[Dual; 3]; 3],
}

impl Network {
    /// Parameters in order; the state is zero.
    #[must_use]
    pub fn new(theta: &[f64; PARAMETERS]) -> Self {
        let theta = theta
            .iter()
            .enumerate()
            .map(|(i, v)| Dual::parameter(*v, i))
            .collect();
        Self {
            theta,
            y: [[Dual::constant(0.0); 3]; 3],
        }
    }

    /// One step (eq. 1, 2): output with its gradient. `u` is the normalised input.
    pub fn step(&mut self, u: [f64; 3]) -> [Dual; 3] {
        let mut below = u.map(Dual::constant);
        for l in 0..3 {
            let at = |k: usize| self.theta[PER_LAYER * l + k];
            let last = self.y[l];
            let x: [Dual; 3] = std::array::from_fn(|p| {
                let feed = (0..3).map(|q| at(3 * p + q) * below[q]);
                let back = (0..3).map(|q| at(9 + 3 * p + q) * last[q]);
                feed.chain(back).fold(at(18 + p), |sum, term| sum + term)
            });
            self.y[l] = if l < 2 { x.map(Dual::tanh) } else { x };
            below = self.y[l];
        }
        below
    }
}

mod tests {
    // matrix elements are written with their indices, as in the equations
    #![allow(clippy::needless_range_loop)]
    use super::*;
    use lrnn_nostd::{Full, Identity, Net, Normalisation, Sensitivities, State, Tanh, Weights};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn inputs(k: usize) -> [f64; 3] {
        let t = k as f64;
        [
            (0.31 * t).sin(),
            0.5 * (0.17 * t).cos(),
            0.8 * (0.05 * t + 1.0).sin(),
        ]
    }

    #[test]
    fn kernel_and_oracle_agree_in_f64() {
        for seed in 0..5 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let theta: [f64; PARAMETERS] = std::array::from_fn(|_| rng.random_range(-0.7..0.7));
            let weights = Weights::from_array(&theta);
            let net = Net::<Tanh, Identity, Full, f64>::new(weights, Normalisation::identity());
            let (mut state, mut sens, mut oracle) =
                (State::new(), Sensitivities::new(), Network::new(&theta));
            for k in 0..400 {
                let got = net.step_gradient(&mut state, &mut sens, inputs(k));
                let want = oracle.step(inputs(k));
                for j in 0..3 {
                    assert!(
                        (got.output[j] - want[j].value).abs() < 1e-12,
                        "net {seed} step {k}"
                    );
                    for i in 0..PARAMETERS {
                        let (a, b) = (sens.output()[j][i], want[j].d[i]);
                        assert!(
                            (a - b).abs() < 1e-10 * b.abs().max(1.0),
                            "net {seed} step {k} dy{j}/d{i}: {a} {b}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn product_in_f32_stays_at_the_oracle() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let theta32: [f32; PARAMETERS] = std::array::from_fn(|_| rng.random_range(-0.5..0.5));
        let net: Net = Net::new(Weights::from_array(&theta32), Normalisation::identity());
        let (mut state, mut oracle) = (State::new(), Network::new(&theta32.map(f64::from)));
        for k in 0..64 {
            let got = net.step(&mut state, inputs(k).map(|x| x as f32)).output;
            let want = oracle.step(inputs(k).map(|x| f64::from(x as f32)));
            for (got, want) in got.iter().zip(&want) {
                assert!(
                    (f64::from(*got) - want.value).abs() < 2e-6,
                    "step {k}: {} {}",
                    got,
                    want.value
                );
            }
        }
    }
}
