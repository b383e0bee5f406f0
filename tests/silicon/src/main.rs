//! Cycles of the measured pieces of work on a board with an STM32F4, F7 or H7: `cargo xtask flash
//! --bench [--chip NAME]`.
//!
//! The works are those whose instructions `cargo xtask bench` counts in QEMU. Here the core's cycle
//! counter (DWT, ARM DDI 0403, C1.8) counts, so flash wait states, caches, branches and divisions
//! are in it. QEMU has no such counter: there the works are done, and said not to have been
//! counted.
//!
//! One image for all: it finds out core and chip ([`silicon::chip`]), and its first lines tell what
//! belongs to the figures.
//!
//! | chip | clock | flash | memory |
//! |---|---|---|---|
//! | F405, F407, F415, F417 | 168 MHz, as the board image | 5 wait states, prefetch and accelerator on | SRAM |
//! | F411, F412, F42x, F43x, F446, F469, F479 | as after reset, 16 MHz | as after reset: no wait states | SRAM |
//! | F72x to F77x | as after reset, 16 MHz | as after reset: no wait states; I-cache and D-cache on | DTCM 64 KiB (F72x to F75x) or 128 |
//! | H72x to H75x, H7A3, H7B3 | as after reset, 64 MHz | as after reset: 7 wait states (H743); I-cache and D-cache on | DTCM |
//! | another | as it is | as it is; on a Cortex-M7 I-cache and D-cache on | as it is |
//!
//! The log is in the first 5 KiB of RAM: on an F7 or H7 in DTCM, which the D-cache does not hold,
//! so that a probe reads what was written. The stack, and on it the works' own memory, begins at
//! the end of 128 KiB: where DTCM has 64, in the SRAM behind it, which is cached. At its deepest
//! (the learner's works, 67 kB) the stack comes down to the last 2 kB of those 64. The image needs
//! more than 256 KiB of flash, so an F730, F750, H730, H750 or H7B0 cannot hold it; an F401 or F410
//! has too little memory. It executes 190 million instructions: at 16 MHz 12 s or more.
//!
//! It has run in QEMU and in a model of these chips (`tests/qemu/judges/stm32bench.py`), on silicon
//! not yet.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../../../firmware/src/board/stm32f405/clock.rs"]
#[allow(unsafe_code, reason = "the board's; each block says why it is sound")]
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
#[allow(unsafe_code, reason = "a load that may fault")]
mod read;
#[cfg(target_os = "none")]
mod start;

#[cfg(target_os = "none")]
use start::end;

/// Bytes of log that are kept: all lines, since nobody may be reading yet.
#[cfg(target_os = "none")]
const LOG_SIZE: usize = 4096;

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32-bench is a board binary: `cargo xtask flash --bench`");
}
