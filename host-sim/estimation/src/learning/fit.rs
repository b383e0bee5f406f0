//! Learning from one session: references, linear fits, two networks, and the decision whether the
//! networks may be used.

use crate::learning::baseline::{LinearModel, Sample, fit_3x3, fit_bias};
use crate::learning::promotion::{THRESHOLD, log_likelihood};
use crate::learning::teacher::{Assumptions, Nominal, Reference, navigate, references};
use crate::learning::window::{
    Inputs, Taught, compensator, corrected_counts, increments_from, inputs, normalisation, silent,
    teach,
};
use firmware::inputs::OWN;
use firmware::sample::Counts;
use host_core::inertial::motion::{Increments, Motion};
use host_core::inertial::session::{Session, to_si};
use host_unit::scenario::network::NetworkSpec;
use lrnn_nostd::Net;
use nalgebra::Vector3;
use std::ops::Range;

/// Which of the two networks are in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Gyro network.
    pub gyro: bool,
    /// Accelerometer network.
    pub accel: bool,
}

impl Use {
    /// Samples whose triads are corrected where their network is in use.
    fn of(self, corrected: &[Counts], raw: &[Counts]) -> Vec<Counts> {
        let pairs = corrected.iter().zip(raw);
        let chosen = pairs.map(|(corrected, raw)| Counts {
            dtheta: if self.gyro { corrected } else { raw }.dtheta,
            dv: if self.accel { corrected } else { raw }.dv,
        });
        chosen.collect()
    }
}

/// All results of learning from a session.
#[derive(Debug, Clone)]
pub struct FittedNetworks {
    /// References over the part learnt from.
    pub references: Vec<Reference>,
    /// Least-squares bias.
    pub bias: LinearModel,
    /// Least-squares bias + 3x3.
    pub linear: LinearModel,
    /// The taught networks, before promotion.
    pub taught: [Taught; 2],
    /// The networks to use. A network that was not promoted has zero output.
    pub nets: [Net; 2],
    /// The networks that were promoted.
    pub promoted: Use,
    /// Log-likelihood ratios on the held-back part: of both networks, of the gyro network only, of
    /// the accelerometer network only. Empty if nothing was held back.
    pub evidence: Vec<(Use, f64)>,
    /// Assumptions of the fit.
    pub assumptions: Assumptions,
}

/// Learns from the epochs of a session up to `until`. `increments` are its [`Session::increments`].
///
/// With `hold_back` the last [`NetworkSpec::held_back`] of the epochs teach nothing and only judge.
/// Without it all epochs teach and nothing is judged, as in the paper. `None` when the standstill
/// gives no attitude.
#[must_use]
pub fn fit(
    session: &Session,
    increments: &dyn Motion,
    assumptions: Assumptions,
    spec: &NetworkSpec,
    until: usize,
    hold_back: bool,
) -> Option<FittedNetworks> {
    let nominal = navigate(session, increments, &assumptions, until)?;
    Some(fit_from(
        session,
        increments,
        &nominal,
        assumptions,
        spec,
        hold_back,
    ))
}

/// [`fit`] with a nominal trajectory that is already known. All its records are used.
#[must_use]
pub fn fit_from(
    session: &Session,
    increments: &dyn Motion,
    nominal: &Nominal,
    mut assumptions: Assumptions,
    spec: &NetworkSpec,
    hold_back: bool,
) -> FittedNetworks {
    // the inputs of the paper's networks are their own triads, whatever those of the device are
    assumptions.inputs = OWN;
    let total = nominal.records.len();
    let learnt = if hold_back {
        total - (total as f64 * spec.held_back) as usize
    } else {
        total
    };
    let references = references(nominal, learnt);

    let norm = normalisation(&assumptions);
    let quiet = silent(&assumptions);
    let until = nominal.first + total;
    let inputs = inputs(session, &compensator(session, &quiet, &assumptions), until);
    let (gyro, accel) = rayon::join(
        || {
            teach(spec, norm[0], &inputs.rate, &references, |r| {
                (r.error.dtheta, r.sigma.dtheta)
            })
        },
        || {
            teach(spec, norm[1], &inputs.force, &references, |r| {
                (r.error.dv, r.sigma.dv)
            })
        },
    );
    let taught = [gyro, accel];
    let (bias, linear) = linear_fits(&inputs, &references);
    let mut out = FittedNetworks {
        references,
        bias,
        linear,
        nets: [taught[0].net, taught[1].net],
        taught,
        promoted: Use {
            gyro: true,
            accel: true,
        },
        evidence: Vec::new(),
        assumptions,
    };
    if hold_back {
        let (from, to) = (nominal.first + learnt, nominal.first + total);
        out.promote(session, increments, nominal, from, to);
    }
    out
}

fn linear_fits(inputs: &Inputs, references: &[Reference]) -> (LinearModel, LinearModel) {
    let v = |x: [f32; 3]| Vector3::from(x.map(f64::from));
    let gyro: Vec<Sample> = references
        .iter()
        .map(|r| (v(inputs.rate[r.epoch]), r.error.dtheta))
        .collect();
    let accel: Vec<Sample> = references
        .iter()
        .map(|r| (v(inputs.force[r.epoch]), r.error.dv))
        .collect();
    (
        LinearModel {
            gyro: fit_bias(&gyro),
            accel: fit_bias(&accel),
        },
        LinearModel {
            gyro: fit_3x3(&gyro),
            accel: fit_3x3(&accel),
        },
    )
}

impl FittedNetworks {
    /// The decision on the networks, in a sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let best = self
            .evidence
            .iter()
            .map(|e| e.1)
            .fold(f64::NEG_INFINITY, f64::max);
        let ratio =
            format!("log-likelihood ratio on the held-back part {best:.1}, needed {THRESHOLD}");
        match self.promoted {
            Use {
                gyro: true,
                accel: true,
            } => format!("Both networks are in use: {ratio}."),
            Use {
                gyro: true,
                accel: false,
            } => format!(
                "Only the gyro network is in use, the accelerometers are left alone: {ratio}."
            ),
            Use {
                gyro: false,
                accel: true,
            } => format!(
                "Only the accelerometer network is in use, the gyros are left alone: {ratio}."
            ),
            Use {
                gyro: false,
                accel: false,
            } => {
                format!(
                    "The correction is left at zero, since nothing learnt has proved itself: {ratio}."
                )
            }
        }
    }

    fn promote(
        &mut self,
        session: &Session,
        increments: &dyn Motion,
        nominal: &Nominal,
        from: usize,
        to: usize,
    ) {
        let assumptions = self.assumptions;
        let base = log_likelihood(session, increments, nominal, &assumptions, from, to);
        let choices =
            [(true, true), (true, false), (false, true)].map(|(gyro, accel)| Use { gyro, accel });
        let quiet = silent(&self.assumptions);
        let pick = |u: Use| {
            let net = |k: usize, used: bool| {
                if used { self.taught[k].net } else { quiet[k] }
            };
            [net(0, u.gyro), net(1, u.accel)]
        };
        // The triads are corrected independently, and a network with zero output leaves its counts
        // unchanged. So one pass with both networks serves all three choices.
        let nets = [self.taught[0].net, self.taught[1].net];
        let both = compensator(session, &nets, &self.assumptions);
        let both = corrected_counts(session, &both, from..to);
        let n = session.samples_per_epoch();
        let raw = session.counts.part(from * n..to * n);
        let chosen =
            |u: Use, samples: Range<usize>| u.of(&both[samples.clone()], &raw.block(samples));
        let evidence = |u: Use| {
            let increments = match session.gather {
                1 => Increments::Made(Box::new(move |k| {
                    let epoch = chosen(u, (k - from) * n..(k - from + 1) * n);
                    epoch.iter().map(|c| to_si(c, &session.lsb)).collect()
                })),
                _ => {
                    let all = chosen(u, 0..both.len());
                    Increments::All(increments_from(session, from, all.into_iter()))
                }
            };
            log_likelihood(session, &increments, nominal, &assumptions, from, to) - base
        };
        self.evidence = choices.map(|u| (u, evidence(u))).to_vec();
        let best = self.evidence.iter().copied().fold(
            (
                Use {
                    gyro: false,
                    accel: false,
                },
                THRESHOLD,
            ),
            |best, e| if e.1 > best.1 { e } else { best },
        );
        self.promoted = best.0;
        self.nets = pick(best.0);
    }
}
