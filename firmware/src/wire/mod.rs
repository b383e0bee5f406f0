//! Bytes to inertial samples and back.
//!
//! A compensator between sensor and navigation computer decodes a frame, corrects the six values of
//! its sample, and sends the frame on with every other byte unchanged. So each format is a view
//! over the frame's own bytes, and all have the same shape: field positions, view, `Repr` with
//! `parse` and `emit`, and golden bytes in the tests.
//!
//! | module | frames | checksum | source |
//! |---|---|---|---|
//! | [`stim300`] | Safran STIM300, all datagrams | CRC-32/MPEG-2 | datasheet TS1524 rev 31 |
//! | [`kvh`] | KVH 1725/1750/1775: A, B, C, BIT | CRC-32/MPEG-2 | ICD 56-0298 rev B, recordings |
//! | [`novatel`] | RAWIMU(S), RAWIMU(S)X, INSPVAS | CRC-32 from 0 | OEM7 pages, recordings |
//! | [`hg4930`] | Honeywell HG4930 0x01, 0x02, 0xCA | 16-bit sum | installation manual |
//! | [`sbgecom`] | SBG Systems IMU_DATA, IMU_SHORT | CRC-16/KERMIT | headers of SBG's library |
//! | [`epson`] | Epson M-G3xx bursts at a UART | 16-bit sum | data sheet, Epson's drivers |
//! | [`vectornav`] | VectorNav binary messages | CRC-16/XMODEM | UM001, VectorNav's library |
//! | [`mavlink`] | MAVLink 2 and 1, HIGHRES_IMU | CRC-16/MCRF4XX | mavlink.io, pymavlink |
//! | [`xsens`] | Xsens MTData2 | byte sum | MT0101P, Xsens' public headers |
//! | [`adis`] | ADIS bursts over SPI | byte sum, CRC-32 | Linux and ArduPilot drivers |
//! | [`adis::uart`] | the same in frames of ours | CRC-32 | this crate |
//! | [`ubx`] | u-blox NAV-PVT and ten others | Fletcher-8 | gpsd and pyubx2 |
//! | [`nmea`] | NMEA 0183: GGA, RMC and six others | exclusive or | gpsd, pynmeagps |
//! | [`novatel::best`] | BESTPOS, BESTVEL, HEADING2 | CRC-32 from 0 | OEM7 pages, `novatel_edie` |
//! | [`sbf`] | Septentrio PVTGeodetic and others | CRC-16/XMODEM | SBF reference guides, pysbf2 |
//! | [`command`] | our own command link | CRC-32 | this crate |
//!
//! [`Framer`] finds the frames of one format in a stream, and [`Detector`] finds the format. A
//! frame that was found good is a [`Checked`], which is read and changed without another check.
//!
//! **A new format of an IMU** implements [`ImuProtocol`] in a file of its own, and gets a row in
//! the table above and in the list `imu_formats!` below. Detection, framing, correction, settings,
//! simulated drives and the tests of all formats follow from that row. A format whose frames do not
//! state their content implements [`LaidOut`] too. A [`ReceiverFormat`] has fixes and no samples.
//!
//! **Panics:** nothing here panics, allocates or loops without bound, on any input. Bytes that are
//! no frame yield an [`Error`] or a [`framer::Kind`]. Fields outside a buffer read zero (see
//! [`field`]).
//!
//! **Axes:** x, y, z of the sensor's own frame, in the sensor's own sense. `NovAtel`'s order and
//! negated y are undone here. Nothing is rotated.

pub mod adis;
pub mod checked;
pub mod checksum;
pub mod cobs;
pub mod command;
pub mod cut;
pub mod detect;
pub mod epson;
pub mod field;
pub mod framer;
pub mod hg4930;
pub mod kvh;
pub mod mavlink;
pub mod nmea;
pub mod novatel;
pub mod protocol;
pub mod receiver;
mod registry;
pub mod sbf;
pub mod sbgecom;
pub mod sequence;
pub mod stim300;
pub mod ubx;
pub mod vectornav;
pub mod xsens;

#[cfg(test)]
mod examples;
#[cfg(test)]
mod properties;

pub(crate) use checked::USUAL;
pub use checked::{Checked, Source};
pub use detect::Detector;
pub use framer::Framer;
pub use protocol::{Change, Fields, Framing, ImuProtocol, LaidOut, Simulated};
pub use receiver::ReceiverFormat;
pub use receiver::stream::Receiver;
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
    /// [`sbgecom`]
    SbgEcom: sbgecom,
    /// [`epson`], with the layout of its frames
    Epson(layout: epson::Layout): epson,
    /// [`adis::uart`]
    AdisUart: adis_uart,
    /// [`vectornav`], with the values that are corrected
    VectorNav(values: vectornav::Values): vectornav,
    /// [`mavlink`], with the IMU that is corrected
    Mavlink(imu: mavlink::Imu): mavlink,
    /// [`xsens`]
    Xsens: xsens,
}

use crate::sample::{Axes, RawSample};
use adis::uart as adis_uart;
use serde::{Deserialize, Serialize};

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
    /// The frame is good but carries no sample, or not one of this kind.
    Content,
}

/// Result of [`Framing::scan`] for the beginning of some bytes of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    /// Perhaps a frame. To decide, this number of bytes is needed in all; fewer decide nothing.
    Partial(usize),
    /// A frame of so many bytes with a right checksum. It holds a sample, or a receiver's fix.
    Frame(usize),
    /// Another message of so many bytes with a right checksum. It is passed on unchanged.
    Other(usize),
    /// A start mark with a wrong checksum or an impossible length.
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

/// Content of a frame: see [`Checked::read`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The six values. They are zero where the frame has none.
    pub sample: RawSample,
    /// The axes that the frame has values for.
    pub present: Axes,
    /// The axes that the sensor itself calls good. Absent axes are not.
    pub valid: Axes,
    /// The sensor's counter, for [`sequence::Rule`].
    pub counter: Option<u16>,
    /// Time from the sample's validity to the start of transmission, microseconds.
    pub latency_us: Option<u16>,
    /// Time stamp, s, which starts from 0 again: see [`sequence::Sequence::Time`].
    pub time: Option<f64>,
    /// Sensor temperature x, y, z, degrees Celsius.
    pub temperature: Option<[f32; 3]>,
}

impl Reading {
    /// Values and validity, nothing else known.
    fn new(sample: RawSample, present: Axes, valid: Axes) -> Reading {
        Reading {
            sample,
            present,
            valid,
            counter: None,
            latency_us: None,
            time: None,
            temperature: None,
        }
    }
}
