//! Frames that are cut through: the plan for the interrupt ([`crate::link::cut`]).
//!
//! A frame that was cut comes to the loop like any other, which does all its work but does not send
//! it. The compensator corrects it once more, so that its carried remainder goes on as the
//! interrupt's does.

use super::{Correction, Flow};
use crate::link::Line;
use crate::link::cut::{Behind, Plan, Word};
use crate::sample::Axes;
use crate::wire::cut::{in_order, owed_in_order};
use crate::wire::{Checked, ImuFormat, Source};

impl Flow<'_> {
    /// Whether frames are to be cut.
    #[inline(always)]
    pub fn cuts(&self) -> bool {
        self.config.lines().cut_through
    }

    /// [`Flow::frame`], and a plan for those that follow from this position of the stream on, if
    /// they are to be cut.
    #[inline(never)]
    pub fn frame_and_plan(&mut self, frame: Checked, next: u32, out: &mut Behind<impl Line>) {
        let plan = match frame.source() {
            Source::Stream(format) => self.planned(format, &frame),
            Source::Burst(_) | Source::FramedBurst(_) => None,
        };
        self.frame(frame, out);
        if let Some(plan) = plan {
            self.offer(&plan, next, out);
        }
    }

    /// Plan for frames like this one, which has just come; `None`: the next one is not cut.
    fn planned(&self, format: ImuFormat, frame: &Checked) -> Option<Plan> {
        let good = frame
            .read()
            .is_ok_and(|reading| reading.valid != Axes::NONE);
        let changes =
            self.corrector.correction.is_some() || frame.always_changes(&self.config.sensor);
        let mark = changes && self.marks();
        let plan = good.then(|| format.plan(frame.bytes(), mark, &self.config.sensor))?;
        plan.filter(|_| self.corrector.channels.is_one())
    }

    /// Offers the plan of the frames from this position of the stream on, with the correction now
    /// in force.
    fn offer(&mut self, plan: &Plan, next: u32, out: &mut impl Line) {
        let floats = plan.word == Word::F32;
        let output = self.corrector.channels.current();
        let mut correction = self.corrector.correction.get_mut();
        let state = correction.as_mut().map(|Correction { state, .. }| state);
        let owed = state.as_ref().map(|state| state.owed(output, floats));
        let owed = owed_in_order(plan.word, owed);
        let mut left = None;
        out.cut(&mut |cut| left = cut.offer(plan, owed, next));
        if let (Some(state), Some(left)) = (state, left) {
            state.set_left(output, floats, in_order(plan.word, left));
        }
    }
}
