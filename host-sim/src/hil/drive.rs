//! A simulated drive as the bytes of its sensors: standstill, then road, with a fix of the receiver every second.

use crate::error::Error;
use crate::inertial::earth::Geodetic;
use crate::inertial::gnss::Fix;
use crate::inertial::session::{Session, to_si};
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::ImuSpec;
use crate::simulator::session::{SessionConfig, simulate};
use firmware::sample::Counts;
use firmware::units::{DEGREE, G};
use firmware::wire::novatel::{self, Header, Log};
use firmware::wire::stim300::{self, Cluster, Temperatures};
use firmware::wire::ubx::Pvt;
use firmware::wire::{Format, kvh};

/// Longest record.
const LONGEST: usize = 256;

/// Where a record's bytes arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Sensor line.
    Sensor,
    /// Receiver.
    Gnss,
}

/// STIM300 at 250 Hz, increments, 10 g range.
#[must_use]
pub fn stim300_config() -> stim300::config::Config {
    stim300::config::Config::DEFAULT.with_sample_rate_code(1)
}

/// A piece of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Where its bytes arrive.
    pub input: Input,
    /// When, microseconds from the start.
    pub at_us: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The sensor of a format: rate in Hz; value of a count in rad and m/s.
fn sensor(format: Format) -> (u32, f64, f64) {
    let exponent = |power: i32| 2f64.powi(power);
    match format {
        Format::Stim300 => (250, DEGREE * exponent(-21), exponent(-22)), // increments, 10 g
        Format::Novatel => (200, 1e-9, 2e-8),                            // ISA-100C
        _ => (1000, 1e-9, 1e-7), // KVH has numbers, which the quantisation of a simulated pulse must not show
    }
}

/// A drive: what was simulated, and as bytes.
#[derive(Clone, Debug)]
pub struct Drive {
    /// What the sensor speaks.
    pub format: Format,
    /// Words and fixes in the order of time.
    pub records: Vec<Record>,
    /// What they were made from; words after the last record are in it too.
    pub session: Session,
}

/// Simulates `seconds` (at most 4000), the first ten of them at rest, with the medium laser-gyro IMU behind the words of `format`.
///
/// # Errors
/// A word does not fit into its field.
pub fn drive(format: Format, seconds: u32) -> Result<Drive, Error> {
    drive_from(format, seconds, 10)
}

/// The same, the first `standstill_s` seconds at rest.
///
/// # Errors
/// A word does not fit into its field.
pub fn drive_from(format: Format, seconds: u32, standstill_s: u32) -> Result<Drive, Error> {
    let (rate_hz, rad, mps) = sensor(format);
    let mut imu =
        ImuSpec::preset("medium").ok_or_else(|| Error::unknown("preset", "medium", &["medium"]))?;
    imu.rate_hz = rate_hz;
    imu.gyro.pulse_arcsec = rad / DEGREE * 3600.0;
    imu.accel.pulse_ugs = mps / G * 1e6;
    let standstill_s = f64::from(standstill_s.min(seconds));
    let (session, _) = simulate(&SessionConfig {
        imu: &imu,
        gnss: &GnssSpec::default(),
        start: Geodetic {
            lat: 0.92,
            lon: 0.18,
            h: 300.0,
        },
        heading: 0.7,
        standstill_s,
        drive_s: f64::from(seconds) - standstill_s, // the last manoeuvre may take longer; it is cut off
        segments: None,
        vibration: 1.0,
        unit: 1,
        turn_on: 2,
        drive: 3,
    });
    let mut records = records(format, &session)?;
    records.retain(|record| record.at_us <= seconds * 1_000_000);
    Ok(Drive {
        format,
        records,
        session,
    })
}

/// The word in whose place a STIM300 sends its configuration, as it does when asked with `C`.
const ANSWER: usize = 50;

/// Words and fixes in the order of time; a STIM300 sends its configuration first. A fix is there 100 ms after its second.
fn records(format: Format, session: &Session) -> Result<Vec<Record>, Error> {
    let period_us = (session.dt * 1e6).round() as u32;
    let mut records = Vec::with_capacity(1 + session.counts.len() + session.fixes.len());
    if format == Format::Stim300 {
        records.push(Record {
            input: Input::Sensor,
            at_us: 0,
            bytes: stim300_config().emit().to_vec(),
        });
    }
    for (index, counts) in session.counts.iter().enumerate() {
        records.push(Record {
            input: Input::Sensor,
            at_us: (index as u32 + 1) * period_us,
            bytes: if format == Format::Stim300 && index == ANSWER {
                stim300_config().emit().to_vec()
            } else {
                word(format, session, index, counts)?
            },
        });
    }
    for (second, fix) in session.fixes.iter().enumerate() {
        records.push(Record {
            input: Input::Gnss,
            at_us: second as u32 * 1_000_000 + 100_000,
            bytes: pvt(second as u32, fix).emit().to_vec(),
        });
    }
    records.sort_by_key(|record| record.at_us);
    Ok(records)
}

/// One word in its frame.
fn word(
    format: Format,
    session: &Session,
    index: usize,
    counts: &Counts,
) -> Result<Vec<u8>, Error> {
    let mut buffer = [0; LONGEST];
    let time = (index + 1) as f64 * session.dt;
    let emitted = match format {
        Format::Stim300 => {
            let fits = |word: &i32| (-(1 << 23)..1 << 23).contains(word);
            if !counts.dtheta.iter().chain(&counts.dv).all(fits) {
                return Err(too_large(index));
            }
            let cluster = |words| Cluster { words, status: 0 };
            stim300::Repr {
                contents: stim300_config().contents(),
                gyro: cluster(counts.dtheta),
                accel: cluster(counts.dv),
                incl: Cluster::default(),
                temperatures: [Temperatures::default(); 3],
                extra: (0, 0),
                counter: (index * 8) as u8, // of 2000 Hz
                latency_us: 120,
            }
            .emit(&mut buffer)
        }
        Format::Novatel => novatel::Repr {
            log: Log::Rawimusx,
            header: Header {
                week: 2400,
                millisecond: (time * 1e3) as u32,
                ..Header::default()
            },
            lead: [0, 26, (2400u16 & 0xff) as u8, (2400u16 >> 8) as u8],
            second_of_week: time,
            status: 0,
            gyro: counts.dtheta,
            accel: counts.dv,
        }
        .emit(&mut buffer),
        _ => {
            let si = to_si(counts, &session.lsb);
            kvh::Repr {
                layout: kvh::Layout::A,
                gyro: [0, 1, 2].map(|axis| si.dtheta[axis] as f32),
                accel: [0, 1, 2].map(|axis| (si.dv[axis] / session.dt / G) as f32),
                extra: [0; 4],
                status: 0x77,
                sequence: (index % 128) as u8,
                temperature: 29,
            }
            .emit(&mut buffer)
        }
    };
    let length = emitted.map_err(|_| too_large(index))?;
    Ok(buffer[..length].to_vec())
}

/// A fix as the receiver sends it, its units rounded to the message's.
#[must_use]
pub fn pvt(second: u32, fix: &Fix) -> Pvt {
    let degrees = |radians: f64| (radians / DEGREE * 1e7).round() as i32;
    let velocity = [0, 1, 2].map(|axis| (fix.velocity[axis] * 1e3).round() as i32);
    let height = (fix.position.h * 1e3).round() as i32;
    Pvt {
        time_of_week: second * 1000,
        year: 2026,
        month_to_second: [
            11,
            21,
            (second / 3600 % 24) as u8,
            (second / 60 % 60) as u8,
            (second % 60) as u8,
        ],
        valid: 7,
        time_accuracy: 25,
        fix: 3,
        flags: 1,
        satellites: 14,
        longitude: degrees(fix.position.lon),
        latitude: degrees(fix.position.lat),
        height,
        height_sea: height - 47_000,
        horizontal_accuracy: 1400,
        vertical_accuracy: 1500,
        velocity,
        ground_speed: fix.velocity.xy().norm().mul_add(1e3, 0.5) as i32,
        speed_accuracy: 90,
        pdop: 130,
        ..Pvt::default()
    }
}

fn too_large(index: usize) -> Error {
    Error::Option {
        option: "drive".into(),
        problem: format!("word {index} does not fit into its field"),
        remedy: "choose a calmer drive".into(),
    }
}
