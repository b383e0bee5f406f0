//! Whether the application is healthy, so that the watchdogs may be fed.

use super::App;
use crate::wire::command::{fault, unwell};

/// Silence must be known for silence so long after it has begun, microseconds.
const KNOWN_US: u64 = 1_000_000;
/// Bytes that come must leave within this time, microseconds. The slowest bytes that make up a
/// frame, each just not late enough to be silence, take half of it.
const LEAVES_US: u64 = 60_000_000;
/// The command link and the receiver must be served within this time, microseconds.
const SERVED_US: u64 = 1_000_000;
/// State of the health check.
#[derive(Debug, Default)]
pub(super) struct HealthCheck {
    /// All that has left on the navigation line, or was dropped there for want of room.
    left: u64,
    /// Time of its last change, or at which no byte had come, microseconds.
    left_us: u64,
}

impl App<'_> {
    /// Why the watchdogs must not be fed: bits of [`unwell`]; 0: the application is healthy. To be
    /// called in every turn of the frame path, after [`App::poll`], with the board's time.
    ///
    /// A sensor that is silent, sends nothing that is understood, or was never connected is known
    /// and handled, and no reason to restart. Neither is a learner that was stopped: the stream
    /// goes on.
    pub fn unwell(&mut self, now_us: u64) -> u8 {
        let since = |then: u64| now_us.saturating_sub(then);
        let left = self.flow.health.left();
        let silent = self.flow.health.faults & fault::SILENT != 0;
        if left != self.upkeep.health_check.left || silent {
            (
                self.upkeep.health_check.left,
                self.upkeep.health_check.left_us,
            ) = (left, now_us);
        }
        let silence = u64::from(self.flow.config.silence_us).saturating_add(KNOWN_US);
        let unknown = !silent && since(self.link.heard_us) > silence;
        let words = unknown || since(self.upkeep.health_check.left_us) > LEAVES_US;
        [
            (words, unwell::WORDS),
            (since(self.served_us) > SERVED_US, unwell::LINKS),
        ]
        .into_iter()
        .fold(0, |bits, (is, bit)| if is { bits | bit } else { bits })
    }

    /// State of the board: the supply is too low for writing flash, and how often the navigation
    /// line was reopened since it did not send.
    pub fn board_is(&mut self, supply_low: bool, reopened: u16) {
        if let Some(reset) = &mut self.flow.config.hardware.reset {
            (reset.supply_low, reset.reopened) = (supply_low, reopened);
        }
    }
}
