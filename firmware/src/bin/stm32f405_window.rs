//! The same board without the learner from fixes and without an ADIS over SPI: less than half its flash, a quarter of its RAM.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../board/stm32f405/mod.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../board/memory.rs"]
mod memory;
#[cfg(target_os = "none")]
#[path = "../board/time.rs"]
mod time;
#[cfg(target_os = "none")]
#[path = "../board/uart.rs"]
mod uart;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    board::run::run::<false>(memory::windows().map(|learner| learner as _))
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405_window is a board binary: `cargo xtask flash` or `cargo xtask qemu`");
}
