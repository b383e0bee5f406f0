//! Safran (Sensonor) STIM300 measurement datagrams.
//!
//! Source: datasheet TS1524 rev 31 (February 2024), tables 5-20 to 5-23, equations 1 to 10. The
//! identifiers of older firmware, which has an auxiliary input where rev 31 has PPS, are from the
//! `vortexntnu/stim300-driver`.
//!
//! All fields most significant byte first, data words 24-bit two's complement:
//!
//! ```text
//! ID | gyro 3x3 + status | [acc 3x3 + st] | [incl 3x3 + st] | [temperatures 3x2 + st, per cluster]
//!    | [PPS 3 + st]
//!    | counter | latency 2 | CRC 4 | [CR LF]
//! ```
//!
//! There is no start mark. A frame is an identifier byte with a right CRC at the length that the
//! identifier names. The identifier does not state whether CR LF follows, and the CRC does not
//! cover it. [`scan`] reports CR LF as a message of its own, so that no frame waits for it.
//!
//! STIM318 and STIM377H are of the same family but were not checked.

pub mod config;
pub mod request;

use super::checksum::{crc32_mpeg2_padded, crc32_mpeg2_padded_change, crc32_mpeg2_words};
use super::field::{be_i24, head, put, put_be_i24, resealed, saturate_i24, take};
use super::{Error, Reading, Scan, exactly};
use crate::sample::{Axes, RawSample};
use serde::{Deserialize, Serialize};

/// The longest measurement datagram, without CR LF.
pub const MAX_LEN: usize = 63;

/// Field positions that do not depend on the content. The last ones count from the end.
mod at {
    pub const GYRO: usize = 1;
    /// One inertial cluster: three values and a status byte.
    pub const CLUSTER: usize = 10;
    /// One cluster's temperatures: three values and a status byte.
    pub const TEMPERATURES: usize = 7;
    /// PPS or auxiliary value and its status byte.
    pub const EXTRA: usize = 4;
    pub const EXTRA_FROM_END: usize = 11;
    pub const COUNTER_FROM_END: usize = 7;
    pub const LATENCY_FROM_END: usize = 6;
    pub const CRC: usize = 4;
}

/// Status bits: 1 = bad.
pub mod status {
    /// System integrity error.
    pub const INTEGRITY: u8 = 0x80;
    /// Start-up: data not valid yet.
    pub const START_UP: u8 = 0x40;
    /// Outside operating conditions: data are sent and may be out of specification.
    pub const CONDITIONS: u8 = 0x20;
    /// Overload of the axes in bits 2 to 0.
    pub const OVERLOAD: u8 = 0x10;
    /// Error in the measurement channels in bits 2 to 0.
    pub const CHANNEL: u8 = 0x08;

    /// Whether it calls all axes of its cluster good.
    #[inline(always)]
    pub fn is_good(status: u8) -> bool {
        status & (INTEGRITY | START_UP | OVERLOAD | CHANNEL) == 0
    }

    /// The axes of a cluster that its status byte calls good, x in bit 0.
    pub fn valid_axes(status: u8) -> u8 {
        if status & (INTEGRITY | START_UP) != 0 {
            0
        } else if status & (OVERLOAD | CHANNEL) == 0 {
            7
        } else if status & 7 == 0 {
            0 // a channel is bad, but none is named
        } else {
            !status & 7
        }
    }
}

/// The value that may follow the temperatures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Extra {
    /// None.
    None,
    /// Time since the PPS edge or filtered PPS (rev 31).
    Pps,
    /// Auxiliary input (older firmware).
    Aux,
}

/// Content of a datagram besides the gyros, as given by its identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contents {
    /// Accelerometers.
    pub accel: bool,
    /// Inclinometers.
    pub incl: bool,
    /// Temperatures, of the clusters that are there.
    pub temperature: bool,
    /// PPS or auxiliary value.
    pub extra: Extra,
}

impl Contents {
    /// Table 5-21. In all three families bits 2, 1, 0 of the identifier are temperature,
    /// inclination, acceleration.
    pub fn from_id(id: u8) -> Option<Contents> {
        let extra = match id {
            0x90..=0x94 | 0xA5..=0xA7 => Extra::None,
            0xF0..=0xF7 => Extra::Pps,
            0x98..=0x9C | 0xAD..=0xAF => Extra::Aux,
            _ => return None,
        };
        Some(Contents {
            accel: id & 1 != 0,
            incl: id & 2 != 0,
            temperature: id & 4 != 0,
            extra,
        })
    }

    /// The identifier of this content.
    pub fn id(self) -> u8 {
        let low = u8::from(self.temperature) << 2 | u8::from(self.incl) << 1 | u8::from(self.accel);
        let base = match self.extra {
            Extra::Pps => return 0xF0 | low,
            Extra::None => 0x00,
            Extra::Aux => 0x08,
        };
        base | low | if low < 5 { 0x90 } else { 0xA0 }
    }

    /// Inertial clusters.
    fn clusters(self) -> usize {
        1 + usize::from(self.accel) + usize::from(self.incl)
    }

    /// First byte after the inertial clusters.
    fn after_clusters(self) -> usize {
        at::GYRO + at::CLUSTER * self.clusters()
    }

    /// Bytes of the datagram without CR LF.
    pub fn len(self) -> usize {
        let temperatures = usize::from(self.temperature) * at::TEMPERATURES * self.clusters();
        let extra = usize::from(self.extra != Extra::None) * at::EXTRA;
        self.after_clusters() + temperatures + extra + at::COUNTER_FROM_END
    }

    /// Never: a datagram has at least the gyros.
    pub fn is_empty(self) -> bool {
        false
    }
}

/// Looks for a datagram at the beginning of `bytes`: a measurement, a special one
/// ([`config::special_len`]), or CR LF.
pub fn scan(bytes: &[u8]) -> Scan {
    let Some(&id) = bytes.first() else {
        return Scan::Partial(1);
    };
    if let Some(contents) = Contents::from_id(id) {
        check(bytes, contents.len(), Scan::Frame)
    } else if let Some(len) = config::special_len(id) {
        check(bytes, len, Scan::Other)
    } else {
        match bytes {
            [b'\r'] => Scan::Partial(2),
            [b'\r', b'\n', ..] => Scan::Other(2),
            _ => Scan::Garbage,
        }
    }
}

fn check(bytes: &[u8], len: usize, good: fn(usize) -> Scan) -> Scan {
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if crc_is_right(frame) => good(len),
        Some(_) => Scan::BadChecksum,
    }
}

/// Whether the last four bytes are the CRC of those before.
fn crc_is_right(frame: &[u8]) -> bool {
    let crc = frame.len().saturating_sub(at::CRC);
    crc32_mpeg2_padded(head(frame, crc)) == u32::from_be_bytes(take(frame, crc))
}

/// Identifier and length of what most sensors send: gyros and accelerometers.
pub(super) const USUAL: (u8, usize) = (0x91, 28);

/// The length of a good datagram of this kind.
#[inline(always)]
fn usual(bytes: &[u8]) -> Option<usize> {
    let frame = bytes.first_chunk::<{ USUAL.1 }>()?;
    let ([words @ .., crc], _) = frame.as_chunks::<4>() else {
        return None; // it has seven words
    };
    let words = words.first_chunk::<{ USUAL.1 / 4 - 1 }>()?;
    let is_one =
        frame.first() == Some(&USUAL.0) && crc32_mpeg2_words(words) == u32::from_be_bytes(*crc);
    is_one.then_some(USUAL.1)
}

/// Change of the CRC when the first bytes change.
fn crc_change(bits: &[u8], after: usize) -> [u8; 4] {
    crc32_mpeg2_padded_change(bits, after).to_be_bytes()
}

/// Puts the CRC of the bytes before it into the last four bytes.
fn seal(frame: &mut [u8]) {
    let crc = frame.len().saturating_sub(at::CRC);
    let sum = crc32_mpeg2_padded(head(frame, crc));
    put(frame, crc, sum.to_be_bytes());
}

/// A measurement datagram, without CR LF.
#[derive(Debug)]
pub struct Frame<T> {
    buffer: T,
    contents: Contents,
}

impl<T: AsRef<[u8]>> Frame<T> {
    /// A view over exactly one datagram whose identifier, length and CRC are right.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`].
    pub fn new_checked(buffer: T) -> Result<Frame<T>, Error> {
        exactly(buffer.as_ref(), scan)?;
        Frame::over(buffer).ok_or(Error::Header)
    }

    /// A view over a datagram that a framer has checked.
    pub(super) fn over(buffer: T) -> Option<Frame<T>> {
        let contents = buffer
            .as_ref()
            .first()
            .and_then(|&id| Contents::from_id(id));
        contents.map(|contents| Frame { buffer, contents })
    }

    /// Content of the datagram.
    pub fn contents(&self) -> Contents {
        self.contents
    }

    fn cluster(&self, at: usize) -> Cluster {
        let bytes: [u8; at::CLUSTER] = take(self.buffer.as_ref(), at);
        let [.., status] = bytes;
        Cluster {
            values: [0, 3, 6].map(|at| be_i24(&bytes, at)),
            status,
        }
    }

    /// Gyro counts and status.
    pub fn gyro(&self) -> Cluster {
        self.cluster(at::GYRO)
    }

    /// Accelerometer counts and status, if any.
    pub fn accel(&self) -> Option<Cluster> {
        self.contents
            .accel
            .then(|| self.cluster(at::GYRO + at::CLUSTER))
    }

    /// Inclinometer counts and status, if any.
    pub fn incl(&self) -> Option<Cluster> {
        self.contents
            .incl
            .then(|| self.cluster(self.contents.after_clusters() - at::CLUSTER))
    }

    /// Temperatures of the `n`th cluster in the datagram (0 = gyros), 2^-8 degrees Celsius.
    pub fn temperatures(&self, n: usize) -> Option<Temperatures> {
        if !self.contents.temperature || n >= self.contents.clusters() {
            return None;
        }
        let bytes = self.buffer.as_ref();
        let at = self.contents.after_clusters() + n * at::TEMPERATURES;
        let value = |at| i16::from_be_bytes(take(bytes, at));
        let [status] = take(bytes, at + 6);
        Some(Temperatures {
            values: [value(at), value(at + 2), value(at + 4)],
            status,
        })
    }

    /// PPS or auxiliary value (24 bits) and its status byte, if any.
    pub fn extra(&self) -> Option<(u32, u8)> {
        let at = self.contents.len() - at::EXTRA_FROM_END;
        let [high, middle, low, status] = take(self.buffer.as_ref(), at);
        (self.contents.extra != Extra::None)
            .then_some((u32::from_be_bytes([0, high, middle, low]), status))
    }

    /// Counts the internal 2000 Hz samples, modulo 256: see [`config::Config::counter_step`].
    pub fn counter(&self) -> u8 {
        let at = self.contents.len() - at::COUNTER_FROM_END;
        let [counter] = take(self.buffer.as_ref(), at);
        counter
    }

    /// Time from the newest internal sample to the start of transmission, microseconds.
    pub fn latency_us(&self) -> u16 {
        let at = self.contents.len() - at::LATENCY_FROM_END;
        u16::from_be_bytes(take(self.buffer.as_ref(), at))
    }

    /// The six values and what goes with them.
    pub fn reading(&self) -> Reading {
        let gyro = self.gyro();
        let accel = self.accel();
        Reading {
            counter: Some(u16::from(self.counter())),
            latency_us: Some(self.latency_us()),
            temperature: self
                .temperatures(0)
                .map(|t| t.values.map(|count| f32::from(count) / 256.0)),
            ..Reading::new(
                RawSample::Counts {
                    gyro: gyro.values,
                    accel: accel.map_or([0; 3], |a| a.values),
                },
                Axes::new(7, if accel.is_some() { 7 } else { 0 }),
                Axes::new(
                    status::valid_axes(gyro.status),
                    accel.map_or(0, |a| status::valid_axes(a.status)),
                ),
            )
        }
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> Frame<T> {
    /// Writes gyro and accelerometer counts, each saturated at 24 bits, and changes the CRC by the
    /// difference. Returns the axes that saturated. Accelerations are left out when the datagram
    /// has none. `family` changes between PPS and auxiliary identifiers, which share one layout,
    /// for a receiver that knows only the other family; nothing happens to a datagram without
    /// either.
    #[inline(always)]
    pub(super) fn change(
        &mut self,
        gyro: [i32; 3],
        accel: [i32; 3],
        family: Option<Extra>,
    ) -> Option<Axes> {
        let bytes = self.buffer.as_mut();
        let contents = &mut self.contents;
        if contents.accel {
            return resealed(bytes, 0, crc_change, |place: &mut [u8; 24]| {
                put_family(contents, place, family.unwrap_or(Extra::None));
                let saturated = put_triad(place, at::GYRO, gyro);
                Axes::new(saturated, put_triad(place, at::GYRO + at::CLUSTER, accel))
            });
        }
        resealed(bytes, 0, crc_change, |place: &mut [u8; 12]| {
            put_family(contents, place, family.unwrap_or(Extra::None));
            Axes::new(put_triad(place, at::GYRO, gyro), 0)
        })
    }
}

/// Writes three values, each saturated at 24 bits. Returns which were, x in bit 0.
#[inline(always)]
fn put_triad(bytes: &mut [u8], at: usize, values: [i32; 3]) -> u8 {
    let mut saturated = 0;
    for (axis, value) in values.into_iter().enumerate() {
        let (value, over) = saturate_i24(value);
        put_be_i24(bytes, at + 3 * axis, value);
        saturated |= u8::from(over) << axis;
    }
    saturated
}

/// The identifier of the other family, without the CRC.
#[inline(always)]
fn put_family(contents: &mut Contents, bytes: &mut [u8], extra: Extra) {
    if contents.extra != Extra::None && extra != Extra::None {
        contents.extra = extra;
        put(bytes, 0, [contents.id()]);
    }
}

/// Three values and a status byte of an inertial cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cluster {
    /// x, y, z, 24-bit counts.
    pub values: [i32; 3],
    /// See [`status`].
    pub status: u8,
}

/// Three temperatures and a status byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Temperatures {
    /// x, y, z, 2^-8 degrees Celsius.
    pub values: [i16; 3],
    /// See [`status`].
    pub status: u8,
}

mod protocol;
mod repr;
mod words;
pub use protocol::{Protocol, Settings};
pub use repr::Repr;

#[cfg(test)]
pub(super) mod tests;
