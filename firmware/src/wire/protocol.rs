//! The interface of a wire format.
//!
//! An IMU format implements [`ImuProtocol`] in its own file and is named once, in the list of
//! [`super`]. Everything that loops over the formats follows from that list: framing, detection,
//! correction, settings, simulated sensors and the tests.

use super::sequence::Stream;
use super::{Error, Reading, Scan, Settings};
use crate::sample::{Axes, RawSample};
use core::fmt::Debug;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Framing of a format in a stream of bytes.
pub trait Framing: Copy + PartialEq {
    /// Scans for a message at the beginning of `bytes`.
    fn scan(self, bytes: &[u8]) -> Scan;

    /// The length of a good frame at the beginning of `bytes`, where that is known sooner than by
    /// [`Framing::scan`]. `None`: not known.
    #[inline(always)]
    fn usual(self, _bytes: &[u8]) -> Option<usize> {
        None
    }

    /// Whether a start mark is long enough to mean something by itself. If not, a wrong checksum
    /// behind it has no meaning, except where a frame is expected.
    fn has_start_mark(self) -> bool {
        true
    }
}

/// A wire format of an IMU. `scan` checks length and checksum; all other functions get a frame that
/// `scan` has found good, and check nothing again.
pub trait ImuProtocol {
    /// Settings that the frames do not contain. They are part of the device's configuration.
    type Settings: Debug + Copy + PartialEq + Serialize + DeserializeOwned;
    /// The settings of a sensor as delivered.
    const DEFAULT: Self::Settings;
    /// Name on command lines and in tables: lower case, without spaces.
    const NAME: &'static str;
    /// See [`Framing::has_start_mark`].
    const HAS_START_MARK: bool = true;
    /// Sensors that simulators and tests make frames of, at least one. The first one is the sensor
    /// of simulated drives: a device with default settings must understand it.
    const SIMULATED: &'static [Simulated];

    /// See [`Framing::scan`].
    fn scan(bytes: &[u8]) -> Scan;

    /// See [`Framing::usual`].
    #[inline(always)]
    fn usual(_bytes: &[u8]) -> Option<usize> {
        None
    }

    /// The kind of frame, where units, rate or the set of values depend on it, and where one sample
    /// may come in two logs. Each kind has its own carried remainder.
    fn content(_frame: &[u8]) -> u8 {
        0
    }

    /// Units, rate and gap rule of frames of this [`ImuProtocol::content`], or `None` when they are
    /// not known. `rate` is the configured one, Hz, for formats that do not state theirs.
    fn stream(settings: &Self::Settings, content: u8, rate: f64) -> Option<Stream>;

    /// The six values and what goes with them.
    fn read(frame: &[u8]) -> Option<Reading>;

    /// Changes values, own fault bit and checksum. The checksum is changed by the difference and
    /// never recomputed. Returns the axes whose value saturated.
    fn change(frame: &mut [u8], change: &Change, settings: &Self::Settings) -> Option<Axes>;

    /// Whether a frame of such a sensor may contain its temperature ([`Reading::temperature`]).
    fn has_thermometer(_settings: &Self::Settings) -> bool {
        false
    }

    /// Whether frames are changed even where nothing is corrected.
    fn always_changes(_settings: &Self::Settings) -> bool {
        false
    }

    /// Whether a good message shows that the sensor has just started: a status bit of a frame, or a
    /// message that is sent at power-on only. A frame is asked only if it calls an axis invalid.
    fn starts_up(_message: &[u8]) -> bool {
        false
    }

    /// Recomputes the checksum of a frame, for simulators and tests.
    fn seal(frame: &mut [u8]);
}

/// A format whose frames do not state their content. Their layout follows from the settings.
pub trait LaidOut: ImuProtocol {
    /// Layout of a frame. The constant `USUAL` of this type is the layout that [`ImuProtocol`]'s
    /// own functions take.
    type Layout: Copy;

    /// As [`ImuProtocol::scan`].
    fn scan(layout: Self::Layout, bytes: &[u8]) -> Scan;

    /// See [`Framing::usual`].
    #[inline(always)]
    fn usual(_layout: Self::Layout, _bytes: &[u8]) -> Option<usize> {
        None
    }

    /// As [`ImuProtocol::read`].
    fn read(layout: Self::Layout, frame: &[u8]) -> Option<Reading>;

    /// As [`ImuProtocol::change`].
    fn change(
        layout: Self::Layout,
        frame: &mut [u8],
        change: &Change,
        settings: &Self::Settings,
    ) -> Option<Axes>;
}

/// Changes of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Change<'c> {
    /// The six values. Those the frame does not have are left out.
    pub sample: &'c RawSample,
    /// Set our own fault bit, where the format has room. It is never cleared.
    pub mark: bool,
    /// Settings of the format, some of which change the frame too.
    pub settings: &'c Settings,
}

/// Writes what a sensor with these settings says of itself into a buffer and gives its length.
pub type Introduction = fn(&Settings, &mut [u8]) -> Result<usize, Error>;

/// A sensor as simulators and tests make it: one frame of one format, and the settings it needs.
#[derive(Debug, Clone, Copy)]
pub struct Simulated {
    /// Name of the frame.
    pub name: &'static str,
    /// Frames a second.
    pub rate: u32,
    /// Increment of a count of [`Fields`]: rad, m/s.
    pub count: [f64; 2],
    /// Increment of a count of the frame (or 1.0, of a float): rad, m/s. By the format's
    /// documentation and not by the code that it checks.
    pub unit: [f64; 2],
    /// Bits of a count in the frame; 32 for floats.
    pub bits: u32,
    /// Value of a quiet sensor in [`Fields::rest`].
    pub rest: u32,
    /// Whether the frame has accelerometers.
    pub has_accel: bool,
    /// Whether the frame reports that the sensor is faulty.
    pub has_status: bool,
    /// Sets the settings that the frames do not contain.
    pub settings: fn(&mut Settings),
    /// Writes a frame and returns its length. Counts keep their low bits.
    pub emit: fn(&Fields, &mut [u8]) -> Result<usize, Error>,
    /// The message in which the sensor describes itself, at its start and when it is asked. A
    /// measurement is left out for it.
    pub introduction: Option<Introduction>,
}

impl Simulated {
    /// Settings of a device for this sensor.
    pub fn settings(&self) -> Settings {
        let mut settings = Settings {
            rate: f64::from(self.rate),
            ..Settings::DEFAULT
        };
        (self.settings)(&mut settings);
        settings
    }
}

/// Content of a simulated frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Fields {
    /// Number of the frame, from 0.
    pub index: u32,
    /// Time of validity, s.
    pub time: f64,
    /// Gyro counts x, y, z.
    pub gyro: [i32; 3],
    /// Accelerometer counts x, y, z.
    pub accel: [i32; 3],
    /// Fills all fields that are neither a value nor a counter nor a time nor a status. A format
    /// uses as many of its bits as it has room for.
    pub rest: u32,
}
