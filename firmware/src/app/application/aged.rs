//! An application that has run for long. For tests, since a counter of 32 bits takes days to fill.

use super::App;
use crate::app::counts::Counts;

impl App<'_> {
    /// As if so much of everything had been counted before the first pass: what the command link
    /// shows, samples, bytes and seconds.
    pub fn has_counted(&mut self, counted: u64) {
        let flow = &mut self.flow;
        flow.health.counters = Counts::all(counted);
        flow.begin_at(counted);
        self.link.frames_seen = flow.health.counters.frames;
        self.machine.has_entered(flow.health.counters.entered);
        self.link.taken = counted as u32;
        self.upkeep.seconds = counted as u8;
    }
}
