//! What the bench knows about chips, apart from the hardware: how to identify one, and its clock,
//! flash and memory.
//!
//! The image is the binary `stm32-bench`: `cargo xtask flash --bench`. It has not run on silicon
//! yet.
#![no_std]

pub mod chip;
