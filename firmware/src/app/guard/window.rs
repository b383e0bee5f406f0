//! When the window watchdog of an STM32F405 may be fed (RM0090 section 22).
//!
//! It counts down from [`FULL`] and resets the board below 0x40. It does so at once, too, when it
//! is fed before it has come down to [`OPEN`]. The board feeds it by another clock, so clocks that
//! disagree are found as well as a loop that does not turn.

/// Value to feed it with: 64 ticks until it bites.
pub const FULL: u8 = 0x7F;
/// Up to here it must not be fed: 13 ticks.
pub const OPEN: u8 = FULL - 13;
/// It is fed after so many ticks by the other clock.
const DUE: u64 = 26;
/// Clocks of the bus a tick: 4096, and its greatest prescaler of 8 (RM0090 22.4).
const TICK: u64 = 4096 * 8;

/// After so long it is to be fed, microseconds, at a bus clock of `hz`. At 42 MHz 20 ms, of 50; at
/// 16 MHz 53 ms, of 131.
#[must_use]
pub fn due_us(hz: u32) -> u64 {
    (DUE * TICK * 1_000_000)
        .checked_div(u64::from(hz))
        .unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_fed_within_its_window() {
        for hz in [42_000_000, 16_000_000] {
            let tick_us = TICK as f64 * 1e6 / f64::from(hz);
            let (closed, ends) = (f64::from(FULL - OPEN) * tick_us, 64.0 * tick_us);
            let due = due_us(hz) as f64;
            // the two clocks may differ by a third, and a turn may take half of the time
            assert!(
                due * 0.67 > closed && due < ends / 2.0,
                "{hz}: {closed} {due} {ends}"
            );
        }
        assert_eq!(due_us(0), u64::MAX);
    }
}
