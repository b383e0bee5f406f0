//! Requests to the black box (`app::blackbox`), and its reports.

use serde::{Deserialize, Serialize};

/// State of the black box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum State {
    /// Recording; the oldest page is overwritten.
    #[default]
    Records,
    /// A fault has come, and it still records what follows.
    Follows,
    /// Holding the recording until it is released.
    Holds,
}

/// Why it holds, or soon will.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Cause {
    /// Not holding.
    #[default]
    None,
    /// A fault.
    Fault,
    /// A request.
    Request,
    /// A reset.
    Reset,
}

/// State of the recording, as reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Recording {
    /// State of the black box.
    pub state: State,
    /// Why it holds.
    pub cause: Cause,
    /// Fault bits at the cause.
    pub faults: u32,
    /// Time of the cause, microseconds after the device's start; 0 for a reset.
    pub at_us: u64,
    /// Pages begun since its memory was blank.
    pub pages: u32,
    /// Length of the recording, bytes.
    pub len: u32,
}

/// Order to the black box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Order {
    /// Hold what it has, so that it can be read.
    Hold,
    /// Record again.
    Release,
}
