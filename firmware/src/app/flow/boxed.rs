//! What the black box is told of the flow, and going on from what it holds.

use super::{Correction, Flow};
use crate::app::blackbox::{Key, Noted, Stage, What};
use crate::sample::RawSample;
use crate::wire::ImuFormat;
use crate::wire::command::fault;

/// Fault bits that follow from the bytes of a page. The others follow from what was before it, or
/// from what is beside the stream.
pub(in crate::app) const FOLLOWS: u32 =
    fault::SILENT | fault::UNKNOWN_FORMAT | fault::UNITS | fault::SATURATED | fault::SENSOR;

impl Flow<'_> {
    /// What is compared in every pass.
    #[inline(always)]
    pub fn noted(&self, stage: u8) -> Noted {
        Noted {
            faults: self.faults | self.other_sensor,
            changes: self.correction.get().map_or(0, |c| c.state.changes),
            mode: self.mode as u8,
            stage,
            alignment: self.alignment,
        }
    }

    /// A correction may have changed while more frames of the same piece are to leave.
    pub(super) fn note_correction(&mut self) {
        let now = self.noted(self.blackbox.stage());
        if self.blackbox.differs(&now) {
            let estimate = self.estimate_in_force();
            self.blackbox.note(now, &estimate);
        }
    }

    /// Other networks are in use.
    pub(super) fn note_nets(&mut self) {
        let [first, ..] = self.config.nets.gyro.weights.to_array();
        self.blackbox.event(What::Nets, first.to_bits());
    }

    /// The correction in force.
    pub fn estimate_in_force(&self) -> [[f32; 3]; 2] {
        let correction = self.correction.get();
        correction.map_or([[0.0; 3]; 2], |c| c.state.estimate())
    }

    /// The state for a page, after the frame that begins it; `frames`: they are being read.
    pub fn key(&self, at_us: u64, stage: Stage, format: ImuFormat) -> Key {
        let floats = self.floats;
        let carried = self.correction.get().map(|c| c.state.carried(floats));
        let all = ImuFormat::ALL;
        let place = all.iter().position(|known| known.name() == format.name());
        Key {
            at_us,
            faults: self.faults | self.other_sensor,
            sample: self.sample(),
            hash: self.blackbox.hash(),
            mode: self.mode,
            stage,
            format: place.unwrap_or(all.len()) as u8,
            floats,
            corrects: self.correction.is_some(),
            plays: stage == Stage::Run && self.channels.is_one(),
            estimate: self.estimate_in_force(),
            carried: carried.unwrap_or_default(),
        }
    }

    /// Goes on from a key, when a frame of its kind has passed. False: no correction was made for
    /// that frame where the key has one, or the other way round.
    pub fn resume(&mut self, key: &Key) -> bool {
        self.mode = key.mode;
        self.sample = key.sample.into();
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.set_slew(None);
            state.hold = true;
            compensator.force(state, &key.estimate);
            state.carry(key.floats, key.carried);
        }
        self.impose_faults(key.faults, !0);
        self.correction.is_some() == key.corrects || key.estimate == [[0.0; 3]; 2]
    }

    /// The correction is this.
    pub fn impose(&mut self, estimate: &[[f32; 3]; 2]) {
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.force(state, estimate);
        }
    }

    /// These of the fault bits are so.
    pub fn impose_faults(&mut self, faults: u32, which: u32) {
        self.faults = self.faults & !which | faults & which;
    }

    /// Whether a sample's values are floats.
    pub(super) fn see_kind(&mut self, sample: &RawSample) {
        self.floats = matches!(sample, RawSample::Floats { .. });
    }
}
