//! Cycles of the measured pieces of work on a board with an STM32F4, F7 or H7: `cargo xtask flash
//! --bench [--chip NAME]`.
//!
//! The pieces of work are those whose instructions `cargo xtask bench` counts in QEMU. Here the
//! core's cycle counter (DWT, ARM DDI 0403, C1.8) counts, so the figures include flash wait states,
//! caches, branches and divisions. QEMU has no such counter: there the image does the work and
//! reports that it was not counted.
//!
//! One image runs on all chips. It identifies core and chip ([`silicon::chip`]), and its first
//! lines state the conditions of the figures:
//!
//! - F405, F407, F415, F417: 168 MHz as in the board image; flash with 5 wait states, prefetch and
//!   accelerator on; memory in SRAM.
//! - F411, F412, F42x, F43x, F446, F469, F479: 16 MHz as after reset; flash without wait states;
//!   memory in SRAM.
//! - F72x to F77x: 16 MHz as after reset; flash without wait states, I-cache and D-cache on; memory
//!   in 64 KiB (F72x to F75x) or 128 KiB of DTCM.
//! - H72x to H75x, H7A3, H7B3: 64 MHz as after reset; flash with 7 wait states (H743) as after
//!   reset, I-cache and D-cache on; memory in DTCM.
//! - Another chip: everything as it is; on a Cortex-M7 I-cache and D-cache on.
//!
//! The log is in the first 5 KiB of RAM. On an F7 or H7 that is DTCM, which the D-cache does not
//! hold, so that a probe reads what was written. The stack, which also holds the memory of the
//! works, begins at the end of 128 KiB. Where DTCM has 64 KiB, this is in the SRAM behind it, which
//! is cached. At its deepest (the learner's works, 67 kB) the stack reaches the last 2 kB of those
//! 64 KiB. The image needs more than 256 KiB of flash, so it does not fit on an F730, F750, H730,
//! H750 or H7B0; an F401 or F410 has too little memory. It executes 190 million instructions: at 16
//! MHz 12 s or more.
//!
//! It has run in QEMU and in a model of these chips (`tests/qemu/judges/stm32bench.py`), not on
//! silicon.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/clock.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
#[allow(dead_code, reason = "what only the board asks for")]
mod clock;
#[cfg(target_os = "none")]
mod cycles;
#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "the interrupt table and the fault handler")]
mod faults;
#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/log.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
mod log;
#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/measure.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
mod measure;
#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "a load that may fault")]
mod read;
#[cfg(target_os = "none")]
mod start;

#[cfg(target_os = "none")]
use start::end;

/// Size of the log in bytes. It holds all lines, because a probe may connect later.
#[cfg(target_os = "none")]
const LOG_SIZE: usize = 4096;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32-bench is a board binary: `cargo xtask flash --bench`");
}
