//! Gauss-Newton with Levenberg damping and a prior. It needs 3-10 passes where the gradient rules
//! need hundreds.
//!
//! ```text
//! minimise  E(theta) + 1/2 sum ridge_i (theta_i - prior_i)^2
//! (N + R + lambda R) delta = -(dE/dtheta + R (theta - prior))
//! N = sum weight Psi^T Psi,  R = diag ridge
//! ```
//!
//! In lambda R the ridge is the mean diagonal of N scaled by R, and 1 where a ridge is 0.
//!
//! With `weight` = 1/sigma^2 of a window's noise and `ridge` = 1/sd^2 of the weights around the
//! prior this is the maximum a posteriori estimate. The prior keeps 63 parameters from fitting
//! noise.
//!
//! lambda follows the gain ratio, which is actual over predicted decrease (Nielsen 1999). A pass as
//! good as predicted divides it by three. A rejected pass multiplies it by 2, 4, 8 ... and solves
//! again from the sums of the best pass. The memory is two packed matrices: N of the best pass, and
//! one that holds the sum N of the running pass and then its factor L.

use crate::learn::{Batch, Rule};
use crate::real::{Real, all_finite};
use crate::shape::{Feedback, NEURONS, PARAMS};
use crate::weights::Weights;

/// Values of a packed symmetric matrix: row i holds the columns 0..=i.
const PACKED: usize = PARAMS * (PARAMS + 1) / 2;

/// The rule; its two matrices take 16 128 bytes in `f32`.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussNewton<T = f32> {
    prior: [T; PARAMS],
    ridge: [T; PARAMS],
    /// lambda, and the factor by which it grows when the next pass is rejected.
    damping: T,
    growth: T,
    /// Sums of the running pass; afterwards `work` is L.
    batch: Batch<T>,
    work: [T; PACKED],
    /// The best pass: its weights, N, gradient, and cost including the prior.
    best: Weights<T>,
    normal: [T; PACKED],
    gradient: [T; PARAMS],
    best_objective: Option<T>,
    /// The predicted decrease of the objective by the candidate.
    predicted: T,
}

impl<T: Real> GaussNewton<T> {
    /// Expects weights around `prior` with inverse variance `ridge` >= 0, in the units of `weight`.
    /// The example of the crate learns by it.
    pub fn new(prior: &Weights<T>, ridge: T) -> Self {
        Self::with_ridges(prior, [ridge; PARAMS])
    }

    /// As [`Self::new`], with an inverse variance for each weight in parameter order. The feedback
    /// of a slow unit, for example, is known much better than the weight of its output.
    pub fn with_ridges(prior: &Weights<T>, ridge: [T; PARAMS]) -> Self {
        Self {
            prior: prior.to_array(),
            ridge,
            damping: T::from_f64(1e-2),
            growth: T::from_f64(2.0),
            batch: Batch::new(),
            work: [T::ZERO; PACKED],
            best: *prior,
            normal: [T::ZERO; PACKED],
            gradient: [T::ZERO; PARAMS],
            best_objective: None,
            predicted: T::ZERO,
        }
    }

    /// Adds the prior to cost and gradient; returns the objective.
    fn add_prior<F: Feedback>(&mut self, weights: &Weights<T>) -> T {
        let half = T::from_f64(0.5);
        let mut objective = self.batch.cost;
        let priors = self.prior.iter().zip(&self.ridge);
        for (index, ((theta, (&prior, &ridge)), g)) in weights
            .iter()
            .zip(priors)
            .zip(&mut self.batch.gradient)
            .enumerate()
        {
            if F::is_active(index) {
                let off = theta - prior;
                objective += half * ridge * off * off;
                *g += ridge * off;
            }
        }
        objective
    }

    /// The damped step from the sums of the best pass; 0 if it cannot be solved.
    fn solve(&mut self) -> [T; PARAMS] {
        // In units of the prior, z = theta / sigma, the matrix is well scaled even for very
        // different ridges.
        let sigma = self.ridge.map(unit);
        self.work = self.normal;
        let mut axis = 0;
        for_each_row(&mut self.work, |row| {
            let own = sigma.get(axis).map_or(T::ONE, |&s| s);
            for (value, &s) in row.iter_mut().zip(&sigma) {
                *value *= own * s;
            }
            axis += 1;
        });
        let diagonal = rows(&self.work).filter_map(|row| row.last());
        let sum = diagonal.fold(T::ZERO, |sum, &value| sum + value);
        let lambda = self.damping * sum / T::from_f64(PARAMS as f64);
        let mut priors = self.ridge.iter().zip(&sigma);
        for_each_row(&mut self.work, |row| {
            if let (Some(diagonal), Some((&ridge, &s))) = (row.last_mut(), priors.next()) {
                *diagonal += ridge * s * s + lambda;
            }
        });
        factorise(&mut self.work);
        let mut gradient = self.gradient;
        scale(&mut gradient, &sigma);
        let mut step = gradient.map(|g| -g);
        substitute(&self.work, &mut step);
        if !all_finite(&step) {
            return [T::ZERO; PARAMS];
        }
        // The decrease predicted by the model: (lambda |z|^2 - gradient . z) / 2.
        self.predicted = T::from_f64(0.5) * (lambda * dot(&step, &step) - dot(&step, &gradient));
        scale(&mut step, &sigma);
        step
    }

    /// Reduces the damping after a pass that lowered the objective by `decrease`; the better the
    /// prediction was, the more.
    fn ease(&mut self, decrease: T) {
        let excess = (decrease + decrease) / self.predicted - T::ONE;
        let factor = T::ONE - excess * excess * excess;
        let (least, most) = (T::ONE / T::from_f64(3.0), T::from_f64(2.0));
        let factor = if factor > most {
            most
        } else if factor > least {
            factor
        } else {
            least
        };
        let eased = self.damping * factor;
        self.damping = if eased > T::EPSILON {
            eased
        } else {
            T::EPSILON
        };
        self.growth = T::from_f64(2.0);
    }

    /// Increases the damping after a rejected pass. It is bounded so that it stays finite.
    fn stiffen(&mut self) {
        let most = T::ONE / T::EPSILON;
        let damping = self.damping * self.growth;
        self.damping = if damping < most { damping } else { most };
        self.growth = if self.growth < most {
            self.growth + self.growth
        } else {
            most
        };
    }
}

impl<T: Real> Rule<T> for GaussNewton<T> {
    fn start(&mut self, weights: &Weights<T>) {
        self.best = *weights;
        self.best_objective = None;
        self.normal = [T::ZERO; PACKED];
        self.gradient = [T::ZERO; PARAMS];
    }

    fn begin(&mut self) {
        self.batch = Batch::new();
        self.work = [T::ZERO; PACKED];
    }

    #[inline]
    fn residual(&mut self, psi: &[[T; PARAMS]; NEURONS], r: &[T; NEURONS], weight: T) {
        self.batch.add(psi, r, weight);
        let [a, b, c] = psi;
        let mut left = a.iter().zip(b).zip(c);
        // all three rows at once, so that the matrix is read and written once
        for_each_row(&mut self.work, |line| {
            let Some(((&left_a, &left_b), &left_c)) = left.next() else {
                return;
            };
            let (left_a, left_b, left_c) = (weight * left_a, weight * left_b, weight * left_c);
            let right = a.iter().zip(b).zip(c);
            for (value, ((&a, &b), &c)) in line.iter_mut().zip(right) {
                *value = *value + left_a * a + left_b * b + left_c * c;
            }
        });
    }

    fn end<F: Feedback>(&mut self, candidate: &mut Weights<T>, valid: bool) -> (T, bool) {
        let cost = self.batch.cost;
        let objective = self.add_prior::<F>(candidate);
        let lower = self.best_objective.is_none_or(|best| objective <= best);
        let accepted = valid && lower && objective.is_finite() && self.batch.is_finite();
        if accepted {
            if let Some(best) = self.best_objective {
                self.ease(best - objective);
            }
            self.best = *candidate;
            self.best_objective = Some(objective);
            self.normal = self.work;
            self.gradient = self.batch.gradient;
        } else {
            self.stiffen();
        }
        let step = self.solve();
        let mut next = self.best.to_array();
        for (theta, step) in next.iter_mut().zip(step) {
            *theta += step;
        }
        candidate.set_all(&next);
        (cost, accepted)
    }

    fn best(&self) -> Option<Weights<T>> {
        Some(self.best)
    }
}

/// Standard deviation of a weight with this ridge; 1 if there is no prior.
fn unit<T: Real>(ridge: T) -> T {
    if ridge > T::ZERO {
        T::ONE / ridge.sqrt()
    } else {
        T::ONE
    }
}

fn scale<T: Real>(x: &mut [T; PARAMS], by: &[T; PARAMS]) {
    for (x, &by) in x.iter_mut().zip(by) {
        *x *= by;
    }
}

/// Calls `act` with each row of a packed matrix.
fn for_each_row<T>(packed: &mut [T; PACKED], mut act: impl FnMut(&mut [T])) {
    let mut rest = packed.as_mut_slice();
    for length in 1..=PARAMS {
        let Some((row, below)) = rest.split_at_mut_checked(length) else {
            return;
        };
        act(row);
        rest = below;
    }
}

/// The rows of a packed matrix, of 1, 2, 3 ... values.
fn rows<T>(packed: &[T]) -> impl Iterator<Item = &[T]> {
    (0..PARAMS).map_while(|i| {
        let start = i * (i + 1) / 2;
        packed.get(start..=start + i)
    })
}

/// N = L L^T in place (Cholesky, row by row). A pivot lost to rounding is replaced by the largest
/// diagonal element, which nearly freezes its direction; the step is still one of descent.
fn factorise<T: Real>(packed: &mut [T; PACKED]) {
    let largest = rows(packed)
        .filter_map(|row| row.last())
        .fold(
            T::ZERO,
            |most, &value| if value > most { value } else { most },
        );
    let least = largest * T::EPSILON * T::from_f64(16.0);
    for i in 0..PARAMS {
        let Some((above, rest)) = packed.split_at_mut_checked(i * (i + 1) / 2) else {
            return;
        };
        let Some(([row @ .., pivot], _)) = rest.split_at_mut_checked(i + 1) else {
            return;
        };
        for (j, upper) in rows(above).enumerate() {
            let Some((done, [value, ..])) = row.split_at_mut_checked(j) else {
                break;
            };
            let [known @ .., diagonal] = upper else { break };
            *value = (*value - dot(done, known)) / *diagonal;
        }
        let square = *pivot - dot(row, row);
        *pivot = if square > least {
            square.sqrt()
        } else {
            largest.sqrt()
        };
    }
}

/// Solves L L^T x = b in place of b.
fn substitute<T: Real>(packed: &[T; PACKED], x: &mut [T; PARAMS]) {
    for (i, row) in rows(packed).enumerate() {
        let (Some((done, [value, ..])), [known @ .., diagonal]) = (x.split_at_mut_checked(i), row)
        else {
            return;
        };
        *value = (*value - dot(known, done)) / *diagonal;
    }
    for i in (0..PARAMS).rev() {
        let Some([known @ .., diagonal]) = packed.get(i * (i + 1) / 2..(i + 1) * (i + 2) / 2)
        else {
            return;
        };
        let Some((above, [value, ..])) = x.split_at_mut_checked(i) else {
            return;
        };
        *value = *value / *diagonal;
        for (above, &factor) in above.iter_mut().zip(known) {
            *above -= factor * *value;
        }
    }
}

/// a . b over the shorter of the two.
fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (&a, &b)| sum + a * b)
}

#[cfg(test)]
mod tests;
