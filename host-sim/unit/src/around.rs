//! The tables `[receiver]`, `[vehicle]` and `[correction]`: the surroundings of the sensor, and how
//! corrections act.

use firmware::configuration;
use firmware::control;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Standard deviation of a lever arm that nobody has measured, m: antennas are some metres from the
/// sensors of a vehicle (assumed).
const UNMEASURED_M: f64 = 2.0;
/// Standard deviation of a lever arm that was measured somehow, m: the sensors' centre is hidden in
/// a box, and a sign or an axis is easily mistaken (assumed). The filter still finds an error of
/// seven standard deviations, but not one of twenty.
const MEASURED_M: f64 = 0.5;

/// The satellite receiver whose fixes the device learns from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Receiver {
    /// Its protocol. Default: ubx.
    pub protocol: Protocol,
    /// Bit rate of its line, bit/s, 1200 to 12000000. Default: 115200.
    #[schemars(range(min = 1_200, max = 12_000_000))]
    pub baud: u32,
    /// From the IMU to the antenna: forward, right, down, m, each -100 to 100. Default: [0, 0, 0].
    /// Source: measured on the vehicle.
    #[schemars(inner(range(min = -100, max = 100)))]
    pub lever_arm_m: [f64; 3],
    /// Standard deviation of the lever arm along each axis, m, 0 to 100. The device estimates the
    /// remaining error while it drives, so a value that is too large costs little. 0: exactly as
    /// given, nothing is estimated. Default: 0.5 where lever_arm_m gives an arm; 2 where that is
    /// [0, 0, 0], because then nobody has measured it. Source: how it was measured.
    #[schemars(range(min = 0, max = 100))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lever_arm_sigma_m: Option<f64>,
    /// Least age of a fix when it arrives, ms, 0 to 1000. Default: 100, as at 115200 bit/s. Source:
    /// the receiver's manual, or measured.
    #[schemars(range(min = 0, max = 1000))]
    pub fix_delay_ms: f64,
    /// Standard deviation of that age, ms, 0 to 1000. The device estimates the remaining error
    /// while it drives, so a value that is too large costs little. 0: exactly as given, nothing is
    /// estimated. Default: 100, by which receivers, messages and bit rates differ (assumed).
    /// Source: how the delay was found.
    #[schemars(range(min = 0, max = 1000))]
    pub fix_delay_sigma_ms: f64,
    /// The receiver's time pulse is wired to the board, so that the age of a fix is measured.
    /// Default: false. Source: the wiring.
    pub pulse: bool,
    /// Receivers with two antennas: direction from the first antenna to the second, clockwise from
    /// the vehicle's forward axis as seen from above, deg, -180 to 180. Default: 0. Source:
    /// measured on the vehicle.
    #[schemars(range(min = -180, max = 180))]
    pub heading_offset_deg: f64,
}

/// Protocol of a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// u-blox UBX-NAV-PVT.
    #[default]
    Ubx,
    /// NMEA 0183: GGA, RMC, GST; without checksums as long as no line has one.
    Nmea,
    /// NovAtel logs in binary or text: BESTPOS, BESTVEL.
    Novatel,
    /// Septentrio Binary Format: PVTGeodetic or PVTCartesian.
    Sbf,
    /// Detected from the data on the line; of two the one with the better fixes.
    Detect,
}

/// The vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Vehicle {
    /// How it moves. Default: land.
    pub kind: Kind,
    /// Largest speed over ground, m/s, above 0 to 1000. Default: 50.
    #[schemars(range(min = 1e-3, max = 1000))]
    pub largest_speed_mps: f64,
    /// Whether anybody knows how the sensor sits in the vehicle. Unknown: the alignment finds the
    /// attitude of the sensor from the motion alone. Neither the course nor a given heading counts
    /// as its heading, the direction of gravity is not checked, and the lever arm is in axes of the
    /// sensor. Default: known, as `[mounting]` says.
    pub mounting: MountingKnowledge,
}

/// Whether the mounting of the sensor is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MountingKnowledge {
    /// As the table `[mounting]` says.
    #[default]
    Known,
    /// Nobody knows it.
    Unknown,
}

/// How a vehicle moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// On land; it can stand still.
    #[default]
    Land,
    /// On water; it never stands still.
    Ship,
    /// In the air; it stands still only on the ground.
    Air,
}

/// How corrections act.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Correction {
    /// Mode at power-on. Default: bypass.
    pub mode: Mode,
    /// When learnt corrections come into force in mode learn. The live activations (commanded,
    /// standstill, faded) are for navigation computers that do not estimate biases. Default:
    /// next-power-on.
    pub activation: Activation,
    /// Largest correction of a gyro, deg/h, 0 to 1e6. Default: three times its bias, at
    /// power-on and in run together.
    #[schemars(range(min = 0, max = 1e6))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_gyro_dph: Option<f64>,
    /// Largest correction of an accelerometer, ug, 0 to 1e7. Default: three times its bias, at
    /// power-on and in run together.
    #[schemars(range(min = 0, max = 1e7))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit_accel_ug: Option<f64>,
    /// Fastest change of a gyro's correction after the alignment, deg/h per s, 0 to 1e6. Default: a
    /// thousandth of its limit.
    #[schemars(range(min = 0, max = 1e6))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slew_gyro_dphps: Option<f64>,
    /// Fastest change of an accelerometer's correction after the alignment, ug per s, 0 to 1e7.
    /// Default: a thousandth of its limit.
    #[schemars(range(min = 0, max = 1e7))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slew_accel_ugps: Option<f64>,
    /// Time between two steps of the networks, s, 0.1 to 10. Default: 1.
    #[schemars(range(min = 0.1, max = 10))]
    pub block_s: f64,
    /// Length of an alignment that is not commanded, s, 30 to 3600. Default: 100.
    #[schemars(range(min = 30, max = 3600))]
    pub align_s: f64,
    /// Mark a frame whose correction must not be trusted, in a spare bit of the frame
    /// (docs/ICD.md). Default: true.
    pub mark: bool,
    /// Compare the rate of the samples with the board's clock. Off only where samples do not come
    /// in real time. Default: true.
    pub check_rate: bool,
}

/// Mode at power-on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Samples pass unchanged.
    #[default]
    Bypass,
    /// Stored weights correct the samples.
    Frozen,
    /// Samples pass unchanged; the correction is computed and reported only.
    Shadow,
    /// The device learns, and corrections that have proved themselves are applied to the samples.
    Learn,
}

/// When learnt corrections come into force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// Live: when the navigation computer reports that its alignment begins.
    Commanded,
    /// Live: also when the vehicle has come to a standstill, as samples and receiver agree.
    Standstill,
    /// Live: as soon as it is proved, no faster than the slew limit.
    Faded,
    /// The correction is stored, and applied to all samples from the next power-on.
    #[default]
    NextPowerOn,
    /// As next-power-on, and the gyros' errors that the first rest after power-on shows as well:
    /// for a vehicle that stands when it is switched on. Needs no receiver.
    FirstRest,
}

impl Default for Receiver {
    fn default() -> Self {
        Self {
            protocol: Protocol::Ubx,
            baud: 115_200,
            lever_arm_m: [0.0; 3],
            lever_arm_sigma_m: None,
            fix_delay_ms: 100.0,
            fix_delay_sigma_ms: 100.0,
            pulse: false,
            heading_offset_deg: 0.0,
        }
    }
}

impl Receiver {
    /// Standard deviation of the lever arm, m: as given, or as its documentation says.
    #[must_use]
    pub fn lever_arm_sigma(&self) -> f64 {
        let usual = if self.lever_arm_m == [0.0; 3] {
            UNMEASURED_M
        } else {
            MEASURED_M
        };
        self.lever_arm_sigma_m.unwrap_or(usual)
    }
}

impl Default for Vehicle {
    fn default() -> Self {
        Self {
            kind: Kind::Land,
            largest_speed_mps: 50.0,
            mounting: MountingKnowledge::Known,
        }
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self {
            mode: Mode::Bypass,
            activation: Activation::NextPowerOn,
            limit_gyro_dph: None,
            limit_accel_ug: None,
            slew_gyro_dphps: None,
            slew_accel_ugps: None,
            block_s: 1.0,
            align_s: 100.0,
            mark: true,
            check_rate: true,
        }
    }
}

impl From<Protocol> for configuration::ReceiverProtocol {
    fn from(protocol: Protocol) -> Self {
        match protocol {
            Protocol::Ubx => Self::Ubx,
            Protocol::Nmea => Self::Nmea,
            Protocol::Novatel => Self::Novatel,
            Protocol::Sbf => Self::Sbf,
            Protocol::Detect => Self::Detect,
        }
    }
}

impl From<Kind> for configuration::VehicleKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Land => Self::Land,
            Kind::Ship => Self::Ship,
            Kind::Air => Self::Air,
        }
    }
}

impl From<Mode> for control::Mode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Bypass => Self::Bypass,
            Mode::Frozen => Self::Frozen,
            Mode::Shadow => Self::Shadow,
            Mode::Learn => Self::Learn,
        }
    }
}

impl From<Activation> for configuration::Activation {
    fn from(activation: Activation) -> Self {
        match activation {
            Activation::Commanded => Self::Commanded,
            Activation::Standstill => Self::Standstill,
            Activation::Faded => Self::Faded,
            Activation::NextPowerOn => Self::NextPowerOn,
            Activation::FirstRest => Self::FirstRest,
        }
    }
}
