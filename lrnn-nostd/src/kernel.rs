//! Step, gradient and descent of the network with [`Cubic`] hidden layers: in assembly on a Cortex-M4F or M7 with the feature `kernel-m4` or
//! `kernel-m7`, otherwise the methods of [`crate::Net`]. The bits are the same, all of them.
//!
//! `kernel-m4` multiplies and adds in two instructions, which is fewer cycles on that core; `kernel-m7` in one that rounds twice, which is
//! fewer instructions. With either feature both are there, as [`m4`] and [`m7`]; [`step`] and the others are those of the feature, of
//! `kernel-m7` when both are set.

use crate::activation::{Cubic, Identity};
use crate::shape::Full;

/// The one network the kernel is written for.
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
