//! Step, gradient and descent of the network with [`Cubic`] hidden layers. On a Cortex-M4F or M7
//! with the feature `kernel-m4` or `kernel-m7` they are in assembly, elsewhere they are the methods
//! of [`crate::Net`]. All bits are the same.
//!
//! `kernel-m4` multiplies and adds in two instructions, which takes fewer cycles on that core.
//! `kernel-m7` uses one instruction that rounds twice, which takes fewer instructions. With either
//! feature both forms exist, as [`m4`] and [`m7`]. [`step`] and the other functions of this module
//! are those of the chosen feature, and of `kernel-m7` when both are set.
//!
//! ```
//! use lrnn_nostd::{Normalisation, Sensitivities, State, Weights, kernel};
//!
//! let weights = Weights::from_fn(|i| 0.02 * (i % 7) as f32 - 0.06);
//! let mut net = kernel::Net::new(weights, Normalisation::identity());
//! let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
//! let (input, target) = ([0.1, 0.2, 0.3], [0.5, 0.0, 0.0]);
//! let (mut portable, mut state_2, mut sensitivities_2) = (net, state, sensitivities);
//!
//! let step = kernel::step_descend(&mut net, &mut state, &mut sensitivities, input, &target, 0.05);
//! // The same bits as those of the portable code.
//! let same = portable.step_descend(&mut state_2, &mut sensitivities_2, input, &target, 0.05);
//! assert_eq!(step, same);
//! assert_eq!(net.weights, portable.weights);
//! ```

use crate::activation::{Cubic, Identity};
use crate::shape::Full;

/// The network that the kernel supports.
pub type Net = crate::Net<Cubic, Identity, Full, f32>;

#[cfg_attr(
    all(
        any(feature = "kernel-m4", feature = "kernel-m7"),
        target_arch = "arm",
        target_abi = "eabihf"
    ),
    path = "kernel/arm.rs"
)]
#[cfg_attr(
    not(all(
        any(feature = "kernel-m4", feature = "kernel-m7"),
        target_arch = "arm",
        target_abi = "eabihf"
    )),
    path = "kernel/portable.rs"
)]
mod form;

pub use form::{m4, m7, step, step_descend, step_gradient};
