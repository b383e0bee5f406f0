//! The competitors of a campaign: each is aided by fixes up to an epoch and coasts from there, on the same words.

use super::tuning::{DATASHEET_WALK, Tuned};
use crate::coast::{Coast, coast};
use crate::ekf::{Aided, ErrorModel, Noise, Parameter, Regressor, Triad};
use crate::imu::ImuSpec;
use crate::learning::{NetworkSpec, compensator, corrected_words};
use crate::session::{EPOCH_S, Session};
use crate::sins::Increment;
use crate::study::{Use, study};
use crate::teacher::{Assumptions, aid, aligned};
use crate::units::{DEG_PER_H, PPM, UG};
use std::borrow::Cow;

/// One task: a session measured with one group of errors.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    /// The session, aided to `until`.
    pub session: &'a Session,
    /// Its words, [`Session::increments`].
    pub words: &'a [Increment],
    /// What may be known of the IMU.
    pub knows: Knowledge<'a>,
    /// What was tuned for this group of errors on other units.
    pub tuned: Tuned,
    /// Epoch at which the fixes end.
    pub until: usize,
}

/// What a competitor may know.
#[derive(Debug, Clone, Copy)]
pub struct Knowledge<'a> {
    /// The datasheet, which does not say which groups of errors the simulator has: for everybody.
    pub datasheet: &'a ImuSpec,
    /// The simulated IMU: for the oracle.
    pub simulated: &'a ImuSpec,
}

/// A competitor: aided to [`Case::until`], coasting from there to the end. `None` if the standstill gives no attitude.
pub type Scheme = fn(&Case<'_>) -> Option<Coast>;

/// All competitors in the order of the tables, which add `floor`: [`none`] on an IMU with noise only.
pub const SCHEMES: [(&str, Scheme); 8] = [
    ("none", |c| none(c, c.words, c.tuned.none_factor)),
    ("ekf6", |c| ekf6(c, DATASHEET_WALK)),
    ("ekf6-tuned", |c| ekf6(c, c.tuned.walk)),
    ("ekf12", |c| classical(c, ErrorModel::with_scale)),
    ("ekf24", |c| classical(c, ErrorModel::with_matrices)),
    ("ekf-ramp", |c| classical(c, ErrorModel::with_ramps)),
    ("oracle", |c| {
        let assumptions = Assumptions::of(c.knows.datasheet);
        aided_coast(c, c.words, &assumptions, oracle(&c.knows))
    }),
    ("rnn-window", |c| {
        none(c, &rnn_words(c)?, c.tuned.rnn_factor)
    }),
];

/// The aided filter without a model of the IMU; white noise times the factor covers what it does not know.
pub fn none(case: &Case<'_>, words: &[Increment], factor: f64) -> Option<Coast> {
    let mut assumptions = Assumptions::of(case.knows.datasheet);
    assumptions.noise = Noise {
        gyro: assumptions.noise.gyro * factor,
        accel: assumptions.noise.accel * factor,
    };
    aided_coast(case, words, &assumptions, ErrorModel::default())
}

/// Six biases that walk by `walk` of their prior in an hour.
pub fn ekf6(case: &Case<'_>, walk: f64) -> Option<Coast> {
    let mut assumptions = Assumptions::of(case.knows.datasheet);
    assumptions.prior.walk_per_hour = walk;
    let model = ErrorModel::biases(&assumptions.prior);
    aided_coast(case, case.words, &assumptions, model)
}

fn classical(case: &Case<'_>, model: fn(&crate::ekf::Prior) -> ErrorModel) -> Option<Coast> {
    let assumptions = Assumptions::of(case.knows.datasheet);
    aided_coast(case, case.words, &assumptions, model(&assumptions.prior))
}

fn aided_coast(
    case: &Case<'_>,
    words: &[Increment],
    assumptions: &Assumptions,
    model: ErrorModel,
) -> Option<Coast> {
    let session = case.session;
    let (start, first) = aligned(session, words, assumptions)?;
    let mut filter = Aided::new(start.nav, &start.sigma, model, assumptions.noise)
        .with_samples(session.samples())
        .powered_for(first as f64 * EPOCH_S);
    for k in first..case.until {
        aid(&mut filter, session, words, k);
    }
    Some(free(&filter, session, words, case.until))
}

/// Free inertial from the filter's state with its last estimate of the errors.
fn free(filter: &Aided, session: &Session, words: &[Increment], until: usize) -> Coast {
    let (from, dt) = (until * session.steps_per_epoch(), session.step_s());
    let mut corrected = vec![Increment::default(); from];
    let time = |k: usize| (k as f64 + 0.5) * dt;
    corrected.extend(
        words[from..]
            .iter()
            .enumerate()
            .map(|(k, w)| filter.corrected_at(w, dt, time(from + k))),
    );
    coast(
        session,
        &corrected,
        filter.sins.nav,
        until,
        session.epochs(),
    )
}

/// The words behind networks taught over the aided part: the session's own where no network is promoted.
pub fn rnn_words<'a>(case: &Case<'a>) -> Option<Cow<'a, [Increment]>> {
    let assumptions = Assumptions::of(case.knows.datasheet);
    let session = case.session;
    let learnt = study(
        session,
        case.words,
        assumptions,
        &NetworkSpec::default(),
        case.until,
        true,
    )?;
    let silent = Use {
        gyro: false,
        accel: false,
    };
    if learnt.promoted == silent {
        return Some(Cow::Borrowed(case.words));
    }
    let compensator = compensator(session, &learnt.nets, &assumptions);
    let words = corrected_words(session, &compensator, 0..session.epochs());
    Some(Cow::Owned(words))
}

/// The filter that knows what the simulator does: parameters of exactly the errors that are there, with their exact statistics.
fn oracle(knows: &Knowledge<'_>) -> ErrorModel {
    let (g, a) = (&knows.simulated.gyro, &knows.simulated.accel);
    let si = [DEG_PER_H, UG];
    let constant = [
        g.bias_unit_dph.hypot(g.bias_turn_on_dph),
        a.bias_unit_ug.hypot(a.bias_turn_on_ug),
    ];
    let drift = [
        (g.bias_drift_dph, g.bias_drift_time_s),
        (a.bias_drift_ug, a.bias_drift_time_s),
    ];
    let scale = [g.scale_ppm, a.scale_ppm];
    let skew = [g.misalignment_arcsec, a.misalignment_arcsec];
    let warm_up = [
        (g.warm_up_dph, g.warm_up_time_s),
        (a.warm_up_ug, a.warm_up_time_s),
    ];
    let asymmetry = [g.scale_asymmetry_ppm, a.scale_asymmetry_ppm];
    let mut out = ErrorModel::default();
    out.extend(|axis, triad| {
        let k = triad.index();
        let c = |regressor, sigma: f64| Parameter::constant(triad, axis, regressor, sigma);
        let (sigma, time) = (drift[k].0 * si[k], drift[k].1);
        let wandering = Parameter {
            walk: sigma * (2.0 / time).sqrt(),
            time_s: time,
            ..c(Regressor::One, sigma)
        };
        let mut list = vec![c(Regressor::One, constant[k] * si[k]), wandering];
        for j in 0..3 {
            let sigma = if j == axis {
                scale[k] * PPM
            } else {
                skew[k] * crate::units::ARCSEC
            };
            list.push(c(Regressor::Input(j), sigma));
        }
        list.push(c(Regressor::Decay(warm_up[k].1), warm_up[k].0 * si[k]));
        list.push(c(Regressor::Magnitude(axis), asymmetry[k] * PPM));
        if triad == Triad::Accel {
            list.push(c(
                Regressor::Square(axis),
                a.k2_ugpg2 * UG / (crate::units::G0 * crate::units::G0),
            ));
        }
        list.retain(|p| p.sigma > 0.0);
        list
    });
    out
}
