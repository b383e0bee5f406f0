//! Builds a session from increments, fixes and an initial attitude, for all formats with time
//! stamps.

use crate::recordings::clocks;
use crate::recordings::gaps::Gap;
use crate::recordings::increments::MotionIntegral;
use crate::recordings::record::TimedFix;
use crate::recordings::table::CUT;
use crate::recordings::track::Track;
use firmware::sample::{Counts, Lsb};
use host_core::error::Error;
use host_core::inertial::counts::{FINE_LSB, rounded};
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::NavState;
use host_core::list::Writer;
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Longest time between two fixes, or between two true states, over which the reference is
/// interpolated, s.
pub(super) const MOST_GAP_S: f64 = 2.5;
/// A fix so little after its epoch still belongs to it, s: receivers' times jitter.
const LATE_S: f64 = 0.05;
/// Times closer than this are the same, s.
pub(super) const SAME_S: f64 = 1e-6;

/// Source of the attitude at the first epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialAttitude {
    /// Self-alignment while the vehicle stands for this many seconds.
    Standstill(usize),
    /// The user gives it.
    Known(UnitQuaternion<f64>),
}

/// Input of [`build`], from the reader of a format.
#[derive(Debug)]
pub(super) struct Parts<'a> {
    /// File named in errors.
    pub(super) file: PathBuf,
    /// Motion, body axes forward-right-down.
    pub(super) motion: MotionIntegral,
    /// Gaps of samples that are too long to bridge.
    pub(super) gaps: Vec<Gap>,
    /// Samples per second of the session.
    pub(super) rate_hz: usize,
    /// Fixes at rising times. A single one means a vehicle at rest.
    pub(super) fixes: &'a [TimedFix],
    /// Reference against which navigators are judged. It may be the fixes themselves.
    pub(super) reference: &'a Track,
    /// From the IMU to the antenna, body axes, m.
    pub(super) lever_arm: Vector3<f64>,
    /// Whether the reference is that of the antenna.
    pub(super) at_antenna: bool,
    /// Attitude at the first epoch.
    pub(super) attitude: Option<InitialAttitude>,
    /// Notes of the reader, which may explain why there is so little.
    pub(super) notes: &'a [String],
}

/// A recording in whole seconds, before its attitude is known.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The recording. Where `missing` says so, its counts only bridge gaps.
    pub session: Session,
    /// Source of its first attitude. `None`: it must be estimated from samples and fixes.
    pub attitude: Option<InitialAttitude>,
    /// Time of the first epoch on the IMU's clock, s.
    pub begin: f64,
    /// Epochs without whole samples.
    pub missing: Vec<Range<usize>>,
    /// Notes for the reader, a sentence each.
    pub notes: Vec<String>,
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
    samples: (Vec<Counts>, Lsb),
    reference: Vec<NavState>,
    sigmas: [f64; 6],
) -> Session {
    let fix = |s: &NavState| Some(Fix::new(s.position, s.velocity, sigmas));
    let fixes = reference.iter().map(fix).collect();
    Session::new(dt, samples, reference, fixes)
}

/// The recording from the first fix within the motion on, in whole seconds. The first reference
/// state has the initial attitude. So have all others of a reference without attitudes, where it is
/// not right.
pub(super) fn build(parts: &Parts<'_>) -> Result<Prepared, Error> {
    let complain = |problem, remedy: &str| complain(&parts.file, "time", problem, remedy);
    let (begin, end) = span(parts);
    let epochs = ((end - begin) / EPOCH_S + SAME_S).max(0.0) as usize;
    if epochs == 0 {
        let (problem, remedy) = too_short(parts, (begin, end));
        return Err(complain(problem, &remedy));
    }
    let (standstill, q_bn) = match parts.attitude {
        Some(InitialAttitude::Standstill(s)) if s >= epochs => {
            let problem = format!("covers {epochs} s, all of it within the standstill of {s} s");
            let remedy = "give a shorter standstill or a longer recording";
            return Err(complain(problem, remedy));
        }
        Some(InitialAttitude::Standstill(s)) => (s, UnitQuaternion::identity()),
        Some(InitialAttitude::Known(q)) => (0, q),
        None => (0, UnitQuaternion::identity()),
    };
    let dt = EPOCH_S / parts.rate_hz as f64;
    let increments = parts.motion.increments(begin, dt, epochs * parts.rate_hz);
    let too_large = |k: usize| {
        let t = begin + (k + 1) as f64 * dt;
        complain(
            format!("{t:.3} s has an increment of more than 2 rad or 20 m/s"),
            "check the units",
        )
    };
    let mut counts = Writer::default();
    rounded(increments, &FINE_LSB).try_for_each(|count| counts.push(count.map_err(too_large)?))?;
    let counts = counts.finish()?;
    let time = |k: usize| begin + k as f64 * EPOCH_S;
    let state = |k: usize| match parts.reference.at(time(k)) {
        state if k > 0 && parts.reference.has_attitude() => state,
        state => NavState { q_bn, ..state },
    };
    let reference: Vec<NavState> = (0..=epochs).map(state).collect();
    let fixes = match parts.fixes {
        [site] => vec![Some(site.at_epoch(0.0)); epochs + 1],
        fixes => assigned(fixes, begin, epochs),
    };
    let bridged = |k: &usize| !parts.reference.covers(time(*k), MOST_GAP_S);
    let unjudged = ranges((0..=epochs).filter(bridged));
    let arm = parts.lever_arm;
    let session = Session {
        standstill,
        unjudged,
        lever_arm: arm,
        reference_arm: arm * f64::from(u8::from(parts.at_antenna)),
        ..Session::new(dt, (counts, FINE_LSB), reference, fixes)
    };
    let missing = lost(&parts.gaps, begin, epochs);
    Ok(Prepared {
        notes: notes(&session, &missing),
        session,
        attitude: parts.attitude,
        begin,
        missing,
    })
}

/// First and last time that is used.
fn span(parts: &Parts<'_>) -> (f64, f64) {
    let (t0, t1) = parts.motion.span();
    let [_, .., last] = parts.fixes else {
        return (t0, t1);
    };
    let judged = parts.reference.span().map_or(f64::MIN, |(_, end)| end);
    let end = t1.min(last.time.max(judged));
    (first_from(parts.fixes, t0), end)
}

/// Why there is no whole second, and the remedy. A file that ends within a line explains it best,
/// then samples that last for less than a second, then times that do not overlap.
fn too_short(parts: &Parts<'_>, (begin, end): (f64, f64)) -> (String, String) {
    let (t0, t1) = parts.motion.span();
    let samples = format!("the samples last from {} to {} s", seconds(t0), seconds(t1));
    if t1 - t0 < EPOCH_S {
        if let Some(cut) = parts.notes.iter().find(|note| note.contains(CUT)) {
            let cut = cut.trim_end_matches('.');
            let problem = format!("has no whole second: {cut}; {samples}");
            return (problem, "give the whole file".to_owned());
        }
        let remedy = "give a longer recording; if this one is longer, its times have another unit";
        return (format!("has no whole second: {samples}"), remedy.to_owned());
    }
    match parts.fixes {
        [first, .., last] if last.time < t0 || first.time > t1 => {
            let fixes = [first.time, last.time];
            let [from, to] = fixes.map(seconds);
            let problem =
                format!("has no whole second: {samples}, the fixes from {from} to {to} s");
            (problem, clocks::apart([t0, t1], fixes))
        }
        _ => {
            let (from, to) = (seconds(begin), seconds(end));
            let problem = format!("has no whole second: {samples}, {from} to {to} s are in use");
            let remedy = "give motion and fixes of the same time, in the same time system";
            (problem, remedy.to_owned())
        }
    }
}

/// A time to a millisecond, without zeros at its end.
fn seconds(t: f64) -> String {
    let text = format!("{t:.3}");
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" | "" => "0".to_owned(),
        text => text.to_owned(),
    }
}

/// The epochs that gaps touch.
fn lost(gaps: &[Gap], begin: f64, epochs: usize) -> Vec<Range<usize>> {
    let within = |t: f64| ((t - begin) / EPOCH_S).clamp(0.0, epochs as f64);
    let touched = gaps.iter().flat_map(|gap| {
        let [from, to] = [
            within(gap.from + SAME_S).floor(),
            within(gap.to - SAME_S).ceil(),
        ];
        from as usize..to as usize
    });
    let mut touched: Vec<usize> = touched.collect();
    touched.dedup();
    ranges(touched.into_iter())
}

/// Notes on missing samples and fixes, a sentence each.
fn notes(session: &Session, missing: &[Range<usize>]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for range in missing {
        out.push(format!(
            "Samples are missing from {} to {} s.",
            range.start, range.end
        ));
    }
    let without = |k: &usize| session.fixes.get(*k).is_some_and(Option::is_none);
    let gaps = ranges((0..session.fixes.len()).filter(without));
    let long = gaps.iter().max_by_key(|gap| gap.len());
    if let Some(long) = long.filter(|gap| gap.len() as f64 * EPOCH_S > MOST_GAP_S) {
        let seconds: usize = gaps.iter().map(Range::len).sum();
        out.push(format!(
            "{seconds} of {} s have no fix, {} of them in one gap from {} s on; nothing is judged \
             there, unless there is a truth.",
            session.epochs(),
            long.len(),
            long.start
        ));
    }
    out
}

/// Time of the first fix at `t` or later, else of the last.
pub(super) fn first_from(fixes: &[TimedFix], t: f64) -> f64 {
    let first = fixes.iter().find(|fix| fix.time >= t - SAME_S);
    first.or(fixes.last()).map_or(t, |fix| fix.time)
}

/// The fix of each epoch: of those since the epoch before, the nearest in time.
fn assigned(fixes: &[TimedFix], begin: f64, epochs: usize) -> Vec<Option<Fix>> {
    let mut of_epoch = vec![None; epochs + 1];
    for fix in fixes {
        let since = (fix.time - begin) / EPOCH_S;
        let epoch = (since - LATE_S).ceil().max(0.0);
        let age = (epoch - since) * EPOCH_S;
        let slot: Option<&mut Option<Fix>> = of_epoch.get_mut(epoch as usize);
        if let Some(slot) = slot.filter(|_| since > -SAME_S) {
            let age = if age.abs() < SAME_S { 0.0 } else { age };
            let nearer = slot.is_none_or(|other| age.abs() < other.age_s.abs());
            if nearer {
                *slot = Some(fix.at_epoch(age));
            }
        }
    }
    of_epoch
}

/// Rising numbers as ranges.
fn ranges(numbers: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for k in numbers {
        match out.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => out.push(k..k + 1),
        }
    }
    out
}
