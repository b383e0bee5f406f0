//! The states that every scheme's coasts start from, and that judge them.
//!
//! They are smoothed from all samples and all fixes of the session with a model of its own: of some
//! classes of sensors the one under which the fixes are likeliest, whatever the unit file says,
//! with biases of three times its sigmas and 3x3 matrices of a third of them. (Where motion does
//! not separate matrices, accelerometer biases and tilts, wide matrices spoil the tilts: with the
//! whole sigmas the remembered biases of ten RC-car sessions navigate twice as badly.) No judged
//! scheme's parameters shape them.
//! Where the recording gives no attitude, the filter begins level, by the mean specific force, with
//! the heading of a row under which the fixes are most likely; the smoothed start then replaces it,
//! twice. Time offset of the fixes and lever arm of the antenna are those under which fixes and
//! samples contradict each other least.

use super::timeline::Timeline;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Noise, Prior, Record, smooth};
use host_core::inertial::gnss::{Fix, NOT_MEASURED};
use host_core::inertial::rotation::from_euler;
use host_core::inertial::sins::NavState;
use host_core::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, PPM, UG, UG_PER_SQRT_HZ};
use host_core::list::{IN_MEMORY, List};
use host_unit::triads::MRAD;
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
/// Classes of sensors, from navigation grade to consumer MEMS as in the presets, and coarser: bias
/// of the gyros, deg/h, and angle random walk, deg/sqrt(h); bias of the accelerometers, ug, and
/// velocity random walk, ug/sqrt(Hz); scale factors, ppm, and misalignments, mrad, of both.
const CLASSES: [[f64; 6]; 6] = [
    [0.01, 0.002, 30.0, 5.0, 50.0, 0.03],
    [0.4, 0.005, 400.0, 20.0, 100.0, 0.1],
    [1.2, 0.12, 1_000.0, 35.0, 200.0, 0.3],
    [11.0, 0.15, 2_200.0, 40.0, 500.0, 1.0],
    [1_800.0, 0.17, 20_000.0, 70.0, 5_000.0, 10.0],
    [7_200.0, 0.5, 20_000.0, 120.0, 10_000.0, 10.0],
];
/// Factors of a class's sigmas: of biases, and of scale factors and misalignments.
const WIDE: f64 = 3.0;
const MAP: f64 = 0.3;
/// Random walk of a bias in an hour, as a share of its sigma.
const WALK_PER_HOUR: f64 = 0.5;
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
pub const CONTRADICTS: f64 = 20.0;

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

/// What the reference assumes of the sensors.
#[derive(Debug, Clone, Copy)]
struct Model {
    prior: Prior,
    noise: Noise,
}

impl Model {
    fn of([gyro, walk, accel, accel_walk, scale, misalignment]: [f64; 6]) -> Self {
        Self {
            prior: Prior {
                gyro_bias: WIDE * gyro * DEG_PER_H,
                accel_bias: WIDE * accel * UG,
                walk_per_hour: WALK_PER_HOUR,
                scale: [MAP * scale * PPM; 2],
                misalignment: [MAP * misalignment * MRAD; 2],
            },
            noise: Noise {
                gyro: walk * DEG_PER_SQRT_H,
                accel: accel_walk * UG_PER_SQRT_HZ,
            },
        }
    }

    /// A filter with biases alone.
    fn filter(&self, timeline: &Timeline, nav: &NavState, tilt_deg: f64) -> Aided {
        let sigma = start_sigma(tilt_deg, 10.0);
        Aided::new(*nav, &sigma, ErrorModel::biases(&self.prior), self.noise)
            .with_samples(timeline.session.samples())
    }

    /// The class under which these fixes are likeliest, and the state where it begins.
    fn likeliest(
        timeline: &Timeline,
        fixes: &Fixes,
        begin: impl Fn(&Self) -> NavState + Sync,
    ) -> Option<(Self, NavState)> {
        let tried = CLASSES.par_iter().map(|class| {
            let model = Self::of(*class);
            let nav = begin(&model);
            let score = likelihood(timeline, model.filter(timeline, &nav, 10.0), fixes);
            (score, (model, nav))
        });
        let tried: Vec<_> = tried.filter(|(score, _)| score.is_finite()).collect();
        let best = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, of)| of)
    }
}

/// The reference of a session, whose fixes are moved to the clock of the samples.
///
/// # Errors
/// Samples and fixes contradict each other: the residual, where 1 is expected.
pub fn reference(timeline: &mut Timeline) -> Result<Reference, f64> {
    let fixes = thinned(timeline);
    let coarse = Model::of(CLASSES[CLASSES.len() - 1]);
    let between = between(timeline, &coarse, &begin(timeline, &fixes, &coarse));
    timeline.between(&between);
    let fixes = thinned(timeline);
    let begin = |model: &Model| begin(timeline, &fixes, model);
    let (model, start) = Model::likeliest(timeline, &fixes, begin).ok_or(f64::NAN)?;
    let (states, residual) = solved(timeline, &model, start, &fixes);
    if residual < CONTRADICTS && states.len() > 1 {
        Ok(Reference {
            states,
            residual,
            between,
        })
    } else {
        Err(residual)
    }
}

/// The state of the IMU at a time of a session, s, and the residual. The filter begins near `start`
/// and has the fixes as they are.
pub fn state_at(timeline: &Timeline, start: NavState, time_s: f64) -> Option<(NavState, f64)> {
    let (at, end) = (timeline.step_at(time_s), timeline.increments.len());
    let mut fixes = thinned(timeline);
    let nothing = Fix::new(start.position, start.velocity, [NOT_MEASURED; 6]);
    // a state for each of these steps, and no measured value
    for step in [at, end] {
        let place = fixes.partition_point(|(of, _)| *of < step);
        if step > 0 && fixes.get(place).is_none_or(|(of, _)| *of != step) {
            fixes.insert(place, (step, nothing));
        }
    }
    let (model, start) = Model::likeliest(timeline, &fixes, |_| start)?;
    let (states, residual) = solved(timeline, &model, start, &fixes);
    let of = states.into_iter().find(|(step, _)| *step == at)?;
    Some((of.1, residual)).filter(|_| residual.is_finite())
}

/// The states at the beginning and at all fixes but the last, smoothed by the model of the
/// reference, and the residual.
fn solved(
    timeline: &Timeline,
    Model { prior, noise }: &Model,
    mut start: NavState,
    fixes: &Fixes,
) -> (Vec<(usize, NavState)>, f64) {
    let mut found = (Vec::new(), f64::NAN);
    for (model, tilt_deg, heading_deg) in [
        (ErrorModel::biases(prior), 10.0, 10.0),
        (ErrorModel::with_matrices(prior), 5.0, 8.0),
        (ErrorModel::with_matrices(prior), 3.0, 5.0),
    ] {
        let sigma = start_sigma(tilt_deg, heading_deg);
        let filter =
            Aided::new(start, &sigma, model, *noise).with_samples(timeline.session.samples());
        found = smoothed(timeline, filter, fixes);
        if let Some((_, first)) = found.0.first() {
            start = *first;
        }
    }
    found
}

/// What lies between samples and fixes: the time offset of the fixes, s, and the lever arm of the
/// antenna, forward and right, m, under which they contradict the samples least. No offset, and the
/// arm of the recording, where that hardly matters.
fn between(timeline: &Timeline, model: &Model, start: &NavState) -> [f64; 3] {
    let score = |[offset, x, y]: &[f64; 3]| {
        let mut moved = timeline.clone();
        moved.between(&[*offset, *x, *y]);
        let mut fixes = thinned(&moved);
        let until = moved.step_at(COMPARED_S);
        fixes.truncate(fixes.partition_point(|(step, _)| *step <= until).max(2));
        let filter = model.filter(&moved, start, 10.0);
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

fn start_sigma(tilt_deg: f64, heading_deg: f64) -> InitialSigma {
    InitialSigma {
        tilt: tilt_deg * DEG,
        heading: heading_deg * DEG,
        velocity: 3.0,
        position: 1.0,
    }
}

type Fixes = Vec<(usize, Fix)>;

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
fn begin(timeline: &Timeline, fixes: &Fixes, model: &Model) -> NavState {
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
        likelihood(
            timeline,
            model.filter(timeline, &nav, 8.0),
            &fixes[..compared],
        )
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

/// Logarithm of the likelihood of fixes.
fn likelihood(timeline: &Timeline, mut filter: Aided, fixes: &[(usize, Fix)]) -> f64 {
    let mut sum = 0.0;
    aid(timeline, &mut filter, fixes, |filter, fix| {
        sum += filter.take(Some(&fix));
    });
    sum
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
    let far =
        |(_, fix): &(usize, Fix)| fix.position.ned_from(&first.position).xy().norm() > MOVED_M;
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
    fixes: &[(usize, Fix)],
    mut take: impl FnMut(&mut Aided, Fix),
) {
    let mut from = 0;
    for (step, fix) in fixes {
        for increment in &timeline.increments[from..*step] {
            filter.step(increment, timeline.step_s);
        }
        from = *step;
        let fix = timeline.at_imu(*step, fix, &filter.sins.nav);
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
