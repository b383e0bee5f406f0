//! Board images in QEMU. On the desktop this library builds the images ([`images`]), runs them
//! ([`machine`]), measures them ([`size`], [`count`]), and compares the cost with limits
//! ([`budget`]) and with the last measurement ([`committed`]). On the target it is the start-up and
//! exit of the programs in `src/bin`.
//!
//! [`replay`] is on both sides. The board images themselves run in [`live`] machines, with sockets
//! at their serial lines, or are [`listening`] at ports.
#![cfg_attr(target_os = "none", no_std)]

pub mod replay;
#[cfg(target_os = "none")]
pub mod target;

#[cfg(not(target_os = "none"))]
pub mod alone;
#[cfg(not(target_os = "none"))]
pub use xtask::boards;
#[cfg(not(target_os = "none"))]
pub mod budget;
#[cfg(not(target_os = "none"))]
pub mod chip;
#[cfg(not(target_os = "none"))]
pub mod committed;
#[cfg(not(target_os = "none"))]
pub mod count;
#[cfg(not(target_os = "none"))]
pub mod cycles;
#[cfg(not(target_os = "none"))]
pub mod debugger;
#[cfg(not(target_os = "none"))]
pub mod drive;
#[cfg(not(target_os = "none"))]
pub mod emulator;
#[cfg(not(target_os = "none"))]
pub mod images;
#[cfg(not(target_os = "none"))]
pub mod judges;
#[cfg(not(target_os = "none"))]
pub mod listening;
#[cfg(not(target_os = "none"))]
pub mod live;
#[cfg(not(target_os = "none"))]
pub mod lockstep;
#[cfg(not(target_os = "none"))]
pub mod machine;
#[cfg(not(target_os = "none"))]
pub mod memory;
#[cfg(not(target_os = "none"))]
pub mod protocol;
#[cfg(not(target_os = "none"))]
pub mod report;
#[cfg(not(target_os = "none"))]
pub mod rp2350;
#[cfg(not(target_os = "none"))]
pub mod size;
#[cfg(not(target_os = "none"))]
pub mod software;

/// `main` of a target program built for the desktop, as `cargo build --workspace` does.
#[cfg(not(target_os = "none"))]
pub fn only_in_qemu() {
    println!("this is a program for QEMU; `cargo xtask check` runs it");
}
