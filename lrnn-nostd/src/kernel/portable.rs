//! The kernel for machines without an assembly form.

use super::Net;
use crate::gradient::Sensitivities;
use crate::infer::Step;
use crate::shape::NEURONS;
use crate::state::State;

/// [`crate::Net::step`].
#[inline]
pub fn step(net: &Net, state: &mut State, input: [f32; NEURONS]) -> Step {
    net.step(state, input)
}

/// [`crate::Net::step_gradient`].
#[inline]
pub fn step_gradient(
    net: &Net,
    state: &mut State,
    sens: &mut Sensitivities,
    input: [f32; NEURONS],
) -> Step {
    net.step_gradient(state, sens, input)
}

/// [`crate::Net::step_descend`].
#[inline]
pub fn step_descend(
    net: &mut Net,
    state: &mut State,
    sens: &mut Sensitivities,
    input: [f32; NEURONS],
    target: &[f32; NEURONS],
    rate: f32,
) -> Step {
    net.step_descend(state, sens, input, target, rate)
}

/// The same functions under the name of a core, so that code that names a core compiles everywhere.
pub mod m4 {
    pub use super::{step, step_descend, step_gradient};
}

/// As [`m4`].
pub mod m7 {
    pub use super::{step, step_descend, step_gradient};
}
