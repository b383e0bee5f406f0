//! Properties of the board.

use crate::configuration::{Parity, SerialLines};
use crate::control::{Field, Reason};
use crate::link::rates::Clock;
use crate::wire::command::{ClockSource, Crash, LoopPhase, Reset, cause, fault};

/// Bit rate of the command link. It never changes, so that a device can always be reached (8 data
/// bits, no parity, one stop bit).
pub const COMMAND_BAUD: u32 = 921_600;

/// Properties of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hardware {
    /// Name of the board, at most 32 bytes.
    pub name: &'static str,
    /// Clocks of the sensor's, the navigation computer's and the receiver's line.
    pub clocks: [Clock; 3],
    /// The lines can have parity and two stop bits.
    pub parity: bool,
    /// Sets of pins to choose from, at least 1.
    pub pin_sets: u8,
    /// Cause and kind of the board's start; `None`: not known.
    pub reset: Option<Reset>,
}

impl Hardware {
    /// A computer, whose lines can do everything.
    pub const DESKTOP: Hardware = Hardware {
        name: "desktop",
        clocks: [Clock::ANY; 3],
        parity: true,
        pin_sets: 1,
        reset: None,
    };

    /// Whether the board's lines support these settings.
    ///
    /// # Errors
    /// [`Reason::Baud`] with the nearest possible rate, [`Reason::Pins`] with the number of sets,
    /// [`Reason::Field`] for parity and stop bits.
    pub fn check(&self, lines: &SerialLines) -> Result<(), Reason> {
        let [sensor, navigation, receiver] = &self.clocks;
        let rates = [sensor, navigation].map(|clock| clock.rate(lines.sensor_baud));
        // of two the slower line's rate, which the other one has too
        if let Some(nearest) = rates.into_iter().filter_map(Result::err).min() {
            return Err(Reason::Baud(nearest));
        }
        receiver.rate(lines.receiver_baud).map_err(Reason::Baud)?;
        if (lines.parity != Parity::None || lines.two_stop_bits) && !self.parity {
            return Err(Reason::Field(Field::Parity));
        }
        if lines.pins >= self.pin_sets {
            return Err(Reason::Pins(self.pin_sets));
        }
        Ok(())
    }

    /// Faults that the board reports of itself: bits of [`fault`].
    #[must_use]
    pub fn faults(&self, lines: &SerialLines) -> u32 {
        let Some(reset) = &self.reset else {
            return 0;
        };
        let [_, command, _] = &self.clocks; // on the bus of the navigation computer's line
        let crystal = &reset.crystal;
        let clock = match reset.clock {
            ClockSource::Simulator => false,
            ClockSource::Crystal => crystal.used_mhz != crystal.built_mhz,
            ClockSource::Internal | ClockSource::InternalDirect => true,
        };
        let rates = matches!(self.check(lines), Err(Reason::Baud(_)));
        let rates = rates || command.rate(COMMAND_BAUD).is_err();
        [
            (clock, fault::CLOCK),
            (rates, fault::BIT_RATE),
            (reset.safe, fault::SAFE_START),
            (reset.supply_low, fault::SUPPLY),
        ]
        .into_iter()
        .fold(0, |bits, (is, bit)| if is { bits | bit } else { bits })
    }

    /// Whether this is a safe start.
    #[must_use]
    pub fn starts_safely(&self) -> bool {
        self.reset.is_some_and(|reset| reset.safe)
    }

    /// Whether the run before this start ended with a failure.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        let failed = cause::WATCHDOG | cause::WINDOW;
        self.reset
            .is_some_and(|reset| reset.causes & failed != 0 || crashed(&reset).is_some())
    }

    /// Whether this safe start leaves the store alone: the run before it crashed before its first
    /// pass.
    #[must_use]
    pub fn shuns_store(&self) -> bool {
        let phase = |reset: &Reset| crashed(reset).map(|crash| crash.phase);
        (self.reset).is_some_and(|reset| reset.safe && phase(&reset) == Some(LoopPhase::Starting))
    }

    /// The bit rates that the lines have in fact, bit/s; 0: not known.
    #[must_use]
    pub fn bauds(&self, lines: &SerialLines) -> [u32; 3] {
        let mut bauds = bauds(lines);
        for (clock, baud) in self.clocks.iter().zip(&mut bauds) {
            *baud = match clock.hz {
                0 => 0,
                _ => clock.nearest(*baud).baud,
            };
        }
        bauds
    }
}

/// The crash that ended the run before.
fn crashed(reset: &Reset) -> Option<Crash> {
    reset.crash.filter(|crash| crash.starts == 1)
}

/// The configured bit rates of the sensor's, the navigation computer's and the receiver's line.
#[must_use]
pub fn bauds(lines: &SerialLines) -> [u32; 3] {
    [lines.sensor_baud, lines.sensor_baud, lines.receiver_baud]
}
