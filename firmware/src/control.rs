//! Requests to the device, without the frames of the command link that carry them.
//!
//! The command link (`wire::command`) encodes these types; the learner and the application act on
//! them. The order of the variants is part of the wire format: new ones go to the end.

pub mod recording;
pub mod update;

use serde::{Deserialize, Serialize};
use update::Refusal;

/// Use of the samples by the compensator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Samples pass through unchanged.
    Bypass,
    /// Fixed weights correct the samples.
    Frozen,
    /// Samples pass through unchanged; the correction is computed and reported only.
    Shadow,
    /// The weights learn, and weights that have proved themselves correct the samples.
    Learn,
}

/// Report of the navigation computer about its alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Alignment {
    /// Started. Until now a correction may be switched on at once.
    Started,
    /// Finished. From now on a correction may only be faded in or out.
    Finished,
}

/// Source of the heading with which the learner's navigator was aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum HeadingSource {
    /// Not aligned.
    #[default]
    None,
    /// The Earth's rotation, at standstill.
    Gyrocompass,
    /// The course of a land vehicle, whose sign velocities have settled.
    Course,
    /// Velocities alone: accelerations of the vehicle, measured by sensors and receiver.
    Velocity,
    /// A heading that was given, by two antennas or by a person.
    Heading,
    /// The whole state was given.
    Known,
}

/// A reference for one window of samples, as sums. The device announces which window it awaits a
/// reference for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Number of the first sample in the window.
    pub first: u32,
    /// Number of the last sample in the window.
    pub last: u32,
    /// Sum of the true angle increments x, y, z, rad.
    pub angle: [f64; 3],
    /// Sum of the true velocity increments x, y, z, m/s.
    pub velocity: [f64; 3],
    /// Standard deviation of the angle sums, rad, > 0, including the noise of the sensor's own
    /// samples. References that share their errors over T seconds count as one in T: give each
    /// sqrt(T / window) times its own standard deviation.
    pub angle_sigma: f32,
    /// Standard deviation of the velocity sums likewise, m/s, > 0.
    pub velocity_sigma: f32,
}

/// Why a request was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reason {
    /// A number in the request is outside its range.
    Range,
    /// Not possible in this mode.
    Mode,
    /// The weight image is damaged, or has another shape or version.
    Image,
    /// The window is no longer known, or not yet.
    Window,
    /// An alignment is in progress or done.
    Alignment,
    /// The board does not have the function.
    Unsupported,
    /// Not on this board, or not yet available.
    NotAvailable,
    /// The bytes are no whole configuration record: damaged, too short or too long.
    Record,
    /// The configuration record has another schema; the device's is given.
    Schema(u16),
    /// A value of the configuration is out of its range.
    Field(Field),
    /// The bit rate cannot be reached with this board's clock; the nearest possible one is given,
    /// bit/s.
    Baud(u32),
    /// The board has no such set of pins; how many it has is given.
    Pins(u8),
    /// The device has no configuration, so it only passes bytes.
    NotConfigured,
    /// The store holds a record or a configuration of a newer firmware, whose version is given. It
    /// is not overwritten.
    Newer(u16),
    /// Work that must come first is in progress. The same request succeeds a little later.
    Busy,
    /// The device has a key, and the request is not sealed with it.
    KeyNeeded,
    /// The device has no key, and the request is sealed.
    NoKey,
    /// The seal is of a session that is over or was never begun: ask for a challenge.
    Session,
    /// The counter of the seal is not the next one: the request is an old one, or one is missing.
    Counter,
    /// The seal was made with another key, or the request was changed.
    Key,
    /// Too often. It may be asked again in so many milliseconds.
    Wait(u32),
    /// A device without a key takes its first one within a minute after power-on.
    TooLate,
    /// The update of the firmware is refused.
    Update(Refusal),
}

/// A field of the device's configuration whose value was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Field {
    /// Name of the unit.
    Name,
    /// Serial number of the sensor.
    Serial,
    /// Bit rate of the sensor's line.
    SensorBaud,
    /// Bit rate of the receiver's line.
    ReceiverBaud,
    /// Sample rate.
    Rate,
    /// Mounting.
    Mounting,
    /// Datasheet of the gyros.
    Gyro,
    /// Datasheet of the accelerometers.
    Accel,
    /// Lever arm.
    LeverArm,
    /// Delay of the fixes.
    FixDelay,
    /// Largest speed.
    Speed,
    /// Largest correction.
    Limit,
    /// Fastest change of a correction.
    Slew,
    /// Time between network steps.
    Block,
    /// Length of the alignment.
    Align,
    /// Time after which the sensor counts as silent.
    Silence,
    /// Parity or a second stop bit, which this board's lines do not have.
    Parity,
    /// Standard deviation of the lever arm.
    LeverArmSigma,
    /// Standard deviation of the fixes' delay.
    FixDelaySigma,
    /// Heading of the antenna baseline.
    HeadingOffset,
    /// Cut-through of a format that cannot be cut.
    CutThrough,
    /// Wheels.
    Wheels,
}
