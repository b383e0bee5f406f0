//! Memory of a unit between two drives.
//!
//! With [`super::UnitBiases`] and [`super::UnitOutput`] a parameter set has two parts: the biases,
//! which are new at every turn-on, and weights, which belong to the unit and stay. The mean and the
//! covariance of the weights are then all that one drive leaves to the next. They are the
//! marginal of the filter's own mean and covariance, so no smoother is needed: a turn-on bias is a
//! parameter of its own, and what a drive says of the sum of both is divided between them by their
//! variances. For a bias that is measured in K drives with the variance R each, with the turn-on
//! variance T, this is the mean of K measurements with the variance T + R.

use super::blocks::at_least;
use super::{ErrorModel, Kalman, OUTPUTS, ParameterSet, Prior, packed};
use crate::activation::Activation;
use crate::real::Real;
use crate::shape::NEURONS;

impl<L: ParameterSet, const X: usize, const N: usize, const PACKED: usize, H: Activation, T: Real>
    Kalman<L, X, N, PACKED, H, T>
{
    /// Number of weights that belong to the unit.
    const OF_UNIT: usize = super::TRIADS * L::WEIGHTS;
    /// Number of values that [`Self::remember`] gives.
    pub const REMEMBERED: usize = Self::OF_UNIT + super::TRIADS * packed::packed(L::WEIGHTS);

    /// Gives what is known of the unit: the weights in parameter order, then the lower triangle of
    /// the covariance of each triad's, row by row. What gyros and accelerometers have in common is
    /// left out.
    pub fn remember(&mut self, mut put: impl FnMut(T)) {
        self.covariance.apply_deferred();
        self.model.weights().for_each(&mut put);
        Self::pairs().for_each(|(i, j)| put(self.covariance.parameter(i, j)));
    }

    /// Parameters of the unit whose covariances are remembered.
    fn pairs() -> impl Iterator<Item = (usize, usize)> {
        let unit = ErrorModel::<L, N, H, T>::is_weight;
        let of_triad = N / super::TRIADS;
        let rows = (0..N).filter(move |&i| unit(i));
        rows.flat_map(move |i| {
            let first = i / of_triad.max(1) * of_triad;
            (first..=i).filter(move |&j| unit(j)).map(move |j| (i, j))
        })
    }

    /// Takes what [`Self::remember`] gave after an earlier drive in place of the prior of the
    /// weights. To be called after [`Kalman::init`]; the biases keep their prior. `ages`: what each
    /// variance has grown by since, as a share of its prior.
    ///
    /// Returns false, and changes nothing, when a value is missing or not finite, or a variance is
    /// not positive or beyond all measure (more than 10^4 times its prior).
    pub fn recall(&mut self, values: impl Iterator<Item = T> + Clone, ages: T) -> bool {
        let mut covariance = values.clone().skip(Self::OF_UNIT);
        let (mut good, most) = (0, T::from_f64(1e4));
        let prior = |prior: &Prior<X, N, T>, i: usize| {
            prior.parameter_sigma.get(i).map_or(T::ZERO, |&s| s * s)
        };
        for (i, j) in Self::pairs() {
            let Some(value) = covariance.next() else {
                return false;
            };
            let variance = i != j || value > T::ZERO && value <= most * prior(&self.prior, i);
            good += usize::from(value.is_finite() && variance);
        }
        let finite = values.clone().take(Self::OF_UNIT).filter(|v| v.is_finite());
        if good + finite.count() != Self::REMEMBERED {
            return false;
        }
        self.model.set_weights(&mut values.clone());
        self.model.reset();
        for ((i, j), value) in Self::pairs().zip(values.skip(Self::OF_UNIT)) {
            let aged = if i == j {
                ages * prior(&self.prior, i)
            } else {
                T::ZERO
            };
            self.covariance.set_parameter(i, j, value + aged);
        }
        true
    }

    /// The second moment of each bias of this turn-on about zero, by what is known now: the square
    /// of its mean and its variance. Its mean over axes and drives estimates the variance of the
    /// turn-on (expectation-maximisation).
    pub fn turn_on_moments(&self) -> [T; OUTPUTS] {
        let mut moments = [T::ZERO; OUTPUTS];
        let variances = self.covariance.variances().enumerate();
        let of_bias =
            variances.filter(|(i, _)| L::BIASES && !ErrorModel::<L, N, H, T>::is_weight(*i));
        let biases = self.model.biases().as_flattened().iter();
        for ((moment, (_, variance)), &bias) in moments.iter_mut().zip(of_bias).zip(biases) {
            *moment = bias * bias + variance;
        }
        moments
    }

    /// Standard deviation of the sum of the biases of each output: of this turn-on and of the unit;
    /// zero without biases.
    pub fn bias_sigma(&self) -> [T; OUTPUTS] {
        let mut sigma = [T::ZERO; OUTPUTS];
        if !L::BIASES {
            return sigma;
        }
        let per_triad = N / super::TRIADS;
        for (output, sigma) in sigma.iter_mut().enumerate() {
            let (k, j) = (output / NEURONS, output % NEURONS);
            let bias = k * per_triad + j;
            let mut variance = self.covariance.parameter(bias, bias);
            if let Some(at) = L::OUTPUT_BIAS {
                let own = k * per_triad + NEURONS + at + j;
                let scale = self.model.output_scale(output);
                let both = self.covariance.parameter(bias, own);
                let unit = self.covariance.parameter(own, own);
                variance += scale * (both + both + scale * unit);
            }
            // a sum that is known much better than its parts may be lost to rounding
            *sigma = at_least(variance, T::ZERO).sqrt();
        }
        sigma
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Correction, Prior, Transition, UnitBiases, UnitMap, UnitOutput};
    use super::*;
    use crate::{Full, Identity, Net, Normalisation, Rational, Weights};
    use std::vec::Vec;

    /// Standard deviation of the unit's bias, of a turn-on's bias, and of a measurement.
    const UNIT: f64 = 3.0;
    const TURN_ON: f64 = 0.7;
    const MEASURED: f64 = 0.4;
    const SCALE: f64 = 2.0;

    type Six = Kalman<UnitBiases, 6, 12, 78, Rational, f64>;

    fn nets() -> [Net<Rational, Identity, Full, f64>; 2] {
        let mut scales = Normalisation::identity();
        scales.output_scale = [SCALE; 3];
        [Net::new(Weights::zero(), scales); 2]
    }

    fn begun() -> Six {
        let mut parameter_sigma = [TURN_ON; 12];
        for (i, sigma) in parameter_sigma.iter_mut().enumerate() {
            if i % 6 >= 3 {
                *sigma = UNIT / SCALE;
            }
        }
        let prior = Prior {
            error_sigma: [0.0; 6],
            parameter_sigma,
            walk: [0.0; 6],
            error_floor: [0.0; 6],
            parameter_floor: 0.0,
        };
        Kalman::new(ErrorModel::new(nets()), prior)
    }

    /// A second over which the navigator's errors are the sums of the sensors'.
    fn second<T: Real>() -> Transition<6, T> {
        let mut second = Transition::ZEROED;
        second.time = T::ONE;
        for i in 0..6 {
            (second.phi[i][i], second.gamma[i][i]) = (T::ONE, T::ONE);
        }
        second
    }

    /// A drive in which the sum of each sensor's errors over one second is measured.
    fn drive(filter: &mut Six, errors: [f64; 6]) {
        filter.reset_errors(&[0.0; 6]);
        filter.step([[0.0; 3]; 2]);
        // the increments were not corrected, so their sums lack the estimate
        filter.propagate(&second(), &Correction::NONE);
        for (i, error) in errors.into_iter().enumerate() {
            let innovation = filter.innovation(i, -error, MEASURED * MEASURED);
            filter.update(i, innovation);
        }
        filter.finish_update();
    }

    /// The memory after K drives is the mean of K measurements, each with the variance of the
    /// turn-on and that of the measurement.
    #[test]
    fn k_drives_are_k_measurements_of_the_unit() {
        let draws = [1.3, 2.9, 1.8, 2.4, 0.9, 3.1];
        let mut known: Option<Vec<f64>> = None;
        for (k, &z) in draws.iter().enumerate() {
            let mut filter = begun();
            if let Some(known) = &known {
                assert!(filter.recall(known.iter().copied(), 0.0));
            }
            drive(&mut filter, [z; 6]);
            let mut values = Vec::new();
            filter.remember(|value| values.push(value));
            assert_eq!(values.len(), Six::REMEMBERED);

            let n = (k + 1) as f64;
            let each = TURN_ON * TURN_ON + MEASURED * MEASURED;
            let variance = 1.0 / (1.0 / (UNIT * UNIT) + n / each);
            let sum: f64 = draws.iter().take(k + 1).sum();
            let mean = variance / each * sum;
            for i in 0..6 {
                assert!((values[i] * SCALE - mean).abs() < 1e-12, "{k} {i}");
                let own = values[6 + 6 * (i / 3) + packed::packed(i % 3) + i % 3] * SCALE * SCALE;
                assert!((own - variance).abs() < 1e-12, "{k} {i}");
            }
            // what the drive knows of the sum: with one more measurement
            let sigma = filter.bias_sigma()[0];
            let before = 1.0 / (1.0 / (UNIT * UNIT) + (n - 1.0) / each) + TURN_ON * TURN_ON;
            let after = 1.0 / (1.0 / before + 1.0 / (MEASURED * MEASURED));
            assert!((sigma * sigma - after).abs() < 1e-12);
            known = Some(values);
        }
    }

    /// The moments of many turn-ons of a known unit have the variance of the turn-on as their mean,
    /// whatever the filter believes, when each measurement is good.
    #[test]
    fn moments_are_those_of_the_turn_ons() {
        let mut known = Vec::new();
        for k in 0..300 {
            let mut filter = begun();
            if k > 0 {
                assert!(filter.recall(known.iter().copied(), 0.0));
            }
            drive(&mut filter, [0.7 * f64::from(k % 3 - 1); 6]);
            known.clear();
            filter.remember(|value| known.push(value));
        }
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..50 {
            let t = 0.2 * f64::from(k % 7 - 3);
            let mut filter = begun();
            assert!(filter.recall(known.iter().copied(), 0.0));
            for _ in 0..400 {
                drive(&mut filter, [t; 6]);
            }
            sum += filter.turn_on_moments().iter().sum::<f64>() / 6.0;
            squares += t * t;
        }
        assert!((sum / squares - 1.0).abs() < 0.1, "{sum} {squares}");
    }

    #[test]
    fn ageing_widens_and_bad_values_are_not_taken() {
        let mut filter = begun();
        drive(&mut filter, [1.0; 6]);
        let mut values = Vec::new();
        filter.remember(|value| values.push(value));
        let mut aged = begun();
        assert!(aged.recall(values.iter().copied(), 0.01));
        let mut after = Vec::new();
        aged.remember(|value| after.push(value));
        let grown = after[6] - values[6];
        assert!((grown - 0.01 * (UNIT / SCALE).powi(2)).abs() < 1e-12);
        assert_eq!(after[7], values[7]);

        let fresh = begun();
        for (at, bad) in [
            (0, f64::NAN),
            (6, 0.0),
            (6, -1.0),
            (6, 1e6),
            (8, f64::INFINITY),
        ] {
            let mut wrong = values.clone();
            wrong[at] = bad;
            let mut filter = begun();
            assert!(!filter.recall(wrong.iter().copied(), 0.0), "{at} {bad}");
            assert_eq!(filter, fresh);
        }
        // up to 10^4 times the prior
        for (times, good) in [(0.9e4, true), (1.1e4, false)] {
            let mut wide = values.clone();
            wide[6] = times * (UNIT / SCALE).powi(2);
            assert_eq!(begun().recall(wide.iter().copied(), 0.0), good, "{times}");
        }
        let mut filter = begun();
        assert!(!filter.recall(values[1..].iter().copied(), 0.0));
        assert_eq!(filter, fresh);
    }

    /// Numbers that look random, between -1 and 1.
    fn noise(state: &mut u64) -> f64 {
        *state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// The variance of a sum that is known much better than its parts is a small difference of
    /// large numbers, and may be below 0 in f32.
    #[test]
    fn a_sum_that_is_known_well_has_a_deviation() {
        type Single = Kalman<UnitBiases, 6, 12, 78, Rational, f32>;
        let net = Net::new(Weights::zero(), Normalisation::identity());
        let prior = Prior {
            error_sigma: [0.0; 6],
            parameter_sigma: core::array::from_fn(|i| if i % 6 < 3 { 0.7 } else { 3.0 }),
            walk: [0.0; 6],
            error_floor: [0.0; 6],
            parameter_floor: 0.0,
        };
        for measured in [1e-2, 3e-4, 1e-5_f32] {
            let mut filter = Single::new(ErrorModel::new([net; 2]), prior);
            filter.step([[0.0; 3]; 2]);
            filter.propagate(&second(), &Correction::NONE);
            for i in 0..6 {
                let innovation = filter.innovation(i, 0.5, measured * measured);
                filter.update(i, innovation);
            }
            filter.finish_update();
            let sigma = filter.bias_sigma();
            let good = |sigma: &f32| (0.0..=2e-3_f32.max(1.1 * measured)).contains(sigma);
            assert!(sigma.iter().all(good), "{measured}: {sigma:?}");
        }
    }

    /// A filter that learns biases and maps from sums of sensor errors finds the mean and the
    /// variances of the regression of these sums, solved in one piece with the normal equations.
    /// Part of the input is there at rest, and enters by the estimate; the rest by the intervals.
    #[test]
    fn maps_are_the_regression_of_what_is_felt() {
        type Mapped = Kalman<UnitMap, 6, 30, 465, Rational, f64>;
        let rest = [[0.0, 0.1, 0.0], [0.3, -0.2, -9.8]];
        let sigma: [f64; 30] = core::array::from_fn(|i| match i % 15 {
            0..3 => 0.3,
            3..12 => 0.05,
            _ => 0.8 / SCALE,
        });
        let prior = Prior {
            error_sigma: [0.0; 6],
            parameter_sigma: sigma,
            walk: [0.0; 6],
            error_floor: [0.0; 6],
            parameter_floor: 0.0,
        };
        let mut filter = Mapped::new(ErrorModel::new(nets()), prior);
        filter.set_rest(rest);
        filter.step([[0.0; 3]; 2]);
        let mut information = [[0.0; 30]; 30];
        for (i, row) in information.iter_mut().enumerate() {
            row[i] = 1.0 / (sigma[i] * sigma[i]);
        }
        let mut right = [0.0; 30];
        let mut state = 4;
        let second_of = |felt: &[[f64; 3]; 2]| {
            let mut second = second::<f64>();
            for i in 0..6 {
                let from = 9 * (i / 3) + 3 * (i % 3);
                second.proportional[i][from..from + 3].copy_from_slice(&felt[i / 3]);
            }
            second
        };
        for _ in 0..40 {
            let mut felt = [[0.0; 3]; 2];
            felt.as_flattened_mut()
                .iter_mut()
                .for_each(|x| *x = 2.0 * noise(&mut state));
            filter.reset_errors(&[0.0; 6]);
            filter.propagate(&second_of(&felt), &Correction::NONE);
            for i in 0..6 {
                let (k, axis) = (i / 3, i % 3);
                let z = noise(&mut state);
                let innovation = filter.innovation(i, -z, MEASURED * MEASURED);
                filter.update(i, innovation);
                // the sum is bias + row of the map times all that is felt + the unit's bias
                let mut row = [0.0; 30];
                row[15 * k + axis] = 1.0;
                for j in 0..3 {
                    row[15 * k + 3 + 3 * axis + j] = rest[k][j] + felt[k][j];
                }
                row[15 * k + 12 + axis] = SCALE;
                for a in 0..30 {
                    for b in 0..30 {
                        information[a][b] += row[a] * row[b] / (MEASURED * MEASURED);
                    }
                    right[a] += row[a] * z / (MEASURED * MEASURED);
                }
            }
            filter.finish_update();
        }
        let inverse = inverted(information);
        let mut means = [0.0; 30];
        for (mean, row) in means.iter_mut().zip(&inverse) {
            *mean = row.iter().zip(&right).map(|(a, b)| a * b).sum();
        }
        let mut known = Vec::new();
        filter.remember(|value| known.push(value));
        for (k, unit) in known[..24].chunks(12).enumerate() {
            for (i, value) in unit.iter().enumerate() {
                assert!((value - means[15 * k + 3 + i]).abs() < 1e-9, "{k} {i}");
            }
        }
        for (i, variance) in filter.covariance().variances().enumerate() {
            assert!((variance / inverse[i][i] - 1.0).abs() < 1e-9, "{i}");
        }
        assert_eq!(filter.model().maps()[1][2][0], known[12 + 6]);
        // what the estimate says is all that acts at rest
        let bias = means[15 + 2] + SCALE * means[15 + 14];
        let row = &filter.model().maps()[1][2];
        let at_rest = bias + row[0] * 0.3 - row[1] * 0.2 - row[2] * 9.8;
        assert!((filter.model().estimate()[5] - at_rest).abs() < 1e-9);
        assert!((filter.model().output()[5] - bias).abs() < 1e-9);
    }

    /// The inverse by elimination; the matrix is positive.
    fn inverted<const N: usize>(mut a: [[f64; N]; N]) -> [[f64; N]; N] {
        let mut inverse: [[f64; N]; N] =
            core::array::from_fn(|i| core::array::from_fn(|j| f64::from(u8::from(i == j))));
        for i in 0..N {
            let by = 1.0 / a[i][i];
            for j in 0..N {
                a[i][j] *= by;
                inverse[i][j] *= by;
            }
            for k in (0..N).filter(|k| *k != i) {
                let factor = a[k][i];
                for j in 0..N {
                    a[k][j] -= factor * a[i][j];
                    inverse[k][j] -= factor * inverse[i][j];
                }
            }
        }
        inverse
    }

    /// J against differences of the estimate by each parameter.
    #[test]
    fn the_output_layer_is_linear() {
        type Model = ErrorModel<UnitOutput, 30, Rational, f64>;
        let weights: Weights<f64> = Weights::from_fn(|i| 0.1 * ((i * 5 % 11) as f64 - 5.0));
        let mut scales = Normalisation::identity();
        scales.output_scale = [2.0, 0.5, 3.0];
        let mut model = Model::new([Net::new(weights, scales); 2]);
        let inputs = [[0.3, -0.2, 0.9], [1.0, 0.1, -0.4]];
        let steps = |model: &mut Model| (0..3).map(|_| model.step(inputs)).last();
        let first = steps(&mut model).expect("three steps");
        for parameter in 0..30 {
            let mut other = Model::new([Net::new(weights, scales); 2]);
            let mut change = [0.0; 30];
            change[parameter] = -1.0;
            other.subtract(&change);
            let moved = steps(&mut other).expect("three steps");
            let mut unit = [0.0; 30];
            unit[parameter] = 1.0;
            let derivatives = model.jacobian().map(|rows| rows.times(&unit));
            for (output, derivative) in derivatives.into_iter().flatten().enumerate() {
                assert!((moved[output] - first[output] - derivative).abs() < 1e-12);
            }
        }
    }
}
