//! The shape of a type: the hidden layers with the smallest residual errors of many units, where
//! each unit has its own best output layer ([`super::linear`]).
//!
//! It is a Levenberg-Marquardt search over the hidden weights, from several starts. The Jacobian is
//! that of the residuals with the best output layers (full variable projection), by differences.
//! The moments of the fleet are computed again after each step. The score of a unit is always that
//! of its last drive, from which it has not learnt. A set of units for validation chooses the start
//! and the step at which the fit ends. Other units judge it.

use super::hidden_layers::{HIDDEN, HiddenLayers, Three};
use super::linear::{Constants, Moments, Point, Sums, regressors, renewed, solve};
use nalgebra::{DMatrix, DVector, Vector4};
use rayon::prelude::*;

/// Number of random starts beside the others.
const FURTHER_STARTS: usize = 4;
/// Number of steps of each start, and largest number for the best one.
const FIRST_STEPS: usize = 4;
const STEPS: usize = 25;
/// Number of steps without a better validation after which the fit ends.
const PATIENCE: usize = 4;
/// Largest number of units on which starts are compared.
const FIRST_UNITS: usize = 24;
/// Step of the differences, standard deviations of a weight.
const DIFFERENCE: f64 = 1e-4;
/// Iterations of the moments after a step, and at the end.
const RENEWALS: usize = 2;
const LAST_RENEWALS: usize = 40;

/// One drive: normalised inputs of each second, and the errors of the three axes.
#[derive(Debug, Clone)]
pub struct DriveData {
    /// Normalised inputs, second by second.
    pub inputs: Vec<Three>,
    /// Errors of each axis.
    pub points: [Vec<Point>; 3],
}

/// The drives of a unit, in their order.
pub type UnitData = Vec<DriveData>;

/// The features of a law, as functions of the inputs.
#[derive(Debug, Clone)]
pub enum Law {
    /// A network.
    Network(Box<HiddenLayers>),
    /// The inputs themselves: a static linear law.
    Linear,
    /// No features: biases only.
    Biases,
}

impl Law {
    fn features(&self, inputs: &[Three]) -> Vec<Three> {
        match self {
            Self::Network(shape) => shape.features(inputs),
            Self::Linear => inputs.iter().take(1).chain(inputs).copied().collect(),
            Self::Biases => vec![[0.0; 3]; inputs.len() + 1],
        }
    }

    fn sums(&self, unit: &UnitData) -> [Vec<Sums>; 3] {
        let mut out = [(); 3].map(|()| Vec::with_capacity(unit.len()));
        for drive in unit {
            let features = self.features(&drive.inputs);
            for (sums, points) in out.iter_mut().zip(&drive.points) {
                sums.push(Sums::of(points, &features));
            }
        }
        out
    }
}

/// A law with the moments of its constants.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The law.
    pub law: Law,
    /// The moments of its constants.
    pub moments: Moments,
}

impl Fitted {
    /// A law with its moments on these units.
    pub fn of(law: Law, units: &[&UnitData]) -> Self {
        let features: Vec<Vec<Three>> = units
            .iter()
            .flat_map(|unit| unit.iter().map(|drive| law.features(&drive.inputs)))
            .collect();
        let moments = Moments::wide(&features);
        Self { law, moments }.renewed(units, RENEWALS)
    }

    /// The same law after `times` further iterations of the moments.
    pub fn renewed(mut self, units: &[&UnitData], times: usize) -> Self {
        let sums: Vec<_> = units.par_iter().map(|unit| self.law.sums(unit)).collect();
        for _ in 0..times {
            let known: Vec<_> = sums.iter().map(|s| constants(s, &self.moments)).collect();
            self.moments = renewed(&known);
        }
        self
    }

    /// The residual share of the last drive's errors of each unit, when the unit has learnt from
    /// the drives before and the turn-on is not known.
    pub fn left(&self, units: &[&UnitData]) -> Vec<f64> {
        let of = |unit: &&UnitData| {
            let sums = self.law.sums(unit);
            let axes = sums.iter().enumerate().map(|(axis, drives)| {
                let (last, before) = drives.split_last()?;
                let known = solve(before, &self.moments, axis);
                Some((last.left(&known.mean), last.errors()))
            });
            let (left, all) = axes
                .flatten()
                .fold((0.0, 0.0), |(a, b), (left, all)| (a + left, b + all));
            left / f64::max(all, f64::MIN_POSITIVE)
        };
        units.par_iter().map(of).collect()
    }

    /// Mean logarithm of the residual shares: the score of a validation.
    fn check(&self, units: &[&UnitData]) -> f64 {
        let left = self.left(units);
        let count = left.len().max(1) as f64;
        left.iter().map(|x| x.max(1e-12).ln()).sum::<f64>() / count
    }

    /// The hidden layers; zero where the law has none.
    pub fn layers(&self) -> [lrnn_nostd::Layer<f64>; 2] {
        self.shape()
            .map_or_else(Default::default, HiddenLayers::layers)
    }

    fn shape(&self) -> Option<&HiddenLayers> {
        match &self.law {
            Law::Network(shape) => Some(shape),
            _ => None,
        }
    }

    /// All residuals of a unit with its best constants, in standard deviations: those of the
    /// points, of the constants and of the turn-ons.
    fn residuals(&self, shape: &HiddenLayers, unit: &UnitData) -> DVector<f64> {
        let law = Law::Network(Box::new(shape.clone()));
        let features: Vec<Vec<Three>> = unit.iter().map(|d| shape.features(&d.inputs)).collect();
        let all = constants(&law.sums(unit), &self.moments);
        let mut out = Vec::new();
        for (axis, known) in all.iter().enumerate() {
            let off = known.mean - self.moments.mean[axis];
            out.extend(off.component_div(&self.moments.sigma).iter());
            for ((drive, features), (t, _)) in unit.iter().zip(&features).zip(&known.turn_ons) {
                out.push(t / self.moments.turn_on);
                let of = |p: &Point| {
                    let predicted = known.mean.dot(&regressors(features, p.second)) + t;
                    p.weight.sqrt() * (p.error - predicted)
                };
                out.extend(drive.points[axis].iter().map(of));
            }
        }
        DVector::from_vec(out)
    }

    /// Sum of the squares of all residuals, those of the hidden weights included.
    fn cost(&self, shape: &HiddenLayers, units: &[&UnitData]) -> f64 {
        let each = units
            .par_iter()
            .map(|unit| self.residuals(shape, unit).norm_squared());
        let each: Vec<f64> = each.collect();
        each.iter().sum::<f64>() + shape.z.iter().map(|z| z * z).sum::<f64>()
    }

    /// Square of the Jacobian, and its product with the residuals.
    fn normal(&self, shape: &HiddenLayers, units: &[&UnitData]) -> (DMatrix<f64>, DVector<f64>) {
        let of = |unit: &&UnitData| {
            let at = self.residuals(shape, unit);
            let mut jacobian = DMatrix::zeros(at.len(), HIDDEN);
            for (mut column, i) in jacobian.column_iter_mut().zip(0..) {
                let mut moved = shape.clone();
                moved.z[i] += DIFFERENCE;
                column.copy_from(&((self.residuals(&moved, unit) - &at) / DIFFERENCE));
            }
            (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&at))
        };
        let each: Vec<_> = units.par_iter().map(of).collect();
        let z = DVector::from_column_slice(&shape.z);
        let first = (DMatrix::identity(HIDDEN, HIDDEN), z);
        each.into_iter()
            .fold(first, |(a, b), (square, cross)| (a + square, b + cross))
    }

    /// One Levenberg-Marquardt step. `None` if no step is better.
    fn step(&self, units: &[&UnitData], damping: &mut f64) -> Option<Self> {
        let shape = self.shape()?;
        let (square, cross) = self.normal(shape, units);
        let before = self.cost(shape, units);
        for _ in 0..6 {
            let mut damped = square.clone();
            for i in 0..HIDDEN {
                damped[(i, i)] *= 1.0 + *damping;
            }
            let step = damped.cholesky()?.solve(&cross);
            let mut next = shape.clone();
            next.z
                .iter_mut()
                .zip(step.iter())
                .for_each(|(z, s)| *z -= s);
            if self.cost(&next, units) < before {
                *damping = (*damping / 3.0).max(1e-6);
                let law = Law::Network(Box::new(next));
                let moments = self.moments;
                return Some(Self { law, moments }.renewed(units, RENEWALS));
            }
            *damping *= 5.0;
        }
        None
    }

    /// Takes steps until the validation is no longer better. Returns the best law and its score.
    fn descended(self, units: &[&UnitData], check: &[&UnitData], steps: usize) -> (Self, f64) {
        let mut damping = 0.1;
        let mut now = self;
        let mut best = (now.clone(), now.check(check));
        let mut since = 0;
        for _ in 0..steps {
            let Some(next) = now.step(units, &mut damping) else {
                break;
            };
            now = next;
            let checked = now.check(check);
            since += 1;
            if checked < best.1 {
                best = (now.clone(), checked);
                since = 0;
            }
            if since >= PATIENCE {
                break;
            }
        }
        best
    }
}

fn constants(sums: &[Vec<Sums>; 3], moments: &Moments) -> [Constants; 3] {
    [0, 1, 2].map(|axis| solve(&sums[axis], moments, axis))
}

/// The units for training, validation and test.
pub struct Parts<'a> {
    /// For training.
    pub learn: Vec<&'a UnitData>,
    /// For validation.
    pub check: Vec<&'a UnitData>,
    /// For the test.
    pub judge: Vec<&'a UnitData>,
}

impl<'a> Parts<'a> {
    /// Of five units three are for training, one for validation and one for the test.
    pub fn of(units: &'a [UnitData]) -> Self {
        let part = |which: fn(usize) -> bool| {
            let all = units.iter().enumerate();
            let part = all.filter(|(number, _)| which(number % 5));
            part.map(|(_, unit)| unit).collect()
        };
        Self {
            learn: part(|k| k < 3),
            check: part(|k| k == 3),
            judge: part(|k| k == 4),
        }
    }
}

/// The shape with the moments of its constants. `progress` is called after each start and at the
/// end: [`STARTS`] and one more times.
pub fn fit(parts: &Parts<'_>, settles: bool, progress: &dyn Fn()) -> Fitted {
    let first = &parts.learn[..parts.learn.len().min(FIRST_UNITS)];
    let mut best: Option<(Fitted, f64)> = None;
    for shape in HiddenLayers::starts(FURTHER_STARTS, settles) {
        let fitted = Fitted::of(Law::Network(Box::new(shape)), first);
        let tried = fitted.descended(first, &parts.check, FIRST_STEPS);
        if best.as_ref().is_none_or(|(_, least)| tried.1 < *least) {
            best = Some(tried);
        }
        progress();
    }
    let fitted = best.map_or_else(|| Fitted::of(Law::Biases, first), |(fitted, _)| fitted);
    let fitted = fitted.renewed(&parts.learn, RENEWALS);
    let (fitted, _) = fitted.descended(&parts.learn, &parts.check, STEPS);
    progress();
    fitted.renewed(&parts.learn, LAST_RENEWALS)
}

/// A law without a shape, fitted for comparison.
pub fn rival(law: Law, parts: &Parts<'_>) -> Fitted {
    Fitted::of(law, &parts.learn).renewed(&parts.learn, LAST_RENEWALS)
}

/// Number of starts that are compared.
pub const STARTS: usize = super::hidden_layers::STARTS + FURTHER_STARTS;

/// A mean of an output layer: three rows of weights, then the biases.
pub fn mean_of(moments: &Moments) -> ([Three; 3], Three) {
    let rows = moments.mean.map(|m: Vector4<f64>| [m[0], m[1], m[2]]);
    (rows, moments.mean.map(|m| m[3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// The errors of these units are a sigmoid of the first input, which a line cannot follow. The
    /// fit finds the shape: on test units the residual is much smaller than that of the static
    /// linear law.
    #[test]
    fn a_known_shape_is_found() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut z = || -> f64 { StandardNormal.sample(&mut rng) };
        let units: Vec<UnitData> = (0..20)
            .map(|_| {
                let size = [z(), z(), z()];
                let drive = |_: usize| {
                    let from = z();
                    let input = |k: usize| [from + 0.005 * k as f64, 0.3, 0.1];
                    let inputs: Vec<Three> = (0..300).map(input).collect();
                    let (t, noise) = (0.05 * z(), [(); 90].map(|()| 0.05 * z()));
                    let points = size.map(|size| {
                        let of = |k: usize| {
                            let x = inputs[10 * k][0];
                            Point {
                                second: 10 * k,
                                error: size / (1.0 + (-6.0 * (x - 0.6)).exp()) + t + noise[k],
                                weight: 400.0,
                            }
                        };
                        (1..30).map(of).collect()
                    });
                    DriveData { inputs, points }
                };
                (0..3).map(drive).collect()
            })
            .collect();
        let parts = Parts::of(&units);
        let fitted = fit(&parts, false, &|| {});
        let mean = |fitted: &Fitted| fitted.check(&parts.judge).exp();
        let [network, line, biases] = [
            mean(&fitted),
            mean(&rival(Law::Linear, &parts)),
            mean(&rival(Law::Biases, &parts)),
        ];
        println!("left: {network:.3} by the network, {line:.3} by a line, {biases:.3} by biases");
        assert!(network < 0.4 * line && line < biases);
    }

    /// The derivative of the cost by each hidden weight is twice the product of the Jacobian and
    /// the residuals, as by the theory of variable projection.
    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let shape = HiddenLayers::starts(4, true).pop().unwrap();
        let inputs: Vec<Three> = (0..200)
            .map(|k| [0.01 * f64::from(k) - 1.0, (0.1 * f64::from(k)).sin(), 0.4])
            .collect();
        let point = |k: usize| Point {
            second: 10 * k,
            error: (0.3 * k as f64).sin(),
            weight: 9.0,
        };
        let points = [(); 3].map(|()| (1..20).map(point).collect());
        let unit: UnitData = vec![DriveData { inputs, points }];
        let units = [&unit];
        let fitted = Fitted::of(Law::Network(Box::new(shape.clone())), &units);
        let (_, cross) = fitted.normal(&shape, &units);
        for i in 0..HIDDEN {
            let at = |by: f64| {
                let mut moved = shape.clone();
                moved.z[i] += by;
                fitted.cost(&moved, &units)
            };
            let slope = (at(1e-4) - at(-1e-4)) / 2e-4;
            let want = 2.0 * cross[i];
            assert!(
                (slope - want).abs() < 1e-3 * (1.0 + want.abs()),
                "{i}: {slope} {want}"
            );
        }
    }
}
