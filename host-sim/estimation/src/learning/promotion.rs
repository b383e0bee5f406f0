//! Whether a learnt network may be used: it must explain the held-back fixes better than no
//! correction does, by far more than chance.
//!
//! A filter that allows for small sensor errors only (a tenth of the datasheet's) runs over the
//! held-back part twice: on the increments as they are, and on the corrected ones. The difference
//! of the two log-likelihoods of the fixes is the log-likelihood ratio of "the errors are small
//! with the correction" to "the errors are small without it". If the second is true, a ratio above
//! `k` has a probability below `1/k` (Ville's inequality), whatever was learnt. The filter allows
//! for small errors so that errors that no correction removes do not decide.

use crate::learning::aiding::{Passed, pass};
use crate::learning::teacher::{Assumptions, Nominal};
use host_core::inertial::ekf::{Aided, ErrorModel, NAV};
use host_core::inertial::motion::Motion;
use host_core::inertial::session::Session;

/// Smallest log-likelihood ratio of a promotion: less than one in a hundred is wrong.
pub const THRESHOLD: f64 = 4.6;

/// Sensor errors that both hypotheses allow for, as a share of the prior (assumed).
const SLACK: f64 = 0.1;

/// Log-likelihood of the fixes of epochs `from..to`, starting from the teacher's state at `from`.
#[must_use]
pub fn log_likelihood(
    session: &Session,
    increments: &dyn Motion,
    nominal: &Nominal,
    assumptions: &Assumptions,
    from: usize,
    to: usize,
) -> f64 {
    let mut records = nominal.records.cursor();
    let Some(start) = records.get(from - nominal.first) else {
        return f64::NEG_INFINITY;
    };
    let mut model = ErrorModel::biases(&assumptions.prior);
    for p in &mut model.parameters {
        p.sigma *= SLACK;
        p.walk *= SLACK;
    }
    let sigma = host_core::inertial::ekf::InitialSigma {
        tilt: 0.0,
        heading: 0.0,
        velocity: 0.0,
        position: 0.0,
    };
    let filter = Aided::new(start.nav, &sigma, model, assumptions.noise);
    let mut filter = filter.with_samples(session.samples());
    filter
        .p
        .view_mut((0, 0), (NAV, NAV))
        .copy_from(&start.p.view((0, 0), (NAV, NAV)));
    let mut sum = 0.0;
    for k in from..to {
        sum += match pass(&mut filter, session, increments, k, session.fixes[k + 1]) {
            Passed::Epoch(fix) => filter.take(fix.as_ref()),
            Passed::Outage(_) => 0.0,
        };
    }
    sum
}
