//! The soak itself, sample by sample.

use crate::disturb::{Disturb, Kind};
use crate::drive::Drive;
use crate::flash::{Failing, Flash};
use crate::lines::{Digest, Input, MessageCounts, Noted, OutputLine, Passing};
use crate::random::Random;
use crate::sensor::{Port, Sensor};
use crate::setup::{configured, nets};
use crate::world::World;
use core::cell::{Cell, RefCell};
use firmware::app::blackbox;
use firmware::app::{App, Hardware, Lines};
use firmware::configuration::Configuration;
use firmware::configuration::record::{Record, encode as record_of};
use firmware::control::Mode;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::link::faulty::{Chances, Faulty};
use firmware::store::{Content, MEMORY_MAX, Store};
use firmware::wire::command::{MAX_CHUNK, MAX_PACKET, Request, encode};
use firmware::wire::framer::{CAPACITY, LONGEST};

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
    };
    memory.flash.clear();
    let end = u64::from(plan.seconds) * u64::from(plan.rate);
    while soak.sample < end && soak.report.violation.is_none() {
        let Some(sensor) = Sensor::draw(plan.rate, &mut soak.random) else {
            break;
        };
        soak.drive(memory, &sensor, end, watch);
    }
    soak.sum_up();
    soak.report
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

/// A step of the application, in which nothing may be changed while nothing is corrected.
fn watched<T>(
    app: &mut App,
    lines: &mut AppLines,
    step: impl FnOnce(&mut App, &mut AppLines) -> T,
) -> T {
    lines.navigation.exact = app.correction() == [[0.0; 3]; 2];
    let before = lines.navigation.seen.inexact;
    let done = step(app, lines);
    if app.correction() != [[0.0; 3]; 2] {
        // it came into force in this step
        lines.navigation.seen.inexact = before;
    }
    done
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
        if let Port::Spi(adis) = sensor.port {
            app.detected(&adis);
        }
        self.report.power_ons += 1;
        let passing = RefCell::new(Passing::default());
        let seed = u64::from(self.random.next());
        let mut lines: AppLines = Lines {
            sensor: Noted {
                line: Faulty::new(Input::default(), Chances::default(), seed),
                passing: &passing,
            },
            navigation: OutputLine::new(&passing, sensor.port),
            command: Input::default(),
            gnss: Input::default(),
        };
        for (slot, digest) in digests(&mut lines).into_iter().zip(self.digests) {
            *slot = digest; // it continues over a power-on
        }
        let random = Random::new(self.plan.seed, self.random.next().into());
        let mut drive = Drive::new(World::new(random, self.plan.rate), sensor);
        let now = Cell::new(0);
        let mut number = 0u64;
        while self.sample < end && self.report.violation.is_none() {
            self.disturb.step();
            if self.disturb.is(Kind::Reset) {
                break;
            }
            (self.sample, number) = (self.sample + 1, number + 1);
            now.set(number * 1_000_000 / u64::from(self.plan.rate));
            self.feed(&mut drive, &mut app, &mut lines, number);
            self.ask(&mut lines, &record);
            if self.disturb.is(Kind::HeldUp) && !self.disturb.chance(4) {
                continue;
            }
            self.take_bursts(&mut drive, &mut app, &mut lines, &now);
            self.settle(&mut app, &mut lines, &now);
            if let (Port::Spi(adis), true) = (sensor.port, app.must_detect_again()) {
                app.detected(&adis);
            }
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
        self.gather(&mut lines, sensor.port);
        app.hold_recording();
        if !watch.drive_over(&configuration, &app) {
            self.violated(Violation::BlackBox);
        }
    }

    /// Sends the bytes of a sample time on the lines of sensor, receiver and navigation computer.
    fn feed(&mut self, drive: &mut Drive, app: &mut App, lines: &mut AppLines, number: u64) {
        match drive.sensor.port {
            Port::Line(_) => self.send(drive, lines),
            Port::Spi(adis) => {
                let form = adis.model.form();
                let (len, lost) = drive.fetch(&mut self.disturb, self.plan.rate, form);
                self.report.came += len as u64;
                if lost {
                    app.lost();
                }
            }
        }
        self.receive(drive, lines, number);
        lines.navigation.full = self.disturb.is(Kind::OutputFull) && self.disturb.chance(3);
        if self.disturb.is(Kind::Reverse) && self.disturb.chance(4) {
            let mut bytes = [0; 12];
            self.disturb.fill(&mut bytes);
            lines.navigation.input.come(&bytes);
        }
    }

    /// The sensor's bytes of a sample.
    fn send(&mut self, drive: &mut Drive, lines: &mut AppLines) {
        let faulty = &mut lines.sensor.line;
        faulty.chances = if self.disturb.is(Kind::SensorNoise) {
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
    }

    /// The application takes the bursts that the board has fetched, with a pass after each, as
    /// a board does.
    fn take_bursts(
        &mut self,
        drive: &mut Drive,
        app: &mut App,
        lines: &mut AppLines,
        now: &Cell<u64>,
    ) {
        while let Some(mut burst) = drive.bursts.pop_front() {
            let passing = lines.navigation.passing;
            passing.borrow_mut().come(&burst);
            let taken = watched(app, lines, |app, lines| {
                app.burst(&mut burst, &mut lines.navigation, now)
            });
            if taken.is_err() {
                passing.borrow_mut().refused();
            }
            if lines.navigation.inside() > 0 {
                self.violated(Violation::Kept);
            }
            self.settle(app, lines, now);
        }
    }

    /// The receiver's bytes of a sample.
    fn receive(&mut self, drive: &mut Drive, lines: &mut AppLines, number: u64) {
        let rate = u64::from(self.plan.rate);
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
            let more = watched(app, lines, |app, lines| app.poll(lines, now));
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

    fn gather(&mut self, lines: &mut AppLines, port: Port) {
        let MessageCounts {
            same,
            changed,
            full,
            ..
        } = lines.navigation.seen;
        self.report.same += same;
        self.report.corrected += changed;
        if matches!(port, Port::Spi(_)) {
            self.report.corrected_bursts += changed;
        }
        self.report.full += full;
        self.digests = digests(lines).map(|digest| *digest);
    }
}
