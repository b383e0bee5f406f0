//! Repairs after a bit of memory has flipped.
//!
//! The compensator checks the values by which it corrects ([`Compensator`](crate::compensator)).
//! Networks and configuration, from which it is made, are checked once a second.

use super::{Correction, Flow};
use crate::app::config::Activation;
use crate::app::setup::{compensator, lsb};
use crate::compensator::of_nets;
use crate::model::Nets;
use crate::sample::RawSample;
use crate::wire::command::fault;

impl Flow<'_> {
    /// Other networks are those in use.
    pub(super) fn take_nets(&mut self, nets: Nets) {
        self.corrector.nets_sum = of_nets(&nets);
        self.config.nets = nets;
        self.corrector.prepared = None;
    }

    /// Looks at the networks. If they have changed, the compensator's copy takes their place while
    /// that is good, else no networks do, and fault WEIGHTS says so.
    #[inline(never)]
    pub fn scrub(&mut self) {
        if !self.corrector.correction.agrees() {
            // there was none, or there is none any more: the next frame rebuilds it
            self.blackbox.part();
            self.corrector.look_again();
            self.health.mended();
        }
        if of_nets(&self.config.nets) == self.corrector.nets_sum {
            return;
        }
        let own = !self.session.learner_nets;
        let correction = self
            .corrector
            .correction
            .get()
            .filter(|c| own && c.compensator.is_intact());
        let copy = correction.map(|c| c.compensator.nets());
        match copy.filter(|nets| of_nets(nets) == self.corrector.nets_sum) {
            Some(nets) => self.config.nets = nets,
            None => {
                self.set_nets(Nets::NONE);
                self.health.flag(fault::WEIGHTS, true);
            }
        }
        self.health.mended();
    }

    /// Rebuilds the compensator from configuration and networks, and ends the block whose last
    /// sample this is. Its state stays. Networks that the learner had put there are taken from the
    /// learner again.
    #[cold]
    #[inline(never)]
    pub(super) fn rebuild_compensator(&mut self, sample: &RawSample) {
        self.scrub();
        let made = self.rebuilt();
        let learner_nets = core::mem::take(&mut self.session.learner_nets);
        match (self.corrector.correction.get_mut(), made) {
            (Some(correction), Some(made)) => {
                correction.compensator = made;
            }
            _ => self.corrector.correction.clear(),
        }
        match (learner_nets, self.config.activation) {
            (true, Activation::FirstRest) => self.restore_at_rest(),
            (true, _) => self.activate(false),
            _ => {}
        }
        self.health.mended();
        let correction = self.corrector.correction.get_mut();
        let block = correction.and_then(|c| c.compensator.end_in_place(&mut c.state, sample));
        if let Some(block) = &block {
            self.end_of_block(block);
        }
    }

    #[inline(never)]
    fn rebuilt(&mut self) -> Option<crate::compensator::Compensator> {
        let Correction {
            compensator: old,
            state,
        } = self.corrector.correction.get_mut()?;
        let slew = old.slew().map(|_| self.config.slew);
        let mut made = compensator(self.corrector.stream.as_ref()?, &self.config, slew)?;
        for (output, (source, content)) in self.corrector.channels.kinds().enumerate().skip(1) {
            if let Some(stream) = source.stream(&self.config.sensor, content)
                && let Some(lsb) = lsb(&stream, 1.0 / stream.rate)
            {
                // one that was set before has a place
                let _ = made.set_output_stream(state, output, lsb, 1.0 / stream.rate);
            }
        }
        Some(made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::config::Config;
    use crate::control::Mode;
    use crate::link::NoLine;
    use crate::link::cut::Behind;
    use crate::wire::{Checked, Fields, ImuFormat};
    use lrnn_nostd::{Net, Normalisation, Weights};

    fn flow() -> Flow<'static> {
        let mut weights = Weights::zero();
        weights.layers[2].b = [1e-3; 3];
        let net = Net::new(weights, Normalisation::identity());
        let config = Config {
            format: Some(ImuFormat::Stim300),
            nets: Nets {
                gyro: net,
                accel: net,
                ..Nets::NONE
            },
            mode: Mode::Frozen,
            block: 0.01,
            ..Config::default()
        };
        let mut flow = Flow::blank();
        flow.set_config(config);
        flow
    }

    /// Two blocks of frames.
    fn runs(flow: &mut Flow, n: &mut u32) {
        for _ in 0..20 {
            let fields = Fields {
                index: *n,
                gyro: [*n as i32 % 50, 7, 3],
                ..Fields::default()
            };
            let mut buffer = [0; 256];
            let emit = ImuFormat::Stim300.simulated()[1].emit;
            let len = emit(&fields, &mut buffer).expect("a frame");
            let frame = Checked::new(ImuFormat::Stim300, &mut buffer[..len]).expect("good");
            flow.frame(frame, &mut Behind::nothing(&mut NoLine));
            *n += 1;
        }
    }

    /// Any upset is repaired, a second and a third time as the first.
    #[test]
    fn every_upset_is_mended_not_only_the_first() {
        type Upset = (fn(&mut Flow), bool);
        let upsets: [Upset; 3] = [
            (|flow| flow.corrector.correction.upset(), true),
            (
                |flow| flow.config.nets.gyro.weights.layers[0].b[1] = 2.0,
                true,
            ),
            (
                |flow| {
                    flow.corrector
                        .correction
                        .get_mut()
                        .expect("one")
                        .compensator
                        .upset()
                },
                false,
            ),
        ];
        for (kind, (upset, scrubs)) in upsets.into_iter().enumerate() {
            let (mut flow, mut other, mut n) = (flow(), flow(), 0);
            runs(&mut flow, &mut n);
            let mut of_other = 0;
            runs(&mut other, &mut of_other);
            for times in 1..4 {
                upset(&mut flow);
                if scrubs {
                    flow.scrub();
                }
                runs(&mut flow, &mut n);
                runs(&mut other, &mut of_other);
                flow.scrub();
                assert_eq!(flow.counted().mended.saturated(), times, "{kind}");
                assert_eq!(flow.corrector.estimate(), other.corrector.estimate());
                assert!(
                    flow.corrector.in_force() && flow.health.faults & fault::WEIGHTS == 0,
                    "{kind}"
                );
                assert_eq!(flow.config.nets, other.config.nets, "{kind}");
            }
        }
    }
}
