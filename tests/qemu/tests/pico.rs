//! The image of the Raspberry Pi Pico 2 in a third-party emulator (`tests/rp2350`).

use std::path::PathBuf;

use firmware::control::Mode;
use firmware::wire::ImuFormat;
use firmware::wire::command::{Counters, Request, Response, decode};
use qemu::boards::Family;
use qemu::drive::{Record, drive, frames, hex};
use qemu::protocol::{packet_of, set_up};
use qemu::replay::Input;
use qemu::rp2350::{self, Run};
use qemu::software::desktops;
use serde_json::{Value, json};

/// Cycles of a microsecond, and of a millisecond.
const US: f64 = 150.0;
const MILLISECOND: u32 = 150_000;
/// Interrupts: the receiver's PIO, the sensor's UART and the navigation computer's.
const PIO: u32 = 15;
const SENSOR: u32 = 33;
const NAVIGATION: u32 = 34;

/// From the last byte of a frame to the first byte sent, microseconds: the median and the maximum.
/// The first frames, which are buffered until the format is known, do not count.
fn latencies(run: &Run, frames: &[Record]) -> [f64; 2] {
    assert_eq!(run.came.len(), run.left.len(), "as many bytes leave");
    let (mut late, mut begin) = (Vec::new(), 0);
    for frame in frames {
        let end = begin + frame.bytes.len();
        late.push(run.left[begin] - run.came[end - 1]);
        begin = end;
    }
    let mut late = late.split_off(frames.len() / 4);
    late.sort_by(f64::total_cmp);
    [late[late.len() / 2], late[late.len() - 1]].map(|cycles| cycles / US)
}

/// The image and the program that runs it.
struct Tools {
    image: PathBuf,
    program: PathBuf,
}

impl Tools {
    fn build() -> Self {
        let board = Family::named("pico2").expect("a board");
        Self {
            image: board.build().expect("it builds"),
            program: rp2350::build().expect("it builds"),
        }
    }

    /// Runs the image, set up or not, over frames that are `period` cycles apart; `world` is added
    /// to its input.
    fn run(&self, set: bool, frames: &[Record], period: u32, world: &Value) -> Run {
        let commands = set_up().expect("requests");
        let commands = if set { &commands[..] } else { &[] };
        let mut asked = json!({
            "image": self.image, "period": period,
            "command": commands.iter().map(|packet| hex(packet)).collect::<Vec<_>>(),
            "sensor": frames.iter().map(|frame| hex(&frame.bytes)).collect::<Vec<_>>(),
        });
        for (name, value) in world.as_object().expect("an object") {
            asked[name] = value.clone();
        }
        let run = rp2350::run(&self.program, &asked).expect("it runs");
        assert!(run.wrong.is_empty(), "{:?}", run.wrong);
        run
    }
}

/// A request over the command link.
fn request(number: u8, request: &Request) -> String {
    hex(&packet_of(number, request).expect("a packet"))
}

/// Decodes the last answer, hexadecimal, which must be one to `GetCounters`.
fn counters(answers: &str) -> Counters {
    let pairs = (0..answers.len() / 2).map(|n| &answers[2 * n..2 * n + 2]);
    let bytes = pairs.map(|pair| u8::from_str_radix(pair, 16).expect("hexadecimal"));
    let bytes: Vec<u8> = bytes.collect();
    let mut packets = bytes.split(|byte| *byte == 0);
    let last = packets.rfind(|packet| !packet.is_empty());
    match decode::<Response>(&mut last.expect("an answer").to_vec()) {
        Ok((_, Response::Counters(counters))) => counters,
        other => panic!("{other:?}"),
    }
}

/// The command link loads the networks over USB. The UART interrupts when its buffer has 28 bytes,
/// which is a frame of the STIM300, and after a pause. The asserted figures are in docs/BOARDS.md.
#[test]
fn the_bytes_that_leave_are_the_desktops() {
    let tools = Tools::build();
    for (format, period, interrupts, most_us) in [
        (ImuFormat::Stim300, MILLISECOND - 210, [1.0, 2.0], 30.0),
        (ImuFormat::Kvh, MILLISECOND / 2, [2.0, 3.0], 70.0),
    ] {
        let mut frames = frames(format, 1);
        frames.truncate(250);
        let run = tools.run(true, &frames, period, &json!({}));
        let expected = desktops(&frames);
        assert!(
            run.sent == expected,
            "{} of {} bytes",
            run.sent.len() / 2,
            expected.len() / 2
        );
        let late = latencies(&run, &frames);
        println!(
            "{format:?}: latency {late:.1?} us; {:?} {:?}",
            run.served, run.executed
        );
        for (number, each) in [SENSOR, NAVIGATION].into_iter().zip(interrupts) {
            let served = run.served(number) as f64 / frames.len() as f64;
            assert!((served - each).abs() < 0.1, "{served} {:?}", run.served);
        }
        assert!(late[0] < most_us, "{late:?}");
        assert_eq!(run.starts, ["0 power"]);
        assert!(run.log.contains(&hex(b"pico2")), "{}", run.log);
    }
}

/// The emulator's own UART sends the same bytes, though its buffer and its interrupts differ from
/// the chip's.
#[test]
fn the_emulators_own_transmitter_sends_the_same() {
    let frames = frames(ImuFormat::Kvh, 1);
    let frames = &frames[..100];
    let run = Tools::build().run(false, frames, MILLISECOND / 2, &json!({"theirs": true}));
    let all: String = frames.iter().map(|frame| hex(&frame.bytes)).collect();
    assert!(run.sent == all, "{} of {}", run.sent.len(), all.len());
}

/// A wrong stop bit anywhere in a frame costs that frame; so does a lost byte. `embassy-rp`
/// receives nothing after an error until it is asked to.
#[test]
fn damage_costs_a_frame_and_not_the_line() {
    let frames = frames(ImuFormat::Kvh, 1);
    let frames = &frames[..100];
    let damage = [(30, 0, "framing"), (50, 20, "framing"), (70, 9, "overrun")];
    let world = json!({"damage": damage, "ask": [request(1, &Request::GetCounters)]});
    let run = Tools::build().run(false, frames, MILLISECOND / 2, &world);
    let left = |frame: &Record| run.sent.contains(&hex(&frame.bytes));
    let missing: Vec<_> = (0..100).filter(|n| !left(&frames[*n])).collect();
    assert_eq!(missing, damage.map(|(frame, ..)| frame));
    let counted = counters(&run.command);
    assert_eq!((counted.lost, counted.missed), (3, 3), "{counted:?}");
}

/// What `StoreImage` stores survives a power cycle. The functions of the ROM erase and program it,
/// in the part of the flash beyond the image.
#[test]
fn networks_and_configuration_outlast_the_power() {
    let mut frames = frames(ImuFormat::Stim300, 1);
    frames.truncate(100);
    let mut commands: Vec<_> = set_up().expect("requests").iter().map(|c| hex(c)).collect();
    let modes = [Mode::Bypass, Mode::Frozen].map(Request::SetMode);
    let number = commands.len() as u8;
    commands.push(request(number, &modes[0]));
    commands.push(request(number + 1, &Request::StoreImage));
    let again = [request(number + 2, &modes[1])];
    let world = json!({"command": commands, "restart": again});
    let run = Tools::build().run(false, &frames, MILLISECOND, &world);
    let expected = desktops(&frames);
    assert!(
        run.sent == expected,
        "{} of {}",
        run.sent.len(),
        expected.len()
    );
    assert_eq!(run.starts.len(), 2, "{:?}", run.starts);
    assert!(run.flash.iter().all(|count| *count > 0), "{:?}", run.flash);
}

/// The receiver's line is a program of PIO0, whose task has a higher priority than the loop: one
/// interrupt per byte. No fix is lost while frames come.
#[test]
fn fixes_come_by_pio() {
    let records = drive(ImuFormat::Stim300, 7).expect("a drive");
    let sensor: Vec<_> = records
        .iter()
        .filter(|of| of.input == Input::Sensor)
        .cloned()
        .collect();
    let fixes: Vec<_> = records
        .iter()
        .filter(|record| record.input == Input::Gnss)
        .zip(1..=6)
        .map(|(record, n)| (n * 40 * u64::from(MILLISECOND), hex(&record.bytes)))
        .collect();
    let world = json!({"gnss": fixes, "ask": [request(1, &Request::GetCounters)]});
    let run = Tools::build().run(true, &sensor[..300], MILLISECOND, &world);
    assert!(run.sent == desktops(&sensor[..300]), "{}", run.sent.len());
    let counted = counters(&run.command);
    assert!(fixes.len() > 4, "{}", fixes.len());
    assert_eq!(counted.fixes as usize, fixes.len(), "{counted:?}");
    let bytes: usize = fixes.iter().map(|(_, message)| message.len() / 2).sum();
    assert_eq!(run.served(PIO), bytes, "{:?}", run.served);
}

/// A core that nobody wakes does not feed the watchdog, which resets the chip 8 s later.
#[test]
fn the_watchdog_restarts_the_image() {
    let run = Tools::build().run(false, &[], MILLISECOND, &json!({"deaf": 8_100}));
    let (at, why) = run.starts[1].split_once(' ').expect("a time");
    assert_eq!((run.starts.len(), why), (2, "watchdog"), "{:?}", run.starts);
    let at: u32 = at.parse().expect("a number");
    assert!((8_040..8_050).contains(&at), "{at} ms");
}
