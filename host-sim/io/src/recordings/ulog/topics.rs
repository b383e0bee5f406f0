//! The topics of PX4 that are read (its message definitions `VehicleImu`, `SensorCombined`,
//! `SensorGps`, `VehicleAttitude`), in all versions of their fields.

use super::row::Row;
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::stamped::USUAL_SIGMAS;
use std::collections::BTreeMap;

pub(super) const VEHICLE_IMU: &str = "vehicle_imu";
pub(super) const SENSOR_COMBINED: &str = "sensor_combined";
const GPS: [&str; 2] = ["vehicle_gps_position", "sensor_gps"];
const ATTITUDE: &str = "vehicle_attitude";

/// Value that marks an accelerometer of `sensor_combined` as missing.
const INVALID: i64 = i32::MAX as i64;

/// Increments of the body, forward-right-down, over the time before `end`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// us since the start of the autopilot.
    pub(super) end: i64,
    /// Times over which gyros and accelerometers were summed, s.
    pub(super) length: [f64; 2],
    /// rad
    pub(super) dtheta: [f64; 3],
    /// m/s
    pub(super) dv: [f64; 3],
}

/// A fix with its times, us since the start of the autopilot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Received {
    /// When it arrived.
    pub(super) arrived: i64,
    /// When it was valid, if the driver measured it; else it is 0, as late as its arrival, or
    /// nonsense.
    pub(super) sampled: Option<i64>,
    /// UTC since 1970, us.
    pub(super) utc: Option<i64>,
    pub(super) fix: TimedFix,
}

/// No fix arrives later, us.
const LATE_US: i64 = 1_000_000;

/// A topic with its instance.
pub(super) type Stream = (&'static str, u8);

/// Samples, fixes and attitudes collected from a log.
#[derive(Debug, Default)]
pub(super) struct Collected {
    pub(super) pieces: BTreeMap<Stream, Vec<Piece>>,
    pub(super) fixes: BTreeMap<Stream, Vec<Received>>,
    /// Attitudes w, x, y, z with their times, us.
    pub(super) attitudes: Vec<(i64, [f64; 4])>,
    /// Messages of a receiver without a fix in three dimensions.
    pub(super) without_fix: BTreeMap<Stream, usize>,
    /// Samples whose accelerometers are marked as missing.
    pub(super) invalid: usize,
}

/// The topic's name here, if messages of it are read.
pub(super) fn known(topic: &str) -> Option<&'static str> {
    let all = [VEHICLE_IMU, SENSOR_COMBINED, GPS[0], GPS[1], ATTITUDE];
    all.into_iter().find(|name| *name == topic)
}

impl Collected {
    /// Takes a message; `None` if it lacks a field.
    pub(super) fn take(&mut self, row: &Row<'_>) -> Option<()> {
        let topic = known(&row.subscription.topic)?;
        let stream = (topic, row.subscription.instance);
        match topic {
            VEHICLE_IMU => self
                .pieces
                .entry(stream)
                .or_default()
                .push(vehicle_imu(row)?),
            SENSOR_COMBINED => match row.integer("accelerometer_timestamp_relative", 0)? {
                INVALID => self.invalid += 1,
                _ => self.pieces.entry(stream).or_default().push(combined(row)?),
            },
            ATTITUDE => {
                let [x, y, z] = [1, 2, 3].map(|k| row.number("q", k));
                let q = [row.number("q", 0)?, x?, y?, z?];
                self.attitudes.push((time(row)?, q));
            }
            _ => {
                let (arrived, fix) = (row.integer("timestamp", 0)?, fix(row)?);
                let fixes = self.fixes.entry(stream).or_default();
                let again = fixes.last().is_some_and(|before| before.arrived == arrived);
                let positive = |name: &str| row.integer(name, 0).filter(|us| *us > 0);
                let sampled = positive("timestamp_sample");
                match fix {
                    Some(fix) if !again => fixes.push(Received {
                        arrived,
                        sampled: sampled.filter(|us| (1..LATE_US).contains(&(arrived - us))),
                        utc: positive("time_utc_usec"),
                        fix,
                    }),
                    Some(_) => {}
                    None => *self.without_fix.entry(stream).or_default() += 1,
                }
            }
        }
        Some(())
    }

    /// The fixes of the receiver that the autopilot used, else of the first one.
    pub(super) fn receiver(&mut self) -> Option<(Stream, Vec<Received>)> {
        let first = |topic: &str| {
            let mut streams = self.fixes.keys();
            streams.find(|(name, _)| *name == topic).copied()
        };
        let stream = GPS.into_iter().find_map(first)?;
        Some((stream, self.fixes.remove(&stream)?))
    }
}

/// When the values were sampled, us. Older messages have one time only.
fn time(row: &Row<'_>) -> Option<i64> {
    let sampled = row.integer("timestamp_sample", 0).filter(|us| *us > 0);
    sampled.or_else(|| row.integer("timestamp", 0))
}

/// A duration: whole us, or s in logs of before 2017.
fn duration(row: &Row<'_>, name: &str) -> Option<f64> {
    let whole = row.integer(name, 0).map(|us| us as f64 * 1e-6);
    whole.or_else(|| row.number(name, 0))
}

fn vehicle_imu(row: &Row<'_>) -> Option<Piece> {
    Some(Piece {
        end: time(row)?,
        length: [
            duration(row, "delta_angle_dt")?,
            duration(row, "delta_velocity_dt")?,
        ],
        dtheta: row.three("delta_angle")?,
        dv: row.three("delta_velocity")?,
    })
}

/// A `sensor_combined` message: its values are means over the time before the stamp.
fn combined(row: &Row<'_>) -> Option<Piece> {
    let gyro = duration(row, "gyro_integral_dt")?;
    let accel = duration(row, "accelerometer_integral_dt")?;
    Some(Piece {
        end: row.integer("timestamp", 0)?,
        length: [gyro, accel],
        dtheta: row.three("gyro_rad")?.map(|rate| rate * gyro),
        dv: row.three("accelerometer_m_s2")?.map(|force| force * accel),
    })
}

/// A fix, if the receiver has one in three dimensions (types 3 to 6). Positions are in degrees and
/// m, or in 1e-7 degree and mm in logs of before version 1.14.
fn fix(row: &Row<'_>) -> Option<Option<TimedFix>> {
    let either = |new: &str, old: &str, scale: f64| {
        let old = || Some(row.number(old, 0)? * scale);
        row.number(new, 0).or_else(old)
    };
    let lat_deg = either("latitude_deg", "lat", 1e-7)?;
    let lon_deg = either("longitude_deg", "lon", 1e-7)?;
    let height_m = either("altitude_ellipsoid_m", "alt_ellipsoid", 1e-3)?;
    if !(3..=6).contains(&row.integer("fix_type", 0)?) {
        return Some(None);
    }
    let velocity = ["vel_n_m_s", "vel_e_m_s", "vel_d_m_s"].map(|name| row.number(name, 0));
    let [Some(north), Some(east), Some(down)] = velocity else {
        return None;
    };
    // The accuracies are those of two, one and three axes, as u-blox receivers report them.
    let sigma = |name: &str, axes: f64, usual: usize| {
        let reported = row.number(name, 0).filter(|s| s.is_finite() && *s > 0.0);
        reported.map_or(USUAL_SIGMAS[usual], |s| s / axes.sqrt())
    };
    let [h, v] = [sigma("eph", 2.0, 0), sigma("epv", 1.0, 2)];
    let s = match row.integer("vel_ned_valid", 0) {
        Some(0) => NOT_MEASURED,
        _ => sigma("s_variance_m_s", 3.0, 3),
    };
    Some(Some(TimedFix {
        time: 0.0, // stored beside the fix, in ns
        lat_deg,
        lon_deg,
        height_m,
        velocity: [north, east, down],
        sigmas: [h, h, v, s, s, s],
    }))
}
