//! Why and how the board started: the answer to [`Request::GetReset`](super::Request::GetReset).

use serde::{Deserialize, Serialize};

/// Bits of [`Reset::causes`]: what the chip says of its last reset. Several may be set: an internal
/// reset pulls the reset pin, too.
pub mod cause {
    /// A brown-out: the supply fell below the level of the option bytes. Set at power-on, too.
    pub const BROWN_OUT: u8 = 1 << 0;
    /// The reset pin.
    pub const PIN: u8 = 1 << 1;
    /// Power-on.
    pub const POWER_ON: u8 = 1 << 2;
    /// Reset by software: a fault of the core, a stopped crystal, a debug probe.
    pub const SOFTWARE: u8 = 1 << 3;
    /// The independent watchdog.
    pub const WATCHDOG: u8 = 1 << 4;
    /// The window watchdog.
    pub const WINDOW: u8 = 1 << 5;
    /// A low-power mode was entered that the option bytes forbid.
    pub const LOW_POWER: u8 = 1 << 6;
}

/// Bits of [`Crash::unwell`]: why the watchdogs were no longer fed.
pub mod unwell {
    /// The sensor's words neither flow nor are known to be absent, or they come and do not leave.
    pub const WORDS: u8 = 1 << 0;
    /// The command link and the receiver have not had their turn.
    pub const LINKS: u8 = 1 << 1;
    /// The learner's work does not end: of older firmware, a newer one goes on without it.
    pub const LEARNER: u8 = 1 << 2;
    /// The navigation line does not send, although it was reopened.
    pub const OUTPUT: u8 = 1 << 3;
}

/// Source of the core's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClockSource {
    /// Crystal and PLL.
    Crystal,
    /// Internal oscillator and PLL: the crystal does not start, or no value fits it.
    Internal,
    /// Internal oscillator alone: the PLL did not lock.
    InternalDirect,
    /// A simulator without clock registers.
    Simulator,
}

/// The crystal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crystal {
    /// Crystal that the firmware was built for, MHz.
    pub built_mhz: u8,
    /// Crystal frequency in use, MHz; 0: the crystal is not in use.
    pub used_mhz: u8,
    /// As measured at start against the internal oscillator, kHz, and as exact as that is; 0: it
    /// could not be measured.
    pub measured_khz: u32,
}

/// Cause of the end of the run before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum CrashKind {
    /// A fault of the core: `cfsr` and `hfsr` say which.
    Fault,
    /// A fault of the core with the stack pointer outside the stack.
    StackOverflow,
    /// The crystal stopped.
    ClockStopped,
    /// A panic.
    Panic,
    /// The window watchdog was about to bite: `unwell` gives why it was not fed; 0: the frame path
    /// did not run.
    NotFed,
}

/// Phase of the frame path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum LoopPhase {
    /// The frame path had not begun.
    Starting,
    /// A burst of an ADIS.
    Burst,
    /// A pass of the application.
    Poll,
    /// Lines were reopened.
    Open,
    /// The store.
    Store,
    /// The search for an ADIS.
    Look,
    /// Watchdogs and sleep.
    Sleep,
    /// The learner.
    Learn,
}

/// The record of a crash. It survives the reset, in RAM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crash {
    /// Cause of the crash.
    pub kind: CrashKind,
    /// Phase of the frame path.
    pub phase: LoopPhase,
    /// Bits of [`unwell`].
    pub unwell: u8,
    /// Program counter; 0: not known, since the stack could not be read.
    pub pc: u32,
    /// The return address there.
    pub lr: u32,
    /// Program status register there.
    pub xpsr: u32,
    /// Configurable fault status (Armv7-M B3.2.15).
    pub cfsr: u32,
    /// Hard fault status (B3.2.16).
    pub hfsr: u32,
    /// Address of a memory management fault, if `cfsr` says that it is valid.
    pub mmfar: u32,
    /// Address of a bus fault, likewise.
    pub bfar: u32,
    /// Time since the start before, ms.
    pub uptime_ms: u32,
    /// Crashes since power-on, this one included.
    pub number: u32,
    /// Starts since this crash; 1: it caused the last reset.
    pub starts: u32,
}

/// Why and how the board started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reset {
    /// Bits of [`cause`].
    pub causes: u8,
    /// Time since that start, ms, modulo 2^32.
    pub uptime_ms: u32,
    /// Safe start: the last starts ended too early, so the device stays in bypass and does not use
    /// the stored weights.
    pub safe: bool,
    /// Source of the clock.
    pub clock: ClockSource,
    /// The core's clock, Hz.
    pub core_hz: u32,
    /// The crystal.
    pub crystal: Crystal,
    /// Bit rate that the command link has in fact, bit/s.
    pub command_baud: u32,
    /// Brown-out level of the option bytes, 0 (off) to 3 (2.7 V); `None`: not known.
    pub brown_out: Option<u8>,
    /// The supply is too low for writing flash.
    pub supply_low: bool,
    /// Times since start that the navigation line was reopened, since it did not send.
    pub reopened: u16,
    /// The last crash since power-on.
    pub crash: Option<Crash>,
}

impl Reset {
    /// Whether the program has ended itself or was ended by a watchdog, and the power stayed on.
    #[must_use]
    pub fn is_by_software(&self) -> bool {
        let power = cause::BROWN_OUT | cause::POWER_ON;
        let own = cause::SOFTWARE | cause::WATCHDOG | cause::WINDOW;
        self.causes & power == 0 && self.causes & own != 0
    }
}
