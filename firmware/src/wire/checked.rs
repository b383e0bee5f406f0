//! A frame whose checksum was right when it arrived, to be read and changed without checking it again.
//!
//! Only a [`super::Framer`] makes one, or [`Checked::burst`], so whoever holds one need not check. And no damage after that check can be sealed
//! under a good checksum: a checksum is not made anew from the bytes but *changed by what was changed* (CRCs and sums are
//! linear). A byte that a disturbance turned over in between still fails the receiver's check.

use super::stim300::Extra;
use super::{Axes, Error, Format, Reading, Words, adis, hg4930, kvh, novatel, stim300};

/// The longest frame with inertial words.
pub const MAX_LEN: usize = novatel::LONG_LEN;

/// Where a frame comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Out of a stream of bytes.
    Stream(Format),
    /// A burst of an ADIS, framed by chip select.
    Burst(adis::Form),
}

/// What is changed in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change<'w> {
    /// The six words; those the frame does not have are left out.
    pub words: &'w Words,
    /// Set our own fault bit, where the format has room. It is never cleared.
    pub mark: bool,
    /// STIM300: the family of the identifier.
    pub family: Option<Extra>,
}

/// A frame whose checksum was right when it arrived.
#[derive(Debug, PartialEq, Eq)]
pub struct Checked<'a> {
    source: Source,
    bytes: &'a mut [u8],
}

impl<'a> Checked<'a> {
    pub(super) fn new(format: Format, bytes: &'a mut [u8]) -> Checked<'a> {
        let source = Source::Stream(format);
        Checked { source, bytes }
    }

    /// A burst as it was fetched.
    ///
    /// # Errors
    /// What is wrong with the bytes.
    pub fn burst(form: adis::Form, reply: &'a mut [u8]) -> Result<Checked<'a>, Error> {
        form.check(reply)?;
        let source = Source::Burst(form);
        Ok(Checked {
            source,
            bytes: reply,
        })
    }

    /// Where it comes from.
    pub fn source(&self) -> Source {
        self.source
    }

    /// All of it.
    pub fn bytes(&self) -> &[u8] {
        self.bytes
    }

    /// What the meaning of its words depends on, besides the sensor's configuration: the STIM300 identifier, the `NovAtel`
    /// IMU type (0 when the log does not tell), the HG4930 message; 0 for others.
    pub fn content(&self) -> u8 {
        match self.source {
            Source::Stream(Format::Stim300) => self.bytes.first().copied().unwrap_or_default(),
            Source::Stream(Format::Hg4930) => self.bytes.get(1).copied().unwrap_or_default(),
            Source::Stream(Format::Novatel) => novatel::Frame::over(&*self.bytes)
                .and_then(|frame| frame.info())
                .map_or(0, |(_, kind)| kind.0),
            Source::Stream(Format::Kvh | Format::Ubx) | Source::Burst(_) => 0,
        }
    }

    /// The six words and what goes with them.
    ///
    /// # Errors
    /// [`Error::Content`] when it has no inertial words (UBX).
    pub fn read(&self) -> Result<Reading, Error> {
        let bytes = &*self.bytes;
        let reading = match self.source {
            Source::Stream(Format::Stim300) => {
                stim300::Frame::over(bytes).map(|frame| frame.reading())
            }
            Source::Stream(Format::Kvh) => kvh::Frame::over(bytes).map(|frame| frame.reading()),
            Source::Stream(Format::Novatel) => {
                novatel::Frame::over(bytes).map(|frame| frame.reading())
            }
            Source::Stream(Format::Hg4930) => {
                hg4930::Frame::over(bytes).and_then(|frame| frame.reading().ok())
            }
            Source::Burst(form) => adis::Frame::over(form, bytes).map(|frame| frame.reading()),
            Source::Stream(Format::Ubx) => None,
        };
        reading.ok_or(Error::Content)
    }

    /// Change it, and its checksum by the same difference. Returns the axes whose word had to be held at the end of its
    /// field.
    ///
    /// # Errors
    /// [`Error::Content`] when the frame has no words of this kind; nothing is changed.
    pub fn change(&mut self, change: &Change) -> Result<Axes, Error> {
        let mut before = [0; MAX_LEN];
        let before = before.get_mut(..self.bytes.len()).ok_or(Error::Content)?;
        before.copy_from_slice(self.bytes); // of equal length, which the compiler sees: no panic remains
        let held = self.put(change).ok_or(Error::Content)?;
        let bytes = &mut *self.bytes;
        match self.source {
            Source::Stream(Format::Hg4930) => {
                hg4930::reseal(bytes, before);
                return Ok(held);
            }
            Source::Burst(form) => {
                if let Some(mut frame) = adis::Frame::over(form, bytes) {
                    frame.reseal(before);
                }
                return Ok(held);
            }
            _ => {}
        }
        exclusive_or(before, bytes);
        match self.source {
            Source::Stream(Format::Stim300) => stim300::reseal(bytes, before),
            Source::Stream(Format::Kvh) => kvh::reseal(bytes, before),
            Source::Stream(Format::Novatel) => novatel::reseal(bytes, before),
            Source::Stream(Format::Hg4930 | Format::Ubx) | Source::Burst(_) => {}
        }
        Ok(held)
    }

    /// The fields, without the checksum.
    fn put(&mut self, change: &Change) -> Option<Axes> {
        let bytes = &mut *self.bytes;
        match (self.source, *change.words) {
            (Source::Stream(Format::Stim300), Words::Counts { gyro, accel }) => {
                let mut frame = stim300::Frame::over(bytes)?;
                if let Some(family) = change.family {
                    frame.put_family(family);
                }
                Some(frame.put_words(gyro, accel))
            }
            (Source::Stream(Format::Kvh), Words::Floats { gyro, accel }) => {
                let mut frame = kvh::Frame::over(bytes)?;
                frame.put_words(gyro, accel);
                if change.mark {
                    frame.put_mark();
                }
                Some(Axes::NONE)
            }
            (Source::Stream(Format::Novatel), Words::Counts { gyro, accel }) => {
                let mut frame = novatel::Frame::over(bytes)?;
                frame.put_words(gyro, accel);
                if change.mark {
                    frame.put_mark();
                }
                Some(Axes::NONE)
            }
            (Source::Stream(Format::Hg4930), Words::Counts { gyro, accel }) => {
                let mut frame = hg4930::Frame::over(bytes)?;
                if change.mark {
                    frame.put_mark();
                }
                frame.put_words(gyro, accel).ok()
            }
            (Source::Burst(form), Words::Counts { gyro, accel }) => {
                Some(adis::Frame::over(form, bytes)?.put_words(gyro, accel))
            }
            _ => None,
        }
    }
}

/// `to ^= by`, four bytes at a time: a quarter of the instructions.
fn exclusive_or(to: &mut [u8], by: &[u8]) {
    let (to_words, to_rest) = to.as_chunks_mut::<4>();
    let (by_words, by_rest) = by.as_chunks::<4>();
    for (to, by) in to_words.iter_mut().zip(by_words) {
        *to = (u32::from_ne_bytes(*to) ^ u32::from_ne_bytes(*by)).to_ne_bytes();
    }
    for (to, by) in to_rest.iter_mut().zip(by_rest) {
        *to ^= by;
    }
}
