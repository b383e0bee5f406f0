//! Conversion from physical units to network units and back. It is part of the model and is stored
//! with the weights.

use crate::real::Real;
use crate::shape::NEURONS;

/// u = (input - input_offset) * input_scale, error = y_3 * output_scale, per axis.
///
/// Choose the scales so that |u| and |y_3| stay below about 1: `input_offset` near the mean input
/// (gravity, for example), `input_scale` about 1 / (its largest deviation), `output_scale` about
/// the largest error to be expected.
///
/// ```
/// use lrnn_nostd::Normalisation;
///
/// // Accelerometers: gravity on the third axis, 20 m/s^2 beside it, errors up to 0.01 m/s^2.
/// let scales = Normalisation {
///     input_offset: [0.0, 0.0, 9.81],
///     input_scale: [0.05; 3],
///     output_scale: [0.01; 3],
/// };
/// assert_eq!(scales.input([10.0, 0.0, 9.81]), [0.5, 0.0, 0.0]);
/// assert_eq!(scales.error([0.5, 0.0, 0.0]), [0.005, 0.0, 0.0]); // m/s^2
/// ```
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)] // the kernel reads it
pub struct Normalisation<T = f32> {
    /// Subtracted from the input, in its units (rad/s or m/s^2).
    pub input_offset: [T; NEURONS],
    /// Network units per input unit (1/(rad/s) or 1/(m/s^2)).
    pub input_scale: [T; NEURONS],
    /// Error units per network unit (rad/s or m/s^2). 0 switches the axis off; such an axis cannot
    /// learn.
    pub output_scale: [T; NEURONS],
}

impl<T: Real> Normalisation<T> {
    /// No conversion: u = input and error = y_3.
    #[must_use]
    pub const fn identity() -> Self {
        let one = [T::ONE; NEURONS];
        Self {
            input_offset: [T::ZERO; NEURONS],
            input_scale: one,
            output_scale: one,
        }
    }

    /// u = (input - input_offset) * input_scale.
    #[inline(always)]
    pub fn input(&self, input: [T; NEURONS]) -> [T; NEURONS] {
        let [a, b, c] = input;
        let ([oa, ob, oc], [sa, sb, sc]) = (self.input_offset, self.input_scale);
        [(a - oa) * sa, (b - ob) * sb, (c - oc) * sc]
    }

    /// error = y_3 * output_scale.
    #[inline(always)]
    pub fn error(&self, output: [T; NEURONS]) -> [T; NEURONS] {
        let ([a, b, c], [sa, sb, sc]) = (output, self.output_scale);
        [a * sa, b * sb, c * sc]
    }

    /// These scales in another number type: exact from `f32` to `f64`, rounded to nearest the other
    /// way.
    pub fn cast<U: Real>(&self) -> Normalisation<U> {
        let cast = |values: [T; NEURONS]| values.map(|value| U::from_f64(value.to_f64()));
        Normalisation {
            input_offset: cast(self.input_offset),
            input_scale: cast(self.input_scale),
            output_scale: cast(self.output_scale),
        }
    }
}

impl<T: Real> Default for Normalisation<T> {
    fn default() -> Self {
        Self::identity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_shifted_then_scaled_in_every_number_type() {
        let scales = Normalisation {
            input_offset: [25.0, -1.0, 0.5],
            input_scale: [0.5, 4.0, 0.25],
            output_scale: [2.0, 0.5, 8.0],
        };
        assert_eq!(scales.input([27.0, -3.0, 1.5]), [1.0, -8.0, 0.25]);
        assert_eq!(scales.error([1.0, 2.0, -3.0]), [2.0, 1.0, -24.0]);
        let wide: Normalisation<f64> = scales.cast();
        assert_eq!(wide.input([27.0, -3.0, 1.5]), [1.0, -8.0, 0.25]);
        assert_eq!(wide.error([1.0, 2.0, -3.0]), [2.0, 1.0, -24.0]);
        assert_eq!(wide.cast::<f32>(), scales);
    }
}
