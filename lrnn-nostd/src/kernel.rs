//! Step, gradient and descent of the network with [`Cubic`] hidden layers. On a Cortex-M4F or M7
//! with the feature `kernel-m4` or `kernel-m7` they are in assembly, elsewhere they are the methods
//! of [`crate::Net`]. All bits are the same.
//!
//! `kernel-m4` multiplies and adds in two instructions, which takes fewer cycles on that core.
//! `kernel-m7` uses one instruction that rounds twice, which takes fewer instructions. With either
//! feature both forms exist, as [`m4`] and [`m7`]. [`step`] and the other functions of this module
//! are those of the chosen feature, and of `kernel-m7` when both are set.

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
