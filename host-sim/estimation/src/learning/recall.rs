//! The rivals of the device over several power-ons: what they remember of a unit.
//!
//! A filter with a memory begins with what it has found of the unit in earlier sessions: the unit's
//! part of each parameter has a mean and a covariance, which widens a little from one power-on to
//! the next. Once in a while a unit has stepped: a second filter begins with a belief that a step
//! has opened, and the fixes of the session decide which of the two is used.

use host_core::inertial::ekf::{Aided, Belief, ErrorModel, Prior, TurnOn};
use host_core::inertial::sins::Increment;
use nalgebra::Vector3;

/// The classical filters: biases, with scale factors, with 3x3 matrices.
pub const FILTERS: [&str; 3] = ["ekf6", "ekf12", "ekf24"];

/// Share of a parameter's prior variance that is new at a power-on, and by which the unit's own
/// part has moved since the last: 0.02 of its sigma each, as measured on real units.
const TIGHT: f64 = 0.02 * 0.02;
/// The same by which a step of the unit opens it: 0.2 of its sigma, with this probability.
const STEP: f64 = 0.2 * 0.2;
const STEPS: f64 = 0.1;

/// The error model of one of [`FILTERS`].
#[must_use]
pub fn model(filter: usize, prior: &Prior) -> ErrorModel {
    match filter {
        0 => ErrorModel::biases(prior),
        1 => ErrorModel::with_scale(prior),
        _ => ErrorModel::with_matrices(prior),
    }
}

/// A session of a filter: the belief on the unit that it began with, and what came of it.
#[derive(Debug, Clone)]
pub struct Passed<P> {
    /// The belief on the unit before.
    pub before: Belief,
    /// What `run` gave.
    pub pass: P,
}

/// Runs a filter that knows nothing of its unit. `run` gets the belief at power-on.
pub fn new<P>(model: &ErrorModel, run: impl Fn(&Belief) -> Option<P>) -> Option<Passed<P>> {
    let turn_on = TurnOn::of_all(TIGHT);
    let before = Belief::of_unit(model, turn_on);
    let pass = run(&before.turned_on(model, turn_on))?;
    Some(Passed { before, pass })
}

/// Runs a filter twice: as if the unit were as it was, and as if it had stepped.
pub fn knowing<P>(
    model: &ErrorModel,
    known: &Belief,
    run: impl Fn(&Belief) -> Option<P>,
) -> Option<[Passed<P>; 2]> {
    let of = |share| {
        let before = known.turned_on(model, TurnOn::of_all(share));
        let pass = run(&before.turned_on(model, TurnOn::of_all(TIGHT)))?;
        Some(Passed { before, pass })
    };
    Some([of(TIGHT)?, of(STEP)?])
}

/// Which of the two of [`knowing`] is likelier, by the logarithms of the likelihoods of the fixes.
#[must_use]
pub fn stepped([as_was, stepped]: [f64; 2]) -> usize {
    let odds = (STEPS / (1.0 - STEPS)).ln();
    usize::from(stepped + odds > as_was)
}

/// The belief on the unit after a session of `time_s` seconds that ended with this filter.
#[must_use]
pub fn after(model: &ErrorModel, before: &Belief, end: &Aided, time_s: f64) -> Belief {
    let turn_on = TurnOn::of_all(TIGHT);
    before.powered_off(model, turn_on, &Belief::of_filter(end), time_s)
}

/// The six biases of a filter: rad/s, m/s2.
#[must_use]
pub fn biases(filter: &Aided) -> [Vector3<f64>; 2] {
    let of = |from: usize| Vector3::from_iterator(filter.theta.rows(from, 3).iter().copied());
    [of(0), of(3)]
}

/// Increments of `step_s` seconds less a bias, from a step on.
#[must_use]
pub fn less(
    increments: &[Increment],
    step_s: f64,
    [gyro, accel]: &[Vector3<f64>; 2],
    from: usize,
) -> Vec<Increment> {
    let each = increments.iter().enumerate();
    each.map(|(k, w)| {
        let on = f64::from(u8::from(k >= from));
        Increment {
            dtheta: w.dtheta - gyro * (step_s * on),
            dv: w.dv - accel * (step_s * on),
        }
    })
    .collect()
}

/// Mean of the gyros over a standstill, rad/s.
#[must_use]
pub fn mean_rate(standing: &[Increment], step_s: f64) -> Vector3<f64> {
    let turned: Vector3<f64> = standing.iter().map(|w| w.dtheta).sum();
    turned / (standing.len().max(1) as f64 * step_s)
}
