//! The parts of the application beside the flow.

use super::super::counts::Count;
use super::super::pulse::TimePulse;
use super::super::server::{InitialState, Server};
use super::health_check::HealthCheck;
use super::links::UnreadBytes;
use super::service::Service;
use crate::fix::Fix;
use crate::wire::adis::DetectedSensor;
use crate::wire::command::Packets;
use crate::wire::framer::Framer;
use crate::wire::{Detector, ImuFormat, Receiver, ReceiverFormat};

/// The sensor's line: from bytes to frames.
#[derive(Debug)]
pub(super) struct SensorLink {
    pub(super) framer: Framer,
    pub(super) detector: Detector,
    /// Bytes in which no format was found.
    pub(super) undetected: u32,
    /// Bytes taken from the line since start, modulo 2^32.
    pub(super) taken: u32,
    /// Time of the sensor's last byte, microseconds.
    pub(super) heard_us: u64,
    /// Time of the last frame's last byte, microseconds: that of the last sample.
    pub(super) sampled_us: u64,
    /// Since when no frame has come, microseconds, and how many had come until then.
    pub(super) frameless_us: u64,
    pub(super) frames_seen: Count,
    /// The sensor was asked for its service mode.
    pub(super) service: Option<Service>,
}

impl SensorLink {
    /// Before the first byte.
    pub(super) fn new(format: Option<ImuFormat>) -> SensorLink {
        SensorLink {
            framer: Framer::new(format.unwrap_or(ImuFormat::Stim300)),
            detector: Detector::new(),
            undetected: 0,
            taken: 0,
            heard_us: 0,
            sampled_us: 0,
            frameless_us: 0,
            frames_seen: Count::default(),
            service: None,
        }
    }
}

/// An ADIS at the board's SPI.
#[derive(Debug, Default)]
pub(super) struct SpiSensor {
    pub(super) detected: Option<DetectedSensor>,
    /// Whether it must be set up again.
    pub(super) set_up: bool,
    /// Faults a second ago that a sensor with its factory settings shows.
    pub(super) odd: u32,
}

/// The command link.
#[derive(Debug)]
pub(super) struct Commands {
    pub(super) packets: Packets,
    pub(super) unread: UnreadBytes,
    pub(super) server: Server,
    /// The board stores what [`App::job`] gave.
    pub(super) storing: bool,
}

impl Commands {
    pub(super) fn new(initial: InitialState) -> Commands {
        Commands {
            packets: Packets::new(),
            unread: UnreadBytes::NOTHING,
            server: Server::new(initial),
            storing: false,
        }
    }
}

/// The GNSS receiver and its time pulse.
#[derive(Debug)]
pub(super) struct Gnss {
    pub(super) receiver: Receiver,
    pub(super) pulse: TimePulse,
    /// The latest fix that the receiver vouches for.
    pub(super) fix: Option<Fix>,
}

impl Gnss {
    pub(super) fn new(format: Option<ReceiverFormat>) -> Gnss {
        Gnss {
            receiver: Receiver::new(format),
            pulse: TimePulse::default(),
            fix: None,
        }
    }

    /// Another configuration has come. The last fix stays.
    pub(super) fn restart(&mut self, format: Option<ReceiverFormat>) {
        self.receiver.restart(format);
        self.pulse = TimePulse::default();
    }
}

/// Checks that the application makes once a second.
#[derive(Debug, Default)]
pub(super) struct Upkeep {
    pub(super) due: bool,
    /// Seconds, modulo 256.
    pub(super) seconds: u8,
    /// Whether the configuration in use follows from its record: see [`integrity`].
    pub(super) as_recorded: bool,
    /// Conditions under which the watchdogs are fed.
    pub(super) health_check: HealthCheck,
}
