//! The competitors of a campaign: each is aided by fixes up to an epoch and coasts from there, on the same words.

use crate::coast::{Coast, coast};
use crate::ekf::{Aided, ErrorModel, Noise, Parameter, Regressor, Triad};
use crate::imu::ImuSpec;
use crate::learning::{NetworkSpec, compensate, compensator};
use crate::session::EPOCH_S;
use crate::session::Session;
use crate::sins::Increment;
use crate::study::study;
use crate::teacher::{Assumptions, aid, aligned};
use crate::units::{DEG_PER_H, PPM, UG};

/// What a competitor is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// The aided filter without a model of the IMU; white noise times the factor covers what it does not know.
    None(f64),
    /// Six biases that walk; the factor is `walk_per_hour`.
    Ekf6(f64),
    /// Biases and scale factors.
    Ekf12,
    /// Biases and 3x3 matrices.
    Ekf24,
    /// Biases with ramps.
    EkfRamp,
    /// A filter that is told the simulator's error structure and time constants.
    Oracle,
    /// Networks taught over the aided part, then the filter without a model, with this noise factor, on the corrected words.
    RnnWindow(f64),
}

/// What a competitor may know.
#[derive(Debug, Clone, Copy)]
pub struct Knowledge<'a> {
    /// The datasheet, which does not say which groups of errors the simulator has: for everybody.
    pub datasheet: &'a ImuSpec,
    /// The simulated IMU: for the oracle.
    pub simulated: &'a ImuSpec,
}

/// Aided over `first..until`, coasting from there to the end. `None` if the standstill gives no attitude.
#[must_use]
pub fn judge(
    scheme: Scheme,
    session: &Session,
    words: &[Increment],
    knows: &Knowledge<'_>,
    until: usize,
) -> Option<Coast> {
    let mut assumptions = Assumptions::of(knows.datasheet);
    let prior = assumptions.prior;
    let model = match scheme {
        Scheme::None(factor) => {
            assumptions.noise = scaled(assumptions.noise, factor);
            ErrorModel::default()
        }
        Scheme::Ekf6(walk) => {
            assumptions.prior.walk_per_hour = walk;
            ErrorModel::biases(&assumptions.prior)
        }
        Scheme::Ekf12 => ErrorModel::with_scale(&prior),
        Scheme::Ekf24 => ErrorModel::with_matrices(&prior),
        Scheme::EkfRamp => ErrorModel::with_ramps(&prior),
        Scheme::Oracle => oracle(knows),
        Scheme::RnnWindow(factor) => return rnn_window(session, knows, factor, until),
    };
    aided_coast(session, words, &assumptions, model, until)
}

fn scaled(noise: Noise, factor: f64) -> Noise {
    Noise {
        gyro: noise.gyro * factor,
        accel: noise.accel * factor,
    }
}

fn aided_coast(
    session: &Session,
    words: &[Increment],
    assumptions: &Assumptions,
    model: ErrorModel,
    until: usize,
) -> Option<Coast> {
    let (start, first) = aligned(session, words, assumptions)?;
    let filter = Aided::new(start.nav, &start.sigma, model, assumptions.noise);
    let mut filter = filter.powered_for(first as f64 * EPOCH_S);
    for k in first..until {
        aid(&mut filter, session, words, k);
    }
    Some(free(&filter, session, words, until))
}

/// Free inertial from the filter's state with its last estimate of the errors.
fn free(filter: &Aided, session: &Session, words: &[Increment], until: usize) -> Coast {
    let from = until * session.words_per_epoch();
    let mut corrected = vec![Increment::default(); from];
    let time = |k: usize| (k as f64 + 0.5) * session.dt;
    corrected.extend(
        words[from..]
            .iter()
            .enumerate()
            .map(|(k, w)| filter.corrected_at(w, session.dt, time(from + k))),
    );
    coast(
        session,
        &corrected,
        filter.sins.nav,
        until,
        session.epochs(),
    )
}

fn rnn_window(
    session: &Session,
    knows: &Knowledge<'_>,
    factor: f64,
    until: usize,
) -> Option<Coast> {
    let assumptions = Assumptions::of(knows.datasheet);
    let learnt = study(session, assumptions, &NetworkSpec::default(), until, true)?;
    let corrected = compensate(session, &compensator(session, &learnt.nets, &assumptions)).session;
    let words = corrected.increments();
    judge(Scheme::None(factor), &corrected, &words, knows, until)
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
