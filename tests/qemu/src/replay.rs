//! The application over a recording: the same code on the desktop and on the target, so that both
//! can be compared byte for byte.
//!
//! A recording is three bytes (number in `ImuFormat::ALL`, pace, whether it learns) and then
//! records: line, two bytes of length, four bytes of time in microseconds (both little-endian),
//! bytes. At pace [`Pace::Time`] the variant of the sensor and the rate, in three bytes, precede
//! the records.

mod lines;
mod timed;

use core::cell::Cell;
use firmware::app::blackbox::Memory;
use firmware::app::{Activation, App, Config, Lines};
use firmware::configuration::{Configuration, Sensor};
use firmware::control::Mode;
use firmware::learn::Learner;
use firmware::learn::exchange::{Background, Exchange};
use firmware::link::progress::{NoStream, Progress};
use firmware::link::uart::{Port, Uart};
use firmware::model::Nets;
use firmware::wire::{ImuFormat, Settings};
use heapless::Vec;
use lrnn_nostd::{Net, Normalisation, Rational};
use vectors::Digest;

use lines::{CALIBRATION, Tap};
pub use lines::{Feed, Wires};
pub use timed::CYCLES;
use timed::Timed;

/// Longest record.
pub const LONGEST: usize = 256;
/// Length of a record's header, bytes.
pub const HEADER: usize = 7;

/// Input at which a record's bytes arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Input {
    /// Sensor line.
    Sensor,
    /// Receiver.
    Gnss,
    /// Command link.
    Command,
}

impl Input {
    /// From its number in a recording.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        [Self::Sensor, Self::Gnss, Self::Command]
            .into_iter()
            .find(|input| *input as u8 == number)
    }
}

/// How the bytes of a record arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Pace {
    /// All at once.
    Record,
    /// One by one, each in an interrupt of its own, and they leave in the same way: as at a board's
    /// lines, and at the board's cost. A pass for the clock is included.
    Byte,
    /// One by one too, but moved by the streams of a DMA controller, whose interrupts alone cost
    /// something.
    Dma,
    /// All at once, at the record's time. Between records the processor does its pending work at
    /// its own speed.
    Time,
}

impl Pace {
    /// From its number in a recording.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        [Self::Record, Self::Byte, Self::Dma, Self::Time]
            .into_iter()
            .find(|pace| *pace as u8 == number)
    }
}

/// The configuration under test: corrections by two frozen networks, once per second.
#[must_use]
pub fn config(format: ImuFormat) -> Config {
    let mut sensor = Settings::DEFAULT;
    (format.simulated()[0].settings)(&mut sensor);
    Config {
        format: Some(format),
        sensor,
        mode: Mode::Frozen,
        nets: nets(),
        ..Config::default()
    }
}

/// The device of [`config`] while it learns from fixes; its corrections follow what is learnt.
#[must_use]
pub fn learning_config(format: ImuFormat) -> Config {
    Config {
        mode: Mode::Learn,
        activation: Activation::Faded,
        ..config(format)
    }
}

/// Configuration of a device that learns from fixes, for this variant of the format's simulated
/// sensors at this rate, Hz. `None`: there is no such variant.
#[must_use]
pub fn configured(format: ImuFormat, variant: u8, rate: u16) -> Option<Configuration> {
    let mut sensor = Settings::DEFAULT;
    let simulated = format.simulated().get(usize::from(variant))?;
    (simulated.settings)(&mut sensor);
    let code = [125, 250, 500, 1000, 2000]
        .iter()
        .position(|known| *known == rate);
    let stim300 = &mut sensor.stim300.config;
    *stim300 = stim300.with_sample_rate_code(code.unwrap_or_default() as u8);
    let mut configuration = Configuration {
        sensor: Some(Sensor::Stream(format.settings(&sensor))),
        rate: rate.into(),
        ..Configuration::default()
    };
    (
        configuration.correction.mode,
        configuration.correction.activation,
    ) = (Mode::Learn, Activation::Faded);
    Some(configuration)
}

/// The networks: the weights of the shared vectors, which are recurrent; output up to about 1 deg/h
/// and 100 ug.
#[must_use]
pub fn nets() -> Nets {
    let net = |input_scale: f32, output_scale: f32| -> Net<Rational> {
        let shared = vectors::net::<Rational>();
        Net::new(
            shared.weights,
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

/// Samples that are left out of the latency. The first frames after power-on start the correction,
/// so they take longer.
const FIRST: u32 = 10;

/// Cost of sensor records, in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Sensor records.
    pub records: u32,
    /// All passes of all of them.
    pub total: u64,
    /// All passes of the most expensive one.
    pub worst: u32,
    /// All passes of the most expensive record from `FIRST` on.
    pub later: u32,
    /// From the last byte of a record to the first byte sent, the longest from record `FIRST` on.
    pub latency: u32,
    /// The longest single pass: the time for which a complete frame may have to wait.
    pub pass: u32,
    /// Sensor records before it.
    pub pass_at: u32,
    /// At pace [`Pace::Time`]: from a frame's last byte to its first byte sent, the longest from
    /// record `FIRST` on, ns.
    pub late: u32,
    /// Sensor records before it.
    pub late_at: u32,
}

/// The state of a learner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Learnt {
    /// FNV-1a of all weights' bits.
    pub weights: u64,
    /// Fixes used.
    pub fixes: u32,
    /// The hypothesis in force.
    pub winner: u32,
}

/// The application with a recording at its lines.
#[derive(Debug)]
pub struct Replay<'u, S = NoStream> {
    app: App<'static>,
    /// The learner, where it has a priority of its own.
    background: Option<Background<'static>>,
    lines: Lines<Port<'u, S>, Tap<'u, S>, Feed, Feed>,
    now: Cell<u64>,
    pace: Pace,
    wires: Wires<'u, S>,
    sent: Vec<u8, { 2 * LONGEST }>,
    /// Ticks of the calibration.
    overhead: u32,
    cost: Cost,
    timed: Timed,
}

impl<'u, S: Progress + Copy> Replay<'u, S> {
    /// An application without a learner.
    pub fn new(config: Config, pace: Pace, wires: Wires<'u, S>) -> Self {
        Self::with_learner(config, pace, wires, None)
    }

    /// An application with a learner, if one is given.
    pub fn with_learner(
        config: Config,
        pace: Pace,
        wires: Wires<'u, S>,
        learner: Option<&'static mut dyn Learner>,
    ) -> Self {
        let ([stream, other], [sync, other_sync, wake]) = (wires.streams, wires.pend);
        Self {
            app: App::with_learner(config, learner),
            background: None,
            lines: Lines {
                sensor: wires.sensor.port_over(stream, sync, || ()),
                navigation: Tap {
                    port: wires.navigation.port_over(other, other_sync, wake),
                    first: None,
                    last: 0,
                    ticks: wires.ticks,
                },
                command: Feed::default(),
                gnss: Feed::default(),
            },
            now: Cell::new(0),
            pace,
            wires,
            sent: Vec::new(),
            overhead: 0,
            cost: Cost::default(),
            timed: Timed::default(),
        }
    }

    /// To be called before the first record, in the place where it stays: it is too large to be on
    /// the stack twice.
    pub fn begin(&mut self) {
        if let Some(let_through) = self.wires.let_through {
            self.overhead = self.rehearse();
            let_through();
        }
        if matches!(self.pace, Pace::Byte | Pace::Dma) {
            self.awake(); // a board's loop begins before its sensor does
        }
    }

    /// Runs the learner through this exchange, as on a board: whenever no frame needs the
    /// processor.
    pub fn learn_apart(&mut self, exchange: &'static mut Exchange) {
        self.background = self.app.split(exchange);
    }

    /// Records to this memory, as a board does.
    pub fn record_in(&mut self, memory: &'static mut Memory) {
        self.app.record_in(memory);
    }

    /// Processes one record. Returns what the application sends to the navigation computer.
    pub fn record(&mut self, input: Input, at_us: u32, bytes: &[u8]) -> &[u8] {
        self.sent.clear();
        if self.pace == Pace::Time {
            self.in_time(input, at_us, bytes);
            return &self.sent;
        }
        self.now.set(at_us.into());
        match (input, self.pace) {
            (Input::Sensor, Pace::Byte | Pace::Dma) => self.interrupts(bytes),
            (Input::Sensor, Pace::Record | Pace::Time) => {
                for byte in bytes {
                    self.wires.sensor.came(*byte);
                }
                self.passes();
                self.cost.records += 1;
            }
            (Input::Gnss, _) => {
                self.lines.gnss.provide(bytes);
                self.passes();
            }
            (Input::Command, _) => {
                self.lines.command.provide(bytes);
                self.passes();
            }
        }
        let next = match self.pace {
            Pace::Dma => self.wires.left,
            _ => Uart::next,
        };
        while let Some(byte) = next(self.wires.navigation) {
            let _ = self.sent.push(byte); // fits: a frame leaves as long as it came
        }
        &self.sent
    }

    /// Runs the frame path, and the learner whenever the frame path has nothing to do.
    fn passes(&mut self) {
        self.frame_path();
        while self.background.as_mut().is_some_and(Background::turn) {
            self.frame_path();
        }
    }

    fn frame_path(&mut self) {
        if self.pace != Pace::Record {
            // There are so many that counting each would itself cost time.
            while self.app.poll(&mut self.lines, &self.now) {}
            return;
        }
        let ticks = self.wires.ticks;
        let mut more = true;
        while more {
            let begun = ticks();
            more = self.app.poll(&mut self.lines, &self.now);
            let pass = ticks().wrapping_sub(begun) & 0x00ff_ffff;
            if pass > self.cost.pass {
                (self.cost.pass, self.cost.pass_at) = (pass, self.cost.records);
            }
        }
    }

    /// The sensor's bytes one by one, as a board's interrupts and main loop handle them.
    fn interrupts(&mut self, bytes: &[u8]) {
        let ticks = self.wires.ticks;
        let since = |start: u32| ticks().wrapping_sub(start) & 0x00ff_ffff;
        let (last, before) = bytes.split_last().unwrap_or((&0, &[]));
        let begin = ticks();
        self.bytes_come(before);
        self.lines.navigation.first = None;
        let start = ticks();
        self.bytes_come(core::slice::from_ref(last));
        let first = self.lines.navigation.first;
        self.awake(); // by SysTick
        if self.lines.navigation.first.is_none() {
            self.awake(); // by the next one: a message shorter than expected
        }
        self.bytes_leave(bytes.len());
        let _ = (self.wires.left)(self.wires.navigation); // the transmitter asks once more
        let overhead = self.overhead * bytes.len() as u32 / CALIBRATION as u32;
        let spent = since(begin).saturating_sub(overhead);
        self.cost.records += 1;
        self.cost.total += u64::from(spent);
        self.cost.worst = self.cost.worst.max(spent);
        if self.cost.records >= FIRST {
            self.cost.later = self.cost.later.max(spent);
        }
        if let (Some(first), FIRST..) = (first, self.cost.records) {
            let latency = first.wrapping_sub(start) & 0x00ff_ffff;
            self.cost.latency = self.cost.latency.max(latency);
        }
    }

    #[inline(never)]
    fn bytes_come(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if (self.wires.came)(self.wires.sensor, *byte) {
                self.awake();
            }
        }
    }

    #[inline(never)]
    fn bytes_leave(&mut self, bytes: usize) {
        for _ in 0..bytes {
            let byte = (self.wires.left)(self.wires.navigation);
            // It fits: a frame leaves as long as it came.
            let _ = self.sent.push(byte.unwrap_or_default());
        }
    }

    /// Measures the cost of bytes without their interrupts: that of this file's loops, ticks.
    fn rehearse(&mut self) -> u32 {
        let ticks = self.wires.ticks;
        let start = ticks();
        self.bytes_come(&[0; CALIBRATION]);
        self.bytes_leave(CALIBRATION);
        let overhead = ticks().wrapping_sub(start) & 0x00ff_ffff;
        self.sent.clear();
        overhead
    }

    /// One turn of the main loop.
    fn awake(&mut self) {
        self.passes();
        self.lines.sensor.want(self.app.needs());
    }

    /// The state of the learner so far.
    pub fn learnt(&mut self) -> Learnt {
        let mut digest = Digest::new();
        if let Some(nets) = self.app.learnt() {
            for net in [&nets.gyro, &nets.accel] {
                digest.numbers(net.weights.to_array());
            }
        }
        let report = self.app.learning();
        Learnt {
            weights: digest.value(),
            fixes: report.fixes,
            winner: report.winner.into(),
        }
    }

    /// The cost so far.
    pub fn cost(&self) -> Cost {
        self.cost
    }
}
