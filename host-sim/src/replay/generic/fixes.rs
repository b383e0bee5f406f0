//! The table of fixes.

use super::super::axes::Axes;
use super::super::build::{MOST_GAP_S, NOT_MEASURED};
use super::super::input::Table;
use super::super::track::Track;
use super::header::{ANGLE, Gnss, LENGTH, Read, SPEED, TIME};
use super::{File, still};
use crate::earth::Geodetic;
use crate::error::Error;
use crate::sins::NavState;

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
    let si = Si {
        second,
        lat,
        lon,
        velocity,
    };
    let mut track = track(read, &table, &si)?;
    if velocity.is_none() {
        track.differentiate();
    }
    let v = velocity.map_or([NOT_MEASURED; 3], |_| v);
    Ok((track, [p[0], p[1], p[2], v[0], v[1], v[2]]))
}

/// Units of the columns; velocity, if there is one, with its axes.
struct Si {
    second: f64,
    lat: f64,
    lon: f64,
    velocity: Option<(Axes, f64)>,
}

/// The fixes of a table: time, latitude, longitude, height, perhaps velocity; lines without any of them are left out.
fn track(read: &Read, table: &Table, si: &Si) -> Result<Track, Error> {
    let (mut time, mut states): (Vec<f64>, Vec<NavState>) = (Vec::new(), Vec::new());
    for (k, r) in table.rows().enumerate() {
        if r[1..].iter().all(|x| x.is_nan()) {
            continue;
        }
        if let Some(missing) = r.iter().position(|x| x.is_nan()) {
            return Err(table.complain(k, missing, "missing", "give all columns of a fix or none"));
        }
        let state = fix(r, si).ok_or_else(|| {
            let fault = "with its longitude and height no place on Earth";
            table.complain(k, 1, fault, "check order and units")
        })?;
        let now = r[0] * si.second;
        let since = time.last().map_or(1.0, |before| now - before);
        if since <= 0.0 {
            return Err(table.complain(k, 0, "not after the fix before", "sort the fixes by time"));
        }
        if since > MOST_GAP_S {
            return Err(table.complain(
                k,
                0,
                "after a gap of more than 2.5 s",
                "cut the recording there",
            ));
        }
        time.push(now);
        states.push(state);
    }
    if states.len() < 2 {
        let remedy = "leave [gnss] out for a vehicle at rest";
        return Err(read.bad("gnss", "has fewer than two fixes".into(), remedy));
    }
    Ok(Track::new(time, states))
}

/// One fix; `None` off the Earth or at a pole.
fn fix(r: &[f64], si: &Si) -> Option<NavState> {
    let position = Geodetic {
        lat: r[1] * si.lat,
        lon: r[2] * si.lon,
        h: r[3],
    };
    let mut state = still(position);
    if let Some((order, unit)) = si.velocity {
        state.velocity = order.turn([r[4], r[5], r[6]]) * unit;
    }
    let here = position.lat.abs() < 1.57 && position.lon.abs() < 7.0 && position.h.abs() < 20_000.0;
    here.then_some(state)
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
