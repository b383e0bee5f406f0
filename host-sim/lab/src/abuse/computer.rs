//! The navigation computers behind the device. Each has a good receiver of its own while there
//! are fixes, and knows the datasheet, whatever the device's configuration says.

use super::names::Computer;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, Prior};
use host_core::inertial::free_inertial::from_filter;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_estimation::learning::teacher::{Assumptions, aid, aligned};

/// Correlation time of Gauss-Markov biases and scale factors, s: four hours, as in the
/// configuration that comes with KF-GINS (`corrtime`).
const CORRELATION_S: f64 = 4.0 * 3600.0;
/// The error of a computer that is lost, m: a quarter of a meridian.
const LOST_M: f64 = 1e7;
/// Standard deviations of position (m) and velocity (m/s) where the first state is known: a vehicle
/// that never stands.
const KNOWN: [f64; 2] = [0.1, 0.02];
/// Largest standard deviation of the heading there, rad.
const HEADING: f64 = 0.02;

/// The sensor errors that the computer estimates.
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
/// fixes until epoch `until`. At most [`LOST_M`], which is also the error of a computer that cannot
/// align itself.
pub(super) fn error(
    computer: Computer,
    session: &Session,
    increments: &[Increment],
    (assumptions, finds_north): &(Assumptions, bool),
    until: usize,
) -> f64 {
    let assumptions = assumptions.walking(assumptions.datasheet_walk());
    let model = model(computer, &assumptions.prior);
    let start = match session.standstill > 0 && *finds_north {
        false => Some((0, known(session, model, &assumptions))),
        true => aligned(session, &increments).map(|at| (at.first, at.filter(model, &assumptions))),
    };
    let Some((first, mut filter)) = start else {
        return LOST_M;
    };
    for k in first..until {
        aid(&mut filter, session, &increments, k);
    }
    let free = from_filter(&filter, session, increments, until);
    let end = free.position.last().map(|error| error.xy().norm());
    // NaN counts as lost
    end.map_or(LOST_M, |error| error.min(LOST_M))
}

/// A filter that starts at the true state, with standard deviations [`KNOWN`]. That of the
/// heading is at most [`HEADING`].
fn known(session: &Session, model: ErrorModel, assumptions: &Assumptions) -> Aided {
    let [position, velocity] = KNOWN;
    let site = session.reference[0];
    let sigmas = [position, position, position, velocity, velocity, velocity];
    let usual = assumptions.initial_sigma(&site, &sigmas);
    let sigma = InitialSigma {
        position,
        velocity,
        heading: usual.heading.min(HEADING),
        ..usual
    };
    Aided::new(site, &sigma, model, assumptions.noise).with_samples(session.samples())
}
