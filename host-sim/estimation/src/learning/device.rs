//! The device: the firmware's own application, from one power-on to the next.
//!
//! What corrects, learns, proves, stores and remembers is the application of the boards with its
//! configuration, limits, activation and store in (simulated) flash. It gets samples and fixes
//! without their bytes ([`App::sample`], [`App::fix_of`]); `tests/device` shows that it decides
//! alike on bytes.

mod course;
mod diary;
mod of_session;

pub use course::{Course, course, since};
pub use diary::{Candidate, Diary, EVERY_S, Entry};
pub use of_session::{arrived, configured};

use firmware::app::{App, Hardware, Lines};
use firmware::configuration::Configuration;
use firmware::configuration::record::{decode, encode};
use firmware::control::{Alignment, Mode};
use firmware::fix::Fix;
use firmware::learn::{FixLearner, FixMemory, Report, Settings, Trials};
use firmware::link::NoLine;
use firmware::model::Nets;
use firmware::sample::{Axes, Counts, Lsb, Quantity, RawSample, Unit, Units};
use firmware::store::{Content, Memory, Notes, Progress, Step, Store, unit};
use firmware::wheels::WheelSpeed;
use firmware::wire::command::{MAX_PACKET, Request, encode as packet};
use firmware::wire::sequence::{Rule, Sequence};
use firmware::wire::{Reading, Stream};
use host_core::error::Error;
use host_core::list::{IN_MEMORY, List};
use host_device::hil::{MemoryFlash, MemoryLine, SetClock};
use std::ops::Range;

/// The time between two passes without a sample, microseconds.
const TICK_US: u64 = 20_000;

/// A configured device between two power-ons: its store.
#[derive(Debug, Clone)]
pub struct Device {
    configuration: Configuration,
    flash: MemoryFlash,
}

/// Input of a device from power-on to power-off.
#[derive(Debug)]
pub struct Input<'a> {
    /// Samples, and what a count is worth.
    pub samples: &'a List<Counts>,
    /// See [`Input::samples`].
    pub lsb: Lsb,
    /// Time between samples, s.
    pub dt: f64,
    /// Thermometer of the sensor for each second, degrees C; empty without one.
    pub celsius: &'a [f32],
    /// Samples that are missing.
    pub missing: &'a [Range<usize>],
    /// Fixes, each after so many samples.
    pub fixes: &'a [(usize, Fix)],
    /// Speeds of the wheels, each after so many samples.
    pub wheels: &'a [(usize, WheelSpeed)],
    /// What the navigation computer reports of its alignment, each after so many samples.
    pub alignment: &'a [(usize, Alignment)],
}

/// What a device did from power-on to power-off.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Its samples; those that were missing are zero. [`List::check`] says whether all of them are
    /// there.
    pub corrected: List<Counts>,
    /// Whether any of them is not as it came.
    pub changed: bool,
    /// The correction in force in each second, from its first sample on: rad/s, m/s2.
    pub correction: Vec<[[f32; 3]; 2]>,
    /// The learner's report at the end.
    pub report: Report,
    /// Its hypotheses at the end, if it has navigated.
    pub trials: Option<Trials>,
    /// The course of its learning.
    pub diary: Diary,
    /// Number of fixes that it was given.
    pub given: usize,
    /// When records were stored, s after power-on.
    pub stored_s: Vec<f64>,
}

impl Device {
    /// A device that was configured and has stored its configuration, and nothing else.
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let mut device = Self {
            configuration: at_work(configuration),
            flash: MemoryFlash::default(),
        };
        device.store_nets(&Nets::NONE);
        device
    }

    /// The device of a unit, as its file configures it, before its first drive. If the file has a
    /// prior from a fleet, its networks are stored as by `device weights put`.
    ///
    /// # Errors
    /// A value of the file that no device accepts.
    pub fn of_unit(unit: &host_unit::Unit) -> Result<Self, Error> {
        let configuration = unit.configuration().map_err(|wrong| Error::Option {
            option: format!("unit '{}': {}", unit.name, wrong.key),
            problem: wrong.problem,
            remedy: wrong.remedy,
        })?;
        let mut device = Self::new(&configuration);
        if let Some(prior) = &unit.prior {
            device.store_nets(&prior.nets());
        }
        Ok(device)
    }

    /// Its configuration.
    #[must_use]
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// Stores networks with the configuration, as the command link does.
    pub fn store_nets(&mut self, nets: &Nets) {
        let record = encode(&self.configuration);
        let content = Content {
            unit: unit(&self.configuration),
            memory: Memory::Same,
            ..Content::new(nets, &record)
        };
        if let Ok(mut store) = Store::new(core::mem::take(&mut self.flash)) {
            let _ = store.load();
            let _ = store.carry_out(Step::Save, &content);
            self.flash = store.into_inner();
        }
    }

    /// Stores another configuration; what is known of the unit stays if it is the same unit.
    pub fn configure(&mut self, configuration: &Configuration) {
        let configuration = at_work(configuration);
        if configuration != self.configuration {
            self.configuration = configuration;
            let (nets, _) = self.stored();
            self.store_nets(&nets);
        }
    }

    /// A device with this content of its flash, which is then configured and stored.
    ///
    /// # Errors
    /// What is wrong with it, and the remedy: no store, one of another unit, or one of a newer
    /// firmware.
    pub fn of_flash(
        configuration: &Configuration,
        flash: MemoryFlash,
    ) -> Result<Self, (String, &'static str)> {
        const READ: &str = "give a file that `--memory` has written, or the two sectors of a \
                            board's store";
        let mut store =
            Store::new(flash).map_err(|_| ("is too short for a store".to_owned(), READ))?;
        let found = store.load().map_err(|newer| {
            let problem = format!("is of a newer firmware (version {} of its format)", newer.0);
            (problem, "use the desktop program of that firmware")
        })?;
        let found = found.ok_or(("holds no good record of a store".to_owned(), READ))?;
        let own = unit(configuration);
        let identity = decode(&found.record).map(|of| of.identity).ok();
        // units without serial numbers are apart by their names
        let named = identity.as_ref().filter(|of| of.serial.is_empty());
        let renamed = named.is_some_and(|of| of.name != configuration.identity.name);
        if renamed || found.unit.is_some_and(|of| of != own) {
            let of = identity.map_or_else(
                || "another one".to_owned(),
                |of| format!("'{}' (serial '{}')", of.name, of.serial),
            );
            let own = &configuration.identity;
            let problem = format!(
                "is of the unit {of}, and the unit file is of '{}' (serial '{}')",
                own.name, own.serial
            );
            return Err((
                problem,
                "give the memory of this unit, or its own unit file",
            ));
        }
        let mut device = Self {
            configuration: at_work(configuration),
            flash: store.into_inner(),
        };
        device.store_nets(&found.nets);
        Ok(device)
    }

    /// The content of its flash.
    #[must_use]
    pub fn flash(&self) -> &MemoryFlash {
        &self.flash
    }

    /// The networks that act from the next power-on, and the notes and bytes of what it remembers.
    #[must_use]
    pub fn stored(&self) -> (Nets, Option<(Notes, Vec<u8>)>) {
        let Ok(mut store) = Store::new(self.flash.clone()) else {
            return (Nets::NONE, None);
        };
        let nets = store.load().ok().flatten().map_or(Nets::NONE, |of| of.nets);
        let mut memory = [0; firmware::store::MEMORY_MAX];
        let len = store.memory(&mut memory);
        let notes = Notes::of(memory.get(..len).unwrap_or_default());
        (nets, notes.map(|(notes, bytes)| (notes, bytes.to_vec())))
    }

    /// Power on, all of the input, power off.
    pub fn drive(&mut self, input: &Input<'_>) -> Drive {
        let mut memory = Box::new(FixMemory::ZEROED);
        let mut learner = FixLearner::new(&mut memory, Settings::of(&self.configuration));
        let mut store = Store::new(core::mem::take(&mut self.flash)).ok();
        let app = App::start_up(Hardware::DESKTOP, &mut store, true, Some(&mut learner));
        let mut run = Run {
            app: Box::new(app),
            lines: Lines::default(),
            clock: SetClock(0),
            store,
            course: OnTheWay::default(),
        };
        let corrected = run.all(input);
        let Run {
            app, store, course, ..
        } = run;
        if let Some(store) = store {
            self.flash = store.into_inner();
        }
        let (report, trials) = (app.learning(), app.trials());
        Drive {
            corrected,
            changed: course.changed,
            correction: course.correction,
            given: input.fixes.len(),
            stored_s: course.stored_s,
            diary: course.diary.closed(&report, trials.as_ref()),
            report,
            trials,
        }
    }
}

/// The configuration in mode learn where it is in bypass, as that of a unit file that says nothing:
/// in bypass there is nothing to judge.
fn at_work(configuration: &Configuration) -> Configuration {
    let mut of = configuration.clone();
    if of.correction.mode == Mode::Bypass {
        of.correction.mode = Mode::Learn;
    }
    of
}

/// The lines of the application: only the command link has bytes.
type OfSamples = Lines<NoLine, NoLine, MemoryLine, NoLine>;

struct Run<'m> {
    app: Box<App<'m>>,
    lines: OfSamples,
    clock: SetClock,
    store: Option<Store<MemoryFlash>>,
    course: OnTheWay,
}

/// What is noted of a drive on the way.
#[derive(Default)]
struct OnTheWay {
    changed: bool,
    correction: Vec<[[f32; 3]; 2]>,
    stored_s: Vec<f64>,
    diary: Diary,
}

impl Run<'_> {
    /// All samples, corrected.
    fn all(&mut self, input: &Input<'_>) -> List<Counts> {
        let stream = stream(input);
        let second = (1.0 / input.dt).round().max(1.0) as usize;
        let mut fixes = input.fixes.iter().peekable();
        let mut wheels = input.wheels.iter().peekable();
        let mut alignment = input.alignment.iter().peekable();
        let mut missing = input.missing.iter().peekable();
        let mut gap = None;
        let each = input.samples.each().enumerate().map(|(k, counts)| {
            while let Some((_, alignment)) = alignment.next_if(|(after, _)| *after <= k) {
                self.ask(&Request::Alignment(*alignment));
            }
            let now_us = ((k + 1) as f64 * input.dt * 1e6).round() as u64;
            self.wait(now_us);
            missing.next_if(|gap| gap.end <= k);
            let corrected = if let Some(now) = missing.peek().filter(|gap| gap.contains(&k)) {
                gap = Some(now.start as f64 * input.dt..now.end as f64 * input.dt);
                Counts::default()
            } else {
                let celsius = input.celsius.get(k / second).copied();
                let reading = reading(&counts, k, celsius);
                let corrected = counts_of(self.app.sample(&reading, &stream, &self.clock));
                self.course.changed |= corrected != counts;
                corrected
            };
            if k.is_multiple_of(second) {
                self.course.correction.push(self.app.correction());
            }
            self.settle();
            while let Some((_, speed)) = wheels.next_if(|(after, _)| *after <= k + 1) {
                self.ask(&Request::WheelSpeed(*speed));
            }
            while let Some((_, fix)) = fixes.next_if(|(after, _)| *after <= k + 1) {
                self.app.fix_of(*fix);
                self.settle();
            }
            if (k + 1).is_multiple_of(second) {
                let second = (k + 1) / second;
                self.course.diary.second(second, &self.app, gap.clone());
            }
            corrected
        });
        List::collected(each, IN_MEMORY)
    }

    /// Advances the clock, with a pass of the application from time to time.
    fn wait(&mut self, now_us: u64) {
        while self.clock.0 + TICK_US < now_us {
            self.clock.0 += TICK_US;
            self.settle();
        }
        self.clock.0 = now_us;
    }

    /// Runs the application until it has nothing to do.
    fn settle(&mut self) {
        while self.app.poll(&mut self.lines, &self.clock) {}
        while self.app.wants_to_store() {
            let (store, mut last) = (&mut self.store, Progress::Failed);
            self.app.store(|step, content| {
                last = match store {
                    Some(store) => store.carry_out(step, content),
                    None => Progress::Failed,
                };
                last
            });
            if last == Progress::Done {
                self.course.stored_s.push(self.clock.0 as f64 * 1e-6);
            }
        }
        self.app.to_open();
        self.lines.command.sent.clear();
    }

    fn ask(&mut self, request: &Request<'_>) {
        let mut bytes = [0; MAX_PACKET];
        if let Ok(bytes) = packet(0, request, &mut bytes) {
            self.lines.command.received.extend(&*bytes);
        }
        self.settle();
    }
}

fn stream(input: &Input<'_>) -> Stream {
    let unit = |lsb| Unit {
        quantity: Quantity::Increment,
        lsb,
    };
    Stream {
        units: Units {
            gyro: unit(input.lsb.rad),
            accel: unit(input.lsb.mps),
        },
        rate: 1.0 / input.dt,
        sequence: Sequence::Counter(Rule::new(1 << 16, 1)),
    }
}

fn reading(counts: &Counts, number: usize, celsius: Option<f32>) -> Reading {
    Reading {
        sample: RawSample::Counts {
            gyro: counts.dtheta,
            accel: counts.dv,
        },
        present: Axes::ALL,
        valid: Axes::ALL,
        counter: Some(number as u16), // modulo 2^16, as the rule says
        latency_us: None,
        time: None,
        temperature: celsius.map(|celsius| [celsius; 3]),
    }
}

fn counts_of(sample: RawSample) -> Counts {
    match sample {
        RawSample::Counts { gyro, accel } => Counts {
            dtheta: gyro,
            dv: accel,
        },
        RawSample::Floats { .. } => Counts::default(), // it got counts
    }
}

#[cfg(test)]
mod tests;
