//! Seiko Epson IMUs at a UART: the bursts of the M-G320, G354, G364, G365, G366 and G370 families.
//!
//! Sources: data sheet M-G362PDC1 (packet format, flags, 16 and 32 bits); Epson's own drivers
//! `esensorlib` 2.1.0 for Python and `ess_imu_driver` for ROS (registers, order of the fields,
//! checksum, scales of the models). Most significant byte first throughout:
//!
//! ```text
//! 80 | fields | checksum u16 | 0D
//! fields, in this order, those that BURST_CTRL1 switches on:
//!   bit 15 FLAG u16 | 14 temperature | 13 gyro x, y, z | 12 accelerometer x, y, z
//!   | 11 delta angle x, y, z | 10 delta velocity x, y, z | 9 quaternion 0 to 3
//!   | 8 attitude x, y, z | 2 GPIO u16 | 1 COUNT u16 | 0 checksum
//! the same bit of BURST_CTRL2 makes the numbers of bits 14 to 8 32 bits wide instead of 16
//! checksum: sum of all 16-bit words between 80 and itself
//! ```
//!
//! **A burst does not state its content**: both registers are configured in the device
//! ([`Layout`]). The frames are the same in UART automatic mode and when the host asks for each
//! one.
//!
//! Of a triad that comes as rate and as increment, the increments are corrected, which are for
//! navigation. The rates pass unchanged, and so do quaternion and attitude.
//!
//! A burst without checksum is refused ([`Refused::Checksum`]): one byte at either end says too
//! little about the bytes in between. The checksum is weak too: words that change places pass it.
//! An answer to a register read (4 bytes, no checksum) is no burst.
//!
//! No recorded burst is public. Those of the tests were put together by hand and are read by
//! `esensorlib` as they are meant.

mod layout;
mod model;
mod protocol;
mod repr;

pub use layout::{Field, Layout, Refused};
pub use model::Model;
pub use protocol::{Protocol, Settings};
pub use repr::Repr;

use super::checksum::sum16_be;
use super::field::{put, take};
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};

const START: u8 = 0x80;
const END: u8 = 0x0D;
/// Checksum and end mark.
const TRAILER: usize = 3;

/// Bit of FLAG: some diagnosis of the sensor reports an error (EA).
pub const ERROR: u16 = 1 << 0;

/// Scans for a burst at the beginning of `bytes`.
pub fn scan(layout: Layout, bytes: &[u8]) -> Scan {
    match bytes.first() {
        None => return Scan::Partial(1),
        Some(&START) => {}
        Some(_) => return Scan::Garbage,
    }
    let len = layout.bytes();
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if take(frame, len - 1) == [END] && sum_is_right(frame) => Scan::Frame(len),
        Some(_) => Scan::BadChecksum,
    }
}

/// The words under the checksum.
fn summed(frame: &[u8]) -> &[u8] {
    let end = frame.len().saturating_sub(TRAILER);
    frame.get(1..end).unwrap_or_default()
}

fn sum_is_right(frame: &[u8]) -> bool {
    let stated = u16::from_be_bytes(take(frame, frame.len().saturating_sub(TRAILER)));
    sum16_be(summed(frame)) == stated
}

/// Recomputes checksum and end mark.
fn seal(frame: &mut [u8]) {
    let [high, low] = sum16_be(summed(frame)).to_be_bytes();
    put(frame, frame.len().saturating_sub(TRAILER), [high, low, END]);
}

/// A burst.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    layout: Layout,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one burst of this layout with the right checksum.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(layout: Layout, buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), |bytes| scan(layout, bytes))?;
        Ok(Frame { buffer, layout })
    }

    /// A view over a burst that a framer has checked.
    fn over(layout: Layout, buffer: T) -> Option<Frame<T>> {
        (buffer.as_ref().len() == layout.bytes()).then_some(Frame { buffer, layout })
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_be_bytes(take(self.buffer.as_ref(), at))
    }

    /// A triad of numbers of two or four bytes.
    fn triad(&self, (at, wide): (usize, bool)) -> [i32; 3] {
        let bytes = self.buffer.as_ref();
        core::array::from_fn(|axis| {
            if wide {
                i32::from_be_bytes(take(bytes, at + 4 * axis))
            } else {
                i32::from(i16::from_be_bytes(take(bytes, at + 2 * axis)))
            }
        })
    }

    /// FLAG: see [`ERROR`].
    pub fn flags(&self) -> Option<u16> {
        self.layout.flags().map(|at| self.word(at))
    }

    /// COUNT.
    pub fn count(&self) -> Option<u16> {
        self.layout.count().map(|at| self.word(at))
    }

    /// The six values that are corrected.
    pub fn sample(&self) -> RawSample {
        RawSample::Counts {
            gyro: self.triad(self.layout.gyro()),
            accel: self.triad(self.layout.accel()),
        }
    }

    /// The six values and what goes with them. They are invalid when FLAG says so. What a count of
    /// the temperature means depends on the model: it passes, unread.
    pub fn reading(&self) -> Reading {
        let failed = self.flags().is_some_and(|flags| flags & ERROR != 0);
        let valid = if failed { Axes::NONE } else { Axes::ALL };
        Reading {
            counter: self.count(),
            ..Reading::new(self.sample(), Axes::ALL, valid)
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values and changes the checksum by the difference. Values of 16 bits
    /// saturate; the axes that did are returned.
    fn change(&mut self, gyro: [i32; 3], accel: [i32; 3]) -> Axes {
        let layout = self.layout;
        let bytes = self.buffer.as_mut();
        let at = bytes.len().saturating_sub(TRAILER);
        let mut sum = u16::from_be_bytes(take(bytes, at));
        let gyro = put_triad(bytes, layout.gyro(), gyro, &mut sum);
        let accel = put_triad(bytes, layout.accel(), accel, &mut sum);
        put(bytes, at, sum.to_be_bytes());
        Axes::new(gyro, accel)
    }
}

/// Writes three numbers and adds to `sum` what the sum of their words changes by. Returns the axes
/// that saturated, x in bit 0.
#[inline(never)] // two callers
fn put_triad(bytes: &mut [u8], (at, wide): (usize, bool), values: [i32; 3], sum: &mut u16) -> u8 {
    let len = if wide { 12 } else { 6 };
    let words = |bytes: &[u8]| sum16_be(bytes.get(at..at + len).unwrap_or_default());
    let before = words(bytes);
    let mut saturated = 0;
    for (axis, value) in values.into_iter().enumerate() {
        if wide {
            put(bytes, at + 4 * axis, value.to_be_bytes());
        } else {
            let narrow = value.clamp(i32::from(i16::MIN), i32::from(i16::MAX));
            put(bytes, at + 2 * axis, (narrow as i16).to_be_bytes());
            saturated |= u8::from(narrow != value) << axis;
        }
    }
    *sum = sum.wrapping_add(words(bytes)).wrapping_sub(before);
    saturated
}

#[cfg(test)]
pub(super) mod tests;
