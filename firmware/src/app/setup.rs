//! What the words of a stream mean: from the frame where it tells, from the sensor's configuration where not.

use super::config::Config;
use crate::compensator::{Compensator, Limit};
use crate::sample::{Lsb, Units};
use crate::wire::novatel::ImuType;
use crate::wire::sequence::{Gap, Rule, time_gap};
use crate::wire::{Format, Reading, Source, hg4930, kvh, stim300};

/// How frames that are missing are noticed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sequence {
    /// By the sensor's counter.
    Counter(Rule),
    /// By the time in the frame, at this rate in Hz.
    Time(f64),
    /// Not by the frame: HG4930, whose two bits count messages of all kinds, and a STIM300 with an external trigger.
    None,
}

/// The meaning of the words of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Setup {
    units: Units,
    /// Words a second.
    rate: f64,
    sequence: Sequence,
}

impl Setup {
    /// For frames of a source with this [`crate::wire::Checked::content`]; `None` when their meaning is not known.
    pub fn new(
        config: &Config,
        stim: &stim300::config::Config,
        source: Source,
        content: u8,
    ) -> Option<Setup> {
        let format = match source {
            Source::Stream(format) => format,
            Source::Burst(_) => {
                return Some(Setup {
                    units: config.adis?.units,
                    rate: config.rate,
                    sequence: Sequence::Counter(Rule::ADIS),
                });
            }
        };
        let (units, rate, sequence) = match format {
            Format::Stim300 => {
                let rate = stim.sample_rate().ok()?;
                let sequence = stim.counter_step().map_or(Sequence::None, |step| {
                    Sequence::Counter(Rule::stim300(step))
                });
                let rate = rate.map_or(config.rate, f64::from);
                (stim.units().ok()?, rate, sequence)
            }
            Format::Kvh => {
                let units = kvh::units(config.kvh.delta, config.kvh.degrees);
                (units, config.rate, Sequence::Counter(Rule::KVH))
            }
            Format::Novatel => {
                let kind = if content == 0 {
                    config.imu_type
                } else {
                    ImuType(content)
                };
                let rate = kind.rate().map_or(config.rate, f64::from);
                (kind.units()?, rate, Sequence::Time(rate))
            }
            Format::Hg4930 if content == 0xCA => (hg4930::S_CLASS, 3600.0, Sequence::None),
            Format::Hg4930 => (hg4930::INERTIAL, 100.0, Sequence::None),
            Format::Ubx => return None,
        };
        Some(Setup {
            units,
            rate,
            sequence,
        })
    }

    /// A compensator for these words, or `None` when they are of a kind that cannot be corrected.
    pub fn compensator(&self, config: &Config, slew: Option<Limit>) -> Option<Compensator> {
        let period = 1.0 / self.rate;
        let lsb = Lsb {
            rad: self.units.gyro.increment(period)?,
            mps: self.units.accel.increment(period)?,
        };
        // rounds, and holds at 1 and 65535
        let words = (config.block * self.rate + 0.5) as u16;
        let nets = config.nets;
        let made = Compensator::new(
            nets.gyro,
            nets.accel,
            lsb,
            period,
            words.max(1),
            config.limit,
        );
        made.ok().map(|mut compensator| {
            compensator.slew = slew;
            compensator
        })
    }

    /// What the frame says about those before it.
    pub fn gap(&self, last: &mut Last, reading: &Reading) -> Gap {
        match (self.sequence, reading.counter, reading.time_of_week) {
            (Sequence::Counter(rule), Some(counter), _) => rule.check(&mut last.counter, counter),
            (Sequence::Time(rate), _, Some(now)) => last
                .time
                .replace(now)
                .map_or(Gap::None, |before| time_gap(before, now, rate)),
            _ => Gap::None,
        }
    }
}

/// Counter and time of the last frame.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Last {
    counter: Option<u16>,
    time: Option<f64>,
}

impl Last {
    /// The sensor's counter.
    pub fn counter(&self) -> Option<u16> {
        self.counter
    }
}
