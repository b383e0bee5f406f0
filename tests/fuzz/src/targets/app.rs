//! Any bytes on all four lines at any time, any free space in the output: nothing panics or hangs,
//! no byte is invented or held back, and every counter and state agrees with the output.

use firmware::app::{App, Config, Lines};
use firmware::control::{Mode, Window};
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::model::Nets;
use firmware::sample::RawSample;
use firmware::wire::command::{MAX_PACKET, Packets, Request, Response, decode, encode};
use firmware::wire::{Change, Checked, Fields, Framer, ImuFormat, Reading, framer, ubx};
use lrnn_nostd::{Net, Normalisation, Weights};
use std::cell::Cell;
use test_bench::line::MockLine;

/// A good frame of one of the format's sensors with some of the fuzzer's bytes in its values.
fn frame(format: ImuFormat, n: u8, bytes: &[u8]) -> Vec<u8> {
    let word = |k: usize| {
        let byte = |i| bytes.get(4 * k + i).copied().unwrap_or(n);
        i32::from_be_bytes([byte(0), byte(1), byte(2), byte(3)])
    };
    let fields = Fields {
        index: n.into(),
        time: f64::from(n) / 100.0,
        gyro: [word(0), word(1), word(2)],
        accel: [word(3), word(4), word(5)],
        rest: word(6).cast_unsigned(),
    };
    let sensors = format.simulated();
    let mut buffer = [0; framer::LONGEST];
    let sensor = &sensors[usize::from(n) % sensors.len()];
    let format = format.configured(&sensor.settings());
    let len = (sensor.emit)(&fields, &mut buffer);
    let mut frame = buffer[..len.expect("room")].to_vec();
    // any bits of a float, NaN too
    if let Ok(mut checked) = Checked::new(format, &mut frame)
        && let Ok(Reading {
            sample: RawSample::Floats { .. },
            ..
        }) = checked.read()
    {
        let float = |v: i32| f32::from_bits(v.cast_unsigned());
        let sample = RawSample::Floats {
            gyro: fields.gyro.map(float),
            accel: fields.accel.map(float),
        };
        let settings = &firmware::wire::Settings::DEFAULT;
        let change = Change {
            sample: &sample,
            mark: false,
            settings,
        };
        checked.change(&change).expect("room");
    }
    frame
}

/// A good fix.
fn fix(n: u8) -> Vec<u8> {
    let pvt = ubx::Pvt {
        flags: n,
        fix: 3,
        ..ubx::Pvt::default()
    };
    pvt.emit().to_vec()
}

fn net(byte: u8) -> Net {
    let mut weights = Weights::zero();
    let scale = if byte & 0x40 != 0 { f32::MAX } else { 1e-3 };
    for (k, weight) in weights.iter_mut().enumerate() {
        *weight = (f32::from(byte) - k as f32) * scale;
    }
    Net::new(weights, Normalisation::identity())
}

fn request<'a>(kind: u8, bytes: &'a [u8]) -> Request<'a> {
    let offset = u32::from(bytes.first().copied().unwrap_or(0)) * 4;
    match kind % 17 {
        0 => Request::GetHealth,
        1 => Request::SetMode(Mode::Frozen),
        2 => Request::SetMode(Mode::Bypass),
        3 => Request::CommitImage { length: 608 },
        4 => Request::ReadImage {
            offset,
            length: 128,
        },
        5 => Request::Alignment(firmware::control::Alignment::Started),
        6 => Request::Alignment(firmware::control::Alignment::Finished),
        7 => Request::SetMode(Mode::Learn),
        8 => Request::SetMode(Mode::Shadow),
        9 => Request::GetEstimate,
        10 => Request::CommitLearnt,
        11 => Request::ReadLearnt {
            offset,
            length: 128,
        },
        12 => Request::Reference(Window {
            first: offset,
            last: offset + 9 + u32::from(bytes.get(1).copied().unwrap_or(0)),
            angle: [1e-3; 3],
            velocity: [f64::from(offset), 0.0, 1e30],
            angle_sigma: 1e-6,
            velocity_sigma: 1e3,
        }),
        13 => Request::Heading(firmware::fix::Heading {
            angle: offset as f32 * 0.01,
            sigma: 0.1,
        }),
        14 => Request::WheelSpeed(firmware::wheels::WheelSpeed {
            speed: f32::from_bits(offset),
            age_ms: offset as u16,
        }),
        _ => Request::WriteImage {
            offset,
            bytes: &bytes[..bytes.len().min(128)],
        },
    }
}

/// A line that takes so many bytes and never rests.
fn line(room: usize) -> MockLine {
    MockLine {
        room,
        never_idle: true,
        ..MockLine::default()
    }
}

/// Whether the device found a frame.
pub fn run(input: &[u8]) -> bool {
    let [which, setting, weight, input @ ..] = input else {
        return false;
    };
    let format = ImuFormat::ALL[usize::from(*which) % ImuFormat::ALL.len()];
    let config = Config {
        format: (setting & 1 != 0).then_some(format),
        mode: if setting & 2 != 0 {
            Mode::Frozen
        } else {
            Mode::Bypass
        },
        nets: Nets {
            gyro: net(*weight),
            accel: net(weight.rotate_left(3)),
            ..Nets::NONE
        },
        block: f64::from(setting >> 4) / 1000.0,
        ..Config::default()
    };
    let mut windows = WindowLearner::new();
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut learner = CombinedLearner {
        references: &mut windows,
        fixes: FixLearner::new(&mut memory, Settings::MEDIUM),
    };
    let mut app = App::with_learner(config, Some(&mut learner));
    let mut lines = Lines {
        sensor: line(usize::MAX),
        navigation: line(0),
        command: line(usize::MAX),
        gnss: line(0),
    };
    let time = Cell::new(0_u64);
    let mut came: Vec<u8> = Vec::new();
    let mut left = 0;
    let mut rest = input;
    while let [step, amount, tail @ ..] = rest {
        let (bytes, next) = tail.split_at(tail.len().min(usize::from(*amount)));
        rest = next;
        match step % 8 {
            0 => lines.sensor.input.extend(bytes),
            1 | 2 => {
                let frame = frame(format, *amount, bytes);
                lines.sensor.input.extend(&frame);
            }
            3 => lines.navigation.input.extend(bytes),
            4 => {
                let mut buffer = [0; MAX_PACKET];
                if let Ok(packet) =
                    encode(*amount, &request(amount ^ (step >> 3), bytes), &mut buffer)
                {
                    lines.command.input.extend(&*packet);
                }
            }
            5 => lines.gnss.input.extend(fix(*amount)),
            6 => time.set(time.get() + (u64::from(*amount) << (step >> 3))),
            _ => {
                lines.command.input.extend(bytes);
                lines.sensor.lost = true;
            }
        }
        lines.navigation.room = if step & 0x80 != 0 { 40 } else { 10_000 };
        came.extend(&lines.sensor.input);
        let mut passes = 0;
        while app.poll(&mut lines, &time) {
            passes += 1;
            assert!(passes < 1000, "it never rests");
        }
        left += std::mem::take(&mut lines.navigation.sent).concat().len();
        let counters = app.counters();
        assert!(
            left <= came.len() || counters.answered > 0,
            "bytes are made up"
        );
        // bytes that have not left are the beginning of a message
        if counters.answered == 0 && counters.dropped == 0 {
            assert!(left + framer::CAPACITY >= came.len(), "bytes are missing");
        }
    }
    // without silence and changes of state, the frames found are those of the input, however it was
    // divided
    let mut framer = Framer::new(format);
    let mut frames = 0;
    for piece in came.chunks(64) {
        framer.push(piece);
        while let Some(event) = framer.next_event() {
            frames += u32::from(event.kind() == framer::Kind::Frame);
        }
    }
    let counters = app.counters();
    if setting & 1 != 0 && counters.silences == 0 && matches!(counters.entered, [0, _, 0]) {
        assert_eq!(counters.frames, frames);
    }
    let mut packets = Packets::new();
    for byte in lines.command.sent.concat() {
        if let Some(packet) = packets.push(byte) {
            decode::<Response>(packet).expect("our own packet");
        }
    }
    counters.frames > 0
}
