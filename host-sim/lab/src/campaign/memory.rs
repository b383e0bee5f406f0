//! Schemes with a memory: the state that they store over power-off between the drives of a unit.
//!
//! The classical filters store mean and covariance of each of their models ([`Belief`]), and the
//! likelihood of all fixes so far. The device is the firmware's own application with its store.

use super::NONE;
use super::laws::{Models, biases, exponentials, inputs, temperatures};
use super::rivals::{self, RivalMemory};
use super::schemes::{Case, FILTERS, before_drive};
use host_core::inertial::ekf::{Aided, Belief, ErrorModel, TurnOn};
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::free_inertial::from_filter;
use host_core::inertial::sins::Increment;
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::{Assumptions, aligned_knowing};

/// Filters with a memory: the names of their schemes, the same filters without it (of [`FILTERS`]),
/// and their models.
pub const REMEMBERING: [(&str, usize, Models); 4] = [
    ("ekf6-memory", 0, biases),
    ("ekf-exp-memory", 4, exponentials),
    ("ekf-temp-memory", 5, temperatures),
    ("ekf-inputs-memory", 6, inputs),
];

/// The device: the scheme with a store.
pub const DEVICE: &str = "device";

/// End of the name of a filter with a memory that does not learn in the judged drive.
const FROZEN: &str = "-frozen";

/// The scheme without memory that equals a filter with a memory before its first drive.
#[must_use]
pub fn without_memory(scheme: &str) -> Option<&'static str> {
    if let Some(rival) = rivals::without_memory(scheme) {
        return Some(rival);
    }
    let index = (0..REMEMBERING.len()).find(|&index| uses(scheme, index))?;
    let (_, filter, _) = REMEMBERING[index];
    Some(if scheme.ends_with(FROZEN) {
        NONE
    } else {
        FILTERS[filter]
    })
}

/// Whether a scheme uses its memory of earlier drives.
#[must_use]
pub fn remembers(scheme: &str) -> bool {
    without_memory(scheme).is_some() || scheme == DEVICE
}

/// Whether a scheme uses the memory of the filter number `index`.
#[must_use]
pub fn uses(scheme: &str, index: usize) -> bool {
    scheme.trim_end_matches(FROZEN) == REMEMBERING[index].0
}

/// One model of a filter after some drives.
#[derive(Debug, Clone)]
pub struct StoredModel {
    /// The parameters of the unit.
    pub(super) unit: Belief,
    /// Logarithm of the likelihood of all fixes so far.
    pub(super) score: f64,
}

/// The memory of the drives so far.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    /// The models of each of [`REMEMBERING`]; empty before the first drive.
    filters: [Vec<StoredModel>; REMEMBERING.len()],
    /// The device, once it has had a drive.
    device: Option<Device>,
    /// What the rivals remember.
    rivals: RivalMemory,
}

/// One model at the end of a drive.
pub(super) struct Passed {
    filter: Aided,
    score: f64,
    time_s: f64,
}

impl Memory {
    /// The models of the filter number `index`.
    #[must_use]
    pub fn of(&self, index: usize) -> &[StoredModel] {
        &self.filters[index]
    }

    /// The device as its last drive has left it; `None` before the first one.
    #[must_use]
    pub fn device(&self) -> Option<&Device> {
        self.device.as_ref()
    }

    /// Runs the filter number `index` through a drive and stores its models. `None`: no attitude.
    pub(super) fn keep(&mut self, index: usize, case: &Case<'_>) -> Option<()> {
        let turn_on = case.tuned.turn_on[index];
        let passed = pass(index, case, turn_on, &self.filters[index])?;
        self.filters[index] = stored_models(index, case, turn_on, &self.filters[index], &passed);
        Some(())
    }

    /// What the rivals remember.
    pub(super) fn rivals(&self) -> &RivalMemory {
        &self.rivals
    }

    /// Runs one of the rivals with a memory through a drive. `None`: no attitude.
    pub(super) fn recall(&mut self, scheme: &str, case: &Case<'_>) -> Option<()> {
        self.rivals.keep(scheme, case)
    }

    /// Runs the device through a drive.
    pub(super) fn store(&mut self, case: &Case<'_>) {
        let memory = Some(&*self);
        let mut device = before_drive(&Case { memory, ..*case });
        device.drive_session(case.session, case.until);
        self.device = Some(device);
    }
}

fn models(index: usize, case: &Case<'_>) -> (Assumptions, Vec<ErrorModel>) {
    let assumptions = case.knows.assumptions;
    let assumptions = assumptions.walking(assumptions.datasheet_walk());
    let models = REMEMBERING[index].2(case.session, &assumptions.prior);
    (assumptions, models)
}

/// Each model from power-on to the end of the fixes.
pub(super) fn pass(
    index: usize,
    case: &Case<'_>,
    turn_on: TurnOn,
    stored: &[StoredModel],
) -> Option<Vec<Passed>> {
    let (assumptions, models) = models(index, case);
    let (session, increments) = (case.session, case.increments());
    let each = models.into_iter().enumerate().map(|(i, model)| {
        let unit = stored.get(i).map(|k| k.unit.clone());
        let unit = unit.unwrap_or_else(|| Belief::of_unit(&model, turn_on));
        let known = unit.turned_on(&model, turn_on);
        let aligned = aligned_knowing(session, increments, &model, &known)?;
        let filter = aligned.filter_knowing(model, &assumptions, &known);
        let (filter, score) = aligned.scored_from(filter, session, &increments, case.until);
        Some(Passed {
            filter,
            score: score + stored.get(i).map_or(0.0, |k| k.score),
            time_s: (case.until - aligned.first) as f64,
        })
    });
    each.collect()
}

/// The increments corrected by the model under which the fixes of all drives had the greatest
/// likelihood. `None` before the first drive.
pub(super) fn corrected_by_memory(
    index: usize,
    case: &Case<'_>,
    stored: &[StoredModel],
) -> Option<Vec<Increment>> {
    let (_, models) = models(index, case);
    let each = models.iter().zip(stored);
    let (model, stored) = each.max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
    let dt = case.session.step_s();
    Some(model.all_corrected(&stored.unit.mean, case.increments(), dt))
}

/// The models that are stored after a drive.
pub(super) fn stored_models(
    index: usize,
    case: &Case<'_>,
    turn_on: TurnOn,
    before: &[StoredModel],
    passed: &[Passed],
) -> Vec<StoredModel> {
    let (_, models) = models(index, case);
    let each = models.iter().zip(passed).enumerate();
    let each = each.map(|(i, (model, passed))| {
        let unit = before.get(i).map(|k| k.unit.clone());
        let unit = unit.unwrap_or_else(|| Belief::of_unit(model, turn_on));
        let after = Belief::of_filter(&passed.filter);
        StoredModel {
            unit: unit.powered_off(model, turn_on, &after, passed.time_s),
            score: passed.score,
        }
    });
    each.collect()
}

/// Free-inertial navigation by the model under which all fixes, including those of the earlier
/// drives, had the greatest likelihood.
pub(super) fn recalled(
    index: usize,
    case: &Case<'_>,
    turn_on: TurnOn,
    stored: &[StoredModel],
) -> Option<FreeInertial> {
    let passed = pass(index, case, turn_on, stored)?.into_iter();
    let best = passed.max_by(|a, b| a.score.total_cmp(&b.score))?;
    Some(from_filter(
        &best.filter,
        case.session,
        case.increments(),
        case.until,
    ))
}
