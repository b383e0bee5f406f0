//! Builds a session from increments, fixes and an initial attitude, for all formats with time
//! stamps.

use crate::error::Error;
use crate::inertial::counts::{FINE_LSB, quantise};
use crate::inertial::gnss::Fix;
use crate::inertial::session::{EPOCH_S, Session};
use crate::inertial::sins::NavState;
use crate::recordings::increments::MotionIntegral;
use crate::recordings::track::Track;
use firmware::sample::{Counts, Lsb};
use nalgebra::UnitQuaternion;
use std::path::{Path, PathBuf};

/// Longest time between two fixes that is interpolated, s.
pub(super) const MOST_GAP_S: f64 = 2.5;
/// Standard deviation of a velocity that is computed from positions instead of measured, m/s. It is
/// so large that a filter gives the velocity no weight.
pub(super) const NOT_MEASURED: f64 = 1e3;

/// Where the attitude at the first epoch comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialAttitude {
    /// Self-alignment while the vehicle stands for this many seconds.
    Standstill(usize),
    /// The user gives it.
    Known(UnitQuaternion<f64>),
}

/// What the reader of a format gives.
#[derive(Debug)]
pub(super) struct Parts {
    /// File named in errors.
    pub(super) file: PathBuf,
    /// Motion, body axes forward-right-down.
    pub(super) motion: MotionIntegral,
    /// Samples per second of the session.
    pub(super) rate_hz: usize,
    /// Fixes, whose attitudes are not used. A single one means a vehicle at rest.
    pub(super) fixes: Track,
    /// Standard deviations of the fixes: m, then m/s.
    pub(super) sigmas: [f64; 6],
    /// Attitude at the first epoch.
    pub(super) initial_attitude: InitialAttitude,
}

/// An error about a whole file.
pub(super) fn complain(file: &Path, key: &str, problem: String, remedy: &str) -> Error {
    Error::Scenario {
        file: file.to_path_buf(),
        line: None,
        key: key.to_owned(),
        problem,
        remedy: remedy.to_owned(),
    }
}

/// A session without a standstill, whose fixes are its reference states.
pub(super) fn referenced(
    dt: f64,
    (counts, lsb): (Vec<Counts>, Lsb),
    reference: Vec<NavState>,
    sigmas: [f64; 6],
) -> Session {
    let fix = |s: &NavState| Fix {
        position: s.position,
        velocity: s.velocity,
    };
    Session {
        dt,
        lsb,
        counts,
        standstill: 0,
        fixes: reference.iter().map(fix).collect(),
        reference,
        sigmas,
        systematic: None,
        surroundings: None,
        gather: 1,
    }
}

/// The session from the first fix within the motion on, in whole seconds. Its reference states are
/// the fixes. Their attitude is the initial attitude, which is only right at the first epoch.
pub(super) fn build(parts: &Parts) -> Result<Session, Error> {
    let complain = |problem, remedy| complain(&parts.file, "time", problem, remedy);
    let (t0, t1) = parts.motion.span();
    let (begin, end) = match parts.fixes.span() {
        Some((f0, f1)) if f1 > f0 => (parts.fixes.first_from(t0), t1.min(f1)),
        _ => (t0, t1),
    };
    let epochs = ((end - begin) / EPOCH_S + 1e-6).max(0.0) as usize;
    if epochs == 0 {
        let problem =
            format!("has no whole second: motion {t0} to {t1} s, used {begin} to {end} s");
        return Err(complain(
            problem,
            "give motion and fixes of the same time, in the same time system",
        ));
    }
    let (standstill, q_bn) = match parts.initial_attitude {
        InitialAttitude::Standstill(s) if s >= epochs => {
            let problem = format!("covers {epochs} s, all of it within the standstill of {s} s");
            let remedy = "give a shorter standstill or a longer recording";
            return Err(complain(problem, remedy));
        }
        InitialAttitude::Standstill(s) => (s, UnitQuaternion::identity()),
        InitialAttitude::Known(q) => (0, q),
    };
    let dt = EPOCH_S / parts.rate_hz as f64;
    let increments = parts.motion.increments(begin, dt, epochs * parts.rate_hz);
    let counts = quantise(&increments, &FINE_LSB).map_err(|k| {
        let t = begin + (k + 1) as f64 * dt;
        complain(
            format!("{t:.3} s has an increment of more than 2 rad or 20 m/s"),
            "check the units",
        )
    })?;
    let state = |k: usize| NavState {
        q_bn,
        ..parts.fixes.at(begin + k as f64 * EPOCH_S)
    };
    let reference: Vec<NavState> = (0..=epochs).map(state).collect();
    Ok(Session {
        standstill,
        ..referenced(dt, (counts, FINE_LSB), reference, parts.sigmas)
    })
}
