//! The navigation computers behind the device. They have a good receiver of their own while there
//! are fixes, and know the datasheet, whatever the device was told.

use super::names::Computer;
use crate::learning::teacher::{Assumptions, aid, aligned};
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Prior};
use host_core::inertial::free_inertial::from_filter;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;

/// Time in which Gauss-Markov biases and scale factors forget, s: four hours, as in the
/// configuration that comes with KF-GINS (`corrtime`).
const CORRELATION_S: f64 = 4.0 * 3600.0;
/// The error of a computer that is lost, m: a quarter of a meridian.
const LOST_M: f64 = 1e7;
/// Standard deviations of position (m) and velocity (m/s) where the first state is known: a vehicle
/// that never stands.
const KNOWN: [f64; 2] = [0.1, 0.02];
/// And of the heading at most, rad.
const HEADING: f64 = 0.02;

/// What the computer estimates of the sensors.
fn model(computer: Computer, prior: &Prior) -> ErrorModel {
    match computer {
        Computer::Plain => ErrorModel::default(),
        Computer::Biases => ErrorModel::biases(prior),
        Computer::GaussMarkov => {
            let mut model = ErrorModel::with_scale(prior);
            for parameter in &mut model.parameters {
                parameter.time_s = CORRELATION_S;
                parameter.walk = parameter.sigma * (2.0 / CORRELATION_S).sqrt();
            }
            model
        }
    }
}

/// Horizontal error at the end of the session, m, of a computer that gets these increments, with
/// fixes until epoch `until`. [`LOST_M`] if it cannot align itself, and at most.
pub(super) fn error(
    computer: Computer,
    session: &Session,
    increments: &[Increment],
    (assumptions, finds_north): &(Assumptions, bool),
    until: usize,
) -> f64 {
    let told = assumptions.walking(assumptions.datasheet_walk());
    let model = model(computer, &told.prior);
    let begun = match session.standstill > 0 && *finds_north {
        false => Some((0, known(session, model, &told))),
        true => aligned(session, increments).map(|at| (at.first, at.filter(model, &told))),
    };
    let Some((first, mut filter)) = begun else {
        return LOST_M;
    };
    for k in first..until {
        aid(&mut filter, session, increments, k);
    }
    let free = from_filter(&filter, session, increments, until);
    let end = free.position.last().map(|error| error.xy().norm());
    // what is not a number is lost too
    end.map_or(LOST_M, |error| error.min(LOST_M))
}

/// A filter that begins with the true state, and knows how exactly. A heading is known to a degree
/// at best where sensors do not find north.
fn known(session: &Session, model: ErrorModel, told: &Assumptions) -> Aided {
    let [position, velocity] = KNOWN;
    let site = session.reference[0];
    let sigmas = [position, position, position, velocity, velocity, velocity];
    let usual = told.initial_sigma(&site, &sigmas);
    let sigma = InitialSigma {
        position,
        velocity,
        heading: usual.heading.min(HEADING),
        ..usual
    };
    Aided::new(site, &sigma, model, told.noise).with_samples(session.samples())
}
