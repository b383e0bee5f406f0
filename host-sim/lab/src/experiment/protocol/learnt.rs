//! Learning from one part of a recording, for every scheme.

use super::{Judged, Settings, Split, judged};
use crate::experiment::correction::Correction;
use firmware::learn::bank::Gates;
use host_core::error::Error;
use host_core::inertial::align;
use host_core::inertial::ekf::{Aided, ErrorModel};
use host_core::inertial::motion::Motion;
use host_core::inertial::session::Session;
use host_estimation::learning::considered::considered as of_biases;
use host_estimation::learning::corrected::estimates;
use host_estimation::learning::fit::{FittedNetworks, fit_from};
use host_estimation::learning::fix_learner::learn;
use host_estimation::learning::teacher::{
    Assumptions, Nominal, Start, aid, aligned, navigate_from,
};
use host_estimation::learning::window::compensator;
use nalgebra::Vector3;

/// The classical filters beside the networks, with the walk of the biases by the datasheet.
fn classical(assumptions: &Assumptions) -> [(&'static str, ErrorModel); 3] {
    let prior = assumptions.walking(assumptions.datasheet_walk()).prior;
    [
        ("ekf6", ErrorModel::biases(&prior)),
        ("ekf12", ErrorModel::with_scale(&prior)),
        ("ekf24", ErrorModel::with_matrices(&prior)),
    ]
}

/// Results of the part to learn from.
pub(super) struct Learnt {
    pub(super) lesson: Session,
    pub(super) nominal: Nominal,
    pub(super) fitted: FittedNetworks,
    pub(super) filters: Vec<(&'static str, Aided)>,
    pub(super) device: Judged,
}

impl Learnt {
    /// Learns. `None` when a standstill does not give an attitude, or samples and fixes contradict
    /// each other.
    ///
    /// # Errors
    /// A long part needs a temporary file, and it cannot be written.
    pub(super) fn from(
        session: &Session,
        split: &Split,
        settings: &Settings,
    ) -> Result<Option<Self>, Error> {
        let a = &settings.assumptions;
        let lesson = session.cut(&split.learn);
        let (increments, until) = (lesson.motion(), lesson.epochs());
        let Some((first, start)) = begin(&lesson, &increments, settings) else {
            return Ok(None);
        };
        let nominal = navigate_from(&lesson, &increments, a, &start, first, until);
        nominal.records.check()?;
        let fitted = fit_from(
            &lesson,
            &increments,
            &nominal,
            *a,
            &settings.network,
            settings.promoted_only,
        );
        let filters = classical(a)
            .into_iter()
            .map(|(name, model)| Some((name, aided(&lesson, &increments, model, settings, until)?)))
            .collect::<Option<_>>();
        drop(increments);
        let device = judged(session, split, settings)?;
        // Where a navigator gives up that begins at the known state, samples and fixes contradict
        // each other. The device does not begin there: it aligns itself.
        let gives_up = || learn(&lesson, a, Gates::default(), Some(&start), until).is_none();
        if lesson.standstill == 0 && gives_up() {
            return Ok(None);
        }
        let learnt = filters.map(|filters| Self {
            filters,
            device,
            lesson,
            nominal,
            fitted,
        });
        Ok(learnt)
    }

    /// The correction by a scheme for the samples of the whole session.
    pub(super) fn correction(&self, scheme: &str, session: &Session) -> Correction {
        let filter = self.filters.iter().find(|(name, _)| *name == scheme);
        match (scheme, filter) {
            (_, Some((_, filter))) => {
                Correction::Filter(Box::new(filter.clone()), self.lesson.epochs())
            }
            ("ls-bias", _) => Correction::Linear(self.fitted.bias),
            ("ls-3x3", _) => Correction::Linear(self.fitted.linear),
            ("rnn", _) => {
                let compensator = compensator(session, &self.fitted.nets, &self.fitted.assumptions);
                let mut errors = vec![compensator.power_on(false).estimate()];
                errors.extend(estimates(session, &compensator));
                Correction::Epochs(errors)
            }
            ("device", _) => Correction::Epochs(self.device.correction.clone()),
            _ => Correction::Nothing,
        }
    }
}

/// First epoch after alignment and the state there. Without a standstill it is the session's own
/// start, else the reference's.
fn begin(
    session: &Session,
    increments: &dyn Motion,
    settings: &Settings,
) -> Option<(usize, Start)> {
    let first = session.standstill;
    if let Some(start) = session.start.filter(|_| first == 0) {
        return Some((0, start));
    }
    let mut nav = session.referenced(first);
    if first > 0 {
        let standstill = increments.beginning(first, session.samples_per_epoch());
        nav.q_bn = align::inertial_frame(
            &standstill,
            session.dt,
            session.samples(),
            session.nearest_fix(0).position,
        )?;
        let fix = session.nearest_fix(first);
        nav.position = session.imu_position(&fix.position, &nav.q_bn);
        nav.velocity = Vector3::zeros();
    }
    let sigmas = session.nearest_fix(first).start_sigmas();
    let aligned = || settings.assumptions.initial_sigma(&nav, &sigmas);
    let sigma = settings.start_sigma.unwrap_or_else(aligned);
    Some((first, Start { nav, sigma }))
}

/// The beginning of a filter: from an alignment at standstill, else from the reference's first
/// state; and the epoch at which it begins.
fn begun(
    session: &Session,
    increments: &dyn Motion,
    settings: &Settings,
) -> Option<(usize, impl Fn(ErrorModel) -> Aided)> {
    let a = settings.assumptions;
    let aligned = match session.standstill {
        0 => None,
        _ => Some(aligned(session, increments)?),
    };
    let (first, start) = match &aligned {
        Some(aligned) => (aligned.first, aligned.start(&a)),
        None => begin(session, increments, settings)?,
    };
    let samples = session.samples();
    let filter = move |model| match &aligned {
        Some(aligned) => aligned.filter(model, &a),
        None => Aided::new(start.nav, &start.sigma, model, a.noise).with_samples(samples),
    };
    Some((first, filter))
}

/// A filter with fixes up to epoch `until`.
pub(super) fn aided(
    session: &Session,
    increments: &dyn Motion,
    model: ErrorModel,
    settings: &Settings,
    until: usize,
) -> Option<Aided> {
    let (first, filter) = begun(session, increments, settings)?;
    let mut filter = filter(model);
    for k in first..until {
        aid(&mut filter, session, increments, k);
    }
    Some(filter)
}

/// Standard deviations of six biases that are learnt from a session, after each second, infinite
/// before the first: see [`learning::considered`](host_estimation::learning::considered).
pub(super) fn considered(session: &Session, settings: &Settings) -> Vec<[f64; 6]> {
    let increments = session.motion();
    let Some((first, filter)) = begun(session, &increments, settings) else {
        return Vec::new();
    };
    let epochs = first..session.epochs();
    let all = of_biases(session, &increments, &settings.assumptions, filter, epochs);
    let sigmas = all
        .iter()
        .map(|p| std::array::from_fn(|k| p[(k, k)].sqrt()));
    let before = std::iter::repeat_n([f64::INFINITY; 6], first);
    before.chain(sigmas).collect()
}
