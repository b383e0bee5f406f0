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
    /// At start.
    pub const fn start(_: &Clock) -> (Self, Option<Reset>) {
        (Self, None)
    }

    /// The loop has turned.
    #[allow(clippy::unused_self, reason = "as on chips that keep a record")]
    pub const fn turned(&mut self, _: u64, _: u8) {}
}
