//! Fixes from the log of a receiver that stands beside the recording of another IMU: UBX, NMEA,
//! `NovAtel` or SBF, detected and decoded by the code of the device ([`firmware::wire::receiver`]).

use crate::recordings::WEEK_S;
use crate::recordings::input::{Input, Progress};
use crate::recordings::record::{NOT_MEASURED, Record, TimedFix};
use crate::recordings::session::complain;
use crate::recordings::stamped::{Fixes, Location};
use firmware::fix::Fix;
use firmware::wire::framer::LONGEST;
use firmware::wire::receiver::ReceiverFormat;
use firmware::wire::receiver::epoch::Arrival;
use firmware::wire::receiver::stream::{Receiver, SILENCE_US};
use host_core::error::Error;
use host_core::inertial::units::DEG;
use std::io::Read;
use std::path::Path;

/// A week, ms.
const WEEK_MS: i64 = 1000 * WEEK_S as i64;
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
    /// Fixes at GPS seconds of week, which continue over the end of a week.
    pub fixes: Vec<TimedFix>,
}

/// Reads the fixes of a log.
///
/// # Errors
/// [`Error::Missing`], [`Error::Unreadable`]; there is no fix; times do not rise.
pub fn read(file: &Path, progress: Progress<'_>) -> Result<Log, Error> {
    let format = format(file)?;
    let mut input = Input::open(file, progress)?;
    let mut receiver = Receiver::new(Some(format));
    let mut fixes = Fixes::new(Location::new(file, format!("{format:?} fix")));
    let mut bytes = [0; LONGEST];
    let mut times = Unwrapped::default();
    loop {
        let count = input
            .read(&mut bytes)
            .map_err(|e| Error::reading(file, e))?;
        // The silence at the end completes the last epoch.
        let us = if count == 0 { SILENCE_US } else { 0 };
        receiver.push(&bytes[..count], Arrival { us, sample: 0 });
        while let Some(solution) = receiver.next_fix() {
            if let Some(fix) = &solution.fix {
                let ms = times.on(fix.time_ms);
                fixes.push(times.count - 1, ms * 1_000_000, timed(fix))?;
            }
        }
        if count == 0 {
            break;
        }
    }
    if fixes.all.is_empty() {
        let problem = format!("holds {format:?} messages and no fix");
        let remedy =
            "give a log with UBX-NAV-PVT, GGA and RMC, BESTPOS and BESTVEL, or PVTGeodetic";
        return Err(complain(file, "fixes", problem, remedy));
    }
    let behind = match format {
        ReceiverFormat::Nmea => LEAP_S, // its times are UTC
        _ => 0.0,
    };
    let at = |(ns, fix): &(i64, TimedFix)| TimedFix {
        time: *ns as f64 / 1e9 + behind,
        ..*fix
    };
    Ok(Log {
        format,
        fixes: fixes.all.iter().map(at).collect(),
    })
}

/// Detects the protocol of the receiver.
fn format(file: &Path) -> Result<ReceiverFormat, Error> {
    let mut input = Input::open(file, &|_, _| ())?;
    let mut receiver = Receiver::new(None);
    let mut bytes = [0; LONGEST];
    loop {
        let count = input
            .read(&mut bytes)
            .map_err(|e| Error::reading(file, e))?;
        if count == 0 {
            let problem = "has no messages of a receiver that is known".to_owned();
            let remedy = "give a log of UBX, NMEA 0183, NovAtel (OEM, binary) or SBF messages";
            return Err(complain(file, "fixes", problem, remedy));
        }
        receiver.push(&bytes[..count], Arrival::default());
        while receiver.next_fix().is_some() {}
        if let Some(format) = receiver.format() {
            return Ok(format);
        }
    }
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
        let start = self.fixes.first().map_or(0.0, |fix| fix.time);
        let shift = match unix {
            None => 0.0,
            Some(origin) => {
                // the week that brings the first fix nearest to the first sample
                let gps = origin + first - GPS_START_S + LEAP_S;
                let week = ((gps - start) / WEEK_S).round();
                week * WEEK_S + GPS_START_S - LEAP_S - origin
            }
        };
        let moved = |fix: TimedFix| TimedFix {
            time: fix.time + shift,
            ..fix
        };
        record.fixes = self.fixes.into_iter().map(moved).collect();
        record.truth = None;
        record.told_offset_s = None;
        record.estimates_offset = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings::record::Kind;
    use firmware::wire::ubx::Pvt;
    use test_bench::recordings::{file, message};

    fn ubx(ms: u32) -> Vec<u8> {
        let pvt = Pvt {
            time_of_week: ms,
            fix: 3,
            flags: 1,
            latitude: 470_000_001,
            horizontal_accuracy: 1414,
            velocity: [1000, -500, 0],
            ..Pvt::default()
        };
        pvt.emit().to_vec()
    }

    fn nmea(sentence: &str) -> Vec<u8> {
        let sum = sentence.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("${sentence}*{sum:02X}\r\n").into_bytes()
    }

    fn log(bytes: &[u8]) -> Result<Log, Error> {
        let (_dir, path) = file("in.log", bytes);
        read(&path, &|_, _| ())
    }

    /// A recording of rates from this time on.
    fn record(start: f64) -> Record {
        Record {
            time: vec![start, start + 0.01].into(),
            kind: Kind::Rate,
            ..Record::default()
        }
    }

    #[test]
    fn ubx_over_the_end_of_a_week() {
        let bytes: Vec<u8> = (0..20)
            .flat_map(|k| ubx((604_790_000 + 1000 * k) % 604_800_000))
            .collect();
        let log = log(&bytes).unwrap();
        assert_eq!((log.format, log.fixes.len()), (ReceiverFormat::Ubx, 20));
        let times: Vec<f64> = log.fixes.iter().map(|f| f.time).collect();
        assert_eq!(
            (times[0], times[10], times[19]),
            (604_790.0, 604_800.0, 604_809.0)
        );
        let f = log.fixes[3];
        assert!((f.lat_deg - 47.000_000_1).abs() < 1e-12);
        assert!((f.sigmas[0] - 1.0).abs() < 1e-3 && !f.has(2..3) && !f.has(3..6));
        // samples in seconds of week, in UTC, and from 0 with a known origin
        let at = |record: &mut Record, origin| {
            log.clone().beside(record, origin);
            record.fixes[0].time
        };
        assert_eq!(at(&mut record(604_780.0), None), 604_790.0);
        // GPS week 2300 ended on 2024-02-11 at 0 h GPS time, 18 s before in UTC
        let utc = 315_964_800.0 + 2301.0 * 604_800.0 - 18.0 - 10.0;
        assert_eq!(at(&mut record(utc - 3.0), None), utc);
        assert_eq!(at(&mut record(0.0), Some(utc + 5.0)), -5.0);
    }

    #[test]
    fn nmea_is_in_utc_and_read_in_gps_time() {
        // 29 February 2024 is a Thursday
        let bytes: Vec<u8> = (0..30)
            .flat_map(|k| {
                [
                    nmea(&format!(
                        "GNRMC,1235{k:02}.00,A,4730.000,N,00830.000,E,19.438,090.0,290224,,,A"
                    )),
                    nmea(&format!(
                        "GNGGA,1235{k:02}.00,4730.000,N,00830.000,E,1,12,0.8,400.0,M,48.0,M,,"
                    )),
                ]
                .concat()
            })
            .collect();
        let log = log(&bytes).unwrap();
        assert_eq!(log.format, ReceiverFormat::Nmea);
        assert!((29..=30).contains(&log.fixes.len()), "{}", log.fixes.len());
        let last = log.fixes.last().unwrap();
        assert_eq!(
            last.time,
            f64::from(4 * 86_400 + 12 * 3600 + 35 * 60 + 29 + 18)
        );
        assert!((last.lat_deg - 47.5).abs() < 1e-9 && (last.lon_deg - 8.5).abs() < 1e-9);
        assert!((last.height_m - 448.0).abs() < 1e-9);
        assert!(
            (last.velocity[1] - 10.0).abs() < 1e-3,
            "{:?}",
            last.velocity
        );
    }

    #[test]
    fn what_is_no_log_of_a_receiver_is_named() {
        let why = |bytes: &[u8]| message(&log(bytes).unwrap_err());
        let text = why(&[b'x'; 5000]);
        assert!(
            text.starts_with("in.log: 'fixes' has no messages of a receiver"),
            "{text}"
        );
        let bad: Vec<u8> = (0..9)
            .flat_map(|_| nmea("GNGGA,,,,,,0,00,,,M,,M,,"))
            .collect();
        let text = why(&bad);
        assert!(text.contains("Nmea messages and no fix"), "{text}");
        let text = why(&[ubx(50_000), ubx(51_000), ubx(52_000), ubx(1000)].concat());
        assert!(
            text.contains("'Ubx fix message 4' has the time 1.0"),
            "{text}"
        );
    }
}
