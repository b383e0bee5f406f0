//! A recording as its files hold it: time stamps, samples and fixes to the last bit, before they
//! are resampled. `convert` translates between formats through it, and [`Record::session`] makes it
//! the session of an experiment.

use crate::recordings::gaps;
use crate::recordings::increments::MotionIntegral;
use crate::recordings::pace::Pace;
use crate::recordings::session::{
    InitialAttitude, Parts, Prepared, SAME_S, build, complain, first_from,
};
use crate::recordings::track::Track;
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::gnss::{Fix, has};
use host_core::inertial::session::{EPOCH_S, Session, to_si};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_core::list::{List, median};
use host_core::words::{agrees, counted};
use nalgebra::UnitQuaternion;
use std::ops::Range;
use std::path::PathBuf;

pub use host_core::inertial::gnss::NOT_MEASURED;

/// A rate over the whole time that differs by more than this share is noted.
const CONTRADICTS: f64 = 0.005;

/// Kind of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Rates at their times, rad/s and m/s2.
    Rate,
    /// Increments that end at their times, rad and m/s.
    Increment,
}

/// A fix with its time. It may lack any of its values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedFix {
    /// Time of validity on the IMU's clock, s.
    pub time: f64,
    /// Latitude, deg.
    pub lat_deg: f64,
    /// Longitude, deg.
    pub lon_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
    /// Velocity north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Standard deviations north, east, down: of position, m, then of velocity, m/s. Each is above
    /// 0, and [`NOT_MEASURED`] for a value that the fix does not have.
    pub sigmas: [f64; 6],
}

impl TimedFix {
    /// A fix without any value.
    pub const EMPTY: Self = Self {
        time: 0.0,
        lat_deg: 0.0,
        lon_deg: 0.0,
        height_m: 0.0,
        velocity: [0.0; 3],
        sigmas: [NOT_MEASURED; 6],
    };

    /// A fix that arrived at `time` s, at its own time of validity.
    #[must_use]
    pub fn arrived(time: f64, fix: &Fix) -> Self {
        Self {
            time: time - fix.age_s,
            lat_deg: fix.position.lat / DEG,
            lon_deg: fix.position.lon / DEG,
            height_m: fix.position.h,
            velocity: fix.velocity.into(),
            sigmas: fix.sigmas,
        }
    }

    /// Whether all these values (0 to 2 position, 3 to 5 velocity) are measured.
    #[must_use]
    pub fn has(&self, values: Range<usize>) -> bool {
        has(&self.sigmas, values)
    }

    /// Whether it has a latitude and a longitude.
    #[must_use]
    pub fn has_position(&self) -> bool {
        self.has(0..2)
    }

    /// The velocity, if all of it is measured.
    #[must_use]
    pub fn measured_velocity(&self) -> Option<[f64; 3]> {
        self.has(3..6).then_some(self.velocity)
    }

    /// The fix of an epoch, `age_s` before which it was valid.
    pub(super) fn at_epoch(&self, age_s: f64) -> Fix {
        Fix {
            age_s,
            ..Fix::new(self.position(), self.velocity.into(), self.sigmas)
        }
    }

    /// Its position.
    #[must_use]
    pub fn position(&self) -> Geodetic {
        Geodetic {
            lat: self.lat_deg * DEG,
            lon: self.lon_deg * DEG,
            h: self.height_m,
        }
    }
}

/// A recording as its files hold it.
#[derive(Debug, Clone)]
pub struct Record {
    /// File named in errors.
    pub file: PathBuf,
    /// Times of the samples, s, rising.
    pub time: List<f64>,
    /// Samples, body axes forward-right-down.
    pub samples: List<Increment>,
    /// Whether they are rates or increments.
    pub kind: Kind,
    /// Samples per second, to the nearest whole number.
    pub rate_hz: usize,
    /// Fixes at rising times. A single one is the site of a vehicle at rest.
    pub fixes: Vec<TimedFix>,
    /// Speed of the wheels, m/s, at rising times on the IMU's clock, s.
    pub wheels: Vec<[f64; 2]>,
    /// From the IMU to the antenna: forward, right, down, m, if the recording states it.
    pub lever_arm_m: Option<[f64; 3]>,
    /// Attitude at the first fix, if it is known.
    pub initial_attitude: Option<InitialAttitude>,
    /// Heading at the first fix and its standard deviation, rad, if no more of the attitude is
    /// known than that.
    pub rough_heading: Option<[f64; 2]>,
    /// Longest step between rates that is interpolated, s. Three samples or 0.1 s by default.
    pub max_gap_s: Option<f64>,
    /// Offset that was added to the times of the fixes to give the IMU's, s, if one was given.
    pub given_offset_s: Option<f64>,
    /// Whether that offset is to be estimated from the data.
    pub estimates_offset: bool,
    /// True states of the IMU, if the recording has better ones than its fixes.
    pub truth: Option<Track>,
    /// What was left out or changed when it was read, a sentence each.
    pub notes: Vec<String>,
}

impl Default for Record {
    /// An empty recording of increments.
    fn default() -> Self {
        Self {
            file: PathBuf::new(),
            time: List::default(),
            samples: List::default(),
            kind: Kind::Increment,
            rate_hz: 0,
            fixes: Vec::new(),
            wheels: Vec::new(),
            lever_arm_m: None,
            initial_attitude: None,
            rough_heading: None,
            max_gap_s: None,
            given_offset_s: None,
            estimates_offset: false,
            truth: None,
            notes: Vec::new(),
        }
    }
}

impl Record {
    /// A session as it would have been recorded, from time 0 on.
    #[must_use]
    pub fn from_session(session: &Session) -> Self {
        let fix = |(k, f): (usize, &Option<Fix>)| {
            Some(TimedFix::arrived(k as f64 * EPOCH_S, f.as_ref()?))
        };
        let speeds = session.wheels.iter().flatten().enumerate();
        let speeds = speeds.filter_map(|(k, speed)| Some((k, (*speed)?)));
        let initial_attitude = match session.standstill {
            0 => InitialAttitude::Known(session.reference[0].q_bn),
            s => InitialAttitude::Standstill(s),
        };
        Self {
            time: (1..=session.counts.len())
                .map(|k| k as f64 * session.dt)
                .collect(),
            samples: session
                .counts
                .each()
                .map(|c| to_si(&c, &session.lsb))
                .collect(),
            rate_hz: session.samples_per_epoch(),
            fixes: session.fixes.iter().enumerate().filter_map(fix).collect(),
            wheels: speeds.map(|(k, v)| [k as f64 * EPOCH_S, v]).collect(),
            lever_arm_m: Some(session.lever_arm.into()).filter(|arm| *arm != [0.0; 3]),
            initial_attitude: Some(initial_attitude),
            ..Self::default()
        }
    }

    /// Whether all times and samples could be read from their temporary files, if they are there.
    ///
    /// # Errors
    /// What the system says.
    pub fn check(&self) -> Result<(), Error> {
        self.time.check().and(self.samples.check())
    }

    /// Increments, each with the time it ends at. Rates are integrated by the trapezoidal rule, so
    /// the first increment begins at the first sample.
    pub fn increments(&self) -> impl Iterator<Item = (f64, Increment)> {
        let kind = self.kind;
        let mut all = self.time.each().zip(self.samples.each());
        let mut before = match kind {
            Kind::Increment => None,
            Kind::Rate => all.next(),
        };
        all.map(move |(now, b)| {
            let Some((then, a)) = before.filter(|_| kind == Kind::Rate) else {
                return (now, b);
            };
            before = Some((now, b));
            let half = 0.5 * (now - then);
            let increment = Increment {
                dtheta: (a.dtheta + b.dtheta) * half,
                dv: (a.dv + b.dv) * half,
            };
            (now, increment)
        })
    }

    /// [`Record::increments`] for a file of increments: where rates are missing for too long to be
    /// bridged, there is no increment, so that a reader of the file sees the gap. Across a shorter
    /// gap the increment is split into equal ones of about the usual length.
    pub fn written_increments(&self) -> impl Iterator<Item = (f64, Increment)> {
        let mut before = self.time.start().unwrap_or_default();
        let mut parts = Vec::new();
        if self.kind == Kind::Rate {
            let pace = Pace::of(&self.time);
            let gaps = gaps::gaps(&self.time, self.kind, &pace);
            let long = gaps::long(&gaps, self.kind, pace.step, self.max_gap_s);
            parts.extend(gaps.iter().map(|gap| match long.contains(gap) {
                true => (gap.to, 0),
                false => (gap.to, (gap.length / pace.step).round() as usize),
            }));
        }
        let mut parts = parts.into_iter().peekable();
        self.increments().flat_map(move |(now, whole)| {
            let count = parts.next_if(|(to, _)| *to == now).map_or(1, |(_, n)| n);
            let from = std::mem::replace(&mut before, now);
            let part = Increment {
                dtheta: whole.dtheta / count as f64,
                dv: whole.dv / count as f64,
            };
            let end = move |k| match k == count {
                true => now,
                false => from + (now - from) * k as f64 / count as f64,
            };
            (1..=count).map(move |k| (end(k), part))
        })
    }

    /// The session from the first fix within the motion on, for a recording that is whole and
    /// whose attitude is known.
    ///
    /// # Errors
    /// As [`Record::prepare`]; there is no initial attitude, or samples are missing.
    pub fn session(&self) -> Result<Session, Error> {
        let Prepared {
            session,
            attitude,
            missing,
            ..
        } = self.prepare()?;
        let remedy = "give a standstill to align on, or roll, pitch and heading at the first fix";
        match missing.first() {
            _ if attitude.is_none() => Err(self.complain("start", "is not given", remedy)),
            Some(range) => {
                let problem = format!("lack from {} to {} s", range.start, range.end);
                Err(self.complain("samples", &problem, "cut the recording there"))
            }
            None => Ok(session),
        }
    }

    /// The recording in whole seconds, from the first fix within the motion on.
    ///
    /// # Errors
    /// There is no fix with a position or only one sample, or the times do not overlap.
    pub fn prepare(&self) -> Result<Prepared, Error> {
        if !self.fixes.iter().any(TimedFix::has_position) {
            let problem = "are not in the recording with a position, nor a site";
            return Err(self.complain("fixes", problem, "give fixes or the site"));
        }
        if self.samples.len() < 2 || self.samples.len() != self.time.len() {
            let remedy = "give at least one second of samples";
            return Err(self.complain("samples", "are fewer than two", remedy));
        }
        let pace = Pace::of(&self.time);
        let (step, gaps) = (pace.step, gaps::gaps(&self.time, self.kind, &pace));
        let long = gaps::long(&gaps, self.kind, step, self.max_gap_s);
        let motion = match self.kind {
            Kind::Rate => MotionIntegral::of_rates(&self.time, &self.samples),
            Kind::Increment if gaps.is_empty() => {
                MotionIntegral::of_increments(&self.time, &self.samples, step)
            }
            Kind::Increment => {
                let (time, samples) = gaps::bridged(&self.time, &self.samples, &gaps, step)?;
                MotionIntegral::of_increments(time, samples, step)
            }
        };
        let of_fixes;
        let truth = self.truth.as_ref().filter(|truth| truth.span().is_some());
        let reference = match truth {
            Some(truth) => truth,
            None => {
                of_fixes = track(&self.fixes);
                &of_fixes
            }
        };
        let mut prepared = build(&Parts {
            file: self.file.clone(),
            motion,
            rate_hz: self.rate_hz,
            fixes: &self.fixes,
            reference,
            lever_arm: self.lever_arm_m.unwrap_or_default().into(),
            at_antenna: truth.is_none(),
            attitude: self.initial_attitude,
            gaps: long.clone(),
            notes: &self.notes,
        })?;
        if !self.wheels.is_empty() {
            let epochs = prepared.session.fixes.len();
            let speed = |k: usize| speed_at(&self.wheels, prepared.begin + k as f64 * EPOCH_S);
            prepared.session.wheels = Some((0..epochs).map(speed).collect());
        }
        let short = gaps.len() - long.len();
        if short > 0 {
            let bridged = gaps.iter().filter(|gap| !long.contains(gap));
            let longest = bridged.map(|gap| gap.length).fold(0.0, f64::max);
            let note = format!(
                "{} of samples, of at most {longest:.3} s, {} bridged.",
                counted(short, "gap"),
                agrees(short, "is", "are")
            );
            prepared.notes.insert(0, note);
        }
        prepared.notes.extend(self.contradiction(&pace, &long));
        let outside = self.fixes_outside();
        if outside > 0 {
            let all = self.fixes.len();
            let note = format!(
                "{outside} of {} {} outside the time of the samples.",
                counted(all, "fix"),
                agrees(outside, "is", "are")
            );
            prepared.notes.push(note);
        }
        prepared.notes.extend(self.notes.iter().cloned());
        self.check()?;
        Ok(prepared)
    }

    /// A note where the samples over the whole time are others than the rate says, without long
    /// gaps.
    fn contradiction(&self, pace: &Pace, long: &[gaps::Gap]) -> Option<String> {
        let ends = self.time.end().zip(self.time.start());
        let seconds = ends.map_or(f64::NAN, |(end, start)| end - start);
        let lost: f64 = long.iter().map(|gap| gap.length).sum();
        let rate = (self.time.len() as f64 - 1.0) / (seconds - lost);
        ((rate * pace.step - 1.0).abs() > CONTRADICTS).then(|| {
            format!(
                "There are {rate:.1} samples a second, and their steps say {:.1}: samples are \
                 missing, or the time stamps are rounded (then write them with more digits).",
                1.0 / pace.step
            )
        })
    }

    fn complain(&self, key: &str, problem: &str, remedy: &str) -> Error {
        complain(&self.file, key, problem.to_owned(), remedy)
    }

    /// Adds `seconds` to the times of the fixes, and of the truth, which shares their clock.
    pub fn move_fixes(&mut self, seconds: f64) {
        self.fixes.iter_mut().for_each(|fix| fix.time += seconds);
        self.truth = self.truth.take().map(|truth| truth.shifted(seconds));
    }

    /// Time of the first epoch of [`Record::session`]: the first fix within the motion.
    #[must_use]
    pub fn first_epoch(&self) -> f64 {
        let start = self.time.start().unwrap_or_default();
        let start = match self.kind {
            Kind::Rate => start,
            Kind::Increment => start - Pace::of(&self.time).step,
        };
        match self.fixes[..] {
            [] | [_] => start,
            _ => first_from(&self.fixes, start),
        }
    }

    /// Number of fixes more than two samples outside the time of the samples.
    #[must_use]
    pub fn fixes_outside(&self) -> usize {
        let (Some(start), Some(end)) = (self.time.start(), self.time.end()) else {
            return self.fixes.len();
        };
        let near = 2.5 * median_step(&self.time).max(SAME_S);
        let inside = |fix: &&TimedFix| (start - near..=end + near).contains(&fix.time);
        match self.fixes.len() {
            1 => 0, // the site of a vehicle at rest
            all => all - self.fixes.iter().filter(inside).count(),
        }
    }

    /// Whether all fixes have a whole velocity.
    #[must_use]
    pub fn has_velocity(&self) -> bool {
        self.fixes.iter().all(|f| f.has(3..6))
    }
}

/// The speed of the wheels at a time, between two reports that are no further apart than an epoch.
fn speed_at(wheels: &[[f64; 2]], time: f64) -> Option<f64> {
    let after = wheels.partition_point(|[t, _]| *t < time - SAME_S);
    let [t1, v1] = *wheels.get(after)?;
    if t1 <= time + SAME_S {
        return Some(v1);
    }
    let [t0, v0] = *wheels.get(after.checked_sub(1)?)?;
    (t1 - t0 <= EPOCH_S + SAME_S).then(|| v0 + (v1 - v0) * (time - t0) / (t1 - t0))
}

/// States from the fixes with a position. Velocities that they lack are computed from the
/// neighbours; heights, those of the fix before, or of the first that has one.
pub(super) fn track(fixes: &[TimedFix]) -> Track {
    let placed = || fixes.iter().filter(|f| f.has_position());
    let mut height = placed().find(|f| f.has(2..3)).map_or(0.0, |f| f.height_m);
    let mut state = |f: &TimedFix| {
        if f.has(2..3) {
            height = f.height_m;
        }
        NavState {
            position: Geodetic {
                h: height,
                ..f.position()
            },
            velocity: f.velocity.into(),
            q_bn: UnitQuaternion::identity(),
        }
    };
    let states = placed().map(&mut state).collect();
    let mut track = Track::new(placed().map(|f| f.time).collect(), states).without_attitude();
    let measured: Vec<[bool; 3]> = placed()
        .map(|f| [3, 4, 5].map(|i| f.has(i..i + 1)))
        .collect();
    track.differentiate(&measured);
    track
}

/// Median time between samples, NaN for fewer than two.
pub fn median_step(time: &List<f64>) -> f64 {
    median(|| gaps::pairs(time).map(|[before, now]| now - before))
}

#[cfg(test)]
mod tests;
