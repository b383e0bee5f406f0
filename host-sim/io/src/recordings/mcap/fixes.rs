//! `NavSatFix` messages and the velocities beside them as fixes.

use super::cdr::{NavSatFix, Twist};
use super::topics::Timed;
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::stamped::{Fixes, Location, USUAL_SIGMAS};
use host_core::error::Error;
use host_core::words::{agrees, counted};

/// Largest difference between the stamps of a velocity and its fix, ns. Drivers of receivers give
/// both the same stamp, or stamp both when they arrive.
const BESIDE_NS: u64 = 20_000_000;

/// Velocities at rising times.
pub(super) struct Velocities<'a>(Vec<(i64, &'a Twist)>);

impl<'a> Velocities<'a> {
    pub(super) fn new(twists: &'a Timed<Twist>, time: &impl Fn(i64, i64) -> i64) -> Self {
        let mut all: Vec<(i64, &Twist)> = twists
            .iter()
            .map(|(log, t)| (time(*log, t.stamp), t))
            .collect();
        all.sort_by_key(|(ns, _)| *ns);
        Self(all)
    }

    /// The velocity nearest to a fix, north, east, down, with its standard deviations.
    fn beside(&self, ns: i64) -> Option<([f64; 3], [f64; 3])> {
        let next = self.0.partition_point(|(t, _)| *t < ns);
        let near = &self.0[next.saturating_sub(1)..(next + 1).min(self.0.len())];
        let (at, twist) = near.iter().min_by_key(|(t, _)| t.abs_diff(ns))?;
        if at.abs_diff(ns) > BESIDE_NS {
            return None;
        }
        let [east, north, up] = twist.velocity;
        let [e, n, u] = twist.variance.unwrap_or_default();
        let [.., s_n, s_e, s_d] = USUAL_SIGMAS;
        Some(([north, east, -up], sigmas([n, e, u], [s_n, s_e, s_d])))
    }
}

/// Standard deviations of these variances, or the usual ones where one is not above 0.
fn sigmas(variances: [f64; 3], usual: [f64; 3]) -> [f64; 3] {
    let known = variances.iter().all(|v| v.is_finite() && *v > 0.0);
    if known {
        variances.map(f64::sqrt)
    } else {
        usual
    }
}

/// The fixes of all messages with one.
///
/// # Errors
/// A fix is not on Earth, or times do not rise.
pub(super) fn collect(
    location: Location,
    messages: &Timed<NavSatFix>,
    velocities: &Velocities<'_>,
    time: &impl Fn(i64, i64) -> i64,
    notes: &mut Vec<String>,
) -> Result<Fixes, Error> {
    let mut fixes = Fixes::new(location);
    let (mut unknown, mut alone) = (0, 0);
    for (k, (log, m)) in messages.iter().enumerate() {
        let ns = time(*log, m.stamp);
        if m.status < 0 {
            fixes.leave_out(&format!("their status is {} (STATUS_NO_FIX)", m.status), ns);
            continue;
        }
        let beside = velocities.beside(ns);
        unknown += usize::from(m.variance_kind == 0);
        alone += usize::from(beside.is_none());
        fixes.push(k, ns, fix(m, beside))?;
    }
    if unknown > 0 {
        notes.push(fixes.note(&format!(
            "{} without a stated accuracy {} as good to 1 m, 1.5 m in height",
            counted(unknown, "fix"),
            agrees(unknown, "counts", "count")
        )));
    }
    if !velocities.0.is_empty() && alone > 0 {
        notes.push(fixes.note(&format!(
            "{} {} no velocity within 20 ms",
            counted(alone, "fix"),
            agrees(alone, "has", "have")
        )));
    }
    Ok(fixes)
}

fn fix(m: &NavSatFix, beside: Option<([f64; 3], [f64; 3])>) -> TimedFix {
    let [lat, lon, h] = m.position;
    let [east, north, up] = m.variance;
    let variances = match m.variance_kind {
        0 => [0.0; 3],
        _ => [north, east, up],
    };
    let [usual_n, usual_e, usual_d, ..] = USUAL_SIGMAS;
    let [s_n, s_e, s_d] = sigmas(variances, [usual_n, usual_e, usual_d]);
    // A receiver that knows no height sends NaN.
    let (h, s_d) = if h.is_nan() {
        (0.0, NOT_MEASURED)
    } else {
        (h, s_d)
    };
    let (velocity, [v_n, v_e, v_d]) = beside.unwrap_or(([0.0; 3], [NOT_MEASURED; 3]));
    TimedFix {
        time: 0.0, // stored beside the fix, in ns
        lat_deg: lat,
        lon_deg: lon,
        height_m: h,
        velocity,
        sigmas: [s_n, s_e, s_d, v_n, v_e, v_d],
    }
}
