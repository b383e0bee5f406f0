//! The disturbances and their times. All follow from the seed.

use crate::random::Random;
use firmware::control::recording::Order;
use firmware::control::{Alignment, Mode, Window};
use firmware::fix::Heading;
use firmware::wire::command::{MAX_CHUNK, Request};

/// Mean time between the starts of disturbances, s.
const EVERY_S: u32 = 15;

macro_rules! kinds {
    ($($(#[$doc:meta])+ $kind:ident = $lasts:literal;)+) => {
        /// A kind of disturbance.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Kind {
            $($(#[$doc])+ $kind,)+
        }

        /// All kinds, with the longest duration of each, ms; 0: one sample.
        pub const KINDS: [(Kind, u32); [$(stringify!($kind)),+].len()] =
            [$((Kind::$kind, $lasts)),+];
    };
}

kinds! {
    /// Bits of the sensor's bytes flip, bytes are lost, bursts of noise come.
    SensorNoise = 5000;
    /// The sensor's line reports losses.
    SensorLost = 0;
    /// The sensor is silent.
    Silence = 4000;
    /// The sensor restarts: it is silent, then counts from zero.
    Restart = 3000;
    /// Bytes of another format, text and noise stand between the frames.
    Garbage = 2000;
    /// Only noise comes, as at a wrong bit rate.
    NoFormat = 6000;
    /// Frames come twice.
    Twice = 1000;
    /// Frames are missing.
    Missing = 2000;
    /// The main loop is delayed, so that several frames are pending at once.
    HeldUp = 3000;
    /// The values do not change.
    Stuck = 3000;
    /// The values are at the ends of their fields.
    Extreme = 500;
    /// The fixes are kilometres off.
    FixWrong = 20000;
    /// The fixes come late.
    FixLate = 20000;
    /// The receiver is silent.
    FixSilence = 60000;
    /// Many fixes arrive at once, each with its own time.
    FixFlood = 500;
    /// The receiver's bytes are damaged.
    ReceiverNoise = 10000;
    /// Another mode is set.
    Mode = 0;
    /// Requests come without a pause.
    CommandFlood = 1000;
    /// The command link carries noise.
    CommandNoise = 500;
    /// The navigation computer's line is full.
    OutputFull = 1000;
    /// The navigation computer sends to the sensor.
    Reverse = 500;
    /// The store fails.
    StoreFails = 60000;
    /// Everything is stored by command.
    StoreNow = 0;
    /// The record in use is sent again.
    Configure = 0;
    /// The device is reset.
    Reset = 0;
}

/// Number of kinds.
pub const COUNT: usize = KINDS.len();

/// The current disturbances.
#[derive(Debug, Clone)]
pub struct Disturb {
    random: Random,
    rate: u32,
    /// Remaining samples of each kind.
    left: [u32; COUNT],
    /// How often each has begun.
    pub begun: [u32; COUNT],
}

impl Disturb {
    /// Without a disturbance yet.
    #[must_use]
    pub fn new(random: Random, rate: u32) -> Disturb {
        Disturb {
            random,
            rate,
            left: [0; COUNT],
            begun: [0; COUNT],
        }
    }

    /// Advances to the next sample.
    pub fn step(&mut self) {
        for left in &mut self.left {
            *left = left.saturating_sub(1);
        }
        if self.random.below(EVERY_S * self.rate) > 0 {
            return;
        }
        let which = self.random.below(COUNT as u32) as usize;
        // a reset, a new configuration and a store are rarer
        let rare = which >= Kind::StoreNow as usize;
        if rare && self.random.below(3) > 0 {
            return;
        }
        let lasts = KINDS.get(which).map_or(0, |(_, ms)| *ms);
        let ms = if lasts > 0 {
            self.random.below(lasts)
        } else {
            0
        };
        if let (Some(left), Some(begun)) = (self.left.get_mut(which), self.begun.get_mut(which)) {
            *left = 1 + ms * self.rate / 1000;
            *begun = begun.saturating_add(1);
        }
    }

    /// Whether this disturbance is present now.
    #[must_use]
    pub fn is(&self, kind: Kind) -> bool {
        self.left.get(kind as usize).is_some_and(|left| *left > 0)
    }

    /// True with probability 1 / `of`.
    pub fn chance(&mut self, of: u32) -> bool {
        self.random.below(of) == 0
    }

    /// Random bytes.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = self.random.next() as u8;
        }
    }

    /// A random number below `below`.
    pub fn below(&mut self, below: u32) -> u32 {
        self.random.below(below)
    }

    /// A random mode; learn most often.
    pub fn mode(&mut self) -> Mode {
        match self.random.below(6) {
            0 => Mode::Bypass,
            1 => Mode::Frozen,
            2 => Mode::Shadow,
            _ => Mode::Learn,
        }
    }

    /// Any request except those that have kinds of their own. `bytes` are for pieces of images.
    pub fn request<'b>(&mut self, bytes: &'b mut [u8; MAX_CHUNK]) -> Request<'b> {
        let offset = self.random.below(700);
        let length = self.random.below(140) as u16;
        match self.random.below(22) {
            0 => Request::GetVersion,
            1 => Request::GetHealth,
            2 => Request::SetMode(self.mode()),
            3 | 4 => {
                self.fill(bytes);
                let len = self.random.below(MAX_CHUNK as u32 + 1) as usize;
                let bytes = bytes.get(..len).unwrap_or_default();
                if offset.is_multiple_of(2) {
                    Request::WriteImage { offset, bytes }
                } else {
                    Request::WriteConfiguration { offset, bytes }
                }
            }
            5 => Request::CommitImage { length: 608 },
            6 => Request::ReadImage { offset, length },
            7 => Request::Reference(Window {
                first: self.random.next(),
                last: self.random.next(),
                angle: [1e-3; 3],
                velocity: [0.5; 3],
                angle_sigma: 1e-5,
                velocity_sigma: 1e-3,
            }),
            8 if offset.is_multiple_of(2) => Request::GetProgress,
            8 => Request::GetCounters,
            9 if offset.is_multiple_of(2) => Request::GetEstimate,
            9 => Request::GetSolution,
            10 | 11 => Request::ReadLearnt { offset, length },
            12 => Request::CommitLearnt,
            13 => Request::CommitConfiguration { length: offset },
            14 => Request::ReadConfiguration { offset, length },
            15 => Request::GetBoard,
            16 => Request::Heading(Heading {
                angle: self.random.signed() * 7.0,
                sigma: 0.1,
            }),
            17 if offset.is_multiple_of(2) => Request::GetAntenna,
            17 => Request::GetTrials,
            18 => Request::GetReceiver,
            19 => Request::Alignment(if offset.is_multiple_of(2) {
                Alignment::Started
            } else {
                Alignment::Finished
            }),
            20 => Request::Record(if offset.is_multiple_of(2) {
                Order::Hold
            } else {
                Order::Release
            }),
            _ => Request::ReadRecording { offset, length },
        }
    }
}
