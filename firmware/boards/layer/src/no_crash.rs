//! A chip that keeps no record of a crash over a reset.

use cortex_m::peripheral::SCB;
use firmware::link::rates::Clock;
use firmware::wire::command::{LoopPhase, Reset};

/// The loop begins with this.
pub const fn during(_: LoopPhase) {}

/// A panic.
pub fn panicked() -> ! {
    SCB::sys_reset()
}

/// Nothing is kept.
#[derive(Debug)]
pub struct Guard;

impl Guard {
    /// At start. The last value: the board was switched on.
    pub fn start(_: &Clock) -> (Self, Option<Reset>, bool) {
        (Self, None, switched_on())
    }

    /// The loop has turned.
    #[allow(clippy::unused_self, reason = "as on chips that keep a record")]
    pub const fn turned(&mut self, _: u64, _: u8) {}
}

/// Whether the chip was switched on, or its supply broke down: else it says what has reset it
/// (nRF52840 PS 5.3.7.13).
#[cfg(feature = "nrf")]
fn switched_on() -> bool {
    let reasons = embassy_nrf::pac::POWER.resetreas();
    let none = reasons.read().0 == 0;
    reasons.modify(|_| {}); // a bit that is written is cleared
    none
}

/// Whether the chip was switched on. A register of the watchdog outlasts the resets that the chip
/// does itself (RP2350 datasheet 12.9); the mark in it is of a start before.
#[cfg(feature = "rp")]
fn switched_on() -> bool {
    const STARTED: u32 = u32::from_le_bytes(*b"LRNN");
    let watchdog = embassy_rp::pac::WATCHDOG;
    let before = watchdog.scratch0().read();
    watchdog.scratch0().write_value(STARTED);
    before != STARTED && watchdog.reason().read().0 == 0
}
