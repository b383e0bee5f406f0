//! The kernel in assembly: memory layouts, calls, and the handling of values that are not finite.
#![allow(
    unsafe_code,
    reason = "assembly works on addresses; each block says why they are good"
)]

use core::arch::global_asm;
use core::mem::{MaybeUninit, offset_of};

use super::Net;
use crate::activation::{MIDDLE, TABLE};
use crate::gradient::{Sensitivities, are_finite};
use crate::infer::{Fault, Forward, Step};
use crate::normalisation::Normalisation;
use crate::real::three_finite;
use crate::shape::NEURONS;
use crate::state::State;
use crate::weights::{Layer, Weights};

global_asm!(
    ".syntax unified",
    ".fpu fpv4-sp-d16",
    include_str!("forward.s"),
    include_str!("advance.s"),
    include_str!("descend.s"),
    include_str!("functions.s"),
    include_str!("form_m4.s"),
    "functions m4",
    include_str!("form_m7.s"),
    "functions m7",
    options(raw)
);

// Offsets and sizes in bytes that the assembly relies on.
const _: () = {
    assert!(offset_of!(Net, weights) == 0 && offset_of!(Net, normalisation) == 252);
    assert!(size_of::<Layer>() == 84 && offset_of!(Weights, layers) == 0);
    assert!(offset_of!(Layer, w) == 0 && offset_of!(Layer, r) == 36 && offset_of!(Layer, b) == 72);
    assert!(offset_of!(Normalisation, input_offset) == 0);
    assert!(offset_of!(Normalisation, input_scale) == 12);
    assert!(offset_of!(Normalisation, output_scale) == 24);
    assert!(size_of::<State>() == 36 && size_of::<Forward<f32>>() == 60);
    assert!(offset_of!(Forward<f32>, input) == 0 && offset_of!(Forward<f32>, y) == 12);
    assert!(offset_of!(Forward<f32>, error) == 48);
    assert!(size_of::<Sensitivities>() == 1512 && Sensitivities::<f32>::OUTPUT == 756);
};

/// Checks the values after a flag of the FPU was set; resets the sensitivities if one is not
/// finite.
#[cold]
#[inline(never)]
fn is_finite_or_reset(sens: &mut Sensitivities) -> bool {
    let finite = sens.is_finite();
    if !finite {
        sens.reset();
    }
    finite
}

#[cold]
#[inline(never)]
fn portable_step(net: &Net, state: &mut State, input: [f32; NEURONS]) -> Step {
    net.step(state, input)
}

#[cold]
#[inline(never)]
fn portable_step_gradient(
    net: &Net,
    state: &mut State,
    sens: &mut Sensitivities,
    input: [f32; NEURONS],
) -> Step {
    net.step_gradient(state, sens, input)
}

/// Defines the module with the functions of one form.
macro_rules! form {
    ($(#[$doc:meta])* $name:ident, $forward:ident, $advance:ident, $descend:ident) => {
        $(#[$doc])*
        pub mod $name {
            use super::*;

            unsafe extern "C" {
                fn $forward(
                    net: *const Net,
                    last: *const State,
                    input: *const [f32; NEURONS],
                    forward: *mut Forward<f32>,
                    middle: *const [f32; 4],
                ) -> u32;
                fn $advance(
                    net: *const Net,
                    sens: *mut Sensitivities,
                    forward: *const Forward<f32>,
                    last: *const State,
                ) -> u32;
                fn $descend(
                    weights: *mut Weights,
                    s3: *const f32,
                    g0: f32,
                    g1: f32,
                    g2: f32,
                ) -> u32;
            }

            /// `None` when an error or their sum is not finite; the portable step then finds the
            /// fault.
            #[inline(always)]
            fn forward(net: &Net, state: &State, input: &[f32; NEURONS]) -> Option<Forward<f32>> {
                let mut forward = MaybeUninit::uninit();
                // SAFETY: all are references to what the assembly expects, laid out as asserted
                // above; it reads rows -128..128 of the table around its middle.
                let faulty = unsafe {
                    let middle = TABLE.as_ptr().add(MIDDLE);
                    $forward(net, state, input, forward.as_mut_ptr(), middle)
                };
                // SAFETY: the assembly has written all 15 numbers.
                (faulty == 0).then(|| unsafe { forward.assume_init() })
            }

            /// Advances s(k-1) to s(k). After an overflow all values are 0 and the result is false.
            #[inline(always)]
            fn advance(net: &Net, sens: &mut Sensitivities, forward: &Forward<f32>, last: &State) -> bool {
                // SAFETY: references to what the assembly expects, laid out as asserted above.
                let overflow = unsafe { $advance(net, sens, forward, last) };
                overflow == 0 || is_finite_or_reset(sens)
            }

            /// [`crate::Net::step`].
            #[inline]
            pub fn step(net: &Net, state: &mut State, input: [f32; NEURONS]) -> Step {
                match forward(net, state, &input) {
                    Some(forward) => net.accept(state, &forward),
                    None => portable_step(net, state, input),
                }
            }

            /// [`crate::Net::step_gradient`].
            #[inline]
            pub fn step_gradient(
                net: &Net,
                state: &mut State,
                sens: &mut Sensitivities,
                input: [f32; NEURONS],
            ) -> Step {
                let Some(forward) = forward(net, state, &input) else {
                    return portable_step_gradient(net, state, sens, input);
                };
                let finite = advance(net, sens, &forward, state);
                let mut step = net.accept(state, &forward);
                if !finite {
                    step.fault = Some(Fault::SensitivityOverflow);
                }
                step
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
                if !are_finite(target, rate) {
                    return net.hold(state, Fault::NonFiniteInput);
                }
                let mut step = step_gradient(net, state, sens, input);
                if step.fault.is_none() {
                    let [a, b, c] = step.output;
                    let g = [a - target[0], b - target[1], c - target[2]].map(|r| r * rate);
                    // SAFETY: 63 weights in order, and the 63 columns of s_3, as asserted above.
                    let mut descend = || unsafe {
                        let s3 = (&raw const *sens).cast::<f32>().add(Sensitivities::<f32>::OUTPUT / 4);
                        $descend(&mut net.weights, s3, g[0], g[1], g[2])
                    };
                    if !three_finite(g) || descend() != 0 {
                        step.fault = Some(Fault::Overflow);
                    }
                }
                step
            }
        }
    };
}

form!(
    /// A product and a sum in two instructions: fewest cycles on a Cortex-M4F.
    m4, lrnn_nostd_forward_m4, lrnn_nostd_advance_m4, lrnn_nostd_descend_m4
);
form!(
    /// Both in one instruction: fewest instructions, and fewest cycles on a Cortex-M7.
    m7, lrnn_nostd_forward_m7, lrnn_nostd_advance_m7, lrnn_nostd_descend_m7
);

#[cfg(not(feature = "kernel-m7"))]
pub use m4::{step, step_descend, step_gradient};
#[cfg(feature = "kernel-m7")]
pub use m7::{step, step_descend, step_gradient};
