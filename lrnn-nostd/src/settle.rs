//! The state that a network reaches when its input stays as it is.
//!
//! Inputs that drive an error, such as a temperature, are there before power-on: a sensor that has
//! been off for hours, or that was switched off and on again, is in equilibrium with what its
//! thermometer reads. So a network with such inputs begins in its steady state, not in the zero
//! state, whose transient would be a warm-up that the sensor does not have.

use crate::activation::Activation;
use crate::infer::{Net, activity};
use crate::real::{Real, all_finite};
use crate::shape::{Feedback, NEURONS};
use crate::state::State;
use crate::weights::Layer;

/// Newton steps of a layer, at most; fewer when no unit moves by more than the root of the
/// resolution near 1. Each unit is solved for itself with the others as they are: alone it
/// converges quadratically, and feedback between units linearly, as far as these steps go.
const STEPS: usize = 32;

impl<H: Activation, O: Activation, F: Feedback, T: Real> Net<H, O, F, T> {
    /// Sets the state to the one that the network reaches under a constant `input` (physical
    /// units, as for [`Net::step`]). A state that is not finite is not taken: the old one stays.
    ///
    /// What is found is a steady state wherever all entries of R are within +-0.3 in f32 (+-0.25 in
    /// f64), because a layer then has one and the search ends there. With stronger feedback there
    /// may be none or several, and the search may end beside them: a unit that feeds itself by 1 or
    /// more stays at 0, although with a saturating activation it may have stable states elsewhere.
    /// What was found is taken in any case, and the steps that follow lead away from it;
    /// [`Net::is_steady`] tells.
    ///
    /// Sensitivities are not settled: they remain as they are, those of no step after
    /// [`crate::Sensitivities::reset`].
    ///
    /// ```
    /// use lrnn_nostd::{Net, Normalisation, State, Weights};
    ///
    /// let weights = Weights::from_fn(|i| 0.05 * (i % 5) as f32);
    /// let net: Net = Net::new(weights, Normalisation::identity());
    /// let mut state = State::new();
    /// net.settle(&mut state, [0.5, 0.0, 0.0]);
    /// assert!(net.is_steady(&state, [0.5, 0.0, 0.0]));
    /// let settled = state.output();
    /// let next = net.step(&mut state, [0.5, 0.0, 0.0]).output;
    /// assert!((next[0] - settled[0]).abs() < 1e-3); // no transient
    /// ```
    pub fn settle(&self, state: &mut State<T>, input: [T; NEURONS]) {
        let u = self.normalisation.input(input);
        let [one, two, three] = &self.weights.layers;
        let first = steady::<H, F, T>(one, &u);
        let second = steady::<H, F, T>(two, &first);
        let third = steady::<O, F, T>(three, &second);
        let y = [first, second, third];
        if all_finite(y.as_flattened()) {
            state.y = y;
        }
    }

    /// Whether a step with this input moves no unit by more than 0.03 % of 1 or its value (`f32`;
    /// the root of the resolution), with the layers below as they are.
    pub fn is_steady(&self, state: &State<T>, input: [T; NEURONS]) -> bool {
        let u = self.normalisation.input(input);
        let [one, two, three] = &self.weights.layers;
        let [first, second, third] = &state.y;
        stays::<H, F, T>(one, &u, first)
            && stays::<H, F, T>(two, first, second)
            && stays::<O, F, T>(three, second, third)
    }
}

/// Whether a step of this layer moves no value by more than the root of the resolution.
fn stays<A: Activation, F: Feedback, T: Real>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
    y: &[T; NEURONS],
) -> bool {
    let next = activity::<F, T>(layer, below, y).map(A::apply);
    y.iter().zip(next).all(|(&y, next)| {
        let moved = next - y;
        moved * moved <= T::EPSILON * (T::ONE + y * y)
    })
}

/// The solution of y = f(W below + R y + b), found from y = 0.
#[inline(never)]
fn steady<A: Activation, F: Feedback, T: Real>(
    layer: &Layer<T>,
    below: &[T; NEURONS],
) -> [T; NEURONS] {
    let mut y = [T::ZERO; NEURONS];
    let mut constant = layer.b;
    for (c, row) in constant.iter_mut().zip(&layer.w) {
        for (&w, &input) in row.iter().zip(below) {
            *c += w * input;
        }
    }
    if !all_finite(&constant) {
        return constant;
    }
    if layer.r.as_flattened().iter().all(|&r| r == T::ZERO) {
        let [a, b, c] = constant;
        return [A::apply(a), A::apply(b), A::apply(c)];
    }
    for _ in 0..STEPS {
        let last = y;
        for p in 0..NEURONS {
            let mut x = constant[p];
            for q in 0..NEURONS {
                if F::FULL || p == q {
                    x += layer.r[p][q] * y[q];
                }
            }
            let now = A::apply(x);
            // otherwise no step leads to a stable state from here, and the unit stays
            let against = T::ONE - A::slope(now) * layer.r[p][p];
            if against > T::ZERO {
                y[p] += (now - y[p]) / against;
            }
        }
        let near = |(now, before): (&T, &T)| {
            let moved = *now - *before;
            moved * moved <= T::EPSILON
        };
        if y.iter().zip(&last).all(near) {
            break;
        }
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::normalisation::Normalisation;
    use crate::{Diagonal, Full, Identity, Rational, Tanh, Weights};

    /// A network with slow units: after very many steps with one input its state is the settled
    /// one.
    #[test]
    fn the_steady_state_is_where_many_steps_end() {
        let mut weights: Weights<f64> = Weights::from_fn(|i| 0.11 * ((i * 7 % 13) as f64 - 6.0));
        for (layer, leak) in weights.layers.iter_mut().zip([0.5, 0.01, 0.6]) {
            layer.r = layer.r.map(|row| row.map(|r| 0.1 * leak * r));
            for (p, row) in layer.r.iter_mut().enumerate() {
                row[p] = 1.0 - leak;
            }
            if leak < 0.1 {
                layer.w = layer.w.map(|row| row.map(|w| w * leak * 0.05));
                layer.b = layer.b.map(|b| b * leak * 0.05);
            }
        }
        let scales = Normalisation {
            input_offset: [25.0, 0.0, 0.0],
            input_scale: [1.0 / 30.0, 60.0, 2.0],
            output_scale: [2.0; 3],
        };
        let net: Net<Rational, Identity, Full, f64> = Net::new(weights, scales);
        for input in [[25.0, 0.0, 0.0], [48.0, 0.01, 0.3], [-10.0, -0.02, 1.5]] {
            let mut settled = State::new();
            net.settle(&mut settled, input);
            assert!(net.is_steady(&settled, input));
            let mut stepped = State::new();
            for _ in 0..20_000 {
                let _ = net.step(&mut stepped, input);
            }
            let pairs = settled.y.as_flattened().iter();
            for (a, b) in pairs.zip(stepped.y.as_flattened()) {
                assert!((a - b).abs() < 1e-6, "{settled:?} {stepped:?}");
            }
        }
    }

    /// With diagonal feedback the other entries of R have no effect.
    #[test]
    fn diagonal_feedback_settles_by_its_diagonal() {
        let settled = |off: f64| {
            let mut weights: Weights<f64> = Weights::from_fn(|i| 0.1 * (i % 5) as f64 - 0.2);
            for layer in &mut weights.layers {
                for (p, row) in layer.r.iter_mut().enumerate() {
                    *row = [off; NEURONS];
                    row[p] = 0.5;
                }
            }
            let mut state = State::new();
            let net =
                Net::<Rational, Identity, Diagonal, f64>::new(weights, Normalisation::identity());
            net.settle(&mut state, [0.4, -0.3, 0.8]);
            state
        };
        assert_eq!(settled(0.3), settled(0.0));
        assert!(settled(0.0).y.as_flattened().iter().all(|y| y.abs() > 1e-3));
    }

    /// A unit that only integrates has no steady state. It stays where it is.
    #[test]
    fn an_integrator_does_not_settle() {
        let mut weights = Weights::zero();
        weights.layers[2].r = [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0; 3]];
        weights.layers[2].b = [0.1; 3];
        let net: Net = Net::new(weights, Normalisation::identity());
        let mut state = State::new();
        net.settle(&mut state, [0.0; 3]);
        assert!(!net.is_steady(&state, [0.0; 3]));
        let [a, b, c] = state.y[2];
        assert_eq!(a, 0.0);
        assert!((b - 0.2).abs() < 1e-3 && (c - 0.1).abs() < 1e-6, "{b} {c}");
    }

    #[test]
    fn an_unstable_or_infinite_network_keeps_its_state() {
        let mut weights = Weights::from_fn(|_| 0.1);
        weights.layers[0].b[1] = f32::INFINITY;
        let net: Net = Net::new(weights, Normalisation::identity());
        let mut state = State::new();
        net.settle(&mut state, [f32::NAN; 3]);
        assert!(!net.is_steady(&state, [f32::NAN; 3]));
        assert!(state.y.as_flattened().iter().all(|y| *y == 0.0));
        let mut weights = Weights::zero();
        weights.layers[2].r = [[3.0; 3]; 3];
        weights.layers[2].b = [1.0; 3];
        let net: Net = Net::new(weights, Normalisation::identity());
        net.settle(&mut state, [0.0; 3]);
        assert!(!net.is_steady(&state, [0.0; 3]));
        assert!(state.y.as_flattened().iter().all(|y| y.is_finite()));
    }

    /// Weak feedback always settles, where many steps end; what it says of strong feedback is so.
    #[test]
    fn it_says_whether_the_state_is_steady() {
        let mut seed = 3_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let mut no = 0;
        for case in 0..400 {
            let strength = if case % 2 == 0 { 0.3 } else { 3.0 };
            let mut weights: Weights<f64> = Weights::from_fn(|_| 2.0 * random());
            for layer in &mut weights.layers {
                layer.r = layer.r.map(|row| row.map(|_| strength * random()));
            }
            let net: Net<Tanh, Tanh, Full, f64> = Net::new(weights, Normalisation::identity());
            let (input, mut settled) = ([(); 3].map(|()| random()), State::new());
            net.settle(&mut settled, input);
            let steady = net.is_steady(&settled, input);
            no += u32::from(!steady);
            let mut stepped = settled;
            let steps = if strength < 1.0 { 1000 } else { 1 };
            for _ in 0..steps {
                let _ = net.step(&mut stepped, input);
            }
            let pairs = settled.y.as_flattened().iter();
            let same = pairs
                .zip(stepped.y.as_flattened())
                .all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(steady || strength > 1.0, "{case}: {weights:?}");
            assert!(same || !steady, "{case}: {settled:?} {stepped:?}");
        }
        assert!(no > 20, "{no}");
    }

    /// A saturating unit that feeds itself strongly has stable states, and the search ends at none.
    #[test]
    fn a_latch_is_not_settled() {
        let mut weights: Weights<f64> = Weights::zero();
        weights.layers[0].r[0][0] = 2.0;
        weights.layers[0].b[0] = 0.1;
        let net: Net<Tanh, Identity, Full, f64> = Net::new(weights, Normalisation::identity());
        let mut state = State::new();
        net.settle(&mut state, [0.0; 3]);
        assert!(!net.is_steady(&state, [0.0; 3]));
    }
}
