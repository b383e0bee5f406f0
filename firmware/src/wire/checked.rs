//! A frame whose checksum was right when it arrived, to be read and changed without checking it
//! again.
//!
//! Only a [`super::Framer`], [`Checked::new`] and [`Checked::burst`] make one, so whoever has one
//! need not check. And no damage after that check can be sealed under a good checksum: a checksum
//! is not recomputed from the bytes but *changed by the difference* (CRCs and sums are linear). A
//! byte that is corrupted in between fails the receiver's check.

use super::sequence::Stream;
use super::{Change, Error, Framing, ImuFormat, Reading, Settings, adis, exactly, stim300};
use crate::sample::Axes;

/// Length of the usual frames: STIM300 datagrams with gyros and accelerometers, of which a sensor
/// sends up to 2000 a second.
pub(crate) const USUAL: usize = stim300::USUAL.1;

/// Origin of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Out of a stream of bytes.
    Stream(ImuFormat),
    /// A burst of an ADIS, framed by chip select.
    Burst(adis::Form),
    /// A burst in our own frame ([`adis::uart`]), which leaves framed.
    FramedBurst(adis::Form),
}

impl Source {
    /// Units, rate and gap rule of frames of this [`Checked::content`]; `None` when they are not
    /// known.
    pub fn stream(self, settings: &Settings, content: u8) -> Option<Stream> {
        match self {
            Source::Stream(format) => format.stream(settings, content),
            Source::Burst(_) | Source::FramedBurst(_) => {
                Some(adis::counting(settings.adis?.units, settings.rate))
            }
        }
    }
}

/// A frame whose checksum was right when it arrived.
#[derive(Debug, PartialEq, Eq)]
pub struct Checked<'a> {
    source: Source,
    bytes: &'a mut [u8],
}

impl<'a> Checked<'a> {
    /// Found good by a framer.
    #[inline(always)]
    pub(super) fn good(format: ImuFormat, bytes: &'a mut [u8]) -> Checked<'a> {
        let source = Source::Stream(format);
        Checked { source, bytes }
    }

    /// Exactly one frame.
    ///
    /// # Errors
    /// [`Error::Content`] for a good message without inertial values, else what is wrong with the
    /// bytes.
    pub fn new(format: ImuFormat, bytes: &'a mut [u8]) -> Result<Checked<'a>, Error> {
        if exactly(bytes, |bytes| format.scan(bytes))? {
            Ok(Checked::good(format, bytes))
        } else {
            Err(Error::Content)
        }
    }

    /// A burst as it leaves: [`adis::Settings::leaving`].
    ///
    /// # Errors
    /// What is wrong with the burst.
    pub fn burst(settings: &adis::Settings, bytes: &'a mut [u8]) -> Result<Checked<'a>, Error> {
        let source = if settings.framed {
            adis::uart::check(settings.form, bytes)?;
            Source::FramedBurst(settings.form)
        } else {
            settings.form.check(bytes)?;
            Source::Burst(settings.form)
        };
        Ok(Checked { source, bytes })
    }

    /// Origin of the frame.
    pub fn source(&self) -> Source {
        self.source
    }

    /// All bytes of the frame.
    pub fn bytes(&self) -> &[u8] {
        self.bytes
    }

    /// The kind of frame: see [`super::ImuProtocol::content`].
    #[inline(always)]
    pub fn content(&self) -> u8 {
        match self.source {
            Source::Stream(format) => format.content(self.bytes),
            Source::Burst(_) | Source::FramedBurst(_) => 0,
        }
    }

    /// The six values and what goes with them.
    ///
    /// # Errors
    /// [`Error::Content`], which a good frame never gives.
    pub fn read(&self) -> Result<Reading, Error> {
        self.reading().ok_or(Error::Content)
    }

    /// A frame of the kind of which most come. What is done with it looks at neither source nor
    /// length.
    #[inline(always)]
    pub(crate) fn of_usual(bytes: &'a mut [u8; USUAL]) -> Checked<'a> {
        Checked {
            source: Source::Stream(ImuFormat::Stim300),
            bytes,
        }
    }

    /// The reading as an option: a reference to where it was made, not a copy.
    #[inline(always)]
    pub(crate) fn reading(&self) -> Option<Reading> {
        let bytes = &*self.bytes;
        match self.source {
            Source::Stream(format) => format.read(bytes),
            Source::Burst(form) => adis::Frame::over(form, bytes).map(|frame| frame.reading()),
            Source::FramedBurst(_) => adis::uart::read(bytes),
        }
    }

    /// Changes it, and its checksum by the same difference. Returns the axes whose value saturated.
    ///
    /// # Errors
    /// [`Error::Content`] when the frame has no values of this kind; nothing is changed.
    #[inline(always)]
    pub fn change(&mut self, change: &Change) -> Result<Axes, Error> {
        let bytes = &mut *self.bytes;
        let saturated = match self.source {
            Source::Stream(format) => format.change(bytes, change),
            Source::Burst(form) => {
                adis::Frame::over(form, bytes).and_then(|mut frame| frame.change(change.sample))
            }
            Source::FramedBurst(_) => adis::uart::change(bytes, change),
        };
        saturated.ok_or(Error::Content)
    }

    /// Whether it shows that the sensor has just started: see [`super::ImuProtocol::starts_up`].
    pub fn starts_up(&self) -> bool {
        match self.source {
            Source::Stream(format) => format.starts_up(self.bytes),
            Source::Burst(_) | Source::FramedBurst(_) => false,
        }
    }

    /// Whether it is changed even where nothing is corrected.
    pub fn always_changes(&self, settings: &Settings) -> bool {
        match self.source {
            Source::Stream(format) => format.always_changes(settings),
            Source::Burst(_) | Source::FramedBurst(_) => false,
        }
    }
}
