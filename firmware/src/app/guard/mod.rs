//! Decisions in case of a failure, without registers: which crystal is there ([`crystal`]), what
//! survives a reset ([`retained`]), whether the output is stuck ([`output`]), and when the window
//! watchdog may be fed ([`window`]). Whether the application is healthy is [`super::App::unwell`].

pub mod crystal;
pub mod output;
pub mod retained;
pub mod window;

/// Whether a loop that turned well at `turned_ms` is late by more than `late_ms`. The times wrap,
/// and a clock that reads less than before shows nothing: after a flash has held up the interrupts,
/// that of `embassy-stm32` is behind until its own interrupt is served.
#[must_use]
pub fn is_late(now_ms: u32, turned_ms: u32, late_ms: u32) -> bool {
    let since = now_ms.wrapping_sub(turned_ms);
    since > late_ms && since <= u32::MAX / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_goes_back_is_not_late() {
        for turned in [0, 5, 123_456, u32::MAX - 2, u32::MAX / 2] {
            let late = |after: i32| is_late(turned.wrapping_add_signed(after), turned, 6000);
            assert!(
                [-66, -33, -1, 0, 1, 6000].map(late) == [false; 6],
                "{turned}"
            );
            assert!(
                [6001, 60_000, 86_400_000].map(late) == [true; 3],
                "{turned}"
            );
        }
    }
}
