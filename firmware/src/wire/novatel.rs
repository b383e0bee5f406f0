//! `NovAtel` OEM raw IMU logs in binary: RAWIMU, RAWIMUS, RAWIMUX, RAWIMUSX.
//!
//! Source: docs.novatel.com, OEM7 (log and header pages); golden frames of `novatel_edie`, of which
//! the HG1700-AG58 one is a recorded ring-laser sample. Little-endian throughout.
//!
//! ```text
//! short header, 12 bytes
//!   AA 44 13 | payload length u8 | id u16 | week u16 | ms of week u32
//! long header, 28 bytes
//!   AA 44 12 | 28 | id u16 | type | port | payload length u16 | ... | week u16 @14 | ms u32 @16
//! payload, 40 bytes
//!   RAWIMU(S)   week u32 @0
//!   RAWIMU(S)X  info u8 @0, IMU type u8 @1, week u16 @2
//!   all         second of week f64 @4 | status u32 @12 | values @16
//! values      accelerometer z, -y, x, gyro z, -y, x    (i32 increments per IMU sample; of the
//!             Epson types 41, 61 and 62 rates and accelerations)
//! CRC-32 over header and payload
//! ```
//!
//! **The order is z, y, x and y is negated**; [`Frame`] undoes both. The smallest number on the
//! wire has no opposite: it reads as the largest one, and stays as it is unless it is corrected.
//!
//! Trap: `novatel_oem7_driver` takes the foot as 1/3.2808 m, 12 ppm more than 0.3048 m. A velocity
//! compared with its output differs by that much. Compare counts.

use super::checksum::{crc32_novatel, crc32_novatel_change};
use super::field::{Mark, head, mark, put, resealed, take};
use super::{Error, Reading, Scan, exactly, power_of_two as two};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::units::{DEGREE, FOOT, G};
use serde::{Deserialize, Serialize};

/// Bytes of a short-header frame.
pub const SHORT_LEN: usize = 12 + PAYLOAD + 4;
/// Bytes of a long-header frame.
pub const LONG_LEN: usize = 28 + PAYLOAD + 4;
/// All four logs have the same payload length.
const PAYLOAD: usize = 40;

/// Positions in the headers and, from its start, in the payload.
mod at {
    pub const SHORT_PAYLOAD_LEN: usize = 3;
    pub const LONG_HEADER_LEN: usize = 3;
    pub const ID: usize = 4;
    pub const LONG_PAYLOAD_LEN: usize = 8;
    pub const INFO: usize = 0;
    pub const IMU_TYPE: usize = 1;
    pub const SECOND: usize = 4;
    pub const STATUS: usize = 12;
    pub const ACCEL: usize = 16;
    pub const GYRO: usize = 28;
}

/// The four logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Log {
    /// 268, long header.
    Rawimu,
    /// 325, short header.
    Rawimus,
    /// 1461, long header, with IMU type.
    Rawimux,
    /// 1462, short header, with IMU type.
    Rawimusx,
}

impl Log {
    /// Message number.
    pub fn id(self) -> u16 {
        match self {
            Log::Rawimu => 268,
            Log::Rawimus => 325,
            Log::Rawimux => 1461,
            Log::Rawimusx => 1462,
        }
    }

    /// The log of a header's length and message number.
    fn from_header(header: usize, id: u16) -> Option<Log> {
        match (header, id) {
            (28, 268) => Some(Log::Rawimu),
            (12, 325) => Some(Log::Rawimus),
            (28, 1461) => Some(Log::Rawimux),
            (12, 1462) => Some(Log::Rawimusx),
            _ => None,
        }
    }

    /// Length of its header.
    pub fn header_len(self) -> usize {
        match self {
            Log::Rawimu | Log::Rawimux => 28,
            Log::Rawimus | Log::Rawimusx => 12,
        }
    }

    /// Bytes of the frame.
    pub fn frame_len(self) -> usize {
        self.header_len() + PAYLOAD + 4
    }

    /// Whether the payload begins with info and IMU type.
    pub fn is_extended(self) -> bool {
        matches!(self, Log::Rawimux | Log::Rawimusx)
    }
}

/// The log that a header announces, and the lengths of header and payload. `None` while the header
/// is incomplete.
fn header(bytes: &[u8]) -> Option<(Option<Log>, usize, usize)> {
    let short = bytes.get(2) == Some(&0x13);
    let header = if short { 12 } else { 28 };
    if bytes.len() < header {
        return None;
    }
    let id = u16::from_le_bytes(take(bytes, at::ID));
    let payload = if short {
        let [len] = take(bytes, at::SHORT_PAYLOAD_LEN);
        usize::from(len)
    } else {
        usize::from(u16::from_le_bytes(take(bytes, at::LONG_PAYLOAD_LEN)))
    };
    Some((Log::from_header(header, id), header, payload))
}

/// Whether the length that a long header states is right.
fn states_its_length(bytes: &[u8], header: usize) -> bool {
    let [stated] = take(bytes, at::LONG_HEADER_LEN);
    header != 28 || stated == 28
}

/// Looks for a log at the beginning of `bytes`. Other logs with a right CRC pass unchanged. One
/// longer than a framer waits for passes unread.
pub fn scan(bytes: &[u8]) -> Scan {
    match (
        mark(bytes, &[0xAA, 0x44, 0x12]),
        mark(bytes, &[0xAA, 0x44, 0x13]),
    ) {
        (Mark::No, Mark::No) => return Scan::Garbage,
        (Mark::Whole, _) | (_, Mark::Whole) => {}
        _ => return Scan::Partial(bytes.len() + 1),
    }
    let Some((log, header, payload)) = header(bytes) else {
        return Scan::Partial(if bytes.get(2) == Some(&0x13) { 12 } else { 28 });
    };
    if !states_its_length(bytes, header) || (log.is_some() && payload != PAYLOAD) {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    }
    let len = header + payload + 4;
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !crc_is_right(frame) => Scan::BadChecksum,
        Some(_) if log.is_some() => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

#[inline(never)]
fn crc_is_right(frame: &[u8]) -> bool {
    let crc = frame.len().saturating_sub(4);
    crc32_novatel(head(frame, crc)) == u32::from_le_bytes(take(frame, crc))
}

fn seal(frame: &mut [u8]) {
    let crc = frame.len().saturating_sub(4);
    let sum = crc32_novatel(head(frame, crc));
    put(frame, crc, sum.to_le_bytes());
}

/// A raw IMU log.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    log: Log,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one log with the right header, length and CRC.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), scan)?;
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a log whose checksum was found right.
    pub(super) fn over(buffer: T) -> Option<Frame<T>> {
        let (log, ..) = header(buffer.as_ref())?;
        log.map(|log| Frame { buffer, log })
    }

    /// Kind of the log.
    pub fn log(&self) -> Log {
        self.log
    }

    fn payload<const N: usize>(&self, at: usize) -> [u8; N] {
        take(self.buffer.as_ref(), self.log.header_len() + at)
    }

    /// Info byte (bit 0: IMU error) and IMU type, of the extended logs.
    pub fn info(&self) -> Option<(u8, ImuType)> {
        let ([info], [kind]) = (self.payload(at::INFO), self.payload(at::IMU_TYPE));
        self.log.is_extended().then_some((info, ImuType(kind)))
    }

    /// Time of the sample, second of the GPS week.
    pub fn second_of_week(&self) -> f64 {
        f64::from_le_bytes(self.payload(at::SECOND))
    }

    /// The IMU's own status word; its meaning depends on the IMU.
    pub fn status(&self) -> u32 {
        u32::from_le_bytes(self.payload(at::STATUS))
    }

    /// z, -y, x on the wire to x, y, z.
    fn triad(&self, at: usize) -> [i32; 3] {
        let value = |at| i32::from_le_bytes(self.payload(at));
        [value(at + 8), value(at + 4).saturating_neg(), value(at)]
    }

    /// Angle increments x, y, z.
    pub fn gyro(&self) -> [i32; 3] {
        self.triad(at::GYRO)
    }

    /// Velocity increments x, y, z.
    pub fn accel(&self) -> [i32; 3] {
        self.triad(at::ACCEL)
    }

    /// The six values and what goes with them. They are invalid when the info byte or a known
    /// status word says so.
    pub fn reading(&self) -> Reading {
        let good = match self.info() {
            Some((info, kind)) => info & 1 == 0 && kind.status_is_good(self.status()),
            None => true,
        };
        Reading {
            time: Some(self.second_of_week()),
            ..Reading::new(
                RawSample::Counts {
                    gyro: self.gyro(),
                    accel: self.accel(),
                },
                Axes::ALL,
                if good { Axes::ALL } else { Axes::NONE },
            )
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values and, if asked and there is room for it, [`OWN_FAULT`], and changes the
    /// CRC by the difference.
    #[inline(always)]
    pub(super) fn change(&mut self, gyro: [i32; 3], accel: [i32; 3], mark: bool) -> Option<()> {
        let payload = self.log.header_len();
        let mark = mark && self.log.is_extended();
        let bytes = self.buffer.as_mut();
        resealed(
            bytes,
            payload + at::ACCEL,
            crc_change,
            |place: &mut [u8; VALUES]| {
                put_values(place, 0, gyro, accel);
            },
        )?;
        if mark {
            resealed(
                bytes,
                payload + at::INFO,
                crc_change,
                |[info, ..]: &mut [u8; 4]| {
                    *info |= OWN_FAULT;
                },
            )?;
        }
        Some(())
    }
}

/// Bytes of the six values.
const VALUES: usize = 24;

/// Accelerometers first, each triad as z, -y, x.
#[inline(always)]
fn put_values(bytes: &mut [u8], at: usize, gyro: [i32; 3], accel: [i32; 3]) {
    for (at, [x, y, z]) in [(at, accel), (at + VALUES / 2, gyro)] {
        let on_wire = i32::from_le_bytes(take(bytes, at + 4));
        let y = if on_wire.saturating_neg() == y {
            on_wire // the smallest number stays
        } else {
            y.saturating_neg()
        };
        for (n, value) in [z, y, x].into_iter().enumerate() {
            put(bytes, at + 4 * n, value.to_le_bytes());
        }
    }
}

/// Our own fault bit in the info byte of the extended logs, reserved by `NovAtel`. RAWIMU and
/// RAWIMUS have no room for it.
pub const OWN_FAULT: u8 = 0x80;

/// Change of the CRC.
fn crc_change(bits: &[u8], after: usize) -> [u8; 4] {
    crc32_novatel_change(bits, after).to_le_bytes()
}

/// `NovAtel`'s number of an IMU model (table "IMU type" of the RAWIMUX page).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImuType(pub u8);

impl ImuType {
    /// Scale of the values, of the types whose scale is published. They are increments, but for the
    /// Epson types: `novatel_oem7_driver` divides the scale of these by the rate. It rounds 1/66
    /// degree per second to 0.0151515, which is 1 ppm less.
    pub fn units(self) -> Option<Units> {
        const ARC_SECOND: f64 = DEGREE / 3600.0;
        let (gyro, accel) = match self.0 {
            // HG1700-AG11, -AG58, HG1900, HG1930
            1 | 5 | 11 | 20 | 27 | 28 => (two(-33), two(-27) * FOOT),
            // HG1700-AG17, -AG62
            4 | 12 => (two(-33), two(-26) * FOOT),
            // LN-200
            8 => (two(-19), two(-14)),
            // iMAR-FSAS
            13 => (0.1 * two(-8) * ARC_SECOND, 0.05 * two(-15)),
            // KVH 1750, 1725
            16 | 33 => (0.1 / (3600.0 * 256.0), 0.05 * two(-15)),
            // ISA-100C, uIMU
            26 | 52 => (1e-9, 2e-8),
            // ADIS16488
            31 => (720.0 * two(-31) * DEGREE, 200.0 * two(-31)),
            // STIM300: its own incremental counts with the 10 g range
            32 | 56 => (two(-21) * DEGREE, two(-22)),
            // HG4930
            58 | 68 | 69 => (two(-33), two(-29)),
            // Epson EG320N and EG370N: the counts of the sensor itself
            41 | 62 => (0.008 * two(-16) * DEGREE, 0.2e-3 * G * two(-16)),
            61 => (two(-16) / 66.0 * DEGREE, 0.4e-3 * G * two(-16)),
            _ => return None,
        };
        let quantity = match self.0 {
            41 | 61 | 62 => Quantity::Rate,
            _ => Quantity::Increment,
        };
        let unit = |lsb| Unit { quantity, lsb };
        Some(Units {
            gyro: unit(gyro),
            accel: unit(accel),
        })
    }

    /// Samples a second, of the types whose rate is published.
    pub fn rate(self) -> Option<u16> {
        match self.0 {
            1 | 4 | 5 | 11 | 12 | 20 | 27 | 28 | 58 | 68 => Some(100),
            32 | 41 | 56 => Some(125),
            8 | 13 | 16 | 26 | 31 | 33 | 52 | 61 | 62 => Some(200),
            69 => Some(400),
            _ => None,
        }
    }

    /// Whether a status word says that the sensor is good. Only the bits of the HG1700 family are
    /// known here (from the `GearBox` decoder: 1 = failed). Its path-length control bits of single
    /// gyros are not counted. The status of all other types passes.
    pub fn status_is_good(self, status: u32) -> bool {
        !matches!(self.0, 1 | 4 | 5 | 11 | 12) || status & 0xF800_0010 == 0
    }
}

pub mod best;
pub mod inspvas;
mod protocol;
mod repr;
pub use protocol::{Protocol, Settings};
pub use repr::{Header, Repr};

#[cfg(test)]
pub(super) mod tests;
