//! Solution files of RTKLIB (`.pos`), as its programs `rtkpost` and `rnx2rtkp` write them.
//!
//! ```text
//! %  GPST          latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m) ...
//! 2021/01/05 10:20:30.000   28.199998908  112.899998750    58.5074   1  12   0.0100 ...
//! ```
//!
//! The last comment before the data names the columns. Times are in GPS time, UTC or JST, as a date
//! or as week and second; positions are geodetic (degrees, or degrees, minutes and seconds) or of
//! the Earth's centre. Q is 1 (fixed) to 7 (PPP); 0 is no solution.

use crate::recordings::WEEK_S;
use crate::recordings::nowhere::LeftOut;
use crate::recordings::record::{NOT_MEASURED, Record, TimedFix};
use crate::recordings::session::complain;
use crate::recordings::table::{Separator, Source};
use crate::recordings::week;
use host_core::error::Error;
use host_core::inertial::earth::{A, E2};
use host_core::inertial::units::DEG;
use host_core::words::{agrees, counted};
use nalgebra::{Matrix3, Vector3};
use std::path::Path;

/// Start of GPS time in UTC, s since 1970.
pub(super) const GPS_START_S: f64 = 315_964_800.0;
/// Times of samples from here on are UTC since 1970, s.
const UNIX_S: f64 = 1e9;
/// JST less UTC, s.
const JAPAN_S: f64 = 9.0 * 3600.0;
/// GPS time less UTC from these GPS times on, s.
const LEAPS: [(f64, f64); 4] = [
    (1_167_264_018.0, 18.0),
    (1_119_744_017.0, 17.0),
    (1_025_136_016.0, 16.0),
    (0.0, 15.0),
];

/// Fixes at GPS times, s since 1980, and notes on the file.
#[derive(Debug, Clone)]
pub struct Solutions {
    /// The fixes.
    pub fixes: Vec<TimedFix>,
    /// A sentence each.
    pub notes: Vec<String>,
}

/// Whether a file is one of RTKLIB's by its comments.
#[must_use]
pub fn is_one(file: &Path) -> bool {
    Source::open(file, Separator::BlankOrComma)
        .is_ok_and(|source| Columns::of(source.head()).is_some())
}

/// Reads a file of solutions.
///
/// # Errors
/// Any fault of the file, with its line.
pub fn read(file: &Path) -> Result<Solutions, Error> {
    let text = crate::recordings::read::read_to_cut(file)?;
    let text = String::from_utf8_lossy(&text);
    let lines: Vec<Vec<String>> = text.lines().take(64).map(cells).collect();
    let columns = Columns::of(&lines).ok_or_else(|| {
        let problem = "has no comment that names the columns of RTKLIB".to_owned();
        complain(
            file,
            "solutions",
            problem,
            "give a file as rtkpost writes it, with its header",
        )
    })?;
    let (mut fixes, mut left_out) = (Vec::<TimedFix>::new(), LeftOut::default());
    let mut notes = Vec::new();
    let mut comments = text.lines().take_while(|line| line.starts_with('%'));
    if comments.any(|line| line.contains("/geodetic")) {
        notes.push(format!(
            "{}: the heights are above the geoid, which lies -106 to 85 m from the ellipsoid.",
            file.display()
        ));
    }
    let last = text.lines().count();
    let mut most = 0;
    for (k, line) in (1..).zip(text.lines()) {
        if line.trim().is_empty() || line.starts_with('%') {
            continue;
        }
        let bad = |problem: String| {
            let remedy = "give lines as the comment above them names their columns";
            complain(file, &format!("line {k}"), problem, remedy)
        };
        let cells = cells(line);
        let is_cut = k == last && !text.ends_with('\n') && cells.len() < most;
        most = most.max(cells.len());
        let found = match is_cut {
            true => Err(String::new()),
            false => columns.fix(&cells),
        };
        match found {
            Ok(Ok(fix)) => {
                if fixes.last().is_some_and(|before| before.time >= fix.time) {
                    return Err(bad("is not after the line before".into()));
                }
                fixes.push(fix);
            }
            Ok(Err(reason)) => left_out.count(reason, k as f64),
            Err(_) if k == last && !text.ends_with('\n') => {
                notes.push(format!(
                    "{}:{k}: the file ends within this line.",
                    file.display()
                ));
            }
            Err(problem) => return Err(bad(problem)),
        }
    }
    if fixes.is_empty() {
        let remedy = "look at the solution in rtkplot; Q must not be 0";
        return Err(complain(file, "solutions", "are none".into(), remedy));
    }
    if left_out.all() > 0 {
        notes.push(format!(
            "{}: {} {} no fix: {}.",
            file.display(),
            counted(left_out.all(), "line"),
            agrees(left_out.all(), "holds", "hold"),
            left_out.reasons()
        ));
    }
    Ok(Solutions { fixes, notes })
}

fn cells(line: &str) -> Vec<String> {
    let all = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';');
    all.filter(|cell| !cell.is_empty())
        .map(str::to_owned)
        .collect()
}

/// Scale of the times.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Clock {
    Gps,
    /// UTC and this, s.
    Utc(f64),
}

/// Form of the positions.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Degrees,
    /// Degrees, minutes, seconds.
    Sexagesimal,
    Cartesian,
}

/// The columns of a file.
#[derive(Debug, Clone)]
struct Columns {
    clock: Clock,
    form: Form,
    /// Names behind the position.
    names: Vec<String>,
}

impl Columns {
    fn of(head: &[Vec<String>]) -> Option<Self> {
        let named = |line: &&Vec<String>| {
            let text = line.join(" ");
            line.first().is_some_and(|first| first.starts_with('%'))
                && (text.contains("latitude(") || text.contains("x-ecef("))
        };
        let line = head.iter().rfind(named)?.join(" ");
        let line = line.trim_start_matches('%').trim();
        let mut words = line.split(' ');
        let clock = match words.next()? {
            "GPST" => Clock::Gps,
            "UTC" => Clock::Utc(0.0),
            "JST" => Clock::Utc(JAPAN_S),
            _ => return None,
        };
        let first = words.next()?;
        let form = match () {
            () if first.starts_with("x-ecef") => Form::Cartesian,
            () if first.contains('\'') => Form::Sexagesimal,
            () => Form::Degrees,
        };
        let names = words
            .skip(2)
            .map(|name| name.split('(').next().unwrap_or("").to_owned());
        Some(Self {
            clock,
            form,
            names: names.collect(),
        })
    }

    /// The fix of a line, or why it holds none.
    fn fix(&self, cells: &[String]) -> Result<Result<TimedFix, &'static str>, String> {
        let number = |k: usize| {
            let text = cells
                .get(k)
                .ok_or_else(|| format!("has {} columns", cells.len()))?;
            let number = text.parse::<f64>().ok().filter(|x| x.is_finite());
            number.ok_or_else(|| format!("has '{text}', which is not a number"))
        };
        let time = self.time(cells)?;
        let angle = |k: usize| {
            let (degrees, minutes, seconds) = (number(k)?, number(k + 1)?, number(k + 2)?);
            let size = degrees.abs() + minutes / 60.0 + seconds / 3600.0;
            let is_minus = cells[k].starts_with('-');
            Ok::<_, String>(if is_minus { -size } else { size })
        };
        let angles = if self.form == Form::Sexagesimal {
            2..8
        } else {
            2..4
        };
        if angles.into_iter().all(|k| number(k) == Ok(0.0)) {
            return Ok(Err("the position is 0"));
        }
        let (position, behind) = match self.form {
            Form::Degrees => ([number(2)?, number(3)?, number(4)?], 5),
            Form::Sexagesimal => ([angle(2)?, angle(5)?, number(8)?], 9),
            Form::Cartesian => (geodetic([number(2)?, number(3)?, number(4)?]), 5),
        };
        let [lat_deg, lon_deg, height_m] = position;
        if !(lat_deg.abs() < 89.9 && lon_deg.abs() <= 360.0 && height_m.abs() < 20_000.0) {
            return Err(format!("has the position {lat_deg}, {lon_deg}, {height_m}"));
        }
        let of = |name: &str| {
            let at = self.names.iter().position(|n| n == name)?;
            number(behind + at).ok()
        };
        if of("Q") == Some(0.0) {
            return Ok(Err("Q is 0"));
        }
        let three = |names: [&str; 3]| Some([of(names[0])?, of(names[1])?, of(names[2])?]);
        let north_east_down = |names: [[&str; 3]; 2], squares: bool| match self.form {
            Form::Cartesian => {
                let xyz = Vector3::from(three(names[1])?);
                let turn = to_ned(lat_deg, lon_deg);
                Some(match squares {
                    true => (turn.map(|x| x * x) * xyz.map(|x| x * x)).map(f64::sqrt),
                    false => turn * xyz,
                })
            }
            _ => {
                let [n, e, u] = three(names[0])?;
                Some(Vector3::new(n, e, if squares { u } else { -u }))
            }
        };
        let sigma = north_east_down([["sdn", "sde", "sdu"], ["sdx", "sdy", "sdz"]], true);
        let velocity = north_east_down([["vn", "ve", "vu"], ["vx", "vy", "vz"]], false);
        let sigma_v = north_east_down([["sdvn", "sdve", "sdvu"], ["sdvx", "sdvy", "sdvz"]], true);
        let known = |sigma: Option<Vector3<f64>>, usual: [f64; 3]| match sigma {
            Some(s) if s.iter().all(|s| *s > 0.0) => s.into(),
            _ => usual,
        };
        let [n, e, d] = known(sigma, [1.0, 1.0, 1.5]);
        let [vn, ve, vd] = match velocity {
            // RTKLIB writes zeros where there is no Doppler
            Some(v) if v != Vector3::zeros() => known(sigma_v, [0.05; 3]),
            _ => [NOT_MEASURED; 3],
        };
        Ok(Ok(TimedFix {
            time,
            lat_deg,
            lon_deg,
            height_m,
            velocity: velocity.unwrap_or_default().into(),
            sigmas: [n, e, d, vn, ve, vd],
        }))
    }

    /// GPS time, s since 1980.
    fn time(&self, cells: &[String]) -> Result<f64, String> {
        let bad = || format!("has no time: '{}'", cells[..cells.len().min(2)].join(" "));
        let [date, time, ..] = cells else {
            return Err(bad());
        };
        let numbers = |text: &str, by: char| -> Option<[f64; 3]> {
            let all: Result<Vec<f64>, _> = text.split(by).map(str::parse).collect();
            all.ok()?.try_into().ok()
        };
        let second = match date.contains('/') {
            false => {
                let week: f64 = date.parse().map_err(|_| bad())?;
                week * WEEK_S + time.parse::<f64>().map_err(|_| bad())?
            }
            true => {
                let [year, month, day] = numbers(date, '/').ok_or_else(bad)?;
                let [hour, minute, second] = numbers(time, ':').ok_or_else(bad)?;
                let days = days([year, month, day]).ok_or_else(bad)?;
                days * 86_400.0 - GPS_START_S + hour * 3600.0 + minute * 60.0 + second
            }
        };
        Ok(match self.clock {
            Clock::Gps => second,
            Clock::Utc(zone) => {
                let utc = second - zone;
                utc + leap(utc)
            }
        })
    }
}

/// GPS time less UTC at a GPS time, s.
pub(super) fn leap(gps: f64) -> f64 {
    let found = LEAPS.iter().find(|(from, _)| gps >= *from);
    found.map_or(15.0, |(_, leap)| *leap)
}

/// Days since 1970 of year, month and day of the Gregorian calendar.
pub(super) fn days(date: [f64; 3]) -> Option<f64> {
    let [year, month, day] = date.map(|x| x as i64);
    if !((1970..2200).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day)) {
        return None;
    }
    // years begin in March, so that the leap day is the last one
    let (year, month) = match month {
        3.. => (year, month - 3),
        _ => (year - 1, month + 9),
    };
    let of_year = (153 * month + 2) / 5 + day - 1;
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    Some((365 * year + leap_days + of_year - 719_468) as f64)
}

/// Latitude and longitude, deg, and height, m, of a place by its distances from the Earth's centre.
fn geodetic([x, y, z]: [f64; 3]) -> [f64; 3] {
    let p = x.hypot(y);
    let mut lat = z.atan2(p * (1.0 - E2));
    let mut height = 0.0;
    for _ in 0..10 {
        let n = A / (1.0 - E2 * lat.sin().powi(2)).sqrt();
        height = p / lat.cos() - n;
        lat = z.atan2(p * (1.0 - E2 * n / (n + height)));
    }
    [lat / DEG, y.atan2(x) / DEG, height]
}

/// Rotation from the axes of the Earth's centre to north, east and down.
fn to_ned(lat_deg: f64, lon_deg: f64) -> Matrix3<f64> {
    let ((sin, cos), (sin_l, cos_l)) = ((lat_deg * DEG).sin_cos(), (lon_deg * DEG).sin_cos());
    Matrix3::new(
        -sin * cos_l,
        -sin * sin_l,
        cos,
        -sin_l,
        cos_l,
        0.0,
        -cos * cos_l,
        -cos * sin_l,
        -sin,
    )
}

impl Solutions {
    /// Replaces the fixes of a recording. `origin_s` is UTC at its time 0, s since 1970, if the
    /// recording knows it. Otherwise its times are UTC since 1970 where they are large, else GPS
    /// seconds of week.
    pub fn beside(self, record: &mut Record, origin_s: Option<f64>) {
        let first = record.time.start().unwrap_or_default();
        let start = self.fixes.first().map_or(0.0, |fix| fix.time);
        let unix = origin_s.or((first > UNIX_S).then_some(0.0));
        let shift = match unix {
            Some(origin) => GPS_START_S - leap(start) - origin,
            None => -(start / WEEK_S).floor() * WEEK_S,
        };
        let moved = |fix: TimedFix| TimedFix {
            time: fix.time + shift,
            ..fix
        };
        record.fixes = self.fixes.into_iter().map(moved).collect();
        record.truth = None;
        record.given_offset_s = None;
        record.estimates_offset = false;
        record.notes.extend(self.notes);
        week::join(record);
    }
}

#[cfg(test)]
mod tests;
