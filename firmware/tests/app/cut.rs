//! Cut-through, between the interrupt that forwards bytes and the main loop that runs late.

use crate::device::{Mock, Time, constant};
use firmware::app::{App, Config, Lines};
use firmware::configuration::{Configuration, Sensor};
use firmware::control::Mode;
use firmware::link::cut::Cut;
use firmware::link::{Full, Line, Lost};
use firmware::model::Nets;
use firmware::wire::framer::{Kind, LONGEST};
use firmware::wire::{Fields, Framer, ImuFormat, Simulated};
use proptest::prelude::*;
use std::cell::RefCell;
use std::rc::Rc;

const CAN: [ImuFormat; 3] = [ImuFormat::Stim300, ImuFormat::Kvh, ImuFormat::Novatel];

/// State shared by interrupt and loop.
#[derive(Debug, Default)]
struct Shared {
    cut: Cut,
    sent: Vec<u8>,
    /// Bytes that the interrupt has sent.
    by_interrupt: usize,
}

/// The loop's end of the navigation line, as a board's `Port` is.
#[derive(Debug, Default, Clone)]
struct Output(Rc<RefCell<Shared>>);

impl Line for Output {
    fn receive(&mut self, _: &mut [u8]) -> Result<usize, Lost> {
        Ok(0)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        let mut shared = self.0.borrow_mut();
        if !shared.cut.stop() {
            return Err(Full);
        }
        shared.sent.extend(message);
        Ok(())
    }

    fn cut(&mut self, work: &mut dyn FnMut(&mut Cut)) -> bool {
        work(&mut self.0.borrow_mut().cut);
        true
    }
}

/// Configuration of a sensor, with or without cut-through, and networks with constant outputs.
fn config(format: ImuFormat, sensor: &Simulated, cut_through: bool) -> Config {
    let mut configuration = Configuration {
        sensor: Some(Sensor::Stream(format.settings(&sensor.settings()))),
        rate: f64::from(sensor.rate),
        ..Configuration::default()
    };
    configuration.lines.cut_through = cut_through;
    configuration.correction.mode = Mode::Frozen;
    configuration.correction.check_rate = false;
    configuration.correction.limit.gyro = 1.0;
    configuration.correction.limit.accel = 1.0;
    Config {
        nets: Nets {
            gyro: constant([3e-5, -2e-5, 1e-4]),
            accel: constant([2e-3, -1e-3, 5e-3]),
            ..Nets::NONE
        },
        ..Config::of(&configuration)
    }
}

/// Output for a stream. The loop runs after the numbers of bytes in `turns`, cyclically. Also gives
/// the number of bytes that the interrupt has sent.
fn through(config: Config, stream: &[u8], turns: &[usize]) -> (Vec<u8>, usize) {
    run(config, stream, turns, true)
}

/// [`through`], also for a board whose interrupt cuts nothing.
fn run(config: Config, stream: &[u8], turns: &[usize], cuts: bool) -> (Vec<u8>, usize) {
    let output = Output::default();
    let mut app = App::new(config);
    let mut lines = Lines {
        sensor: Mock::default(),
        navigation: output.clone(),
        command: Mock::default(),
        gnss: Mock::default(),
    };
    let time = Time::default();
    let mut turns = turns.iter().cycle();
    let mut left = 0;
    for (place, &byte) in (0..).zip(stream) {
        time.set(time.get() + 11);
        let mut shared = output.0.borrow_mut();
        if cuts {
            let leaving = shared.cut.came(place, byte, 512);
            leaving.each(|byte| shared.sent.push(byte));
            shared.by_interrupt += leaving.len();
        }
        drop(shared);
        lines.sensor.input.push_back(byte);
        if left == 0 {
            left = *turns.next().expect("a turn");
            while app.poll(&mut lines, &time) {}
        }
        left -= 1;
    }
    // the line falls silent, and the pending bytes leave
    for _ in 0..200 {
        time.set(time.get() + 1000);
        while app.poll(&mut lines, &time) {}
    }
    let shared = output.0.borrow();
    (shared.sent.clone(), shared.by_interrupt)
}

fn frames(sensor: &Simulated, count: u32) -> Vec<Vec<u8>> {
    let frame = |index: u32| {
        let n = index.wrapping_mul(7919) as i32 % 50;
        let fields = Fields {
            index,
            time: f64::from(index) / f64::from(sensor.rate),
            gyro: [n, -n, 3 * n],
            accel: [-2 * n, n, 40 + n],
            rest: sensor.rest,
        };
        let mut buffer = [0; 256];
        let len = (sensor.emit)(&fields, &mut buffer).expect("room");
        buffer[..len].to_vec()
    };
    (0..count).map(frame).collect()
}

fn any_sensor() -> impl Strategy<Value = (ImuFormat, &'static Simulated)> {
    let of = |format: ImuFormat| format.simulated().iter().map(move |s| (format, s));
    let all: Vec<_> = CAN.into_iter().flat_map(of).collect();
    prop::sample::select(all)
}

fn good(format: ImuFormat, stream: &[u8]) -> Vec<Vec<u8>> {
    let mut framer = Framer::new(format);
    let mut frames = Vec::new();
    // zeros end a message that only seems to begin near the end
    for byte in stream.iter().chain(&[0; LONGEST]) {
        framer.push(&[*byte]);
        while let Some(event) = framer.next_event() {
            if event.kind() == Kind::Frame {
                frames.push(event.bytes().to_vec());
            }
        }
    }
    frames
}

/// The six floats of each frame.
fn floats(stream: &[u8], len: usize) -> Vec<f64> {
    let frames = stream.chunks(len);
    let values = frames.flat_map(|frame| frame[4..28].chunks(4));
    let float = |bytes: &[u8]| f32::from_be_bytes(bytes.try_into().expect("four"));
    values.map(|bytes| f64::from(float(bytes))).collect()
}

/// Floats that leave before they have come as a whole differ by at most 128 units in the last place
/// of what came, and so much is made good with the next one: sums differ by no more.
fn are_near(came: &[f64], whole: &[f64], early: &[f64]) {
    let mut sums = [0.0; 6];
    for (n, ((came, whole), early)) in came.iter().zip(whole).zip(early).enumerate() {
        let ulps = came.abs().max(whole.abs()) / 32_000.0;
        assert!((whole - early).abs() <= ulps, "{n}: {came} {whole} {early}");
        sums[n % 6] += whole - early;
        assert!(sums[n % 6].abs() <= ulps, "{n}: {came} {sums:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Byte for byte what leaves without, but for floats that begin before they have come, and
    /// byte for byte what the loop sends where nothing is cut, however late the loop is. Most of it
    /// is sent by the interrupt where the loop is in time.
    #[test]
    fn cutting_through_changes_no_byte(
        (format, sensor) in any_sensor(),
        turns in prop::collection::vec(1usize..150, 1..30),
        in_time in any::<bool>(),
        pauses in any::<bool>(),
    ) {
        let turns = if in_time { vec![1] } else { turns };
        let mut stream = Vec::new();
        for (n, frame) in frames(sensor, 120).into_iter().enumerate() {
            stream.extend(frame);
            if pauses && format == ImuFormat::Stim300 && n % 7 == 3 {
                stream.extend(b"\r\n");
            }
        }
        let (sent, _) = through(config(format, sensor, false), &stream, &turns);
        let (cut, by_interrupt) = through(config(format, sensor, true), &stream, &turns);
        prop_assert_eq!(sent.len(), stream.len());
        let differ = sent.iter().zip(&stream).filter(|(a, b)| a != b).count();
        prop_assert!(differ > 120, "{}: {} bytes corrected", sensor.name, differ);
        if format == ImuFormat::Kvh {
            let len = stream.len() / 120;
            let [came, whole, cut] = [&stream, &sent, &cut].map(|all| floats(all, len));
            are_near(&came, &whole, &cut);
            let some = sensor.name != "kvh" || whole != cut;
            prop_assert!(some, "no value began too soon");
        }
        let expected = run(config(format, sensor, true), &stream, &turns, false);
        prop_assert!(expected.0 == cut, "{}", sensor.name);
        prop_assert!(format == ImuFormat::Kvh || sent == cut, "{}", sensor.name);
        if in_time {
            prop_assert!(by_interrupt > stream.len() / 2, "{}: {}", sensor.name, by_interrupt);
        }
    }

    /// Damage: every byte leaves once. A frame that leaves good came good, and each place of damage
    /// costs at most one frame more than without cut-through.
    #[test]
    fn damage_leaves_as_damage(
        (format, sensor) in any_sensor(),
        turns in prop::collection::vec(1usize..60, 1..30),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..3u8, 1..=255u8), 1..6),
    ) {
        let mut stream = frames(sensor, 60).concat();
        for (at, kind, bits) in &damage {
            let at = at.index(stream.len());
            match kind {
                0 => stream[at] ^= bits,
                1 => drop(stream.remove(at)),
                _ => stream.insert(at, *bits),
            }
        }
        let (sent, _) = through(config(format, sensor, false), &stream, &turns);
        let (cut, _) = through(config(format, sensor, true), &stream, &turns);
        prop_assert_eq!(sent.len(), cut.len());
        let (came, whole, cut) = (good(format, &stream), good(format, &sent), good(format, &cut));
        prop_assert!(cut.len() <= came.len(), "{} of {}", cut.len(), came.len());
        prop_assert!(cut.len() + damage.len() >= whole.len(), "{} of {}", cut.len(), whole.len());
    }
}
