//! `lrnn-nostd` in a crate of its own, as a user has it, on Cortex-M and RISC-V in QEMU. The
//! programs in `src/bin` compare the digests of the shared vectors with the desktop's, count
//! instructions, and show how large a network is.
#![no_std]

#[cfg(target_os = "none")]
pub mod machine;
#[cfg(target_os = "none")]
pub mod works;
