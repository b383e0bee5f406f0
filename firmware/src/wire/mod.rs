//! Bytes to inertial words and back.
//!
//! A compensator between sensor and navigation computer decodes a frame, corrects six words and sends the frame on with
//! every other byte as it came. So each protocol is a view over the frame's own bytes, in one file of one shape: field
//! positions, view, `Repr` with `parse` and `emit`, golden bytes in the same file's tests.
//!
//! | file | frames | sum | source |
//! |---|---|---|---|
//! | [`stim300`] | Safran STIM300, all datagrams | CRC-32/MPEG-2 | datasheet TS1524 rev 31 |
//! | [`kvh`] | KVH 1725/1750/1775, formats A, B, C, BIT | CRC-32/MPEG-2 | ICD 56-0298 rev B, recorded frames |
//! | [`novatel`] | RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX, INSPVAS, binary | CRC-32 from 0 | OEM7 documentation, recorded frames |
//! | [`hg4930`] | Honeywell HG4930 0x01, 0x02, 0xCA | 16-bit sum | performance and installation manual |
//! | [`adis`] | ADIS1646x/1647x/1650x and 1649x bursts, over SPI | byte sum, CRC-32 | Linux and ArduPilot drivers |
//! | [`ubx`] | u-blox NAV-PVT | Fletcher-8 | gpsd and pyubx2 |
//! | [`command`] | our own command link | CRC-32 | this crate |
//!
//! [`Framer`] finds the frames of one [`Format`] in a stream, [`Detector`] finds the format. [`read`] and [`write()`] are
//! the same six words for all formats.
//!
//! **Panics:** nothing here panics, allocates or loops without bound, on any input. Bytes from a line are answered by an
//! [`Error`] or a [`framer::Kind`]; fields outside a buffer read zero (see [`field`]).
//!
//! **Axes:** x, y, z of the sensor's own frame, in the sensor's own sense, except that `NovAtel`'s order and negated y are
//! undone here. Nothing is rotated.

pub mod adis;
pub mod checked;
pub mod checksum;
pub mod cobs;
pub mod command;
pub mod detect;
pub mod field;
pub mod framer;
pub mod hg4930;
pub mod kvh;
pub mod novatel;
pub mod protocol;
pub mod receiver;
mod registry;
pub mod sequence;
pub mod stim300;
pub mod ubx;

#[cfg(test)]
mod examples;
#[cfg(test)]
mod properties;

pub use checked::{Checked, Source};
pub use detect::Detector;
pub use framer::Framer;
pub use protocol::{Change, Fields, Framing, ImuProtocol, Simulated};
pub use receiver::ReceiverFormat;
pub use sequence::Stream;

registry::imu_formats! {
    /// [`stim300`]
    Stim300: stim300,
    /// [`kvh`]
    Kvh: kvh,
    /// [`novatel`]
    Novatel: novatel,
    /// [`hg4930`]
    Hg4930: hg4930,
}

use crate::sample::{Axes, RawSample};

/// 2 to the power given (-1022 to 1023), exactly.
const fn power_of_two(power: i32) -> f64 {
    f64::from_bits(((1023 + power) as u64) << 52)
}

/// Why bytes are not the frame they were taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Error {
    /// Fewer or more bytes than the frame has.
    Length,
    /// Not the start of this frame.
    Header,
    /// The checksum disagrees with the bytes.
    Checksum,
    /// A field holds a value that has no meaning.
    Field,
    /// The frame is good but carries no inertial words, or not the ones given.
    Content,
}

/// What stands at the beginning of some bytes of a stream. Every protocol has a `scan` with this answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    /// Perhaps a frame: nothing more can be told before there are so many bytes in all.
    Partial(usize),
    /// A frame of so many bytes with inertial words (NAV-PVT: a fix), its checksum right.
    Frame(usize),
    /// A message of so many bytes, its checksum right, that is sent on as it is.
    Other(usize),
    /// A start mark whose checksum is wrong, or whose length cannot be.
    BadChecksum,
    /// No start mark.
    Garbage,
}

/// Whether `bytes` are exactly one good message: true for a frame, false for another message.
fn exactly(bytes: &[u8], scan: impl FnOnce(&[u8]) -> Scan) -> Result<bool, Error> {
    match scan(bytes) {
        Scan::Frame(len) if len == bytes.len() => Ok(true),
        Scan::Other(len) if len == bytes.len() => Ok(false),
        Scan::Frame(_) | Scan::Other(_) | Scan::Partial(_) => Err(Error::Length),
        Scan::BadChecksum => Err(Error::Checksum),
        Scan::Garbage => Err(Error::Header),
    }
}

/// What [`read`] finds in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The six words; zero where the frame has none.
    pub words: RawSample,
    /// The axes the frame has words for.
    pub present: Axes,
    /// The axes the sensor itself calls good. Absent axes are not.
    pub valid: Axes,
    /// The sensor's counter, for [`sequence::Rule`].
    pub counter: Option<u16>,
    /// From time of validity to start of transmission, microseconds.
    pub latency_us: Option<u16>,
    /// Time stamp, s, which starts from 0 again: see [`sequence::Sequence::Time`].
    pub time: Option<f64>,
    /// Sensor temperature x, y, z, degrees Celsius.
    pub temperature: Option<[f32; 3]>,
}

impl Reading {
    /// Values and validity, nothing else known.
    fn new(words: RawSample, present: Axes, valid: Axes) -> Reading {
        Reading {
            words,
            present,
            valid,
            counter: None,
            latency_us: None,
            time: None,
            temperature: None,
        }
    }
}
