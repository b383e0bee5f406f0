//! The sensor between two power-ons.

use crate::disturb::{Disturb, Kind};
use crate::sensor::{Counts, Sensor};
use crate::world::World;
use firmware::wire::adis::Form;
use firmware::wire::adis::spi::LONGEST as BURST;
use firmware::wire::command::Counters;
use firmware::wire::framer::LONGEST;
use heapless::{Deque, Vec};

/// Bursts that a board fetches before the application takes them; the next one is lost.
const FETCHED: usize = 4;

/// State between two power-ons.
pub struct Drive<'s> {
    pub world: World,
    pub sensor: &'s Sensor,
    /// The sensor's counter of samples.
    pub index: u32,
    /// The last counts, for a sensor that is stuck.
    pub held: Counts,
    /// Bursts that wait for the application.
    pub bursts: Deque<Vec<u8, BURST>, FETCHED>,
    pub counters: Counters,
}

impl<'s> Drive<'s> {
    /// A drive that begins.
    pub fn new(world: World, sensor: &'s Sensor) -> Drive<'s> {
        Drive {
            world,
            sensor,
            index: 0,
            held: [[0; 3]; 2],
            bursts: Deque::new(),
            counters: Counters::default(),
        }
    }

    /// The board fetches the bursts of a sample; returns how many bytes, and whether one was lost.
    pub fn fetch(&mut self, disturb: &mut Disturb, rate: u32, form: Form) -> (usize, bool) {
        let mut lost = disturb.is(Kind::SensorLost);
        let mut bytes = 0;
        let Some(counts) = self.counts(disturb) else {
            return (bytes, lost);
        };
        let times = 1 + u32::from(disturb.is(Kind::Twice) && disturb.chance(2));
        for _ in 0..times {
            let mut burst = [0; BURST];
            let period = 1.0 / f64::from(rate);
            let celsius = self.world.celsius();
            let sensor = self.sensor;
            sensor.emit(self.index, period, counts, celsius, &mut burst);
            if disturb.is(Kind::NoFormat) {
                disturb.fill(&mut burst);
            }
            if disturb.is(Kind::Garbage) && disturb.chance(3) {
                burst = [[0, 0xFF][disturb.below(2) as usize]; BURST]; // nobody drives the line
            }
            if disturb.is(Kind::SensorNoise) && disturb.chance(4) {
                let at = disturb.below(form.bytes() as u32) as usize;
                if let Some(byte) = burst.get_mut(at) {
                    *byte ^= 1 << disturb.below(8);
                }
            }
            let burst = burst.get(..form.bytes()).unwrap_or_default();
            bytes += burst.len();
            let burst = Vec::from_slice(burst).unwrap_or_default();
            lost |= self.bursts.push_back(burst).is_err();
        }
        (bytes, lost)
    }

    /// The counts of a sample; `None`: the sensor does not send it.
    fn counts(&mut self, disturb: &mut Disturb) -> Option<Counts> {
        let mut counts = self.world.sample(self.sensor);
        self.index = self.index.wrapping_add(1);
        if disturb.is(Kind::Restart) {
            self.index = 0;
            return None;
        }
        if disturb.is(Kind::Silence) || disturb.is(Kind::Missing) && disturb.chance(3) {
            return None;
        }
        if disturb.is(Kind::Stuck) {
            counts = self.held;
        }
        self.held = counts;
        if disturb.is(Kind::Extreme) {
            let largest = self.sensor.largest();
            counts = [[largest, -largest, largest]; 2];
        }
        Some(counts)
    }

    /// Writes the bytes of a sample on the sensor's line.
    pub fn bytes(
        &mut self,
        disturb: &mut Disturb,
        rate: u32,
        into: &mut [u8; 2 * LONGEST],
    ) -> usize {
        let Some(counts) = self.counts(disturb) else {
            return 0;
        };
        if disturb.is(Kind::NoFormat) {
            let bytes = into.get_mut(..40).unwrap_or_default();
            disturb.fill(bytes);
            return bytes.len();
        }
        let period = 1.0 / f64::from(rate);
        let mut frame = [0; LONGEST];
        let celsius = self.world.celsius();
        let sensor = self.sensor;
        let len = sensor.emit(self.index, period, counts, celsius, &mut frame);
        let mut at = 0;
        let mut put = |bytes: &[u8]| {
            for byte in bytes {
                if let Some(slot) = into.get_mut(at) {
                    *slot = *byte;
                    at += 1;
                }
            }
        };
        if disturb.is(Kind::Garbage) && disturb.chance(3) {
            let mut noise = [0; 24];
            disturb.fill(&mut noise);
            put(&noise);
            put(b"text\r\n");
        }
        let frame = frame.get(..len).unwrap_or_default();
        put(frame);
        if disturb.is(Kind::Twice) && disturb.chance(2) {
            put(frame);
        }
        at
    }
}
