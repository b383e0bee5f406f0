//! MAVLink `HIGHRES_IMU` (105), in frames of MAVLink 2 and 1.
//!
//! Sources: mavlink.io (serialisation, signing), `common.xml` as pymavlink 2.4.50 has it. All
//! fields little-endian:
//!
//! ```text
//! 2  FD | length u8 | incompatible u8 | compatible u8 | sequence u8 | system u8 | component u8
//!       | message u24 | payload | CRC-16 | signature 13, if bit 0 of incompatible
//! 1  FE | length u8 | sequence u8 | system u8 | component u8 | message u8 | payload | CRC-16
//! HIGHRES_IMU: time us u64 | acceleration m/s^2 3 x f32 | rate rad/s 3 x f32 | magnetic 3 x f32
//!              | pressures and height 3 x f32 | temperature f32 | fields_updated u16 | id u8
//! ```
//!
//! MAVLink 2 leaves out zeros at the end of a payload, MAVLink 1 the `id`. A payload that ends
//! before the last rate passes unchanged: the correction may have no room in it.
//!
//! **Signed** frames of MAVLink 2 cannot be changed without the key, and a wrong signature would
//! make the navigation computer refuse them. Their units are called unknown, so that the device
//! raises a fault and passes everything through: switch signing off at the sensor.
//!
//! **Several senders.** The correction belongs to one IMU, which is configured ([`Imu`]). Those of
//! other IMUs pass unchanged.
//!
//! All other messages of the dialect `common` pass unchanged. The CRC of messages of other dialects
//! cannot be checked, so their bytes are no message to the device.

use self::checksum::{is_right, resealed};
use super::field::{finite, put, take};
use super::protocol::Change;
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};
use serde::{Deserialize, Serialize};

/// Message number of `HIGHRES_IMU`.
pub const HIGHRES_IMU: u32 = 105;
/// `CRC_EXTRA` of `HIGHRES_IMU`.
const CRC_EXTRA: u8 = 93;
/// Bytes of a signature.
const SIGNATURE: usize = 13;
/// Bytes of the CRC.
const CRC: usize = 2;
/// Bytes of the longest payload of `HIGHRES_IMU`.
const LONGEST: usize = 63;
/// Bytes of its shortest payload that has all values.
const SHORTEST: usize = 32;

/// Field positions in the payload.
mod at {
    pub const ACCEL: usize = 8;
    pub const GYRO: usize = 20;
    pub const REST: usize = 32;
    pub const TEMPERATURE: usize = 56;
    pub const UPDATED: usize = 60;
    pub const ID: usize = 62;
}

/// Bits of `fields_updated`: 1 = the field is new in this message. A sender that leaves all of them
/// zero does not state it.
pub mod updated {
    /// Acceleration x; y and z follow.
    pub const ACCEL_X: u16 = 1 << 0;
    /// Rate x; y and z follow.
    pub const GYRO_X: u16 = 1 << 3;
    /// Temperature.
    pub const TEMPERATURE: u16 = 1 << 12;
    /// All fields.
    pub const ALL: u16 = 0x1FFF;
}

/// Our own fault bit in `fields_updated`, of which bits 13 to 15 are not used.
pub const OWN_FAULT: u16 = 0x8000;

/// The IMU that is corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Imu {
    /// System of the IMU; 0: any, for a line with one system.
    pub system: u8,
    /// Component of the IMU; 0: any, for a line with one component that sends `HIGHRES_IMU`.
    pub component: u8,
    /// Number of the IMU, `id`.
    pub id: u8,
}

impl Imu {
    /// The first one of whatever sends.
    pub const USUAL: Imu = Imu {
        system: 0,
        component: 0,
        id: 0,
    };

    fn is(self, [system, component, id]: [u8; 3]) -> bool {
        let same = |configured, sent| configured == 0 || configured == sent;
        same(self.system, system) && same(self.component, component) && self.id == id
    }
}

/// Header of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// MAVLink 2, not 1.
    two: bool,
    /// Bytes of the payload.
    length: u8,
    signed: bool,
    /// System, component.
    sender: [u8; 2],
    /// Message number.
    id: u32,
}

impl Header {
    /// The header of the message at the beginning of `bytes`.
    fn of(bytes: &[u8]) -> Result<Header, Scan> {
        let two = match bytes.first() {
            None | Some(0xFD) => true,
            Some(0xFE) => false,
            Some(_) => return Err(Scan::Garbage),
        };
        let needed = if two { 10 } else { 6 };
        if bytes.is_empty() {
            return Err(Scan::Partial(6));
        }
        if bytes.len() < needed {
            return Err(Scan::Partial(needed));
        }
        if !two {
            let [length, _, system, component, id] = take(bytes, 1);
            return Ok(Header {
                two,
                length,
                signed: false,
                sender: [system, component],
                id: u32::from(id),
            });
        }
        let [length, incompatible, _, _, system, component, a, b, c] = take(bytes, 1);
        // a receiver discards messages with unknown incompatible flags
        if incompatible > 1 {
            return Err(Scan::Garbage);
        }
        Ok(Header {
            two,
            length,
            signed: incompatible != 0,
            sender: [system, component],
            id: u32::from_le_bytes([a, b, c, 0]),
        })
    }

    /// Offset of the payload.
    fn payload(&self) -> usize {
        if self.two { 10 } else { 6 }
    }

    /// Offset of the CRC.
    fn crc(&self) -> usize {
        self.payload() + usize::from(self.length)
    }

    /// Bytes of the message.
    fn len(&self) -> usize {
        self.crc() + CRC + if self.signed { SIGNATURE } else { 0 }
    }

    /// A `HIGHRES_IMU` with all values.
    fn has_sample(&self) -> bool {
        let length = usize::from(self.length);
        self.id == HIGHRES_IMU && (SHORTEST..=LONGEST).contains(&length)
    }
}

/// Scans for a message at the beginning of `bytes`. That of this IMU is a frame.
pub fn scan(imu: Imu, bytes: &[u8]) -> Scan {
    let header = match Header::of(bytes) {
        Ok(header) => header,
        Err(scan) => return scan,
    };
    let Some(extra) = extra::of(header.id) else {
        return Scan::Garbage;
    };
    let len = header.len();
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(message) if !is_right(message, &header, extra) => Scan::BadChecksum,
        Some(message) if is_of(imu, message, header) => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

/// Whether a message is signed: bit 0 of the incompatible flags of MAVLink 2.
fn is_signed(message: &[u8]) -> bool {
    let [mark, _, incompatible] = take(message, 0);
    mark == 0xFD && incompatible & 1 != 0
}

/// Whether a good message is a `HIGHRES_IMU` of this IMU.
fn is_of(imu: Imu, message: &[u8], header: Header) -> bool {
    let frame = Frame {
        buffer: message,
        header,
    };
    header.has_sample() && imu.is(frame.sender())
}

/// A `HIGHRES_IMU`.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    header: Header,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one message of this IMU with the right header, length and CRC.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(imu: Imu, buffer: T) -> Result<Frame<T>, Error> {
        if !exactly(buffer.as_ref(), |bytes| scan(imu, bytes))? {
            return Err(Error::Header);
        }
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a message that a framer has checked.
    fn over(buffer: T) -> Option<Frame<T>> {
        let header = Header::of(buffer.as_ref()).ok()?;
        header.has_sample().then_some(Frame { buffer, header })
    }

    /// A field of the payload; what was left out of it is zero.
    fn field<const N: usize>(&self, at: usize) -> [u8; N] {
        let bytes = self.buffer.as_ref();
        let begin = self.header.payload() + at;
        if at + N <= usize::from(self.header.length) {
            return take(bytes, begin);
        }
        let mut field = [0; N];
        let left = bytes.get(begin..self.header.crc()).unwrap_or_default();
        field
            .iter_mut()
            .zip(left)
            .for_each(|(to, from)| *to = *from);
        field
    }

    fn triad(&self, at: usize) -> [f32; 3] {
        let bytes = self.buffer.as_ref();
        let begin = self.header.payload() + at;
        [0, 4, 8].map(|axis| f32::from_le_bytes(take(bytes, begin + axis)))
    }

    /// System, component, and number of the IMU.
    pub fn sender(&self) -> [u8; 3] {
        let [system, component] = self.header.sender;
        let [id] = self.field(at::ID);
        [system, component, id]
    }

    /// Microseconds since the sensor started or since 1970.
    pub fn time_us(&self) -> u64 {
        u64::from_le_bytes(self.field(0))
    }

    /// See [`updated`].
    pub fn updated(&self) -> u16 {
        u16::from_le_bytes(self.field(at::UPDATED))
    }

    /// Rates and accelerations.
    pub fn sample(&self) -> RawSample {
        RawSample::Floats {
            gyro: self.triad(at::GYRO),
            accel: self.triad(at::ACCEL),
        }
    }

    /// Values that are not new are not valid, nor those that are no finite number. A temperature is
    /// one only where the message says that it is new: without a thermometer the field is 0.
    pub fn reading(&self) -> Reading {
        let (gyro, accel) = (self.triad(at::GYRO), self.triad(at::ACCEL));
        let new = match self.updated() & updated::ALL {
            0 => updated::ALL,
            stated => stated,
        };
        let valid = Axes::new(
            finite(&gyro) & (new / updated::GYRO_X) as u8,
            finite(&accel) & (new / updated::ACCEL_X) as u8,
        );
        let measured = self.updated() & updated::TEMPERATURE != 0;
        let temperature = [f32::from_le_bytes(self.field(at::TEMPERATURE)); 3];
        Reading {
            time: Some(self.time_us() as f64 * 1e-6),
            temperature: measured.then_some(temperature),
            ..Reading::new(RawSample::Floats { gyro, accel }, Axes::ALL, valid)
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the six values and, if asked, [`OWN_FAULT`], and changes the CRC by the difference.
    /// `None`, and nothing is changed, for a sample of counts and for a signed frame.
    fn change(&mut self, change: &Change) -> Option<()> {
        let RawSample::Floats { gyro, accel } = *change.sample else {
            return None;
        };
        if self.header.signed {
            return None;
        }
        let header = &self.header;
        let (bytes, payload) = (self.buffer.as_mut(), header.payload());
        resealed(
            bytes,
            header,
            payload + at::ACCEL,
            |place: &mut [u8; 24]| {
                for (axis, value) in accel.into_iter().chain(gyro).enumerate() {
                    put(place, 4 * axis, value.to_le_bytes());
                }
            },
        )?;
        if change.mark && usize::from(header.length) >= at::ID {
            // with two bytes of the temperature before it
            let at = payload + at::UPDATED - 2;
            resealed(bytes, header, at, |place: &mut [u8; 4]| {
                place[3] |= OWN_FAULT.to_le_bytes()[1];
            })?;
        }
        Some(())
    }
}

/// Every field of a `HIGHRES_IMU` that is not signed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repr {
    /// MAVLink 2, not 1.
    pub two: bool,
    /// Bytes of the payload, 32 to 63. Fields beyond it are zero.
    pub length: u8,
    /// Compatible flags of MAVLink 2.
    pub compatible: u8,
    /// Number of the sender's message.
    pub sequence: u8,
    /// System, component.
    pub sender: [u8; 2],
    /// Microseconds.
    pub time_us: u64,
    /// Rates and accelerations.
    pub sample: RawSample,
    /// Magnetic field, pressures, height: as they are.
    pub rest: [u8; 24],
    /// Degrees Celsius.
    pub temperature: f32,
    /// See [`updated`].
    pub updated: u16,
    /// Number of the IMU.
    pub id: u8,
}

impl Repr {
    /// Takes a message apart.
    pub fn parse<T: AsRef<[u8]>>(frame: &Frame<T>) -> Repr {
        let bytes = frame.buffer.as_ref();
        let header = frame.header;
        let (flags, sequence) = if header.two { (3, 4) } else { (6, 2) };
        let [compatible] = take(bytes, flags);
        let [sequence] = take(bytes, sequence);
        let [.., id] = frame.sender();
        Repr {
            two: header.two,
            length: header.length,
            compatible: if header.two { compatible } else { 0 },
            sequence,
            sender: header.sender,
            time_us: frame.time_us(),
            sample: frame.sample(),
            rest: frame.field(at::REST),
            temperature: f32::from_le_bytes(frame.field(at::TEMPERATURE)),
            updated: frame.updated(),
            id,
        }
    }

    /// Writes the message with its CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short, [`Error::Field`] when `length` is out of
    /// range, [`Error::Content`] for a sample of counts.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let RawSample::Floats { gyro, accel } = self.sample else {
            return Err(Error::Content);
        };
        let header = Header {
            two: self.two,
            length: self.length,
            signed: false,
            sender: self.sender,
            id: HIGHRES_IMU,
        };
        if !header.has_sample() {
            return Err(Error::Field);
        }
        let mut payload = [0; LONGEST];
        put(&mut payload, 0, self.time_us.to_le_bytes());
        for (axis, value) in accel.into_iter().chain(gyro).enumerate() {
            put(&mut payload, at::ACCEL + 4 * axis, value.to_le_bytes());
        }
        put(&mut payload, at::REST, self.rest);
        put(
            &mut payload,
            at::TEMPERATURE,
            self.temperature.to_le_bytes(),
        );
        put(&mut payload, at::UPDATED, self.updated.to_le_bytes());
        put(&mut payload, at::ID, [self.id]);
        let message = buffer.get_mut(..header.len()).ok_or(Error::Length)?;
        let [system, component] = self.sender;
        let (id, length, sequence) = (HIGHRES_IMU as u8, self.length, self.sequence);
        if self.two {
            let flags = [0xFD, length, 0, self.compatible];
            put(message, 0, flags);
            put(message, 4, [sequence, system, component, id, 0, 0]);
        } else {
            put(message, 0, [0xFE, length, sequence, system, component, id]);
        }
        let places = message.iter_mut().skip(header.payload());
        let payload = payload.iter().take(usize::from(length));
        places.zip(payload).for_each(|(place, byte)| *place = *byte);
        checksum::seal(message, &header);
        Ok(header.len())
    }
}

mod checksum;
mod extra;
mod protocol;
pub use protocol::{Protocol, Settings};

#[cfg(test)]
pub(super) mod tests;
