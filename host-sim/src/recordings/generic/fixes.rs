//! Reads the fixes.

use super::File;
use super::header::{ANGLE, Gnss, LENGTH, Read, SPEED, TIME};
use crate::error::Error;
use crate::inertial::axes::Axes;
use crate::inertial::units::DEG;
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::table::Table;

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
    let (_, second) = read.unit("gnss.time", &gnss.time.unit, &TIME)?;
    let (_, lat) = read.unit("gnss.latitude", &gnss.latitude.unit, &ANGLE)?;
    let (_, lon) = read.unit("gnss.longitude", &gnss.longitude.unit, &ANGLE)?;
    read.unit("gnss.height", &gnss.height.unit, &LENGTH)?;
    let velocity = velocity_unit(read, gnss)?;
    let imu = &read.header.imu;
    let separate = read.gnss_file(gnss);
    // lines of the IMU without a fix leave its columns empty
    let gap = separate.is_none().then_some(f64::NAN);
    let (name, separator, names) = match separate {
        Some(file) => (file, &gnss.separator, gnss.names),
        None => (read.imu_file()?, &imu.separator, imu.names),
    };
    let file = File::open(read, "gnss", &name, separator, names)?;
    let (wanted, places) = columns(gnss);
    let table = file.table(&wanted, gap)?;
    let si = Si {
        second,
        degrees: [lat / DEG, lon / DEG],
        velocity,
        sigmas: [p[0], p[1], p[2], v[0], v[1], v[2]],
        places,
    };
    collect(read, &table, &si)
}

/// Key and name of the columns wanted, and the first columns of velocity, position sigmas and
/// velocity sigmas where the file has them.
fn columns(gnss: &Gnss) -> (Vec<(&str, &str)>, [Option<usize>; 3]) {
    let mut wanted = vec![
        ("time", gnss.time.column.as_str()),
        ("latitude", gnss.latitude.column.as_str()),
        ("longitude", gnss.longitude.column.as_str()),
        ("height", gnss.height.column.as_str()),
    ];
    let triads = [
        ("velocity", gnss.velocity.as_ref().map(|v| &v.columns)),
        ("position_sigma", gnss.position_sigma.as_ref()),
        ("velocity_sigma", gnss.velocity_sigma.as_ref()),
    ];
    let places = triads.map(|(key, names)| {
        let at = wanted.len();
        wanted.extend(names?.iter().map(|c| (key, c.as_str())));
        Some(at)
    });
    (wanted, places)
}

/// How columns become SI.
struct Si {
    /// Seconds in a unit of time.
    second: f64,
    /// Degrees in a unit of latitude and longitude.
    degrees: [f64; 2],
    /// Axes and unit of the velocity.
    velocity: Option<(Axes, f64)>,
    /// Standard deviations that no column gives.
    sigmas: [f64; 6],
    /// First columns of velocity, position sigmas, velocity sigmas.
    places: [Option<usize>; 3],
}

/// The fixes of a table. Lines without a fix are skipped.
fn collect(read: &Read, table: &Table, si: &Si) -> Result<Vec<TimedFix>, Error> {
    let mut fixes: Vec<TimedFix> = Vec::new();
    for (k, r) in table.rows().enumerate() {
        if r[1..].iter().all(|x| x.is_nan()) {
            continue;
        }
        if let Some(missing) = r.iter().position(|x| x.is_nan()) {
            return Err(table.complain(k, missing, "missing", "give all columns of a fix or none"));
        }
        for at in si.places[1..].iter().flatten() {
            if let Some(bad) = (*at..at + 3).find(|&c| r[c] <= 0.0) {
                let remedy = "give a number above 0";
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
    if fixes.len() < 2 {
        let remedy = "leave [gnss] out for a vehicle at rest";
        return Err(read.bad("gnss", "has fewer than two fixes".into(), remedy));
    }
    Ok(fixes)
}

/// One fix; `None` if it is not on Earth, or at a pole.
fn fix(r: &[f64], si: &Si) -> Option<TimedFix> {
    let [velocity, sigma, sigma_v] = si
        .places
        .map(|at| at.map(|at| [r[at], r[at + 1], r[at + 2]]));
    let mut sigmas = si.sigmas;
    for (place, columns) in [(0, sigma), (3, sigma_v)] {
        if let Some(columns) = columns {
            sigmas[place..place + 3].copy_from_slice(&columns);
        }
    }
    let turned = |(order, unit): (Axes, f64)| Some((order.turn(velocity?) * unit).into());
    let velocity = si.velocity.and_then(turned);
    if velocity.is_none() {
        sigmas[3..].fill(NOT_MEASURED);
    }
    let fix = TimedFix {
        time: r[0] * si.second,
        lat_deg: r[1] * si.degrees[0],
        lon_deg: r[2] * si.degrees[1],
        height_m: r[3],
        velocity: velocity.unwrap_or_default(),
        sigmas,
    };
    let here =
        fix.lat_deg.abs() < 89.9 && fix.lon_deg.abs() <= 360.0 && fix.height_m.abs() < 20_000.0;
    here.then_some(fix)
}

/// Axes and unit of the velocity, if there is one.
fn velocity_unit(read: &Read, gnss: &Gnss) -> Result<Option<(Axes, f64)>, Error> {
    let Some(velocity) = &gnss.velocity else {
        return Ok(None);
    };
    let (_, unit) = read.unit("gnss.velocity", &velocity.unit, &SPEED)?;
    let order = match velocity.order.as_str() {
        "ned" => Axes::FORWARD_RIGHT_DOWN,
        "enu" => Axes::RIGHT_FORWARD_UP,
        other => {
            return Err(read.bad(
                "gnss.velocity",
                format!("has the order '{other}'"),
                "use ned or enu",
            ));
        }
    };
    Ok(Some((order, unit)))
}
