//! From increments, fixes and a beginning to a session: the part that all formats with time stamps share.

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

/// Longest time between two fixes that is bridged by a straight line, s.
pub(super) const MOST_GAP_S: f64 = 2.5;
/// Standard deviation of a velocity that was not measured but taken from positions: so large that no filter listens, m/s.
pub(super) const NOT_MEASURED: f64 = 1e3;

/// How navigation can begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialAttitude {
    /// The vehicle stands for so many seconds and is aligned.
    Standstill(usize),
    /// The attitude at the first epoch is known.
    Known(UnitQuaternion<f64>),
}

/// What a format's reader hands over.
#[derive(Debug)]
pub(super) struct Parts {
    /// File to name in complaints.
    pub(super) file: PathBuf,
    /// Motion, body axes forward-right-down.
    pub(super) running: MotionIntegral,
    /// Words a second.
    pub(super) rate_hz: usize,
    /// Fixes; attitudes do not count. One alone means a vehicle at rest.
    pub(super) fixes: Track,
    /// Their noise.
    pub(super) sigmas: [f64; 6],
    /// Beginning.
    pub(super) initial_attitude: InitialAttitude,
}

/// A complaint about a whole file.
pub(super) fn complain(file: &Path, key: &str, problem: String, remedy: &str) -> Error {
    Error::Scenario {
        file: file.to_path_buf(),
        line: None,
        key: key.to_owned(),
        problem,
        remedy: remedy.to_owned(),
    }
}

/// A session whose reference is its own fixes, without a standstill.
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

/// The session from the first fix on that lies within the motion, in whole seconds. The reference is the fixes themselves; its attitude
/// is the one of the beginning and means nothing later.
pub(super) fn build(parts: &Parts) -> Result<Session, Error> {
    let complain = |problem, remedy| complain(&parts.file, "time", problem, remedy);
    let (t0, t1) = parts.running.span();
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
    let words = parts.running.increments(begin, dt, epochs * parts.rate_hz);
    let counts = quantise(&words, &FINE_LSB).map_err(|k| {
        let t = begin + (k + 1) as f64 * dt;
        complain(
            format!("{t:.3} s has a word of more than 2 rad or 20 m/s"),
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
