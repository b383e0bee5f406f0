//! The same board without the learner from fixes and without an ADIS over SPI. It needs less than
//! half the flash and a quarter of the RAM.
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
    board::start::run(
        shared::learners::windows().map(|learner| learner as _),
        false,
    )
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405_window is a board binary: `cargo xtask flash` or `cargo xtask qemu`");
}
