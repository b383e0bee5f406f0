//! Reads the fixes.

use super::header::{ANGLE, Gnss, LENGTH, SPEED, Scalar, TIME, Valid, Velocity};
use super::quality::Quality;
use super::read::OpenedHeader;
use super::{Described, File};
use crate::recordings::nowhere::{LeftOut, is_nowhere};
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::table::Table;
use crate::recordings::week::Unwrapped;
use host_core::error::Error;
use host_core::inertial::units::DEG;
use host_core::list::median;

/// Heights from here on are none of a vehicle, m.
const HIGHEST_M: f64 = 20_000.0;

/// Fixes at rising times. What is left out is added to `notes`.
pub(super) fn fixes(
    read: &OpenedHeader,
    gnss: &Gnss,
    notes: &mut Vec<String>,
) -> Result<Vec<TimedFix>, Error> {
    let (p, v) = (gnss.position_sigma_m, gnss.velocity_sigma_mps);
    if let Some(bad) = p.iter().chain(&v).find(|s| !(**s > 0.0 && s.is_finite())) {
        return Err(read.bad(
            "gnss",
            format!("has the standard deviation {bad}"),
            "give finite numbers above 0",
        ));
    }
    let names = Names {
        table: "gnss",
        time: &gnss.time,
        latitude: &gnss.latitude,
        longitude: &gnss.longitude,
        height: gnss.height.as_ref(),
        velocity: gnss.velocity.as_ref(),
        sigmas: [gnss.position_sigma.as_ref(), gnss.velocity_sigma.as_ref()],
        valid: &gnss.valid,
    };
    let imu = &read.header.imu;
    let separate = read.gnss_file(gnss);
    let (name, described) = match &separate {
        Some(file) => (
            file.clone(),
            Described {
                table: "gnss",
                separator: &gnss.separator,
                names: gnss.names,
                skip_lines: gnss.skip_lines,
            },
        ),
        None => (
            read.imu_file()?,
            Described {
                table: "gnss",
                separator: &imu.separator,
                names: imu.names,
                skip_lines: imu.skip_lines.or(gnss.skip_lines),
            },
        ),
    };
    let file = File::open(read, described, &name, &names.names())?;
    let fixes = names.read(read, &file, [p[0], p[1], p[2], v[0], v[1], v[2]], notes)?;
    if fixes.len() < 2 {
        let remedy = "leave [gnss] out for a vehicle at rest";
        return Err(read.bad("gnss", "has fewer than two fixes".into(), remedy));
    }
    Ok(fixes)
}

/// The columns of positions and velocities.
#[derive(Debug, Clone, Copy)]
pub(super) struct Names<'a> {
    /// Table of the header that names them.
    pub(super) table: &'a str,
    pub(super) time: &'a Scalar,
    pub(super) latitude: &'a Scalar,
    pub(super) longitude: &'a Scalar,
    pub(super) height: Option<&'a Scalar>,
    pub(super) velocity: Option<&'a Velocity>,
    /// Columns of standard deviations of position and velocity.
    pub(super) sigmas: [Option<&'a [String; 3]>; 2],
    /// Columns that say whether a line holds a fix.
    pub(super) valid: &'a [Valid],
}

/// Conversion of the columns to SI.
struct Si {
    /// Seconds in one unit of time.
    second: f64,
    /// Degrees in one unit of latitude and of longitude.
    degrees: [f64; 2],
    /// Metres in one unit of height.
    metre: f64,
    /// Order and unit of the velocity.
    velocity: Option<(Order, f64)>,
    /// Standard deviations that no column gives.
    sigmas: [f64; 6],
    /// First columns of height, velocity, position sigmas, velocity sigmas.
    positions: [Option<usize>; 4],
    /// Number of columns of the velocity.
    axes: usize,
    /// Number of columns of a fix; those that say whether there is one follow.
    of_fix: usize,
}

/// Columns of north, east and down in a velocity, each with its sign.
pub(super) type Order = [(usize, f64); 3];

impl<'n> Names<'n> {
    /// The names of all columns.
    pub(super) fn names(&self) -> Vec<&'n str> {
        self.columns().0.iter().map(|(_, name)| *name).collect()
    }

    /// The fixes of a file. `sigmas`: those that no column gives. What is left out is added to
    /// `notes`.
    pub(super) fn read(
        &self,
        read: &OpenedHeader,
        file: &File<'_>,
        sigmas: [f64; 6],
        notes: &mut Vec<String>,
    ) -> Result<Vec<TimedFix>, Error> {
        let key = |name: &str| format!("{}.{name}", self.table);
        let (_, second) = read.value(&key("time"), &self.time.unit, &TIME)?;
        let (_, lat) = read.value(&key("latitude"), &self.latitude.unit, &ANGLE)?;
        let (_, lon) = read.value(&key("longitude"), &self.longitude.unit, &ANGLE)?;
        let height = self
            .height
            .map(|h| read.value(&key("height"), &h.unit, &LENGTH));
        let velocity = self
            .velocity
            .map(|v| velocity_unit(read, &key("velocity"), v));
        let (mut wanted, positions) = self.columns();
        let mut quality: Vec<Quality> = self.valid.iter().map(Quality::given).collect();
        if quality.is_empty() {
            let is_free = |q: &Quality| wanted.iter().all(|(_, name)| **name != *q.column);
            quality.extend(Quality::known(&file.names).filter(is_free));
        }
        let of_fix = wanted.len();
        wanted.extend(quality.iter().map(|q| ("valid", q.column.as_str())));
        // a line may lack values that the receiver did not measure
        let mut table = file.table(&wanted, of_fix)?;
        notes.append(&mut table.notes);
        let si = Si {
            second,
            degrees: [lat / DEG, lon / DEG],
            metre: height.transpose()?.map_or(1.0, |(_, metre)| metre),
            velocity: velocity.transpose()?,
            sigmas,
            positions,
            axes: self.velocity.map_or(3, |v| v.columns.len()),
            of_fix,
        };
        let mut left_out = LeftOut::default();
        let (mut found, mut week) = collect(&table, &si, &quality, &mut left_out)?;
        let guessed = quality.iter().all(|q| !q.is_given());
        if found.len() < 2 && left_out.all() > 0 && guessed && !quality.is_empty() {
            // the columns mean something else than their names say
            left_out = LeftOut::default();
            (found, week) = collect(&table, &si, &[], &mut left_out)?;
        }
        found = once_each(found, &mut left_out);
        if found.is_empty() && left_out.all() > 0 {
            let problem = format!("holds no fix: {}", left_out.reasons());
            let remedy = "give a recording in which the receiver has a fix";
            return Err(read.bad(self.table, problem, remedy));
        }
        notes.extend(week.note("fixes"));
        notes.extend(left_out.notes(&file.source.file.display().to_string()));
        Ok(found)
    }

    /// Key and name of the columns wanted, and the first columns of height, velocity, position
    /// sigmas and velocity sigmas where the file has them.
    fn columns(&self) -> (Vec<(&'n str, &'n str)>, [Option<usize>; 4]) {
        let mut wanted = vec![
            ("time", self.time.column.as_str()),
            ("latitude", self.latitude.column.as_str()),
            ("longitude", self.longitude.column.as_str()),
        ];
        let height = self.height.map(|h| std::slice::from_ref(&h.column));
        let [position, velocity] = self.sigmas;
        let groups: [(&str, Option<&'n [String]>); 4] = [
            ("height", height),
            ("velocity", self.velocity.map(|v| &v.columns[..])),
            ("position_sigma", position.map(|c| &c[..])),
            ("velocity_sigma", velocity.map(|c| &c[..])),
        ];
        let positions = groups.map(|(key, names)| {
            let at = wanted.len();
            wanted.extend(names?.iter().map(|c| (key, c.as_str())));
            Some(at)
        });
        (wanted, positions)
    }
}

/// The fixes of a table, and their times as they went on. Lines without a fix are skipped, and
/// counted where they say so.
fn collect(
    table: &Table,
    si: &Si,
    quality: &[Quality],
    left_out: &mut LeftOut,
) -> Result<(Vec<TimedFix>, Unwrapped), Error> {
    let mut fixes: Vec<TimedFix> = Vec::new();
    let mut week = Unwrapped::default();
    for (k, r) in table.rows().enumerate() {
        let values = 1..si.positions[2].or(si.positions[3]).unwrap_or(si.of_fix);
        if r[values].iter().all(|x| x.is_nan()) {
            continue;
        }
        if r[0].is_nan() {
            return Err(table.complain(k, 0, "missing", "give the time of every fix"));
        }
        let time = week.on(r[0] * si.second);
        let denied = quality.iter().zip(&r[si.of_fix..]);
        if let Some(reason) = denied.filter_map(|(q, value)| q.denies(*value)).next() {
            left_out.count(&reason, time);
            continue;
        }
        if let Some(alone) = (1..3).find(|&c| r[c].is_nan() != r[3 - c].is_nan()) {
            let missing = if r[alone].is_nan() { alone } else { 3 - alone };
            let remedy = "give latitude and longitude of a fix, or neither";
            return Err(table.complain(k, missing, "missing", remedy));
        }
        if !r[1].is_nan() && is_nowhere(r[1], r[2]) {
            left_out.count(
                "latitude and longitude are 0, as before the first fix",
                time,
            );
            continue;
        }
        for at in si.positions[2..].iter().flatten() {
            if let Some(bad) = (*at..at + 3).find(|&c| r[c] <= 0.0) {
                let remedy = "give a number above 0, or nothing for a value that is not measured";
                return Err(table.complain(k, bad, "not a standard deviation", remedy));
            }
        }
        let now = fix(r, time, si).ok_or_else(|| {
            let height = si.positions[0].filter(|at| (r[*at] * si.metre).abs() >= HIGHEST_M);
            match height {
                Some(at) => {
                    table.complain(k, at, "not a height of a vehicle, m", in_millimetres(r[at]))
                }
                None => {
                    let fault = "not on Earth with its longitude and height";
                    table.complain(k, 1, fault, unlikely(r, si))
                }
            }
        })?;
        let since = fixes.last().map_or(1.0, |before| now.time - before.time);
        if since == 0.0 {
            left_out.count("the time is that of the line before", time);
            continue;
        }
        if since < 0.0 {
            return Err(table.complain(k, 0, "not after the fix before", "sort the fixes by time"));
        }
        fixes.push(now);
    }
    Ok((fixes, week))
}

/// Without the lines that repeat a fix, where the file holds each one until the next, as loggers do
/// that write all values whenever one is new. A receiver that stands may repeat its position, so
/// that fixes count that follow after the usual time.
fn once_each(fixes: Vec<TimedFix>, left_out: &mut LeftOut) -> Vec<TimedFix> {
    const LEAST_RUNS: usize = 10;
    let values = |fix: &TimedFix| {
        let [north, east, down] = fix.velocity;
        [fix.lat_deg, fix.lon_deg, fix.height_m, north, east, down].map(f64::to_bits)
    };
    let runs: Vec<&[TimedFix]> = fixes.chunk_by(|a, b| values(a) == values(b)).collect();
    if runs.len() < LEAST_RUNS || median(|| runs.iter().map(|run| run.len() as f64)) < 2.0 {
        return fixes;
    }
    let steps = || runs.windows(2).map(|two| two[1][0].time - two[0][0].time);
    let usual = median(steps);
    let mut kept: Vec<TimedFix> = Vec::new();
    for fix in &fixes {
        let repeats =
            |last: &TimedFix| values(last) == values(fix) && fix.time - last.time < 0.99 * usual;
        match kept.last().is_some_and(repeats) {
            true => left_out.count("its values are those of the line before", fix.time),
            false => kept.push(*fix),
        }
    }
    kept
}

/// The likeliest cause of such a height.
fn in_millimetres(height: f64) -> &'static str {
    match height.abs() < 1e7 {
        true => "the height may be in mm or cm: divide it by 1000 or 100; or check its column",
        false => "check the column of the height; without a height leave its cells empty",
    }
}

/// The likeliest cause of a position that is not on Earth.
fn unlikely(r: &[f64], si: &Si) -> &'static str {
    let [lat, lon] = [r[1].abs(), r[2].abs()];
    let in_degrees = |unit: f64| (unit.abs() - 1.0).abs() < 1e-9;
    match () {
        () if si.degrees.iter().all(|unit| !in_degrees(*unit)) && lat < 90.0 && lon <= 360.0 => {
            "the positions are in deg: say so in 'unit' of latitude and longitude"
        }
        () if lon < 89.9 && lat <= 360.0 => {
            "latitude and longitude may have changed places; check their columns"
        }
        () if (1e5..=9e8).contains(&lat) && lon <= 36e8 => {
            "the positions may be in 1e-7 deg, as a receiver sends them; divide them by 10 000 000"
        }
        () if (100.0..9000.0).contains(&lat) && lon < 18_000.0 => {
            "the positions may be in ddmm.mmmm, as NMEA has them: give the log itself by --fixes, or \
             deg"
        }
        () => "check order and units",
    }
}

/// One fix; `None` if it is not on Earth, or at a pole.
fn fix(r: &[f64], time: f64, si: &Si) -> Option<TimedFix> {
    let [height, velocity, sigma, sigma_v] = si.positions;
    let mut sigmas = si.sigmas;
    for (first, columns) in [(0, sigma), (3, sigma_v)] {
        if let Some(at) = columns {
            sigmas[first..first + 3].copy_from_slice(&r[at..at + 3]);
        }
    }
    let height = height.map_or(f64::NAN, |at| r[at] * si.metre);
    let speed = |at: usize, i: usize| if i < si.axes { r[at + i] } else { f64::NAN };
    let turned = |(order, unit): (Order, f64)| {
        let at = velocity?;
        Some(order.map(|(column, sign)| speed(at, column) * sign * unit))
    };
    let velocity: [f64; 3] = si.velocity.and_then(turned).unwrap_or([f64::NAN; 3]);
    let values = [&[r[1], r[2], height], &velocity[..]].concat();
    for (sigma, value) in sigmas.iter_mut().zip(&values) {
        if value.is_nan() || sigma.is_nan() {
            *sigma = NOT_MEASURED;
        }
    }
    let known = |x: f64| if x.is_nan() { 0.0 } else { x };
    let fix = TimedFix {
        time,
        lat_deg: known(r[1]) * si.degrees[0],
        lon_deg: known(r[2]) * si.degrees[1],
        height_m: known(height),
        velocity: velocity.map(known),
        sigmas,
    };
    let here =
        fix.lat_deg.abs() < 89.9 && fix.lon_deg.abs() <= 360.0 && fix.height_m.abs() < HIGHEST_M;
    here.then_some(fix)
}

/// Order and unit of a velocity.
pub(super) fn velocity_unit(
    read: &OpenedHeader,
    key: &str,
    velocity: &Velocity,
) -> Result<(Order, f64), Error> {
    let (_, unit) = read.value(key, &velocity.unit, &SPEED)?;
    if !(2..=3).contains(&velocity.columns.len()) {
        let problem = format!("names {} columns", velocity.columns.len());
        return Err(read.bad(
            key,
            problem,
            "name three columns, or the two horizontal ones",
        ));
    }
    let order = match velocity.order.as_str() {
        "ned" => [(0, 1.0), (1, 1.0), (2, 1.0)],
        "enu" => [(1, 1.0), (0, 1.0), (2, -1.0)],
        "neu" => [(0, 1.0), (1, 1.0), (2, -1.0)],
        other => {
            let problem = format!("has the order '{other}'");
            return Err(read.bad(key, problem, "use ned, enu or neu"));
        }
    };
    Ok((order, unit))
}
