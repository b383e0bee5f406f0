//! Samples and fixes with time stamps in ns, checked one by one; shared by all readers of recorded
//! messages.

use crate::recordings::nowhere::{LeftOut, is_nowhere};
use crate::recordings::pace::Pace;
use crate::recordings::record::{Kind, Record, TimedFix};
use crate::recordings::session::complain;
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use host_core::list::Writer;
use host_core::words::{agrees, counted};
use nalgebra::{Rotation3, Vector3};
use std::path::{Path, PathBuf};

/// Limits of plausible samples: 2000 deg/s in rad/s, and 100 g in m/s2.
const LIMITS: [f64; 2] = [35.0, 1000.0];
/// Standard deviations where a receiver gives none (assumed): m, then m/s.
pub(super) const USUAL_SIGMAS: [f64; 6] = [1.0, 1.0, 1.5, 0.05, 0.05, 0.05];

/// Remedy for a stream that is damaged at one point.
const CUT: &str = "cut the recording there and give the longer part";

/// Result of a reader.
#[derive(Debug, Clone)]
pub struct Reading {
    /// The recording.
    pub record: Record,
    /// Notes for the user, a sentence each.
    pub notes: Vec<String>,
    /// UTC at time 0 of the recording, s since 1970, if it is known.
    pub origin_s: Option<f64>,
}

/// Location in a recording, for errors.
#[derive(Debug, Clone)]
pub(super) struct Location {
    /// File.
    pub(super) file: PathBuf,
    /// The stream of messages, for example the name of a topic.
    pub(super) stream: String,
    /// Remedy for a time that does not rise.
    pub(super) back: &'static str,
}

impl Location {
    pub(super) fn new(file: &Path, stream: impl Into<String>) -> Self {
        Self {
            file: file.to_path_buf(),
            stream: stream.into(),
            back: CUT,
        }
    }

    /// A note on the messages.
    pub(super) fn note(&self, text: &str) -> String {
        format!("{}: {}: {text}", self.file.display(), self.stream)
    }

    /// An error in message `k`, counted from 0.
    pub(super) fn complain(&self, k: usize, problem: String, remedy: &str) -> Error {
        let key = format!("{} message {}", self.stream, k + 1);
        complain(&self.file, &key, problem, remedy)
    }
}

/// Samples of an IMU with their times.
#[derive(Debug)]
pub(super) struct Samples {
    location: Location,
    kind: Kind,
    /// Stamps of the first and of the last one.
    ends: Option<[i64; 2]>,
    /// Messages so far, and those of them with numbers that are not finite.
    count: usize,
    without: usize,
    /// Since the first one, s.
    time: Writer<f64>,
    values: Writer<Increment>,
}

impl Samples {
    pub(super) fn new(location: Location, kind: Kind) -> Self {
        Self {
            location,
            kind,
            ends: None,
            count: 0,
            without: 0,
            time: Writer::default(),
            values: Writer::default(),
        }
    }

    /// Takes a sample: gyros and accelerometers in body axes forward-right-down, rates in rad/s and
    /// m/s2, or increments in rad and m/s over the time `length`, s.
    ///
    /// # Errors
    /// A value is not plausible, or the time does not rise; a long recording needs temporary files,
    /// and they cannot be written. A sample that is not finite is missing, not a fault.
    pub(super) fn push(&mut self, ns: i64, sample: Increment, length: f64) -> Result<(), Error> {
        let k = self.count;
        self.count += 1;
        let scale = match self.kind {
            Kind::Rate => 1.0,
            Kind::Increment => length,
        };
        if !(sample
            .dtheta
            .iter()
            .chain(&sample.dv)
            .all(|x| x.is_finite())
            && scale.is_finite())
        {
            self.without += 1;
            return Ok(());
        }
        let largest = [sample.dtheta, sample.dv].map(|v| v.abs().max() / scale);
        if largest[0] > LIMITS[0] || largest[1] > LIMITS[1] {
            let [rate, force] = largest;
            let problem = format!("has {rate:.1} rad/s and {force:.1} m/s2");
            let remedy = "check that the driver sends rad/s and m/s2; the limits are 35 and 1000";
            return Err(self.location.complain(k, problem, remedy));
        }
        let [first, before] = self.ends.unwrap_or([ns, ns.saturating_sub(1)]);
        if before >= ns {
            let problem = format!("has the time {} after {}", seconds(ns), seconds(before));
            return Err(self.location.complain(k, problem, self.location.back));
        }
        self.ends = Some([first, ns]);
        self.time.push(since(first, ns))?;
        self.values.push(sample)
    }

    /// Time of the first sample, s on the clock of the stamps.
    pub(super) fn origin_s(&self) -> Option<f64> {
        Some(self.origin_ns()? as f64 / 1e9)
    }

    /// Stamp of the first sample, ns.
    pub(super) fn origin_ns(&self) -> Option<i64> {
        self.ends.map(|[first, _]| first)
    }

    /// The record with these fixes, from time 0 at the first sample on.
    ///
    /// # Errors
    /// There are too few or too many samples in a second; a temporary file cannot be written.
    pub(super) fn record(
        self,
        file: &Path,
        max_gap_s: Option<f64>,
        fixes: &[(i64, TimedFix)],
    ) -> Result<Record, Error> {
        let Some([origin, _]) = self.ends.filter(|_| self.time.len() > 1) else {
            let problem = match (self.count, self.without) {
                (0, _) => "is empty".to_owned(),
                (1, 0) => "has one sample".to_owned(),
                (all, bad) => format!("has {}, {bad} of them not finite", counted(all, "sample")),
            };
            return Err(complain(
                file,
                &self.location.stream,
                problem,
                "give a recording with samples of an IMU",
            ));
        };
        let time = self.time.finish()?;
        let step = Pace::of(&time).step;
        let rate_hz = (1.0 / step).round();
        if !(4.0..=8000.0).contains(&rate_hz) {
            let problem = format!(
                "has {} with a median step of {step} s",
                counted(time.len(), "sample")
            );
            let remedy = "give a recording with 4 to 8000 samples a second";
            return Err(complain(file, &self.location.stream, problem, remedy));
        }
        let note = (self.without > 0).then(|| {
            self.location.note(&format!(
                "{} {} not finite (nan) and {} as missing",
                counted(self.without, "sample"),
                agrees(self.without, "is", "are"),
                agrees(self.without, "counts", "count")
            ))
        });
        let timed = |(ns, fix): &(i64, TimedFix)| TimedFix {
            time: since(origin, *ns),
            ..*fix
        };
        Ok(Record {
            file: file.to_path_buf(),
            time,
            samples: self.values.finish()?,
            kind: self.kind,
            rate_hz: rate_hz as usize,
            fixes: fixes.iter().map(timed).collect(),
            max_gap_s,
            notes: note.into_iter().collect(),
            ..Record::default()
        })
    }
}

/// Seconds from one stamp to another.
fn since(origin: i64, ns: i64) -> f64 {
    ns.saturating_sub(origin) as f64 / 1e9
}

/// A time stamp in s, with all digits.
pub(super) fn seconds(ns: i64) -> String {
    let sign = if ns < 0 { "-" } else { "" };
    let ns = ns.unsigned_abs();
    format!("{sign}{}.{:09} s", ns / 1_000_000_000, ns % 1_000_000_000)
}

/// Fixes of a receiver, checked.
#[derive(Debug, Clone)]
pub(super) struct Fixes {
    location: Location,
    left_out: LeftOut,
    /// Each with its time on the clock of the samples, ns.
    pub(super) all: Vec<(i64, TimedFix)>,
}

impl Fixes {
    pub(super) fn new(location: Location) -> Self {
        Self {
            location,
            left_out: LeftOut::default(),
            all: Vec::new(),
        }
    }

    /// Counts a message that holds no fix.
    pub(super) fn leave_out(&mut self, reason: &str, ns: i64) {
        self.left_out.count(reason, ns as f64 * 1e-9);
    }

    /// Notes on what was left out, each with its reason.
    pub(super) fn left_out(&self) -> Vec<String> {
        self.left_out.notes(&self.location.note("fixes"))
    }

    /// Takes the fix of message `k`, counted from 0, which was valid at `ns`. One at latitude and
    /// longitude 0 or nan is left out.
    ///
    /// # Errors
    /// It is not on Earth, is at a pole, or its time does not rise.
    pub(super) fn push(&mut self, k: usize, ns: i64, fix: TimedFix) -> Result<(), Error> {
        let (lat, lon, h) = (fix.lat_deg, fix.lon_deg, fix.height_m);
        if fix.has_position() && is_nowhere(lat, lon) {
            self.leave_out(
                "latitude and longitude are 0 or nan, as before the first fix",
                ns,
            );
            return Ok(());
        }
        if !(lat.abs() < 89.9 && lon.abs() <= 360.0 && h.abs() < 20_000.0) {
            let problem = format!("has the position {lat}, {lon}, {h}");
            let remedy = "give degrees and metres above the ellipsoid, not at a pole";
            return Err(self.location.complain(k, problem, remedy));
        }
        if !fix.velocity.iter().all(|v| v.abs() < 1000.0) {
            let problem = format!("has the velocity {:?}", fix.velocity);
            let remedy = "give finite velocities in m/s";
            return Err(self.location.complain(k, problem, remedy));
        }
        if let Some(before) = self.all.last().filter(|(before, _)| *before >= ns) {
            let problem = format!("has the time {} after {}", seconds(ns), seconds(before.0));
            return Err(self.location.complain(k, problem, self.location.back));
        }
        self.all.push((ns, fix));
        Ok(())
    }

    /// A note on these fixes.
    pub(super) fn note(&self, text: &str) -> String {
        self.location.note(text)
    }
}

/// A sample in axes of the sensor, turned into forward-right-down.
pub(super) fn turned(mounting: &Rotation3<f64>, gyro: [f64; 3], accel: [f64; 3]) -> Increment {
    Increment {
        dtheta: mounting * Vector3::from(gyro),
        dv: mounting * Vector3::from(accel),
    }
}
