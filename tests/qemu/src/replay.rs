//! The application over a recording: the same code on the desktop and on the target, so that both can be compared byte for byte.
//!
//! A recording is two bytes (format, pace) and then records: line, two bytes of length, four bytes of time in microseconds (both
//! little-endian), bytes.

use firmware::app::{App, Config, Lines, Nets};
use firmware::link::{Clock, Full, Line, Lost};
use firmware::wire::Format;
use firmware::wire::command::Mode;
use firmware::wire::novatel::ImuType;
use firmware::wire::stim300;
use heapless::Vec;
use lrnn_nostd::{Net, Normalisation, Rational};

/// Longest record.
pub const LONGEST: usize = 256;
/// Bytes of a record before its own.
pub const HEADER: usize = 7;

/// Where a record's bytes arrive.
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
    /// One by one with a pass of the application after each, as from an interrupt: the dearest way.
    Byte,
}

impl Pace {
    /// From its number in a recording.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        [Self::Record, Self::Byte]
            .into_iter()
            .find(|pace| *pace as u8 == number)
    }
}

/// The formats of recordings, by number.
pub const FORMATS: [Format; 3] = [Format::Stim300, Format::Kvh, Format::Novatel];

/// STIM300 at 250 Hz, increments, 10 g range: the sensor of the recordings.
#[must_use]
pub fn stim300_config() -> stim300::config::Config {
    stim300::config::Config::DEFAULT.with_sample_rate_code(1)
}

/// The configuration under test: corrections by two frozen networks once a second.
#[must_use]
pub fn config(format: Format) -> Config {
    Config {
        format: Some(format),
        mode: Mode::Frozen,
        nets: nets(),
        stim300: stim300_config(),
        imu_type: ImuType(26), // ISA-100C, 200 Hz
        ..Config::default()
    }
}

/// The networks: the weights of the shared vectors, which remember; up to about 1 deg/h and 100 ug.
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
    }
}

/// An input line: bytes laid down by the recording. What the application sends there goes nowhere. As cheap as a board's, since its
/// cost is counted with the application's.
#[derive(Debug, Default)]
pub struct Feed {
    bytes: Vec<u8, LONGEST>,
    taken: usize,
}

impl Feed {
    /// Puts `bytes` there; those before have been taken.
    fn lay_down(&mut self, bytes: &[u8]) {
        self.bytes.clear();
        self.taken = 0;
        let _ = self.bytes.extend_from_slice(bytes); // fits: a record is no longer
    }
}

impl Line for Feed {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let left = self.bytes.get(self.taken..).unwrap_or_default();
        let taken = left.len().min(buffer.len());
        for (place, byte) in buffer.iter_mut().zip(left) {
            *place = *byte;
        }
        self.taken += taken;
        Ok(taken)
    }

    fn send(&mut self, _: &[u8]) -> Result<(), Full> {
        Ok(())
    }
}

/// The navigation line: keeps what was sent and notes when the first byte of it left.
#[derive(Debug)]
pub struct Tap {
    sent: Vec<u8, { 2 * LONGEST }>,
    first: Option<u32>,
    ticks: fn() -> u32,
}

impl Line for Tap {
    fn receive(&mut self, _: &mut [u8]) -> Result<usize, Lost> {
        Ok(0)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if self.first.is_none() {
            self.first = Some((self.ticks)());
        }
        self.sent.extend_from_slice(message).map_err(|_| Full)
    }
}

/// Time of the recording.
#[derive(Debug)]
struct Now(u64);

impl Clock for Now {
    fn now_us(&self) -> u64 {
        self.0
    }
}

/// What sensor records cost, in ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Sensor records.
    pub records: u32,
    /// All passes of all of them.
    pub total: u64,
    /// All passes of the dearest one.
    pub worst: u32,
    /// From the last byte of a record to the first byte sent, the longest.
    pub latency: u32,
}

/// The application with a recording at its lines.
#[derive(Debug)]
pub struct Replay {
    app: App<'static>,
    lines: Lines<Feed, Tap, Feed, Feed>,
    now: Now,
    pace: Pace,
    ticks: fn() -> u32,
    cost: Cost,
}

impl Replay {
    /// `ticks` is a counter of 24 bits that counts up.
    pub fn new(config: Config, pace: Pace, ticks: fn() -> u32) -> Self {
        Self {
            app: App::new(config),
            lines: Lines {
                sensor: Feed::default(),
                navigation: Tap {
                    sent: Vec::new(),
                    first: None,
                    ticks,
                },
                command: Feed::default(),
                gnss: Feed::default(),
            },
            now: Now(0),
            pace,
            ticks,
            cost: Cost::default(),
        }
    }

    /// One record: what the application sends to the navigation computer.
    pub fn record(&mut self, input: Input, at_us: u32, bytes: &[u8]) -> &[u8] {
        self.now.0 = at_us.into();
        self.lines.navigation.sent.clear();
        let mut spent = 0;
        let piece = match self.pace {
            Pace::Record => bytes.len(),
            Pace::Byte => 1,
        };
        for piece in bytes.chunks(piece.max(1)) {
            self.lines.navigation.first = None;
            let feed = match input {
                Input::Sensor => &mut self.lines.sensor,
                Input::Gnss => &mut self.lines.gnss,
                Input::Command => &mut self.lines.command,
            };
            feed.lay_down(piece);
            let start = (self.ticks)();
            while self.app.poll(&mut self.lines, &self.now) {}
            let since = |end: u32| end.wrapping_sub(start) & 0x00ff_ffff;
            spent += since((self.ticks)());
            if let (Input::Sensor, Some(first)) = (input, self.lines.navigation.first) {
                self.cost.latency = self.cost.latency.max(since(first));
            }
        }
        if input == Input::Sensor {
            self.cost.records += 1;
            self.cost.total += u64::from(spent);
            self.cost.worst = self.cost.worst.max(spent);
        }
        &self.lines.navigation.sent
    }

    /// So far.
    pub fn cost(&self) -> Cost {
        self.cost
    }
}
