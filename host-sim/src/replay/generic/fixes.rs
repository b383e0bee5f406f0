//! The table of fixes.

use super::super::axes::Axes;
use super::super::build::{MOST_GAP_S, NOT_MEASURED};
use super::super::track::Track;
use super::header::{ANGLE, Gnss, LENGTH, Read, SPEED, TIME};
use super::{File, still};
use crate::earth::Geodetic;
use crate::error::Error;

/// Fixes and their noise.
pub(super) fn fixes(read: &Read, gnss: &Gnss) -> Result<(Track, [f64; 6]), Error> {
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
    let (name, separator, names) = match &gnss.file {
        Some(file) => (file, &gnss.separator, gnss.names),
        None => (&imu.file, &imu.separator, imu.names),
    };
    let file = File::open(read, "gnss", name, separator, names)?;
    let scalars = [
        ("time", &gnss.time),
        ("latitude", &gnss.latitude),
        ("longitude", &gnss.longitude),
        ("height", &gnss.height),
    ];
    let mut wanted: Vec<(&str, &str)> = scalars
        .iter()
        .map(|(k, s)| (*k, s.column.as_str()))
        .collect();
    if let Some(v) = &gnss.velocity {
        wanted.extend(v.columns.iter().map(|c| ("velocity", c.as_str())));
    }
    let table = file.table(&wanted, gnss.file.is_none())?;
    let (mut time, mut states, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    for (k, r) in table.rows().enumerate() {
        if r[1..].iter().all(|x| x.is_nan()) {
            continue; // a line without fix
        }
        if let Some(missing) = r.iter().position(|x| x.is_nan()) {
            return Err(table.complain(k, missing, "missing", "give all columns of a fix or none"));
        }
        let mut state = still(Geodetic {
            lat: r[1] * lat,
            lon: r[2] * lon,
            h: r[3],
        });
        if !(state.position.lat.abs() < 1.57
            && state.position.lon.abs() < 7.0
            && r[3].abs() < 20_000.0)
        {
            return Err(table.complain(
                k,
                1,
                "with its longitude and height no place on Earth",
                "check order and units",
            ));
        }
        if let Some((order, unit)) = velocity {
            state.velocity = order.turn([r[4], r[5], r[6]]) * unit;
        }
        time.push(r[0] * second);
        states.push(state);
        rows.push(k);
    }
    let sigmas = |v: [f64; 3]| [p[0], p[1], p[2], v[0], v[1], v[2]];
    if let Some(k) = (1..time.len()).find(|&k| time[k] <= time[k - 1]) {
        return Err(table.complain(
            rows[k],
            0,
            "not after the fix before",
            "sort the fixes by time",
        ));
    }
    if let Some(k) = (1..time.len()).find(|&k| time[k] - time[k - 1] > MOST_GAP_S) {
        return Err(table.complain(
            rows[k],
            0,
            "after a gap of more than 2.5 s",
            "cut the recording there",
        ));
    }
    if states.len() < 2 {
        return Err(read.bad(
            "gnss",
            "has fewer than two fixes".into(),
            "leave [gnss] out for a vehicle at rest",
        ));
    }
    let mut track = Track::new(time, states);
    Ok(match velocity {
        Some(_) => (track, sigmas(v)),
        None => {
            track.differentiate();
            (track, sigmas([NOT_MEASURED; 3]))
        }
    })
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
