//! Reads true states.

use super::fixes::Names;
use super::header::{Gnss, Scalar, Truth, TruthTable, Velocity};
use super::read::OpenedHeader;
use super::{Described, File};
use crate::recordings::columns::{POSITION, VELOCITY};
use crate::recordings::record::{TimedFix, track};
use crate::recordings::track::Track;
use host_core::error::Error;
use std::path::PathBuf;

/// The true states that the user or the header names, if one of them does. `offset_s` is the time
/// offset of the fixes, s. What is left out is added to `notes`. The caller still adds it to the
/// times of the states.
pub(super) fn named(
    read: &OpenedHeader,
    offset_s: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Option<Track>, Error> {
    let table = match (&read.header.truth, &read.truth_file) {
        (Some(Truth::Table(table)), file) => TruthTable {
            file: match file {
                Some(file) => file.clone(),
                None => read.beside(&table.file),
            },
            ..(**table).clone()
        },
        (_, Some(file)) => plain(file.clone()),
        (Some(Truth::File(file)), None) => plain(read.beside(file)),
        (None, None) => return Ok(None),
    };
    let track = states(read, &table, notes)?;
    match table.time_offset_s {
        // the offset of the fixes will be added to it
        Some(own) if own.is_finite() => Ok(Some(track.shifted(own - offset_s.unwrap_or(0.0)))),
        Some(other) => {
            let problem = format!("is {other}");
            Err(read.bad("truth.time_offset_s", problem, "give seconds"))
        }
        None => Ok(Some(track)),
    }
}

/// A file without names of columns.
fn plain(file: PathBuf) -> TruthTable {
    TruthTable {
        file,
        separator: ",".into(),
        names: true,
        skip_lines: None,
        time: None,
        latitude: None,
        longitude: None,
        height: None,
        velocity: None,
        time_offset_s: None,
    }
}

fn states(
    read: &OpenedHeader,
    table: &TruthTable,
    notes: &mut Vec<String>,
) -> Result<Track, Error> {
    let described = Described {
        table: "truth",
        separator: &table.separator,
        names: table.names,
        skip_lines: table.skip_lines,
    };
    let file = File::open(read, described, &table.file, &[])?;
    let usual = usual(&file, read.header.gnss.as_ref());
    let pick = |own: &Option<Scalar>, usual: Option<&Scalar>, key: &str| {
        own.clone().or(usual.cloned()).ok_or_else(|| {
            let problem = "is not given, and the file has not the columns of the fixes".to_owned();
            let remedy = "name the columns in a table [truth]: time, latitude, longitude, height";
            read.bad(&format!("truth.{key}"), problem, remedy)
        })
    };
    let of = usual.as_ref();
    // without velocities in the table, they are computed from the positions
    let has = |v: &&Velocity| v.columns.iter().all(|name| file.names.contains(name));
    let usual_velocity = of.and_then(|g| g.velocity.as_ref()).filter(has);
    let names = Names {
        table: "truth",
        time: &pick(&table.time, of.map(|g| &g.time), "time")?,
        latitude: &pick(&table.latitude, of.map(|g| &g.latitude), "latitude")?,
        longitude: &pick(&table.longitude, of.map(|g| &g.longitude), "longitude")?,
        height: Some(&pick(
            &table.height,
            of.and_then(|g| g.height.as_ref()),
            "height",
        )?),
        velocity: table.velocity.as_ref().or(usual_velocity),
        sigmas: [None; 2],
        valid: &[],
    };
    let states = names.read(read, &file, [1.0; 6], notes)?;
    if !states.iter().any(TimedFix::has_position) {
        let remedy = "give at least one state with latitude and longitude";
        return Err(read.bad("truth", "has no position".into(), remedy));
    }
    Ok(track(&states))
}

/// The default columns of a file of true states: those of `simulate` if they are there, else those
/// of the fixes.
fn usual(file: &File<'_>, gnss: Option<&Gnss>) -> Option<Gnss> {
    let simulated = POSITION
        .iter()
        .all(|name| file.names.iter().any(|n| n == name));
    if !simulated {
        return gnss.cloned();
    }
    let scalar = |column: &str, unit: &str| Scalar {
        column: column.into(),
        unit: unit.into(),
    };
    let [time, latitude, longitude, height] = POSITION;
    let moves = VELOCITY
        .iter()
        .all(|name| file.names.iter().any(|n| n == name));
    let velocity = moves.then(|| Velocity {
        columns: VELOCITY.map(String::from).to_vec(),
        unit: "m/s".into(),
        order: "ned".into(),
    });
    Some(Gnss {
        time: scalar(time, "s"),
        latitude: scalar(latitude, "deg"),
        longitude: scalar(longitude, "deg"),
        height: Some(scalar(height, "m")),
        velocity,
        file: None,
        separator: ",".into(),
        names: true,
        skip_lines: None,
        valid: Vec::new(),
        time_offset_s: None,
        lever_arm_m: None,
        position_sigma: None,
        velocity_sigma: None,
        position_sigma_m: [1.0; 3],
        velocity_sigma_mps: [1.0; 3],
    })
}
