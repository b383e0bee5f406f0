//! Health of the device: counters, faults, and the checks that find them.

use super::config::Config;
use super::counts::{Count, Counts};
use super::load::Load;
use crate::plausibility::{self, Plausibility};
use crate::sample::Axes;
use crate::wire::command::fault;

/// Counters, faults and the checks that find them.
#[derive(Debug)]
pub(super) struct Health {
    pub counters: Counts,
    /// Faults in force: bits of [`fault`].
    pub faults: u32,
    /// The sensor that the board has found is not the configured one: bits of [`fault`]. Nothing
    /// is corrected then.
    pub other_sensor: u32,
    pub load: Load,
    /// The configuration against the samples.
    pub plausibility: Plausibility,
    /// Whether configuration and measurements disagree: nothing is corrected or learnt.
    pub disagrees: bool,
}

impl Health {
    /// The state at power-on or with another configuration.
    pub fn new(config: &Config) -> Health {
        let found = &config.store_faults;
        let unread = if found.unread { fault::STORE } else { 0 };
        let other_unit = if found.other_unit { fault::WEIGHTS } else { 0 };
        let configuration = config.configuration.as_ref();
        Health {
            counters: Counts::default(),
            faults: unread | other_unit,
            other_sensor: 0,
            load: Load::default(),
            plausibility: Plausibility::new(configuration.map(plausibility::Expected::of)),
            disagrees: false,
        }
    }

    /// All faults, those of the sensor that the board has found included.
    #[inline(always)]
    pub fn all(&self) -> u32 {
        self.faults | self.other_sensor
    }

    /// Whether one of these faults is so.
    #[inline(always)]
    pub fn has(&self, bits: u32) -> bool {
        self.faults & bits != 0
    }

    /// Sets or clears these fault bits.
    pub fn flag(&mut self, bit: u32, set: bool) {
        self.faults = if set {
            self.faults | bit
        } else {
            self.faults & !bit
        };
    }

    /// Sets the fault bits in `which` to those in `faults`.
    pub fn impose(&mut self, faults: u32, which: u32) {
        self.faults = self.faults & !which | faults & which;
    }

    /// A frame could not be sent or not be corrected in full, or one of late.
    #[cold]
    #[inline(never)]
    pub fn sent_with(&mut self, sent: bool, saturated: Axes) {
        self.flag(fault::OUTPUT_FULL, !sent);
        self.dropped(sent);
        self.flag(fault::SATURATED, saturated != Axes::NONE);
        self.counters.saturated.add(saturated.0.count_ones());
    }

    /// Counts bytes that could not be sent.
    pub fn dropped(&mut self, sent: bool) {
        self.counters.dropped.add(u32::from(!sent));
    }

    /// Memory was found changed, and was mended.
    pub fn mended(&mut self) {
        self.counters.mended.add(1);
    }

    /// Everything that has left on the output stream, or was dropped there for want of room.
    pub fn left(&self) -> u64 {
        let counters = &self.counters;
        [
            counters.frames,
            counters.others,
            counters.raw,
            counters.garbage,
            counters.bad_checksums,
            counters.dropped,
        ]
        .map(|count| count.since(Count::default()))
        .into_iter()
        .fold(0, u64::wrapping_add)
    }

    /// Losses of the stream that may hide samples, modulo 2^32.
    pub fn damage(&self) -> u32 {
        let counters = &self.counters;
        [
            counters.bad_checksums,
            counters.garbage,
            counters.lost,
            counters.jumps,
        ]
        .map(Count::low)
        .into_iter()
        .fold(0, u32::wrapping_add)
    }
}
