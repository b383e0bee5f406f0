//! The first rest after power-on (activation `FirstRest`): the gyros' errors of this turn-on come
//! into force while the vehicle stands, beside what is stored.
//!
//! A rest that has begun within [`BEGINS_S`] of power-on shows the gyros' errors to some hundredths
//! of a degree per second, before the navigation computer has aligned itself. While it lasts, the
//! correction follows what it shows; afterwards it stays as it is until the next power-on. Should
//! the vehicle have been turned meanwhile, the next rest in that time takes its place. What noise
//! or the Earth's rotation may be changes nothing: sensors without errors stay as they are, and
//! what is stored, which has proved itself, stays unless the rest contradicts it. The
//! accelerometers have what is stored.

use super::{Correction, Flow};
use crate::model::Nets;

/// A rest that begins later does not count, s.
const BEGINS_S: f32 = 30.0;

/// Course of the first rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Course {
    /// It may come, or come again.
    #[default]
    Awaited,
    /// It lasts.
    Lasts,
    /// It is over, or has not come in time.
    Over,
}

/// What the first rest has added to the correction.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::app) struct FirstRest {
    course: Course,
    /// Since power-on, s.
    time_s: f32,
    /// Added to the gyros' correction, rad/s.
    added: [f32; 3],
}

impl FirstRest {
    /// The networks in force are the stored ones again.
    pub fn drop_added(&mut self) {
        self.added = [0.0; 3];
    }

    /// A block of `block_s` has ended, in which the vehicle has `rested` or not. Whether what it
    /// shows comes into force.
    fn takes(&mut self, block_s: f32, rested: bool, aligns: bool) -> bool {
        self.time_s += block_s;
        self.course = match (self.course, rested) {
            _ if aligns => Course::Over,
            (Course::Lasts, true) => Course::Lasts,
            (Course::Awaited | Course::Lasts, _) if self.time_s <= BEGINS_S => {
                if rested {
                    Course::Lasts
                } else {
                    Course::Awaited
                }
            }
            _ => Course::Over,
        };
        self.course == Course::Lasts
    }
}

impl Flow<'_> {
    /// At the end of a block: the first rest corrects the gyros while it lasts.
    pub(super) fn correct_at_rest(&mut self, block_s: f32) {
        let rest = self.learning.answer().and_then(|answer| answer.rest);
        let aligns = self.session.alignment.is_some();
        let first = &mut self.session.first_rest;
        if !first.takes(block_s, rest.is_some(), aligns) {
            return;
        }
        let Some(rest) = rest else { return };
        let [output, _] = self.corrector.network_output();
        let before = first.added;
        for (i, added) in first.added.iter_mut().enumerate() {
            let more = rest.gyro[i] - (output[i] - before[i]);
            *added = if more.abs() > rest.doubt { more } else { 0.0 };
        }
        if before != first.added {
            self.add_at_rest(before);
        }
    }

    /// What the first rest has shown comes into force; `before` was in force already.
    fn add_at_rest(&mut self, before: [f32; 3]) {
        let added = self.session.first_rest.added;
        let nets = more(&self.config.nets, added);
        let [mut gyro, _] = self.corrector.network_output();
        for (i, gyro) in gyro.iter_mut().enumerate() {
            *gyro += added[i] - before[i];
        }
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            compensator.exchange_gyro(state, nets, gyro);
            self.session.learner_nets = true;
        }
    }

    /// The compensator has the stored networks again, and gets what the first rest has added.
    pub(super) fn restore_at_rest(&mut self) {
        let added = self.session.first_rest.added;
        let nets = more(&self.config.nets, added);
        if let Some(Correction { compensator, state }) = self.corrector.correction.get_mut() {
            compensator.exchange(state, nets, state.nets());
            self.session.learner_nets = true;
        }
    }
}

/// These networks, with this added to the gyros' output, rad/s.
fn more(nets: &Nets, added: [f32; 3]) -> Nets {
    let mut nets = *nets;
    let scale = nets.gyro.normalisation.output_scale;
    let [.., last] = &mut nets.gyro.weights.layers;
    for ((bias, scale), added) in last.b.iter_mut().zip(scale).zip(added) {
        if scale != 0.0 {
            *bias += added / scale;
        }
    }
    nets
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(rests: impl IntoIterator<Item = bool>) -> std::vec::Vec<bool> {
        let mut first = FirstRest::default();
        rests
            .into_iter()
            .map(|rested| first.takes(1.0, rested, false))
            .collect()
    }

    /// A rest counts if it begins in time, and no later one.
    #[test]
    fn a_rest_in_time() {
        let of = |waits: usize, rests: usize| {
            let first = std::iter::repeat_n(false, waits).chain(std::iter::repeat_n(true, rests));
            let later = [false].into_iter().chain(std::iter::repeat_n(true, 9));
            course(first.chain(later))
                .into_iter()
                .filter(|takes| *takes)
                .count()
        };
        assert_eq!(of(2, 40), 40);
        assert_eq!(of(2, 10), 10 + 9);
        assert_eq!(of(29, 5), 5);
        assert_eq!(of(30, 5), 0);
    }

    /// A navigation computer that aligns itself is not disturbed any more.
    #[test]
    fn an_alignment_ends_it() {
        let mut first = FirstRest::default();
        assert!(first.takes(1.0, true, false));
        assert!(!first.takes(1.0, true, true));
        assert!(!first.takes(1.0, true, false));
    }

    #[test]
    fn networks_give_more_by_what_is_added() {
        let mut nets = Nets::NONE;
        nets.gyro.normalisation.output_scale = [2.0, 0.0, 0.5];
        let nets = more(&nets, [1.0, 1.0, 1.0]);
        assert_eq!(nets.gyro.weights.layers[2].b, [0.5, 0.0, 2.0]);
        assert_eq!(nets.accel, Nets::NONE.accel);
    }
}
