//! Reads the fixes.

use super::File;
use super::header::{ANGLE, Gnss, LENGTH, SPEED, Scalar, TIME, Velocity};
use super::read::Read;
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::table::Table;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::units::DEG;

/// Fixes at rising times.
pub(super) fn fixes(read: &Read, gnss: &Gnss) -> Result<Vec<TimedFix>, Error> {
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
    };
    let imu = &read.header.imu;
    let separate = read.gnss_file(gnss);
    let (name, separator, has_names) = match &separate {
        Some(file) => (file.clone(), &gnss.separator, gnss.names),
        None => (read.imu_file()?, &imu.separator, imu.names),
    };
    let file = File::open(read, "gnss", &name, separator, has_names)?;
    let fixes = names.read(read, &file, [p[0], p[1], p[2], v[0], v[1], v[2]])?;
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
}

/// Conversion of the columns to SI.
struct Si {
    /// Seconds in one unit of time.
    second: f64,
    /// Degrees in one unit of latitude and of longitude.
    degrees: [f64; 2],
    /// Axes and unit of the velocity.
    velocity: Option<(Axes, f64)>,
    /// Standard deviations that no column gives.
    sigmas: [f64; 6],
    /// First columns of height, velocity, position sigmas, velocity sigmas.
    positions: [Option<usize>; 4],
    /// Number of columns of the velocity.
    axes: usize,
}

impl Names<'_> {
    /// The fixes of a file. `sigmas`: those that no column gives.
    pub(super) fn read(
        &self,
        read: &Read,
        file: &File<'_>,
        sigmas: [f64; 6],
    ) -> Result<Vec<TimedFix>, Error> {
        let key = |name: &str| format!("{}.{name}", self.table);
        let (_, second) = read.value(&key("time"), &self.time.unit, &TIME)?;
        let (_, lat) = read.value(&key("latitude"), &self.latitude.unit, &ANGLE)?;
        let (_, lon) = read.value(&key("longitude"), &self.longitude.unit, &ANGLE)?;
        if let Some(height) = self.height {
            read.value(&key("height"), &height.unit, &LENGTH)?;
        }
        let velocity = self
            .velocity
            .map(|v| velocity_unit(read, &key("velocity"), v));
        let (wanted, positions) = self.columns();
        // a line may lack values that the receiver did not measure
        let table = file.table(&wanted, Some(f64::NAN))?;
        let si = Si {
            second,
            degrees: [lat / DEG, lon / DEG],
            velocity: velocity.transpose()?,
            sigmas,
            positions,
            axes: self.velocity.map_or(3, |v| v.columns.len()),
        };
        collect(&table, &si)
    }

    /// Key and name of the columns wanted, and the first columns of height, velocity, position
    /// sigmas and velocity sigmas where the file has them.
    fn columns(&self) -> (Vec<(&str, &str)>, [Option<usize>; 4]) {
        let mut wanted = vec![
            ("time", self.time.column.as_str()),
            ("latitude", self.latitude.column.as_str()),
            ("longitude", self.longitude.column.as_str()),
        ];
        let height = self.height.map(|h| std::slice::from_ref(&h.column));
        let [position, velocity] = self.sigmas;
        let groups: [(&str, Option<&[String]>); 4] = [
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

/// The fixes of a table. Lines without a fix are skipped.
fn collect(table: &Table, si: &Si) -> Result<Vec<TimedFix>, Error> {
    let mut fixes: Vec<TimedFix> = Vec::new();
    for (k, r) in table.rows().enumerate() {
        let values = 1..si.positions[2].or(si.positions[3]).unwrap_or(r.len());
        if r[values].iter().all(|x| x.is_nan()) {
            continue;
        }
        if r[0].is_nan() {
            return Err(table.complain(k, 0, "missing", "give the time of every fix"));
        }
        if let Some(alone) = (1..3).find(|&c| r[c].is_nan() != r[3 - c].is_nan()) {
            let missing = if r[alone].is_nan() { alone } else { 3 - alone };
            let remedy = "give latitude and longitude of a fix, or neither";
            return Err(table.complain(k, missing, "missing", remedy));
        }
        for at in si.positions[2..].iter().flatten() {
            if let Some(bad) = (*at..at + 3).find(|&c| r[c] <= 0.0) {
                let remedy = "give a number above 0, or nothing for a value that is not measured";
                return Err(table.complain(k, bad, "not a standard deviation", remedy));
            }
        }
        let now = fix(r, si).ok_or_else(|| {
            let fault = "not on Earth with its longitude and height";
            table.complain(k, 1, fault, "check order and units")
        })?;
        let since = fixes.last().map_or(1.0, |before| now.time - before.time);
        if since <= 0.0 {
            return Err(table.complain(k, 0, "not after the fix before", "sort the fixes by time"));
        }
        fixes.push(now);
    }
    Ok(fixes)
}

/// One fix; `None` if it is not on Earth, or at a pole.
fn fix(r: &[f64], si: &Si) -> Option<TimedFix> {
    let [height, velocity, sigma, sigma_v] = si.positions;
    let mut sigmas = si.sigmas;
    for (first, columns) in [(0, sigma), (3, sigma_v)] {
        if let Some(at) = columns {
            sigmas[first..first + 3].copy_from_slice(&r[at..at + 3]);
        }
    }
    let height = height.map_or(f64::NAN, |at| r[at]);
    let speeds =
        velocity.map(|at| std::array::from_fn(|i| if i < si.axes { r[at + i] } else { f64::NAN }));
    let turned = |(order, unit): (Axes, f64)| Some((order.turn(speeds?) * unit).into());
    let velocity: [f64; 3] = si.velocity.and_then(turned).unwrap_or([f64::NAN; 3]);
    let values = [&[r[1], r[2], height], &velocity[..]].concat();
    for (sigma, value) in sigmas.iter_mut().zip(&values) {
        if value.is_nan() || sigma.is_nan() {
            *sigma = NOT_MEASURED;
        }
    }
    let known = |x: f64| if x.is_nan() { 0.0 } else { x };
    let fix = TimedFix {
        time: r[0] * si.second,
        lat_deg: known(r[1]) * si.degrees[0],
        lon_deg: known(r[2]) * si.degrees[1],
        height_m: known(height),
        velocity: velocity.map(known),
        sigmas,
    };
    let here =
        fix.lat_deg.abs() < 89.9 && fix.lon_deg.abs() <= 360.0 && fix.height_m.abs() < 20_000.0;
    here.then_some(fix)
}

/// Axes and unit of a velocity.
fn velocity_unit(read: &Read, key: &str, velocity: &Velocity) -> Result<(Axes, f64), Error> {
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
        "ned" => Axes::FORWARD_RIGHT_DOWN,
        "enu" => Axes::RIGHT_FORWARD_UP,
        other => {
            return Err(read.bad(key, format!("has the order '{other}'"), "use ned or enu"));
        }
    };
    Ok((order, unit))
}
