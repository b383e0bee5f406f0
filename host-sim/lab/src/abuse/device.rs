//! The device's own application, bytes in and bytes out.
//!
//! Frames of the sensor, messages of the receiver and requests of the navigation computer go in at
//! their times. The output is decoded, and its difference to the input is the correction. The
//! navigation computer then gets the true samples with that correction. So a lost frame does not
//! harm the navigation computer by itself: only the device's reaction is judged.

use super::line::Frame;
use super::receiver::Message;
use firmware::app::{App, Config, Lines};
use firmware::configuration::Configuration;
use firmware::learn::{Learner, Report};
use firmware::model::Nets;
use firmware::sample::{Counts, RawSample};
use firmware::store::{Memory, NOTES_LEN};
use firmware::wire::command::{MAX_PACKET, Request, encode};
use firmware::wire::framer::{Kind, LONGEST};
use firmware::wire::{Fields, Framer, ImuFormat, Simulated};
use host_core::inertial::sins::Increment;
use host_device::hil::{MemoryLine, SetClock};
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Longest interval between two calls of the application, microseconds.
const TICK_US: u64 = 20_000;

/// The format of the sensor's frames.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    pub format: ImuFormat,
    sensor: &'static Simulated,
}

impl Format {
    /// NovAtel RAWIMUSX of an HG1700 or, without counter and time, HG4930: both of 100 Hz and with
    /// the same counts.
    pub fn of(counted: bool) -> Self {
        let format = if counted {
            ImuFormat::Novatel
        } else {
            ImuFormat::Hg4930
        };
        let sensors = format.simulated();
        let fits = |sensor: &&Simulated| sensor.rate == 100;
        let sensor = sensors.iter().rev().find(fits).unwrap_or(&sensors[0]);
        Self { format, sensor }
    }

    /// The size of a count, rad and m/s.
    pub fn lsb(self) -> firmware::sample::Lsb {
        let [rad, mps] = self.sensor.unit;
        firmware::sample::Lsb { rad, mps }
    }

    /// The bytes of a frame.
    fn bytes(self, frame: &Frame) -> Vec<u8> {
        let mut buffer = [0; LONGEST];
        let fields = Fields {
            index: frame.number,
            time: f64::from(frame.number + 1) / f64::from(self.sensor.rate),
            gyro: frame.counts.dtheta,
            accel: frame.counts.dv,
            rest: self.sensor.rest,
        };
        let length = (self.sensor.emit)(&fields, &mut buffer).unwrap_or(0);
        let mut bytes = buffer[..length].to_vec();
        if frame.damaged {
            bytes[length / 2] ^= 0x10;
        }
        bytes
    }
}

/// The input of the device's lines.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    pub format: Format,
    pub frames: &'a [Frame],
    pub receiver: &'a [Message],
    /// Requests of the navigation computer: when, microseconds after power-on.
    pub requests: &'a [(u64, Request<'static>)],
    /// Number of samples of the drive, and the duration of one, s.
    pub samples: (usize, f64),
}

/// Result of a drive.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Correction of each sample: rad/s and m/s2.
    pub correction: Vec<Increment>,
    /// The learner's report at the end.
    pub report: Report,
    /// The networks that it has stored for the next power-on, if any.
    pub stored: Option<Nets>,
    /// What it has stored of the unit.
    pub memory: Vec<u8>,
    /// All faults that were raised: bits of [`firmware::wire::command::fault`].
    pub faults: u32,
}

/// What a device has in its store at power-on.
#[derive(Debug, Clone, Copy)]
pub struct Stored<'a> {
    pub nets: &'a Nets,
    pub memory: &'a [u8],
}

impl Stored<'_> {
    pub const NOTHING: Self = Self {
        nets: &Nets::NONE,
        memory: &[],
    };
}

/// Runs the application through a drive.
pub fn run(
    (configuration, Stored { nets, memory }): (&Configuration, Stored<'_>),
    learner: Option<&mut dyn Learner>,
    input: &Input<'_>,
) -> Outcome {
    let config = Config {
        nets: *nets,
        store: true,
        ..Config::of(configuration)
    };
    let mut app = App::with_learner(config, learner);
    app.recall(memory);
    let mut device = Device::new(app, input);
    let mut frames = input.frames.iter().peekable();
    let mut receiver = input.receiver.iter().peekable();
    let mut requests = input.requests.iter().peekable();
    loop {
        let next = [
            frames.peek().map(|frame| frame.at_us),
            receiver.peek().map(|message| message.at_us),
            requests.peek().map(|(at_us, _)| *at_us),
        ];
        let Some(now) = next.iter().flatten().min().copied() else {
            return device.end();
        };
        device.wait(now);
        if let Some(message) = receiver.next_if(|message| message.at_us == now) {
            device.lines.gnss.received.extend(&message.bytes);
            device.settle();
        } else if let Some((_, request)) = requests.next_if(|(at_us, _)| *at_us == now) {
            device.request(request);
        } else if let Some(frame) = frames.next() {
            device.frame(frame);
        }
    }
}

/// The application with its lines.
struct Device<'m, 'i> {
    app: App<'m>,
    lines: Lines<MemoryLine, MemoryLine, MemoryLine, MemoryLine>,
    clock: SetClock,
    input: &'i Input<'i>,
    framer: Framer,
    /// Frames that were sent to the application and are not yet in its output.
    inside: VecDeque<(usize, Counts)>,
    /// Correction of each sample by the application's output, counts.
    corrections: Vec<Option<[i32; 6]>>,
    faults: u32,
    /// The networks that the application stored last, and what it knew of the unit.
    stored: Option<Nets>,
    memory: Vec<u8>,
}

impl<'m, 'i> Device<'m, 'i> {
    fn new(app: App<'m>, input: &'i Input<'i>) -> Self {
        Self {
            app,
            lines: Lines::default(),
            clock: SetClock(0),
            input,
            framer: Framer::new(input.format.format),
            inside: VecDeque::new(),
            corrections: vec![None; input.samples.0],
            faults: 0,
            stored: None,
            memory: Vec::new(),
        }
    }

    /// Advances the clock to `now`, and calls the application at least every [`TICK_US`].
    fn wait(&mut self, now: u64) {
        while self.clock.0 + TICK_US < now {
            self.clock.0 += TICK_US;
            self.settle();
        }
        self.clock.0 = now.max(self.clock.0);
    }

    /// Runs the application until it has nothing to do.
    fn settle(&mut self) {
        while self.app.poll(&mut self.lines, &self.clock) {}
        let (stored, memory) = (&mut self.stored, &mut self.memory);
        if self.app.wants_to_store() {
            self.app.store(|_, content| {
                *stored = Some(*content.nets);
                if let Memory::New(notes, learner, length) = content.memory {
                    *memory = notes.bytes().to_vec();
                    memory.resize(NOTES_LEN + length, 0);
                    learner.write_memory(0, &mut memory[NOTES_LEN..]);
                }
                true
            });
        }
        self.lines.sensor.sent.clear();
        self.lines.command.sent.clear();
    }

    fn request(&mut self, request: &Request<'_>) {
        let mut packet = [0; MAX_PACKET];
        if let Ok(packet) = encode(0, request, &mut packet) {
            self.lines.command.received.extend(&*packet);
        }
        self.settle();
    }

    /// Sends a frame, and compares the output with the input.
    fn frame(&mut self, frame: &Frame) {
        let bytes = self.input.format.bytes(frame);
        if !frame.damaged {
            self.inside.push_back((frame.sample, frame.counts));
        }
        self.lines.sensor.received.extend(bytes);
        self.settle();
        self.faults |= self.app.faults();
        let sent = core::mem::take(&mut self.lines.navigation.sent);
        for piece in sent.chunks(64) {
            self.framer.push(piece);
            while let Some(event) = self.framer.next_event() {
                let reading = match event.kind() {
                    Kind::Frame => event.frame().and_then(|frame| frame.read().ok()),
                    _ => None,
                };
                let Some(RawSample::Counts { gyro, accel }) = reading.map(|r| r.sample) else {
                    continue;
                };
                let Some((sample, was)) = self.inside.pop_front() else {
                    continue;
                };
                let [out, was] = [[gyro, accel], [was.dtheta, was.dv]];
                let by = std::array::from_fn(|i| out[i / 3][i % 3].wrapping_sub(was[i / 3][i % 3]));
                if let Some(slot) = self.corrections.get_mut(sample) {
                    *slot = Some(by);
                }
            }
        }
    }

    fn end(self) -> Outcome {
        let lsb = self.input.format.lsb();
        let (_, dt) = self.input.samples;
        let mut present = Increment::default();
        let corrections = self.corrections.iter().map(|by| {
            if let Some(by) = by {
                let v = |at: usize, lsb: f64| {
                    Vector3::new(by[at], by[at + 1], by[at + 2]).map(f64::from) * (lsb / dt)
                };
                present = Increment {
                    dtheta: v(0, lsb.rad),
                    dv: v(3, lsb.mps),
                };
            }
            present
        });
        Outcome {
            correction: corrections.collect(),
            report: self.app.learning(),
            stored: self.stored,
            memory: self.memory,
            faults: self.faults,
        }
    }
}
