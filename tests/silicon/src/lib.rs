//! What the bench knows of chips, apart from the hardware: which one it runs on, and what clock,
//! flash and memory that one has.
//!
//! The image is the binary `stm32-bench`: `cargo xtask flash --bench`. Nobody has run it on silicon
//! yet.
#![no_std]

pub mod chip;
