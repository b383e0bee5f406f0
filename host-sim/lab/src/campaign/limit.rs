//! The limit of all memory: a filter that knows the unit's errors exactly, but not those that are
//! new at the turn-on.

use super::schemes::{Case, aided_free_inertial, oracle, without_beyond};
use host_core::inertial::ekf::{ErrorModel, Parameter};
use host_core::inertial::free_inertial::FreeInertial;
use nalgebra::DVector;

/// The errors that the unit has at every turn-on are subtracted, and a filter with parameters for
/// those that are new at this turn-on estimates the rest. Errors by the environment are subtracted
/// as for the oracle. The remaining warm-up of a warm unit is known.
pub(super) fn limit(case: &Case<'_>) -> Option<FreeInertial> {
    let model = oracle(case.knows.simulated, case.session);
    let unit = &case.knows.unit;
    let values: Vec<f64> = model.parameters.iter().map(|p| unit.value(p)).collect();
    let fresh = |(p, value): (&Parameter, &f64)| {
        let sigma = unit.turn_on(p, *value);
        let changes = sigma > 0.0 || p.walk > 0.0;
        changes.then_some(Parameter { sigma, ..*p })
    };
    let fresh = ErrorModel {
        parameters: model
            .parameters
            .iter()
            .zip(&values)
            .filter_map(fresh)
            .collect(),
        known: model.known.clone(),
        delay_s: 0.0,
    };
    let dt = case.session.step_s();
    let corrected = model.all_corrected(&DVector::from_vec(values), &without_beyond(case), dt);
    aided_free_inertial(case, &corrected, case.knows.assumptions, fresh)
}
