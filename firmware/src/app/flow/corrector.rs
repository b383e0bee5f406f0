//! The corrector: compensator, networks and the stream that they work on.

use super::channels::Channels;
use super::guarded::Guarded;
use crate::app::config::Config;
use crate::app::counts::{Count, Counts};
use crate::app::phase::FAILURES;
use crate::app::setup::renew;
use crate::compensator::{Block, Compensator, Limit, State};
use crate::model::Nets;
use crate::sample::Axes;
use crate::wire::Stream;
use lrnn_nostd::learn::kalman::Maps;

/// The correction of a stream's frames.
#[derive(Debug)]
pub(in crate::app) struct Correction {
    pub compensator: Compensator,
    pub state: State,
}

impl Correction {
    /// Resets it to the state before the first sample of this stream, with networks of this check
    /// sum. `None`: its samples cannot be corrected.
    pub fn renew(
        &mut self,
        stream: &Stream,
        nets: (&Config, u32),
        slew: Option<Limit>,
    ) -> Option<()> {
        self.state.clear();
        renew(&mut self.compensator, stream, nets, slew)
    }
}

/// The correction in force, and the frames that it is for.
#[derive(Debug)]
pub(in crate::app) struct Corrector {
    pub correction: Guarded<Correction>,
    /// Stream and limit for which `correction` was made before its first frame: see
    /// `Flow::prepare`.
    pub prepared: Option<(Stream, Option<Limit>)>,
    /// Check sum of the configured networks.
    pub nets_sum: u32,
    /// The kinds of frames that `correction` was made for.
    pub channels: Channels,
    /// Stream of the samples that make blocks, and the axes that they have.
    pub stream: Option<Stream>,
    pub present: Axes,
    /// Whether its frames have neither counter nor time.
    pub uncounted: bool,
    /// The samples of the stream are floats.
    pub floats: bool,
    /// Another stream makes the blocks, and the learner does not know yet.
    pub leader_changed: bool,
    /// The last block.
    pub block: Option<Block>,
    /// The networks' failures in a row.
    failures: u8,
    /// Blocks in which a correction was clipped, before the present state.
    clipped: Count,
}

impl Corrector {
    /// No correction yet; `nets_sum`: check sum of the configured networks.
    pub fn new(nets_sum: u32) -> Corrector {
        Corrector {
            correction: Guarded::nothing(Correction {
                compensator: Compensator::BLANK,
                state: State::default(),
            }),
            prepared: None,
            nets_sum,
            channels: Channels::default(),
            stream: None,
            present: Axes::NONE,
            uncounted: false,
            floats: false,
            leader_changed: false,
            block: None,
            failures: 0,
            clipped: Count::default(),
        }
    }

    /// Samples a second; 0 without a stream.
    pub fn rate(&self) -> f64 {
        self.stream.map_or(0.0, |stream| stream.rate)
    }

    /// The correction in force: rad/s, m/s2.
    pub fn estimate(&self) -> [[f32; 3]; 2] {
        let correction = self.correction.get();
        correction.map_or([[0.0; 3]; 2], |c| c.state.estimate())
    }

    /// Whether there is a correction, which may be zero, or be fading out.
    pub fn corrects(&self) -> bool {
        self.correction.is_some()
    }

    /// A correction other than zero is in force.
    pub fn in_force(&self) -> bool {
        self.correction.get().is_some_and(|c| !c.state.is_zero())
    }

    /// The maps in force.
    pub fn maps(&self) -> Maps<f32> {
        let correction = self.correction.get();
        correction.map_or(Nets::NONE.maps, |c| *c.state.maps())
    }

    /// Output of the networks for the last block: rad/s, m/s2.
    pub fn network_output(&self) -> [[f32; 3]; 2] {
        self.block
            .map_or([[0.0; 3]; 2], |block| block.network_output)
    }

    /// The correction is this from now on, beside the maps in force.
    pub fn force(&mut self, estimate: &[[f32; 3]; 2]) {
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            let maps = *state.maps();
            compensator.force_with(state, estimate, &maps);
        }
    }

    /// Limits the changes of the correction from now on.
    pub fn slow_down(&mut self, slew: Limit) {
        if let Some(correction) = self.correction.get_mut() {
            correction.compensator.set_slew(Some(slew));
        }
    }

    /// Counts `samples` as missing.
    #[cold]
    pub fn miss(&mut self, samples: u32) {
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.miss(state, samples);
        }
    }

    /// The block in progress has a gap.
    pub fn give_up_block(&mut self) {
        if let Some(Correction { compensator, state }) = self.correction.get_mut() {
            compensator.give_up_block(state);
        }
    }

    /// The next frame selects the correction again; its units have not changed.
    pub fn look_again(&mut self) {
        self.correction.clear();
        self.channels.clear();
    }

    /// The networks' failures are over, as far as is known.
    pub fn forgive(&mut self) {
        self.failures = 0;
    }

    /// The networks have failed for too long.
    #[inline(always)]
    pub fn fails(&self) -> bool {
        self.failures >= FAILURES
    }

    /// Whether the networks have failed for too long, and the correction has gone.
    pub fn has_failed(&self) -> bool {
        let gone = |c: &Correction| c.compensator.slew().is_none() || c.state.is_zero();
        self.fails() && self.correction.get().is_none_or(gone)
    }

    /// A block's networks have failed, or not. When they have failed for too long, the correction
    /// goes to zero, and then everything passes through. It comes back if they step before. `off`:
    /// the correction is zero, or goes there, anyway.
    pub fn count_failure(&mut self, failed: bool, off: bool) {
        let before = self.fails();
        self.failures = if failed {
            self.failures.saturating_add(1)
        } else {
            0
        };
        let now = self.fails();
        if let (true, Some(Correction { state, .. })) = (now != before, self.correction.get_mut()) {
            state.off = now || off;
        }
    }

    /// Blocks in which a correction was clipped.
    pub fn clipped(&self) -> Count {
        let mut clipped = self.clipped;
        let state = self.correction.get().map(|c| &c.state);
        clipped.add(state.map_or(0, |state| state.clipped));
        clipped
    }

    /// Sets the number of clipped corrections.
    pub fn has_clipped(&mut self, counted: u64) {
        self.clipped = Count::of(counted);
    }

    /// These counters with those of the correction's state.
    pub fn counted(&self, mut counters: Counts) -> Counts {
        if let Some(Correction { state, .. }) = self.correction.get() {
            counters.given_up.add(state.given_up);
            counters.mended.add(state.mended);
        }
        counters
    }

    /// Takes the counters of the correction's state over before that is dropped.
    pub fn retain_counts(&mut self, counters: &mut Counts) {
        *counters = self.counted(*counters);
        self.clipped = self.clipped();
        if let Some(correction) = self.correction.get_mut() {
            correction.state.given_up = 0;
            correction.state.mended = 0;
            correction.state.clipped = 0;
        }
    }
}
