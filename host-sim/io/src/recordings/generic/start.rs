//! Reads the initial attitude, rough heading and site of a recording.

use super::read::OpenedHeader;
use crate::recordings::record::TimedFix;
use crate::recordings::session::InitialAttitude;
use host_core::error::Error;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::units::DEG;

/// Shortest standstill for self-alignment, s.
const LEAST_STANDSTILL_S: f64 = 90.0;
/// Longest one, s.
const MOST_STANDSTILL_S: f64 = 7.0 * 86_400.0;
/// Standard deviations of a vehicle at rest, from sway (assumed): position, m, then velocity, m/s.
const AT_REST: [f64; 6] = [0.05, 0.05, 0.05, 0.01, 0.01, 0.01];
/// Standard deviation of a heading that is given without one, deg (assumed).
const HEADING_DEG: f64 = 10.0;

/// The standstill or the whole attitude; `None` if the header gives neither.
pub(super) fn initial_attitude(read: &OpenedHeader) -> Result<Option<InitialAttitude>, Error> {
    let s = &read.header.start;
    match (s.standstill_s, s.roll_deg, s.pitch_deg, s.heading_deg) {
        (None, None, None, _) => Ok(None),
        (Some(t), None, None, None) if (LEAST_STANDSTILL_S..=MOST_STANDSTILL_S).contains(&t) => {
            Ok(Some(InitialAttitude::Standstill(t as usize)))
        }
        (Some(t), None, None, None) => {
            let problem = match t > MOST_STANDSTILL_S {
                true => format!("is {t}, longer than a week"),
                false => format!("is {t}, too short to align on"),
            };
            let remedy = "give at least 90, or the attitude instead, or neither: then the attitude \
                          is found in motion";
            Err(read.bad("start.standstill_s", problem, remedy))
        }
        (None, Some(roll), Some(pitch), Some(heading)) => {
            let [roll, pitch, heading] = [
                angle(read, "roll_deg", roll)?,
                angle(read, "pitch_deg", pitch)?,
                angle(read, "heading_deg", heading)?,
            ];
            let q = from_euler(roll, pitch, heading);
            Ok(Some(InitialAttitude::Known(q)))
        }
        _ => {
            let problem =
                "gives a part of an attitude, or an attitude with a standstill".to_owned();
            let remedy = "give either standstill_s, or roll_deg, pitch_deg and heading_deg, or \
                          heading_deg alone, or nothing";
            Err(read.bad("start", problem, remedy))
        }
    }
}

/// The heading that is given alone, and its standard deviation, rad.
pub(super) fn rough_heading(read: &OpenedHeader) -> Result<Option<[f64; 2]>, Error> {
    let s = &read.header.start;
    let sigma = s.heading_sigma_deg.unwrap_or(HEADING_DEG);
    if !(sigma > 0.0 && sigma <= 180.0) {
        let problem = format!("is {sigma}");
        return Err(read.bad(
            "start.heading_sigma_deg",
            problem,
            "give degrees, above 0 to 180",
        ));
    }
    match (s.roll_deg, s.heading_deg) {
        (None, Some(heading)) => Ok(Some([angle(read, "heading_deg", heading)?, sigma * DEG])),
        _ => Ok(None),
    }
}

/// An angle of the header, rad.
fn angle(read: &OpenedHeader, key: &str, degrees: f64) -> Result<f64, Error> {
    if (-360.0..=360.0).contains(&degrees) {
        return Ok(degrees * DEG);
    }
    let problem = format!("is {degrees}");
    Err(read.bad(&format!("start.{key}"), problem, "give -360 to 360"))
}

/// The site of a vehicle at rest.
pub(super) fn site(read: &OpenedHeader) -> Result<TimedFix, Error> {
    let s = &read.header.start;
    let (Some(lat), Some(lon), Some(h)) = (s.latitude_deg, s.longitude_deg, s.height_m) else {
        let problem = "does not give the site of a recording without fixes".to_owned();
        return Err(read.bad(
            "start",
            problem,
            "give latitude_deg, longitude_deg and height_m, or a table [gnss]",
        ));
    };
    if !(lat.abs() < 89.9 && lon.abs() <= 360.0 && h.abs() < 20_000.0) {
        return Err(read.bad(
            "start",
            format!("has the site {lat}, {lon}, {h}"),
            "give degrees and metres, not at a pole",
        ));
    }
    Ok(TimedFix {
        time: 0.0,
        lat_deg: lat,
        lon_deg: lon,
        height_m: h,
        velocity: [0.0; 3],
        sigmas: AT_REST,
    })
}
