//! A burst reply as a frame: a view over its own bytes, to be corrected in place.
//!
//! A burst is framed by chip select, not by a start mark. The one who fetched it hands it over
//! whole.

use super::spi::Form;
use super::{
    BURST_1649X_LEN, BURST_ID, BURST16_LEN, BURST32_LEN, Burst, check_sum, low_high, put_low_high,
};
use crate::sample::{Axes, RawSample};
use crate::wire::checksum::{crc32_zlib_swapped, sum_bytes};
use crate::wire::field::{head, put, take};
use crate::wire::{Error, Reading};

/// Bytes of the data of a 1649x burst under its CRC.
const DATA_1649X: usize = 30;

impl Form {
    /// Bytes of a reply.
    pub fn bytes(self) -> usize {
        match self {
            Form::Narrow => BURST16_LEN,
            Form::Wide => BURST32_LEN,
            Form::Adis1649x => BURST_1649X_LEN,
        }
    }

    /// Whether the temperature of a reply is read. That of the ADIS1649x passes unread.
    pub fn has_thermometer(self) -> bool {
        self != Form::Adis1649x
    }

    /// Whether these bytes are a good reply.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Header`] or [`Error::Checksum`].
    #[inline(never)] // several callers
    pub fn check(self, reply: &[u8]) -> Result<(), Error> {
        if reply.len() != self.bytes() {
            return Err(Error::Length);
        }
        match self {
            Form::Narrow | Form::Wide => check_sum(reply),
            Form::Adis1649x => Burst::parse_1649x(&take(reply, 0)).map(|_| ()),
        }
    }

    /// Recomputes the checksum of a reply, for simulators and tests.
    pub(super) fn seal(self, reply: &mut [u8]) {
        if self != Form::Adis1649x {
            let at = reply.len().saturating_sub(2);
            let sum = sum_bytes(head(reply, at));
            return put(reply, at, sum.to_be_bytes());
        }
        let Some(start) = Frame::over(self, &*reply).map(|frame| frame.start) else {
            return;
        };
        let data: [u8; DATA_1649X] = take(reply, start);
        let [high, low] = split(crc32_zlib_swapped(&data));
        put(reply, start + DATA_1649X, low.to_be_bytes());
        put(reply, start + DATA_1649X + 2, high.to_be_bytes());
    }
}

/// The two words of a number, high first.
fn split(number: u32) -> [u16; 2] {
    [(number >> 16) as u16, number as u16]
}

/// A burst reply.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    form: Form,
    /// First byte of the data: behind BURST_ID in a 1649x reply.
    start: usize,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over a reply that [`Form::check`] has found good.
    pub(in crate::wire) fn over(form: Form, buffer: T) -> Option<Frame<T>> {
        let bytes = buffer.as_ref();
        let word = |n: usize| u16::from_be_bytes(take(bytes, 2 * n));
        let start = match form {
            Form::Narrow | Form::Wide => 0,
            Form::Adis1649x => {
                2 * (1..4).find(|&n| word(n - 1) == BURST_ID && word(n) != BURST_ID)?
            }
        };
        (bytes.len() == form.bytes()).then_some(Frame {
            buffer,
            form,
            start,
        })
    }

    fn burst(&self) -> Burst {
        let bytes = self.buffer.as_ref();
        let word = |at| i32::from(i16::from_be_bytes(take(bytes, at)));
        let unsigned = |at| u16::from_be_bytes(take(bytes, at));
        let at = self.start;
        let (gyro, accel, temperature, counter) = match self.form {
            Form::Narrow => (
                [word(2), word(4), word(6)],
                [word(8), word(10), word(12)],
                14,
                16,
            ),
            Form::Wide => (low_high(bytes, 2), low_high(bytes, 14), 26, 28),
            Form::Adis1649x => (
                low_high(bytes, at + 4),
                low_high(bytes, at + 16),
                at + 2,
                at + 28,
            ),
        };
        Burst {
            diagnosis: unsigned(at),
            gyro,
            accel,
            temperature: i16::from_be_bytes(take(bytes, temperature)),
            counter: unsigned(counter),
        }
    }

    /// The six values and what goes with them. A 1649x is taken to be valid: its error flags pass
    /// unchanged, unread.
    pub fn reading(&self) -> Reading {
        let burst = self.burst();
        let (valid, temperature) = match self.form {
            Form::Adis1649x => (Axes::ALL, None),
            _ => (
                burst.valid_1647x(),
                Some([f32::from(burst.temperature) / 10.0; 3]),
            ),
        };
        Reading {
            counter: Some(burst.counter),
            temperature,
            ..Reading::new(
                RawSample::Counts {
                    gyro: burst.gyro,
                    accel: burst.accel,
                },
                Axes::ALL,
                valid,
            )
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values, without the checksum. Values of 16 bits saturate; the axes that did
    /// are returned.
    fn put_values(&mut self, gyro: [i32; 3], accel: [i32; 3]) -> Axes {
        let bytes = self.buffer.as_mut();
        let at = match self.form {
            Form::Narrow => {
                let mut saturated = 0u8;
                for (axis, word) in gyro.into_iter().chain(accel).enumerate() {
                    let narrow = word.clamp(i32::from(i16::MIN), i32::from(i16::MAX));
                    put(bytes, 2 + 2 * axis, (narrow as i16).to_be_bytes());
                    saturated |= u8::from(narrow != word) << axis;
                }
                return Axes(saturated);
            }
            Form::Wide => 2,
            Form::Adis1649x => self.start + 4,
        };
        put_low_high(bytes, at, gyro);
        put_low_high(bytes, at + 12, accel);
        Axes::NONE
    }

    /// Writes the six values and changes the checksum by the difference. Returns the axes that
    /// saturated.
    pub(in crate::wire) fn change(&mut self, values: &RawSample) -> Option<Axes> {
        let RawSample::Counts { gyro, accel } = *values else {
            return None;
        };
        let (start, form) = (self.start, self.form);
        let bytes = self.buffer.as_mut();
        if form != Form::Adis1649x {
            let at = bytes.len().saturating_sub(2);
            let before = sum_bytes(head(bytes, at));
            let saturated = self.put_values(gyro, accel);
            let bytes = self.buffer.as_mut();
            let change = sum_bytes(head(bytes, at)).wrapping_sub(before);
            let sum = u16::from_be_bytes(take(bytes, at)).wrapping_add(change);
            put(bytes, at, sum.to_be_bytes());
            return Some(saturated);
        }
        let mut difference: [u8; DATA_1649X] = take(bytes, start);
        let saturated = self.put_values(gyro, accel);
        let bytes = self.buffer.as_mut();
        let after: [u8; DATA_1649X] = take(bytes, start);
        for (d, a) in difference.iter_mut().zip(after) {
            *d ^= a;
        }
        // inverted at both ends, the CRC of a difference is off by that of zeros
        let change = crc32_zlib_swapped(&difference) ^ crc32_zlib_swapped(&[0; DATA_1649X]);
        let at = start + DATA_1649X;
        for (at, change) in [(at, change as u16), (at + 2, (change >> 16) as u16)] {
            let half = u16::from_be_bytes(take(bytes, at)) ^ change;
            put(bytes, at, half.to_be_bytes());
        }
        Some(saturated)
    }
}
