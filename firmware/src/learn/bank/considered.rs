//! Errors that no hypothesis estimates are considered: scale factors, misalignments and the gyros'
//! g-sensitivity.
//!
//! In a hypothesis they are noise, white and in proportion to the motion. They are constants in
//! fact: where motions come again and again, as in a swinging hand, so do their errors, and fixes
//! do not average them out. What they do to the hypothesis that is followed is exactly known but
//! for their size. Its errors (estimate minus truth) of the navigator, `x`, and of the sensors'
//! constant errors, `e`, by one unit of such a constant move with the same matrices:
//!
//! ```text
//! interval   x+ = Phi x - Gamma e + felt
//! fix        x+ = x - K_x x_i       e+ = e + K_e x_i
//! ```
//!
//! Together they add `sum of sigma^2 x^2` to the variance of the navigator's errors (consider
//! covariance: D. Simon, "Optimal State Estimation", 2006, 10.2). The gains stay as they are.

use super::{NAV, OUTPUTS};
use crate::nav::proportional::{Effect, PAIRS, ProportionalEffects};
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::Transition;

/// Kinds of such errors: of the gyros by rotation, of the gyros by force, of the accelerometers by
/// force.
const KINDS: usize = 3;

/// The errors of attitude and velocity come before those of the position.
const POSITION: usize = 6;

/// The errors by one constant.
#[derive(Clone, Copy, Debug)]
struct Column<T> {
    x: [T; NAV],
    e: [T; OUTPUTS],
}

/// Standard deviations of the constants, as ratios, rad/s per m/s2 and rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Scale factors of gyros and accelerometers.
    pub scale: [f32; 2],
    /// Misalignments of gyros and accelerometers.
    pub misalignment: [f32; 2],
    /// The gyros' g-sensitivity.
    pub g_sensitivity: f32,
}

/// Errors that the filters consider and do not estimate, and their effect on the estimates.
#[derive(Clone, Debug)]
pub struct Considered<T> {
    columns: [[Column<T>; PAIRS]; KINDS],
    /// Of each kind: variance of an axis by itself, and by another one.
    variance: [[T; 2]; KINDS],
}

/// A filter's gains for an observation: of the navigator's errors, and of the sensors'.
pub type Gains<T> = ([T; NAV], [T; OUTPUTS]);

impl<T: Real> Considered<T> {
    /// Nothing.
    pub const ZEROED: Self = Self {
        columns: [[Column {
            x: [T::ZERO; NAV],
            e: [T::ZERO; OUTPUTS],
        }; PAIRS]; KINDS],
        variance: [[T::ZERO; 2]; KINDS],
    };

    /// Begins with constants of this size.
    pub fn begin(&mut self, of: &Sizes) {
        let [gyro, accel] = [0, 1].map(|i| [of.scale[i], of.misalignment[i]]);
        self.variance = [gyro, [of.g_sensitivity; 2], accel]
            .map(|kind| kind.map(|sigma| T::from_f64(f64::from(sigma) * f64::from(sigma))));
        self.clear();
    }

    /// A new navigator.
    pub fn clear(&mut self) {
        for column in self.columns.as_flattened_mut() {
            (column.x, column.e) = ([T::ZERO; NAV], [T::ZERO; OUTPUTS]);
        }
    }

    /// The navigator has passed an interval.
    #[inline(never)]
    pub fn interval(&mut self, block: &Transition<NAV, T>, felt: &ProportionalEffects) {
        let half = T::from_f64(0.5) * block.time;
        for (kind, columns) in self.columns.iter_mut().enumerate() {
            for (pair, column) in columns.iter_mut().enumerate() {
                column.moves(block);
                let of_map = match kind {
                    0 => Some(pair),
                    1 => None,
                    _ => Some(PAIRS + pair),
                };
                if let Some(of_map) = of_map {
                    for (x, row) in column.x.iter_mut().zip(&block.proportional) {
                        *x += row.get(of_map).copied().unwrap_or(T::ZERO);
                    }
                    continue;
                }
                let Some(Effect { phi, velocity }) = felt.by_force.get(pair) else {
                    return;
                };
                let [phi, velocity] = [phi, velocity].map(|v| v.map(|x| T::from_f64(x.into())));
                for i in 0..3 {
                    column.x[i] += phi[i];
                    column.x[3 + i] += velocity[i];
                    column.x[6 + i] += half * velocity[i];
                }
            }
        }
    }

    /// A fix has taught the hypothesis that is followed by these gains, by error `i` of the
    /// navigator.
    #[inline(never)]
    pub fn fix(&mut self, i: usize, gains: &Gains<T>) {
        self.learns(gains, |column| column.x.get(i).copied());
    }

    /// It has learnt by these gains from an observation of the navigator's errors and of the error
    /// of sensor `k`; beyond the last one, of none.
    #[inline(never)]
    pub fn row(&mut self, k: usize, by: &[T; NAV], gains: &Gains<T>) {
        self.learns(gains, |column| {
            let of_attitude = by.iter().zip(&column.x);
            let own = column.e.get(k).copied().unwrap_or(T::ZERO);
            Some(of_attitude.fold(own, |sum, (&by, &x)| sum + by * x))
        });
    }

    #[inline(always)]
    fn learns(&mut self, (of_x, of_e): &Gains<T>, by: impl Fn(&Column<T>) -> Option<T>) {
        for column in self.columns.as_flattened_mut() {
            let seen = by(column).unwrap_or(T::ZERO);
            for (x, gain) in column.x.iter_mut().zip(of_x) {
                *x -= *gain * seen;
            }
            for (e, gain) in column.e.iter_mut().zip(of_e) {
                *e += *gain * seen;
            }
        }
    }

    /// The errors (estimate minus truth) of the navigator's errors, by 1 unit of a constant of this
    /// kind and pair.
    #[cfg(test)]
    pub fn errors_by(&self, kind: usize, pair: usize) -> [T; NAV] {
        self.columns[kind][pair].x
    }

    /// What they add to the variance of the navigator's error `i`.
    #[must_use]
    pub fn variance(&self, i: usize) -> T {
        let mut sum = T::ZERO;
        for (columns, [own, across]) in self.columns.iter().zip(self.variance) {
            for (pair, column) in columns.iter().enumerate() {
                let x = column.x.get(i).copied().unwrap_or(T::ZERO);
                let own_axis = pair % 4 == 0; // 3 i + i
                sum += x * x * if own_axis { own } else { across };
            }
        }
        sum
    }
}

impl<T: Real> Column<T> {
    /// `x+ = Phi x - Gamma e`. What an interval of seconds changes of `Phi` by the position is too
    /// little to count here.
    #[inline(never)]
    fn moves(&mut self, block: &Transition<NAV, T>) {
        let (x, e) = (self.x, self.e);
        let rows = block.phi.iter().zip(&block.gamma);
        for (i, (to, (phi, gamma))) in self.x.iter_mut().zip(rows).enumerate() {
            let mut sum = if i < POSITION { T::ZERO } else { *to };
            for (&a, &b) in phi.iter().zip(&x).take(POSITION) {
                sum += a * b;
            }
            for (&a, &b) in gamma.iter().zip(&e) {
                sum -= a * b;
            }
            *to = sum;
        }
    }
}
