//! The state machine, in the open.
//!
//! ```text
//! Start -> Detect -> Run(mode) -> Fault(cause)
//!   |         ^         |  ^          |
//!   +---------|---------+--|----------+   (format configured: straight to Run; a mode set by command: back to Run)
//!             +---------+  the stream is of no known format any more; service mode of the sensor
//! ```
//!
//! In `Detect` and `Fault` bytes go through raw, as if nothing were here.

use crate::control::Mode;

/// Why nothing is corrected any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// What the words mean is not known, or they are of a kind that cannot be corrected (integrated angle and velocity).
    Units,
    /// The networks failed in [`FAILURES`] blocks in a row.
    Network,
}

/// Blocks in a row whose network step failed, after which the device passes everything through.
pub const FAILURES: u8 = 10;

/// Where the application is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Before the first pass.
    Start,
    /// Raw pass-through while the format is found out.
    Detect,
    /// Frames are taken apart.
    Run(Mode),
    /// Raw pass-through until a mode is set by command.
    Fault(Cause),
}

/// The phase and how often each was entered.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    phase: Phase,
    /// Detect, Run, Fault; a change of mode counts as entering Run. Held at its end.
    entered: [u32; 3],
}

impl Machine {
    /// At its start.
    pub const fn new() -> Machine {
        Machine {
            phase: Phase::Start,
            entered: [0; 3],
        }
    }

    /// Where it is.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// How often `Detect`, `Run` and `Fault` were entered.
    pub fn entered(&self) -> [u32; 3] {
        self.entered
    }

    /// Back at the start, with what was counted.
    #[must_use]
    pub fn restarted(self) -> Machine {
        Machine {
            phase: Phase::Start,
            ..self
        }
    }

    /// Find out the format.
    pub fn transition_to_detect(&mut self) {
        self.enter(0, Phase::Detect);
    }

    /// The format is known.
    pub fn transition_to_run(&mut self, mode: Mode) {
        self.enter(1, Phase::Run(mode));
    }

    /// Nothing can be corrected.
    pub fn transition_to_fault(&mut self, cause: Cause) {
        self.enter(2, Phase::Fault(cause));
    }

    fn enter(&mut self, which: usize, phase: Phase) {
        if let Some(entered) = self.entered.get_mut(which) {
            *entered = entered.saturating_add(1);
        }
        self.phase = phase;
    }
}

impl Default for Machine {
    fn default() -> Machine {
        Machine::new()
    }
}
