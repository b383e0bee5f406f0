//! Our own frame around an ADIS burst, for a line without chip select.
//!
//! A bare burst has no start mark. A reader of a serial line that has lost synchronisation cannot
//! find the next one. This frame can be found, states its content, and is guarded by a CRC:
//!
//! ```text
//! AD 15 | bytes of the burst u8 (20, 32, 40) | flags u8 | time u32 | burst | CRC-32 u32
//! ```
//!
//! Time and CRC are little-endian, the burst is the sensor's, byte for byte ([`super`]), its own
//! checksum too. The time is that at which the burst was fetched, microseconds of the sender's
//! clock modulo 2^32. The CRC is the ordinary one of zlib over all bytes before it. `docs/ICD.md`
//! has a worked example.
//!
//! A device whose ADIS is at its SPI sends this frame if it is so configured
//! ([`super::Settings::framed`]). A device reads it on its sensor line as format `adis-uart`.

mod protocol;
pub use protocol::{Protocol, Settings};

use super::{BURST_1649X_LEN, Form, Frame};
use crate::sample::Axes;
use crate::wire::checksum::{crc32_novatel_change, crc32_zlib};
use crate::wire::field::{Mark, head, mark, put, take};
use crate::wire::{Change, Error, Reading, Scan, exactly};

const START: [u8; 2] = [0xAD, 0x15];
/// Bytes in front of the burst.
const HEADER: usize = 8;
/// Bytes of the CRC.
const TRAILER: usize = 4;
/// Bytes of a frame beside those of its burst.
pub const AROUND: usize = HEADER + TRAILER;
/// Bytes of the longest frame.
pub const LONGEST: usize = BURST_1649X_LEN + AROUND;

/// Flag: the values are increments (BURST_SEL), not rates.
pub const INCREMENTS: u8 = 1 << 0;
/// Our own fault flag. Bits 1 to 6 are reserved: 0 when sent, not looked at when read.
pub const OWN_FAULT: u8 = 1 << 7;

/// Field positions.
mod at {
    pub const LENGTH: usize = 2;
    pub const FLAGS: usize = 3;
    pub const TIME: usize = 4;
}

/// The form of the burst in a frame.
fn form(frame: &[u8]) -> Option<Form> {
    let [length] = take(frame, at::LENGTH);
    [Form::Narrow, Form::Wide, Form::Adis1649x]
        .into_iter()
        .find(|form| form.bytes() == usize::from(length))
}

/// The bytes under the CRC.
fn summed(frame: &[u8]) -> &[u8] {
    let end = frame.len().saturating_sub(TRAILER);
    head(frame, end)
}

fn burst(frame: &[u8]) -> &[u8] {
    let end = frame.len().saturating_sub(TRAILER);
    frame.get(HEADER..end).unwrap_or_default()
}

fn burst_mut(frame: &mut [u8]) -> &mut [u8] {
    let end = frame.len().saturating_sub(TRAILER);
    frame.get_mut(HEADER..end).unwrap_or_default()
}

/// Looks for a frame at the beginning of `bytes`. A frame whose burst was damaged before it was
/// put into the frame passes as another message.
pub fn scan(bytes: &[u8]) -> Scan {
    match mark(bytes, &START) {
        Mark::No => return Scan::Garbage,
        Mark::Whole if bytes.len() >= HEADER => {}
        Mark::Whole => return Scan::Partial(HEADER),
        Mark::Part => return Scan::Partial(START.len()),
    }
    let Some(form) = form(bytes) else {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    };
    let len = HEADER + form.bytes() + TRAILER;
    let Some(frame) = bytes.get(..len) else {
        return Scan::Partial(len);
    };
    let stated = u32::from_le_bytes(take(frame, len - TRAILER));
    if crc32_zlib(summed(frame)) != stated {
        Scan::BadChecksum
    } else if form.check(burst(frame)).is_err() {
        Scan::Other(len)
    } else {
        Scan::Frame(len)
    }
}

/// Recomputes both checksums, that of the burst first.
fn seal(frame: &mut [u8]) {
    if let Some(form) = form(frame) {
        form.seal(burst_mut(frame));
    }
    seal_frame(frame);
}

fn seal_frame(frame: &mut [u8]) {
    let crc = crc32_zlib(summed(frame)).to_le_bytes();
    put(frame, frame.len().saturating_sub(TRAILER), crc);
}

/// Puts a burst into a frame, as it is, and returns the frame. `time_us`: when it was fetched.
///
/// # Errors
/// [`Error::Length`] when the burst is not of this form.
pub fn wrap<'b>(
    form: Form,
    flags: u8,
    time_us: u32,
    reply: &[u8],
    buffer: &'b mut [u8; LONGEST],
) -> Result<&'b mut [u8], Error> {
    let frame = buffer.get_mut(..HEADER + form.bytes() + TRAILER);
    let frame = frame.ok_or(Error::Length)?;
    if reply.len() != form.bytes() {
        return Err(Error::Length);
    }
    put(frame, 0, START);
    put(frame, at::LENGTH, [form.bytes() as u8, flags]);
    put(frame, at::TIME, time_us.to_le_bytes());
    for (place, byte) in burst_mut(frame).iter_mut().zip(reply) {
        *place = *byte;
    }
    seal_frame(frame);
    Ok(frame)
}

/// Whether the burst in a frame that [`wrap`] has made is good.
///
/// # Errors
/// [`Error::Header`] or [`Error::Checksum`].
pub(in crate::wire) fn check(form: Form, frame: &[u8]) -> Result<(), Error> {
    form.check(burst(frame))
}

/// The six values of a good frame and what goes with them.
#[inline(never)] // not in the code of all formats
pub(in crate::wire) fn read(frame: &[u8]) -> Option<Reading> {
    Some(Frame::over(form(frame)?, burst(frame))?.reading())
}

/// Changes values and own fault flag, and both checksums by the difference. Returns the axes that
/// saturated.
#[inline(never)] // likewise
pub(in crate::wire) fn change(frame: &mut [u8], change: &Change) -> Option<Axes> {
    let form = form(frame)?;
    let mut bits: [u8; BURST_1649X_LEN] = [0; BURST_1649X_LEN];
    let place = burst_mut(frame);
    let len = place.len();
    for (bit, byte) in bits.iter_mut().zip(&*place) {
        *bit = *byte;
    }
    let saturated = Frame::over(form, &mut *place)?.change(change.sample)?;
    for (bit, byte) in bits.iter_mut().zip(&*place) {
        *bit ^= *byte;
    }
    // the CRCs of zlib and NovAtel change alike: they differ in how they begin and end
    let mut difference = crc32_novatel_change(head(&bits, len), 0);
    let [flags] = take(frame, at::FLAGS);
    if change.mark && flags & OWN_FAULT == 0 {
        put(frame, at::FLAGS, [flags | OWN_FAULT]);
        difference ^= crc32_novatel_change(&[OWN_FAULT], HEADER - at::TIME + len);
    }
    let crc = frame.len().checked_sub(TRAILER)?;
    let sum = u32::from_le_bytes(take(frame, crc)) ^ difference;
    put(frame, crc, sum.to_le_bytes());
    Some(saturated)
}

/// A frame as numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Repr {
    /// Form of the burst.
    pub form: Form,
    /// See [`INCREMENTS`] and [`OWN_FAULT`].
    pub flags: u8,
    /// Time at which the burst was fetched, microseconds.
    pub time_us: u32,
    /// The burst, and zeros behind a shorter one.
    pub burst: [u8; BURST_1649X_LEN],
}

impl Repr {
    /// Takes a frame apart.
    ///
    /// # Errors
    /// [`Error::Header`], [`Error::Length`] or [`Error::Checksum`]; [`Error::Content`] when its
    /// burst was damaged before.
    pub fn parse(frame: &[u8]) -> Result<Repr, Error> {
        if !exactly(frame, scan)? {
            return Err(Error::Content);
        }
        let mut all = [0; BURST_1649X_LEN];
        for (place, byte) in all.iter_mut().zip(burst(frame)) {
            *place = *byte;
        }
        let [flags] = take(frame, at::FLAGS);
        Ok(Repr {
            form: form(frame).ok_or(Error::Header)?,
            flags,
            time_us: u32::from_le_bytes(take(frame, at::TIME)),
            burst: all,
        })
    }

    /// Writes the frame with its CRC and returns its length.
    ///
    /// # Errors
    /// [`Error::Length`] when the buffer is too short.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let mut frame = [0; LONGEST];
        let reply = head(&self.burst, self.form.bytes());
        let frame = wrap(self.form, self.flags, self.time_us, reply, &mut frame)?;
        let place = buffer.get_mut(..frame.len()).ok_or(Error::Length)?;
        place.copy_from_slice(frame);
        Ok(frame.len())
    }
}

#[cfg(test)]
pub(in crate::wire) mod tests;
