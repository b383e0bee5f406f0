//! Board `stm32f405`: the co-processor on an STM32F405, and in QEMU (`netduinoplus2`).
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
    board::start::learning_from_fixes()
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405 is a board binary: `cargo xtask flash` or `cargo xtask qemu`");
}
