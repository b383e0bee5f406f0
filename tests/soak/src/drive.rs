//! The sensor between two power-ons.

use crate::disturb::{Disturb, Kind};
use crate::world::{Sensor, World};
use firmware::wire::command::Counters;
use firmware::wire::framer::LONGEST;

/// State between two power-ons.
pub struct Drive<'s> {
    pub world: World,
    pub sensor: &'s Sensor,
    /// The sensor's counter of samples.
    pub index: u32,
    /// The last counts, for a sensor that is stuck.
    pub held: [[i32; 3]; 2],
    pub counters: Counters,
}

impl Drive<'_> {
    /// Writes the sensor's bytes for a sample.
    pub fn bytes(
        &mut self,
        disturb: &mut Disturb,
        rate: u32,
        into: &mut [u8; 2 * LONGEST],
    ) -> usize {
        let mut counts = self.world.sample(self.sensor);
        self.index = self.index.wrapping_add(1);
        if disturb.is(Kind::Restart) {
            self.index = 0;
            return 0;
        }
        if disturb.is(Kind::Silence) || disturb.is(Kind::Missing) && disturb.chance(3) {
            return 0;
        }
        if disturb.is(Kind::NoFormat) {
            let bytes = into.get_mut(..40).unwrap_or_default();
            disturb.fill(bytes);
            return bytes.len();
        }
        if disturb.is(Kind::Stuck) {
            counts = self.held;
        }
        self.held = counts;
        if disturb.is(Kind::Extreme) {
            let largest = self.sensor.largest();
            counts = [[largest, -largest, largest]; 2];
        }
        let period = 1.0 / f64::from(rate);
        let mut frame = [0; LONGEST];
        let len = self.sensor.emit(self.index, period, counts, &mut frame);
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
