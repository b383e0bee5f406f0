//! A learner of a lower priority: whenever it gets the processor, the same bytes leave. One that
//! falls behind is stopped, and the stream goes on.

use crate::activation::{KIND, RATE, fix};
use crate::device::{Device, Mock, nets};
use firmware::app::{Activation, App, Config, Jobs};
use firmware::compensator::{Block, Limit};
use firmware::control::Mode;
use firmware::fix::Fix;
use firmware::learn::exchange::{Background, Exchange, SAMPLES};
use firmware::learn::{Learner, Report, Winner};
use firmware::model::Nets;
use firmware::sample::{RawSample, StreamScale};
use firmware::store::Progress;
use firmware::wire::command::{Request, Response, fault};
use lrnn_nostd::State;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

/// Samples of a block.
const BLOCK: u32 = 20;

/// A learner whose correction follows from all that it has had, in its order.
#[derive(Debug, Default)]
struct Orders {
    digest: u32,
    blocks: u32,
}

impl Orders {
    fn takes(&mut self, what: u32) {
        self.digest = (self.digest ^ what)
            .wrapping_mul(0x0100_0193)
            .rotate_left(5);
    }

    /// Up to 0.1 m/s2.
    fn error(&self) -> f32 {
        (self.digest >> 16) as f32 / 655_360.0
    }
}

impl Learner for Orders {
    fn begin(&mut self, _: &Nets, _: StreamScale) {
        *self = Orders::default();
    }
    fn restart(&mut self) {
        self.takes(1);
    }
    fn sample(&mut self, number: u32, sample: &RawSample) {
        let RawSample::Counts { gyro, .. } = sample else {
            panic!("{sample:?}")
        };
        self.takes(number ^ gyro[0] as u32);
    }
    fn block(&mut self, last: u32, _: &Block) {
        self.takes(last);
        self.blocks += 1;
    }
    fn gap(&mut self) {
        self.takes(2);
    }
    fn fix(&mut self, number: u32, fix: &Fix) {
        self.takes(number ^ fix.time_ms);
    }
    fn winner(&mut self) -> Option<Winner> {
        (self.blocks % 7 != 6).then(|| Winner {
            nets: nets([0.0; 3], [self.error(), 0.0, 0.0]),
            states: [State::new(); 2],
            estimate: [[0.0; 3], [self.error(), 0.0, 0.0]],
        })
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        (nets([0.0; 3], [self.error(), 0.0, 0.0]), [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report {
            used: self.blocks,
            ..Report::default()
        }
    }
}

fn device() -> Device {
    let limit = Limit {
        gyro: 1.0,
        accel: 1.0,
    };
    let config = Config {
        mode: Mode::Learn,
        activation: Activation::Faded,
        block: f64::from(BLOCK) / f64::from(RATE),
        limit,
        slew: Limit {
            gyro: 1e6,
            accel: 1e6,
        },
        ..KIND.config()
    };
    let mut device = Device::new(Config::default());
    let learner = Box::leak(Box::<Orders>::default());
    device.app = App::with_learner(config, Some(learner));
    device
}

fn apart(device: &mut Device) -> Background<'static> {
    let exchange = Box::leak(Box::new(Exchange::new()));
    device.app.split(exchange).expect("it has a learner")
}

/// Sends frame `n`, and the receiver's fix with each hundredth.
fn frame(device: &mut Device, n: u32) {
    if n.is_multiple_of(RATE) {
        device.lines.gnss.input.extend(fix(n / RATE, 3000));
    }
    let frames = KIND.stream(n, n + 1);
    device.feed(&frames[0]);
    device.pass_us(1_000_000 / u64::from(RATE));
}

/// Frames 300 to 309 are missing.
fn is_missing(n: u32) -> bool {
    (300..310).contains(&n)
}

fn sent(device: &Device) -> Vec<u8> {
    device.lines.navigation.bytes()
}

#[test]
fn whenever_the_learner_runs_the_same_bytes_leave() {
    let frames = 0..2000;
    let mut here = device();
    for n in frames.clone().filter(|n| !is_missing(*n)) {
        frame(&mut here, n);
    }
    let raw: Vec<u8> = (frames.clone())
        .filter(|n| !is_missing(*n))
        .flat_map(|n| KIND.stream(n, n + 1).concat())
        .collect();
    assert!(sent(&here) != raw, "nothing was corrected");
    let mut random = 1_u32;
    // always at once, some orders at a time, at the end of the block only
    for most in [u32::MAX, 40, 3, 1] {
        let mut there = device();
        let mut background = apart(&mut there);
        for n in frames.clone().filter(|n| !is_missing(*n)) {
            frame(&mut there, n);
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let last = n % BLOCK >= BLOCK - 2 || is_missing(n + 1);
            let turns = if last {
                u32::MAX
            } else {
                (random >> 16) % most
            };
            (0..turns).take_while(|_| background.turn()).for_each(drop);
        }
        assert_eq!(there.app.faults() & fault::LEARNER, 0, "{most}");
        assert!(sent(&there) == sent(&here), "{most}");
    }
}

/// The two in threads of their own, on a desktop's two cores. The frames wait at the end of a block
/// only, for a learner that would be late by the wall clock.
#[test]
fn in_two_threads_the_same_bytes_leave() {
    let frames = 0..40 * BLOCK;
    let mut here = device();
    frames.clone().for_each(|n| frame(&mut here, n));
    let mut there = device();
    let mut background = apart(&mut there);
    let answered = AtomicU32::new(0);
    std::thread::scope(|scope| {
        let answered = &answered;
        let learner = scope.spawn(move || {
            let mut blocks = 0;
            while blocks < 39 {
                if background.turn() {
                    blocks = background.learner().report().used;
                    answered.store(blocks, Ordering::Release);
                } else {
                    std::thread::yield_now();
                }
            }
        });
        for n in frames {
            frame(&mut there, n);
            // the first frame only begins the stream
            let ended = (n + 1) / BLOCK;
            while n % BLOCK == BLOCK - 1 && answered.load(Ordering::Acquire) < ended.min(39) {
                std::thread::yield_now();
            }
        }
        learner.join().expect("it ends");
    });
    assert_eq!(there.app.faults() & fault::LEARNER, 0);
    assert!(sent(&there) == sent(&here));
}

/// A learner that gets no time at all: its answer is missed at the end of the next block. The
/// stream goes on, and what it has brought into force stays.
#[test]
fn a_learner_without_time_is_stopped_and_the_stream_goes_on() {
    let mut there = device();
    let mut background = apart(&mut there);
    for n in 0..10 * BLOCK {
        frame(&mut there, n);
        while background.turn() {}
    }
    let in_force = there.app.correction();
    assert_ne!(in_force, [[0.0; 3]; 2]);
    for n in 10 * BLOCK..12 * BLOCK {
        assert_eq!(there.app.faults() & fault::LEARNER, 0, "{n}");
        frame(&mut there, n);
    }
    let frames = there.app.counters().frames;
    for n in 12 * BLOCK..100 * BLOCK {
        frame(&mut there, n);
        assert_ne!(there.app.faults() & fault::LEARNER, 0, "{n}");
    }
    assert_eq!(there.app.counters().frames - frames, 88 * BLOCK);
    assert_eq!(there.lines.navigation.sent.len() as u32, 100 * BLOCK);
    let stays = there.app.correction();
    let (mut waited, mut last) = (0, there.app.correction());
    while background.turn() {
        waited += 1; // the orders from before, at most
        last = there.app.correction();
    }
    assert!(waited <= SAMPLES);
    assert_eq!(last, stays, "an answer that comes too late is not used");
    // it begins again with another mode, when it has caught up
    there.order(&Request::SetMode(Mode::Bypass));
    there.order(&Request::SetMode(Mode::Learn));
    for n in 100 * BLOCK..110 * BLOCK {
        frame(&mut there, n);
        while background.turn() {}
    }
    assert_eq!(there.app.faults() & fault::LEARNER, 0);
    assert_eq!(there.app.learning().used, 9);
    assert_ne!(there.app.correction(), stays);
}

/// A learner that was stopped gets the configuration of another unit when it has caught up, and
/// what it knew of the unit before is gone. A verdict that nobody waits for any more answers no
/// later question.
#[test]
fn a_stopped_learner_misses_no_configuration_and_answers_no_later_question() {
    use crate::record::{HARDWARE, configure, configured};
    use firmware::configuration::record::encode;
    let heading = |angle| Request::Heading(firmware::fix::Heading { angle, sigma: 0.1 });
    let calls: &Mutex<Vec<_>> = Box::leak(Box::default());
    let mut configuration = configured(KIND);
    configuration.correction.mode = Mode::Learn;
    configuration.identity.serial = "1".try_into().expect("short");
    let mut there = Device::new(Config::default());
    let learner = Box::leak(Box::new(Told(calls)));
    let config = Config {
        hardware: HARDWARE,
        ..Config::of(&configuration)
    };
    there.app = App::with_learner(config, Some(learner));
    let mut background = apart(&mut there);
    let mut n = 0;
    let mut run = |there: &mut Device<Mock>, frames: u32, turns: &mut dyn FnMut()| {
        for _ in 0..frames {
            frame(there, n);
            turns();
            n += 1;
        }
    };
    run(&mut there, 2 * RATE, &mut || while background.turn() {});
    calls.lock().expect("no panic").clear();

    // it gets no time: stopped, with a question that is refused
    let packet = |there: &mut Device<Mock>, number, request| {
        let mut buffer = [0; firmware::wire::command::MAX_PACKET];
        let packet = firmware::wire::command::encode(number, &request, &mut buffer);
        there
            .lines
            .command
            .input
            .extend(&*packet.expect("a packet"));
    };
    packet(&mut there, 201, heading(1.0));
    run(&mut there, 4 * RATE, &mut || ());
    assert_ne!(there.app.faults() & fault::LEARNER, 0);
    assert_eq!(there.lines.command.sent.len(), 1);
    there.lines.command.sent.clear();

    // another unit, while it is stopped and has not caught up
    configuration.identity.serial = "2".try_into().expect("short");
    there.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(configure(&mut there, &encode(&configuration)), Ok(()));
    while background.turn() {}
    run(&mut there, 2 * RATE, &mut || while background.turn() {});
    let told = calls.lock().expect("no panic").clone();
    let at = |what| told.iter().position(|told| *told == what);
    assert!(at("forget") < at("configure"), "{told:?}");
    assert!(
        at("forget").is_some() && at("configure") < at("begin"),
        "{told:?}"
    );
    assert_eq!(there.app.faults() & fault::LEARNER, 0);

    there.lines.command.sent.clear();
    packet(&mut there, 202, heading(2.0));
    there.wait_ms(20);
    assert!(
        there.lines.command.sent.is_empty(),
        "a verdict on the first heading"
    );
    while background.turn() {}
    there.wait_ms(20);
    assert_eq!(there.lines.command.sent.len(), 1);
}

/// What a learner is told.
#[derive(Debug)]
struct Told(&'static Mutex<Vec<&'static str>>);

impl Told {
    fn note(&self, what: &'static str) {
        self.0.lock().expect("no panic").push(what);
    }
}

impl Learner for Told {
    fn begin(&mut self, _: &Nets, _: StreamScale) {
        self.note("begin");
    }
    fn restart(&mut self) {}
    fn recall(&mut self, memory: &[u8]) {
        assert!(memory.is_empty());
        self.note("forget");
    }
    fn configure(&mut self, _: &firmware::learn::Settings) {
        self.note("configure");
    }
    fn sample(&mut self, _: u32, _: &RawSample) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn winner(&mut self) -> Option<Winner> {
        None
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        (Nets::NONE, [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report::default()
    }
}

/// With more samples in a block than the queue holds.
#[test]
fn a_full_queue_stops_the_learner() {
    let mut there = device();
    let _background = apart(&mut there);
    let mut full = None;
    for n in 0..BLOCK {
        frame(&mut there, n);
    }
    // the queue fills within the first blocks, whichever comes first
    for n in BLOCK..SAMPLES as u32 + 2 * BLOCK {
        frame(&mut there, n);
        if there.app.faults() & fault::LEARNER != 0 {
            full = full.or(Some(n));
        }
    }
    assert!(full.is_some());
}

/// A request that needs the learner's verdict is answered when the learner has given it, and other
/// requests wait behind.
#[test]
fn a_request_waits_for_the_learner() {
    let mut there = device();
    let mut background = apart(&mut there);
    frame(&mut there, 0);
    let heading = Request::Heading(firmware::fix::Heading {
        angle: 0.5,
        sigma: 0.1,
    });
    let mut buffer = [0; firmware::wire::command::MAX_PACKET];
    for (number, request) in [(1, heading), (2, Request::GetHealth)] {
        let packet = firmware::wire::command::encode(number, &request, &mut buffer);
        (there.lines.command.input).extend(&*packet.expect("a packet"));
    }
    there.wait_ms(20);
    assert!(there.lines.command.sent.is_empty());
    while background.turn() {}
    there.wait_ms(20);
    let mut numbers = Vec::new();
    for mut packet in core::mem::take(&mut there.lines.command.sent) {
        let answer = firmware::wire::command::decode::<Response>(&mut packet);
        let (number, response) = answer.expect("an answer");
        numbers.push((number, matches!(response, Response::Refused(_))));
    }
    assert_eq!(numbers, [(1, true), (2, false)]);
}

/// A board that stores in the main thread: what is stored is as by [`App::store`].
#[test]
fn what_is_stored_apart_is_the_same() {
    let configuration = crate::record::configured(KIND);
    let job = |store: &mut dyn FnMut(&mut Device<Mock>)| {
        let config = Config {
            store: true,
            ..Config::of(&configuration)
        };
        let mut device = Device::new(config);
        device.order(&Request::SetMode(Mode::Bypass));
        device.order(&Request::StoreImage);
        assert!(device.app.wants_to_store());
        store(&mut device);
        assert!(!device.app.wants_to_store());
        device.app.faults() & fault::STORE != 0
    };
    for progress in [Progress::Done, Progress::Failed] {
        let mut records = Vec::new();
        let failed = job(&mut |device| {
            device.app.store(|_, content| {
                records.push(content.record.clone());
                progress
            });
        });
        let apart = job(&mut |device| {
            let mut jobs = Jobs::new();
            let (mut gives, mut stores) = jobs.split();
            assert!(gives.turn(&mut device.app) && !device.app.wants_to_store());
            assert!(!gives.turn(&mut device.app), "one at a time");
            assert!(stores.turn(|job| {
                records.push(job.content(None).record.clone());
                progress
            }));
            assert!(!stores.turn(|_| panic!("once")));
            assert!(!gives.turn(&mut device.app));
        });
        assert_eq!((failed, apart), (progress == Progress::Failed, failed));
        assert_eq!(records[0], records[1]);
        assert!(!records[0].is_empty());
    }
}
