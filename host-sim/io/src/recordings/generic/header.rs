//! The header file: its keys, and the units it may name.

use crate::recordings::record::Kind;
use host_core::inertial::units::{ARCSEC, DEG, DEG_PER_H, G0};
use host_unit::mounting::Mounting;
use serde::Deserialize;
use std::path::PathBuf;

/// All keys of a header file. The documentation of the parent module shows an example.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    /// Unit file, relative to the header file, or a preset's name.
    pub(super) unit: Option<String>,
    /// True states that navigators are judged against instead of the fixes.
    pub(super) truth: Option<Truth>,
    /// Increments or rates.
    pub(super) imu: Imu,
    /// Fixes. Without them the vehicle is at rest.
    pub(super) gnss: Option<Gnss>,
    /// Speed of the wheels.
    pub(super) wheels: Option<Wheels>,
    /// Initial attitude, and the site of a vehicle at rest.
    #[serde(default)]
    pub(super) start: Start,
}

/// True states: a file whose columns are those of `simulate`'s truth.csv or have the names of
/// [`Gnss`], or a table that names them.
#[derive(Debug, Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "is neither a file nor a table of file, separator, names, skip_lines, time, latitude, longitude, height, velocity, time_offset_s"
)]
pub(super) enum Truth {
    /// The file, relative to the header file.
    File(PathBuf),
    /// A table.
    Table(Box<TruthTable>),
}

/// Table `[truth]`. Columns that it does not name have the names of [`Gnss`].
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TruthTable {
    /// File, relative to the header file.
    pub(super) file: PathBuf,
    /// As in [`Imu`].
    #[serde(default = "comma")]
    pub(super) separator: String,
    /// As in [`Imu`].
    #[serde(default = "yes")]
    pub(super) names: bool,
    /// As in [`Imu`].
    pub(super) skip_lines: Option<usize>,
    /// Time.
    pub(super) time: Option<Scalar>,
    /// rad or deg.
    pub(super) latitude: Option<Scalar>,
    /// rad or deg.
    pub(super) longitude: Option<Scalar>,
    /// m.
    pub(super) height: Option<Scalar>,
    /// Velocity; without it, it is computed from the positions.
    pub(super) velocity: Option<Velocity>,
    /// Added to its times to give the IMU's, s. By default that of the fixes.
    pub(super) time_offset_s: Option<f64>,
}

/// The column of a scalar.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Scalar {
    /// Name.
    pub(super) column: String,
    /// Unit.
    pub(super) unit: String,
}

/// The columns of a triad.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Triad {
    /// Names: x, y, z.
    pub(super) columns: [String; 3],
    /// Unit.
    pub(super) unit: String,
}

/// The samples of the IMU.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Imu {
    /// File, relative to the header file. Required unless the user gives a file.
    pub(super) file: Option<PathBuf>,
    /// One ASCII character, `tab`, or `blank` for any run of blanks.
    #[serde(default = "comma")]
    pub(super) separator: String,
    /// Whether a line names the columns. If not, they are called 1, 2, 3.
    #[serde(default = "yes")]
    pub(super) names: bool,
    /// Lines before that of the names, or before the data. By default the names are looked for.
    pub(super) skip_lines: Option<usize>,
    /// Time of a sample, or of the end of an increment.
    pub(super) time: Scalar,
    /// Gyros: rates in rad/s, deg/s, deg/h, or increments in rad, deg, arcsec.
    pub(super) gyro: Triad,
    /// Accelerometers: specific force in m/s^2, g, mg, or increments in m/s.
    pub(super) accel: Triad,
    /// Forward, right and down in axes of the file, for example `y x -z` for right-forward-up. By
    /// default `x y z` where `mounting` is given, else the mounting of the unit.
    pub(super) axes: Option<String>,
    /// Mounting of these axes in the vehicle, if they are not the vehicle's: axes, a table of
    /// angles, or the rows of a matrix, as in the unit file.
    pub(super) mounting: Option<Turned>,
    /// Longest time between two rates that is interpolated, s. Three samples or 0.1 s by default.
    pub(super) max_gap_s: Option<f64>,
}

/// Table `[wheels]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wheels {
    /// File, relative to the header file.
    pub(super) file: PathBuf,
    /// As in [`Imu`].
    #[serde(default = "comma")]
    pub(super) separator: String,
    /// As in [`Imu`].
    #[serde(default = "yes")]
    pub(super) names: bool,
    /// As in [`Imu`].
    pub(super) skip_lines: Option<usize>,
    /// Time, on the IMU's clock.
    pub(super) time: Scalar,
    /// Speed, negative in reverse.
    pub(super) speed: Scalar,
}

/// A mounting in short forms.
#[derive(Debug, Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "is neither axes as in 'y x -z', nor roll_deg, pitch_deg and heading_deg, nor three rows of a matrix"
)]
pub(super) enum Turned {
    /// Forward, right, down.
    Axes(String),
    /// Rows: forward, right, down.
    Matrix([[f64; 3]; 3]),
    /// As in the unit file.
    Table(Mounting),
}

/// A time offset: given in seconds, or to be estimated.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "is neither seconds nor 'estimate'")]
pub(super) enum Offset {
    /// s.
    Given(f64),
    /// `estimate`.
    Word(String),
}

/// Position and velocity fixes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Gnss {
    /// File, relative to the header file. By default the file of the IMU, whose lines without a fix
    /// leave these columns empty.
    pub(super) file: Option<PathBuf>,
    /// As in [`Imu`].
    #[serde(default = "comma")]
    pub(super) separator: String,
    /// As in [`Imu`].
    #[serde(default = "yes")]
    pub(super) names: bool,
    /// As in [`Imu`].
    pub(super) skip_lines: Option<usize>,
    /// Time on the clock of the IMU, or on another whose offset `time_offset_s` gives.
    pub(super) time: Scalar,
    /// Added to the times of the fixes to give the IMU's, s, or "estimate". Default: 0.
    pub(super) time_offset_s: Option<Offset>,
    /// From the IMU to the antenna: forward, right, down, m. By default that of the unit.
    pub(super) lever_arm_m: Option<[f64; 3]>,
    /// rad or deg.
    pub(super) latitude: Scalar,
    /// rad or deg.
    pub(super) longitude: Scalar,
    /// m or ft. It may be left out.
    pub(super) height: Option<Scalar>,
    /// Velocity, if it is measured.
    pub(super) velocity: Option<Velocity>,
    /// Columns that say whether a line holds a fix, with the values of those that do.
    #[serde(default)]
    pub(super) valid: Vec<Valid>,
    /// Columns of the standard deviations of position north, east, down, m. They replace
    /// `position_sigma_m`.
    pub(super) position_sigma: Option<[String; 3]>,
    /// Columns of the standard deviations of velocity north, east, down, m/s.
    pub(super) velocity_sigma: Option<[String; 3]>,
    /// Standard deviations of position north, east, down, m, > 0.
    #[serde(default = "position_sigma")]
    pub(super) position_sigma_m: [f64; 3],
    /// Standard deviations of velocity north, east, down, m/s, > 0. Not used without a velocity.
    #[serde(default = "velocity_sigma")]
    pub(super) velocity_sigma_mps: [f64; 3],
}

/// A column whose values within a range mark a fix.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Valid {
    /// Name.
    pub(super) column: String,
    /// Least value of a fix.
    pub(super) least: Option<f64>,
    /// Largest value of a fix.
    pub(super) most: Option<f64>,
}

/// Velocity columns.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Velocity {
    /// Names of the columns: three, or the two horizontal ones.
    pub(super) columns: Vec<String>,
    /// m/s, km/h or knots.
    pub(super) unit: String,
    /// `ned`, `enu` or `neu`.
    pub(super) order: String,
}

/// A standstill or an attitude, and the site if there are no fixes. With neither, the attitude is
/// found from samples and fixes of the moving vehicle.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Start {
    /// Standstill for self-alignment, s, at least 90. A part of a second is not used.
    pub(super) standstill_s: Option<f64>,
    /// Roll at the first epoch, deg.
    pub(super) roll_deg: Option<f64>,
    /// Pitch, deg, nose up.
    pub(super) pitch_deg: Option<f64>,
    /// Heading, deg, clockwise from north. Alone it helps to find the attitude in motion.
    pub(super) heading_deg: Option<f64>,
    /// Standard deviation of that heading, deg, above 0 to 180. Default: 10.
    pub(super) heading_sigma_deg: Option<f64>,
    /// Site: latitude, deg.
    pub(super) latitude_deg: Option<f64>,
    /// Site: longitude, deg.
    pub(super) longitude_deg: Option<f64>,
    /// Site: height, m.
    pub(super) height_m: Option<f64>,
}

fn comma() -> String {
    ",".into()
}
fn yes() -> bool {
    true
}
fn position_sigma() -> [f64; 3] {
    [1.0, 1.0, 1.5]
}
fn velocity_sigma() -> [f64; 3] {
    [0.05; 3]
}

/// Name of a unit, and its value as a rate: rad/s or m/s2.
pub type NamedUnit = (String, f64);

/// A unit: its name, what it measures, and its value in SI.
pub(super) type Unit = (&'static str, Kind, f64);

/// Units of gyros.
pub(super) const GYRO: [Unit; 6] = [
    ("rad/s", Kind::Rate, 1.0),
    ("deg/s", Kind::Rate, DEG),
    ("deg/h", Kind::Rate, DEG_PER_H),
    ("rad", Kind::Increment, 1.0),
    ("deg", Kind::Increment, DEG),
    ("arcsec", Kind::Increment, ARCSEC),
];
/// Units of accelerometers.
pub(super) const ACCEL: [Unit; 5] = [
    ("m/s^2", Kind::Rate, 1.0),
    ("m/s2", Kind::Rate, 1.0),
    ("g", Kind::Rate, G0),
    ("mg", Kind::Rate, 1e-3 * G0),
    ("m/s", Kind::Increment, 1.0),
];
/// Units of time.
pub(super) const TIME: [Unit; 4] = [
    ("s", Kind::Rate, 1.0),
    ("ms", Kind::Rate, 1e-3),
    ("us", Kind::Rate, 1e-6),
    ("ns", Kind::Rate, 1e-9),
];
/// Units of latitude and longitude. With a minus they count to the south and to the west.
pub(super) const ANGLE: [Unit; 4] = [
    ("rad", Kind::Rate, 1.0),
    ("deg", Kind::Rate, DEG),
    ("-rad", Kind::Rate, -1.0),
    ("-deg", Kind::Rate, -DEG),
];
/// Units of height.
pub(super) const LENGTH: [Unit; 2] = [("m", Kind::Rate, 1.0), ("ft", Kind::Rate, 0.3048)];
/// Units of velocity.
pub(super) const SPEED: [Unit; 3] = [
    ("m/s", Kind::Rate, 1.0),
    ("km/h", Kind::Rate, 1.0 / 3.6),
    ("knots", Kind::Rate, 1852.0 / 3600.0),
];
