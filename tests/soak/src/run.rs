//! The soak itself, sample by sample.

use crate::disturb::{Disturb, Kind};
use crate::drive::Drive;
use crate::flash::{Failing, Flash};
use crate::lines::{Digest, Input, MessageCounts, Noted, OutputLine, Passing};
use crate::random::Random;
use crate::world::{Sensor, World};
use core::cell::{Cell, RefCell};
use firmware::app::blackbox;
use firmware::app::{Activation, App, Hardware, Lines};
use firmware::configuration::record::{Record, encode as record_of};
use firmware::configuration::{Configuration, Sensor as ConfiguredSensor};
use firmware::control::Mode;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::link::faulty::{Chances, Faulty};
use firmware::model::Nets;
use firmware::store::{Content, MEMORY_MAX, Store};
use firmware::wire::command::{Counters, MAX_CHUNK, MAX_PACKET, Request, encode};
use firmware::wire::framer::{CAPACITY, LONGEST};
use lrnn_nostd::{Net, Normalisation, Weights};

pub use crate::report::{LINES, Report, Violation};

/// More passes than this without idle time are an endless loop.
const PASSES: u32 = 4000;

/// Parameters of a soak.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Simulated time, s.
    pub seconds: u32,
    /// Samples a second.
    pub rate: u32,
}

/// All memory of the soak besides the stack.
#[derive(Debug)]
pub struct Memory {
    windows: WindowLearner,
    fixes: FixMemory,
    flash: Flash,
    blackbox: blackbox::Memory,
    learnt: [u8; MEMORY_MAX],
}

impl Memory {
    /// Initial content.
    pub const ZEROED: Memory = Memory {
        windows: WindowLearner::new(),
        fixes: FixMemory::ZEROED,
        flash: Flash::BLANK,
        blackbox: blackbox::Memory::ZEROED,
        learnt: [0; MEMORY_MAX],
    };
}

/// State that survives a power-on.
struct Soak<'p> {
    plan: &'p Plan,
    report: Report,
    /// As [`Report::lines`].
    digests: [Digest; 4],
    disturb: Disturb,
    random: Random,
    /// Samples so far.
    sample: u64,
    sensors: u32,
}

/// An observer of the soak.
pub trait Watch {
    /// After each simulated minute.
    fn minute(&mut self, _: &Report) {}

    /// Called when the device is about to be reset, with its last configuration and the
    /// application, for its black box. Returns false if the content of the black box is wrong.
    fn drive_over(&mut self, _: &Configuration, _: &App) -> bool {
        true
    }
}

/// No observer.
impl Watch for () {}

/// Runs a plan.
pub fn run(memory: &mut Memory, plan: &Plan, watch: &mut impl Watch) -> Report {
    let mut soak = Soak {
        plan,
        report: Report::default(),
        digests: [Digest::default(); 4],
        disturb: Disturb::new(Random::new(plan.seed, 1), plan.rate),
        random: Random::new(plan.seed, 2),
        sample: 0,
        sensors: Sensor::count(plan.rate),
    };
    memory.flash.clear();
    let end = u64::from(plan.seconds) * u64::from(plan.rate);
    while soak.sample < end && soak.report.violation.is_none() {
        let which = soak.random.below(soak.sensors);
        let Some(sensor) = Sensor::of(plan.rate, which) else {
            break;
        };
        soak.drive(memory, &sensor, end, watch);
    }
    soak.sum_up();
    soak.report
}

/// The device's configuration for its sensor.
fn configured(sensor: &Sensor, rate: u32, live: bool) -> Configuration {
    let mut configuration = Configuration {
        sensor: Some(ConfiguredSensor::Stream(
            sensor.format.settings(&sensor.settings),
        )),
        rate: rate.into(),
        ..Configuration::default()
    };
    configuration.correction.mode = Mode::Learn;
    if live {
        configuration.correction.activation = Activation::Faded;
    }
    configuration
}

/// Networks that correct by up to 1 deg/h and 100 ug, and whose output depends on every sample.
fn nets() -> Nets {
    let weights = Weights::from_fn(|index| ((index * 37 + 11) % 129) as f32 / 128.0 - 0.5);
    let net = |input_scale: f32, output_scale: f32| -> Net {
        Net::new(
            weights,
            Normalisation {
                input_offset: [0.0; 3],
                input_scale: [input_scale; 3],
                output_scale: [output_scale; 3],
            },
        )
    };
    Nets {
        gyro: net(2.0, 5e-6),
        accel: net(0.1, 1e-3),
        ..Nets::NONE
    }
}

type AppLines<'p> = Lines<Noted<'p, Faulty<Input>>, OutputLine<'p>, Input, Input>;

/// Digests of the lines' output, in the order of [`LINES`].
fn digests<'l, 'p>(lines: &'l mut AppLines<'p>) -> [&'l mut Digest; 4] {
    [
        &mut lines.navigation.digest,
        &mut lines.command.digest,
        &mut lines.gnss.digest,
        &mut lines.sensor.line.inner().digest,
    ]
}

impl Soak<'_> {
    fn sum_up(&mut self) {
        self.report.lines = self.digests.map(|digest| digest.value);
        let mut all = Digest::default();
        for line in self.report.lines {
            all.add(&line.to_le_bytes());
        }
        self.report.digest = all.value;
        self.report.left = self.digests.iter().map(|digest| digest.bytes).sum();
        self.report.begun = self.disturb.begun;
        self.report.samples = self.sample;
    }

    fn violated(&mut self, violation: Violation) {
        self.report
            .violation
            .get_or_insert((violation, self.sample));
    }

    /// Runs from one power-on to the next.
    #[inline(never)]
    fn drive(&mut self, memory: &mut Memory, sensor: &Sensor, end: u64, watch: &mut impl Watch) {
        let Memory {
            windows,
            fixes,
            flash,
            blackbox,
            learnt,
        } = memory;
        let live = self.random.below(2) == 0;
        let configuration = configured(sensor, self.plan.rate, live);
        let record = record_of(&configuration);
        if self.random.below(4) > 0 {
            *blackbox = blackbox::Memory::ZEROED; // else its content survives the reset
        }
        *windows = WindowLearner::new();
        let fails = Cell::new(false);
        let failing = Failing {
            flash,
            fails: &fails,
        };
        let Ok(mut store) = Store::new(failing) else {
            return self.violated(Violation::Store);
        };
        // the sensor is exchanged: the device is configured for it
        let stored = store.load();
        if !matches!(&stored, Ok(Some(stored)) if stored.record == record) {
            let nets = nets();
            let content = Content::new(&nets, &record);
            if store.save(&content).is_err() {
                return self.violated(Violation::Store);
            }
        }
        let stored = store.load();
        if !matches!(&stored, Ok(Some(stored)) if stored.record == record) {
            self.violated(Violation::Store);
        }
        let mut learner = CombinedLearner {
            references: windows,
            fixes: FixLearner::new(fixes, Settings::MEDIUM),
        };
        let mut app = App::power_on(Hardware::DESKTOP, Some(stored), Some(&mut learner));
        let len = store.memory(learnt);
        app.recall(learnt.get(..len).unwrap_or_default());
        app.record_in(blackbox);
        self.report.power_ons += 1;
        let passing = RefCell::new(Passing::default());
        let seed = u64::from(self.random.next());
        let mut lines: AppLines = Lines {
            sensor: Noted {
                line: Faulty::new(Input::default(), Chances::default(), seed),
                passing: &passing,
            },
            navigation: OutputLine::new(&passing, sensor.format),
            command: Input::default(),
            gnss: Input::default(),
        };
        for (slot, digest) in digests(&mut lines).into_iter().zip(self.digests) {
            *slot = digest; // it continues over a power-on
        }
        let mut drive = Drive {
            world: World::new(
                Random::new(self.plan.seed, self.random.next().into()),
                self.plan.rate,
            ),
            sensor,
            index: 0,
            held: [[0; 3]; 2],
            counters: Counters::default(),
        };
        let now = Cell::new(0);
        let mut number = 0u64;
        while self.sample < end && self.report.violation.is_none() {
            self.disturb.step();
            if self.disturb.is(Kind::Reset) {
                break;
            }
            (self.sample, number) = (self.sample + 1, number + 1);
            now.set(number * 1_000_000 / u64::from(self.plan.rate));
            self.feed(&mut drive, &mut lines, number, &record);
            if self.disturb.is(Kind::HeldUp) && !self.disturb.chance(4) {
                continue;
            }
            self.settle(&mut app, &mut lines, &now);
            fails.set(self.disturb.is(Kind::StoreFails));
            self.keep(&mut app, &mut store);
            if number.is_multiple_of(u64::from(self.plan.rate)) {
                self.second(&mut drive, &app, &lines);
            }
            if self.sample.is_multiple_of(60 * u64::from(self.plan.rate)) {
                self.digests = digests(&mut lines).map(|digest| *digest);
                self.sum_up();
                watch.minute(&self.report);
            }
        }
        self.gather(&mut lines);
        app.hold_recording();
        if !watch.drive_over(&configuration, &app) {
            self.violated(Violation::BlackBox);
        }
    }

    /// Sends the bytes of a sample time on all lines.
    fn feed(&mut self, drive: &mut Drive, lines: &mut AppLines, number: u64, record: &Record) {
        let rate = u64::from(self.plan.rate);
        let noise = self.disturb.is(Kind::SensorNoise);
        let faulty = &mut lines.sensor.line;
        faulty.chances = if noise {
            Chances {
                flip: 60,
                drop: 40,
                burst: 20,
                ..Chances::default()
            }
        } else {
            Chances::default()
        };
        let lost = self.disturb.is(Kind::SensorLost);
        let mut buffer = [0; 2 * LONGEST];
        let len = drive.bytes(&mut self.disturb, self.plan.rate, &mut buffer);
        let input = faulty.inner();
        input.lost |= lost;
        input.come(buffer.get(..len).unwrap_or_default());
        self.report.came += len as u64;
        // fixes arrive a tenth of a second after their time
        let due = (number + rate - rate / 10).is_multiple_of(rate);
        if due && !self.disturb.is(Kind::FixSilence) {
            let late = self.disturb.is(Kind::FixLate);
            let ms = (number * 1000 / rate) as u32 - 100 * u32::from(number >= rate / 10);
            let late_ms = if late { 600 } else { 0 };
            let wrong = self.disturb.is(Kind::FixWrong);
            let mut fix = drive.world.fix(ms.wrapping_sub(late_ms), wrong);
            if self.disturb.is(Kind::ReceiverNoise) {
                let at = self.disturb.below(fix.len() as u32) as usize;
                if let Some(byte) = fix.get_mut(at) {
                    *byte ^= 0x20;
                }
            }
            lines.gnss.come(&fix);
        }
        if self.disturb.is(Kind::FixFlood) {
            let forged = self.disturb.below(1 << 29);
            let fix = drive.world.fix(forged, false);
            lines.gnss.come(&fix);
        }
        self.ask(lines, record);
        lines.navigation.full = self.disturb.is(Kind::OutputFull) && self.disturb.chance(3);
        if self.disturb.is(Kind::Reverse) && self.disturb.chance(4) {
            let mut bytes = [0; 12];
            self.disturb.fill(&mut bytes);
            lines.navigation.input.come(&bytes);
        }
    }

    /// Sends requests.
    fn ask(&mut self, lines: &mut AppLines, record: &Record) {
        let disturb = &mut self.disturb;
        let mut send = |request: &Request| {
            let mut packet = [0; MAX_PACKET];
            if let Ok(packet) = encode(7, request, &mut packet) {
                lines.command.come(packet);
            }
        };
        if disturb.is(Kind::Mode) {
            send(&Request::SetMode(disturb.mode()));
        }
        if disturb.is(Kind::CommandFlood) {
            for _ in 0..3 {
                let mut bytes = [0; MAX_CHUNK];
                send(&disturb.request(&mut bytes));
            }
        }
        if disturb.is(Kind::StoreNow) {
            send(&Request::SetMode(Mode::Bypass));
            send(&Request::StoreImage);
            send(&Request::SetMode(Mode::Learn));
        }
        if disturb.is(Kind::Configure) {
            send(&Request::SetMode(Mode::Bypass));
            for (index, bytes) in record.chunks(MAX_CHUNK).enumerate() {
                let offset = (index * MAX_CHUNK) as u32;
                send(&Request::WriteConfiguration { offset, bytes });
            }
            let length = record.len() as u32;
            send(&Request::CommitConfiguration { length });
        }
        if disturb.is(Kind::CommandNoise) {
            let mut bytes = [0; 40];
            disturb.fill(&mut bytes);
            lines.command.come(&bytes);
        }
    }

    /// Runs passes until the application is idle.
    fn settle(&mut self, app: &mut App, lines: &mut AppLines, now: &Cell<u64>) {
        let mut passes = 0;
        loop {
            lines.navigation.exact = app.correction() == [[0.0; 3]; 2];
            let before = lines.navigation.seen.inexact;
            let more = app.poll(lines, now);
            if app.correction() != [[0.0; 3]; 2] {
                // it came into force in this pass
                lines.navigation.seen.inexact = before;
            }
            passes += 1;
            if !more {
                break;
            }
            if passes >= PASSES {
                self.violated(Violation::Restless);
                break;
            }
        }
        self.report.passes = self.report.passes.max(passes);
        let MessageCounts {
            wrong,
            inexact,
            made_up,
            ..
        } = lines.navigation.seen;
        if wrong > 0 {
            self.violated(Violation::Changed);
        }
        if inexact > 0 {
            self.violated(Violation::Inexact);
        }
        if made_up > 0 {
            self.violated(Violation::MadeUp);
        }
        if lines.navigation.inside() > CAPACITY {
            self.violated(Violation::Kept);
        }
    }

    /// Stores what is pending, one step per sample.
    fn keep(&mut self, app: &mut App, store: &mut Store<Failing>) {
        if !app.wants_to_store() {
            return;
        }
        let mut ended = None;
        app.store(|step, content| {
            let progress = store.carry_out(step, content);
            ended = Some(progress);
            progress
        });
        match ended {
            Some(firmware::store::Progress::Done) => self.report.stored += 1,
            Some(firmware::store::Progress::Failed) => self.report.failed += 1,
            _ => {}
        }
    }

    /// Checks that are made once a second.
    fn second(&mut self, drive: &mut Drive, app: &App, lines: &AppLines) {
        self.report.navigated += u32::from(app.learning().navigates);
        if lines.navigation.passing.borrow().overrun {
            self.violated(Violation::Overrun);
        }
        let now = app.counters();
        let before = core::mem::replace(&mut drive.counters, now);
        let begun_anew = now.frames < before.frames;
        let back = now.garbage < before.garbage || now.fixes < before.fixes;
        if back && !begun_anew {
            self.violated(Violation::Counter);
        }
        let limit = Configuration::default().correction.limit;
        let [gyro, accel] = app.correction();
        let within = |triad: [f32; 3], limit: f32| triad.iter().all(|c| c.abs() <= limit);
        if !within(gyro, limit.gyro) || !within(accel, limit.accel) {
            self.violated(Violation::Limit);
        }
    }

    fn gather(&mut self, lines: &mut AppLines) {
        let MessageCounts {
            same,
            changed,
            full,
            ..
        } = lines.navigation.seen;
        self.report.same += same;
        self.report.corrected += changed;
        self.report.full += full;
        self.digests = digests(lines).map(|digest| *digest);
    }
}
