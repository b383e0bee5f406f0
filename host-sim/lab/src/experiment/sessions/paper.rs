//! The paper's vehicle test on real drives: learnt on a drive with satellite fixes as the teacher,
//! judged without fixes on the same drive (the paper's protocol), on its second half, and on the
//! next drive.
//!
//! Every judged part starts from a state of the reference. The networks `rnn` are the paper's,
//! taught and used without any proof, and so are the least-squares fits beside them. The device
//! learns on the learning part, is switched off and on again, and has no fixes then.

use super::coasts::{Coasts, Scheme, Starts};
use super::reference::{Reference, reference};
use super::rivals;
use super::timeline::Timeline;
use super::{Assumed, Plan, contradiction, device};
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use host_estimation::learning::device::{Device, configured};
use host_estimation::learning::fit::fit_from;
use host_estimation::learning::recall::FILTERS;
use host_estimation::learning::teacher::{Start, navigate_from};
use host_estimation::learning::window::{compensator, corrected_increments};
use host_unit::scenario::network::NetworkSpec;
use serde::Serialize;

/// The protocols.
const CASES: [&str; 3] = ["same drive", "second half", "next drive"];

/// The error of a scheme in one protocol.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperRow {
    /// Name of the drive that is learnt from.
    pub drive: String,
    /// The protocol: `same drive`, `second half` or `next drive`.
    pub judged_on: String,
    /// The scheme.
    pub scheme: String,
    /// Time without fixes, s.
    pub horizon_s: f64,
    /// Horizontal error at its end, m.
    pub error_m: f64,
}

/// A drive with its reference.
struct Drive {
    timeline: Timeline,
    reference: Reference,
}

/// Runs the test on some drives of one unit, `horizon_s` seconds without fixes.
///
/// # Errors
/// Samples and fixes of a drive contradict each other.
pub fn paper(
    timelines: Vec<Timeline>,
    plan: &Plan,
    horizon_s: f64,
) -> Result<Vec<PaperRow>, Error> {
    let assumed = Assumed::of(&plan.assumptions);
    let drives: Vec<Drive> = timelines
        .into_iter()
        .map(|mut timeline| {
            let reference =
                reference(&mut timeline).map_err(|residual| contradiction(&timeline, residual))?;
            Ok(Drive {
                timeline,
                reference,
            })
        })
        .collect::<Result<_, Error>>()?;
    let mut rows = Vec::new();
    for (k, drive) in drives.iter().enumerate() {
        let (all, half) = (
            drive.timeline.duration_s(),
            0.5 * drive.timeline.duration_s(),
        );
        let cases = [
            (all, Some((drive, 0.0))),
            (half.floor(), Some((drive, half.floor()))),
            (all, drives.get(k + 1).map(|next| (next, 0.0))),
        ];
        for (name, (learn_s, judged)) in CASES.iter().zip(cases) {
            if let Some((judged, from_s)) = judged {
                let case = Case {
                    learnt: drive,
                    learn_s,
                    judged,
                    from_s,
                    horizon_s,
                };
                rows.extend(case.rows(name, plan, &assumed));
            }
        }
    }
    Ok(rows)
}

/// One drive to learn from up to a time, and one to be judged on from a time on.
struct Case<'a> {
    learnt: &'a Drive,
    learn_s: f64,
    judged: &'a Drive,
    from_s: f64,
    horizon_s: f64,
}

impl Case<'_> {
    fn rows(&self, name: &str, plan: &Plan, assumed: &Assumed) -> Vec<PaperRow> {
        let judged = &self.judged.timeline;
        let horizons = [self.horizon_s];
        let coasts = Coasts {
            timeline: judged,
            reference: &self.judged.reference,
            assumed,
            horizons: &horizons,
        };
        let row = |(scheme, increments): (&str, Vec<Increment>)| {
            let of = Scheme::Increments(&increments);
            let errors = coasts.errors(&of, Starts::At(self.from_s));
            let [error_m, _] = *errors.first()?.first()?;
            Some(PaperRow {
                drive: self.learnt.timeline.name.clone(),
                judged_on: name.to_owned(),
                scheme: scheme.to_owned(),
                horizon_s: self.horizon_s,
                error_m,
            })
        };
        let mut all = vec![("uncorrected", judged.increments.clone())];
        all.extend(self.fitted(plan));
        for (k, filter) in FILTERS.iter().enumerate() {
            let at = (&self.learnt.timeline, &self.learnt.reference);
            let passes = rivals::passes(k, at, assumed, &mut None, &[self.learn_s]);
            all.extend(
                passes.map(|passes| (*filter, rivals::corrected(judged, &passes.alone.at[0]))),
            );
        }
        let configuration = configured(&plan.configuration, &self.learnt.timeline.session);
        let mut device = Device::new(&configuration);
        device::drive(&mut device, &self.learnt.timeline, self.learn_s);
        let drive = device::drive(&mut device, judged, 0.0);
        all.push(("device", device::increments(judged, &drive)));
        all.into_iter().filter_map(row).collect()
    }

    /// The increments of the judged drive by least squares and by the paper's networks.
    fn fitted(&self, plan: &Plan) -> [(&'static str, Vec<Increment>); 3] {
        let (learnt, judged) = (&self.learnt.timeline, &self.judged.timeline);
        let session = learnt.session.cut(&(0..self.learn_s as usize));
        let increments = session.increments();
        let nav = self.learnt.reference.states[0].1;
        let sigma = rivals::start_sigma();
        let start = Start { nav, sigma };
        let a = &plan.assumptions;
        let nominal = navigate_from(&session, &increments, a, &start, 0, session.epochs());
        let spec = NetworkSpec::short();
        let fitted = fit_from(&session, &increments, &nominal, *a, &spec, false);
        let linear = |model: &host_estimation::learning::baseline::LinearModel| {
            let all = judged.increments.iter();
            all.map(|w| model.correct(w, judged.step_s)).collect()
        };
        let all = 0..judged.session.epochs();
        let networks = compensator(&judged.session, &fitted.nets, &fitted.assumptions);
        [
            ("ls-bias", linear(&fitted.bias)),
            ("ls-3x3", linear(&fitted.linear)),
            ("rnn", corrected_increments(&judged.session, &networks, all)),
        ]
    }
}
