//! A sample without its frame, as a recording or a simulation holds it: corrected, counted, given
//! to the networks and the learner as that of a frame.

use super::{Correction, Flow};
use crate::sample::{Axes, RawSample};
use crate::wire::{ImuFormat, Reading, Source, Stream};

/// The source that such samples count as. No decision depends on it: units, rate and gap rule come
/// with the samples.
const SOURCE: Source = Source::Stream(ImuFormat::Novatel);

impl Flow<'_> {
    /// A sample in, the corrected sample out.
    pub fn sampled(&mut self, reading: &Reading, stream: &Stream) -> RawSample {
        let known = self.corrector.channels.is(0) || self.another((SOURCE, 0), 1, reading);
        if !known {
            self.make_for((SOURCE, 0), reading.present, Some(*stream));
            self.see_kind(&reading.sample);
        }
        let mut sample = reading.sample;
        if reading.valid != Axes::NONE
            && let Some(Correction { compensator, state }) = self.corrector.correction.get_mut()
        {
            let output = self.corrector.channels.current();
            let (corrected, over) = compensator.corrected(state, output, &reading.sample, false);
            compensator.anticipate(state, output, &reading.sample, reading.valid);
            sample = corrected;
            self.health.sent_with(true, over);
        }
        self.health.counters.frames.add(1);
        if !known {
            self.made();
        }
        self.follow(reading);
        sample
    }
}
