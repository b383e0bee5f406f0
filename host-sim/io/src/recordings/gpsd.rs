//! Logs in lines of JSON: the reports of gpsd (`gpspipe -w`), and others with the same names.
//!
//! ```text
//! {"class":"TPV","mode":3,"time":"2026-11-27T12:00:00.000Z","lat":45.8,"lon":5.7,"altHAE":300.1,
//!  "epx":1.2,"epy":1.4,"epv":2.3,"track":90.1,"speed":12.1,"climb":0.1,"eps":0.2, ...}
//! ```
//!
//! Times are UTC, as text or in seconds since 1970. gpsd does not say with which certainty its
//! errors are stated; they count as standard deviations.

use crate::recordings::DAY_S;
use crate::recordings::input::{Input, Progress};
use crate::recordings::nowhere::{LeftOut, is_nowhere};
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::rtklib::{GPS_START_S, Solutions, days, leap};
use crate::recordings::session::complain;
use host_core::error::Error;
use host_core::inertial::units::DEG;
use host_core::words::{agrees, counted};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Standard deviations that a report does not state: m, m above, m/s.
const USUAL: [f64; 3] = [1.0, 1.5, 0.1];

/// A line.
#[derive(Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Report {
    class: Option<String>,
    device: Option<String>,
    mode: Option<f64>,
    time: Option<Value>,
    lat: Option<f64>,
    lon: Option<f64>,
    #[serde(rename = "altHAE")]
    alt_hae: Option<f64>,
    #[serde(rename = "altMSL")]
    alt_msl: Option<f64>,
    geoid_sep: Option<f64>,
    alt: Option<f64>,
    track: Option<f64>,
    speed: Option<f64>,
    climb: Option<f64>,
    vel_n: Option<f64>,
    vel_e: Option<f64>,
    vel_d: Option<f64>,
    epx: Option<f64>,
    epy: Option<f64>,
    epv: Option<f64>,
    eph: Option<f64>,
    eps: Option<f64>,
    epc: Option<f64>,
}

/// Whether a file holds lines of JSON.
#[must_use]
pub fn is_one(file: &Path) -> bool {
    let mut head = Vec::new();
    let read = Input::text(file, &|_, _| ()).map(|input| input.take(256).read_to_end(&mut head));
    let _ = read; // the reader of the whole file reports what is wrong
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    matches!(text.trim_ascii_start(), [b'{' | b'[', ..])
}

/// Reads the fixes of a log. Those of the receiver with the most count.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`], [`Error::Packed`]; there is no fix.
pub fn read(file: &Path, progress: Progress<'_>) -> Result<Solutions, Error> {
    let mut found = LogContents::default();
    let mut input = BufReader::with_capacity(1 << 16, Input::text(file, progress)?);
    let mut line = Vec::new();
    let mut is_cut = false;
    loop {
        line.clear();
        let count = match input.read_until(b'\n', &mut line) {
            Err(_) if input.get_ref().ended => {
                is_cut = true;
                0
            }
            count => count.map_err(|e| input.get_ref().fault(file, e))?,
        };
        if count == 0 {
            break;
        }
        let text = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&line);
        is_cut = !line.ends_with(b"\n");
        found.take(text.trim_ascii(), is_cut);
    }
    found.solutions(file, is_cut)
}

/// Contents of a log.
#[derive(Debug, Default)]
struct LogContents {
    /// By receiver.
    fixes: BTreeMap<String, Vec<TimedFix>>,
    left_out: LeftOut,
    /// Reports without a fix, by class.
    others: BTreeMap<String, usize>,
    broken: usize,
    /// Fixes whose height is said to be above the sea, or not said above what.
    at_sea: usize,
    lines: usize,
}

impl LogContents {
    fn take(&mut self, line: &[u8], is_cut: bool) {
        self.lines += 1;
        let Ok(report) = serde_json::from_slice::<Report>(line) else {
            // sentences in between are those of the same receiver
            let counts = !line.is_empty() && !line.starts_with(b"$") && !is_cut;
            self.broken += usize::from(counts);
            return;
        };
        let class = report.class.as_deref().unwrap_or("TPV");
        if class != "TPV" {
            *self.others.entry(class.to_owned()).or_default() += 1;
            return;
        }
        match report.fix() {
            Ok(fix) => {
                let is_vague = fix.has(2..3) && report.above_ellipsoid().is_none();
                self.at_sea += usize::from(is_vague);
                let fixes = self.fixes.entry(report.device.unwrap_or_default());
                let fixes = fixes.or_default();
                // gpsd completes an epoch in several reports of the same time
                match fixes.last_mut().filter(|last| last.time == fix.time) {
                    Some(last) if values(&fix) >= values(last) => *last = fix,
                    Some(_) => {}
                    None => fixes.push(fix),
                }
            }
            Err(why) => self.left_out.count(&why, self.lines as f64),
        }
    }

    fn solutions(mut self, file: &Path, is_cut: bool) -> Result<Solutions, Error> {
        let devices = self.fixes.len();
        let most = self.fixes.iter().max_by_key(|(_, fixes)| fixes.len());
        let Some(name) = most.map(|(name, _)| name.clone()) else {
            return Err(self.nothing(file));
        };
        let all = self.fixes.remove(&name).unwrap_or_default();
        let parts = all.chunk_by(|a, b| a.time < b.time);
        let part = parts.max_by_key(|part| part.len()).unwrap_or_default();
        let file = file.display();
        let mut notes = Vec::new();
        if devices > 1 {
            notes.push(format!(
                "{file}: {devices} receivers are in the log; '{name}' is used"
            ));
        }
        if part.len() < all.len() {
            notes.push(format!(
                "{file}: the times go back within the log; of its {} the {} in the longest \
                 part without that are used",
                counted(all.len(), "fix"),
                part.len()
            ));
        }
        if self.left_out.all() > 0 {
            let (count, why) = (self.left_out.all(), self.left_out.reasons());
            notes.push(format!(
                "{file}: {} {} no fix: {why}.",
                counted(count, "report"),
                agrees(count, "holds", "hold")
            ));
        }
        if self.broken > 0 {
            notes.push(format!(
                "{file}: {} {} not JSON",
                counted(self.broken, "line"),
                agrees(self.broken, "is", "are")
            ));
        }
        if self.at_sea > 0 {
            notes.push(format!(
                "{file}: heights are not said to be above the ellipsoid (altHAE); they count so"
            ));
        }
        if is_cut {
            notes.push(format!(
                "{file}: the file ends within a line and is read up to it"
            ));
        }
        Ok(Solutions {
            fixes: part.to_vec(),
            notes,
        })
    }

    fn nothing(&self, file: &Path) -> Error {
        let mut seen: Vec<String> = self
            .others
            .iter()
            .map(|(class, count)| format!("{count} {class}"))
            .collect();
        if self.left_out.all() > 0 {
            let (count, why) = (self.left_out.all(), self.left_out.reasons());
            seen.push(format!("{count} TPV of which {why}"));
        }
        if self.broken > 0 {
            seen.push(format!("{} of other text", counted(self.broken, "line")));
        }
        let problem = format!("has no fix; seen are {}", seen.join(", "));
        let remedy = "give reports of gpsd of the class TPV with time, lat and lon, one on each \
                      line, while the receiver sees satellites (gpspipe -w)";
        complain(file, "fixes", problem, remedy)
    }
}

fn values(fix: &TimedFix) -> usize {
    (0..6).filter(|at| fix.has(*at..at + 1)).count()
}

impl Report {
    fn above_ellipsoid(&self) -> Option<f64> {
        let sum = || Some(self.alt_msl? + self.geoid_sep?);
        self.alt_hae.or_else(sum)
    }

    /// The fix at GPS time, s since 1980, or why there is none.
    fn fix(&self) -> Result<TimedFix, String> {
        if let Some(mode) = self.mode.filter(|mode| *mode < 2.0) {
            return Err(format!("the mode is {mode}"));
        }
        let (Some(lat_deg), Some(lon_deg)) = (self.lat, self.lon) else {
            return Err("lat or lon is missing".into());
        };
        if is_nowhere(lat_deg, lon_deg) {
            return Err("lat and lon are 0".into());
        }
        if lat_deg.abs() >= 89.9 || lon_deg.abs() > 360.0 {
            return Err("lat and lon are not on Earth in deg".into());
        }
        let time = self.time.as_ref().and_then(gps);
        let time = time.ok_or("the time is missing, or not of the form 2026-11-27T12:00:00Z")?;
        let is_flat = self.mode == Some(2.0);
        let height = self.above_ellipsoid().or(self.alt_msl).or(self.alt);
        let height = height.filter(|height| !is_flat && height.abs() < 20_000.0);
        let known = |sigma: Option<f64>| sigma.filter(|sigma| *sigma > 0.0);
        let across = known(self.eph).map_or(USUAL[0], |eph| eph * FRAC_1_SQRT_2);
        let [speed, climb] = [self.eps, self.epc].map(known);
        let speed = speed.unwrap_or(USUAL[2]);
        let mut sigmas = [
            known(self.epy).unwrap_or(across),
            known(self.epx).unwrap_or(across),
            height.map_or(NOT_MEASURED, |_| known(self.epv).unwrap_or(USUAL[1])),
            speed,
            speed,
            climb.unwrap_or(speed),
        ];
        let [north, east, down] = self.velocity();
        if north.is_none() || east.is_none() {
            sigmas[3..].fill(NOT_MEASURED);
        }
        if down.is_none() {
            sigmas[5] = NOT_MEASURED;
        }
        Ok(TimedFix {
            time,
            lat_deg,
            lon_deg,
            height_m: height.unwrap_or(0.0),
            velocity: [north, east, down].map(Option::unwrap_or_default),
            sigmas,
        })
    }

    /// North, east and down, m/s. What stands has no track.
    fn velocity(&self) -> [Option<f64>; 3] {
        let down = self.vel_d.or(self.climb.map(|climb| -climb));
        if self.vel_n.is_some() && self.vel_e.is_some() {
            return [self.vel_n, self.vel_e, down];
        }
        let track = self.track.or(self.speed.filter(|speed| *speed == 0.0));
        let course = self.speed.zip(track).map(|(speed, track)| {
            let (sin, cos) = (track * DEG).sin_cos();
            [speed * cos, speed * sin]
        });
        let [north, east] = course.map_or([None; 2], |v| v.map(Some));
        [north, east, down]
    }
}

/// GPS time, s since 1980, of a text or of seconds since 1970. (An untagged enum would not do: it
/// reads no number where a crate of the same build has `serde_json/arbitrary_precision` on.)
fn gps(time: &Value) -> Option<f64> {
    let unix = time.as_f64().or_else(|| unix(time.as_str()?))?;
    let gps = unix - GPS_START_S;
    unix.is_finite().then(|| gps + leap(gps))
}

/// UTC, s since 1970, of a text as `2026-11-27T12:00:00.000Z`.
fn unix(text: &str) -> Option<f64> {
    let utc = text.strip_suffix('Z').or(text.strip_suffix("+00:00"))?;
    let (date, time) = utc.split_once(['T', ' '])?;
    let numbers = |text: &str, by: char| -> Option<[f64; 3]> {
        let all: Result<Vec<f64>, _> = text.split(by).map(str::parse).collect();
        all.ok()?.try_into().ok()
    };
    let [hour, minute, second] = numbers(time, ':')?;
    let days = days(numbers(date, '-')?)?;
    Some(days * DAY_S + hour * 3600.0 + minute * 60.0 + second)
}

#[cfg(test)]
mod tests;
