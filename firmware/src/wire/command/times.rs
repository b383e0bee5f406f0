//! Times of the samples.

use serde::{Deserialize, Serialize};

/// Whether the samples have times of the receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Sync {
    /// No time pulse whose second is known.
    #[default]
    None,
    /// By the time pulse.
    Locked,
    /// By the board's clock, as it ran when the last pulse came.
    Holdover,
}

/// The answer to [`Request::GetTimes`](super::Request::GetTimes). Sample n came
/// `sample_us + (n - sample) interval_ns / 1000` after the beginning of the receiver's week. All
/// zeros without synchronisation; the last four fields while no sample has come.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Times {
    /// Synchronisation.
    pub sync: Sync,
    /// Time since the last pulse in holdover, s.
    pub holdover_s: u32,
    /// How much the board's clock is fast, in parts of 1e9.
    pub board_ppb: i32,
    /// Scatter of the pulses and of the samples about even times by the board's clock (standard
    /// deviations), microseconds.
    pub jitter_us: [f32; 2],
    /// Number of a sample, as in [`Alignment`](super::Alignment) and [`Window`](super::Window).
    pub sample: u32,
    /// The receiver's time at which its last byte came, microseconds of the week.
    pub sample_us: u64,
    /// Interval of the samples by the receiver's clock, ns.
    pub interval_ns: f32,
    /// Standard deviation of `sample_us`, microseconds, with what the board's clock may have
    /// drifted in holdover.
    pub error_us: f32,
}
