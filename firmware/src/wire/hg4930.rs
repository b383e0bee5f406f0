//! Honeywell HG4930 asynchronous messages.
//!
//! Source: HG4930 Performance and Installation Manual, pages 13 to 17. Least significant byte and
//! word first, 1 Mbit/s 8N1:
//!
//! ```text
//! 01 control, 20 bytes
//!   0E 01 | rate xyz i16 | acc xyz i16 | status 1 u16 | status 2 u16 | sum
//! 02 inertial, 44 bytes
//!   0E 02 | the same 16 bytes | angle increments xyz i32 | velocity increments xyz i32 | sum
//! CA S-class, 20 bytes
//!   0E CA | as 01, other scales | sum
//! ```
//!
//! On a 600 Hz grid five control messages are followed by one inertial message. The increments of
//! 0x02 are for navigation, and they are read and written here. Control messages pass unchanged:
//! their rates are filtered differently and serve control loops. A count of theirs is worth 118
//! deg/h and 1.1 mg, more than any correction, which could only make them jump. An S-class unit
//! sends nothing but 0xCA, so there the rates are corrected.
//!
//! The 16-bit sum finds every single wrong bit, but neither exchanged words nor errors that cancel.
//! One random damage in 65536 passes.
//!
//! Traps in the third-party `bolderflight/hg4930`: velocity increments without the 0.3048, inverted
//! health flags, rotated axes.

use super::checksum::sum16_le;
use super::field::{head, put, take};
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, Quantity, RawSample, Unit, Units};
use crate::units::{DEGREE, FOOT};

/// The longest message.
pub const MAX_LEN: usize = 44;
/// A value of the start-up pattern, which is sent until the power-up test is done (400 ms).
const PATTERN: i32 = 0x5555_5555;

/// Field positions.
mod at {
    pub const RATE: usize = 2;
    pub const ACCEL: usize = 8;
    pub const STATUS_1: usize = 14;
    pub const STATUS_2: usize = 16;
    pub const ANGLE: usize = 18;
    pub const VELOCITY: usize = 30;
}

/// The message's second byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message {
    /// 0x01
    Control,
    /// 0x02
    Inertial,
    /// 0xCA
    SClass,
}

impl Message {
    fn from_id(id: u8) -> Option<Message> {
        match id {
            0x01 => Some(Message::Control),
            0x02 => Some(Message::Inertial),
            0xCA => Some(Message::SClass),
            _ => None,
        }
    }

    fn id(self) -> u8 {
        match self {
            Message::Control => 0x01,
            Message::Inertial => 0x02,
            Message::SClass => 0xCA,
        }
    }

    const fn bytes(self) -> usize {
        match self {
            Message::Control | Message::SClass => 20,
            Message::Inertial => 44,
        }
    }
}

const fn units(quantity: Quantity, gyro: f64, accel: f64) -> Units {
    Units {
        gyro: Unit {
            quantity,
            lsb: gyro,
        },
        accel: Unit {
            quantity,
            lsb: accel,
        },
    }
}

/// Rates of messages 0x01 and 0x02: 600 x 2^-20 rad/s, 600 x 2^-14 ft/s^2.
pub const CONTROL: Units = units(Quantity::Rate, 600.0 / 1_048_576.0, 600.0 * FOOT / 16_384.0);
/// Increments of message 0x02: 2^-33 rad, 2^-27 ft/s.
pub const INERTIAL: Units = units(
    Quantity::Increment,
    1.0 / 8_589_934_592.0,
    FOOT / 134_217_728.0,
);
/// Rates of message 0xCA: 499 x 2^-15 deg/s, 21 x 2^-15 g with the manual's own g.
pub const S_CLASS: Units = units(
    Quantity::Rate,
    499.0 * DEGREE / 32_768.0,
    21.0 * 9.805_989_024 / 32_768.0,
);

/// Looks for a message at the beginning of `bytes`. Inertial and S-class messages are frames,
/// control messages are not.
pub fn scan(bytes: &[u8]) -> Scan {
    let message = match *bytes {
        [] | [0x0E] => return Scan::Partial(2),
        [0x0E, id, ..] => Message::from_id(id),
        _ => None,
    };
    let Some(message) = message else {
        return Scan::Garbage;
    };
    let len = message.bytes();
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !sum_is_right(frame) => Scan::BadChecksum,
        Some(_) if message == Message::Control => Scan::Other(len),
        Some(_) => Scan::Frame(len),
    }
}

fn sum_is_right(frame: &[u8]) -> bool {
    let sum = frame.len().saturating_sub(2);
    sum16_le(head(frame, sum)) == u16::from_le_bytes(take(frame, sum))
}

fn seal(frame: &mut [u8]) {
    let at = frame.len().saturating_sub(2);
    let sum = sum16_le(head(frame, at));
    put(frame, at, sum.to_le_bytes());
}

/// One message of any kind.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    message: Message,
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
    pub(super) fn over(buffer: T) -> Option<Frame<T>> {
        let [_, id] = take(buffer.as_ref(), 0);
        Message::from_id(id).map(|message| Frame { buffer, message })
    }

    /// Kind of the message.
    pub fn message(&self) -> Message {
        self.message
    }

    fn narrow(&self, at: usize) -> [i16; 3] {
        let bytes = self.buffer.as_ref();
        core::array::from_fn(|axis| i16::from_le_bytes(take(bytes, at + 2 * axis)))
    }

    fn wide(&self, at: usize) -> Option<[i32; 3]> {
        let bytes = self.buffer.as_ref();
        let values = core::array::from_fn(|axis| i32::from_le_bytes(take(bytes, at + 4 * axis)));
        (self.message == Message::Inertial).then_some(values)
    }

    /// Filtered angular rate, [`CONTROL`] or [`S_CLASS`].
    pub fn rate(&self) -> [i16; 3] {
        self.narrow(at::RATE)
    }

    /// Filtered acceleration, [`CONTROL`] or [`S_CLASS`].
    pub fn accel(&self) -> [i16; 3] {
        self.narrow(at::ACCEL)
    }

    /// Angle increments of an inertial message.
    pub fn angle(&self) -> Option<[i32; 3]> {
        self.wide(at::ANGLE)
    }

    /// Velocity increments of an inertial message.
    pub fn velocity(&self) -> Option<[i32; 3]> {
        self.wide(at::VELOCITY)
    }

    /// Bits 0-1 counter, 2-3 test mode, 4 IMU, 5 gyros, 6 accelerometers, 7 sensor voltage, 8-10
    /// gyro x y z, 15 IMU; 1 = failed.
    pub fn status_1(&self) -> u16 {
        u16::from_le_bytes(take(self.buffer.as_ref(), at::STATUS_1))
    }

    /// Bits 8-14 health (1 = failed; bit 9: start-up pattern), bit 15: the low byte is the
    /// accelerometer temperature in degrees Celsius, otherwise the software version.
    pub fn status_2(&self) -> u16 {
        u16::from_le_bytes(take(self.buffer.as_ref(), at::STATUS_2))
    }

    /// Temperature of the accelerometers, degrees Celsius, in the messages that contain it.
    pub fn temperature(&self) -> Option<i8> {
        let [low, _] = self.status_2().to_le_bytes();
        (self.status_2() & 0x8000 != 0).then_some(low.cast_signed())
    }

    /// Whether the sensor still sends its start-up pattern.
    pub(super) fn is_pattern(&self) -> bool {
        self.status_2() & 0x0200 != 0 || self.angle() == Some([PATTERN; 3])
    }

    fn valid(&self) -> Axes {
        let (one, two) = (self.status_1(), self.status_2());
        if one & 0x8090 != 0 || two & 0x1C00 != 0 || self.is_pattern() {
            return Axes::NONE;
        }
        let [gyro_axes, _] = (one >> 8).to_le_bytes();
        let gyro = if one & 0x20 != 0 || two & 0x2100 != 0 {
            0
        } else {
            !gyro_axes
        };
        let accel = if one & 0x40 != 0 || two & 0x4000 != 0 {
            0
        } else {
            7
        };
        Axes::new(gyro, accel)
    }

    /// The six values for navigation and what goes with them.
    ///
    /// # Errors
    /// [`Error::Content`] for a control message.
    pub fn reading(&self) -> Result<Reading, Error> {
        let values = match (self.message, self.angle(), self.velocity()) {
            (Message::SClass, ..) => RawSample::Counts {
                gyro: self.rate().map(i32::from),
                accel: self.accel().map(i32::from),
            },
            (_, Some(gyro), Some(accel)) => RawSample::Counts { gyro, accel },
            _ => return Err(Error::Content),
        };
        Ok(Reading {
            counter: Some(self.status_1() & 3),
            temperature: self.temperature().map(|celsius| [f32::from(celsius); 3]),
            ..Reading::new(values, Axes::ALL, self.valid())
        })
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values for navigation and, if asked, [`OWN_FAULT`], and changes the sum by
    /// the difference. S-class values saturate at 16 bits; the axes that did are returned. `None`,
    /// and nothing is changed, for a control message.
    pub(super) fn change(&mut self, gyro: [i32; 3], accel: [i32; 3], mark: bool) -> Option<Axes> {
        let at = self.buffer.as_ref().len().checked_sub(2)?;
        let (from, len) = match self.message {
            Message::Control => return None,
            Message::Inertial => (at::ANGLE, 24),
            Message::SClass => (at::RATE, 12),
        };
        let sum_of_values = |frame: &Self| {
            let bytes = frame.buffer.as_ref();
            sum16_le(bytes.get(from..from + len).unwrap_or_default())
        };
        let before = sum_of_values(self);
        let saturated = self.put_values(gyro, accel);
        let mut change = sum_of_values(self).wrapping_sub(before);
        if mark {
            let status = self.status_1();
            change = change.wrapping_add(OWN_FAULT & !status); // its bit, if it was not set
            put(
                self.buffer.as_mut(),
                at::STATUS_1,
                (status | OWN_FAULT).to_le_bytes(),
            );
        }
        let sum = u16::from_le_bytes(take(self.buffer.as_ref(), at)).wrapping_add(change);
        put(self.buffer.as_mut(), at, sum.to_le_bytes());
        Some(saturated)
    }

    /// The six values without the sum.
    fn put_values(&mut self, gyro: [i32; 3], accel: [i32; 3]) -> Axes {
        let bytes = self.buffer.as_mut();
        let mut saturated = 0u8;
        for (axis, value) in gyro.into_iter().chain(accel).enumerate() {
            match self.message {
                Message::Control => {}
                Message::Inertial => put(bytes, at::ANGLE + 4 * axis, value.to_le_bytes()),
                Message::SClass => {
                    let narrow = value.clamp(i32::from(i16::MIN), i32::from(i16::MAX));
                    put(bytes, at::RATE + 2 * axis, (narrow as i16).to_le_bytes());
                    saturated |= u8::from(narrow != value) << axis;
                }
            }
        }
        Axes(saturated)
    }
}

/// Our own fault bit in status word 1, bit 14, reserved by the manual.
pub const OWN_FAULT: u16 = 0x4000;

/// Every field of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repr {
    /// Kind of the message.
    pub message: Message,
    /// Angular rate.
    pub rate: [i16; 3],
    /// Acceleration.
    pub accel: [i16; 3],
    /// Status word 1.
    pub status_1: u16,
    /// Status word 2A or 2B.
    pub status_2: u16,
    /// Angle increments, sent in an inertial message only.
    pub angle: [i32; 3],
    /// Velocity increments, likewise.
    pub velocity: [i32; 3],
}

impl Repr {
    /// Take a message apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        Repr {
            message: frame.message(),
            rate: frame.rate(),
            accel: frame.accel(),
            status_1: frame.status_1(),
            status_2: frame.status_2(),
            angle: frame.angle().unwrap_or_default(),
            velocity: frame.velocity().unwrap_or_default(),
        }
    }

    /// Write the message with its sum and return its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short; it is then left alone.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let len = self.message.bytes();
        let frame = buffer.get_mut(..len).ok_or(Error::Length)?;
        put(frame, 0, [0x0E, self.message.id()]);
        for (axis, value) in self.rate.into_iter().chain(self.accel).enumerate() {
            put(frame, at::RATE + 2 * axis, value.to_le_bytes());
        }
        put(frame, at::STATUS_1, self.status_1.to_le_bytes());
        put(frame, at::STATUS_2, self.status_2.to_le_bytes());
        if self.message == Message::Inertial {
            for (axis, value) in self.angle.into_iter().chain(self.velocity).enumerate() {
                put(frame, at::ANGLE + 4 * axis, value.to_le_bytes());
            }
        }
        seal(frame);
        Ok(len)
    }
}

mod protocol;
pub use protocol::Protocol;

#[cfg(test)]
pub(super) mod tests;
