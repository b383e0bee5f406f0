//! SBG Systems sbgECom: the IMU messages `IMU_DATA` and `IMU_SHORT`.
//!
//! Source: `sbgEComProtocol.h` and `sbgEComBinaryLogImu.h` as docs.ros.org documents them for
//! `sbg_driver`; bit 10 of the status from the sbgECom library 5.1. Little-endian throughout:
//!
//! ```text
//! FF 5A | message u8 | class u8 | payload length u16 | payload | CRC-16 | 33
//! IMU_DATA   3   time us u32 | status u16 | acceleration 3 x f32 | rate 3 x f32 | temperature f32
//!                | delta velocity 3 x f32 | delta angle 3 x f32                          58 bytes
//! IMU_SHORT  44  time us u32 | status u16 | delta velocity 3 x i32 | delta angle 3 x i32
//!                | temperature i16                                                       32 bytes
//! ```
//!
//! The CRC is over message to payload. Delta velocity and delta angle are increments divided by the
//! time between two messages, m/s^2 and rad/s. They are the values for navigation, and they are
//! read and written here. The acceleration and the rate of `IMU_DATA` are filtered differently and
//! pass unchanged. A stream may have both messages.
//!
//! No recorded message is public. `IMU_SHORT` in the tests is one that SBG's own library reads as
//! it is meant, `IMU_DATA` was put together by hand, its CRC by another implementation.

use self::checksum::{resealed, seal};
use super::field::{Mark, finite, mark, put, take};
use super::protocol::Change;
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};

/// Bytes before the payload.
const HEADER: usize = 6;
/// CRC and end mark.
const TRAILER: usize = 3;
const END: u8 = 0x33;
/// Most bytes of a payload (`SBG_ECOM_MAX_PAYLOAD_SIZE` of SBG's library).
const MAX_PAYLOAD: usize = 4086;
/// Class of the log messages.
const LOGS: u8 = 0;

/// Field positions in the payload.
mod at {
    pub const TIME: usize = 0;
    pub const STATUS: usize = 4;
    pub const REST: usize = 6;
    pub const TEMPERATURE_DATA: usize = 30;
    pub const TEMPERATURE_SHORT: usize = 30;
}

/// Status bits: 1 = good, but for the scale.
pub mod status {
    /// The processor hears the IMU.
    pub const COMMUNICATION: u16 = 1 << 0;
    /// The IMU passes its built-in test.
    pub const IMU: u16 = 1 << 1;
    /// Accelerometer x passes; y and z follow.
    pub const ACCEL_X: u16 = 1 << 2;
    /// Gyro x passes; y and z follow.
    pub const GYRO_X: u16 = 1 << 5;
    /// All accelerometers are within range.
    pub const ACCELS_IN_RANGE: u16 = 1 << 8;
    /// All gyros are within range.
    pub const GYROS_IN_RANGE: u16 = 1 << 9;
    /// `IMU_SHORT`: a count of the gyros has the scale of the high range.
    pub const HIGH_RANGE: u16 = 1 << 10;
    /// All good, standard range.
    pub const GOOD: u16 = 0x03FF;
}

/// Our own fault bit in the status, of which bits 11 to 15 are not used.
pub const OWN_FAULT: u16 = 0x8000;

/// The two messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// 3
    Data,
    /// 44
    Short,
}

impl Message {
    fn from_id(id: u8) -> Option<Message> {
        match id {
            3 => Some(Message::Data),
            44 => Some(Message::Short),
            _ => None,
        }
    }

    /// Message number.
    pub const fn id(self) -> u8 {
        match self {
            Message::Data => 3,
            Message::Short => 44,
        }
    }

    const fn payload(self) -> usize {
        match self {
            Message::Data => 58,
            Message::Short => 32,
        }
    }

    /// Bytes of the frame.
    pub const fn bytes(self) -> usize {
        HEADER + self.payload() + TRAILER
    }

    /// Delta velocity in the frame; delta angle follows.
    const fn values(self) -> usize {
        match self {
            Message::Data => HEADER + 34,
            Message::Short => HEADER + at::REST,
        }
    }
}

/// Looks for a message at the beginning of `bytes`. Other messages pass as they are when their CRC
/// is right; one longer than a framer's buffer goes through as garbage, unread.
pub fn scan(bytes: &[u8]) -> Scan {
    match mark(bytes, &[0xFF, 0x5A]) {
        Mark::No => return Scan::Garbage,
        Mark::Whole if bytes.len() >= HEADER => {}
        Mark::Whole => return Scan::Partial(HEADER),
        Mark::Part => return Scan::Partial(2),
    }
    let [id, class] = take(bytes, 2);
    let payload = usize::from(u16::from_le_bytes(take(bytes, 4)));
    let message = Message::from_id(id).filter(|_| class == LOGS);
    if payload > MAX_PAYLOAD || message.is_some_and(|message| message.payload() != payload) {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    }
    let len = HEADER + payload + TRAILER;
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !checksum::is_right(frame) => Scan::BadChecksum,
        Some(_) if message.is_some() => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

/// An IMU message.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    message: Message,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one message with the right header, length, CRC and end mark.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), scan)?;
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a message that a framer has checked.
    fn over(buffer: T) -> Option<Frame<T>> {
        let [id, class] = take(buffer.as_ref(), 2);
        let message = Message::from_id(id).filter(|_| class == LOGS)?;
        Some(Frame { buffer, message })
    }

    fn payload<const N: usize>(&self, at: usize) -> [u8; N] {
        take(self.buffer.as_ref(), HEADER + at)
    }

    fn triad<const N: usize>(&self, at: usize) -> [[u8; N]; 3] {
        core::array::from_fn(|axis| take(self.buffer.as_ref(), at + N * axis))
    }

    /// Kind of the message.
    pub fn message(&self) -> Message {
        self.message
    }

    /// Microseconds since the sensor started, modulo 2^32.
    pub fn time_us(&self) -> u32 {
        u32::from_le_bytes(self.payload(at::TIME))
    }

    /// See [`status`].
    pub fn status(&self) -> u16 {
        u16::from_le_bytes(self.payload(at::STATUS))
    }

    /// Delta angle and delta velocity.
    pub fn sample(&self) -> RawSample {
        let velocity = self.message.values();
        let [accel, gyro] = [velocity, velocity + 12].map(|at| self.triad(at));
        match self.message {
            Message::Data => RawSample::Floats {
                gyro: gyro.map(f32::from_le_bytes),
                accel: accel.map(f32::from_le_bytes),
            },
            Message::Short => RawSample::Counts {
                gyro: gyro.map(i32::from_le_bytes),
                accel: accel.map(i32::from_le_bytes),
            },
        }
    }

    /// Degrees Celsius.
    pub fn temperature(&self) -> f32 {
        match self.message {
            Message::Data => f32::from_le_bytes(self.payload(at::TEMPERATURE_DATA)),
            Message::Short => {
                f32::from(i16::from_le_bytes(self.payload(at::TEMPERATURE_SHORT))) / 256.0
            }
        }
    }

    /// A triad out of range is not valid, nor a value that is no finite number.
    fn valid(&self, sample: &RawSample) -> Axes {
        let bits = self.status();
        let whole = status::COMMUNICATION | status::IMU;
        if bits & whole != whole {
            return Axes::NONE;
        }
        let axes = |first: u16, in_range: u16| match bits & in_range {
            0 => 0,
            _ => (bits / first) as u8,
        };
        let finite = match sample {
            RawSample::Counts { .. } => Axes::ALL,
            RawSample::Floats { gyro, accel } => Axes::new(finite(gyro), finite(accel)),
        };
        let good = Axes::new(
            axes(status::GYRO_X, status::GYROS_IN_RANGE),
            axes(status::ACCEL_X, status::ACCELS_IN_RANGE),
        );
        Axes(good.0 & finite.0)
    }

    /// The six values and what goes with them.
    pub fn reading(&self) -> Reading {
        let sample = self.sample();
        Reading {
            time: Some(f64::from(self.time_us()) * 1e-6),
            temperature: Some([self.temperature(); 3]),
            ..Reading::new(sample, Axes::ALL, self.valid(&sample))
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values and, if asked, [`OWN_FAULT`], and changes the CRC by the difference.
    /// `None`, and nothing is changed, when the message has values of the other kind.
    #[inline(always)]
    fn change(&mut self, change: &Change) -> Option<()> {
        let (gyro, accel) = match (self.message, *change.sample) {
            (Message::Short, RawSample::Counts { gyro, accel }) => {
                (gyro.map(i32::to_le_bytes), accel.map(i32::to_le_bytes))
            }
            (Message::Data, RawSample::Floats { gyro, accel }) => {
                (gyro.map(f32::to_le_bytes), accel.map(f32::to_le_bytes))
            }
            _ => return None,
        };
        let bytes = self.buffer.as_mut();
        let values = self.message.values();
        resealed(bytes, values, |place: &mut [u8; 24]| {
            for (axis, value) in accel.into_iter().chain(gyro).enumerate() {
                put(place, 4 * axis, value);
            }
        })?;
        if change.mark {
            // the status with two bytes of the time before it
            let at = HEADER + at::STATUS - 2;
            resealed(bytes, at, |place: &mut [u8; 4]| {
                place[3] |= OWN_FAULT.to_le_bytes()[1];
            })?;
        }
        Some(())
    }
}

/// Every field of an IMU message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// Kind of the message; `sample` must be of this kind.
    pub message: Message,
    /// Microseconds.
    pub time_us: u32,
    /// See [`status`].
    pub status: u16,
    /// `IMU_DATA`: filtered acceleration, m/s^2.
    pub acceleration: [f32; 3],
    /// `IMU_DATA`: filtered rate, rad/s.
    pub rate: [f32; 3],
    /// Delta angle and delta velocity.
    pub sample: RawSample,
    /// Degrees Celsius; `IMU_SHORT` rounds to 1/256.
    pub temperature: f32,
}

impl Repr {
    /// Takes a message apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        let filtered = |at| match frame.message {
            Message::Data => frame.triad(HEADER + at).map(f32::from_le_bytes),
            Message::Short => [0.0; 3],
        };
        Repr {
            message: frame.message,
            time_us: frame.time_us(),
            status: frame.status(),
            acceleration: filtered(at::REST),
            rate: filtered(at::REST + 12),
            sample: frame.sample(),
            temperature: frame.temperature(),
        }
    }

    /// Writes the message with its CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short, [`Error::Content`] when the sample is of the
    /// other kind.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let message = self.message;
        let frame = buffer.get_mut(..message.bytes()).ok_or(Error::Length)?;
        put(
            frame,
            0,
            [0xFF, 0x5A, message.id(), LOGS, message.payload() as u8, 0],
        );
        put(frame, HEADER + at::TIME, self.time_us.to_le_bytes());
        put(frame, HEADER + at::STATUS, self.status.to_le_bytes());
        if message == Message::Data {
            let filtered = self.acceleration.into_iter().chain(self.rate);
            for (axis, value) in filtered.enumerate() {
                put(frame, HEADER + at::REST + 4 * axis, value.to_le_bytes());
            }
            let temperature = self.temperature.to_le_bytes();
            put(frame, HEADER + at::TEMPERATURE_DATA, temperature);
        } else {
            let temperature = (self.temperature * 256.0) as i16;
            put(
                frame,
                HEADER + at::TEMPERATURE_SHORT,
                temperature.to_le_bytes(),
            );
        }
        let change = Change {
            sample: &self.sample,
            mark: false,
            settings: &super::Settings::DEFAULT,
        };
        let mut view = Frame {
            buffer: &mut *frame,
            message,
        };
        view.change(&change).ok_or(Error::Content)?;
        seal(frame);
        Ok(message.bytes())
    }
}

mod checksum;
mod protocol;
pub use protocol::Protocol;

#[cfg(test)]
pub(super) mod tests;
