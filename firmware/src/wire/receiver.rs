//! The formats of GNSS receivers. Their frames contain fixes and no inertial values.
//!
//! | format | messages | joined with |
//! |---|---|---|
//! | [`ubx`] | NAV-PVT; or a position and a velocity of [`ubx::more`] | NAV-COV, NAV-RELPOSNED |
//! | [`nmea`] | GGA or GNS, RMC or VTG; RMC or GLL alone | GST, HDT, THS, ZDA |
//! | [`novatel::best`](best) | BESTPOS, BESTVEL; PSRPOS and the like; BESTXYZ | HEADING2 |
//! | [`sbf`] | PVTGeodetic or PVTCartesian | their covariances, AttEuler, AttCovEuler |
//!
//! A [`stream::Receiver`] finds the messages of one format, or finds out which format it is, and
//! joins the messages of an [`epoch`] to one fix.

pub(super) mod cartesian;
pub mod epoch;
pub mod stream;
mod voice;

use super::novatel::best;
use super::{Framing, Scan, nmea, sbf, ubx};
use epoch::{Head, Values};
use serde::{Deserialize, Serialize};

/// Format of a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReceiverFormat {
    /// [`ubx`]
    Ubx,
    /// [`nmea`]
    Nmea,
    /// [`best`]
    Novatel,
    /// [`sbf`]
    Sbf,
}

/// State of the receiver's stream, as reported over the command link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ReceiverStatus {
    /// The format; `None` while it is not known.
    pub format: Option<ReceiverFormat>,
    /// Time of validity of the last good fix, ms of the GPS week.
    pub time_ms: Option<u32>,
    /// Age of that fix when it was complete, by the time pulse, microseconds; `None` without a
    /// pulse that is believed.
    pub age_us: Option<u32>,
    /// Edges of the time pulse since the configuration. It saturates.
    pub pulses: u32,
}

impl ReceiverFormat {
    /// All formats.
    pub const ALL: [ReceiverFormat; 4] = [
        ReceiverFormat::Ubx,
        ReceiverFormat::Nmea,
        ReceiverFormat::Novatel,
        ReceiverFormat::Sbf,
    ];

    /// Kind and time of a message that a framer has checked; `None` if it is not read, or has no
    /// time that can be read.
    pub fn head(self, frame: &[u8]) -> Option<Head> {
        match self {
            ReceiverFormat::Ubx => ubx::head(frame),
            ReceiverFormat::Nmea => nmea::head(frame),
            ReceiverFormat::Novatel => best::head(frame),
            ReceiverFormat::Sbf => sbf::head(frame),
        }
    }

    /// Day of the week and ms of that day of a message that states a date and is of no epoch.
    pub fn date(self, frame: &[u8]) -> Option<(u8, u32)> {
        match self {
            ReceiverFormat::Nmea => nmea::date(frame),
            _ => None,
        }
    }

    /// Writes the values of a message that has a [`ReceiverFormat::head`].
    pub fn read(self, frame: &[u8], values: &mut Values) {
        match self {
            ReceiverFormat::Ubx => ubx::read(frame, values),
            ReceiverFormat::Nmea => nmea::read(frame, values),
            ReceiverFormat::Novatel => best::read(frame, values),
            ReceiverFormat::Sbf => sbf::read(frame, values),
        }
    }

    /// The kinds of messages that are waited for in the first epoch, a bit each.
    fn usual(self) -> u16 {
        match self {
            ReceiverFormat::Ubx => ubx::USUAL,
            ReceiverFormat::Nmea => nmea::USUAL,
            ReceiverFormat::Novatel => best::USUAL,
            ReceiverFormat::Sbf => sbf::USUAL,
        }
    }
}

impl Framing for ReceiverFormat {
    #[inline(never)] // not on the way of a sample: smaller, not faster
    fn scan(self, bytes: &[u8]) -> Scan {
        match self {
            ReceiverFormat::Ubx => ubx::scan(bytes),
            ReceiverFormat::Nmea => nmea::scan(bytes),
            ReceiverFormat::Novatel => best::scan(bytes),
            ReceiverFormat::Sbf => sbf::scan(bytes),
        }
    }
}

#[cfg(test)]
impl super::examples::Examples for ReceiverFormat {
    fn example(self, n: u8) -> std::vec::Vec<u8> {
        match self {
            ReceiverFormat::Ubx => ubx::tests::example(n),
            ReceiverFormat::Nmea => nmea::tests::example(n),
            ReceiverFormat::Novatel => best::tests::example(n),
            ReceiverFormat::Sbf => sbf::tests::example(n),
        }
    }

    fn remade(self, frame: &[u8]) -> Result<std::vec::Vec<u8>, super::Error> {
        match self {
            ReceiverFormat::Ubx => ubx::tests::remade(frame),
            ReceiverFormat::Nmea => nmea::tests::remade(frame),
            ReceiverFormat::Novatel => best::tests::remade(frame),
            ReceiverFormat::Sbf => sbf::tests::remade(frame),
        }
    }
}

/// One message alone, for the tests of the formats.
#[cfg(test)]
pub(super) mod testing {
    use super::epoch::{Head, Sigmas, Time, Values};
    use super::{Framing, ReceiverFormat};
    use crate::fix::{Heading, NOT_MEASURED, OBSERVATIONS, Position};
    use crate::wire::{Error, exactly};
    use std::vec::Vec;

    pub const NONE: Sigmas = [NOT_MEASURED; OBSERVATIONS];

    /// Content of a message.
    #[derive(Debug, PartialEq)]
    pub struct DecodedMessage {
        pub time: Time,
        pub day: Option<u8>,
        pub position: Option<Position>,
        pub velocity: Option<[f64; 3]>,
        pub own: Sigmas,
        pub stated: Sigmas,
        pub assumed: Sigmas,
        pub heading: Option<Heading>,
        pub heading_sigma: Option<f32>,
    }

    /// A message of 32-bit words, taken apart and joined again, with a recomputed checksum.
    pub fn remade(
        format: ReceiverFormat,
        frame: &[u8],
        seal: fn(&mut [u8]),
    ) -> Result<Vec<u8>, Error> {
        if !exactly(frame, |bytes| format.scan(bytes))? {
            return Err(Error::Content);
        }
        let words = frame.as_chunks::<4>().0.iter();
        let words = words.map(|word| u32::from_le_bytes(*word));
        let mut made: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        seal(&mut made);
        Ok(made)
    }

    pub fn parse(format: ReceiverFormat, frame: &[u8]) -> Result<DecodedMessage, Error> {
        if !exactly(frame, |bytes| format.scan(bytes))? {
            return Err(Error::Content);
        }
        let Head { time, .. } = format.head(frame).ok_or(Error::Field)?;
        let mut v = Values::NONE;
        format.read(frame, &mut v);
        Ok(DecodedMessage {
            time,
            day: v.day,
            position: v.own[0].is_finite().then_some(v.position),
            velocity: v.own[3].is_finite().then_some(v.velocity),
            own: v.own,
            stated: v.stated,
            assumed: v.assumed,
            heading: v.heading,
            heading_sigma: v.heading_sigma,
        })
    }
}
