//! VectorNav binary output messages (VN-100, VN-200, VN-300 and their successors).
//!
//! Sources: VN-100 user manual UM001 (header, CRC, meaning and units of the fields), VectorNav's
//! C++ libraries 1.2 and SDK 0.99 (lengths of all fields, status bits). Little-endian, but for the
//! CRC:
//!
//! ```text
//! FA | groups u8 | one word u16 a group | fields, lowest group and bit first | CRC-16, high byte
//! first
//! ```
//!
//! The user chooses the fields, so [`layout`] finds them by the header. A message with at least one
//! triad of the gyros is a frame. All other messages pass unchanged, and so does one of more than
//! 256 bytes.
//!
//! **What is corrected.** A message may measure the same motion up to three times:
//!
//! | values | fields | errors |
//! |---|---|---|
//! | increments | `DeltaTheta`, `DeltaVel` | the sensor's, unless its register 82 says otherwise |
//! | uncompensated rates | `UncompGyro`, `UncompAccel` (`Imu`) | the sensor's |
//! | compensated rates | `AngularRate`, `Accel` | what the sensor's own filter leaves |
//!
//! The first of these that the message has are its sample, for gyros and accelerometers apart. With
//! increments, uncompensated rates in the same message are changed by the same amount, as they have
//! the same errors. Compensated rates pass unchanged, in this message and in others: the sensor's
//! filter has subtracted its own estimate of the same errors, and ours would be subtracted from it
//! once more. The device can be configured to take the compensated rates instead ([`Values`]). Then
//! they alone are read and changed, and the bias that is learnt moves with the sensor's filter.
//!
//! Increments must be in body axes (register 82, as delivered). Their `DeltaTime` is the period of
//! the messages; without it the configured rate counts.
//!
//! No recorded message is public. Those in the tests were put together by hand, with a CRC by
//! Python's `binascii.crc_hqx`, and VectorNav's own library reads them as they are meant.

use self::checksum::{Difference, is_right};
pub use self::layout::{Layout, Quantity, Values};
use self::layout::{TRIADS, Triad};
use super::field::{finite, put, take};
use super::framer::LONGEST;
use super::protocol::Change;
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};
use crate::units::DEGREE;

/// Status bits: 1 = bad.
pub mod status {
    /// `InsStatus`: the processor does not hear the IMU.
    pub const IMU_ERROR: u16 = 1 << 4;
    /// `VpeStatus`: a gyro is at the end of its range.
    pub const GYRO_SATURATION: u16 = 1 << 2;
    /// `VpeStatus`: an accelerometer is at the end of its range.
    pub const ACCEL_SATURATION: u16 = 1 << 9;
    /// `SensSat`: accelerometer x is at the end of its range; y and z follow.
    pub const ACCEL_X: u16 = 1 << 3;
    /// `SensSat`: gyro x is at the end of its range; y and z follow.
    pub const GYRO_X: u16 = 1 << 6;
}

/// Our own fault bit in `ImuStatus`, of which bits 10 to 15 are not used.
pub const OWN_FAULT: u16 = 0x8000;

/// Scans for a message at the beginning of `bytes`. One that has these values is a frame.
pub fn scan(values: Values, bytes: &[u8]) -> Scan {
    let layout = match Layout::of(bytes) {
        Ok(layout) => layout,
        Err(scan) => return scan,
    };
    match bytes.get(..layout.len) {
        None => Scan::Partial(layout.len),
        Some(message) if !is_right(message) => Scan::BadChecksum,
        Some(_) if layout.has_sample(values) => Scan::Frame(layout.len),
        Some(_) => Scan::Other(layout.len),
    }
}

/// A message with a sample.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    layout: Layout,
    /// The triads that are read and changed.
    gyro: &'static Triad,
    accel: Option<&'static Triad>,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one message with the right header, length and CRC.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(values: Values, buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), |bytes| scan(values, bytes))?;
        Frame::over(values, buffer).ok_or(Error::Header)
    }

    /// A view over a message that a framer has checked.
    #[inline(never)] // three callers
    fn over(values: Values, buffer: T) -> Option<Frame<T>> {
        let layout = Layout::of(buffer.as_ref()).ok()?;
        let gyro = layout
            .best(values, false)
            .filter(|_| layout.len <= LONGEST)?;
        let accel = layout.best(values, true);
        Some(Frame {
            buffer,
            layout,
            gyro,
            accel,
        })
    }

    /// The field at a position, if it is there.
    fn field<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        (at != 0).then(|| take(self.buffer.as_ref(), at))
    }

    fn status(&self, at: usize) -> u16 {
        self.field(at).map_or(0, u16::from_le_bytes)
    }

    fn values(&self, triad: &Triad) -> [f32; 3] {
        floats(take(self.buffer.as_ref(), self.layout.at(triad)))
    }

    /// Quantities of the gyros and the accelerometers of the sample.
    pub fn quantities(&self) -> (Quantity, Option<Quantity>) {
        (self.gyro.quantity, self.accel.map(|triad| triad.quantity))
    }

    /// Nanoseconds since the sensor started, else GPS time, if the message contains one of them.
    pub fn time_ns(&self) -> Option<u64> {
        self.field(self.layout.time()).map(u64::from_le_bytes)
    }

    /// The sample; zero where the message has none of the accelerometers.
    pub fn sample(&self) -> RawSample {
        let (gyro, accel) = self.triads();
        RawSample::Floats { gyro, accel }
    }

    fn triads(&self) -> ([f32; 3], [f32; 3]) {
        let accel = self.accel.map_or([0.0; 3], |triad| self.values(triad));
        (self.values(self.gyro), accel)
    }

    /// Values at the end of their range are not valid, nor those that are no finite number.
    fn valid(&self, gyro: &[f32; 3], accel: &[f32; 3]) -> Axes {
        let layout = &self.layout;
        if self.status(layout.ins_status()) & status::IMU_ERROR != 0 {
            return Axes::NONE;
        }
        let saturation = self.status(layout.saturation());
        let vpe = self.status(layout.vpe_status());
        let good = |first: u16, all: u16| match vpe & all {
            0 => !(saturation / first) as u8,
            _ => 0,
        };
        let gyro = finite(gyro) & good(status::GYRO_X, status::GYRO_SATURATION);
        let accel = finite(accel) & good(status::ACCEL_X, status::ACCEL_SATURATION);
        Axes::new(gyro, if self.accel.is_some() { accel } else { 0 })
    }

    /// The sample and what goes with it.
    pub fn reading(&self) -> Reading {
        let (gyro, accel) = self.triads();
        let present = Axes::new(7, if self.accel.is_some() { 7 } else { 0 });
        let temperature = self.field(self.layout.temperature());
        Reading {
            time: self.time_ns().map(|ns| ns as f64 * 1e-9),
            temperature: temperature.map(|celsius| [f32::from_le_bytes(celsius); 3]),
            ..Reading::new(
                RawSample::Floats { gyro, accel },
                present,
                self.valid(&gyro, &accel),
            )
        }
    }
}

/// A triad of the sample, and what it becomes.
struct Corrected {
    triad: &'static Triad,
    before: [f32; 3],
    after: [f32; 3],
    /// The worth of an increment in the units of the rates.
    rate: f64,
}

impl Corrected {
    /// Corrected values of another triad with the same errors; `None` where it has others.
    fn applied(&self, other: &Triad, mut values: [f32; 3]) -> Option<[f32; 3]> {
        if core::ptr::eq(self.triad, other) {
            return Some(self.after);
        }
        let scale = match (self.triad.quantity, other.quantity) {
            (Quantity::Increments, Quantity::Uncompensated) => self.rate as f32,
            (ours, other) if ours == other => 1.0,
            _ => return None,
        };
        let pairs = self.before.iter().zip(&self.after);
        for (value, (before, after)) in values.iter_mut().zip(pairs) {
            let difference = after - before;
            if difference.is_finite() {
                *value += difference * scale;
            }
        }
        Some(values)
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes the sample, all values with the same errors and, if asked, [`OWN_FAULT`], and changes
    /// the CRC by the difference. `None`, and nothing is changed, for a sample of counts.
    fn change(&mut self, change: &Change) -> Option<()> {
        let RawSample::Floats { gyro, accel } = *change.sample else {
            return None;
        };
        let period = self.layout.period(self.buffer.as_ref());
        let rate = layout::rate(period, change.settings.rate);
        let corrected = |triad, after, rate| Corrected {
            triad,
            before: self.values(triad),
            after,
            rate,
        };
        let gyro = corrected(self.gyro, gyro, rate * DEGREE);
        let accel = self.accel.map(|triad| corrected(triad, accel, rate));
        let status = self.layout.imu_status();
        let mut mark = (change.mark && status != 0).then_some(status);
        let mut difference = Difference::of(self.buffer.as_mut());
        // from front to back
        for triad in &TRIADS {
            let at = self.layout.at(triad);
            if at == 0 {
                continue;
            }
            if let Some(status) = mark.take_if(|status| *status < at) {
                difference.set(status, OWN_FAULT);
            }
            let sample = if triad.accel {
                accel.as_ref()
            } else {
                Some(&gyro)
            };
            let values = floats(difference.bytes(at));
            if let Some(values) = sample.and_then(|sample| sample.applied(triad, values)) {
                difference.put(at, bytes(values));
            }
        }
        if let Some(status) = mark {
            difference.set(status, OWN_FAULT);
        }
        difference.finish();
        Some(())
    }
}

fn floats(bytes: [u8; 12]) -> [f32; 3] {
    [0, 4, 8].map(|at| f32::from_le_bytes(take(&bytes, at)))
}

fn bytes(floats: [f32; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (axis, value) in floats.into_iter().enumerate() {
        put(&mut bytes, 4 * axis, value.to_le_bytes());
    }
    bytes
}

mod checksum;
pub mod layout;
mod protocol;
mod repr;
pub use protocol::{Protocol, Settings};
pub use repr::Repr;

#[cfg(test)]
pub(super) mod tests;
