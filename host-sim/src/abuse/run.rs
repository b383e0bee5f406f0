//! One unit with one kind of sensor through some cases.

use super::Abuse;
use super::act::Act;
use super::case::Case;
use super::computer;
use super::device::{self, Format, Input, Outcome};
use super::line::{self, Frame};
use super::names::{Activation, Computer, Sensor};
use super::receiver;
use super::times::Span;
use super::told;
use super::world::{World, corrected, sensor_faults};
use crate::error::Error;
use crate::inertial::session::Session;
use crate::inertial::sins::Increment;
use crate::learning::teacher::Assumptions;
use crate::unit::sensor::FormatName;
use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::learn::{FixLearner, FixMemory, Learner, Settings};
use firmware::model::Nets;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;

/// Calls the second argument with a learner for this configuration.
pub type Teach<'a> = &'a (dyn Fn(&Configuration, &mut dyn FnMut(&mut dyn Learner)) + Sync);

/// The device's learner from fixes.
pub fn fix_learner(told: &Configuration, then: &mut dyn FnMut(&mut dyn Learner)) {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = FixLearner::new(&mut memory, Settings::of(told));
    then(&mut learner);
}

/// What came of one case in one run, behind one navigation computer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Name of the case.
    pub case: String,
    /// The sensor.
    pub sensor: Sensor,
    /// The navigation computer.
    pub computer: Computer,
    /// When corrections act.
    pub activation: Activation,
    /// Number of the run.
    pub run: u32,
    /// Horizontal error at the end without the device, m.
    pub raw_m: f64,
    /// The same with the device's corrections, m.
    pub corrected_m: f64,
    /// The device corrected something: live, a hypothesis was promoted; at the next power-on,
    /// something had been stored.
    pub promoted: bool,
    /// A promoted hypothesis was given up for "no correction".
    pub rolled_back: bool,
    /// Faults that the device ever raised: bits of `fault` of the command link.
    pub faults: u32,
}

/// Both drives of a unit in one motion, as one kind of sensor measures them.
pub(super) struct Bench<'a> {
    abuse: &'a Abuse,
    sensor: Sensor,
    run: u32,
    worlds: [OnceCell<World>; 2],
    /// Undisturbed samples of both drives, with the errors of each computer on them.
    clean: [OnceCell<(Session, Vec<f64>)>; 2],
    assumptions: Assumptions,
    teach: Teach<'a>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(abuse: &'a Abuse, sensor: Sensor, run: u32, teach: Teach<'a>) -> Self {
        Self {
            abuse,
            sensor,
            run,
            worlds: [OnceCell::new(), OnceCell::new()],
            clean: [OnceCell::new(), OnceCell::new()],
            assumptions: Assumptions::of(&told::unit()),
            teach,
        }
    }

    fn world(&self, case: &Case, activation: Activation) -> &World {
        let (times, motion) = (&self.abuse.times, case.motion());
        match activation {
            Activation::Live => {
                self.worlds[0].get_or_init(|| World::learning(times, motion, self.run))
            }
            Activation::NextPowerOn => {
                self.worlds[1].get_or_init(|| World::next(times, motion, self.run))
            }
        }
    }

    /// Epoch at which a drive's fixes end.
    fn until(&self, activation: Activation) -> usize {
        let times = &self.abuse.times;
        match activation {
            Activation::Live => times.until() as usize,
            Activation::NextPowerOn => times.standstill_s as usize,
        }
    }

    /// Errors of the computers with these corrections.
    fn errors(&self, session: &Session, correction: &[Increment], of: Activation) -> Vec<f64> {
        let increments = corrected(session, correction);
        let until = self.until(of);
        let computers = self.abuse.computers.iter();
        computers
            .map(|&which| computer::error(which, session, &increments, &self.assumptions, until))
            .collect()
    }

    /// The samples of a drive as a case leaves them, with the errors of the computers on them.
    fn measured<'s>(
        &'s self,
        case: &Case,
        of: Activation,
        own: &'s mut Option<(Session, Vec<f64>)>,
    ) -> &'s (Session, Vec<f64>) {
        let times = &self.abuse.times;
        let make = |faults: &[_]| {
            let session = self.world(case, of).measured(self.sensor, faults, times);
            let none = vec![Increment::default(); session.counts.len()];
            let errors = self.errors(&session, &none, of);
            (session, errors)
        };
        let next = of == Activation::NextPowerOn;
        let faults = sensor_faults(case);
        if faults.iter().any(|(fault, _)| fault.acts(next)) {
            return own.insert(make(&faults));
        }
        self.clean[usize::from(next)].get_or_init(|| make(&[]))
    }

    /// A case with all computers and activations.
    ///
    /// # Errors
    /// Values of the case that no device takes.
    pub(super) fn judge(&self, case: &Case) -> Result<Vec<Judged>, Error> {
        let wants = |of: Activation| self.abuse.activations.contains(&of);
        let mut rows = Vec::new();
        let mut own = None;
        let (session, raw) = self.measured(case, Activation::Live, &mut own);
        let device = Device::new(self, case)?;
        let end_s = match wants(Activation::Live) {
            true => self.abuse.times.learning_s(),
            false => self.abuse.times.until(),
        };
        let learnt = device.learns(session, end_s);
        if wants(Activation::Live) {
            let promoted = learnt.report.promotions > 0;
            rows.extend(self.rows(case, Activation::Live, session, raw, &learnt, promoted));
        }
        if wants(Activation::NextPowerOn) {
            let mut own = None;
            let (session, raw) = self.measured(case, Activation::NextPowerOn, &mut own);
            let mut next = learnt.clone();
            let stored = learnt.stored.filter(|nets| !nets.same_images(&Nets::NONE));
            next.correction = match &stored {
                Some(nets) => device.next(session, nets).correction,
                None => Vec::new(),
            };
            let promoted = stored.is_some();
            rows.extend(self.rows(case, Activation::NextPowerOn, session, raw, &next, promoted));
        }
        Ok(rows)
    }

    fn rows(
        &self,
        case: &Case,
        activation: Activation,
        session: &Session,
        raw: &[f64],
        outcome: &Outcome,
        promoted: bool,
    ) -> Vec<Judged> {
        let none = Increment::default();
        let changed = outcome.correction.iter().any(|by| *by != none);
        let with = match changed {
            true => self.errors(session, &outcome.correction, activation),
            false => raw.to_vec(),
        };
        let computers = self.abuse.computers.iter().zip(raw.iter().zip(with));
        let row = |(&computer, (&raw_m, corrected_m))| Judged {
            case: case.name().to_owned(),
            sensor: self.sensor,
            computer,
            activation,
            run: self.run,
            raw_m,
            corrected_m,
            promoted,
            rolled_back: outcome.report.rollbacks > 0,
            faults: outcome.faults,
        };
        computers.map(row).collect()
    }
}

/// The device of a case.
struct Device<'b, 'a> {
    bench: &'b Bench<'a>,
    case: &'b Case,
    format: Format,
    told: Configuration,
}

impl<'b, 'a> Device<'b, 'a> {
    fn new(bench: &'b Bench<'a>, case: &'b Case) -> Result<Self, Error> {
        let uncounted = Act::Line(line::Fault::NoCounter);
        let counted = case.acts.iter().all(|(act, _)| *act != uncounted);
        let name = if counted {
            FormatName::Novatel
        } else {
            FormatName::Hg4930
        };
        let faults = case.acts.iter().filter_map(|(act, _)| match act {
            Act::Told(fault) => Some(*fault),
            _ => None,
        });
        let mut told = told::configuration(faults, name).map_err(|problem| Error::Option {
            option: format!("--cases {case}"),
            problem,
            remedy: "give values that a device takes".into(),
        })?;
        told.correction.mode = Mode::Learn;
        told.correction.activation = firmware::configuration::Activation::Faded;
        Ok(Self {
            bench,
            case,
            format: Format::of(counted),
            told,
        })
    }

    /// The frames of a drive. In the next one only what is always there acts.
    fn frames(&self, session: &Session, seed: u64, next: bool) -> Vec<Frame> {
        let times = &self.bench.abuse.times;
        let acts = self
            .case
            .acts
            .iter()
            .filter(|(_, span)| !next || *span == Span::Always);
        let faults: Vec<_> = acts
            .filter_map(|(act, span)| match act {
                Act::Line(fault) => Some((*fault, span.seconds(times))),
                _ => None,
            })
            .collect();
        line::frames(&faults, &session.counts, (session.dt, &session.lsb), seed)
    }

    /// The drive in which it learns, until `end_s`.
    fn learns(&self, session: &Session, end_s: u32) -> Outcome {
        let Bench {
            abuse, run, teach, ..
        } = *self.bench;
        let times = &abuse.times;
        let world = self.bench.world(self.case, Activation::Live);
        let seed = world.seeds.drive;
        let mut frames = self.frames(session, seed, false);
        frames.retain(|frame| frame.at_us <= u64::from(end_s) * 1_000_000);
        let faults: Vec<_> = self
            .case
            .acts
            .iter()
            .filter_map(|(act, span)| match act {
                Act::Receiver(fault) => Some((*fault, span.seconds(times))),
                _ => None,
            })
            .collect();
        let elsewhere = || World::elsewhere(times, run);
        let receiver = receiver::messages(&faults, &world.truth, elsewhere, !seed, times.until());
        let mut requests: Vec<_> = self
            .case
            .acts
            .iter()
            .filter_map(|(act, span)| match act {
                Act::Asked(asked) => Some(asked.requests(*span, times)),
                _ => None,
            })
            .flatten()
            .collect();
        requests.sort_by_key(|(at_us, _)| *at_us);
        let input = Input {
            format: self.format,
            frames: &frames,
            receiver: &receiver,
            requests: &requests,
            samples: (session.counts.len(), session.dt),
        };
        let mut outcome = None;
        teach(&self.told, &mut |learner| {
            let told = (&self.told, &Nets::NONE);
            outcome = Some(device::run(
                told,
                Some(learner),
                &input,
                times.until().into(),
            ));
        });
        outcome.unwrap_or_else(|| {
            device::run(
                (&self.told, &Nets::NONE),
                None,
                &input,
                times.until().into(),
            )
        })
    }

    /// The next drive, in which what was stored acts from the first sample on.
    fn next(&self, session: &Session, stored: &Nets) -> Outcome {
        let mut told = self.told.clone();
        told.correction.mode = Mode::Frozen;
        let world = self.bench.world(self.case, Activation::NextPowerOn);
        let input = Input {
            format: self.format,
            frames: &self.frames(session, world.seeds.drive, true),
            receiver: &[],
            requests: &[],
            samples: (session.counts.len(), session.dt),
        };
        device::run((&told, stored), None, &input, f64::INFINITY)
    }
}
