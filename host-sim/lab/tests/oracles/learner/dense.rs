//! A second, independent implementation of the filter behind a hypothesis: dense matrices in f64
//! over one joint state. It is slow.

use firmware::learn::prior::LearnerNet;
use lrnn_nostd::learn::kalman::Transition;
use lrnn_nostd::{Sensitivities, State};
use nalgebra::{DMatrix, DVector};

/// Navigation errors.
const X: usize = 9;
/// Parameters of a triad: 3 biases, 63 weights.
const PER_TRIAD: usize = 66;
const N: usize = 2 * PER_TRIAD;

/// The hypothesis of all weights.
pub struct DenseReference {
    pub nets: [LearnerNet<f64>; 2],
    state: [State<f64>; 2],
    sens: [Sensitivities<f64>; 2],
    pub bias: [[f64; 3]; 2],
    pub x: DVector<f64>,
    pub p: DMatrix<f64>,
    pub estimate: DVector<f64>,
    jacobian: DMatrix<f64>,
    walk: Vec<f64>,
}

impl DenseReference {
    pub fn new(nets: [LearnerNet<f64>; 2], outer: &[f64], theta: &[f64], walk: &[f64]) -> Self {
        let sigma = outer.iter().chain(theta).map(|s| s * s);
        let mut jacobian = DMatrix::zeros(6, N);
        for i in 0..6 {
            jacobian[(i, i / 3 * PER_TRIAD + i % 3)] = 1.0;
        }
        Self {
            nets,
            state: [State::new(); 2],
            sens: [Sensitivities::new(); 2],
            bias: [[0.0; 3]; 2],
            x: DVector::zeros(X),
            p: DMatrix::from_diagonal(&DVector::from_iterator(X + N, sigma)),
            estimate: DVector::zeros(6),
            jacobian,
            walk: walk.to_vec(),
        }
    }

    pub fn step(&mut self, inputs: [[f64; 3]; 2]) {
        for (k, input) in inputs.into_iter().enumerate() {
            let step = self.nets[k].step_gradient(&mut self.state[k], &mut self.sens[k], input);
            for j in 0..3 {
                let scale = self.nets[k].normalisation.output_scale[j];
                self.estimate[3 * k + j] = self.bias[k][j] + step.error[j];
                for i in 0..63 {
                    self.jacobian[(3 * k + j, PER_TRIAD * k + 3 + i)] =
                        scale * self.sens[k].output()[j][i];
                }
            }
        }
    }

    pub fn propagate(&mut self, block: &Transition<X, f64>, applied: &[f64; 6]) {
        let phi = DMatrix::from_fn(X, X, |i, j| block.phi[i][j]);
        let gamma = DMatrix::from_fn(X, 6, |i, j| block.gamma[i][j]);
        self.x = &phi * &self.x + &gamma * (DVector::from_row_slice(applied) - &self.estimate);
        let mut whole = DMatrix::identity(X + N, X + N);
        whole.view_mut((0, 0), (X, X)).copy_from(&phi);
        whole
            .view_mut((0, X), (X, N))
            .copy_from(&(gamma * &self.jacobian));
        self.p = &whole * &self.p * whole.transpose();
        for i in 0..X {
            for j in 0..X {
                self.p[(i, j)] += block.q[i][j];
            }
        }
        for i in 0..N {
            self.p[(X + i, X + i)] += self.walk[i] * self.walk[i] * block.time;
        }
    }

    /// All observations of a fix at once, in Joseph's form.
    pub fn fix(&mut self, z: &[f64; 6], variance: &[f64; 6]) {
        let h = DMatrix::from_fn(6, X + N, |k, i| {
            f64::from(u8::from(i == if k < 3 { 6 + k } else { k }))
        });
        let r = DMatrix::from_diagonal(&DVector::from_row_slice(variance));
        let s = &h * &self.p * h.transpose() + &r;
        let inverse = s.try_inverse().expect("positive");
        let gain = &self.p * h.transpose() * inverse;
        let predicted = DVector::from_fn(6, |k, _| self.x[if k < 3 { 6 + k } else { k }]);
        let e = &gain * (DVector::from_row_slice(z) - predicted);
        let left = DMatrix::identity(X + N, X + N) - &gain * h;
        self.p = &left * &self.p * left.transpose() + &gain * r * gain.transpose();
        self.x += e.rows(0, X);
        for k in 0..2 {
            let of_triad = e.rows(X + PER_TRIAD * k, PER_TRIAD);
            for j in 0..3 {
                self.bias[k][j] -= of_triad[j];
            }
            let mut weights = self.nets[k].weights.to_array();
            for (weight, e) in weights.iter_mut().zip(of_triad.iter().skip(3)) {
                *weight -= e;
            }
            self.nets[k].weights.set_all(&weights);
        }
    }
}
