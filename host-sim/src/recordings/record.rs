//! A recording as its files hold it: time stamps, samples and fixes to the last bit, before they
//! are resampled. `convert` translates between formats through it, and [`Record::session`] makes it
//! the session of an experiment.

use crate::error::Error;
use crate::inertial::earth::Geodetic;
use crate::inertial::session::{EPOCH_S, Session, to_si};
use crate::inertial::sins::{Increment, NavState};
use crate::inertial::units::DEG;
use crate::recordings::increments::MotionIntegral;
use crate::recordings::session::{InitialAttitude, NOT_MEASURED, Parts, build};
use crate::recordings::track::Track;
use nalgebra::{UnitQuaternion, Vector3};
use std::path::PathBuf;

/// What samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Rates at their times, rad/s and m/s2.
    Rate,
    /// Increments that end at their times, rad and m/s.
    Increment,
}

/// A fix with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedFix {
    /// Time on the IMU's clock, s.
    pub time: f64,
    /// Latitude, deg.
    pub lat_deg: f64,
    /// Longitude, deg.
    pub lon_deg: f64,
    /// Height above the ellipsoid, m.
    pub height_m: f64,
    /// Velocity north, east, down, m/s, if the receiver measures it.
    pub velocity: Option<[f64; 3]>,
    /// Standard deviations north, east, down: of position, m, then of velocity, m/s. The latter
    /// mean nothing without a velocity.
    pub sigmas: [f64; 6],
}

/// A recording as its files hold it.
#[derive(Debug, Clone)]
pub struct Record {
    /// File named in errors.
    pub file: PathBuf,
    /// Times of the samples, s, rising.
    pub time: Vec<f64>,
    /// Samples, body axes forward-right-down.
    pub samples: Vec<Increment>,
    /// What the samples are.
    pub kind: Kind,
    /// Samples per second, to the nearest whole number.
    pub rate_hz: usize,
    /// Fixes at rising times. A single one is the site of a vehicle at rest.
    pub fixes: Vec<TimedFix>,
    /// Attitude at the first fix, if it is known.
    pub initial_attitude: Option<InitialAttitude>,
}

impl Record {
    /// A session as it would have been recorded, from time 0 on.
    #[must_use]
    pub fn from_session(session: &Session) -> Self {
        let fix = |(k, f): (usize, &crate::inertial::gnss::Fix)| TimedFix {
            time: k as f64 * EPOCH_S,
            lat_deg: f.position.lat / DEG,
            lon_deg: f.position.lon / DEG,
            height_m: f.position.h,
            velocity: Some(f.velocity.into()),
            sigmas: session.sigmas,
        };
        let initial_attitude = match session.standstill {
            0 => InitialAttitude::Known(session.reference[0].q_bn),
            s => InitialAttitude::Standstill(s),
        };
        Self {
            file: PathBuf::new(),
            time: (1..=session.counts.len())
                .map(|k| k as f64 * session.dt)
                .collect(),
            samples: session
                .counts
                .iter()
                .map(|c| to_si(c, &session.lsb))
                .collect(),
            kind: Kind::Increment,
            rate_hz: session.samples_per_epoch(),
            fixes: session.fixes.iter().enumerate().map(fix).collect(),
            initial_attitude: Some(initial_attitude),
        }
    }

    /// Increments and the times they end at. Rates are integrated by the trapezoidal rule, so the
    /// first increment begins at the first sample.
    #[must_use]
    pub fn increments(&self) -> (&[f64], Vec<Increment>) {
        if self.kind == Kind::Increment {
            return (&self.time, self.samples.clone());
        }
        let increment = |k: usize| {
            let half = 0.5 * (self.time[k] - self.time[k - 1]);
            let (a, b) = (&self.samples[k - 1], &self.samples[k]);
            Increment {
                dtheta: (a.dtheta + b.dtheta) * half,
                dv: (a.dv + b.dv) * half,
            }
        };
        (
            &self.time[1.min(self.time.len())..],
            (1..self.time.len()).map(increment).collect(),
        )
    }

    /// The session from the first fix within the motion on.
    ///
    /// # Errors
    /// There is no initial attitude or no fix, or the times do not overlap.
    pub fn session(&self) -> Result<Session, Error> {
        let missing = |key: &str, problem: &str, remedy: &str| {
            crate::recordings::session::complain(&self.file, key, problem.to_owned(), remedy)
        };
        let remedy = "give a standstill to align on, or roll, pitch and heading at the first fix";
        let initial_attitude = self
            .initial_attitude
            .ok_or_else(|| missing("start", "is not given", remedy))?;
        if self.fixes.is_empty() {
            let problem = "are not in the recording, nor a site";
            return Err(missing("fixes", problem, "give fixes or the site"));
        }
        let motion = match self.kind {
            Kind::Rate => MotionIntegral::of_rates(&self.time, &self.samples),
            Kind::Increment => {
                MotionIntegral::of_increments(&self.time, &self.samples, median_step(&self.time))
            }
        };
        build(&Parts {
            file: self.file.clone(),
            motion,
            rate_hz: self.rate_hz,
            fixes: self.track(),
            sigmas: self.sigmas(),
            initial_attitude,
        })
    }

    /// Time of the first epoch of [`Record::session`]: the first fix within the motion.
    #[must_use]
    pub fn first_epoch(&self) -> f64 {
        let start = self.time.first().copied().unwrap_or_default();
        let start = match self.kind {
            Kind::Rate => start,
            Kind::Increment => start - median_step(&self.time),
        };
        match self.fixes[..] {
            [] | [_] => start,
            _ => self.track().first_from(start),
        }
    }

    /// Whether all fixes have a velocity.
    #[must_use]
    pub fn has_velocity(&self) -> bool {
        self.fixes.iter().all(|f| f.velocity.is_some())
    }

    fn track(&self) -> Track {
        let state = |f: &TimedFix| NavState {
            position: Geodetic {
                lat: f.lat_deg * DEG,
                lon: f.lon_deg * DEG,
                h: f.height_m,
            },
            velocity: f.velocity.map_or_else(Vector3::zeros, Vector3::from),
            q_bn: UnitQuaternion::identity(),
        };
        let time = self.fixes.iter().map(|f| f.time).collect();
        let mut track = Track::new(time, self.fixes.iter().map(state).collect());
        if !self.has_velocity() {
            track.differentiate();
        }
        track
    }

    /// Standard deviations of the session: the medians over the fixes, and [`NOT_MEASURED`] for
    /// velocities that are computed from positions.
    fn sigmas(&self) -> [f64; 6] {
        std::array::from_fn(|i| {
            if i >= 3 && !self.has_velocity() {
                return NOT_MEASURED;
            }
            let mut all: Vec<f64> = self.fixes.iter().map(|f| f.sigmas[i]).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(NOT_MEASURED)
        })
    }
}

/// Median time between samples, NaN for fewer than two.
pub(crate) fn median_step(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(kind: Kind, velocity: Option<[f64; 3]>) -> Record {
        let fix = |k: usize| TimedFix {
            time: k as f64,
            lat_deg: 45.0 + 1e-5 * k as f64,
            lon_deg: 7.0,
            height_m: 100.0,
            velocity,
            sigmas: [1.0 + k as f64, 2.0, 3.0, 0.1, 0.1, 0.1],
        };
        Record {
            file: "in".into(),
            time: (0..=400).map(|k| 0.01 * f64::from(k)).collect(),
            samples: (0..=400)
                .map(|k| Increment {
                    dtheta: Vector3::new(0.0, 0.0, 0.001 * f64::from(k)),
                    dv: Vector3::new(0.0, 0.0, -0.098),
                })
                .collect(),
            kind,
            rate_hz: 100,
            fixes: (0..5).map(fix).collect(),
            initial_attitude: Some(InitialAttitude::Known(UnitQuaternion::identity())),
        }
    }

    #[test]
    fn rates_become_the_increments_of_a_trapezoid_and_increments_stay() {
        let (rates, increments) = (record(Kind::Rate, None), record(Kind::Increment, None));
        let (time, made) = rates.increments();
        assert_eq!((time.len(), time[0]), (400, 0.01));
        assert!((made[9].dtheta.z - 0.01 * 0.0095).abs() < 1e-15);
        let (time, same) = increments.increments();
        assert_eq!(
            (time, same.len()),
            (&increments.time[..], increments.samples.len())
        );
        assert_eq!(same[9].dtheta, increments.samples[9].dtheta);
    }

    #[test]
    fn a_velocity_that_was_not_measured_has_no_weight() {
        let without = record(Kind::Rate, None).session().unwrap();
        assert_eq!(without.sigmas, [3.0, 2.0, 3.0, 1e3, 1e3, 1e3]);
        assert!((without.fixes[2].velocity.x - 1.11).abs() < 0.01);
        let with = record(Kind::Rate, Some([5.0, 0.0, 0.0])).session().unwrap();
        assert_eq!((with.sigmas[3], with.fixes[2].velocity.x), (0.1, 5.0));
    }

    #[test]
    fn missing_parts_are_named() {
        let mut r = record(Kind::Rate, None);
        r.initial_attitude = None;
        let why = r.session().unwrap_err().to_string();
        assert!(why.starts_with("in: 'start' is not given"), "{why}");
        let mut r = record(Kind::Rate, None);
        r.fixes.clear();
        let why = r.session().unwrap_err().to_string();
        assert!(why.starts_with("in: 'fixes' are not"), "{why}");
    }
}
