//! Fixes from the log of a receiver that stands beside the recording of another IMU: UBX, NMEA,
//! `NovAtel` or SBF, detected and decoded by the code of the device ([`firmware::wire::receiver`]).
//!
//! All protocols are read at once, each as the device reads it when it is configured. That with the
//! better fixes is used: more values, then more fixes, but not if they cover less than half of the
//! time.

mod line;
mod message_counts;
mod others;
mod unread;

use crate::recordings::input::{Input, Progress};
use crate::recordings::record::{NOT_MEASURED, Record, TimedFix};
use crate::recordings::rtklib;
use crate::recordings::stamped::{Fixes, Location};
use crate::recordings::{DAY_S, WEEK_S};
use firmware::fix::Fix;
use firmware::wire::framer::LONGEST;
use firmware::wire::receiver::ReceiverFormat;
use host_core::error::Error;
use host_core::inertial::units::DEG;
use host_core::words::counted;
use line::Line;
use std::io::{ErrorKind, Read};
use std::path::Path;
use unread::Unread;

/// A week and a day, ms.
const WEEK_MS: i64 = 1000 * WEEK_S as i64;
const DAY_MS: u32 = 86_400_000;
/// Start of GPS time in UTC, s since 1970.
const GPS_START_S: f64 = 315_964_800.0;
/// GPS time minus UTC, since 2017, s.
const LEAP_S: f64 = 18.0;
/// Times of samples from here on are UTC since 1970, s: September 2001. No second of week is so
/// large.
const UNIX_S: f64 = 1e9;

/// The fixes of a receiver's log.
#[derive(Debug, Clone)]
pub struct Log {
    /// Protocol of the receiver.
    pub format: ReceiverFormat,
    /// Fixes at GPS seconds of week, which continue over the end of a week; of the day where it is
    /// not dated.
    pub fixes: Vec<TimedFix>,
    /// The week of the fixes is known, and not their time of the day alone.
    pub dated: bool,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
}

/// Name of a protocol as its makers write it.
#[must_use]
pub const fn name(format: ReceiverFormat) -> &'static str {
    match format {
        ReceiverFormat::Ubx => "UBX",
        ReceiverFormat::Nmea => "NMEA",
        ReceiverFormat::Novatel => "NovAtel",
        ReceiverFormat::Sbf => "SBF",
    }
}

/// Reads the fixes of a log. `given`: the protocol; `None`: that with the better fixes.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`]; there is no fix; times do not rise.
pub fn read(
    file: &Path,
    given: Option<ReceiverFormat>,
    progress: Progress<'_>,
) -> Result<Log, Error> {
    let (mut lines, unread, is_cut) = lines(file, given, progress)?;
    let Some(best) = best(&lines) else {
        return Err(nothing(file, &lines, &unread));
    };
    let others = lines
        .iter()
        .filter(|line| line.format != best)
        .filter_map(Line::also);
    let mut notes: Vec<String> = others.collect();
    if is_cut {
        notes.push("the gzip stream is cut; the log is read up to there".to_owned());
    }
    let Some(line) = lines.iter_mut().find(|line| line.format == best) else {
        return Err(nothing(file, &[], &unread));
    };
    let dated = line.date();
    if !dated {
        notes.push(
            "no date is in the log (RMC, ZDA); its times of the day are taken as those of the \
             samples"
                .to_owned(),
        );
    }
    let mut fixes = Fixes::new(Location::new(file, format!("{best:?} fix")));
    let mut times = Unwrapped::default();
    let all: Vec<(i64, TimedFix)> = (line.fixes.iter())
        .map(|solved| (times.on(solved.fix.time_ms), timed(&solved.fix)))
        .collect();
    let rising = rising(&all);
    if rising.len() < all.len() {
        notes.push(format!(
            "the receiver's clock goes back within the log; of its {} the {} in the longest \
             part without that are used",
            counted(all.len(), "fix"),
            rising.len()
        ));
    }
    for (k, (ms, fix)) in rising.iter().enumerate() {
        fixes.push(k, ms * 1_000_000, *fix)?;
    }
    let behind = match best {
        ReceiverFormat::Nmea => LEAP_S, // its times are UTC
        _ => 0.0,
    };
    let at = |(ns, fix): &(i64, TimedFix)| TimedFix {
        time: *ns as f64 / 1e9 + behind,
        ..*fix
    };
    Ok(Log {
        format: best,
        fixes: fixes.all.iter().map(at).collect(),
        dated,
        notes,
    })
}

/// The error of a log without a fix.
fn nothing(file: &Path, lines: &[Line], unread: &Unread) -> Error {
    let mut head = Vec::new();
    let input = Input::text(file, &|_, _| ());
    let read = input.map(|input| input.take(others::LOOK).read_to_end(&mut head));
    let _ = read; // it was read before
    message_counts::nothing(file, lines, unread, others::recognised(&head))
}

/// What is in the log, by protocol, and what cannot be read; whether it is gzipped and cut.
fn lines(
    file: &Path,
    given: Option<ReceiverFormat>,
    progress: Progress<'_>,
) -> Result<(Vec<Line>, Unread, bool), Error> {
    let formats = ReceiverFormat::ALL.into_iter();
    let heard = formats.filter(|format| given.is_none_or(|given| given == *format));
    let mut lines: Vec<Line> = heard
        .map(|format| Line::new(format, given.is_some()))
        .collect();
    let mut unread = Unread::default();
    let mut input = Input::text(file, progress)?;
    let mut bytes = [0; LONGEST];
    let mut is_cut = false;
    loop {
        let count = match input.read(&mut bytes) {
            Err(fault) if input.packed && fault.kind() == ErrorKind::UnexpectedEof => {
                is_cut = true;
                0
            }
            count => count.map_err(|e| input.fault(file, e))?,
        };
        for line in &mut lines {
            line.push(&bytes[..count]);
        }
        unread.push(&bytes[..count]);
        if count == 0 {
            return Ok((lines, unread, is_cut));
        }
    }
}

/// The protocol with the better fixes.
fn best(lines: &[Line]) -> Option<ReceiverFormat> {
    let longest = lines.iter().map(Line::span_ms).max().unwrap_or_default();
    let candidates = lines.iter().filter(|line| !line.fixes.is_empty());
    let fair = candidates.filter(|line| 2 * line.span_ms() >= longest);
    // of equal ones the first
    let best = fair
        .rev()
        .max_by_key(|line| (line.values(), line.fixes.len()));
    best.map(|line| line.format)
}

/// The longest part whose times rise.
fn rising(all: &[(i64, TimedFix)]) -> &[(i64, TimedFix)] {
    let parts = all.chunk_by(|a, b| a.0 < b.0);
    // of equal ones the first
    parts
        .rev()
        .max_by_key(|part| part.len())
        .unwrap_or_default()
}

/// Times of week that continue over the end of a week.
#[derive(Debug, Default)]
struct Unwrapped {
    count: usize,
    weeks: i64,
    last: i64,
}

impl Unwrapped {
    fn on(&mut self, ms: u32) -> i64 {
        let ms = i64::from(ms);
        self.weeks += i64::from(self.count > 0 && ms < self.last - WEEK_MS / 2);
        self.count += 1;
        self.last = ms;
        ms + self.weeks * WEEK_MS
    }
}

fn timed(fix: &Fix) -> TimedFix {
    let sigma = |s: f32| match s {
        s if s.is_finite() => f64::from(s),
        _ => NOT_MEASURED,
    };
    TimedFix {
        time: 0.0, // stored beside the fix
        lat_deg: fix.position.latitude / DEG,
        lon_deg: fix.position.longitude / DEG,
        height_m: fix.position.height,
        velocity: fix.velocity,
        sigmas: fix.sigmas.map(sigma),
    }
}

impl Log {
    /// Replaces the fixes of a recording. `origin_s` is UTC at its time 0, s since 1970, if the
    /// recording knows it. Otherwise its times are UTC since 1970 where they are large, else GPS
    /// seconds of week.
    pub fn beside(self, record: &mut Record, origin_s: Option<f64>) {
        let first = record.time.start().unwrap_or_default();
        let unix = origin_s.or((first > UNIX_S).then_some(0.0));
        // time 0 of the recording in GPS time, since its start or that of a week
        let leap = |gps: f64| match self.format {
            ReceiverFormat::Nmea => LEAP_S, // as was added to its times
            _ => rtklib::leap(gps),
        };
        let zero = unix.map_or(0.0, |origin| {
            let gps = origin - GPS_START_S;
            gps + leap(gps + first)
        });
        let start = self.fixes.first().map_or(0.0, |fix| fix.time);
        let shift = if self.dated {
            // the week that brings the first fix nearest to the first sample
            let weeks = ((zero + first - start) / WEEK_S).round();
            if unix.is_some() { weeks * WEEK_S } else { 0.0 }
        } else {
            // the day that brings the middle of the fixes nearest to that of the samples
            let last = record.time.end().unwrap_or_default();
            let end = self.fixes.last().map_or(0.0, |fix| fix.time);
            let days = (zero + (first + last - start - end) / 2.0) / DAY_S;
            days.round() * DAY_S
        };
        let moved = |fix: TimedFix| TimedFix {
            time: fix.time + (shift - zero),
            ..fix
        };
        record.fixes = self.fixes.into_iter().map(moved).collect();
        record.truth = None;
        record.given_offset_s = None;
        record.estimates_offset = false;
    }
}

#[cfg(test)]
mod tests;
