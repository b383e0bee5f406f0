//! Any recording as text. A TOML header file says what the columns mean:
//!
//! ```toml
//! # The unit: what is known of the sensors. A file is relative to the header file. Optional.
//! unit = "unit.toml"
//!
//! [imu]
//! # Relative to the header file, plain or gzipped. A file on the command line replaces it.
//! file = "imu.csv"
//! # s, ms, us, ns
//! time = { column = "t", unit = "ms" }
//! # Rates: rad/s, deg/s, deg/h. Increments: rad, deg, arcsec.
//! gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
//! # Specific force: m/s^2, g (9.80665 m/s^2), mg. Increments: m/s.
//! accel = { columns = ["ax", "ay", "az"], unit = "g" }
//! # Forward, right, down in axes of the file. These are right-forward-up.
//! axes = "y x -z"
//! # "," by default, or "tab", or "blank" for any run of blanks.
//! # separator = ";"
//! # Lines before that of the names. By default the names are looked for.
//! # skip_lines = 3
//! # Without a line of names the columns are called "1", "2", ...
//! # names = false
//! # Longest step between rates that is interpolated. Three samples or 0.1 s by default.
//! # max_gap_s = 0.05
//!
//! # Leave this table out if the vehicle is at rest.
//! [gnss]
//! # By default the file of the IMU, whose lines without a fix leave these columns empty.
//! file = "gnss.csv"
//! # Added to the times of the fixes to give the IMU's, or "estimate".
//! # time_offset_s = 2.9
//! # From the IMU to the antenna: forward, right, down.
//! # lever_arm_m = [-1.0, 0.2, -1.5]
//! time = { column = "t", unit = "ms" }
//! # rad, deg, or -deg for degrees west or south; the height in m or ft
//! latitude = { column = "lat", unit = "deg" }
//! longitude = { column = "lon", unit = "deg" }
//! # Above the ellipsoid.
//! height = { column = "h", unit = "m" }
//! # m/s, km/h, knots; order "ned", "enu" or "neu". May be left out.
//! velocity = { columns = ["vn", "ve", "vd"], unit = "m/s", order = "ned" }
//! # Lines with other values of these columns hold no fix.
//! # valid = [{ column = "fix", least = 3 }, { column = "hdop", most = 20 }]
//! # Standard deviations north, east, down, the same for all fixes ...
//! position_sigma_m = [1.0, 1.0, 1.5]
//! velocity_sigma_mps = [0.05, 0.05, 0.05]
//! # ... or columns of m and m/s.
//! # position_sigma = ["sn", "se", "sd"]
//! # velocity_sigma = ["svn", "sve", "svd"]
//!
//! # Speed of an axle, negative in reverse, on the IMU's clock. May be left out.
//! # [wheels]
//! # file = "wheels.csv"
//! # time = { column = "t", unit = "ms" }
//! # m/s, km/h, knots
//! # speed = { column = "v", unit = "km/h" }
//!
//! # Without [start] the attitude is found in motion.
//! [start]
//! # Self-alignment on a standstill of at least 90 s ...
//! standstill_s = 300
//! # ... or the attitude at the first fix: pitch nose up, heading clockwise from north.
//! # roll_deg = 0.0
//! # pitch_deg = 0.0
//! # heading_deg = 90.0
//! # The site, only without [gnss].
//! # latitude_deg = 34.2
//! # longitude_deg = 108.9
//! # height_m = 380.0
//! ```
//!
//! `docs/your-data.md` explains every field. The session begins at the first fix within the time of
//! the IMU and lasts whole seconds. A fix keeps its own time and accuracy, and may lack values.
//! Rates are integrated by the trapezoidal rule with their time stamps. An increment ends at its
//! time. Short gaps of samples are bridged, long ones interrupt navigation
//! ([`crate::recordings::gaps`]). The sample rate of the session is that of the time stamps
//! ([`crate::recordings::pace`]), to the nearest whole number. Counts have the value
//! [`host_core::inertial::counts::FINE_LSB`].

mod fixes;
mod header;
mod quality;
mod read;
mod samples;
mod start;
mod truth;
mod wheels;
mod write;

pub use header::NamedUnit;
pub use write::{UNIT_BESIDE, write, write_readings, write_truth};

use crate::recordings::corrected::Text;
use crate::recordings::record::{Kind, Record};
use crate::recordings::table::{HEAD_LINES, Layout, Separator, Source, Table};
use crate::recordings::week;
use fixes::fixes;
use header::{ACCEL, GYRO, Offset};
use host_core::error::{Error, excerpt};
use host_unit::Unit;
use read::OpenedHeader;
use start::{initial_attitude, rough_heading, site};
use std::path::Path;
use std::path::PathBuf;

/// Reads the recording that a header file describes. `files` replace those that the header names:
/// first that of the IMU, then that of the fixes. If the header gives an attitude, the first
/// reference state of the record's session has it.
///
/// # Errors
/// Any fault of header or files, with line and column or key; more `files` than the header
/// describes.
pub fn read(header: &Path, files: &[PathBuf]) -> Result<Record, Error> {
    read_with_truth(header, files, None)
}

/// [`read`] with another file of true states, which replaces that of the header. Its columns are
/// those of the header's table `[truth]`, if there is one.
///
/// # Errors
/// As [`read`].
pub fn read_with_truth(
    header: &Path,
    files: &[PathBuf],
    truth: Option<&Path>,
) -> Result<Record, Error> {
    let (read, mut record) = begin(header, files, truth)?;
    let gnss = read.header.gnss.as_ref();
    record.fixes = match gnss {
        Some(gnss) => fixes(&read, gnss, &mut record.notes)?,
        None => vec![site(&read)?],
    };
    if let Some(arm) = gnss.and_then(|gnss| gnss.lever_arm_m) {
        if !arm.iter().all(|x| x.abs() <= 100.0) {
            let problem = format!("is {arm:?}");
            return Err(read.bad("gnss.lever_arm_m", problem, "give metres, -100 to 100"));
        }
        record.lever_arm_m = Some(arm);
    }
    match offset(&read)? {
        Some(Offset::Word(_)) => record.estimates_offset = true,
        Some(Offset::Given(seconds)) => record.given_offset_s = Some(*seconds),
        None => {}
    }
    if let Some(of) = &read.header.wheels {
        record.wheels = wheels::wheels(&read, of)?;
    }
    record.truth = truth::named(&read, record.given_offset_s, &mut record.notes)?;
    if let Some(seconds) = record.given_offset_s {
        record.move_fixes(seconds);
    }
    week::join(&mut record);
    Ok(record)
}

/// The time offset of the fixes in the header: seconds, or "estimate".
fn offset(read: &OpenedHeader) -> Result<Option<&Offset>, Error> {
    let gnss = read.header.gnss.as_ref();
    let given = gnss.and_then(|gnss| gnss.time_offset_s.as_ref());
    let is = match given {
        Some(Offset::Given(seconds)) if !seconds.is_finite() => seconds.to_string(),
        Some(Offset::Word(word)) if word != "estimate" => format!("'{word}'"),
        good => return Ok(good),
    };
    let remedy = "give seconds that are added to the times of the fixes, or \"estimate\"";
    Err(read.bad("gnss.time_offset_s", format!("is {is}"), remedy))
}

/// Reads all but the fixes, for fixes from elsewhere. The times of the truth are those of the
/// header's fixes, unless the truth has an offset of its own.
///
/// # Errors
/// As [`read`].
pub fn samples(header: &Path, files: &[PathBuf], truth: Option<&Path>) -> Result<Record, Error> {
    let (read, mut record) = begin(header, files, truth)?;
    let offset_s = match offset(&read)? {
        Some(Offset::Given(seconds)) => *seconds,
        _ => 0.0,
    };
    let truth = truth::named(&read, Some(offset_s), &mut record.notes)?;
    record.truth = truth.map(|track| track.shifted(offset_s));
    record.lever_arm_m = read.header.gnss.and_then(|gnss| gnss.lever_arm_m);
    Ok(record)
}

/// Position of the samples in their file, to write it again.
///
/// # Errors
/// As [`read`].
pub fn original(header: &Path, files: &[PathBuf]) -> Result<Text, Error> {
    samples::original(&OpenedHeader::open(header, files)?)
}

/// The header with samples and start.
fn begin(
    header: &Path,
    files: &[PathBuf],
    truth: Option<&Path>,
) -> Result<(OpenedHeader, Record), Error> {
    let read = OpenedHeader::open(header, files)?.with_truth(truth);
    let attitude = initial_attitude(&read)?;
    let motion = samples::motion(&read)?;
    let record = Record {
        file: header.to_path_buf(),
        initial_attitude: attitude,
        rough_heading: rough_heading(&read)?,
        ..motion
    };
    Ok((read, record))
}

/// The unit that a header file names, if it names one.
///
/// # Errors
/// Any fault of the header or of the unit file, with line and key.
pub fn unit(header: &Path) -> Result<Option<Unit>, Error> {
    OpenedHeader::open(header, &[])?.unit()
}

/// The units that a header file names for gyros and accelerometers, and all that it could name. The
/// samples are `step` seconds apart.
///
/// # Errors
/// As [`read`].
pub fn units(header: &Path, step: f64) -> Result<[(NamedUnit, Vec<NamedUnit>); 2], Error> {
    let read = OpenedHeader::open(header, &[])?;
    let imu = &read.header.imu;
    let units = |known: &[header::Unit]| {
        let value = |unit: &header::Unit| match unit.1 {
            Kind::Rate => unit.2,
            Kind::Increment => unit.2 / step,
        };
        let all = known.iter().map(|unit| (unit.0.to_owned(), value(unit)));
        all.collect::<Vec<_>>()
    };
    let named = |key: &str, name: &str, known: &[header::Unit]| {
        read.value(key, name, known)?;
        let all = units(known);
        let unit = all.iter().find(|unit| unit.0 == name).cloned();
        Ok((unit.unwrap_or_default(), all))
    };
    Ok([
        named("imu.gyro", &imu.gyro.unit, &GYRO)?,
        named("imu.accel", &imu.accel.unit, &ACCEL)?,
    ])
}

/// What a header file says about its fixes: the unit of each value, and all units that it could
/// name.
#[derive(Debug, Clone, PartialEq)]
pub struct FixUnits {
    /// Times; the value is in s.
    pub time: (NamedUnit, Vec<NamedUnit>),
    /// Latitude and longitude, rad.
    pub position: (NamedUnit, Vec<NamedUnit>),
    /// Height, m.
    pub height: Option<(NamedUnit, Vec<NamedUnit>)>,
    /// Velocity, m/s.
    pub velocity: Option<(NamedUnit, Vec<NamedUnit>)>,
    /// For north, east and down: the column of the velocity that holds it, and its sign.
    pub order: Option<[(usize, f64); 3]>,
}

/// What a header file says about its fixes, if it has any.
///
/// # Errors
/// As [`read`].
pub fn fix_units(header: &Path) -> Result<Option<FixUnits>, Error> {
    let read = OpenedHeader::open(header, &[])?;
    let Some(gnss) = &read.header.gnss else {
        return Ok(None);
    };
    let of = |key: &str, name: &str, known: &[header::Unit]| {
        let (_, value) = read.value(&format!("gnss.{key}"), name, known)?;
        let all = known.iter().map(|unit| (unit.0.to_owned(), unit.2));
        Ok::<_, Error>(((name.to_owned(), value), all.collect::<Vec<_>>()))
    };
    let height = gnss.height.as_ref();
    let velocity = gnss.velocity.as_ref();
    Ok(Some(FixUnits {
        time: of("time", &gnss.time.unit, &header::TIME)?,
        position: of("latitude", &gnss.latitude.unit, &header::ANGLE)?,
        height: height
            .map(|h| of("height", &h.unit, &header::LENGTH))
            .transpose()?,
        velocity: velocity
            .map(|v| of("velocity", &v.unit, &header::SPEED))
            .transpose()?,
        order: velocity
            .map(|v| fixes::velocity_unit(&read, "gnss.velocity", v))
            .transpose()?
            .map(|(order, _)| order),
    }))
}

/// A file with the names of its columns, and the table of the header file that describes it.
struct File<'a> {
    read: &'a OpenedHeader,
    table: &'a str,
    source: Source,
    /// Lines before the data.
    skip: usize,
    names: Vec<String>,
    /// Whether a line of the file names them.
    named: bool,
}

/// Where the columns of a file are, by the header file.
#[derive(Clone, Copy)]
struct Described<'a> {
    /// The table of the header file.
    table: &'a str,
    separator: &'a str,
    /// Whether a line names the columns.
    names: bool,
    /// Lines before it, or before the data; `None`: they are found.
    skip_lines: Option<usize>,
}

impl<'a> File<'a> {
    /// Opens a file. The line of names is the first one that has all names `wanted`.
    fn open(
        read: &'a OpenedHeader,
        described: Described<'a>,
        file: &Path,
        wanted: &[&str],
    ) -> Result<Self, Error> {
        let Described {
            table,
            separator,
            names,
            skip_lines,
        } = described;
        let separator = read.separator(&format!("{table}.separator"), separator)?;
        let source = Source::open(file, separator)?;
        let _ = source.header("names of the columns, as the header file has them")?;
        let head = source.head();
        let runs = separator == Separator::Blank;
        let has_all = |line: &[String]| wanted.iter().all(|name| line.iter().any(|n| n == name));
        // a mark of a comment before the first name is a part of it only where the header says so
        let named = |line: &[String]| match has_all(line) {
            true => line.to_vec(),
            false => bare(line, runs),
        };
        let found = match names {
            true => head.iter().position(|line| has_all(&named(line))),
            false => head.iter().position(|line| !is_comment(line)),
        };
        let before = skip_lines.or(found).unwrap_or(0);
        let Some(line) = head.get(before) else {
            let problem = format!("is {before}, and {} has fewer lines", file.display());
            let remedy = format!(
                "give the number of lines before the names of the columns, at most {}",
                HEAD_LINES - 1
            );
            return Err(read.bad(&format!("{table}.skip_lines"), problem, &remedy));
        };
        let (skip, columns) = match names {
            true => (before + 1, named(line)),
            false => (before, (1..=line.len()).map(|k| k.to_string()).collect()),
        };
        Ok(Self {
            read,
            table,
            source,
            skip,
            names: columns,
            named: names,
        })
    }

    /// The position of a column, given as key of the header file and name.
    fn position(&self, (key, name): &(&str, &str)) -> Result<usize, Error> {
        self.names.iter().position(|n| n == name).ok_or_else(|| {
            let problem = format!(
                "names column '{name}', which {} does not have",
                self.source.file.display()
            );
            let numbers = |name: &String| name.parse::<f64>().is_ok();
            let remedy = match self.other_separator(name) {
                Some(other) => format!(
                    "the columns seem to be separated by '{other}': say so in '{}.separator'",
                    self.table
                ),
                None if self.named && self.names.iter().all(numbers) => format!(
                    "the file begins with numbers and not with names: give '{}.names = false' and \
                     the numbers of the columns, from \"1\" on",
                    self.table
                ),
                None => {
                    let names: Vec<String> = self.names.iter().map(|name| excerpt(name)).collect();
                    format!("use one of {}", names.join(", "))
                }
            };
            self.read
                .bad(&format!("{}.{key}", self.table), problem, &remedy)
        })
    }

    /// The character that separates this name from others within what counts as one name.
    fn other_separator(&self, name: &str) -> Option<&'static str> {
        let known = [
            (";", ";"),
            ("\t", "tab"),
            (" ", "blank"),
            (",", ","),
            ("|", "|"),
        ];
        let parts = |with: &'static str| self.names.iter().flat_map(move |of| of.split(with));
        let fits = |(with, _): &&(&'static str, _)| parts(with).any(|part| part.trim() == name);
        known.iter().find(fits).map(|(_, shown)| *shown)
    }

    /// Reads the columns `wanted`, each given as key of the header file and name of the column.
    /// From column `loose` on, texts that are no numbers count as gaps.
    fn table(&self, wanted: &[(&str, &str)], loose: usize) -> Result<Table, Error> {
        let wanted = self.positions(wanted)?;
        Table::read(&self.source, &self.layout(&wanted, loose))
    }

    /// Reads the same columns row by row; an empty cell or one of `nan` is NaN. The table has no
    /// values; it only locates errors.
    fn rows(
        &self,
        wanted: &[(&str, &str)],
        take: impl FnMut(&[f64]) -> Result<(), Error>,
    ) -> Result<Table, Error> {
        let wanted = self.positions(wanted)?;
        Table::read_first(&self.source, &self.layout(&wanted, usize::MAX), 0, take)
    }

    /// The positions of columns. Only standard deviations may have one column for several axes.
    fn positions(&self, wanted: &[(&str, &str)]) -> Result<Vec<usize>, Error> {
        for (k, (key, name)) in wanted.iter().enumerate() {
            let before = wanted[..k].iter().find(|(_, other)| other == name);
            if let Some((other, _)) = before.filter(|_| !key.ends_with(SIGMA)) {
                let problem = format!("names column '{name}', which '{other}' names already");
                let remedy = "each value has a column of its own; look for a slip of the pen";
                return Err(self
                    .read
                    .bad(&format!("{}.{key}", self.table), problem, remedy));
            }
        }
        wanted.iter().map(|column| self.position(column)).collect()
    }

    fn layout<'l>(&'l self, wanted: &'l [usize], loose: usize) -> Layout<'l> {
        Layout {
            skip: self.skip,
            names: &self.names,
            wanted,
            gap: Some(f64::NAN),
            loose,
            cut: true,
        }
    }
}

/// End of the keys of columns of standard deviations.
const SIGMA: &str = "_sigma";

/// Whether a line begins with the mark of a comment.
fn is_comment(line: &[String]) -> bool {
    let first = line.first().map_or("", String::as_str);
    first.is_empty() && line.len() < 2 || first.starts_with(['#', '%'])
}

/// The names on a line, without the mark of a comment before the first one. `runs`: the separator
/// is any run of blanks.
fn bare(line: &[String], runs: bool) -> Vec<String> {
    let mut names = line.to_vec();
    if let Some(first) = names.first_mut() {
        *first = first.trim_start_matches(['#', '%', ' ']).to_owned();
        if first.is_empty() && runs {
            names.remove(0); // the mark stands alone
        }
    }
    names
}

#[cfg(test)]
mod tests;
