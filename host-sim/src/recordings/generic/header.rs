//! The header file: its keys, and the units it may name.

use crate::error::Error;
use crate::inertial::axes::Axes;
use crate::inertial::units::{ARCSEC, DEG, DEG_PER_H, G0};
use crate::recordings::record::Kind;
use crate::recordings::session::complain;
use crate::recordings::table::Separator;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// All keys of a header file. The documentation of the parent module shows an example.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    /// Unit file, relative to the header file, or a preset's name.
    pub(super) unit: Option<String>,
    /// Increments or rates.
    pub(super) imu: Imu,
    /// Fixes. Without them the vehicle is at rest.
    pub(super) gnss: Option<Gnss>,
    /// Initial attitude, and the site of a vehicle at rest.
    pub(super) start: Start,
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
    /// Whether the first line names the columns. If not, they are called 1, 2, 3.
    #[serde(default = "yes")]
    pub(super) names: bool,
    /// Time of a sample, or of the end of an increment.
    pub(super) time: Scalar,
    /// Gyros: rates in rad/s, deg/s, deg/h, or increments in rad, deg, arcsec.
    pub(super) gyro: Triad,
    /// Accelerometers: specific force in m/s^2, g, mg, or increments in m/s.
    pub(super) accel: Triad,
    /// Forward, right and down in axes of the file, for example `y x -z` for right-forward-up.
    pub(super) axes: String,
    /// Longest time between two rates that is interpolated, s. Three samples by default.
    pub(super) max_gap_s: Option<f64>,
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
    /// Time on the clock of the IMU.
    pub(super) time: Scalar,
    /// rad or deg.
    pub(super) latitude: Scalar,
    /// rad or deg.
    pub(super) longitude: Scalar,
    /// m.
    pub(super) height: Scalar,
    /// Velocity, if it is measured.
    pub(super) velocity: Option<Velocity>,
    /// Columns of the standard deviations of position north, east, down, m. They replace
    /// `position_sigma_m`.
    pub(super) position_sigma: Option<[String; 3]>,
    /// The same for velocity, m/s.
    pub(super) velocity_sigma: Option<[String; 3]>,
    /// Standard deviations of position north, east, down, m, > 0.
    #[serde(default = "position_sigma")]
    pub(super) position_sigma_m: [f64; 3],
    /// Standard deviations of velocity north, east, down, m/s, > 0. Not used without a velocity.
    #[serde(default = "velocity_sigma")]
    pub(super) velocity_sigma_mps: [f64; 3],
}

/// Velocity columns.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Velocity {
    /// Names of the columns.
    pub(super) columns: [String; 3],
    /// m/s or km/h.
    pub(super) unit: String,
    /// `ned` or `enu`.
    pub(super) order: String,
}

/// A standstill or an attitude, and the site if there are no fixes.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Start {
    /// Standstill for self-alignment, s, at least 90.
    pub(super) standstill_s: Option<u32>,
    /// Roll at the first epoch, deg.
    pub(super) roll_deg: Option<f64>,
    /// Pitch, deg, nose up.
    pub(super) pitch_deg: Option<f64>,
    /// Heading, deg, clockwise from north.
    pub(super) heading_deg: Option<f64>,
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

/// A unit by its name, and what 1.0 of it is worth as a rate: rad/s or m/s2.
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
/// Units of latitude and longitude.
pub(super) const ANGLE: [Unit; 2] = [("rad", Kind::Rate, 1.0), ("deg", Kind::Rate, DEG)];
/// Units of height.
pub(super) const LENGTH: [Unit; 1] = [("m", Kind::Rate, 1.0)];
/// Units of velocity.
pub(super) const SPEED: [Unit; 2] = [("m/s", Kind::Rate, 1.0), ("km/h", Kind::Rate, 1.0 / 3.6)];

/// A header file that was read.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) header: Header,
    pub(super) file: PathBuf,
    /// Files that replace those named in the header: that of the IMU, then that of the fixes.
    replacements: Vec<PathBuf>,
}

impl Read {
    pub(super) fn open(file: &Path, replacements: &[PathBuf]) -> Result<Self, Error> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::reading(file, e))?;
        let header: Header = toml::from_str(&text).map_err(|e| syntax_error(file, &text, &e))?;
        let read = Self {
            file: file.to_path_buf(),
            replacements: replacements.to_vec(),
            header,
        };
        let most = 1 + usize::from(read.header.gnss.is_some());
        if replacements.len() > most {
            let problem = format!(
                "describes {most} of the {} files given with it",
                replacements.len()
            );
            let remedy =
                "give the file of the IMU, then that of the fixes if the header has [gnss]";
            return Err(read.bad("header", problem, remedy));
        }
        Ok(read)
    }

    /// The file of the IMU.
    pub(super) fn imu_file(&self) -> Result<PathBuf, Error> {
        let named = || Some(self.beside(self.header.imu.file.as_ref()?));
        self.replacements
            .first()
            .cloned()
            .or_else(named)
            .ok_or_else(|| {
                let problem = "is not in the header, and no file was given with it".to_owned();
                self.bad("imu.file", problem, "give the file of the IMU")
            })
    }

    /// The file of the fixes, if it is not that of the IMU.
    pub(super) fn gnss_file(&self, gnss: &Gnss) -> Option<PathBuf> {
        let named = || Some(self.beside(gnss.file.as_ref()?));
        self.replacements.get(1).cloned().or_else(named)
    }

    /// An error in `key`.
    pub(super) fn bad(&self, key: &str, problem: String, remedy: &str) -> Error {
        complain(&self.file, key, problem, remedy)
    }

    /// A path that the header names.
    fn beside(&self, name: &Path) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(name)
    }

    pub(super) fn unit(&self, key: &str, name: &str, known: &[Unit]) -> Result<(Kind, f64), Error> {
        let hit = known.iter().find(|u| u.0 == name);
        hit.map(|u| (u.1, u.2)).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|u| u.0).collect();
            self.bad(
                key,
                format!("has the unit '{name}'"),
                &format!("use one of {}", names.join(", ")),
            )
        })
    }

    pub(super) fn axes(&self) -> Result<Axes, Error> {
        let text = &self.header.imu.axes;
        Axes::parse(text).map_err(|why| {
            let remedy = "give forward, right and down in axes of the file, \
                          as in 'y x -z' for right-forward-up";
            self.bad("imu.axes", format!("is '{text}' and {why}"), remedy)
        })
    }

    pub(super) fn separator(&self, key: &str, text: &str) -> Result<Separator, Error> {
        let mut chars = text.chars();
        match (text, chars.next(), chars.next()) {
            ("tab", ..) => Ok(Separator::Char(b'\t')),
            ("blank", ..) => Ok(Separator::Blank),
            (_, Some(c), None) if c.is_ascii() && !c.is_alphanumeric() && !"+-.".contains(c) => {
                Ok(Separator::Char(c as u8))
            }
            _ => {
                let remedy = "give one ASCII character such as ',' or ';', or 'tab', \
                              or 'blank' for any run of blanks";
                Err(self.bad(key, format!("is '{text}'"), remedy))
            }
        }
    }
}

/// An error in the TOML syntax, with its line.
fn syntax_error(file: &Path, text: &str, e: &toml::de::Error) -> Error {
    let at = e.span().map(|span| span.start.min(text.len()));
    let line = at.map(|at| text[..at].matches('\n').count() + 1);
    let on_line = line
        .and_then(|l| text.lines().nth(l - 1))
        .unwrap_or_default();
    let key = on_line
        .split('=')
        .next()
        .unwrap_or_default()
        .trim()
        .trim_matches(['[', ']']);
    Error::Scenario {
        file: file.to_path_buf(),
        line,
        key: if key.is_empty() {
            "header".into()
        } else {
            key.to_owned()
        },
        problem: e.message().replace('\n', " "),
        remedy: "see the example in the documentation of host_sim::recordings::generic".into(),
    }
}
