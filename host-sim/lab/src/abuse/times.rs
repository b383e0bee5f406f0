//! Durations of the parts of a drive.

use serde::{Deserialize, Serialize};

/// Time between the end of a disturbance and the end of the fixes, in which the device recovers, s.
pub const RECOVERY_S: u32 = 600;

/// Durations of the parts of a drive, s.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Times {
    /// Standstill from power-on on, at least 60.
    pub standstill_s: u32,
    /// Drive with fixes, at least 60.
    pub aided_s: u32,
    /// Drive without fixes, on which the navigation computer is judged, at least 60.
    pub free_s: u32,
}

impl Default for Times {
    fn default() -> Self {
        Self {
            standstill_s: 300,
            aided_s: 900,
            free_s: 1320,
        }
    }
}

impl Times {
    /// Second at which the fixes end.
    #[must_use]
    pub fn until(&self) -> u32 {
        self.standstill_s + self.aided_s
    }
}

/// When a disturbance acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Span {
    /// From power-on to the end of the fixes. Faults of a sensor or a line act always.
    Always,
    /// While the vehicle drives with fixes.
    Drive,
    /// From the end of the standstill on; it ends [`RECOVERY_S`] before the fixes do, or after a
    /// third of a shorter drive.
    Ends,
    /// As [`Span::Ends`], but only for this long, s.
    For(u32),
    /// Before the standstill, while a [`super::motion::Motion::Begins`] lasts.
    Before,
}

impl Span {
    /// Start and end, s after power-on of the drive in which the device learns.
    #[must_use]
    pub fn seconds(self, times: &Times) -> [f64; 2] {
        let (from, until) = (times.standstill_s, times.until());
        let ends = until - RECOVERY_S.min(2 * times.aided_s / 3);
        let [from, to] = match self {
            Self::Always => [0, u32::MAX],
            Self::Drive => [from, until],
            Self::Ends => [from, ends],
            // in the middle of the drive, so that the device learns before and after it
            Self::For(length) => {
                let from = (from + (ends - from) / 3).min(ends);
                [from, (from + length).min(ends)]
            }
            Self::Before => [0, 0], // no drive has it by itself
        };
        [from.into(), to.into()]
    }

    /// Whether the disturbance ends long enough before the fixes for a recovery.
    #[must_use]
    pub fn ends(self) -> bool {
        matches!(self, Self::Ends | Self::For(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disturbances_that_end_leave_ten_minutes() {
        let times = Times::default();
        assert_eq!(Span::Ends.seconds(&times), [300.0, 600.0]);
        assert_eq!(Span::Drive.seconds(&times), [300.0, 1200.0]);
        let [from, to] = Span::For(60).seconds(&times);
        assert!(from >= 300.0 && to <= 600.0 && to - from == 60.0);
        let short = Times {
            standstill_s: 100,
            aided_s: 200,
            free_s: 60,
        };
        assert_eq!(Span::Ends.seconds(&short), [100.0, 167.0]);
    }
}
