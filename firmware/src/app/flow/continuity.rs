//! Which samples are missing, came twice or are constant, and whether the sensor has restarted.

use super::stuck::StuckDetector;
use crate::app::counts::Count;
use crate::wire::sequence::Last;

/// Knowledge of the units that a sensor reports beside its frames (STIM300).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::app) enum Units {
    /// Assumed to be as configured: the sensor's receiver need not be wired.
    AsConfigured,
    /// The sensor may have changed them since its last report.
    Unknown,
    /// The sensor has reported them since its last start.
    Reported,
}

/// The order of the samples so far.
#[derive(Debug)]
pub(in crate::app) struct Continuity {
    pub last: Last,
    /// Number of the last sample, modulo 2^64; the first is 0.
    pub sample: u64,
    /// Arrival time of the frames that are being read, microseconds.
    pub now_us: u64,
    pub stuck: StuckDetector,
    pub units: Units,
    /// No good sample has come since the sensor's start.
    pub fresh: bool,
    /// The sensor was silent before the next frame, microseconds.
    pub silent_us: Option<u64>,
    /// Bytes that belong to no frame, since the last frame.
    pub unframed: u32,
    /// Frames of other kinds than those that make blocks, and the number of all frames when their
    /// count began.
    pub aside: (u32, Count),
}

impl Continuity {
    /// The state at power-on.
    pub fn new() -> Continuity {
        Continuity {
            last: Last::default(),
            sample: u64::MAX,
            now_us: 0,
            stuck: StuckDetector::default(),
            units: Units::AsConfigured,
            fresh: true,
            silent_us: None,
            unframed: 0,
            aside: (0, Count::default()),
        }
    }

    /// Another configuration has come. What the sensor has shown of itself stays.
    pub fn restart(&mut self) {
        *self = Continuity {
            units: self.units,
            fresh: self.fresh,
            ..Continuity::new()
        };
    }

    /// The sensor has restarted.
    pub fn sensor_restarted(&mut self) {
        self.units = Units::Unknown;
        (self.last, self.stuck) = (Last::default(), StuckDetector::default());
    }

    /// Counts `samples` as missing before the last one.
    pub fn skip(&mut self, samples: u32) {
        self.sample = self.sample.wrapping_add(samples.into());
    }
}
