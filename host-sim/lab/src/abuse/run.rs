//! One unit with one kind of sensor through some cases.

use super::Abuse;
use super::act::Act;
use super::case::Case;
use super::computer;
use super::configured;
use super::device::{self, Format, Input, Outcome};
use super::line::{self, Frame};
use super::names::{Activation, Computer, Sensor};
use super::receiver;
use super::times::Span;
use super::world::{World, corrected, sensor_faults};
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
    /// Error of each computer on the uncorrected samples, m, computed at the first request.
    raw: OnceCell<Vec<f64>>,
}

/// The drives of a unit in one motion, as one kind of sensor measures them.
pub(super) struct Bench<'a> {
    abuse: &'a Abuse,
    sensor: Sensor,
    run: u32,
    worlds: [OnceCell<World>; Activation::ALL.len()],
    /// Undisturbed samples of the drives.
    clean: [OnceCell<Measured>; Activation::ALL.len()],
    assumptions: Assumptions,
    teach: Teach<'a>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(abuse: &'a Abuse, sensor: Sensor, run: u32, teach: Teach<'a>) -> Self {
        Self {
            abuse,
            sensor,
            run,
            worlds: Default::default(),
            clean: Default::default(),
            assumptions: Assumptions::of(&configured::unit(sensor)),
            teach,
        }
    }

    fn world(&self, case: &Case, activation: Activation) -> &World {
        let (times, motion, run) = (&self.abuse.times, case.motion(), self.run);
        self.worlds[activation as usize].get_or_init(|| match activation {
            Activation::Live => World::learning(times, motion, run),
            Activation::NextPowerOn => World::next(times, motion, run, 0),
            Activation::NextPowerOnAided => World::next(times, motion, run, times.aided_s),
        })
    }

    /// Epoch at which a drive's fixes end.
    fn until(&self, activation: Activation) -> usize {
        let times = &self.abuse.times;
        match activation {
            Activation::Live | Activation::NextPowerOnAided => times.until() as usize,
            Activation::NextPowerOn => times.standstill_s as usize,
        }
    }

    /// Errors of the computers with these corrections.
    fn errors(&self, session: &Session, correction: &[Increment], of: Activation) -> Vec<f64> {
        let increments = corrected(session, correction);
        let until = self.until(of);
        let knows = (self.assumptions, self.sensor.finds_north());
        let computers = self.abuse.computers.iter();
        computers
            .map(|&which| computer::error(which, session, &increments, &knows, until))
            .collect()
    }

    /// The samples of a drive as a case leaves them.
    fn measured<'s>(
        &'s self,
        case: &Case,
        of: Activation,
        own: &'s mut Option<Measured>,
    ) -> &'s Measured {
        let times = &self.abuse.times;
        let make = |faults: &[_]| Measured {
            session: self.world(case, of).measured(self.sensor, faults, times),
            raw: OnceCell::new(),
        };
        let next = of != Activation::Live;
        let faults = sensor_faults(case);
        if faults.iter().any(|(fault, _)| fault.acts(next)) {
            return own.insert(make(&faults));
        }
        self.clean[of as usize].get_or_init(|| make(&[]))
    }

    /// A case with all computers and activations.
    ///
    /// # Errors
    /// Values of the case that a device rejects.
    pub(super) fn judge(&self, case: &Case) -> Result<Vec<Judged>, Error> {
        let mut rows = Vec::new();
        let mut own = None;
        let learning = self.measured(case, Activation::Live, &mut own);
        let mut learnt_once: Option<Outcome> = None;
        for &activation in &self.abuse.activations {
            let device = Device::new(self, case, activation)?;
            if activation == Activation::Live {
                let learnt = device.learns(&learning.session);
                rows.extend(self.rows(case, activation, learning, &learnt));
                continue;
            }
            let mut own = None;
            let next = self.measured(case, activation, &mut own);
            let learnt = learnt_once.get_or_insert_with(|| device.learns(&learning.session));
            let stored = learnt.stored.as_ref();
            let stored = stored.filter(|nets| !nets.same_images(&Nets::NONE));
            let correction = stored.map(|nets| device.next(&next.session, nets).correction);
            let outcome = Outcome {
                correction: correction.unwrap_or_default(),
                ..learnt.clone()
            };
            rows.extend(self.rows(case, activation, next, &outcome));
        }
        Ok(rows)
    }

    fn rows(
        &self,
        case: &Case,
        activation: Activation,
        Measured { session, raw }: &Measured,
        outcome: &Outcome,
    ) -> Vec<Judged> {
        let none = Increment::default();
        let raw = raw.get_or_init(|| {
            let none = vec![none; session.counts.len()];
            self.errors(session, &none, activation)
        });
        let changed = outcome.correction.iter().any(|by| *by != none);
        let with = match changed {
            true => self.errors(session, &outcome.correction, activation),
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

    /// The drive in which it learns.
    fn learns(&self, session: &Session) -> Outcome {
        let Bench { abuse, run, .. } = *self.bench;
        let times = &abuse.times;
        let world = self.bench.world(self.case, Activation::Live);
        let seed = world.seeds.drive;
        let frames = self.frames(session, seed, false);
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
        self.taught(&Nets::NONE, &input)
    }

    /// A drive with the stored networks and a learner.
    fn taught(&self, stored: &Nets, input: &Input<'_>) -> Outcome {
        let mut outcome = None;
        let state = (&self.configuration, stored);
        (self.bench.teach)(&self.configuration, &mut |learner| {
            outcome = Some(device::run(state, Some(learner), input));
        });
        outcome.unwrap_or_else(|| device::run(state, None, input))
    }

    /// The next drive, in which the stored networks act from the first sample on.
    fn next(&self, session: &Session, stored: &Nets) -> Outcome {
        let world = self.bench.world(self.case, self.activation);
        let input = Input {
            format: self.format,
            frames: &self.frames(session, world.seeds.drive, true),
            receiver: &[],
            requests: &[],
            samples: (session.counts.len(), session.dt),
        };
        self.taught(stored, &input)
    }
}
