//! The sensor errors of a drive: every ten seconds the error of each axis with its standard
//! deviation, and every second the possible inputs of networks.
//!
//! The errors are the biases of a filter that is aided by fixes and lets them walk fast, smoothed
//! over the whole drive ([`host_estimation::learning::teacher`]). Neighbouring ones share the fixes
//! between them. A bias that walks by `q` in a second and is known to the variance P is smoothed
//! over some `2 P / q` seconds; the variance is enlarged accordingly, for the smaller number of
//! independent errors.

use firmware::inputs::Inputs;
use firmware::model::Nets;
use host_core::error::Error;
use host_core::inertial::session::{EPOCH_S, Session};
use host_estimation::learning::teacher::{
    Assumptions, Nominal, navigate, navigate_from, references,
};
use host_estimation::learning::window::{compensator, inputs};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Smallest random walk of the biases in an hour, as a share of their prior: the effect of
/// temperature and vibration.
const WALK_PER_HOUR: f64 = 2.0;
/// Seconds from one error to the next.
const STEP_S: usize = 10;

/// One drive of one unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Drive {
    /// Number of the unit.
    pub unit: u32,
    /// Inputs of the networks of gyros and accelerometers in each second since power-on, SI.
    pub inputs: [Vec<[f32; 3]>; 2],
    /// The errors.
    pub errors: Vec<Error10>,
}

/// The errors about one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Error10 {
    /// Second since power-on.
    pub second: u32,
    /// Errors of gyros (rad/s) and accelerometers (m/s2).
    pub error: [[f32; 3]; 2],
    /// Their standard deviations.
    pub sigma: [[f32; 3]; 2],
}

impl Drive {
    /// The series of a session with fixes to its end. `None`: no attitude, or a drive that
    /// is too short.
    #[must_use]
    pub fn of(
        unit: u32,
        session: &Session,
        assumptions: &Assumptions,
        which: &Inputs,
    ) -> Option<Self> {
        let assumptions = Assumptions {
            inputs: *which,
            ..assumptions.walking(assumptions.prior.walk_per_hour.max(WALK_PER_HOUR))
        };
        let increments = session.increments();
        let until = session.epochs();
        let nominal = match &session.start {
            Some(start) if session.standstill == 0 => {
                navigate_from(session, &increments, &assumptions, start, 0, until)
            }
            _ => navigate(session, &increments, &assumptions, until)?,
        };
        let errors = errors(&nominal, &assumptions);
        // the inputs of the device's own blocks
        let quiet = compensator(session, &[Nets::NONE.gyro; 2], &assumptions);
        let driven = inputs(session, &quiet, until);
        (!errors.is_empty()).then_some(Self {
            unit,
            inputs: [driven.rate, driven.force],
            errors,
        })
    }
}

/// Errors every [`STEP_S`], at the middle of their seconds.
fn errors(nominal: &Nominal, assumptions: &Assumptions) -> Vec<Error10> {
    let bias = [assumptions.prior.gyro_bias, assumptions.prior.accel_bias];
    let walk = bias.map(|b| (b * assumptions.prior.walk_per_hour).powi(2) / 3600.0);
    let enlarged = |sigma: f64, q: f64| {
        let over_s = 2.0 * sigma * sigma / q;
        (sigma * (2.0 * over_s / (STEP_S as f64 * EPOCH_S)).max(1.0).sqrt()) as f32
    };
    let all = references(nominal, nominal.records.len());
    let each = all.iter().skip(STEP_S / 2).step_by(STEP_S);
    let of = each.map(|r| {
        let pairs = [[r.error.dtheta, r.sigma.dtheta], [r.error.dv, r.sigma.dv]];
        Error10 {
            second: r.epoch as u32,
            error: pairs.map(|[error, _]| [0, 1, 2].map(|i| error[i] as f32)),
            sigma: [0, 1].map(|triad: usize| {
                let [_, sigma] = pairs[triad];
                [0, 1, 2].map(|i| enlarged(sigma[i], walk[triad]))
            }),
        }
    });
    let good = |e: &Error10| {
        let numbers = e.error.iter().chain(&e.sigma).flatten();
        numbers.clone().all(|x| x.is_finite()) && e.sigma.iter().flatten().all(|s| *s > 0.0)
    };
    of.filter(good).collect()
}

/// The error of a drive without an attitude.
pub(super) fn useless(file: &Path) -> Error {
    Error::Option {
        option: format!("--recordings: {}", file.display()),
        problem: "its fixes and samples give no attitude, so that its errors cannot be estimated"
            .into(),
        remedy: "leave this drive out, or let it begin with a standstill of 90 s".into(),
    }
}
