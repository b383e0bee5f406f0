//! The states that every scheme's coasts start from, and that judge them.
//!
//! They are smoothed from all samples and all fixes of the session with a model of its own: biases
//! with three times the datasheet's sigmas, 3x3 matrices with a third of them. (Where motion does
//! not tell matrices, accelerometer biases and tilts apart, wide matrices spoil the tilts: with the
//! whole sigmas the remembered biases of ten RC-car sessions navigate twice as badly.) No judged
//! scheme's parameters shape them.
//! Where the recording gives no attitude, the filter begins level, by the mean specific force, with
//! the heading of a row under which the fixes are most likely; the smoothed start then replaces it,
//! twice. Time offset of the fixes and lever arm of the antenna are those under which fixes and
//! samples contradict each other least.

use super::Assumed;
use super::timeline::Timeline;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Prior, Record, smooth};
use host_core::inertial::rotation::from_euler;
use host_core::inertial::sins::NavState;
use host_core::inertial::units::DEG;
use host_core::list::{IN_MEMORY, List};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Headings that are tried.
const HEADINGS: u32 = 24;
/// The headings are compared until the vehicle has moved so far, m, and so long after, s.
const MOVED_M: f64 = 10.0;
const THEN_S: f64 = 40.0;
/// Force over so long gives the first roll and pitch, s.
const LEVEL_S: f64 = 2.0;
/// More fixes a second than these are not needed.
const FIXES_HZ: f64 = 5.0;
/// Factors of the datasheet's sigmas: of biases, and of scale factors and misalignments.
const WIDE: f64 = 3.0;
const MAP: f64 = 0.3;
/// The search between samples and fixes: which value (time offset, s, then arm forward and right,
/// m), how many steps on each side, and their size.
const SEARCH: [(usize, i32, f64); 7] = [
    (0, 8, 0.1),
    (1, 3, 0.2),
    (2, 3, 0.2),
    (0, 2, 0.04),
    (1, 2, 0.08),
    (2, 2, 0.08),
    (0, 2, 0.02),
];
/// Time over which they are compared for it, s.
const COMPARED_S: f64 = 150.0;
/// It is used if it reduces the residual to this.
const MATTERS: f64 = 0.9;
/// Mean normalised innovation squared above which samples and fixes contradict each other.
const CONTRADICTS: f64 = 20.0;

/// States of the IMU at the times of fixes, each with the number of steps before it.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The states, the first one at the beginning of the session.
    pub states: Vec<(usize, NavState)>,
    /// Mean normalised innovation squared of a measured value: 1 when all assumptions hold.
    pub residual: f64,
    /// What was added to the times of the fixes, s, and the lever arm of the antenna, forward and
    /// right, m.
    pub between: [f64; 3],
}

impl Reference {
    /// The state nearest to a step.
    #[must_use]
    pub fn near(&self, step: usize) -> &(usize, NavState) {
        let after = self.states.partition_point(|(at, _)| *at < step);
        let pair = [after.saturating_sub(1), after.min(self.states.len() - 1)];
        let [a, b] = pair.map(|k| &self.states[k]);
        if step.abs_diff(a.0) <= step.abs_diff(b.0) {
            a
        } else {
            b
        }
    }
}

/// The reference of a session, whose fixes are moved to the clock of the samples.
///
/// # Errors
/// Samples and fixes contradict each other: the residual, where 1 is expected.
pub fn reference(timeline: &mut Timeline, assumed: &Assumed) -> Result<Reference, f64> {
    let prior = wide(&assumed.prior);
    let mut start = begin(timeline, &thinned(timeline), assumed, &prior);
    let between = between(timeline, assumed, &prior, &start);
    timeline.between(&between);
    let fixes = thinned(timeline);
    let mut found = None;
    for (model, tilt_deg, heading_deg) in [
        (ErrorModel::biases(&prior), 10.0, 10.0),
        (ErrorModel::with_matrices(&prior), 5.0, 8.0),
        (ErrorModel::with_matrices(&prior), 3.0, 5.0),
    ] {
        let sigma = start_sigma(tilt_deg, heading_deg);
        let filter = Aided::new(start, &sigma, model, assumed.noise)
            .with_samples(timeline.session.samples());
        let (states, residual) = smoothed(timeline, filter, &fixes);
        if let Some((_, first)) = states.first() {
            start = *first;
        }
        found = Some(Reference {
            states,
            residual,
            between,
        });
    }
    match found {
        Some(found) if found.residual < CONTRADICTS && found.states.len() > 1 => Ok(found),
        Some(found) => Err(found.residual),
        None => Err(f64::NAN),
    }
}

/// What lies between samples and fixes: the time offset of the fixes, s, and the lever arm of the
/// antenna, forward and right, m, under which they contradict the samples least. No offset, and the
/// arm of the recording, where that hardly matters.
fn between(timeline: &Timeline, assumed: &Assumed, prior: &Prior, start: &NavState) -> [f64; 3] {
    let score = |[offset, x, y]: &[f64; 3]| {
        let mut moved = timeline.clone();
        moved.between(&[*offset, *x, *y]);
        let mut fixes = thinned(&moved);
        let until = moved.step_at(COMPARED_S);
        fixes.truncate(fixes.partition_point(|(step, _)| *step <= until).max(2));
        let sigma = start_sigma(10.0, 10.0);
        let filter = Aided::new(*start, &sigma, ErrorModel::biases(prior), assumed.noise)
            .with_samples(moved.session.samples());
        passed(&moved, filter, &fixes).1
    };
    let given = [
        0.0,
        timeline.session.lever_arm.x,
        timeline.session.lever_arm.y,
    ];
    let first = score(&given);
    let mut best = (first, given);
    for (axis, count, step) in SEARCH {
        let tried = (-count..=count).into_par_iter().map(|k| {
            let mut of = best.1;
            of[axis] += f64::from(k) * step;
            (score(&of), of)
        });
        let better = |a: &(f64, [f64; 3]), b: &(f64, [f64; 3])| a.0.total_cmp(&b.0);
        best = tried.min_by(better).unwrap_or(best);
    }
    if best.0 < MATTERS * first {
        best.1
    } else {
        given
    }
}

fn wide(prior: &Prior) -> Prior {
    Prior {
        gyro_bias: WIDE * prior.gyro_bias,
        accel_bias: WIDE * prior.accel_bias,
        scale: prior.scale.map(|sigma| MAP * sigma),
        misalignment: prior.misalignment.map(|sigma| MAP * sigma),
        ..*prior
    }
}

fn start_sigma(tilt_deg: f64, heading_deg: f64) -> InitialSigma {
    InitialSigma {
        tilt: tilt_deg * DEG,
        heading: heading_deg * DEG,
        velocity: 3.0,
        position: 1.0,
    }
}

type Fixes = Vec<(usize, host_core::inertial::gnss::Fix)>;

/// Fixes after the beginning, at most [`FIXES_HZ`].
fn thinned(timeline: &Timeline) -> Fixes {
    let apart = (0.9 / (FIXES_HZ * timeline.step_s)) as usize;
    let mut next = 1;
    let mut out = Vec::new();
    for (step, fix) in &timeline.fixes {
        if *step >= next {
            out.push((*step, *fix));
            next = *step + apart.max(1);
        }
    }
    out
}

/// The state at the beginning.
fn begin(timeline: &Timeline, fixes: &Fixes, assumed: &Assumed, prior: &Prior) -> NavState {
    let site = timeline.session.nearest_fix(0);
    let state = |q_bn: UnitQuaternion<f64>| NavState {
        position: timeline.session.imu_position(&site.position, &q_bn),
        velocity: velocity(fixes),
        q_bn,
    };
    if let Some(q_bn) = timeline.attitude {
        return state(q_bn);
    }
    let steps = timeline.step_at(LEVEL_S).max(1);
    let force: Vector3<f64> = timeline.increments[..steps].iter().map(|w| w.dv).sum();
    let roll = (-force.y).atan2(-force.z);
    let pitch = force.x.atan2(force.y.hypot(force.z));
    let compared = compared(timeline, fixes);
    let score = |heading: f64| {
        let nav = state(from_euler(roll, pitch, heading));
        let model = ErrorModel::biases(prior);
        let sigma = start_sigma(8.0, 10.0);
        let mut filter =
            Aided::new(nav, &sigma, model, assumed.noise).with_samples(timeline.session.samples());
        let mut sum = 0.0;
        aid(timeline, &mut filter, &fixes[..compared], |filter, fix| {
            sum += filter.take(Some(&fix));
        });
        sum
    };
    let turn = std::f64::consts::TAU / f64::from(HEADINGS);
    let scored: Vec<(f64, f64)> = (0..HEADINGS)
        .into_par_iter()
        .map(|k| f64::from(k) * turn)
        .map(|heading| (score(heading), heading))
        .collect();
    let likelier = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0);
    let finite = scored.into_iter().filter(|(score, _)| score.is_finite());
    let heading = finite.max_by(likelier).map_or(0.0, |(_, heading)| heading);
    state(from_euler(roll, pitch, heading))
}

/// Velocity between the first fixes.
fn velocity(fixes: &Fixes) -> Vector3<f64> {
    match fixes.first() {
        Some((_, fix)) if fix.has(3..6) => fix.velocity,
        _ => Vector3::zeros(),
    }
}

/// Number of fixes over which headings are compared.
fn compared(timeline: &Timeline, fixes: &Fixes) -> usize {
    let Some((_, first)) = fixes.first() else {
        return 0;
    };
    let far = |(_, fix): &(usize, host_core::inertial::gnss::Fix)| {
        fix.position.ned_from(&first.position).xy().norm() > MOVED_M
    };
    let Some(moved) = fixes.iter().position(far) else {
        return fixes.len();
    };
    let until = fixes[moved].0 + timeline.step_at(THEN_S);
    fixes.partition_point(|(step, _)| *step <= until)
}

/// Steps a filter from the beginning to the last of these fixes, each of which goes to `take` as a
/// receiver at the IMU would have given it.
pub(super) fn aid(
    timeline: &Timeline,
    filter: &mut Aided,
    fixes: &[(usize, host_core::inertial::gnss::Fix)],
    mut take: impl FnMut(&mut Aided, host_core::inertial::gnss::Fix),
) {
    let mut from = 0;
    for (step, fix) in fixes {
        for increment in &timeline.increments[from..*step] {
            filter.step(increment, timeline.step_s);
        }
        from = *step;
        let fix = timeline.at_imu(fix, &filter.sins.nav);
        take(filter, fix);
    }
}

/// The records of a filter with these fixes, and its residual.
fn passed(timeline: &Timeline, mut filter: Aided, fixes: &Fixes) -> (Vec<Record>, f64) {
    let (mut records, mut sum, mut count): (Vec<Record>, f64, usize) = (Vec::new(), 0.0, 0);
    aid(timeline, &mut filter, fixes, |filter, fix| {
        let record = filter.fix(Some(&fix));
        sum += record.nis;
        count += fix.sigmas.iter().filter(|sigma| sigma.is_finite()).count();
        records.push(record);
    });
    (records, sum / count.max(1) as f64)
}

fn smoothed(timeline: &Timeline, filter: Aided, fixes: &Fixes) -> (Vec<(usize, NavState)>, f64) {
    let (records, residual) = passed(timeline, filter, fixes);
    // each record belongs to the state before its interval
    let starts = std::iter::once(0).chain(fixes.iter().map(|(step, _)| *step));
    let smoothed = smooth(&List::collected(records, IN_MEMORY));
    (
        starts.zip(smoothed.iter().map(|of| of.nav)).collect(),
        residual,
    )
}
