//! Board images in QEMU. On the desktop this library builds the images ([`images`]), runs them ([`machine`]), measures them
//! ([`size`], [`count`]) and knows what they may cost ([`budget`]); on the target it is the start-up and exit of the programs
//! in `src/bin`.
//!
//! One machine serves for all: `netduinoplus2`, QEMU's STM32F405, so that images, memory map and core are the product's. (The
//! `mps2` boards want flash at 0 and a link script of their own, and their SysTick is six times coarser.)
#![cfg_attr(target_os = "none", no_std)]

#[cfg(target_os = "none")]
pub mod target;

#[cfg(not(target_os = "none"))]
pub mod budget;
#[cfg(not(target_os = "none"))]
pub mod count;
#[cfg(not(target_os = "none"))]
pub mod images;
#[cfg(not(target_os = "none"))]
pub mod machine;
#[cfg(not(target_os = "none"))]
pub mod size;

/// `main` of a target program built for the desktop, as `cargo build --workspace` does.
#[cfg(not(target_os = "none"))]
pub fn only_in_qemu() {
    println!("this is a program for QEMU; `cargo xtask test` runs it");
}
