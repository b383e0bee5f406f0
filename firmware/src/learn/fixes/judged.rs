//! Which hypothesis' memory would have been best without fixes.
//!
//! What is remembered of a unit acts from power-on, before any fix. Evidence does not show which
//! hypothesis is best at that: it is earned while each of them learns from the same drive, and
//! there a law that is fitted again in every drive wins over a constant, even if it never repeats.
//! So in each drive the learner compares what biases and networks ([`JUDGED`]) knew at power-on
//! with what the best of all hypotheses knows now. The mean square of the difference, in units of
//! the datasheet's bias, is stored for the next drives. A map counts as the biases: it is a
//! constant as well.

use crate::learn::bank::{Bank, CURVED, DRIVEN, REMEMBERED, SIX_BIASES, ZERO_CORRECTION};
use crate::learn::prior::{Datasheet, Shapes};

/// The first blocks do not count, in which the best hypothesis knows little more than at power-on:
/// five minutes at the usual second.
const SKIPPED: u32 = 300;
/// Least number for a judgement.
const LEAST: u32 = 300;
/// Weight of the judgement of a drive after the next one: memory gets better from drive to drive
/// (assumed).
const STAYS: f32 = 0.8;
/// A hypothesis whose memory was less wrong by this factor takes the place of the one with the
/// greatest evidence: less is chance (assumed).
pub(super) const BETTER: f32 = 0.85;
/// Number of drives before the present one that it takes: memory before the second was of one drive
/// only.
pub(super) const DRIVES: u16 = 2;

/// The hypotheses whose memory is judged.
const JUDGED: [usize; 3] = [SIX_BIASES, DRIVEN, CURVED];

/// Means of the output layers of the hypotheses that remember.
const MEANS: usize = 6 + 2 * OF_LAYER;
const OF_LAYER: usize = 24;

/// The judgement of one drive.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    /// Before this drive, as [`crate::learn::unit::Head::judged`].
    before: [f32; 3],
    /// Means of the memory at power-on; `None`: there was none.
    known: Option<[f32; MEANS]>,
    squares: [f32; 3],
    blocks: u32,
}

impl Judged {
    pub const NONE: Judged = Judged {
        before: [0.0; 3],
        known: None,
        squares: [0.0; 3],
        blocks: 0,
    };

    /// A drive begins before which `values` were known, in the order of
    /// [`Bank::remember`].
    pub fn begin(&mut self, before: [f32; 3], values: Option<&[f32]>) {
        let [of_biases, of_driven, ..] = REMEMBERED;
        *self = Judged {
            before,
            ..Self::NONE
        };
        let Some(values) = values else { return };
        let mut known = [0.0; MEANS];
        let starts = [
            (0, 6),
            (of_biases, OF_LAYER),
            (of_biases + of_driven, OF_LAYER),
        ];
        let all = starts
            .into_iter()
            .flat_map(|(start, len)| values.iter().skip(start).take(len));
        for (place, value) in known.iter_mut().zip(all) {
            *place = *value;
        }
        self.known = Some(known);
    }

    /// A block of navigation beside fixes.
    pub fn block(&mut self, bank: &Bank, shapes: &Shapes, sheet: &Datasheet) {
        let Some(known) = &self.known else { return };
        if bank.leading() == ZERO_CORRECTION {
            return;
        }
        self.blocks = self.blocks.saturating_add(1);
        if self.blocks <= SKIPPED {
            return;
        }
        let now = bank.estimate();
        let (constant, layers) = known.split_at(6);
        let mut of = [constant; 3];
        for (own, layer) in of.iter_mut().skip(1).zip(layers.chunks_exact(OF_LAYER)) {
            *own = layer;
        }
        let nets = [&shapes.driven, &shapes.driven, &shapes.curved];
        for (((known, nets), index), sum) in
            of.into_iter().zip(nets).zip(JUDGED).zip(&mut self.squares)
        {
            let states = bank.states_of(index);
            let mut square = 0.0;
            let Some((gyros, accels)) = known.split_at_checked(known.len() / 2) else {
                continue;
            };
            let triads = [gyros, accels].into_iter().zip(nets).zip(&states);
            let sheets = [sheet.gyro_bias, sheet.accel_bias];
            for ((((own, net), state), now), bias) in triads.zip(now.chunks_exact(3)).zip(sheets) {
                let [_, hidden, _] = state.layers();
                let Some((w, b)) = own.split_last_chunk::<3>() else {
                    continue;
                };
                let scale = net.normalisation.output_scale;
                for (j, ((b, now), scale)) in b.iter().zip(now).zip(scale).enumerate() {
                    let row = w.iter().skip(3 * j).zip(hidden);
                    let said = row.fold(*b, |sum, (w, y)| sum + w * y) * scale;
                    let off = (said - now) / bias;
                    square += off * off;
                }
            }
            if square.is_finite() {
                *sum += square;
            }
        }
    }

    /// Judgement with this drive: smaller is better; zeros before there is any.
    pub fn so_far(&self) -> [f32; 3] {
        if self.blocks < SKIPPED + LEAST {
            return self.before;
        }
        let blocks = (self.blocks - SKIPPED) as f32;
        core::array::from_fn(|h| match (self.before.get(h), self.squares.get(h)) {
            (Some(before), Some(square)) => STAYS * before + square / blocks,
            _ => 0.0,
        })
    }
}
