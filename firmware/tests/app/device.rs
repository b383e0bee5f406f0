//! The application between mock lines, under a clock that the test moves.

use firmware::app::{App, Config, Lines};
use firmware::learn::WindowLearner;
use firmware::link::{Clock, Full, Line, Lost};
use firmware::model::Nets;
use firmware::wire::command::{Counters, MAX_PACKET, Packets, Request, Response, decode, encode};
use lrnn_nostd::{Net, Normalisation, Weights};
use std::cell::Cell;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard};

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

/// A line that keeps what is sent over it.
#[derive(Debug)]
pub struct Mock {
    pub input: VecDeque<u8>,
    /// Most bytes a call of `receive` gives.
    pub piece: usize,
    /// Every message sent, one by one.
    pub sent: Vec<Vec<u8>>,
    /// Room left, bytes.
    pub room: usize,
}

impl Default for Mock {
    fn default() -> Mock {
        Mock {
            input: VecDeque::new(),
            piece: usize::MAX,
            sent: Vec::new(),
            room: usize::MAX,
        }
    }
}

impl Mock {
    pub fn bytes(&self) -> Vec<u8> {
        self.sent.concat()
    }
}

impl Line for Mock {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let len = buffer.len().min(self.input.len()).min(self.piece);
        for (place, byte) in buffer.iter_mut().zip(self.input.drain(..len)) {
            *place = byte;
        }
        Ok(len)
    }

    fn is_idle(&self) -> bool {
        self.input.is_empty()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if message.len() > self.room {
            return Err(Full);
        }
        self.room -= message.len();
        if !message.is_empty() {
            self.sent.push(message.to_vec());
        }
        Ok(())
    }
}

#[derive(Debug, Default)]
pub struct Time(pub Cell<u64>);

impl Clock for Time {
    fn now_us(&self) -> u64 {
        self.0.get()
    }
}

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
        self.time.0.set(self.time.0.get() + us);
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
