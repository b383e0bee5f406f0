//! KVH 1725, 1750, 1775 fibre-optic IMUs: message formats A, B, C and the BIT message.
//!
//! Source: KVH ICD 56-0298 rev B; golden frames recorded by `TRECVT/ros_kvh1750`. All fields most
//! significant byte first:
//!
//! ```text
//! A  FE 81 FF 55 | gyro 3 x f32 | acc 3 x f32 |               status | seq | temp i16 | CRC 4   36
//! B  FE 81 FF 56 | gyro 3 x f32 | acc 3 x f32 | time us u32 | status | seq | temp i16 | CRC 4   40
//! C  FE 81 FF 57 | gyro 3 x f32 | acc 3 x f32 | cycling f32 | status | seq |          | CRC 4   38
//! BIT  FE 81 00 AA | 6 bytes | sum      FE 81 00 AB | 8 bytes | sum
//! ```
//!
//! The values are floats. The compensator corrects them in two exact single-precision sums and
//! carries what a value cannot hold.

use super::checksum::{crc32_mpeg2, crc32_mpeg2_change, sum_bytes};
use super::field::{Mark, head, mark, put, resealed, take};
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::units::{DEGREE, G};

/// The longest message.
pub const MAX_LEN: usize = 40;

/// Field positions. After the accelerations the formats differ.
mod at {
    pub const GYRO: usize = 4;
    pub const ACCEL: usize = 16;
    pub const AFTER: usize = 28;
}

/// The three message formats (`=OUTPUTFMT,A`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// The default.
    A,
    /// Format with a time stamp.
    B,
    /// Format with temperature and magnetic field in turn.
    C,
}

impl Layout {
    fn from_header(header: [u8; 4]) -> Option<Layout> {
        match header {
            [0xFE, 0x81, 0xFF, 0x55] => Some(Layout::A),
            [0xFE, 0x81, 0xFF, 0x56] => Some(Layout::B),
            [0xFE, 0x81, 0xFF, 0x57] => Some(Layout::C),
            _ => None,
        }
    }

    fn header(self) -> [u8; 4] {
        match self {
            Layout::A => [0xFE, 0x81, 0xFF, 0x55],
            Layout::B => [0xFE, 0x81, 0xFF, 0x56],
            Layout::C => [0xFE, 0x81, 0xFF, 0x57],
        }
    }

    /// Bytes of the message.
    const fn bytes(self) -> usize {
        match self {
            Layout::A => 36,
            Layout::B => 40,
            Layout::C => 38,
        }
    }

    /// Position of the status byte; the sequence number follows it.
    pub(super) const fn status(self) -> usize {
        match self {
            Layout::A => at::AFTER,
            Layout::B | Layout::C => at::AFTER + 4,
        }
    }
}

/// Units by the sensor's settings (`=ROTFMT`, `=ROTUNITS`); the message itself does not state them.
pub fn units(delta: bool, degrees: bool) -> Units {
    Units {
        gyro: Unit {
            quantity: if delta {
                Quantity::Increment
            } else {
                Quantity::Rate
            },
            lsb: if degrees { DEGREE } else { 1.0 },
        },
        accel: Unit {
            quantity: Quantity::Rate,
            lsb: G,
        },
    }
}

/// Scans for a message at the beginning of `bytes`.
pub fn scan(bytes: &[u8]) -> Scan {
    match (
        mark(bytes, &[0xFE, 0x81, 0xFF]),
        mark(bytes, &[0xFE, 0x81, 0x00]),
    ) {
        (Mark::No, Mark::No) => return Scan::Garbage,
        (Mark::Whole, _) | (_, Mark::Whole) if bytes.len() > 3 => {}
        _ => return Scan::Partial(bytes.len() + 1),
    }
    let header: [u8; 4] = take(bytes, 0);
    if let Some(layout) = Layout::from_header(header) {
        let len = layout.bytes();
        return match bytes.get(..len) {
            None => Scan::Partial(len),
            Some(frame) if crc_is_right(frame) => Scan::Frame(len),
            Some(_) => Scan::BadChecksum,
        };
    }
    let len = match header {
        [0xFE, 0x81, 0x00, 0xAA] => 11,
        [0xFE, 0x81, 0x00, 0xAB] => 13,
        _ => return Scan::Garbage,
    };
    match bytes.get(..len) {
        None => Scan::Partial(len),
        // the sum's low byte, over header and status
        Some([data @ .., sum]) if sum_bytes(data).to_le_bytes()[0] == *sum => Scan::Other(len),
        Some(_) => Scan::BadChecksum,
    }
}

fn crc_is_right(frame: &[u8]) -> bool {
    let crc = frame.len().saturating_sub(4);
    crc32_mpeg2(head(frame, crc)) == u32::from_be_bytes(take(frame, crc))
}

/// A message of format A, B or C.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    layout: Layout,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one message with the right header, length and CRC.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), scan)?;
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a message that a framer has checked.
    pub(super) fn over(buffer: T) -> Option<Frame<T>> {
        Layout::from_header(take(buffer.as_ref(), 0)).map(|layout| Frame { buffer, layout })
    }

    /// The layout, one of three.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    fn triad(&self, at: usize) -> [f32; 3] {
        let bytes = self.buffer.as_ref();
        core::array::from_fn(|axis| f32::from_be_bytes(take(bytes, at + 4 * axis)))
    }

    /// Angle increments or rates, see [`units`].
    pub fn gyro(&self) -> [f32; 3] {
        self.triad(at::GYRO)
    }

    /// Accelerations in g.
    pub fn accel(&self) -> [f32; 3] {
        self.triad(at::ACCEL)
    }

    /// Bits 0 to 2 gyro x, y, z, bits 4 to 6 accelerometer x, y, z: 1 = **valid**, the reverse of
    /// other makers.
    pub fn status(&self) -> u8 {
        let [status] = take(self.buffer.as_ref(), self.layout.status());
        status
    }

    /// 0 to 127, then 0 again.
    pub fn sequence(&self) -> u8 {
        let [sequence] = take(self.buffer.as_ref(), self.layout.status() + 1);
        sequence
    }

    /// Formats A and B: degrees C or F or hundredths of them (`=TEMPUNITS`).
    pub fn temperature(&self) -> Option<i16> {
        let at = self.layout.status() + 2;
        (self.layout != Layout::C).then(|| i16::from_be_bytes(take(self.buffer.as_ref(), at)))
    }

    /// The four bytes between accelerations and status: format B's time in microseconds, format C's
    /// float (temperature, magnetic x, y, z, by the sequence number modulo 4).
    pub fn extra(&self) -> Option<[u8; 4]> {
        (self.layout != Layout::A).then(|| take(self.buffer.as_ref(), at::AFTER))
    }

    /// The six values and what goes with them. A value that is no finite number is not valid. The
    /// message does not state the temperature's unit, so the temperature is not here.
    pub fn reading(&self) -> Reading {
        let (gyro, accel) = (self.gyro(), self.accel());
        let finite = |values: [f32; 3]| {
            let bits = values.into_iter().enumerate();
            bits.fold(0, |set, (axis, value)| {
                set | u8::from(value.is_finite()) << axis
            })
        };
        let status = self.status();
        Reading {
            counter: Some(u16::from(self.sequence())),
            ..Reading::new(
                RawSample::Floats { gyro, accel },
                Axes::ALL,
                Axes::new(status & finite(gyro), status >> 4 & finite(accel)),
            )
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values and, if asked, [`OWN_FAULT`], and changes the CRC by the difference.
    #[inline(always)]
    pub(super) fn change(&mut self, gyro: [f32; 3], accel: [f32; 3], mark: bool) -> Option<()> {
        let bytes = self.buffer.as_mut();
        resealed(bytes, at::GYRO, crc_change, |place: &mut [u8; 24]| {
            put_values(place, 0, gyro, accel);
        })?;
        if mark {
            // with two bytes of what is before and after it
            resealed(
                bytes,
                self.layout.status() - 2,
                crc_change,
                |place: &mut [u8; 4]| {
                    place[2] |= OWN_FAULT;
                },
            )?;
        }
        Some(())
    }
}

#[inline(always)]
fn put_values(bytes: &mut [u8], at: usize, gyro: [f32; 3], accel: [f32; 3]) {
    for (axis, value) in gyro.into_iter().chain(accel).enumerate() {
        put(bytes, at + 4 * axis, value.to_be_bytes());
    }
}

/// Our own fault bit in the status byte, bit 3, which the sensor always sends as 0. Bit 7 and the
/// sequence number's top bit stay 0, so that status, sequence and temperature still cannot imitate
/// a header.
pub const OWN_FAULT: u8 = 0x08;

/// Change of the CRC.
fn crc_change(bits: &[u8], after: usize) -> [u8; 4] {
    crc32_mpeg2_change(bits, after).to_be_bytes()
}

fn seal(frame: &mut [u8]) {
    let crc = frame.len().saturating_sub(4);
    let sum = crc32_mpeg2(head(frame, crc));
    put(frame, crc, sum.to_be_bytes());
}

/// Every field of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// The layout.
    pub layout: Layout,
    /// Increments or rates.
    pub gyro: [f32; 3],
    /// g
    pub accel: [f32; 3],
    /// Formats B and C.
    pub extra: [u8; 4],
    /// 1 = valid.
    pub status: u8,
    /// 0 to 127.
    pub sequence: u8,
    /// Formats A and B.
    pub temperature: i16,
}

impl Repr {
    /// Take a message apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        Repr {
            layout: frame.layout(),
            gyro: frame.gyro(),
            accel: frame.accel(),
            extra: frame.extra().unwrap_or_default(),
            status: frame.status(),
            sequence: frame.sequence(),
            temperature: frame.temperature().unwrap_or_default(),
        }
    }

    /// Write the message with its CRC and return its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short; it is then left alone.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let len = self.layout.bytes();
        let frame = buffer.get_mut(..len).ok_or(Error::Length)?;
        put(frame, 0, self.layout.header());
        if self.layout != Layout::A {
            put(frame, at::AFTER, self.extra);
        }
        let status = self.layout.status();
        put(frame, status, [self.status, self.sequence]);
        if self.layout != Layout::C {
            put(frame, status + 2, self.temperature.to_be_bytes());
        }
        put_values(frame, at::GYRO, self.gyro, self.accel);
        seal(frame);
        Ok(len)
    }
}

mod protocol;
pub use protocol::{Protocol, Settings};

#[cfg(test)]
pub(super) mod tests;
