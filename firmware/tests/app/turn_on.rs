//! A sensor that restarts has other errors: nothing that was learnt before is applied. And a sensor
//! whose values do not change is reported.

use crate::device::{Device, Shared, nets};
use crate::frames::{Fields, Kind, kinds, values};
use firmware::app::{Activation, App, Config};
use firmware::compensator::{Block, Limit};
use firmware::control::{Alignment, Mode};
use firmware::learn::{Learner, Report, Winner};
use firmware::model::Nets;
use firmware::sample::{RawSample, StreamScale};
use firmware::wire::ImuFormat;
use firmware::wire::command::{Request, fault};
use firmware::wire::hg4930;
use firmware::wire::stim300::{self, Contents, status};
use lrnn_nostd::State;
use std::sync::Arc;

/// Calls that a learner got.
#[derive(Debug, Default)]
struct Calls {
    begun: Shared<u32>,
    samples: Shared<u32>,
    blocks: Shared<u32>,
    silences: Shared<u32>,
}

/// A learner that learns an error whenever it is begun.
#[derive(Debug)]
struct Knows(Arc<Calls>);

impl Learner for Knows {
    fn begin(&mut self, _: &Nets, _: StreamScale) {
        self.0.begun.set(self.0.begun.get() + 1);
    }
    fn restart(&mut self) {}
    fn sample(&mut self, _: u32, _: &RawSample) {
        self.0.samples.set(self.0.samples.get() + 1);
    }
    fn block(&mut self, _: u32, _: &Block) {
        self.0.blocks.set(self.0.blocks.get() + 1);
    }
    fn gap(&mut self) {}
    fn silence(&mut self) {
        self.0.silences.set(self.0.silences.get() + 1);
    }
    fn winner(&mut self) -> Option<Winner> {
        (self.0.begun.get() == 1).then(|| Winner {
            nets: nets([1e-3, 0.0, 0.0], [0.0; 3]),
            states: [State::new(); 2],
            estimate: [[1e-3, 0.0, 0.0], [0.0; 3]],
        })
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        (Nets::NONE, [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report {
            winner: u8::from(self.0.begun.get() == 1),
            ..Report::default()
        }
    }
}

/// A device in mode learn whose learner has proved an error that is in force.
struct Bench {
    kind: Kind,
    device: Device,
    calls: Arc<Calls>,
    n: u32,
}

impl Bench {
    fn new(kind: Kind) -> Bench {
        let calls = Arc::new(Calls::default());
        let mut device = Device::new(Config::default());
        let config = Config {
            mode: Mode::Learn,
            activation: Activation::Commanded,
            block: 10.0 / kind.rate(),
            limit: Limit {
                gyro: 1.0,
                accel: 1.0,
            },
            slew: Limit {
                gyro: 1e6,
                accel: 1e6,
            },
            ..kind.config()
        };
        let learner = Box::leak(Box::new(Knows(calls.clone())));
        device.app = App::with_learner(config, Some(learner));
        let mut bench = Bench {
            kind,
            device,
            calls,
            n: 0,
        };
        bench.run(30);
        bench.device.order(&Request::Alignment(Alignment::Started));
        bench.run(30);
        assert!(bench.corrects(), "{kind:?}");
        bench
    }

    fn run(&mut self, frames: u32) {
        for frame in self.kind.stream(self.n, self.n + frames) {
            self.device.feed(&frame);
            self.device.pass_us((1e6 / self.kind.rate()) as u64);
        }
        self.n += frames;
    }

    /// Whether the next frame is corrected.
    fn corrects(&mut self) -> bool {
        let frame = self.kind.stream(self.n, self.n + 1).remove(0);
        self.n += 1;
        self.device.feed(&frame);
        let sent = self.device.lines.navigation.sent.last().expect("a frame");
        values(self.kind.format, sent)[0] != values(self.kind.format, &frame)[0]
    }

    fn restarts(&mut self) -> u32 {
        self.device.counters().restarts
    }
}

/// A STIM300 measurement with a status byte.
fn stim(n: u32, status: u8) -> Vec<u8> {
    let cluster = |values| stim300::Cluster { values, status };
    let repr = stim300::Repr {
        contents: Contents::from_id(0x91).expect("an identifier"),
        gyro: cluster([n as i32 % 5, 1, 2]),
        accel: cluster([3, n as i32 % 7, 4]),
        incl: stim300::Cluster::default(),
        temperatures: [stim300::Temperatures::default(); 3],
        extra: (0, 0),
        counter: (2 * n) as u8,
        latency_us: 120,
    };
    let mut buffer = [0; stim300::MAX_LEN];
    let len = repr.emit(&mut buffer).expect("room");
    buffer[..len].to_vec()
}

fn datagram(id: u8) -> Vec<u8> {
    let mut bytes = vec![id; 16];
    let sum = firmware::wire::checksum::crc32_mpeg2_padded(&bytes);
    bytes.extend(sum.to_be_bytes());
    bytes
}

fn pattern() -> Vec<u8> {
    let repr = hg4930::Repr {
        message: hg4930::Message::Inertial,
        rate: [0x5555; 3],
        accel: [0x5555; 3],
        status_1: 0,
        status_2: 0x0200,
        angle: [0x5555_5555; 3],
        velocity: [0x5555_5555; 3],
    };
    let mut buffer = [0; hg4930::MAX_LEN];
    let len = repr.emit(&mut buffer).expect("room");
    buffer[..len].to_vec()
}

/// The signs of one restart, one by one and together, count once. The correction that was learnt
/// before is gone at once, and the learner restarts.
#[test]
fn a_start_of_the_sensor_is_noticed() {
    type Sign = fn(&mut Bench);
    let bit: Sign = |bench| bench.device.feed(&stim(bench.n, status::START_UP));
    let number: Sign = |bench| bench.device.feed(&datagram(0xB1));
    let serial: Sign = |bench| bench.device.feed(&datagram(0xB7));
    let off: Sign = |bench| bench.device.wait_ms(1001);
    let test: Sign = |bench| {
        bench.device.wait_ms(500);
        let mut message = vec![0xFE, 0x81, 0x00, 0xAA, 0x7F, 0x7F, 0x7F, 0x7F, 0x7F, 0x7F];
        let sum = message
            .iter()
            .fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        message.push(sum);
        bench.device.feed(&message);
    };
    let starts: Sign = |bench| bench.device.feed(&pattern());
    let sbg = kinds()
        .into_iter()
        .find(|kind| kind.format == ImuFormat::SbgEcom)
        .expect("one");
    let from_zero: Sign = |bench| {
        bench.device.wait_ms(300);
        let fields = Fields {
            time: 0.01,
            ..Fields::default()
        };
        let mut buffer = [0; 256];
        let len = (bench.kind.sensor.emit)(&fields, &mut buffer).expect("room");
        bench.device.feed(&buffer[..len]);
    };
    let cases: [(Kind, &[Sign]); 9] = [
        (Kind::STIM, &[bit]),
        (Kind::STIM, &[number]),
        (Kind::STIM, &[serial]),
        (Kind::STIM, &[off, number, serial, bit]),
        (Kind::KVH, &[off]),
        (Kind::KVH, &[test]),
        (Kind::HG4930, &[starts]),
        (Kind::RAWIMUSX, &[off]),
        (sbg, &[from_zero]),
    ];
    for (kind, signs) in cases {
        let mut bench = Bench::new(kind);
        signs.iter().for_each(|sign| sign(&mut bench));
        assert!(!bench.corrects() && !bench.corrects(), "{kind:?}");
        bench.run(50);
        assert!(!bench.corrects(), "{kind:?}");
        assert_eq!(bench.restarts(), 1, "{kind:?}");
        let begun = bench.calls.begun.get();
        // without its configuration a STIM300 is not learnt from
        assert_eq!(begun, if kind == Kind::STIM { 1 } else { 2 }, "{kind:?}");
        if kind == Kind::STIM {
            assert_eq!(bench.device.app.faults(), fault::UNITS);
            bench.device.feed(&stim300::config::Config::DEFAULT.emit());
            bench.run(50);
            assert_eq!(bench.calls.begun.get(), 2);
            assert_eq!(bench.device.app.faults(), 0);
        }
    }
}

/// What is no restart of the sensor: a short silence, answers that were asked for, an axis that is
/// bad, a start of sensor and device together.
#[test]
fn not_every_silence_is_a_start() {
    let mut bench = Bench::new(Kind::KVH);
    bench.device.wait_ms(900);
    assert!(bench.corrects());
    assert_eq!((bench.restarts(), bench.calls.begun.get()), (0, 1));
    assert!(bench.calls.silences.get() > 0);

    let mut bench = Bench::new(Kind::STIM);
    bench.device.lines.navigation.input.extend(b"N\rI\rC\r");
    bench.device.settle();
    let config_datagram = stim300::config::Config::DEFAULT.emit();
    bench
        .device
        .feed(&[&datagram(0xB1)[..], &datagram(0xB5), &config_datagram].concat());
    bench.device.feed(&stim(bench.n, status::OVERLOAD | 1));
    bench.n += 1;
    assert!(bench.corrects());
    assert_eq!(bench.restarts(), 0);

    let mut device = Device::new(Kind::STIM.config());
    device.wait_ms(2000);
    device.feed(&[&datagram(0xB1)[..], &datagram(0xB5), &config_datagram].concat());
    (0..10).for_each(|n| device.feed(&stim(n, status::START_UP)));
    (10..100).for_each(|n| device.feed(&stim(n, 0)));
    assert_eq!(device.counters().restarts, 0);
}

/// A sensor that sends a frame a second is silent most of the time, and is corrected all the same.
#[test]
fn a_slow_sensor_does_not_restart() {
    let kind = Kind::KVH;
    let mut config = Config {
        mode: Mode::Frozen,
        nets: nets([1e-3, 0.0, 0.0], [0.0; 3]),
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        block: 2.0,
        ..kind.config()
    };
    config.sensor.rate = 1.0;
    let mut device = Device::new(config);
    for n in 0..50 {
        let frame = kind.stream(n, n + 1).remove(0);
        device.feed(&frame);
        device.wait_ms(1100);
        if n > 3 {
            let sent = device.lines.navigation.sent.last().expect("a frame");
            assert!(values(kind.format, sent)[0] < values(kind.format, &frame)[0]);
        }
    }
    assert_eq!(device.counters().restarts, 0);
    assert_eq!(device.app.faults(), fault::SILENT);
}

/// All six values constant for a second and 100 samples, although the sensor marks them valid: they
/// are reported and not learnt from. Corrections go on.
#[test]
fn constant_values_are_reported() {
    for kind in kinds() {
        let mut device = Device::new(Config {
            mode: Mode::Frozen,
            nets: nets([0.5, 0.0, 0.0], [0.0; 3]),
            limit: Limit {
                gyro: 1.0,
                accel: 1.0,
            },
            block: 10.0 / kind.rate(),
            ..kind.config()
        });
        let fields = Fields {
            gyro: [300, 20, -7],
            accel: [1, 2, 900],
            ..Fields::default()
        };
        let after = (kind.rate() as u32).max(100);
        let moving = kind.stream(0, 50);
        moving.iter().for_each(|frame| device.feed(frame));
        (50..50 + after).for_each(|n| device.feed(&kind.frame(n, fields)));
        assert_eq!(device.app.faults() & fault::STUCK, 0, "{kind:?}");
        device.feed(&kind.frame(50 + after, fields));
        assert_ne!(device.app.faults() & fault::STUCK, 0, "{kind:?}");
        let blocks = device.counters().blocks;
        (51 + after..150 + after).for_each(|n| device.feed(&kind.frame(n, fields)));
        assert_eq!(device.counters().blocks, blocks, "{kind:?}");
        let sent = device.lines.navigation.sent.last().expect("a frame");
        let same = values(kind.format, &kind.frame(0, fields))[0];
        assert!(values(kind.format, sent)[0] < same, "{kind:?}");
        let again = kind.stream(150 + after, 180 + after);
        again.iter().for_each(|frame| device.feed(frame));
        assert_eq!(device.app.faults() & fault::STUCK, 0, "{kind:?}");
        assert!(device.counters().blocks > blocks, "{kind:?}");
    }
}

/// One count of noise on one axis, once in a while, is enough.
#[test]
fn coarse_values_are_not_constant() {
    let kind = Kind::S_CLASS;
    let mut device = Device::new(kind.config());
    let mut state = 1u32;
    for n in 0..20_000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let axis = (state >> 16) % 6;
        let moves = state >> 24 < 2; // one of 128 samples
        let mut values = [0; 6];
        values[axis as usize] = i32::from(moves);
        let [a, b, c, d, e, f] = values;
        let fields = Fields {
            gyro: [a, b, c],
            accel: [d, e, f],
            ..Fields::default()
        };
        device.feed(&kind.frame(n, fields));
        assert_eq!(device.app.faults() & fault::STUCK, 0, "{n}");
    }
}

/// A counter or a time that does not advance while frames come.
#[test]
fn a_counter_that_does_not_advance_is_reported() {
    let sbg = kinds()
        .into_iter()
        .find(|kind| kind.format == ImuFormat::SbgEcom)
        .expect("one");
    for kind in [Kind::STIM, Kind::KVH, Kind::RAWIMUSX, sbg] {
        let mut device = Device::new(kind.config());
        device.feed(&kind.stream(0, 20).concat());
        let fields = |k: i32| Fields {
            gyro: [k, 0, 1],
            ..Fields::default()
        };
        (0..9).for_each(|k| device.feed(&kind.frame(20, fields(k))));
        assert_eq!(device.app.faults(), 0, "{kind:?}");
        (9..20).for_each(|k| device.feed(&kind.frame(20, fields(k))));
        assert_eq!(device.app.faults(), fault::STUCK, "{kind:?}");
        device.feed(&kind.stream(21, 23).concat());
        assert_eq!(device.app.faults(), 0, "{kind:?}");
    }
}

/// A counter of 16 bits that comes round while the cable bounces has not started: what was in force
/// stays.
#[test]
fn coming_round_in_a_silence_is_no_start() {
    for kind in kinds() {
        let mut bench = Bench::new(kind);
        let silent = (kind.rate() / 2.0) as u32;
        bench.n = 65_536 - silent / 2 - 40;
        bench.run(40);
        let before = (bench.restarts(), bench.calls.begun.get());
        bench.device.wait_ms(500);
        bench.n += silent;
        bench.run(20);
        assert_eq!(
            (bench.restarts(), bench.calls.begun.get()),
            before,
            "{kind:?}"
        );
        assert!(bench.corrects(), "{kind:?}");
    }
}
