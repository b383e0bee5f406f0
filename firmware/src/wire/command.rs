//! Our own command link: a person or a host asks, the co-processor answers.
//!
//! One packet is postcard's encoding of `(number, message)`, followed by its CRC-32 (zlib's,
//! little-endian). The whole is COBS encoded and ended by a zero byte. A reader that joins late or
//! receives damage is in step again at the next zero.
//!
//! The requester chooses the number, and the answer carries that of its request. A request that
//! comes again under the same number, because the answer was lost, changes nothing more than the
//! first did.
//!
//! A request may be sealed with a key ([`seal`]). Where the device has a key, every request that
//! changes something must be.
//!
//! Compatibility: the order of the variants is the wire format. New ones go to the end, and
//! [`WIRE_VERSION`] counts changes.

pub mod key;
mod learning;
mod packets;
mod report;
mod reset;
pub mod seal;
mod security;
mod times;

pub use learning::{Progress, Solution, Trials};
pub use packets::{Packets, decode, encode};
pub use report::{Antenna, Board, Remembered, StoreReport};
pub use reset::{ClockSource, Crash, CrashKind, Crystal, LoopPhase, Reset, cause, unwell};
pub use security::{Protection, Provision, Security};
pub use times::{Sync, Times};

use super::checksum::crc32_zlib;
use super::receiver::ReceiverStatus;
use super::{Error, cobs, field};
use crate::control::recording::{Order, Recording};
use crate::control::update::Report;
use crate::control::{Alignment, HeadingSource, Mode, Reason, Window};
use crate::fix::Heading;
use crate::wheels::WheelSpeed;
use key::Challenge;
use seal::SEAL_LEN;
use serde::{Deserialize, Serialize};

/// Version of this wire format, in [`Version`].
pub const WIRE_VERSION: u16 = 13;
/// The largest piece of a weight image in one packet, bytes.
pub const MAX_CHUNK: usize = 128;
/// The longest packet, its zero byte included: chunk, 32 bytes for the other fields and the CRC, a
/// seal, COBS overhead.
pub const MAX_PACKET: usize = MAX_CHUNK + 32 + SEAL_LEN + 2;

/// The output of the networks, whether it is in force or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Number of the last sample: frames since power-on, missing ones included, modulo 2^32. The
    /// first is 0.
    pub sample: u32,
    /// The sensor's own counter in that frame, to identify it.
    pub counter: Option<u16>,
    /// First and last sample of the window that awaits a [`Request::Reference`].
    pub window: Option<(u32, u32)>,
    /// Correction in force: rate error in rad/s, error of the specific force in m/s2.
    pub in_force: [[f32; 3]; 2],
    /// Output of the networks in use for the last block.
    pub network_output: [[f32; 3]; 2],
    /// Output of the learning copy for the last block.
    pub learnt: [[f32; 3]; 2],
    /// References used, of windows since power-on.
    pub used: u32,
    /// Number of these with an axis that was not believed.
    pub doubted: u32,
}

/// A request to the device.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Answer: [`Response::Version`].
    GetVersion,
    /// Answer: [`Response::Health`].
    GetHealth,
    /// Answer: done or refused.
    SetMode(Mode),
    /// Writes a piece of a new weight image, at most [`MAX_CHUNK`] bytes, into the receiving
    /// buffer.
    WriteImage {
        /// Offset in the image.
        offset: u32,
        /// The piece.
        bytes: &'a [u8],
    },
    /// Checks the image received and uses it from the next sample on.
    CommitImage {
        /// Length of the image, bytes.
        length: u32,
    },
    /// Answer: [`Response::Image`] with the weights in use.
    ReadImage {
        /// Offset in the image.
        offset: u32,
        /// Length of the piece, at most [`MAX_CHUNK`].
        length: u16,
    },
    /// A reference to learn from.
    Reference(Window),
    /// The navigation computer's alignment.
    Alignment(Alignment),
    /// Answer: [`Response::Counters`].
    GetCounters,
    /// Keeps the weights in use over a power cycle. Erasing flash halts the processor, so only in
    /// bypass.
    StoreImage,
    /// Answer: [`Response::Estimate`].
    GetEstimate,
    /// As [`Request::ReadImage`], of the weights learnt. They change while learning goes on, so
    /// read them in another mode.
    ReadLearnt {
        /// Offset in the image.
        offset: u32,
        /// Length of the piece, at most [`MAX_CHUNK`].
        length: u16,
    },
    /// Uses the weights learnt from the next block on.
    CommitLearnt,
    /// Writes a piece of a new configuration record ([`crate::configuration::record`]), at most
    /// [`MAX_CHUNK`] bytes, into the receiving buffer, which weight images share.
    WriteConfiguration {
        /// Offset in the record.
        offset: u32,
        /// The piece.
        bytes: &'a [u8],
    },
    /// Checks the received record as a whole and restarts with it. [`Request::StoreImage`] stores
    /// it, with the weights, over a power cycle.
    CommitConfiguration {
        /// Length of the record, bytes.
        length: u32,
    },
    /// Answer: [`Response::Image`] with the configuration record in use; empty without one.
    ReadConfiguration {
        /// Offset in the record.
        offset: u32,
        /// Length of the piece, at most [`MAX_CHUNK`].
        length: u16,
    },
    /// Answer: [`Response::Board`].
    GetBoard,
    /// A heading that somebody knows, of the vehicle's forward axis now, for the learner's
    /// alignment in progress: from north to east, rad, -2 pi to 2 pi, and its standard deviation,
    /// rad, > 0 to 1.
    Heading(Heading),
    /// Answer: [`Response::Antenna`].
    GetAntenna,
    /// Answer: [`Response::Receiver`].
    GetReceiver,
    /// Answer: [`Response::Remembered`].
    GetMemory,
    /// Answer: [`Response::Kept`].
    GetStore,
    /// Answer: [`Response::Recording`].
    GetRecording,
    /// An order to the black box.
    Record(Order),
    /// Answer: [`Response::Image`] with a piece of the black box, while it holds.
    ReadRecording {
        /// Offset in its memory.
        offset: u32,
        /// Length of the piece, at most [`MAX_CHUNK`].
        length: u16,
    },
    /// Answer: [`Response::Security`].
    GetSecurity,
    /// Begins a session of sealed requests. Answer: [`Response::Challenge`], the same until it is
    /// used or 10 s old, so that nobody can end a session by asking.
    GetChallenge,
    /// Gives the device its key, once, or another one with the present one. It is stored like
    /// [`Request::StoreImage`].
    Provision(Provision),
    /// Answer: [`Response::Reset`], or refused by a device that is no board.
    GetReset,
    /// Answer: [`Response::Solution`], or refused while the learner does not navigate.
    GetSolution,
    /// Answer: [`Response::Trials`], or refused by a board without a learner.
    GetTrials,
    /// Answer: [`Response::Progress`], or refused by a board without a learner.
    GetProgress,
    /// Speed by the wheels, some ten times a second. Answer: done or refused.
    WheelSpeed(WheelSpeed),
    /// Answer: [`Response::Update`], or refused by a board that takes no updates.
    GetUpdate,
    /// Begins an update of the firmware ([`crate::update`]), or goes on with the one that was begun
    /// with the same header. This and the next three: only in bypass.
    BeginUpdate {
        /// Its header, [`crate::update::header::HEADER_LEN`] bytes.
        header: &'a [u8],
        /// It may be older than the firmware that runs.
        older: bool,
    },
    /// The next piece of the image, at most [`MAX_CHUNK`] bytes; all but the last are multiples of
    /// 64. Done: it is in the flash.
    WriteUpdate {
        /// Offset in the image.
        offset: u32,
        /// The piece.
        bytes: &'a [u8],
    },
    /// Checks the image in the flash. The next start tries it.
    FinishUpdate,
    /// Restarts the device.
    Restart,
    /// Answer: [`Response::Times`].
    GetTimes,
}

/// The versions of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// [`WIRE_VERSION`]
    pub wire: u16,
    /// Major, minor, patch of the firmware.
    pub firmware: [u16; 3],
    /// Format of the weight image.
    pub image: u16,
}

/// State and counters since power-on. Counters saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health {
    /// Mode in force.
    pub mode: Mode,
    /// Fault flags of the application, see [`fault`]; 0 = none.
    pub faults: u32,
    /// Inertial frames received.
    pub frames: u32,
    /// Frames with a wrong checksum.
    pub bad_checksums: u32,
    /// Bytes of garbage.
    pub garbage: u32,
    /// Frames missing by the sensor's counter.
    pub missed: u32,
    /// Values that saturated.
    pub saturated: u32,
    /// Corrections that were limited.
    pub bounded: u32,
    /// Most metres that corrections within their limits can add to a free-inertial position 5, 10,
    /// 15, 20 and 22 min after the alignment (`crate::error_bound`).
    pub error_bound_m: [u32; 5],
    /// The promoted hypothesis: its number in [`crate::learn::bank::NAMES`], 0 for none.
    pub winner: u8,
    /// The learner is aligned and compares itself with fixes.
    pub navigates: bool,
    /// Fixes learnt from.
    pub used_fixes: u32,
    /// Fixes refused: too old, or with a component that was not believed.
    pub refused_fixes: u32,
    /// Times a hypothesis other than 0 was promoted.
    pub promotions: u32,
    /// Times it was given up for 0.
    pub rollbacks: u32,
    /// Share of the last whole second in which the processor did not sleep, per mille; `None` where
    /// the board does not know.
    pub busy: Option<u16>,
    /// Load of the busiest second since power-on.
    pub busiest: Option<u16>,
    /// How the learner's navigator got its heading; while it does not navigate, how the alignment
    /// in progress gets its heading.
    pub way: HeadingSource,
    /// Standard deviation of that heading, mrad; `None` while it is unknown.
    pub heading_sigma: Option<u16>,
    /// Mean normalised innovation squared of the last alignment in motion, per cent: 100 when the
    /// fixes are as exact as they say, 0 without one.
    pub residual: u16,
    /// Alignments in motion that were refused because the fixes contradicted them.
    pub refused_alignments: u32,
    /// Rests from which the gyros were learnt.
    pub rests: u32,
    /// Time of the rest in progress, s; 0 without one.
    pub rest_s: u32,
}

/// Bits of [`Health::faults`]: what is wrong now, not what once was.
pub mod fault {
    /// The sensor sends nothing.
    pub const SILENT: u32 = 1 << 0;
    /// The sensor sends, but nothing of the format configured, or of none that is known.
    pub const UNKNOWN_FORMAT: u32 = 1 << 1;
    /// The scale of the values or their rate is not known, so they cannot be corrected.
    pub const UNITS: u32 = 1 << 2;
    /// The last network step failed. The estimate before it stays in force.
    pub const NETWORK: u32 = 1 << 3;
    /// A corrected value of the last frame saturated.
    pub const SATURATED: u32 = 1 << 4;
    /// The last frame found no room in the output and was dropped.
    pub const OUTPUT_FULL: u32 = 1 << 5;
    /// Raw pass-through: bytes pass unread.
    pub const PASS_THROUGH: u32 = 1 << 6;
    /// The sensor calls some axis invalid.
    pub const SENSOR: u32 = 1 << 7;
    /// The last attempt to store weights and configuration failed, or what was stored cannot be
    /// read.
    pub const STORE: u32 = 1 << 8;
    /// The device has no configuration: it only passes bytes.
    pub const NOT_CONFIGURED: u32 = 1 << 9;
    /// The samples come at another rate, by the board's clock, than the frames or the configuration
    /// say.
    pub const RATE: u32 = 1 << 10;
    /// At rest, the specific force is not within 5 % of gravity: wrong units or range.
    pub const GRAVITY: u32 = 1 << 11;
    /// At rest, the rate is neither the Earth's nor within the bias of the datasheet: wrong units.
    pub const EARTH_RATE: u32 = 1 << 12;
    /// At rest, gravity is not on the axis, or not of the sign, that the mounting says.
    pub const AXES: u32 = 1 << 13;
    /// The sensor repeats itself: its counter or all its values do not change.
    pub const STUCK: u32 = 1 << 14;
    /// The weights in use were of a sensor with another serial number. They are no longer used: the
    /// device has the built-in ones, until others are uploaded or it has learnt again.
    pub const WEIGHTS: u32 = 1 << 15;
    /// The learner fell behind and was stopped. What is in force stays, and nothing is learnt until
    /// it begins again: with another mode, configuration, or start of the sensor.
    pub const LEARNER: u32 = 1 << 16;
    /// The fixes show the same scale error, of more than 0.5 %, on all axes of the gyros: a wrong
    /// time base, of the sensor or the board. No map is learnt.
    pub const TIME_BASE: u32 = 1 << 17;
    /// The board does not run on the crystal that it was built for: its clock is the internal
    /// oscillator's, or the crystal has another value.
    pub const CLOCK: u32 = 1 << 24;
    /// A line cannot have its bit rate within 2 %, and has the nearest.
    pub const BIT_RATE: u32 = 1 << 25;
    /// Safe start: after repeated resets the device stays in bypass and does not use what is stored
    /// but the lines.
    pub const SAFE_START: u32 = 1 << 26;
    /// The supply is too low for writing flash.
    pub const SUPPLY: u32 = 1 << 27;
    /// The last change of the key is not complete: it is not stored, or a record with the key
    /// before, or without one, is still there.
    pub const KEY: u32 = 1 << 28;
}

/// More counters since power-on. They saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counters<T = u32> {
    /// Inertial frames received.
    pub frames: T,
    /// Other good messages of the sensor, passed on.
    pub others: T,
    /// Frames with a wrong checksum.
    pub bad_checksums: T,
    /// Bytes of garbage.
    pub garbage: T,
    /// Times the sensor's line reported lost bytes; at an SPI, bursts that were lost.
    pub lost: T,
    /// Frames missing by the sensor's counter.
    pub missed: T,
    /// Frames that came twice by the sensor's counter.
    pub duplicates: T,
    /// Times the counter jumped.
    pub jumps: T,
    /// Times the sensor fell silent.
    pub silences: T,
    /// Messages dropped because the output had no room.
    pub dropped: T,
    /// Bytes passed through raw.
    pub raw: T,
    /// Values that saturated at the range of their field.
    pub saturated: T,
    /// Blocks stepped.
    pub blocks: T,
    /// Blocks given up because of a gap in the stream or invalid values.
    pub given_up: T,
    /// Requests of the navigation computer.
    pub requests: T,
    /// Number of these that the device answered because the sensor did not.
    pub answered: T,
    /// Fixes received.
    pub fixes: T,
    /// Number of these that the receiver calls good.
    pub good_fixes: T,
    /// Times each state was entered: detection, run, fault.
    pub entered: [T; 3],
    /// Restarts of the sensor.
    pub restarts: T,
    /// Times the device found its memory changed by nobody, and mended it.
    pub mended: T,
}

/// An answer of the device.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Response<'a> {
    /// Carried out.
    Done,
    /// The request was not carried out.
    Refused(Reason),
    /// To [`Request::GetVersion`].
    Version(Version),
    /// To [`Request::GetHealth`].
    Health(Health),
    /// To [`Request::ReadImage`].
    Image {
        /// Offset in the image.
        offset: u32,
        /// The piece; shorter than asked for at the image's end.
        bytes: &'a [u8],
    },
    /// To [`Request::GetCounters`].
    Counters(Counters),
    /// To [`Request::GetEstimate`].
    Estimate(Estimate),
    /// To [`Request::GetBoard`].
    Board(Board<'a>),
    /// To [`Request::GetAntenna`].
    Antenna(Antenna),
    /// To [`Request::GetReceiver`].
    Receiver(ReceiverStatus),
    /// To [`Request::GetMemory`].
    Remembered(Remembered),
    /// To [`Request::GetStore`].
    Kept(StoreReport),
    /// To [`Request::GetRecording`].
    Recording(Recording),
    /// To [`Request::GetSecurity`].
    Security(Security),
    /// To [`Request::GetChallenge`].
    Challenge(Challenge),
    /// To [`Request::GetReset`].
    Reset(Reset),
    /// To [`Request::GetSolution`].
    Solution(Solution),
    /// To [`Request::GetTrials`].
    Trials(Trials),
    /// To [`Request::GetProgress`].
    Progress(Progress),
    /// To [`Request::GetUpdate`].
    Update(Report),
    /// To [`Request::GetTimes`].
    Times(Times),
}

#[cfg(test)]
mod tests;
