//! A frame whose checksum was right when it arrived, to be read and changed without checking it again.
//!
//! Only a [`super::Framer`] makes one, or [`Checked::burst`], so whoever holds one need not check. And no damage after that check can be sealed
//! under a good checksum: a checksum is not made anew from the bytes but *changed by what was changed* (CRCs and sums are
//! linear). A byte that a disturbance turned over in between still fails the receiver's check.

use super::stim300::Extra;
use super::{Error, Format, Reading, adis, hg4930, kvh, novatel, stim300};
use crate::sample::{Axes, RawSample};

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
    pub words: &'w RawSample,
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
        let bytes = &mut *self.bytes;
        let mark = change.mark;
        let held = match (self.source, *change.words) {
            (Source::Stream(Format::Stim300), RawSample::Counts { gyro, accel }) => {
                stim300::Frame::over(bytes)
                    .and_then(|mut frame| frame.change(gyro, accel, change.family))
            }
            (Source::Stream(Format::Kvh), RawSample::Floats { gyro, accel }) => {
                kvh::Frame::over(bytes)
                    .and_then(|mut frame| frame.change(gyro, accel, mark))
                    .map(|()| Axes::NONE)
            }
            (Source::Stream(Format::Novatel), RawSample::Counts { gyro, accel }) => {
                novatel::Frame::over(bytes)
                    .and_then(|mut frame| frame.change(gyro, accel, mark))
                    .map(|()| Axes::NONE)
            }
            (Source::Stream(Format::Hg4930), RawSample::Counts { gyro, accel }) => {
                hg4930::Frame::over(bytes).and_then(|mut frame| frame.change(gyro, accel, mark))
            }
            (Source::Burst(form), RawSample::Counts { gyro, accel }) => {
                adis::Frame::over(form, bytes).map(|mut frame| frame.change(gyro, accel))
            }
            _ => None,
        };
        held.ok_or(Error::Content)
    }
}
