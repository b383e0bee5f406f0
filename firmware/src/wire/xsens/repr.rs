//! A message in numbers.

use super::layout::{Layout, data, values};
use super::{Frame, payload, seal, write};
use crate::sample::RawSample;
use crate::wire::Error;
use crate::wire::field::put;
use crate::wire::framer::LONGEST;

/// A message of at most 256 bytes: the packets that the device knows as numbers, all others as they
/// are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// Header and packets; the numbers below have no meaning here, nor has the sum.
    pub message: [u8; LONGEST],
    /// Time in steps of 0.1 ms, if the message contains it.
    pub time: u32,
    /// Number of the message, if it contains it.
    pub counter: u16,
    /// The sample; accelerometers that the message does not have are left out.
    pub sample: RawSample,
}

impl Repr {
    /// Takes a message apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        let mut message = [0; LONGEST];
        for (place, byte) in message.iter_mut().zip(frame.buffer.as_ref()) {
            *place = *byte;
        }
        Repr {
            message,
            time: frame.time().unwrap_or_default(),
            counter: frame.counter().unwrap_or_default(),
            sample: frame.sample(),
        }
    }

    /// Writes the message with its sum and returns its length.
    ///
    /// # Errors
    /// [`Error::Header`] when it is no message with a sample, [`Error::Length`] when the buffer is
    /// too short.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let (_, end) = payload(&self.message).map_err(|_| Error::Header)?;
        let frame = Frame::over(&self.message[..]).ok_or(Error::Header)?;
        let message = buffer.get_mut(..end + 1).ok_or(Error::Length)?;
        for (place, byte) in message.iter_mut().zip(self.message) {
            *place = byte;
        }
        let Layout { time, counter, .. } = frame.layout;
        if time != 0 {
            put(message, data(time), self.time.to_be_bytes());
        }
        if counter != 0 {
            put(message, data(counter), self.counter.to_be_bytes());
        }
        let [gyro, accel] = match self.sample {
            RawSample::Floats { gyro, accel } => [gyro, accel].map(|t| t.map(f32::to_be_bytes)),
            RawSample::Counts { gyro, accel } => [gyro, accel].map(|t| t.map(i32::to_be_bytes)),
        };
        let of = |places: [u8; 3], which: usize| places.get(which).copied().unwrap_or_default();
        let gyros = values(frame.gyro, true, of(frame.layout.gyro, frame.gyro));
        for (axis, value) in gyro.into_iter().enumerate() {
            write(message, gyros + 4 * axis, value);
        }
        if let Some(which) = frame.accel {
            let accels = values(which, false, of(frame.layout.accel, which));
            for (axis, value) in accel.into_iter().enumerate() {
                write(message, accels + 4 * axis, value);
            }
        }
        seal(message);
        Ok(end + 1)
    }

    /// A message with these packets, identifiers with their lengths; all data are zero but for
    /// `pattern`, which fills those that the device does not know.
    ///
    /// # Errors
    /// [`Error::Length`] when they do not fit.
    pub fn with_packets(packets: &[(u16, u8)], pattern: u32) -> Result<Repr, Error> {
        let mut message = [0; LONGEST];
        let mut at = 4;
        for &(id, length) in packets {
            put(&mut message, at, id.to_be_bytes());
            put(&mut message, at + 2, [length]);
            let is_status = id & 0xFFF0 == 0xE020;
            for place in at + 3..at + 3 + usize::from(length) {
                let [byte, ..] = pattern.rotate_left(5 * place as u32).to_le_bytes();
                put(&mut message, place, [if is_status { 0 } else { byte }]);
            }
            at += 3 + usize::from(length);
        }
        let length = u8::try_from(at - 4).map_err(|_| Error::Length)?;
        put(&mut message, 0, [0xFA, 0xFF, super::DATA, length]);
        Ok(Repr {
            message,
            time: 0,
            counter: 0,
            sample: RawSample::Floats {
                gyro: [0.0; 3],
                accel: [0.0; 3],
            },
        })
    }
}
