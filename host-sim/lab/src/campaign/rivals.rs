//! The rivals of `replay sessions` in campaigns. They take part where they are named.

use super::NONE;
use super::schemes::{Case, none};
use host_core::inertial::earth::Local;
use host_core::inertial::ekf::{Aided, Belief};
use host_core::inertial::free_inertial::{FreeInertial, from_filter};
use host_estimation::learning::recall::{self, FILTERS, Passed, biases, less, mean_rate};
use host_estimation::learning::teacher::{aligned, aligned_knowing};
use nalgebra::Vector3;

/// The gyros' mean over the standstill.
const REST: &str = "rest";
/// The biases that `ekf6` had at the end of the last drive.
const LAST: &str = "last";
/// The filters with the memory of [`recall`], in the order of its filters.
const TIGHT: [&str; FILTERS.len()] = ["ekf6-tight", "ekf12-tight", "ekf24-tight"];

/// Memory of the rivals between drives.
#[derive(Debug, Clone, Default)]
pub(super) struct RivalMemory {
    beliefs: [Option<Belief>; FILTERS.len()],
    last: Option<[Vector3<f64>; 2]>,
}

/// Whether a scheme is one of these, which a campaign leaves out unless they are named.
#[must_use]
pub(super) fn is_rival(scheme: &str) -> bool {
    scheme == REST || without_memory(scheme).is_some()
}

/// Of one with a memory, the scheme without memory that equals it before its first drive.
#[must_use]
pub(super) fn without_memory(scheme: &str) -> Option<&'static str> {
    if scheme == LAST {
        return Some(NONE);
    }
    let tight = TIGHT.iter().position(|name| *name == scheme);
    tight.map(|filter| FILTERS[filter])
}

/// The mean rate over the standstill is taken off, less that of the Earth in the attitude of the
/// alignment. Of a level axis only what the alignment has not taken for the heading is left.
pub(super) fn rest(case: &Case<'_>) -> Option<FreeInertial> {
    let (session, increments) = (case.session, case.increments());
    let nav = aligned(session, &increments)?.nav;
    let standing = &increments[..session.standstill * session.steps_per_epoch()];
    let earth = Local::at(nav.position.lat, nav.position.h).omega_ie();
    let mean = mean_rate(standing, session.step_s()) - nav.q_bn.inverse() * earth;
    without(case, &[mean, Vector3::zeros()])
}

/// The biases that `ekf6` had at the end of the last drive are taken off.
pub(super) fn last(case: &Case<'_>) -> Option<FreeInertial> {
    let known = case.memory.and_then(|memory| memory.rivals().last);
    without(case, &known.unwrap_or_default())
}

fn without(case: &Case<'_>, biases: &[Vector3<f64>; 2]) -> Option<FreeInertial> {
    let corrected = less(case.increments(), case.session.step_s(), biases, 0);
    none(case, &corrected, case.tuned.none_factor)
}

/// A filter with the memory of the earlier drives.
pub(super) fn tight<const FILTER: usize>(case: &Case<'_>) -> Option<FreeInertial> {
    let nothing = RivalMemory::default();
    let known = case.memory.map_or(&nothing, |memory| memory.rivals());
    let passed = through(FILTER, case, known)?;
    let (filter, _) = &passed.pass;
    Some(from_filter(
        filter,
        case.session,
        case.increments(),
        case.until,
    ))
}

type Scored = (Aided, f64);

/// A filter through a drive.
fn through(filter: usize, case: &Case<'_>, known: &RivalMemory) -> Option<Passed<Scored>> {
    let assumptions = case.knows.assumptions;
    let assumptions = assumptions.walking(assumptions.datasheet_walk());
    let model = recall::model(filter, &assumptions.prior);
    let (session, increments) = (case.session, case.increments());
    let run = |prior: &Belief| {
        let aligned = aligned_knowing(session, increments, &model, prior)?;
        let filter = aligned.filter_knowing(model.clone(), &assumptions, prior);
        Some(aligned.scored_from(filter, session, &increments, case.until))
    };
    let Some(belief) = &known.beliefs[filter] else {
        return recall::new(&model, run);
    };
    let [as_was, stepped] = recall::knowing(&model, belief, run)?;
    Some(match recall::stepped([as_was.pass.1, stepped.pass.1]) {
        0 => as_was,
        _ => stepped,
    })
}

impl RivalMemory {
    /// Learns from a drive what one of these schemes remembers. `None`: no attitude.
    pub(super) fn keep(&mut self, scheme: &str, case: &Case<'_>) -> Option<()> {
        let filter = TIGHT.iter().position(|name| *name == scheme);
        if scheme == LAST {
            // each drive by itself
            let alone = through(0, case, &RivalMemory::default())?;
            self.last = Some(biases(&alone.pass.0));
        }
        let Some(filter) = filter else {
            return Some(());
        };
        let Passed { before, pass } = through(filter, case, self)?;
        let assumptions = case.knows.assumptions;
        let prior = assumptions.walking(assumptions.datasheet_walk()).prior;
        let model = recall::model(filter, &prior);
        self.beliefs[filter] = Some(recall::after(&model, &before, &pass.0, case.until as f64));
        Some(())
    }
}
