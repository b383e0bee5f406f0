//! A reference over a window, with constant memory: sums are stored instead of samples.

use crate::gradient::Sensitivities;
use crate::normalisation::Normalisation;
use crate::real::Real;
use crate::shape::{NEURONS, PARAMS};

/// A = sum y_3(k) dt and Psi = dA/dtheta = sum s_3(k) dt over the steps of a window; 768 bytes in
/// `f32`. [`crate::learn::Learner`] has one; use it alone to learn by a rule of your own.
///
/// ```
/// use lrnn_nostd::learn::Window;
/// use lrnn_nostd::{Net, Normalisation, Sensitivities, State, Weights};
///
/// let net: Net = Net::new(Weights::zero(), Normalisation::identity());
/// let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
/// let mut window = Window::new();
/// for _ in 0..10 {
///     let step = net.step_gradient(&mut state, &mut sensitivities, [0.1, 0.0, 0.2]);
///     window.add(&step.output, &sensitivities, 0.1);
/// }
/// // The true sum over this second, given late: its residual, and how each weight changes it.
/// let residual = window.residual(&[0.5, 0.5, 0.5], &net.normalisation);
/// assert_eq!(residual, [-0.5, -0.5, -0.5]);
/// assert!((window.psi()[0][60] - 1.0).abs() < 1e-6); // by the first output's bias, in one second
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window<T = f32> {
    sum: [T; NEURONS],
    psi: [[T; PARAMS]; NEURONS],
}

impl<T: Real> Window<T> {
    /// A constant, because at opt-level "z" a call of [`Window::new`] makes one on the stack and
    /// copies it.
    const EMPTY: Self = Self::new();

    /// An empty window.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            sum: [T::ZERO; NEURONS],
            psi: [[T::ZERO; PARAMS]; NEURONS],
        }
    }

    /// Resets to [`Window::new`].
    pub fn reset(&mut self) {
        *self = Self::EMPTY;
    }

    /// Adds one step: `output` = y_3, `dt` in s.
    #[inline]
    pub fn add(&mut self, output: &[T; NEURONS], sens: &Sensitivities<T>, dt: T) {
        let [a, b, c] = &mut self.psi;
        for theta in 0..PARAMS {
            let s = sens.of(theta);
            a[theta] += s[0] * dt;
            b[theta] += s[1] * dt;
            c[theta] += s[2] * dt;
        }
        for j in 0..NEURONS {
            self.sum[j] += output[j] * dt;
        }
    }

    /// r = A - A_ref, where A_ref = `reference` / output_scale. `reference` is in physical units
    /// times s, r in network units times s. Where the scale is 0 the axis is switched off: r is 0,
    /// and its row of [`Window::psi`] says nothing.
    #[inline]
    pub fn residual(
        &self,
        reference: &[T; NEURONS],
        normalisation: &Normalisation<T>,
    ) -> [T; NEURONS] {
        core::array::from_fn(|j| match normalisation.output_scale[j] {
            scale if scale == T::ZERO => T::ZERO,
            scale => self.sum[j] - reference[j] / scale,
        })
    }

    /// Clears the rows of Psi of the axes that are switched off.
    pub(crate) fn leave_out(&mut self, normalisation: &Normalisation<T>) {
        for (row, &scale) in self.psi.iter_mut().zip(&normalisation.output_scale) {
            if scale == T::ZERO {
                *row = [T::ZERO; PARAMS];
            }
        }
    }

    /// A = sum y_3 dt, in network units times s.
    pub fn sum(&self) -> &[T; NEURONS] {
        &self.sum
    }

    /// Psi = dA/dtheta: one row for each output.
    #[inline]
    pub fn psi(&self) -> &[[T; PARAMS]; NEURONS] {
        &self.psi
    }
}

impl<T: Real> Default for Window<T> {
    fn default() -> Self {
        Self::new()
    }
}
