//! Board `stm32f405` for QEMU, whose machine has no core-coupled memory: the learner lies in RAM
//! (`__ccm_in_ram` in `memory.x`). Code and constants are those of the board; only addresses
//! differ.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../board/stm32f405/mod.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../board/shared/mod.rs"]
mod shared;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    board::run::learning_from_fixes()
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405_qemu is an image for QEMU: `cargo xtask qemu`");
}
