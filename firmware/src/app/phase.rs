//! The state machine.
//!
//! ```text
//! Start -> Detect -> Run(mode) -> Fault(cause)
//!   |         ^         |  ^          |
//!   +---------|---------+--|----------+
//!             +---------+
//! ```
//!
//! A configured format, or an ADIS at the SPI, leads from `Start` straight to `Run`. From `Run` a
//! stream of no known format, or the sensor's service mode, leads back to `Detect`; an ADIS at the
//! SPI never does. A mode set by command leads from `Fault` back to `Start`. In `Detect` and
//! `Fault` bytes pass through unchanged.

use super::counts::Count;
use crate::control::Mode;

/// Why samples are no longer corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The samples' units are not known, or are of a kind that cannot be corrected (integrated
    /// angle and velocity).
    Units,
    /// The networks failed in [`FAILURES`] blocks in a row.
    Network,
}

/// After this many blocks in a row whose network step failed the device passes everything through.
pub const FAILURES: u8 = 10;

/// State of the application.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Before the first pass.
    Start,
    /// Raw pass-through while the format is detected.
    Detect,
    /// Frames are decoded and corrected.
    Run(Mode),
    /// Raw pass-through until a mode is set by command.
    Fault(Cause),
}

/// The phase and how often each was entered.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    phase: Phase,
    /// Detect, Run, Fault; a change of mode counts as entering Run.
    entered: [Count; 3],
}

impl Machine {
    /// A machine in state `Start`.
    pub const fn new() -> Machine {
        Machine {
            phase: Phase::Start,
            entered: [Count::of(0); 3],
        }
    }

    /// The present state.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Number of times that `Detect`, `Run` and `Fault` were entered.
    pub(super) fn entered(&self) -> [Count; 3] {
        self.entered
    }

    /// Sets the numbers of times that the states were entered.
    pub(super) fn has_entered(&mut self, times: [Count; 3]) {
        self.entered = times;
    }

    /// A machine in state `Start`, with the same counters.
    #[must_use]
    pub fn restarted(self) -> Machine {
        Machine {
            phase: Phase::Start,
            ..self
        }
    }

    /// The format must be detected.
    pub fn transition_to_detect(&mut self) {
        self.enter(0, Phase::Detect);
    }

    /// The format is known.
    pub fn transition_to_run(&mut self, mode: Mode) {
        self.enter(1, Phase::Run(mode));
    }

    /// Samples cannot be corrected.
    pub fn transition_to_fault(&mut self, cause: Cause) {
        self.enter(2, Phase::Fault(cause));
    }

    fn enter(&mut self, which: usize, phase: Phase) {
        if let Some(entered) = self.entered.get_mut(which) {
            entered.add(1);
        }
        self.phase = phase;
    }
}

impl Default for Machine {
    fn default() -> Machine {
        Machine::new()
    }
}
