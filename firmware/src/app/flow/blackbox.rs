//! State of the flow for the black box, and restarts from a recorded state.

use super::{Correction, Flow};
use crate::app::blackbox::{AppState, EventKind, Key, Noted};
use crate::sample::RawSample;
use crate::wire::ImuFormat;
use crate::wire::command::fault;

/// Fault bits that follow from the bytes of a page. The others follow from what was before it, or
/// from what is beside the stream.
pub(in crate::app) const FOLLOWS: u32 =
    fault::SILENT | fault::UNKNOWN_FORMAT | fault::UNITS | fault::SATURATED | fault::SENSOR;

impl Flow<'_> {
    /// State that is compared in every pass.
    #[inline(always)]
    pub fn noted(&self, stage: u8) -> Noted {
        Noted {
            faults: self.health.all(),
            changes: self
                .corrector
                .correction
                .get()
                .map_or(0, |c| c.state.changes),
            mode: self.session.mode as u8,
            stage,
            alignment: self.session.alignment,
        }
    }

    /// A correction may have changed while more frames of the same piece are to leave.
    pub(super) fn note_correction(&mut self) {
        let now = self.noted(self.blackbox.stage());
        if self.blackbox.differs(&now) {
            let estimate = self.corrector.estimate();
            self.blackbox.note(now, &estimate);
        }
    }

    /// Other networks are in use.
    pub(super) fn note_nets(&mut self) {
        let [first, ..] = self.config.nets.gyro.weights.to_array();
        self.blackbox.event(EventKind::Nets, first.to_bits());
    }

    /// A rest has begun or is over.
    pub(super) fn note_rest(&mut self) {
        let rests = self.learning.answer().is_some_and(|of| of.rest.is_some());
        if rests != self.session.rests {
            self.session.rests = rests;
            self.blackbox.event(EventKind::Rest, rests.into());
        }
    }

    /// The state for a page, after the frame that begins it; `frames`: they are being read.
    pub fn key(&self, at_us: u64, stage: AppState, format: ImuFormat) -> Key {
        let floats = self.corrector.floats;
        let carried = self
            .corrector
            .correction
            .get()
            .map(|c| c.state.carried(floats));
        let all = ImuFormat::ALL;
        let place = all.iter().position(|known| known.name() == format.name());
        Key {
            at_us,
            faults: self.health.all(),
            sample: self.sample(),
            hash: self.blackbox.hash(),
            mode: self.session.mode,
            stage,
            format: place.unwrap_or(all.len()) as u8,
            floats,
            corrects: self.corrector.correction.is_some(),
            plays: stage == AppState::Run && self.corrector.channels.is_one(),
            estimate: self.corrector.estimate(),
            maps: self.corrector.maps(),
            carried: carried.unwrap_or_default(),
        }
    }

    /// Goes on from a key, when a frame of its kind has passed. False: no correction was made for
    /// that frame where the key has one, or the other way round.
    pub fn resume(&mut self, key: &Key) -> bool {
        self.session.mode = key.mode;
        self.continuity.sample = key.sample.into();
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            compensator.set_slew(None);
            state.hold = true;
            compensator.force_with(state, &key.estimate, &key.maps);
            state.carry(key.floats, key.carried);
        }
        self.health.impose(key.faults, !0);
        self.corrector.correction.is_some() == key.corrects || key.is_zero()
    }

    /// The correction is this.
    pub fn impose(&mut self, estimate: &[[f32; 3]; 2]) {
        self.corrector.force(estimate);
    }

    /// Whether a sample's values are floats.
    pub(super) fn see_kind(&mut self, sample: &RawSample) {
        self.corrector.floats = matches!(sample, RawSample::Floats { .. });
    }
}
