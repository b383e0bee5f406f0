//! Result of a soak.

use crate::disturb::COUNT;

/// A violation of the requirements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Violation {
    /// A message that is no frame was changed.
    Changed,
    /// A frame was changed while nothing was corrected.
    Inexact,
    /// Bytes left that had not come.
    MadeUp,
    /// More bytes are pending than the framer has room for.
    Kept,
    /// The application did not become idle.
    Restless,
    /// A counter went back.
    Counter,
    /// A correction was beyond its limit, or not a number.
    Limit,
    /// The store returned something that was not stored.
    Store,
    /// Replaying the black box does not give the same bytes.
    BlackBox,
    /// The soak's own buffers were too small.
    Overrun,
}

/// The lines, as in [`Report::lines`].
pub const LINES: [&str; 4] = ["navigation computer", "commands", "receiver", "sensor"];

/// Result of a soak.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Report {
    /// Digest of the output of all lines.
    pub digest: u64,
    /// Digest of each of [`LINES`].
    pub lines: [u64; 4],
    /// Bytes received from the sensor.
    pub came: u64,
    /// Bytes sent on all lines.
    pub left: u64,
    /// Samples of the sensor.
    pub samples: u64,
    /// Number of power-ons.
    pub power_ons: u32,
    /// Messages that left unchanged.
    pub same: u64,
    /// Frames that left corrected.
    pub corrected: u64,
    /// Those that are bursts of an ADIS.
    pub corrected_bursts: u64,
    /// Messages that found no room.
    pub full: u64,
    /// Seconds in which the learner navigated.
    pub navigated: u32,
    /// Records stored.
    pub stored: u32,
    /// Attempts to store that failed.
    pub failed: u32,
    /// How often each kind of disturbance began.
    pub begun: [u32; COUNT],
    /// Most passes without idle time.
    pub passes: u32,
    /// The first violation, and the sample at which it was found.
    pub violation: Option<(Violation, u64)>,
}
