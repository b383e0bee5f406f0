//! A learner that proves what the test sets, and a bench that measures the correction in force from
//! the bytes that leave.

use crate::activation::fix;
use crate::device::{Device, Shared, nets};
use crate::frames::{Fields, Kind, values};
use firmware::app::{App, Config};
use firmware::compensator::Block;
use firmware::learn::{Learner, Report, Resting, Winner};
use firmware::model::Nets;
use firmware::sample::StreamScale;
use lrnn_nostd::State;
use std::sync::Arc;

/// Answers of the learner, and the calls that it got.
#[derive(Debug, Default)]
pub struct Says {
    /// Error of the accelerometer x that it has proved, m/s2.
    pub winner: Shared<Option<f32>>,
    pub stored_harms: Shared<bool>,
    pub withdraws: Shared<bool>,
    pub still_s: Shared<u32>,
    /// Memory of the unit that it has learnt.
    pub learns: Shared<Vec<u8>>,
    /// Memory that it last recorded or was given back.
    pub knows: Shared<Vec<u8>>,
    /// Memory that it had when it began.
    pub knew: Shared<Vec<u8>>,
    /// How often it recorded its memory, and how often a drive began.
    pub took: Shared<u32>,
    pub drives: Shared<u32>,
    pub navigates: Shared<bool>,
    /// What the rest in progress shows.
    pub rest: Shared<Option<Resting>>,
    /// The networks that it last began with.
    pub begun: Shared<Option<Nets>>,
}

#[derive(Debug)]
pub struct Taught(pub Arc<Says>);

/// Networks with this error of the accelerometer x.
pub fn with(error: f32) -> Nets {
    nets([0.0; 3], [error, 0.0, 0.0])
}

impl Learner for Taught {
    fn begin(&mut self, nets: &Nets, _: StreamScale) {
        self.0.begun.set(Some(*nets));
        self.0.knew.set(self.0.knows.borrow().clone());
    }
    fn restart(&mut self) {}
    fn remember(&mut self) -> usize {
        let learnt = self.0.learns.borrow();
        if learnt.is_empty() {
            return 0;
        }
        self.0.knows.set(learnt.clone());
        self.0.took.set(self.0.took.get() + 1);
        learnt.len()
    }
    fn next_drive(&mut self) {
        self.0.drives.set(self.0.drives.get() + 1);
        self.remember();
        self.restart();
    }
    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        let bytes = self.0.knows.borrow();
        for (place, byte) in piece.iter_mut().zip(bytes.iter().skip(start)) {
            *place = *byte;
        }
    }
    fn recall(&mut self, memory: &[u8]) {
        self.0.knows.set(memory.to_vec());
    }
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn winner(&mut self) -> Option<Winner> {
        self.0.winner.get().map(|error| Winner {
            nets: with(error),
            states: [State::new(); 2],
            estimate: [[0.0; 3], [error, 0.0, 0.0]],
        })
    }
    fn rest(&self) -> Option<Resting> {
        self.0.rest.get()
    }
    fn learnt(&mut self) -> (Nets, [State; 2]) {
        (with(self.0.winner.get().unwrap_or(0.0)), [State::new(); 2])
    }
    fn report(&self) -> Report {
        Report {
            winner: u8::from(self.0.winner.get().is_some()),
            still_s: self.0.still_s.get(),
            navigates: self.0.navigates.get(),
            stored_harms: self.0.stored_harms.get(),
            withdraws: self.0.withdraws.get(),
            ..Report::default()
        }
    }
}

/// A device with that learner, in the stream of a sensor.
pub struct Bench {
    pub kind: Kind,
    pub device: Device,
    pub says: Arc<Says>,
    pub n: u32,
    /// A receiver sends a fix a second.
    pub fixes: bool,
    /// Correction of the accelerometer x in each frame since the last look, m/s2.
    pub seen: Vec<f64>,
    /// The same of the gyro x, rad/s.
    pub turns: Vec<f64>,
}

impl Bench {
    /// `make` gives the application with this learner.
    pub fn of(kind: Kind, make: impl FnOnce(&'static mut Taught) -> App<'static>) -> Bench {
        let says = Arc::new(Says::default());
        let mut device = Device::new(Config::default());
        device.app = make(Box::leak(Box::new(Taught(says.clone()))));
        Bench {
            kind,
            device,
            says,
            n: 0,
            fixes: false,
            seen: Vec::new(),
            turns: Vec::new(),
        }
    }

    /// Seconds of samples.
    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * self.kind.rate()).round() as u32 {
            self.step(1.0);
        }
    }

    /// The next frame.
    pub fn frame(&self) -> Vec<u8> {
        let fields = Fields {
            gyro: [self.n as i32 % 50 - 20, 7, 3],
            accel: [self.n as i32 % 13, -3, 900],
            ..Fields::default()
        };
        self.kind.frame(self.n, fields)
    }

    /// A sample in and out; the clock runs as much slower.
    pub fn step(&mut self, slower: f64) {
        let frame = self.frame();
        let a_second = self.kind.rate() as u32;
        if self.fixes && self.n.is_multiple_of(a_second) {
            self.device
                .lines
                .gnss
                .input
                .extend(fix(self.n / a_second, 0));
        }
        self.n += 1;
        self.sends(&frame);
        self.device
            .pass_us((1e6 / self.kind.rate() / slower) as u64);
        self.look(&frame);
    }

    /// Delivers a message of the sensor: on its line, or as a burst, which then is in a frame here.
    pub fn sends(&mut self, frame: &[u8]) {
        if self.kind != Kind::SPI {
            return self.device.feed(frame);
        }
        let Device {
            app, lines, time, ..
        } = &mut self.device;
        let mut burst = frame[8..frame.len() - 4].to_vec();
        // faults of the burst are the board's concern
        let _ = app.burst(&mut burst, &mut lines.navigation, time);
        self.device.settle();
    }

    /// Compares the bytes that have left with the frame that was sent.
    pub fn look(&mut self, frame: &[u8]) {
        for sent in core::mem::take(&mut self.device.lines.navigation.sent) {
            if sent.len() != frame.len() {
                continue;
            }
            let [before, after] = [frame, &sent].map(|f| values(self.kind.format, f));
            let [gyro, accel] = self.kind.sensor.unit.map(|unit| unit * self.kind.rate());
            self.turns.push((before[0] - after[0]) * gyro);
            self.seen.push((before[3] - after[3]) * accel);
        }
    }

    /// Value of one count of a sample as a correction, m/s2.
    pub fn count(&self) -> f64 {
        self.kind.sensor.unit[1] * self.kind.rate()
    }

    /// The same of the gyros, rad/s.
    pub fn count_of_gyro(&self) -> f64 {
        self.kind.sensor.unit[0] * self.kind.rate()
    }

    /// The corrections since the last look.
    pub fn take(&mut self) -> Vec<f64> {
        core::mem::take(&mut self.seen)
    }

    /// The corrections of the gyro since the last look.
    pub fn take_turns(&mut self) -> Vec<f64> {
        core::mem::take(&mut self.turns)
    }

    /// Lets time pass without a byte of the sensor, s.
    pub fn silence(&mut self, seconds: f64) {
        self.device.wait_ms((1e3 * seconds) as u64);
    }
}
