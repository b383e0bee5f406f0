//! Bags of ROS 2 in MCAP: `sensor_msgs/msg/Imu` as samples, `sensor_msgs/msg/NavSatFix` as fixes,
//! and on request `geometry_msgs/msg/TwistStamped` or `TwistWithCovarianceStamped` as their
//! velocities.
//!
//! By REP 103 of ROS the axes of an IMU are forward-left-up, and velocities are east-north-up.
//! Angular rates are in rad/s and the accelerometers measure specific force in m/s2, so `z` is +9.8
//! at rest (REP 145). The height of a `NavSatFix` is above the ellipsoid.
//!
//! The time of a message is the stamp of its header. Where all stamps of a topic are zero, the time
//! at which the recorder received the message is used.
//!
//! The crate `mcap` is not used: it takes C libraries to unpack chunks, or leaves them packed. The
//! container without its index is a loop over lengths.

mod bag;
mod cdr;
mod container;
mod fixes;
mod topics;

use crate::recordings::input::{Input, Progress};
use crate::recordings::record::{Kind, Record};
use crate::recordings::session::complain;
use crate::recordings::stamped::{Location, Reading, Samples, turned};
use container::{Ending, Stop};
use fixes::{Velocities, collect};
use host_core::error::Error;
use nalgebra::Rotation3;
use std::path::Path;
use topics::{ChosenTopics, Topics};

/// Remedy for a stamp that does not rise.
const BAG_TIME: &str = "give --bag-time, which takes the times of the recorder instead of the \
                        stamps, or cut the recording there";

/// Settings of the reader.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Topic of the IMU; without it the only one.
    pub imu: Option<String>,
    /// Topic of the fixes; without it the only one.
    pub fix: Option<String>,
    /// Topic of the velocities east-north-up. Without it velocities are not read, since messages of
    /// the same type command robots.
    pub velocity: Option<String>,
    /// Whether to use the time of the recorder instead of the stamps.
    pub bag_time: bool,
    /// Longest step between samples that is interpolated, s; `None` for the usual one.
    pub max_gap_s: Option<f64>,
    /// Turns axes of the IMU into forward-right-down.
    pub mounting: Rotation3<f64>,
}

/// Reads a bag: an MCAP file or a folder with such files.
///
/// # Errors
/// Any fault of the files, with topic and message or byte; no IMU topic, or several and no choice.
pub fn read(path: &Path, choice: &Choice, progress: Progress<'_>) -> Result<Reading, Error> {
    let mut topics = Topics::new(path, choice);
    let mut notes = Vec::new();
    for file in bag::files(path)? {
        notes.extend(read_file(&file, &mut topics, progress)?);
    }
    let found = topics.choose(&mut notes)?;
    let (record, origin_s) = assemble(path, choice, found, &mut notes)?;
    Ok(Reading {
        record,
        notes,
        origin_s,
    })
}

/// Reads one file into `topics`. Adds a note if the file is cut.
fn read_file(
    file: &Path,
    topics: &mut Topics<'_>,
    progress: Progress<'_>,
) -> Result<Option<String>, Error> {
    let mut input = Input::open(file, progress)?;
    let ending = topics.walk(&mut input);
    let at = input.at;
    match ending {
        Ok(Ending::Whole) => Ok(None),
        Ok(Ending::Cut(bytes)) => Ok(Some(format!(
            "{}: ends without the mark of its end and is read up to byte {bytes}",
            file.display()
        ))),
        Err(Stop::Refused(error)) => Err(error),
        Err(Stop::Bad(problem, remedy)) => {
            Err(complain(file, &format!("MCAP, byte {at}"), problem, remedy))
        }
        Err(Stop::Io(error)) => {
            let problem = format!("cannot be unpacked ({error})");
            let key = format!("MCAP, byte {at}");
            Err(complain(file, &key, problem, container::RECOVER))
        }
    }
}

/// The record of the chosen messages.
fn assemble(
    path: &Path,
    choice: &Choice,
    found: ChosenTopics,
    notes: &mut Vec<String>,
) -> Result<(Record, Option<f64>), Error> {
    let (topic, imu) = found.imu;
    let unstamped = imu.iter().all(|(_, m)| m.stamp == 0);
    let bag_time = choice.bag_time || unstamped;
    if unstamped && !choice.bag_time {
        notes.push(format!(
            "{}: all stamps of {topic} are zero, so the times are those at which the recorder \
             received the messages",
            path.display()
        ));
    }
    let time = |log: i64, stamp: i64| if bag_time { log } else { stamp };
    let mut location = Location::new(path, topic);
    let back = if bag_time { location.back } else { BAG_TIME };
    location.back = back;
    let mut samples = Samples::new(location.clone(), Kind::Rate);
    for (k, (log, message)) in imu.iter().enumerate() {
        if message.has != [true; 2] {
            let problem = "says by a covariance of -1 that it has no rates or no accelerations";
            let remedy = "name the topic of a whole IMU with --imu-topic";
            return Err(location.complain(k, problem.into(), remedy));
        }
        let sample = turned(&choice.mounting, message.gyro, message.accel);
        samples.push(time(*log, message.stamp), sample, 1.0)?;
    }
    let mut left_out = Vec::new();
    let fixes = match found.fixes {
        None => Vec::new(),
        Some((topic, fixes)) => {
            let velocities = Velocities::new(&found.velocities, &time);
            let mut location = Location::new(path, topic);
            location.back = back;
            let fixes = collect(location, &fixes, &velocities, &time, notes)?;
            left_out = fixes.left_out();
            fixes.all
        }
    };
    let origin_s = samples.origin_s();
    let mut record = samples.record(path, choice.max_gap_s, &fixes)?;
    record.notes.append(&mut left_out);
    Ok((record, origin_s))
}

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
