//! A message in numbers.

use super::checksum::seal;
use super::layout::{Layout, Quantity, TRAILER, Values};
use super::{Frame, bytes};
use crate::sample::RawSample;
use crate::wire::Error;
use crate::wire::field::put;
use crate::wire::framer::LONGEST;

/// A message of at most 256 bytes: the fields that the device knows as numbers, all others as they
/// are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// Values of the sample.
    pub values: Values,
    /// The start mark, groups and words, then all fields; those below have no meaning here.
    pub message: [u8; LONGEST],
    /// Nanoseconds since the start of the sensor, or GPS time where the message has no other.
    pub time_ns: u64,
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
        let (gyro, _) = frame.quantities();
        Repr {
            values: match gyro {
                Quantity::Compensated => Values::Filtered,
                Quantity::Increments | Quantity::Uncompensated => Values::Sensors,
            },
            message,
            time_ns: frame.time_ns().unwrap_or_default(),
            sample: frame.sample(),
        }
    }

    /// Writes the message with its CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::Header`] when the header is none of a message with a sample, [`Error::Length`] when
    /// the buffer is too short, [`Error::Content`] for a sample of counts.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let layout = Layout::of(&self.message).map_err(|_| Error::Header)?;
        let gyros = layout.best(self.values, false);
        let gyros = gyros.filter(|_| layout.has_sample(self.values));
        let gyros = gyros.ok_or(Error::Header)?;
        let RawSample::Floats { gyro, accel } = self.sample else {
            return Err(Error::Content);
        };
        let message = buffer.get_mut(..layout.len).ok_or(Error::Length)?;
        for (place, byte) in message.iter_mut().zip(self.message) {
            *place = byte;
        }
        let (time, gyros) = (layout.time(), layout.at(gyros));
        if time != 0 {
            put(message, time, self.time_ns.to_le_bytes());
        }
        put(message, gyros, bytes(gyro));
        if let Some(accels) = layout.best(self.values, true) {
            put(message, layout.at(accels), bytes(accel));
        }
        seal(message);
        Ok(layout.len)
    }

    /// A message with these groups and words, all its fields zero.
    ///
    /// # Errors
    /// [`Error::Header`] when it is none with a sample.
    pub fn with_header(values: Values, header: &[u8]) -> Result<Repr, Error> {
        let mut message = [0; LONGEST];
        put(&mut message, 0, [0xFA]);
        let room = message.iter_mut().skip(1);
        room.zip(header).for_each(|(place, byte)| *place = *byte);
        let layout = Layout::of(&message).map_err(|_| Error::Header)?;
        if !layout.has_sample(values) {
            return Err(Error::Header);
        }
        Ok(Repr {
            values,
            message,
            time_ns: 0,
            sample: RawSample::Floats {
                gyro: [0.0; 3],
                accel: [0.0; 3],
            },
        })
    }

    /// Fills all fields with a pattern, but for those that are status or a time of increments.
    pub(super) fn fill(&mut self, pattern: u32) {
        let Ok(layout) = Layout::of(&self.message) else {
            return;
        };
        let fields = layout.fields..layout.len.saturating_sub(TRAILER);
        let status = [
            layout.ins_status(),
            layout.imu_status(),
            layout.vpe_status(),
            layout.saturation(),
        ];
        let of_status = |at: &usize| status.iter().any(|status| *at / 2 == *status / 2);
        let delta = layout.delta_time();
        let of_time = |at: &usize| delta.is_some_and(|delta| (delta..delta + 4).contains(at));
        for at in fields.filter(|at| !of_status(at) && !of_time(at)) {
            let [byte, ..] = pattern.rotate_left(5 * at as u32).to_le_bytes();
            put(&mut self.message, at, [byte]);
        }
    }
}
