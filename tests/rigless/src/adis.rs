//! An ADIS16 at an SPI: registers of two bytes at their addresses, in pages if it has them, and
//! bursts. It is strict about the pause between two selections and the clock of a burst.
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::snapshot::Store;

use crate::request;

/// Least time between two selections, ns.
const STALL: u64 = 16_000;
/// Commands that begin a burst.
const BURSTS: [[u8; 2]; 2] = [[0x68, 0], [0x7C, 0]];

/// The sensor, which the board and the bus share.
#[derive(Clone, Debug, Default)]
pub struct Adis(Arc<Mutex<Sensor>>);

#[derive(Debug, Default)]
struct Sensor {
    frame: Vec<u8>,
    answer: [u8; 2],
    free_at: u64,
    last: u64,
    page: u8,
    memory: BTreeMap<(u8, u8), u8>,
    burst: Vec<u8>,
    period: u64,
    bursts: usize,
    wrong: Vec<String>,
}

impl Adis {
    /// A sensor with this product number and range.
    pub fn new(request: &request::Adis) -> Self {
        let mut sensor = Sensor {
            period: 8_000_000_000 / request.hz,
            ..Sensor::default()
        };
        let paged = (16480..16500).contains(&request.product);
        let registers = if paged {
            [(0, 0x7E), (3, 0x12)]
        } else {
            [(0, 0x72), (0, 0x5E)]
        };
        for ((page, address), value) in registers.into_iter().zip([request.product, request.range])
        {
            let [low, high] = value.to_le_bytes();
            sensor.memory.insert((page, address), low);
            sensor.memory.insert((page, address + 1), high);
        }
        Self(Arc::new(Mutex::new(sensor)))
    }

    /// Provides the next burst.
    pub fn ready(&self, burst: &[u8]) {
        if let Ok(mut sensor) = self.0.lock() {
            sensor.burst = burst.to_vec();
        }
    }

    /// Number of bursts that were read, and the transfers that a sensor would not have understood.
    pub fn outcome(&self) -> (usize, Vec<String>) {
        let sensor = self.0.lock();
        sensor.map_or((0, vec![]), |sensor| (sensor.bursts, sensor.wrong.clone()))
    }
}

impl Sensor {
    fn is_burst(&self) -> bool {
        BURSTS.iter().any(|begin| self.frame.starts_with(begin))
    }

    fn transfer(&mut self, byte: u8, now: u64) -> u8 {
        let index = self.frame.len();
        self.frame.push(byte);
        if self.is_burst() {
            if index > 1 && now < self.last + self.period {
                let wrong = format!("a byte of a burst in {} ns", now - self.last);
                self.wrong.push(wrong);
            }
            self.last = now;
            let word = index.checked_sub(2);
            return word.and_then(|n| self.burst.get(n)).copied().unwrap_or(0);
        }
        self.last = now;
        self.answer.get(index).copied().unwrap_or(0)
    }

    fn select(&mut self, now: u64) {
        if now < self.free_at {
            let early = self.free_at - now;
            self.wrong.push(format!("selected {early} ns too early"));
        }
        self.frame.clear();
    }

    fn deselect(&mut self, now: u64) {
        self.free_at = now + STALL;
        match self.frame[..] {
            [command, value] if command & 0x80 != 0 => {
                if command == 0x80 {
                    self.page = value;
                }
                self.memory.insert((self.page, command & 0x7F), value);
            }
            [address, _] => {
                let byte = |n| self.memory.get(&(self.page, address + n)).copied();
                self.answer = [1, 0].map(|n| byte(n).unwrap_or(0));
            }
            _ if self.is_burst() => self.bursts += 1,
            _ => {}
        }
    }
}

impl Store for Adis {}

impl Peer for Adis {
    fn transfer(&mut self, mosi: u32, _: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now = context.now().0;
        let sensor = self.0.lock();
        sensor.map_or(0, |mut sensor| sensor.transfer(mosi as u8, now).into())
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        if let Ok(mut sensor) = self.0.lock() {
            sensor.select(context.now().0);
        }
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        if let Ok(mut sensor) = self.0.lock() {
            sensor.deselect(context.now().0);
        }
    }
}
