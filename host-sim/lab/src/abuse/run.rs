//! One unit with one kind of sensor through some cases.

use super::Abuse;
use super::act::Act;
use super::case::Case;
use super::computer;
use super::configured;
use super::device::{self, Format, Input, Outcome, Stored};
use super::line::{self, Frame};
use super::names::{Activation, Computer, Sensor};
use super::receiver;
use super::sensor;
use super::times::{Span, Times};
use super::world::{Begins, World, corrected, later, sensor_faults};
use firmware::configuration::{self, Configuration};
use firmware::control::Mode;
use firmware::learn::{FixLearner, FixMemory, Learner, Settings};
use firmware::model::Nets;
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_estimation::learning::teacher::Assumptions;
use host_unit::sensor::FormatName;
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;

/// Calls the second argument with a learner for this configuration.
pub type Teach<'a> = &'a (dyn Fn(&Configuration, &mut dyn FnMut(&mut dyn Learner)) + Sync);

/// Calls `then` with the device's learner from fixes.
pub fn fix_learner(configuration: &Configuration, then: &mut dyn FnMut(&mut dyn Learner)) {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = FixLearner::new(&mut memory, Settings::of(configuration));
    then(&mut learner);
}

/// Result of one case in one run, with one navigation computer.
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
    /// Whether the device corrected something.
    pub promoted: bool,
    /// Whether a promoted hypothesis was rolled back to "no correction".
    pub rolled_back: bool,
    /// All faults that the device raised: bits of `fault` of the command link.
    pub faults: u32,
}

/// The samples of a drive.
struct Measured {
    session: Session,
    /// Those from the standstill on, if something happens before it.
    later: Option<Session>,
    /// Error of each computer on the uncorrected samples, m, computed at the first request.
    raw: OnceCell<Vec<f64>>,
}

impl Measured {
    fn of(world: &World, sensor: Sensor, faults: &[(sensor::Fault, Span)]) -> Self {
        let session = world.measured(sensor, faults);
        Self {
            later: (world.begins_s > 0).then(|| later(&session, world.begins_s as usize)),
            session,
            raw: OnceCell::new(),
        }
    }

    /// What a navigation computer gets.
    fn judged(&self) -> &Session {
        self.later.as_ref().unwrap_or(&self.session)
    }
}

/// The drives of a unit in one motion, as one kind of sensor measures them.
pub(super) struct Bench<'a> {
    abuse: &'a Abuse,
    times: Times,
    sensor: Sensor,
    run: u32,
    worlds: [OnceCell<World>; Activation::ALL.len()],
    /// Undisturbed samples of the drives.
    clean: [OnceCell<Measured>; Activation::ALL.len()],
    /// What a device learns on an undisturbed drive, before one that begins with something.
    ordinary: OnceCell<Outcome>,
    assumptions: Assumptions,
    teach: Teach<'a>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(abuse: &'a Abuse, sensor: Sensor, run: u32, teach: Teach<'a>) -> Self {
        Self {
            abuse,
            times: Times {
                free_s: abuse.times.free_s.min(sensor.judged_s()),
                ..abuse.times
            },
            sensor,
            run,
            worlds: Default::default(),
            clean: Default::default(),
            ordinary: OnceCell::new(),
            assumptions: Assumptions::of(&configured::unit(sensor)),
            teach,
        }
    }

    /// The drive in which the device learns ([`Activation::Live`]), or the next one, without what
    /// happens before the standstill.
    fn usual_world(&self, case: &Case, of: Activation) -> &World {
        self.worlds[of as usize].get_or_init(|| self.make_world(case, of, None))
    }

    fn make_world(&self, case: &Case, of: Activation, begins: Begins) -> World {
        let (times, run) = (&self.times, self.run);
        let motion = (case.motion().after(), begins);
        match of {
            Activation::Live => World::learning(times, motion, run),
            Activation::NextPowerOnAided => World::next(times, motion, run, times.aided_s),
            _ => World::next(times, motion, run, 0),
        }
    }

    /// Epoch at which a drive's fixes end.
    fn until(&self, activation: Activation) -> usize {
        let times = &self.times;
        match activation {
            Activation::Live | Activation::NextPowerOnAided => times.until() as usize,
            _ => times.standstill_s as usize,
        }
    }

    /// Errors of the computers with these corrections.
    fn errors(&self, of: &Measured, correction: &[Increment], activation: Activation) -> Vec<f64> {
        let session = of.judged();
        let before = correction.len().saturating_sub(session.counts.len());
        let increments = corrected(session, &correction[before..]);
        let until = self.until(activation);
        let knows = (self.assumptions, self.sensor.finds_north());
        let computers = self.abuse.computers.iter();
        computers
            .map(|&which| computer::error(which, session, &increments, &knows, until))
            .collect()
    }

    /// A drive and its samples as a case leaves them, with what happens before its standstill, or
    /// without.
    fn drive<'s>(
        &'s self,
        case: &Case,
        (of, begins): (Activation, Begins),
        (world, measured): &'s mut (Option<World>, Option<Measured>),
    ) -> (&'s World, &'s Measured) {
        let world = match begins {
            None => self.usual_world(case, of),
            Some(_) => &*world.insert(self.make_world(case, of, begins)),
        };
        let faults = sensor_faults(case);
        let next = of != Activation::Live;
        let acts = |(fault, span): &(sensor::Fault, Span)| {
            fault.acts(next) && (*span != Span::Before || begins.is_some())
        };
        let measured = if begins.is_some() || faults.iter().any(acts) {
            &*measured.insert(Measured::of(world, self.sensor, &faults))
        } else {
            self.clean[of as usize].get_or_init(|| Measured::of(world, self.sensor, &[]))
        };
        (world, measured)
    }

    /// A case with all computers and activations.
    ///
    /// # Errors
    /// Values of the case that a device rejects.
    pub(super) fn judge(&self, case: &Case) -> Result<Vec<Judged>, Error> {
        let mut rows = Vec::new();
        // what happens before the standstill is in the drive in which the device learns, or in the
        // one that the first rest corrects
        let begins = case.motion().begins();
        let mut own = Default::default();
        let learns = |of: &Activation| match of {
            Activation::FirstRestNew => false,
            Activation::FirstRest => begins.is_none(),
            _ => true,
        };
        let learning = self.abuse.activations.iter().any(learns);
        let learning = learning.then(|| self.drive(case, (Activation::Live, begins), &mut own));
        let mut learnt_once: Option<Outcome> = None;
        for &activation in &self.abuse.activations {
            let device = Device::new(self, case, activation)?;
            let learnt = match learning.filter(|_| learns(&activation)) {
                Some((world, measured)) if activation == Activation::Live => {
                    let learnt = device.learns(world, &measured.session);
                    rows.extend(self.rows(case, activation, measured, &learnt));
                    continue;
                }
                Some((world, measured)) => {
                    learnt_once.get_or_insert_with(|| device.learns(world, &measured.session))
                }
                None if activation == Activation::FirstRestNew => &Outcome::default(),
                None if case.only_begins() => self.ordinary.get_or_init(|| device.learns_before()),
                None => &device.learns_before(),
            };
            rows.extend(self.judge_next(&device, begins, learnt));
        }
        Ok(rows)
    }

    /// The next drive of a device that has learnt.
    fn judge_next(&self, device: &Device<'_, '_>, begins: Begins, learnt: &Outcome) -> Vec<Judged> {
        let activation = device.activation;
        let begins = begins.filter(|_| activation.rests());
        let mut own = Default::default();
        let (world, measured) = self.drive(device.case, (activation, begins), &mut own);
        let stored = learnt.stored.as_ref();
        let stored = stored.filter(|nets| !nets.same_images(&Nets::NONE));
        let acts = stored.is_some() || activation.rests();
        let next = acts.then(|| {
            let stored = Stored {
                nets: stored.unwrap_or(&Nets::NONE),
                memory: if activation.rests() {
                    &learnt.memory
                } else {
                    &[]
                },
            };
            device.next(world, &measured.session, stored)
        });
        let next = next.unwrap_or_default();
        let outcome = Outcome {
            correction: next.correction,
            faults: learnt.faults | next.faults,
            ..learnt.clone()
        };
        self.rows(device.case, activation, measured, &outcome)
    }

    fn rows(
        &self,
        case: &Case,
        activation: Activation,
        measured: &Measured,
        outcome: &Outcome,
    ) -> Vec<Judged> {
        let none = Increment::default();
        let raw = measured.raw.get_or_init(|| {
            let none = vec![none; measured.session.counts.len()];
            self.errors(measured, &none, activation)
        });
        let changed = outcome.correction.iter().any(|by| *by != none);
        let with = match changed {
            true => self.errors(measured, &outcome.correction, activation),
            false => raw.clone(),
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
            promoted: changed,
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
    activation: Activation,
    format: Format,
    configuration: Configuration,
}

impl<'b, 'a> Device<'b, 'a> {
    fn new(bench: &'b Bench<'a>, case: &'b Case, activation: Activation) -> Result<Self, Error> {
        let uncounted = Act::Line(line::Fault::NoCounter);
        let counted = case.acts.iter().all(|(act, _)| *act != uncounted);
        let name = if counted {
            FormatName::Novatel
        } else {
            FormatName::Hg4930
        };
        let faults = case.acts.iter().filter_map(|(act, _)| match act {
            Act::Configured(fault) => Some(*fault),
            _ => None,
        });
        let mut configuration =
            configured::configuration(faults, (bench.sensor, name)).map_err(|problem| {
                Error::Option {
                    option: format!("--cases {case}"),
                    problem,
                    remedy: "give values that a device takes".into(),
                }
            })?;
        configuration.correction.mode = Mode::Learn;
        configuration.correction.activation = match activation {
            Activation::Live => configuration::Activation::Faded,
            Activation::FirstRest | Activation::FirstRestNew => {
                configuration::Activation::FirstRest
            }
            _ => configuration::Activation::NextPowerOn,
        };
        Ok(Self {
            bench,
            case,
            activation,
            format: Format::of(counted),
            configuration,
        })
    }

    /// The frames of a drive. In the next drive only permanent faults act.
    fn frames(&self, session: &Session, world: &World, next: bool) -> Vec<Frame> {
        let acts = self
            .case
            .acts
            .iter()
            .filter(|(_, span)| !next || *span == Span::Always);
        let faults: Vec<_> = acts
            .filter_map(|(act, span)| match act {
                Act::Line(fault) => Some((*fault, span.seconds(&world.times))),
                _ => None,
            })
            .collect();
        let one = (session.dt, &session.lsb);
        line::frames(&faults, &session.counts, one, world.seeds.drive)
    }

    /// The drive in which it learns, before one that begins with something.
    fn learns_before(&self) -> Outcome {
        let mut own = Default::default();
        let drive = (Activation::Live, None);
        let (world, measured) = self.bench.drive(self.case, drive, &mut own);
        self.learns(world, &measured.session)
    }

    /// The drive in which it learns. While something happens before the standstill, the receiver
    /// finds no satellites yet.
    fn learns(&self, world: &World, session: &Session) -> Outcome {
        let (run, times, seed) = (self.bench.run, &world.times, world.seeds.drive);
        let frames = self.frames(session, world, false);
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
        let mut receiver =
            receiver::messages(&faults, &world.truth, elsewhere, !seed, times.until());
        let begins_us = u64::from(world.begins_s) * 1_000_000;
        receiver.retain(|message| message.at_us >= begins_us);
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
        self.taught(Stored::NOTHING, &input)
    }

    /// A drive with the stored networks and a learner.
    fn taught(&self, stored: Stored<'_>, input: &Input<'_>) -> Outcome {
        let mut outcome = None;
        let state = (&self.configuration, stored);
        (self.bench.teach)(&self.configuration, &mut |learner| {
            outcome = Some(device::run(state, Some(learner), input));
        });
        outcome.unwrap_or_else(|| device::run(state, None, input))
    }

    /// The next drive, in which the stored networks act from the first sample on.
    fn next(&self, world: &World, session: &Session, stored: Stored<'_>) -> Outcome {
        let input = Input {
            format: self.format,
            frames: &self.frames(session, world, true),
            receiver: &[],
            requests: &[],
            samples: (session.counts.len(), session.dt),
        };
        self.taught(stored, &input)
    }
}
