//! State on which the output depends, besides the input bytes.

use crate::control::Mode;
use crate::model::Nets;
use crate::wire::field::{put, take};
use lrnn_nostd::learn::kalman::Maps;

/// Bytes of a key.
pub const KEY_LEN: usize = 144;

/// The state of the application ([`crate::app::Phase`]) without its mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum AppState {
    /// Before the first pass.
    Start,
    /// The format is being found.
    Detect,
    /// Frames are read.
    Run,
    /// Bytes pass because the samples' units are not known.
    FaultUnits,
    /// Bytes pass because the networks failed.
    FaultNetwork,
}

/// The state at the beginning of a page, just after the page's first frame has left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// Microseconds since the device's start.
    pub at_us: u64,
    /// Fault bits.
    pub faults: u32,
    /// Number of the sample.
    pub sample: u32,
    /// Hash of all that has left.
    pub hash: u32,
    /// Mode.
    pub mode: Mode,
    /// State of the application.
    pub stage: AppState,
    /// Place of the sensor's format in [`crate::wire::ImuFormat::ALL`].
    pub format: u8,
    /// The samples are floats.
    pub floats: bool,
    /// Whether there is a correction.
    pub corrects: bool,
    /// The page can be played: frames are read, and of one kind.
    pub plays: bool,
    /// The correction in force, rad/s and m/s2.
    pub estimate: [[f32; 3]; 2],
    /// The maps in force.
    pub maps: Maps<f32>,
    /// Bits of what the correction carries over to the next sample.
    pub carried: [[u32; 3]; 2],
}

impl Key {
    /// Little-endian: time u64, faults u32, sample u32, hash u32, mode u8, stage u8, format u8, 1
    /// for floats + 2 for a correction + 4 for one that plays u8, estimate 6 f32, carried 6 u32,
    /// maps 18 f32.
    #[must_use]
    pub fn bytes(&self) -> [u8; KEY_LEN] {
        let mut bytes = [0; KEY_LEN];
        put(&mut bytes, 0, self.at_us.to_le_bytes());
        put(&mut bytes, 8, self.faults.to_le_bytes());
        put(&mut bytes, 12, self.sample.to_le_bytes());
        put(&mut bytes, 16, self.hash.to_le_bytes());
        let flags =
            u8::from(self.floats) | u8::from(self.corrects) << 1 | u8::from(self.plays) << 2;
        let small = [self.mode as u8, self.stage as u8, self.format, flags];
        put(&mut bytes, 20, small);
        put(&mut bytes, 24, estimate_bytes(&self.estimate));
        for (at, bits) in (48..).step_by(4).zip(self.carried.as_flattened()) {
            put(&mut bytes, at, bits.to_le_bytes());
        }
        let maps = self.maps.as_flattened().as_flattened();
        for (at, element) in (72..).step_by(4).zip(maps) {
            put(&mut bytes, at, element.to_le_bytes());
        }
        bytes
    }

    /// Samples pass as they are.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.estimate == [[0.0; 3]; 2] && self.maps == Nets::NONE.maps
    }

    /// Decodes a key; `None` where a number has no meaning.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Key> {
        let bytes: &[u8; KEY_LEN] = bytes.first_chunk()?;
        let word = |at| u32::from_le_bytes(take(bytes, at));
        let [mode, stage, format, flags] = take(bytes, 20);
        let modes = [Mode::Bypass, Mode::Frozen, Mode::Shadow, Mode::Learn];
        let stages = [
            AppState::Start,
            AppState::Detect,
            AppState::Run,
            AppState::FaultUnits,
            AppState::FaultNetwork,
        ];
        let mut carried = [[0; 3]; 2];
        for (at, bits) in (48..).step_by(4).zip(carried.as_flattened_mut()) {
            *bits = word(at);
        }
        let mut maps = Nets::NONE.maps;
        let elements = maps.as_flattened_mut().as_flattened_mut();
        for (at, element) in (72..).step_by(4).zip(elements) {
            *element = f32::from_le_bytes(take(bytes, at));
        }
        Some(Key {
            at_us: u64::from_le_bytes(take(bytes, 0)),
            faults: word(8),
            sample: word(12),
            hash: word(16),
            mode: modes.into_iter().find(|known| *known as u8 == mode)?,
            stage: stages.into_iter().find(|known| *known as u8 == stage)?,
            format,
            floats: flags & 1 != 0,
            corrects: flags & 2 != 0,
            plays: flags & 4 != 0,
            estimate: estimate_of(&take(bytes, 24)),
            maps,
            carried,
        })
    }
}

/// Six numbers as bytes.
pub(super) fn estimate_bytes(estimate: &[[f32; 3]; 2]) -> [u8; 24] {
    let mut bytes = [0; 24];
    for (at, value) in (0..).step_by(4).zip(estimate.as_flattened()) {
        put(&mut bytes, at, value.to_le_bytes());
    }
    bytes
}

/// Bytes as six numbers.
pub(super) fn estimate_of(bytes: &[u8; 24]) -> [[f32; 3]; 2] {
    let mut estimate = [[0.0; 3]; 2];
    for (at, value) in (0..).step_by(4).zip(estimate.as_flattened_mut()) {
        *value = f32::from_le_bytes(take(bytes, at));
    }
    estimate
}
