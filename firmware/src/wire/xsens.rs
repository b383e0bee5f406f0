//! Xsens MTi: `MTData2` messages.
//!
//! Sources: MT Low-Level Communication Protocol documentation (MT0101P), Xsens' public headers
//! (`xsdataidentifier.h`, `xsstatusflag.h`). Most significant byte first:
//!
//! ```text
//! FA | FF | 36 | length u8 | packets | sum u8           length 0 to 254
//! FA | FF | 36 | FF | length u16 | packets | sum u8     longer
//! ```
//!
//! All bytes behind FA add up to 0. The packets are in [`layout`]. A message that has rates or
//! increments of the gyros is a frame. All other messages of the sensor pass unchanged.
//!
//! | values | packets | unit |
//! |---|---|---|
//! | increments | `DeltaQ` 0x8030, `DeltaV` 0x4010 | twice the vector part rad, m/s |
//! | rates | `RateOfTurn` 0x8020, `Acceleration` 0x4020 | rad/s, m/s^2 |
//! | rates at the full rate | `RateOfTurnHR` 0x8040, `AccelerationHR` 0x4040 | rad/s, m/s^2 |
//!
//! The first of these that a message has are its sample, for gyros and accelerometers apart. The
//! others in it change by the same amount. `FreeAcceleration` is an output of the sensor's filter
//! and passes unchanged.
//!
//! **`DeltaQ`.** Twice its vector part is the rotation since the last one but for a share of the
//! square of its angle over 24: 13 ppm at 100 deg/s and 100 Hz. It is corrected like an increment.
//! The scalar stays: what it would have to change by is the correction times the vector part, less
//! than its last digit for corrections up to 0.01 deg/s at 100 deg/s and 100 Hz.
//!
//! **Precision.** Values in single precision and with 20 bits behind the point are corrected.
//! Messages with values in 48 bits or in double precision are no frames and pass unchanged.
//!
//! No recorded message is committed. The five public recordings of `einride/xsens-go` were read
//! whole and without a byte left over: all of their messages in these two precisions are frames.

use self::layout::{Layout, Precision, data, precision, values};
use super::checksum::sum_bytes;
use super::field::{Mark, finite, mark, put, take};
use super::framer::LONGEST;
use super::protocol::Change;
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};

/// `MTData2`.
const DATA: u8 = 0x36;
/// A length byte that announces a length in two more bytes.
const EXTENDED: u8 = 0xFF;

/// Bits of `StatusWord`: 1 = at the end of the range.
pub mod status {
    /// Accelerometer x; y and z follow.
    pub const ACCEL_X: u32 = 1 << 8;
    /// Gyro x; y and z follow.
    pub const GYRO_X: u32 = 1 << 11;
}

/// Begin and end of the payload of the message at the beginning of `bytes`; its sum follows.
fn payload(bytes: &[u8]) -> Result<(usize, usize), Scan> {
    match mark(bytes, &[0xFA, 0xFF]) {
        Mark::No => return Err(Scan::Garbage),
        Mark::Whole if bytes.len() >= 4 => {}
        Mark::Whole => return Err(Scan::Partial(4)),
        Mark::Part => return Err(Scan::Partial(2)),
    }
    match take(bytes, 3) {
        [EXTENDED] if bytes.len() < 6 => Err(Scan::Partial(6)),
        [EXTENDED] => Ok((6, 6 + usize::from(u16::from_be_bytes(take(bytes, 4))))),
        [length] => Ok((4, 4 + usize::from(length))),
    }
}

/// Looks for a message at the beginning of `bytes`. The sum of one byte says little, so the packets
/// of an `MTData2` must add up, too.
pub fn scan(bytes: &[u8]) -> Scan {
    let (begin, end) = match payload(bytes) {
        Ok(payload) => payload,
        Err(scan) => return scan,
    };
    let len = end + 1;
    let Some(message) = bytes.get(..len) else {
        return Scan::Partial(len);
    };
    let [kind] = take(message, 2);
    if sum_bytes(message.get(1..).unwrap_or_default()) as u8 != 0
        || (kind == DATA && Layout::of(message, begin, end).is_none())
    {
        return Scan::BadChecksum;
    }
    match Frame::over(message) {
        Some(_) => Scan::Frame(len),
        None => Scan::Other(len),
    }
}

/// A message with a sample.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    layout: Layout,
    /// Packet of the sample's gyros.
    gyro: usize,
    accel: Option<usize>,
    precision: Precision,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one message with the right header, length and sum.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), scan)?;
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a message that a framer has checked.
    #[inline(never)] // four callers
    fn over(buffer: T) -> Option<Frame<T>> {
        let message = buffer.as_ref();
        let [kind] = take(message, 2);
        let (begin, end) = payload(message).ok()?;
        if kind != DATA || end >= LONGEST {
            return None;
        }
        let layout = Layout::of(message, begin, end)?;
        let gyro = Layout::best(&layout.gyro)?;
        let accel = Layout::best(&layout.accel);
        let of_gyro = precision(message, *layout.gyro.get(gyro)?)?;
        if let Some(at) = accel.and_then(|which| layout.accel.get(which))
            && precision(message, *at) != Some(of_gyro)
        {
            return None;
        }
        Some(Frame {
            buffer,
            layout,
            gyro,
            accel,
            precision: of_gyro,
        })
    }

    fn triad(&self, gyro: bool, which: usize) -> [[u8; 4]; 3] {
        let places = if gyro {
            &self.layout.gyro
        } else {
            &self.layout.accel
        };
        let at = values(which, gyro, places.get(which).copied().unwrap_or_default());
        [0, 4, 8].map(|axis| take(self.buffer.as_ref(), at + axis))
    }

    /// Packets that are the sample: 0 increments, 1 rates, 2 rates at the full rate.
    pub fn packets(&self) -> (usize, Option<usize>) {
        (self.gyro, self.accel)
    }

    /// Precision of the sample.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Steps of 0.1 ms since the sensor started, modulo 2^32.
    pub fn time(&self) -> Option<u32> {
        let at = self.layout.time;
        (at != 0).then(|| u32::from_be_bytes(take(self.buffer.as_ref(), data(at))))
    }

    /// Number of the message.
    pub fn counter(&self) -> Option<u16> {
        let at = self.layout.counter;
        (at != 0).then(|| u16::from_be_bytes(take(self.buffer.as_ref(), data(at))))
    }

    /// See [`status`].
    pub fn status(&self) -> u32 {
        match self.layout.status {
            0 => 0,
            at => u32::from_be_bytes(take(self.buffer.as_ref(), data(at))),
        }
    }

    /// The sample; zero where the message has none of the accelerometers.
    pub fn sample(&self) -> RawSample {
        let gyro = self.triad(true, self.gyro);
        let accel = self
            .accel
            .map_or([[0; 4]; 3], |which| self.triad(false, which));
        match self.precision {
            Precision::Fixed => RawSample::Counts {
                gyro: gyro.map(i32::from_be_bytes),
                accel: accel.map(i32::from_be_bytes),
            },
            Precision::Single => RawSample::Floats {
                gyro: gyro.map(f32::from_be_bytes),
                accel: accel.map(f32::from_be_bytes),
            },
        }
    }

    /// Values at the end of their range are not valid, nor those that are no finite number.
    pub fn reading(&self) -> Reading {
        let sample = self.sample();
        let accel = if self.accel.is_some() { 7 } else { 0 };
        let numbers = match &sample {
            RawSample::Counts { .. } => Axes::ALL,
            RawSample::Floats { gyro, accel } => Axes::new(finite(gyro), finite(accel)),
        };
        let clipped = self.status();
        let good = |first: u32| !(clipped / first) as u8;
        let valid = Axes::new(
            good(status::GYRO_X) & numbers.gyro(),
            good(status::ACCEL_X) & numbers.accel() & accel,
        );
        Reading {
            counter: self.counter(),
            time: self.time().map(|ticks| f64::from(ticks) * 1e-4),
            temperature: self.temperature().map(|celsius| [celsius; 3]),
            ..Reading::new(sample, Axes::new(7, accel), valid)
        }
    }

    fn temperature(&self) -> Option<f32> {
        let at = self.layout.temperature;
        if at == 0 {
            return None;
        }
        let bytes = take(self.buffer.as_ref(), data(at));
        Some(match precision(self.buffer.as_ref(), at)? {
            Precision::Fixed => i32::from_be_bytes(bytes) as f32 / FIXED,
            Precision::Single => f32::from_be_bytes(bytes),
        })
    }
}

/// 1.0 with 20 bits behind the point.
const FIXED: f32 = 1_048_576.0;

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the sample and all values with the same errors, and changes the sum by the
    /// difference.
    /// `None`, and nothing is changed, for a sample of the other kind.
    fn change(&mut self, change: &Change) -> Option<()> {
        let (gyro, accel) = match (self.precision, *change.sample) {
            (Precision::Single, RawSample::Floats { gyro, accel }) => {
                (gyro.map(f32::to_be_bytes), accel.map(f32::to_be_bytes))
            }
            (Precision::Fixed, RawSample::Counts { gyro, accel }) => {
                (gyro.map(i32::to_be_bytes), accel.map(i32::to_be_bytes))
            }
            _ => return None,
        };
        let rate = change.settings.rate as f32;
        self.replace(true, self.gyro, gyro, 2.0 * rate);
        if let Some(which) = self.accel {
            self.replace(false, which, accel, rate);
        }
        Some(())
    }

    /// Replaces a triad of the sample, and adds as much to the other packets of the same sensors.
    /// `rate`: value of an increment in the unit of the rates.
    fn replace(&mut self, gyro: bool, which: usize, new: [[u8; 4]; 3], rate: f32) {
        let old = self.triad(gyro, which);
        let places = if gyro {
            self.layout.gyro
        } else {
            self.layout.accel
        };
        let of = self.precision;
        for (other, &at) in places.iter().enumerate().filter(|(_, at)| **at != 0) {
            if precision(self.buffer.as_ref(), at) != Some(of) {
                continue;
            }
            let scale = if which == 0 { rate } else { 1.0 };
            for (axis, (old, new)) in old.iter().zip(new).enumerate() {
                let place = values(other, gyro, at) + 4 * axis;
                let bytes = if other == which {
                    new
                } else {
                    added(of, take(self.buffer.as_ref(), place), *old, new, scale)
                };
                write(self.buffer.as_mut(), place, bytes);
            }
        }
    }
}

/// A value that changes as another one has changed from `old` to `new`, times `scale`.
fn added(of: Precision, value: [u8; 4], old: [u8; 4], new: [u8; 4], scale: f32) -> [u8; 4] {
    if of == Precision::Fixed {
        let counts = |bytes| i32::from_be_bytes(bytes);
        let difference = (counts(new).wrapping_sub(counts(old))) as f32 * scale;
        let rounded = (difference + 0.5_f32.copysign(difference)) as i32;
        return counts(value).saturating_add(rounded).to_be_bytes();
    }
    let float = |bytes| f32::from_be_bytes(bytes);
    let difference = (float(new) - float(old)) * scale;
    if difference == 0.0 || !difference.is_finite() {
        return value;
    }
    (float(value) + difference).to_be_bytes()
}

/// Writes bytes and changes the sum by as much.
fn write(message: &mut [u8], at: usize, bytes: [u8; 4]) {
    let before: [u8; 4] = take(message, at);
    let end = message.len().saturating_sub(1);
    let [mut sum] = take(message, end);
    for (before, byte) in before.into_iter().zip(bytes) {
        sum = sum.wrapping_add(before).wrapping_sub(byte);
    }
    put(message, at, bytes);
    put(message, end, [sum]);
}

/// Recomputes the sum.
fn seal(message: &mut [u8]) {
    let end = message.len().saturating_sub(1);
    let sum = sum_bytes(message.get(1..end).unwrap_or_default());
    put(message, end, [(sum as u8).wrapping_neg()]);
}

pub mod layout;
mod protocol;
mod repr;
pub use protocol::Protocol;
pub use repr::Repr;

#[cfg(test)]
pub(super) mod tests;
