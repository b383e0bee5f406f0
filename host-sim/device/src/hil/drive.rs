//! A simulated drive as the bytes of its sensors: a standstill, then road, with a fix of the GNSS
//! receiver every second.

use firmware::configuration::{Configuration, Sensor};
use firmware::sample::{Counts, RawSample};
use firmware::units::{DEGREE, G};
use firmware::wire::framer::LONGEST;
use firmware::wire::sequence::{Gap, Last};
use firmware::wire::ubx::Pvt;
use firmware::wire::{Checked, Fields, ImuFormat, Settings, Simulated};
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::Session;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};

/// Line on which the bytes of a record arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The sensor line.
    Sensor,
    /// The receiver line.
    Gnss,
}

/// A piece of a drive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Line on which its bytes arrive.
    pub input: Input,
    /// Time of arrival, microseconds from the start.
    pub at_us: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The simulated sensor of a format: the first that the format names.
#[must_use]
pub fn sensor(format: ImuFormat) -> &'static Simulated {
    &format.simulated()[0]
}

/// A simulated drive.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Format of the sensor.
    pub format: ImuFormat,
    /// Samples and fixes in the order of time.
    pub records: Vec<Record>,
    /// The session they were made from. It may be longer than the records.
    pub session: Session,
}

/// Simulates `seconds` (at most 4000), the first ten of them at rest, with the medium laser-gyro
/// IMU quantised as in `format`.
///
/// # Errors
/// A sample does not fit into its field.
pub fn drive(format: ImuFormat, seconds: u32) -> Result<Drive, Error> {
    drive_from(format, seconds, 10)
}

/// As [`drive`], with the first `standstill_s` seconds at rest.
///
/// # Errors
/// A sample does not fit into its field.
pub fn drive_from(format: ImuFormat, seconds: u32, standstill_s: u32) -> Result<Drive, Error> {
    let sensor = *sensor(format);
    let source = Source::of(sensor);
    drive_with(format, &source, &medium()?, [seconds, standstill_s])
}

/// The medium laser-gyro IMU.
pub(super) fn medium() -> Result<ImuSpec, Error> {
    ImuSpec::preset("medium").ok_or_else(|| Error::unknown("preset", "medium", &["medium"]))
}

/// As [`drive`], with the sensor and the rate of a device's configuration, measured by an IMU with
/// these `errors`. `format` is used where the configuration leaves it open. `seconds` are those of
/// the whole drive and those at rest.
///
/// # Errors
/// The sensor cannot be simulated, or a sample does not fit into its field.
pub fn drive_configured(
    configuration: &Configuration,
    format: ImuFormat,
    errors: &ImuSpec,
    seconds: [u32; 2],
) -> Result<Drive, Error> {
    let format = match &configuration.sensor {
        Some(Sensor::Stream(settings)) => settings.format(),
        Some(Sensor::Spi(_)) => {
            return Err(Error::Option {
                option: "--unit".into(),
                problem: "an ADIS at the board's SPI has no frames that a line can carry".into(),
                remedy: "give a unit whose sensor is at a serial line".into(),
            });
        }
        None => {
            let source = Source::of(*sensor(format));
            return drive_with(format, &source, errors, seconds);
        }
    };
    let source = fitting(format, &configuration.wire_settings())?;
    drive_with(format, &source, errors, seconds)
}

/// A sensor to simulate.
#[derive(Clone, Copy, Debug)]
struct Source {
    sensor: Simulated,
    settings: Settings,
    /// Increment of [`Fields::index`] from frame to frame.
    step: u32,
}

impl Source {
    fn of(sensor: Simulated) -> Source {
        Source {
            sensor,
            settings: sensor.settings(),
            step: 1,
        }
    }
}

/// The simulated sensor of a format whose frames fit these settings. Its rate and the value of a
/// count are those that a device with these settings assumes.
fn fitting(format: ImuFormat, settings: &Settings) -> Result<Source, Error> {
    let own = |sensor: &Simulated| {
        let mut made = Settings::DEFAULT;
        (sensor.settings)(&mut made);
        format.settings(&made) == format.settings(settings)
    };
    let mut sensors: Vec<Simulated> = format.simulated().to_vec();
    sensors.retain(|sensor| sensor.has_accel);
    sensors.sort_by_key(|sensor| !own(sensor));
    for sensor in sensors {
        for step in [1, 2, 4, 8] {
            let source = Source {
                sensor,
                settings: *settings,
                step,
            };
            if let Some((rate, count)) = worth(format, &source)
                && rate.fract() == 0.0
            {
                let sensor = Simulated {
                    rate: rate as u32,
                    count,
                    ..sensor
                };
                return Ok(Source { sensor, ..source });
            }
        }
    }
    Err(Error::Option {
        option: format!("--unit ({})", format.name()),
        problem: "frames of this variant or rate cannot be simulated".into(),
        remedy: "give a unit with increments, rates or averages, at a whole number of hertz".into(),
    })
}

/// Rate of the frames of a simulated sensor, Hz, and the increment of a count of [`Fields`], rad
/// and m/s, for a device with its settings. `None` when the device cannot know it, or would miss
/// frames.
fn worth(format: ImuFormat, source: &Source) -> Option<(f64, [f64; 2])> {
    const PROBE: i32 = 1 << 10;
    let frame = |number: u32, period: f64| {
        let fields = Fields {
            index: number * source.step,
            time: f64::from(number + 1) * period,
            gyro: [PROBE; 3],
            accel: [PROBE; 3],
            rest: source.sensor.rest,
        };
        bytes(0, |buffer| (source.sensor.emit)(&fields, buffer)).ok()
    };
    let stream_of = |bytes: &mut [u8]| {
        let frame = Checked::new(format, bytes).ok()?;
        let stream = frame.source().stream(&source.settings, frame.content())?;
        Some((stream, frame.read().ok()?))
    };
    let (stream, _) = stream_of(&mut frame(0, 0.0)?)?;
    let period = 1.0 / stream.rate;
    let mut last = Last::default();
    let mut sample = None;
    for number in 0..3 {
        let (_, reading) = stream_of(&mut frame(number, period)?)?;
        if stream.gap(&mut last, &reading) != Gap::None {
            return None;
        }
        sample = Some(reading.sample);
    }
    let [gyro, accel] = match sample? {
        RawSample::Counts { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
        RawSample::Floats { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
    };
    let units = [stream.units.gyro, stream.units.accel];
    let [rad, mps] = units.map(|unit| unit.increment(period));
    let probe = f64::from(PROBE);
    Some((stream.rate, [gyro / probe * rad?, accel / probe * mps?]))
}

/// A drive of `seconds`, the second number of them at rest, measured by an IMU with these errors.
fn drive_with(
    format: ImuFormat,
    source: &Source,
    errors: &ImuSpec,
    [seconds, standstill_s]: [u32; 2],
) -> Result<Drive, Error> {
    let Simulated { rate, count, .. } = source.sensor;
    let [rad, mps] = count;
    let mut imu = errors.clone();
    imu.rate_hz = rate;
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
        drive_s: f64::from(seconds) - standstill_s, // a longer last manoeuvre is cut off below
        segments: None,
        vibration: 1.0,
        unit: 1,
        turn_on: 2,
        drive: 3,
    });
    let mut records = records(source, &session)?;
    records.retain(|record| record.at_us <= seconds * 1_000_000);
    Ok(Drive {
        format,
        records,
        session,
    })
}

/// Number of the sample that a sensor replaces by its description, on request.
const ANSWER: usize = 50;

/// Samples and fixes in the order of time. A sensor that describes itself does so first. A fix
/// arrives 100 ms after its second.
fn records(source: &Source, session: &Session) -> Result<Vec<Record>, Error> {
    let period_us = (session.dt * 1e6).round() as u32;
    let mut records = Vec::with_capacity(1 + session.counts.len() + session.fixes.len());
    let introduction = source
        .sensor
        .introduction
        .map(|emit| bytes(0, |buffer| emit(&source.settings, buffer)))
        .transpose()?;
    if let Some(bytes) = &introduction {
        records.push(Record {
            input: Input::Sensor,
            at_us: 0,
            bytes: bytes.clone(),
        });
    }
    for (index, counts) in session.counts.iter().enumerate() {
        records.push(Record {
            input: Input::Sensor,
            at_us: (index as u32 + 1) * period_us,
            bytes: match &introduction {
                Some(bytes) if index == ANSWER => bytes.clone(),
                _ => sample(source, session, index, counts)?,
            },
        });
    }
    for (second, fix) in session.fixes.iter().enumerate() {
        let Some(fix) = fix else { continue };
        records.push(Record {
            input: Input::Gnss,
            at_us: second as u32 * 1_000_000 + 100_000,
            bytes: pvt(second as u32, fix).emit().to_vec(),
        });
    }
    records.sort_by_key(|record| record.at_us);
    Ok(records)
}

/// One sample in its frame.
fn sample(
    source: &Source,
    session: &Session,
    index: usize,
    counts: &Counts,
) -> Result<Vec<u8>, Error> {
    let Source { sensor, step, .. } = source;
    let end = 1i64 << (sensor.bits - 1);
    let fits = |count: &i32| (-end..end).contains(&i64::from(*count));
    if !counts.dtheta.iter().chain(&counts.dv).all(fits) {
        return Err(too_large(index));
    }
    let fields = Fields {
        index: index as u32 * step,
        time: (index + 1) as f64 * session.dt,
        gyro: counts.dtheta,
        accel: counts.dv,
        rest: sensor.rest,
    };
    bytes(index, |buffer| (sensor.emit)(&fields, buffer))
}

/// The bytes that `emit` writes for the sample of this number.
fn bytes<E>(
    index: usize,
    emit: impl FnOnce(&mut [u8]) -> Result<usize, E>,
) -> Result<Vec<u8>, Error> {
    let mut buffer = [0; LONGEST];
    let length = emit(&mut buffer).map_err(|_| too_large(index))?;
    Ok(buffer[..length].to_vec())
}

/// A fix as the receiver sends it, rounded to the units of the message.
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
        problem: format!("sample {index} does not fit into its field"),
        remedy: "choose a calmer drive".into(),
    }
}
