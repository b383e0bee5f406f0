//! The parameters theta: W, R and b of three layers, in the order of [`crate::shape`].

use crate::real::Real;
use crate::shape::{B, LAYERS, NEURONS, PARAMS, PARAMS_PER_LAYER, R};

/// The parameters of one layer: x = W y_below + R y_last + b.
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)] // parameter order
pub struct Layer<T = f32> {
    /// W_pq from unit q of the layer below to unit p.
    pub w: [[T; NEURONS]; NEURONS],
    /// R_pq from unit q of this layer, one step earlier, to unit p.
    pub r: [[T; NEURONS]; NEURONS],
    /// b_p of unit p.
    pub b: [T; NEURONS],
}

impl<T: Real> Layer<T> {
    /// The 21 values in parameter order.
    #[inline(always)]
    fn to_array(self) -> [T; PARAMS_PER_LAYER] {
        // In full: opt-level "z" leaves loops as they are, and clears what they are to fill.
        let [[w0, w1, w2], [w3, w4, w5], [w6, w7, w8]] = self.w;
        let [[r0, r1, r2], [r3, r4, r5], [r6, r7, r8]] = self.r;
        let [b0, b1, b2] = self.b;
        [
            w0, w1, w2, w3, w4, w5, w6, w7, w8, // row by row
            r0, r1, r2, r3, r4, r5, r6, r7, r8, //
            b0, b1, b2,
        ]
    }

    /// A layer from 21 values in parameter order.
    #[inline(always)]
    fn from_array(values: &[T; PARAMS_PER_LAYER]) -> Self {
        let square = |at: usize| {
            [
                [values[at], values[at + 1], values[at + 2]],
                [values[at + 3], values[at + 4], values[at + 5]],
                [values[at + 6], values[at + 7], values[at + 8]],
            ]
        };
        Self {
            w: square(0),
            r: square(R),
            b: [values[B], values[B + 1], values[B + 2]],
        }
    }
}

/// The 63 parameters of a network. They are dimensionless, because inputs and outputs are
/// normalised. 252 bytes in `f32`.
///
/// ```
/// use lrnn_nostd::Weights;
///
/// let mut weights: Weights = Weights::zero();
/// weights.layers[2].b[0] = 0.5; // the bias of the first output
/// assert_eq!(weights.get(60), Some(0.5)); // in the order of `lrnn_nostd::shape`
/// assert_eq!(Weights::from_array(&weights.to_array()), weights);
/// assert_eq!(weights.get(63), None);
/// ```
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Weights<T = f32> {
    /// Layers from the input to the output.
    pub layers: [Layer<T>; LAYERS],
}

impl<T: Real> Weights<T> {
    /// All parameters 0: the output of the network is 0 for any input.
    #[must_use]
    pub const fn zero() -> Self {
        let square = [[T::ZERO; NEURONS]; NEURONS];
        let layer = Layer {
            w: square,
            r: square,
            b: [T::ZERO; NEURONS],
        };
        Self {
            layers: [layer; LAYERS],
        }
    }

    /// Computes each parameter from its index; `value` is called in order 0..63.
    pub fn from_fn(mut value: impl FnMut(usize) -> T) -> Self {
        let mut weights = Self::zero();
        for (index, parameter) in weights.iter_mut().enumerate() {
            *parameter = value(index);
        }
        weights
    }

    /// Weights from the 63 values in parameter order.
    #[inline]
    pub fn from_array(values: &[T; PARAMS]) -> Self {
        let mut weights = Self::zero();
        weights.set_all(values);
        weights
    }

    /// Sets all parameters from the 63 values in parameter order.
    #[inline]
    pub fn set_all(&mut self, values: &[T; PARAMS]) {
        for (layer, values) in self.layers.iter_mut().zip(values.as_chunks().0) {
            *layer = Layer::from_array(values);
        }
    }

    /// The 63 values in parameter order.
    #[inline]
    pub fn to_array(&self) -> [T; PARAMS] {
        let [one, two, three] = self.layers;
        let rows = [one.to_array(), two.to_array(), three.to_array()];
        let values = rows.as_flattened().first_chunk();
        values.copied().unwrap_or([T::ZERO; PARAMS]) // there are as many
    }

    /// The parameter with this index; `None` from 63 on.
    pub fn get(&self, index: usize) -> Option<T> {
        let layer = self.layers.get(index / PARAMS_PER_LAYER)?;
        let within = index % PARAMS_PER_LAYER;
        match within {
            0..R => layer.w.as_flattened().get(within),
            R..B => layer.r.as_flattened().get(within - R),
            _ => layer.b.get(within - B),
        }
        .copied()
    }

    /// Sets the parameter with this index. Returns false, and sets nothing, from 63 on.
    pub fn set(&mut self, index: usize, value: T) -> bool {
        let parameter = self.iter_mut().nth(index);
        parameter.map(|parameter| *parameter = value).is_some()
    }

    /// Iterates over the values in parameter order.
    #[inline]
    pub fn iter(&self) -> impl Iterator<Item = T> + '_ {
        self.layers
            .iter()
            .flat_map(|layer| {
                layer
                    .w
                    .as_flattened()
                    .iter()
                    .chain(layer.r.as_flattened())
                    .chain(&layer.b)
            })
            .copied()
    }

    /// Iterates over the parameters, mutable, in parameter order.
    #[inline]
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> + '_ {
        self.layers.iter_mut().flat_map(|layer| {
            let Layer { w, r, b } = layer;
            w.as_flattened_mut()
                .iter_mut()
                .chain(r.as_flattened_mut())
                .chain(b)
        })
    }

    /// Whether every parameter is finite.
    pub fn is_finite(&self) -> bool {
        let finite = |values: &[T]| values.iter().all(|value| value.has_finite_bits());
        self.layers.iter().all(|layer| {
            let Layer { w, r, b } = layer;
            finite(w.as_flattened()) && finite(r.as_flattened()) && finite(b)
        })
    }

    /// These weights in another number type: exact from `f32` to `f64`, rounded to nearest the
    /// other way.
    pub fn cast<U: Real>(&self) -> Weights<U> {
        let mut values = self.iter();
        Weights::from_fn(|_| {
            values
                .next()
                .map_or(U::ZERO, |value| U::from_f64(value.to_f64()))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_parameter_has_its_place_and_is_looked_at() {
        let values: [f32; PARAMS] = core::array::from_fn(|i| i as f32 - 31.0);
        let weights = Weights::from_array(&values);
        assert_eq!(weights.to_array(), values);
        assert!(weights.is_finite());
        for i in 0..PARAMS {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut wrong = values;
                wrong[i] = bad;
                assert!(!Weights::from_array(&wrong).is_finite(), "{i} {bad}");
            }
        }
    }
}
