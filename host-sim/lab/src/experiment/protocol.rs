//! Learning from one part of a recording of a moving vehicle and judging on another. Every scheme
//! gets the same fixes and the same samples.
//!
//! Without a standstill, the first attitude is the reference's. Over the learning part the schemes
//! learn from fixes of the reference. Then navigation is free inertial.
//!
//! All navigators begin the judged part at one state, which no scheme's parameters shape
//! ([`Begins`]). If each began at the state of its own aided navigator, a good correction would pay
//! for a start without it: the tilt and the biases of an aided navigator hide each other.
//!
//! The device learns on the learning part with its fixes, is switched off, and is switched on again
//! with its store for the judged part, where it has no fixes. With a live activation it goes on
//! without a power-off. Its navigation computer is that of `raw`, on the device's samples.
//!
//! | scheme | increments of the judged part |
//! |---|---|
//! | `raw` | as recorded |
//! | `ls-bias`, `ls-3x3` | less a bias, or bias and 3x3, fitted to the teacher's references |
//! | `ekf6`, `ekf12`, `ekf24` | less the filter's last estimate (biases; scale factors; 3x3) |
//! | `rnn` | through the compensator, with two networks taught from the same references |
//! | `device` | as they leave the firmware's own application (`learning::device`) |

mod begins;
mod device;
mod learnt;

pub use begins::Begins;
pub(in crate::experiment) use device::{Judged, judged};

use crate::experiment::correction::Correction;
use crate::experiment::outcome::{Bench, Outcome, rows};
use crate::experiment::results::{Curves, SCHEMA};
use crate::experiment::run::{learning_curves, traces};
use host_core::error::Error;
use host_core::inertial::ekf::{ErrorModel, InitialSigma};
use host_core::inertial::free_inertial::{FreeInertial, free_inertial};
use host_core::inertial::motion::Increments;
use host_core::inertial::session::Session;
use host_core::inertial::sins::NavState;
use host_core::words::{agrees, counted};
use host_estimation::learning::baseline::LinearModel;
use host_estimation::learning::corrected::corrected_motion;
use host_estimation::learning::device::Device;
use host_estimation::learning::fit::{FittedNetworks, fit_from};
use host_estimation::learning::teacher::{Assumptions, Nominal};
use host_estimation::learning::window::compensator;
use host_unit::scenario::network::NetworkSpec;
use learnt::{Learnt, aided};
use std::ops::Range;

/// The learning part and the judged part, in epochs of the session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Split {
    /// Learning part, with fixes.
    pub learn: Range<usize>,
    /// Judged part, free inertial.
    pub judge: Range<usize>,
}

impl Split {
    /// Learning on the first `learn` of `epochs`, judging on the rest.
    #[must_use]
    pub fn forward(epochs: usize, learn: usize) -> Self {
        let cut = learn.min(epochs);
        Self {
            learn: 0..cut,
            judge: cut..epochs,
        }
    }

    /// Exchanged parts: learning on the last `learn` of `epochs`, judging on the first.
    #[must_use]
    pub fn exchanged(epochs: usize, learn: usize) -> Self {
        let cut = epochs.saturating_sub(learn);
        Self {
            learn: cut..epochs,
            judge: 0..cut,
        }
    }

    /// Whether the judged part follows the learning part.
    #[must_use]
    pub fn follows(&self) -> bool {
        self.learn.end == self.judge.start
    }

    /// A description of the two parts.
    #[must_use]
    pub fn case(&self) -> String {
        let (l, j) = (&self.learn, &self.judge);
        format!(
            "learn {}-{} s, judge {}-{} s",
            l.start, l.end, j.start, j.end
        )
    }
}

/// What is known of the unit, and settings of the networks' training.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Assumptions about the sensors.
    pub assumptions: Assumptions,
    /// The device of the same unit, before the learning part.
    pub device: Device,
    /// Errors of the reference as the state of this IMU, mounting included. `None`: those of a
    /// self-alignment.
    pub start_sigma: Option<InitialSigma>,
    /// Where the navigators begin the judged part.
    pub begins: Begins,
    /// Settings of the training.
    pub network: NetworkSpec,
    /// Whether `rnn` uses only networks that are proven on a held-back part, as on the device.
    pub promoted_only: bool,
    /// Times of the table, s after the start of the judged part.
    pub times_s: Vec<u32>,
}

/// Learns, then judges every scheme. `None` when a standstill does not give an attitude.
///
/// # Errors
/// A long recording needs temporary files, and they cannot be written or read.
pub fn judge(
    recording: &str,
    session: &Session,
    split: &Split,
    settings: &Settings,
) -> Result<Option<Outcome>, Error> {
    let judged = judge_and_correct(recording, session, split, settings, None)?;
    Ok(judged.map(|(outcome, _)| outcome))
}

/// [`judge`], with the corrections by one of the schemes. The judged part must follow the
/// learning part, which begins with the session.
///
/// # Errors
/// As [`judge`].
pub fn judge_and_correct(
    recording: &str,
    session: &Session,
    split: &Split,
    settings: &Settings,
    corrected_by: Option<&str>,
) -> Result<Option<(Outcome, Correction)>, Error> {
    let Some(learnt) = Learnt::from(session, split, settings)? else {
        session.counts.check()?;
        return Ok(None);
    };
    let records = learnt.nominal.records.clone();
    let correction = corrected_by.map_or(Correction::Nothing, |scheme| {
        learnt.correction(scheme, session)
    });
    let outcome = outcome(recording, session, split, settings, learnt);
    session.counts.check()?;
    records.check()?;
    Ok(outcome.map(|outcome| (outcome, correction)))
}

/// Judges every scheme.
fn outcome(
    recording: &str,
    session: &Session,
    split: &Split,
    settings: &Settings,
    learnt: Learnt,
) -> Option<Outcome> {
    let (begin, residual, start) = begins::begin(session, split, settings, &learnt)?;
    let solutions = solutions(session, split, settings, &learnt, begin)?;
    let Learnt {
        lesson,
        nominal,
        fitted,
        device,
        ..
    } = learnt;
    let note = match settings.promoted_only {
        true => fitted.verdict(),
        false => gate(&lesson, &nominal, settings),
    };
    let judged = |t: &usize| session.judges(split.judge.start + t);
    let mut times_s = settings.times_s.clone();
    times_s.retain(|t| judged(&(*t as usize)));
    let mut notes = vec![note, device.note.clone()];
    let left = settings.times_s.len() - times_s.len();
    if left > 0 {
        notes.push(format!(
            "{left} of {} {} left out of the table, because there is no reference then.",
            counted(settings.times_s.len(), "time"),
            agrees(left, "is", "are")
        ));
    }
    let origin = session.reference[split.judge.start].position;
    let reference: Vec<[f64; 2]> = session.reference[split.judge.start..=split.judge.end]
        .iter()
        .map(|s| s.position.ned_from(&origin))
        .map(|p| [p.x, p.y])
        .collect();
    let limit = settings.device.configuration().correction.limit;
    let bench = Bench::of(
        &device,
        session,
        limit,
        split.learn.clone(),
        split.judge.clone(),
    );
    Some(Outcome {
        schema: SCHEMA,
        recording: recording.to_owned(),
        case: split.case(),
        start,
        residual,
        rows: rows(&solutions, &times_s),
        notes,
        warnings: Vec::new(),
        curves: Curves {
            learning: learning_curves(&fitted),
            traces: traces(&lesson, &fitted),
            ..Curves::of(&solutions, &reference, judged)
        },
        bench: Some(Box::new(bench)),
    })
}

/// Free inertial navigation of every scheme over the part that is judged: from `begin`, or each
/// from its own aided state.
fn solutions(
    session: &Session,
    split: &Split,
    settings: &Settings,
    learnt: &Learnt,
    begin: Option<NavState>,
) -> Option<Vec<(&'static str, FreeInertial)>> {
    let (range, from) = match split.follows() {
        true => (split.learn.start..split.judge.end, learnt.lesson.epochs()),
        false => (split.judge.clone(), 0),
    };
    let run = session.cut(&range);
    let to = run.epochs();
    let own = |increments: &Increments<'_>| {
        let plain = || aided(&run, increments, ErrorModel::default(), settings, from);
        begin.or_else(|| Some(plain()?.sins.nav))
    };
    let mut out: Vec<(&str, FreeInertial)> = Vec::new();
    for (scheme, increments) in corrected(&run, &learnt.fitted) {
        let nav = own(&increments)?;
        out.push((scheme, free_inertial(&run, &increments, nav, from, to)));
    }
    for (k, (name, filter)) in learnt.filters.iter().enumerate() {
        let step = run.step_s();
        let frozen = run.motion().map(move |w| filter.corrected(w, step));
        let nav = begin.unwrap_or(filter.sins.nav);
        out.insert(3 + k, (name, free_inertial(&run, &frozen, nav, from, to)));
    }
    let device = match learnt.device.changed {
        false => out.first()?.1.clone(),
        true => {
            let own_samples = Session {
                counts: learnt.device.corrected.clone(),
                ..run.clone()
            };
            let increments = own_samples.motion();
            let nav = own(&increments)?;
            free_inertial(&run, &increments, nav, from, to)
        }
    };
    out.push(("device", device));
    Some(out)
}

/// Increments of the schemes that need no filter of their own.
fn corrected<'a>(
    run: &'a Session,
    fitted: &'a FittedNetworks,
) -> [(&'static str, Increments<'a>); 4] {
    let linear = |m: &'a LinearModel| run.motion().map(|w| m.correct(w, run.dt));
    let nets = compensator(run, &fitted.nets, &fitted.assumptions);
    [
        ("raw", run.motion()),
        ("ls-bias", linear(&fitted.bias)),
        ("ls-3x3", linear(&fitted.linear)),
        ("rnn", corrected_motion(run, nets)),
    ]
}

/// The verdict of the device's test on networks that learnt from the same part, with its end held
/// back.
fn gate(lesson: &Session, nominal: &Nominal, settings: &Settings) -> String {
    let fitted = fit_from(
        lesson,
        &lesson.motion(),
        nominal,
        settings.assumptions,
        &settings.network,
        true,
    );
    let percent = 100.0 * settings.network.held_back;
    format!(
        "The row `rnn` is learnt from the whole learning part and unjudged. With its last {percent:.0} % held back: {}",
        fitted.verdict()
    )
}

#[cfg(test)]
mod tests;
