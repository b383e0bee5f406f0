//! The configuration of a device: the sensor, its mounting, the receiver, the vehicle, and how
//! corrections act.
//!
//! A user writes one file in datasheet units (`host-sim unit`). The desktop turns it into a
//! [`Configuration`] in SI units and sends it to the device as a [`record`]. The device and every
//! desktop tool make the application's and the learner's settings from it in the same way
//! (`app::Config::of`, `learn::Settings::of`).

pub mod record;

mod bursts;
mod check;
mod older;
mod usual;

pub use usual::LIMIT_SIGMAS;

use crate::compensator::Limit;
use crate::control::Mode;
use crate::inputs::Inputs;
use crate::wire::{FormatSettings, Settings, adis};
use heapless::String;
use serde::{Deserialize, Serialize};

/// Version of the record's content. A device reads older ones too and refuses newer ones.
pub const SCHEMA: u16 = 6;
/// Most bytes of the unit's name.
pub const NAME_LEN: usize = 32;
/// Most bytes of the sensor's serial number.
pub const SERIAL_LEN: usize = 24;

/// A mounting that nobody knows. A device of an earlier firmware refuses it (field `Mounting`).
pub const UNKNOWN: [f32; 4] = [0.0; 4];

/// The configuration of a device. SI units throughout.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Configuration {
    /// Identity of unit and sensor.
    pub identity: Identity,
    /// The serial lines.
    pub lines: SerialLines,
    /// Format of the sensor's frames; `None`: detected at start.
    pub sensor: Option<Sensor>,
    /// Sample rate where the frames do not contain it, Hz, 1 to 20 000.
    pub rate: f64,
    /// Rotation from sensor axes to body axes (forward, right, down): unit quaternion w, x, y, z.
    /// [`UNKNOWN`]: nobody knows it, and body axes are the sensor's.
    pub mounting: [f32; 4],
    /// Gyros. Rates in rad/s.
    pub gyro: Triad,
    /// Accelerometers. Specific force in m/s2.
    pub accel: Triad,
    /// GNSS receiver.
    pub receiver: Receiver,
    /// Vehicle.
    pub vehicle: Vehicle,
    /// Settings of the corrections.
    pub correction: Correction,
    /// Inputs of the networks. Those that need a thermometer stay constant where the sensor has
    /// none.
    pub inputs: Inputs,
    /// Speed of the wheels; `None`: nobody reports it. At the record's end, since earlier schemas
    /// do not have it.
    #[serde(skip)]
    pub wheels: Option<Wheels>,
}

/// Identity of unit and sensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Name of the unit, ASCII without control characters, not empty.
    pub name: String<NAME_LEN>,
    /// Serial number of the sensor, ASCII without control characters; may be empty.
    pub serial: String<SERIAL_LEN>,
}

/// Bit rates and pins. The command link's are fixed, so that a device can always be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SerialLines {
    /// Bit rate of the sensor's and the navigation computer's line, bit/s.
    pub sensor_baud: u32,
    /// Parity of both.
    pub parity: Parity,
    /// Two stop bits instead of one, on both.
    pub two_stop_bits: bool,
    /// Bit rate of the receiver's line, bit/s.
    pub receiver_baud: u32,
    /// Set of the board's pins that the lines use; 0 is the board's usual one.
    pub pins: u8,
    /// Bytes of the sensor's frames leave while the frame still arrives
    /// ([`crate::link::cut`]). At the record's end, since earlier schemas do not have it.
    #[serde(skip)]
    pub cut_through: bool,
}

impl SerialLines {
    /// Lines of a device without a configuration: STIM300 and KVH as delivered, u-blox.
    pub const DEFAULT: SerialLines = SerialLines {
        sensor_baud: 921_600,
        parity: Parity::None,
        two_stop_bits: false,
        receiver_baud: 115_200,
        pins: 0,
        cut_through: false,
    };
}

/// Parity of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Parity {
    /// None.
    #[default]
    None,
    /// Even.
    Even,
    /// Odd.
    Odd,
}

/// Format of the sensor's frames, with the settings that they do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Sensor {
    /// A stream of bytes on the sensor's line.
    Stream(FormatSettings),
    /// An ADIS at the board's SPI.
    Spi(adis::Settings),
}

/// The errors of a triad by its datasheet. All are standard deviations and >= 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Triad {
    /// Bias that changes at each power-on, with what is left of the calibration; rad/s or m/s2, >
    /// 0.
    pub bias_turn_on: f32,
    /// Random walk of the bias in an hour; rad/s or m/s2.
    pub bias_in_run: f32,
    /// White noise: angle random walk, rad/sqrt(s); velocity random walk, m/s/sqrt(s). > 0.
    pub white_noise: f32,
    /// Scale factor error, as a ratio.
    pub scale: f32,
    /// Misalignment of the axes, rad.
    pub misalignment: f32,
    /// Gyros: bias by specific force, rad/s per m/s2. Accelerometers: second-order coefficient,
    /// m/s2 per (m/s2)^2.
    pub g_sensitivity: f32,
    /// Measurement range, rad/s or m/s2, > 0. A plain value.
    pub range: f32,
}

/// The receiver whose fixes teach the networks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Receiver {
    /// Protocol of the receiver.
    pub protocol: ReceiverProtocol,
    /// Lever arm from the IMU to the antenna in body axes (forward, right, down), m, each -100 to
    /// 100.
    pub lever_arm: [f32; 3],
    /// Standard deviation of the lever arm along each axis, m, 0 to 100. 0: it is known exactly.
    pub lever_arm_sigma: f32,
    /// Least age of a fix when it arrives, s, 0 to 1.
    pub fix_delay: f32,
    /// Standard deviation of that age, s, 0 to 1. 0: it is known exactly.
    pub fix_delay_sigma: f32,
    /// The receiver's time pulse is wired to the board.
    pub pulse: bool,
    /// Receivers with two antennas: direction from the first antenna to the second, clockwise from
    /// the vehicle's forward axis as seen from above, rad, -pi to pi.
    pub heading_offset: f32,
}

/// Protocol of a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ReceiverProtocol {
    /// u-blox UBX-NAV-PVT.
    #[default]
    Ubx,
    /// NMEA 0183 sentences.
    Nmea,
    /// NovAtel binary logs.
    Novatel,
    /// Septentrio Binary Format.
    Sbf,
    /// Any of these that the line carries.
    Detect,
}

/// Wheels whose speed a host reports ([`crate::wheels`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// From the IMU to the middle of the axle that does not steer, in body axes (forward, right,
    /// down), m, each -100 to 100.
    pub lever_arm: [f32; 3],
    /// Distance of the axle whose speed is reported ahead of that one, m, 0 to 100: the wheelbase
    /// for front wheels that steer. 0: that one's speed is reported.
    pub ahead: f32,
    /// Standard deviation of the speed's scale, as a ratio, 0 to 0.5.
    pub scale: f32,
    /// Standard deviation of a reported speed, resolution included, m/s, > 0 to 10.
    pub noise: f32,
    /// Time from a speed's validity to its message, which its age comes on top of, s, 0 to 1.
    pub delay: f32,
}

/// The vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Vehicle {
    /// Kind of the vehicle.
    pub kind: VehicleKind,
    /// Largest speed over ground, m/s, > 0 to 1000.
    pub speed: f32,
}

/// Kind of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum VehicleKind {
    /// On land; it can stop.
    #[default]
    Land,
    /// On water; it is never stationary.
    Ship,
    /// In the air; it is stationary only on the ground.
    Air,
}

/// When, in mode learn, what was learnt comes into force.
///
/// A navigation computer that has aligned itself with uncorrected samples has compensated the
/// sensors' errors by its tilt and heading. To correct the samples afterwards is worse than to
/// leave them (680 m in 22 min for 100 ug). A navigation computer that estimates biases follows a
/// correction that moves while it estimates the same thing, and is worse than without. So by
/// default nothing moves in a drive. The three live activations are for navigation computers that
/// do not estimate biases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Activation {
    /// Live: when the navigation computer reports that its alignment begins.
    Commanded,
    /// Live: also when the vehicle has come to a standstill, as samples and receiver agree: for a
    /// navigation computer that then aligns itself without a report.
    Standstill,
    /// Live: as soon as it is proved, and from then on with all that is learnt, no faster than
    /// the slew limit: for an aided navigation computer, whose own filter follows.
    Faded,
    /// From the next power-on of the sensor on. What has proved itself in this drive is stored.
    /// What was stored before this drive corrects all of it, from its first sample, unchanged.
    #[default]
    NextPowerOn,
    /// As `NextPowerOn`, and the gyros' errors that the first rest after power-on shows: for a
    /// vehicle that stands when it is switched on, and a navigation computer that aligns itself
    /// afterwards. Needs no receiver.
    FirstRest,
}

/// Settings of the corrections.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// Mode at power-on.
    pub mode: Mode,
    /// Condition under which learnt networks come into force.
    pub activation: Activation,
    /// Largest correction.
    pub limit: Limit,
    /// Fastest change of a correction after the alignment: rad/s per s, m/s2 per s. It must take a
    /// correction at its limit to zero within a day.
    pub slew: Limit,
    /// Time between network steps, s, 0.1 to 10.
    pub block: f32,
    /// Length of an alignment that is not commanded, s, `align::LEAST_S` to 3600.
    pub align: f32,
    /// The sensor counts as silent when no byte has come for this time, microseconds, 1000 to 10^7,
    /// and at least two periods of the samples.
    pub silence_us: u32,
    /// Mark a frame whose correction must not be trusted.
    pub mark: bool,
    /// Compare the samples' rate with the board's clock (fault RATE). Off only where samples do not
    /// come in real time: a recording that is sent faster, as by `host-sim hil --fast`.
    pub check_rate: bool,
}

impl Configuration {
    /// Settings that the sensor's frames do not contain, for the decoder.
    #[must_use]
    pub fn wire_settings(&self) -> Settings {
        let mut settings = Settings {
            rate: self.rate,
            ..Settings::DEFAULT
        };
        match self.sensor {
            Some(Sensor::Stream(format)) => format.apply(&mut settings),
            Some(Sensor::Spi(adis)) => settings.adis = Some(adis),
            None => {}
        }
        settings
    }

    /// Whether the sensor's frames may contain its temperature; `None` while its format is not
    /// known.
    #[must_use]
    pub fn has_thermometer(&self) -> Option<bool> {
        Some(match self.sensor? {
            Sensor::Stream(format) => format.has_thermometer(),
            Sensor::Spi(adis) => adis.form.has_thermometer(),
        })
    }

    /// The configuration for samples in body axes. A mounting that nobody knows stays unknown.
    #[must_use]
    pub fn in_body_axes(mut self) -> Configuration {
        if self.mounting != UNKNOWN {
            self.mounting = [1.0, 0.0, 0.0, 0.0];
        }
        self
    }

    /// A direction of the vehicle (forward, right, down) in sensor axes; zero where the mounting
    /// is unknown.
    #[must_use]
    pub fn direction(&self, v: [f32; 3]) -> [f32; 3] {
        if self.mounting == UNKNOWN {
            return [0.0; 3];
        }
        self.in_sensor_axes(v)
    }

    /// A vector of body axes (forward, right, down) in sensor axes.
    #[must_use]
    pub fn in_sensor_axes(&self, v: [f32; 3]) -> [f32; 3] {
        // v + 2 u x (u x v - w v): the rotation by the conjugate quaternion
        let [w, x, y, z] = self.mounting;
        let cross = |a: [f32; 3], b: [f32; 3]| {
            [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ]
        };
        let u = [x, y, z];
        let t = cross(u, v);
        let inner = [t[0] - w * v[0], t[1] - w * v[1], t[2] - w * v[2]];
        let turned = cross(u, inner);
        [
            v[0] + 2.0 * turned[0],
            v[1] + 2.0 * turned[1],
            v[2] + 2.0 * turned[2],
        ]
    }
}

#[cfg(test)]
pub(crate) mod tests;
