//! The application between mock lines, under a clock that the test moves.

use firmware::app::{App, Config, Lines};
use firmware::learn::WindowLearner;
use firmware::link::Line;
use firmware::model::Nets;
use firmware::wire::command::{Counters, MAX_PACKET, Packets, Request, Response, decode, encode};
use lrnn_nostd::{Net, Normalisation, Weights};
use std::cell::Cell;
use std::sync::{Mutex, MutexGuard};
pub use test_bench::line::MockLine as Mock;

/// State shared by a test and its learner.
#[derive(Debug, Default)]
pub struct Shared<T>(Mutex<T>);

impl<T> Shared<T> {
    pub fn borrow(&self) -> MutexGuard<'_, T> {
        self.0.lock().expect("not poisoned")
    }

    pub fn set(&self, value: T) {
        *self.borrow() = value;
    }

    pub fn get(&self) -> T
    where
        T: Copy,
    {
        *self.borrow()
    }
}

/// A clock that the test sets.
pub type Time = Cell<u64>;

/// A device between four mock lines.
#[derive(Debug)]
pub struct Device<S = Mock> {
    pub app: App<'static>,
    pub lines: Lines<S, Mock, Mock, Mock>,
    pub time: Time,
    number: u8,
}

impl Device<Mock> {
    pub fn new(config: Config) -> Device<Mock> {
        Device::on(config, Mock::default())
    }

    /// A device with a learner.
    pub fn learning(config: Config) -> Device<Mock> {
        let learner: &'static mut WindowLearner = Box::leak(Box::default());
        let mut device = Device::new(Config::default());
        device.app = App::with_learner(config, Some(learner));
        device
    }

    /// Frames of the sensor, all at once.
    pub fn feed(&mut self, bytes: &[u8]) {
        self.lines.sensor.input.extend(bytes);
        self.settle();
    }
}

impl<S: Line> Device<S> {
    pub fn on(config: Config, sensor: S) -> Device<S> {
        Device {
            app: App::new(config),
            lines: Lines {
                sensor,
                navigation: Mock::default(),
                command: Mock::default(),
                gnss: Mock::default(),
            },
            time: Time::default(),
            number: 0,
        }
    }

    /// Runs passes of 10 microseconds until there is no more work.
    pub fn settle(&mut self) {
        while self.app.poll(&mut self.lines, &self.time) {
            self.pass_us(10);
        }
    }

    pub fn pass_us(&mut self, us: u64) {
        self.time.set(self.time.get() + us);
    }

    /// Lets time pass in steps of 1 ms.
    pub fn wait_ms(&mut self, ms: u64) {
        for _ in 0..ms {
            self.pass_us(1000);
            self.settle();
        }
    }

    pub fn counters(&self) -> Counters {
        self.app.counters()
    }

    /// Asks over the command link and hands the answer to `check`. The beginning of a frame may
    /// delay the answer.
    pub fn ask<T>(&mut self, request: &Request, check: impl FnOnce(Response) -> T) -> T {
        self.number = self.number.wrapping_add(1);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(self.number, request, &mut buffer).expect("a packet");
        self.lines.command.input.extend(&*packet);
        for _ in 0..100 {
            self.wait_ms(1);
            let mut packets = Packets::new();
            for byte in self.lines.command.bytes() {
                if let Some(packet) = packets.push(byte) {
                    let (number, response) = decode::<Response>(packet).expect("our own packet");
                    assert_eq!(number, self.number);
                    self.lines.command.sent.clear();
                    return check(response);
                }
            }
        }
        panic!("no answer");
    }

    /// Sends a request that must be carried out.
    pub fn order(&mut self, request: &Request) {
        self.ask(request, |answer| assert_eq!(answer, Response::Done));
    }
}

/// A network whose output is `error` for every input.
pub fn constant(error: [f32; 3]) -> Net {
    let mut weights = Weights::zero();
    weights.layers[2].b = error;
    Net::new(weights, Normalisation::identity())
}

/// Networks with these errors as output, rad/s and m/s2.
pub fn nets(gyro: [f32; 3], accel: [f32; 3]) -> Nets {
    Nets {
        gyro: constant(gyro),
        accel: constant(accel),
        ..Nets::NONE
    }
}

/// A network whose first step overflows.
pub fn broken() -> Net {
    let mut weights = Weights::zero();
    weights.layers[0].b = [f32::MAX; 3];
    weights.layers[0].w = [[f32::MAX; 3]; 3];
    Net::new(
        weights,
        Normalisation {
            input_scale: [f32::MAX; 3],
            ..Normalisation::identity()
        },
    )
}
