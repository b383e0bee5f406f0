//! Memory of a unit over power-off.
//!
//! Some hypotheses of the bank divide what they learn into what the unit is and what this turn-on
//! is ([`super::bank::REMEMBERING`]). The first part is stored, with its covariance, and is their
//! prior in the next drive. Of the second part the scatter is stored: how much of a bias is new at
//! every turn-on. A datasheet seldom states it; the learner finds it.
//!
//! Little-endian bytes:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 2 | version of this layout, 4 |
//! | 2 | 2 | drives that have taught something |
//! | 4 | 4 | seconds of navigation beside fixes in them, f32 |
//! | 8 | 8 | lowest and highest temperature of these seconds, degrees C, two f32 |
//! | 16 | 8 | second moments of turn-on biases: gyros, accelerometers, two f32 |
//! | 24 | 4 | number of moments in each sum, f32 |
//! | 28 | 8 | evidence of the hypotheses `driven` and `curved` against `biases`, two f32 |
//! | 36 | 4 | CRC-32 of the networks' hidden layers and scales, to which the values belong |
//! | 40 | 12 | how wrong memory of `biases`, `driven` and `curved` was at power-on, three f32 |
//! | 52 | 48 | what `biases`, `driven`, `curved` and `map` have won in bets ([`Carried`]), u8 |
//! | 100 | 4 | 1 where this memory has been found harmful at a power-on, else 0 |
//! | 104 | 4 | evidence of the hypothesis `map` against `biases`, f32 |
//! | 108 | 72 | `biases`: 6 means, covariances, f32 |
//! | 180 | 720 | `driven`: 24 means, covariances, f32 |
//! | 900 | 720 | `curved`: the same |
//! | 1620 | 720 | `map`: the same |
//!
//! The means are those of the gyros, then of the accelerometers; those of `map` are nine elements,
//! row by row, and three biases. Covariances are the lower triangles of the gyros' and of the
//! accelerometers' means. A sum of moments is in squares of the datasheet's bias. Version 3 has no
//! `map`, and the lower triangle of the covariance of all means.

use super::MEMORY_LEN;
use super::bank::{Bank, MAP, REMEMBERED, REMEMBERING, SIX_BIASES, STEP, STEPPED, STORED};
use super::prior::{Datasheet, Shapes};
use super::rehearsal::{Carried, Rehearsal, UNTRIED};
use crate::wire::checksum::Zlib;
use crate::wire::field::take;

/// Version of this layout.
pub const VERSION: u16 = 4;
/// The version before, which is read as well.
const OLDER: u16 = 3;
/// Bytes before the bets, of the bets, and of all before the values.
const START: usize = 52;
const BETS: usize = 4 * size_of::<Carried>();
const HEAD: usize = START + BETS + 8;
const VALUES: usize = REMEMBERED[0] + REMEMBERED[1] + REMEMBERED[2] + REMEMBERED[3];
/// Length of the bytes.
pub const LEN: usize = HEAD + 4 * VALUES;
const _: () = assert!(LEN <= MEMORY_LEN);

/// Weight of the datasheet's scatter of the turn-on, in moments: one drive.
const DATASHEET_MOMENTS: f32 = 3.0;
/// Scatter of the turn-on at least and at most, as a share of the bias.
const SCATTER: [f32; 2] = [0.01, 0.9];
/// Growth of each variance from drive to drive, as a share of its prior: sensors age, and a unit
/// whose variances never grew would never be learnt again. A fiftieth of the bias in a drive
/// predicts best over the sessions of five consumer units.
const AGES: f32 = 4e-4;
/// Largest lead of the best hypothesis over another one in the next drive, by the evidence of
/// earlier ones.
const EVIDENCE: f32 = 20.0;

/// Memory of a unit, without the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Drives that have taught something; 0: nothing is known.
    pub drives: u16,
    /// Seconds of navigation beside fixes in them.
    pub seconds: f32,
    /// Lowest and highest temperature of these seconds, degrees C.
    pub degc: [f32; 2],
    moments: [f32; 2],
    pub(super) count: f32,
    /// Evidence of `driven`, `curved` and `map` against `biases`.
    evidence: [f32; 3],
    shape: u32,
    /// How wrong what was known of biases, `driven` and `curved` was at the power-ons before, in
    /// squares of the datasheet's bias; zeros: not known. The last drives count most.
    pub judged: [f32; 3],
    /// What each of [`REMEMBERING`] has won in bets.
    carried: [Carried; 4],
    /// What was remembered did harm at a power-on: it does not act again before a drive has shown
    /// that it is better than nothing.
    pub refuted: bool,
}

impl Head {
    /// An empty memory.
    pub const NEW: Head = Head {
        drives: 0,
        seconds: 0.0,
        degc: [f32::INFINITY, f32::NEG_INFINITY],
        moments: [0.0; 2],
        count: 0.0,
        evidence: [0.0; 3],
        shape: 0,
        judged: [0.0; 3],
        carried: [UNTRIED; 4],
        refuted: false,
    };

    /// Scatter of the turn-on, as a share of the datasheet's bias: gyros, accelerometers.
    pub fn turn_on(&self, sheet: &Datasheet) -> [f32; 2] {
        let [gyro, accel] = self.moments;
        let of = |(sum, stated): (f32, f32)| {
            let variance =
                (DATASHEET_MOMENTS * stated * stated + sum) / (DATASHEET_MOMENTS + self.count);
            libm::sqrtf(variance).clamp(SCATTER[0], SCATTER[1])
        };
        [(gyro, sheet.turn_on[0]), (accel, sheet.turn_on[1])].map(of)
    }
}

/// Memory of a unit.
#[derive(Debug, Clone)]
pub struct Unit {
    /// Counters and scatter.
    pub head: Head,
    /// The values have those of `map`.
    has_map: bool,
    values: [f32; VALUES],
}

impl Unit {
    /// An empty memory.
    pub const NEW: Unit = Unit {
        head: Head::NEW,
        has_map: false,
        values: [0.0; VALUES],
    };

    /// Reads the bytes of [`Unit::write`] in place. Bytes of another layout, or with values that
    /// cannot be, leave nothing known.
    pub fn read(&mut self, bytes: &[u8]) {
        self.head = Head::NEW;
        let number = |at: usize| f32::from_le_bytes(take(bytes, at));
        let layout = match u16::from_le_bytes(take(bytes, 0)) {
            VERSION => Layout::NOW,
            OLDER => Layout::OLDER,
            _ => return,
        };
        if bytes.len() < layout.len {
            return;
        }
        let mut carried = [UNTRIED; 4];
        let won = take::<BETS>(bytes, START);
        let places = carried.as_flattened_mut().as_flattened_mut();
        for (place, byte) in places.iter_mut().zip(won).take(layout.bets) {
            *place = byte;
        }
        let of_map = if layout.has_map {
            number(HEAD - 4)
        } else {
            0.0
        };
        let head = Head {
            drives: u16::from_le_bytes(take(bytes, 2)),
            seconds: number(4),
            degc: [number(8), number(12)],
            moments: [number(16), number(20)],
            count: number(24),
            evidence: [number(28), number(32), of_map],
            shape: u32::from_le_bytes(take(bytes, 36)),
            judged: [number(40), number(44), number(48)],
            carried,
            refuted: u32::from_le_bytes(take(bytes, layout.refuted)) != 0,
        };
        self.has_map = layout.has_map;
        let mut at = layout.values;
        let mut values = self.values.iter_mut();
        let count = if layout.has_map { 4 } else { 3 };
        for of_unit in OF_UNIT.into_iter().take(count) {
            let means = (0..of_unit).map(|_| true);
            for used in means.chain(covariances(of_unit, layout.has_map)) {
                if used && let Some(value) = values.next() {
                    *value = number(at);
                }
                at += 4;
            }
        }
        values.for_each(|value| *value = 0.0);
        let not_negative = |x: f32| x >= 0.0 && x.is_finite();
        let [gyro, accel] = head.moments;
        let counts = [gyro, accel, head.count, head.seconds];
        let mut counts = counts.into_iter().chain(head.judged);
        if counts.all(not_negative) && head.evidence.iter().all(|e| e.is_finite()) {
            self.head = head;
        }
    }

    /// The values that [`Bank::recall`] takes.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Copies the bytes from `start` on into `piece`.
    pub fn write(&self, start: usize, piece: &mut [u8]) {
        for (place, byte) in piece.iter_mut().enumerate() {
            let at = start + place;
            if let Some(of) = self.word(at / 4).get(at % 4)
                && at < LEN
            {
                *byte = *of;
            }
        }
    }

    /// Four bytes of the layout.
    fn word(&self, index: usize) -> [u8; 4] {
        let head = &self.head;
        let number = match index {
            0 => {
                let ([a, b], [c, d]) = (VERSION.to_le_bytes(), head.drives.to_le_bytes());
                return [a, b, c, d];
            }
            1 => head.seconds,
            2 => head.degc[0],
            3 => head.degc[1],
            4 => head.moments[0],
            5 => head.moments[1],
            6 => head.count,
            7 => head.evidence[0],
            8 => head.evidence[1],
            9 => return head.shape.to_le_bytes(),
            10 => head.judged[0],
            11 => head.judged[1],
            12 => head.judged[2],
            _ if index < (START + BETS) / 4 => {
                let bets = head.carried.as_flattened().as_flattened();
                return take(bets, 4 * index - START);
            }
            _ if index == HEAD / 4 - 2 => return u32::from(head.refuted).to_le_bytes(),
            _ if index == HEAD / 4 - 1 => head.evidence[2],
            _ => self
                .values
                .get(index - HEAD / 4)
                .copied()
                .unwrap_or_default(),
        };
        number.to_le_bytes()
    }

    /// Gives a bank that has begun what is known, if it belongs to networks of this shape.
    pub fn recall(&self, bank: &mut Bank, shapes: &Shapes) -> bool {
        let known = self.head.count > 0.0 && self.head.shape == digest(shapes);
        let evidence = self.head.evidence.map(|e| within(e.into()).into());
        known && bank.recall(&self.values, AGES, evidence, self.has_map)
    }

    /// The biases of the unit, in units of the networks' output scale: gyros, accelerometers.
    pub fn biases(&self) -> [[f32; 3]; 2] {
        let [a, b, c, d, e, f, ..] = self.values;
        [[a, b, c], [d, e, f]]
    }

    /// Gives rehearsals that have begun what was won in earlier drives.
    pub fn carry(&self, rehearsal: &mut Rehearsal) {
        let [biases, ..] = &self.head.carried;
        let of = REMEMBERING.into_iter().zip(&self.head.carried);
        for (hypothesis, carried) in of.chain([(STEPPED, biases)]) {
            rehearsal.carry(hypothesis, carried);
        }
    }

    /// Takes down what a bank knows at the end of a drive, before which `base` was known. Deferred
    /// work must be done. `degc`: the temperatures that the drive has covered.
    pub fn remember(
        &mut self,
        base: &Head,
        (bank, rehearsal): (&mut Bank, &Rehearsal),
        sheet: &Datasheet,
        shapes: &Shapes,
        (seconds, degc): (f32, [f32; 2]),
        judged: [f32; 3],
    ) {
        let remembering = bank.remembering();
        let scores = remembering.map(|of| bank.score(of));
        let best = (scores.iter()).fold(f64::NEG_INFINITY, |best, score| best.max(*score));
        let behind = scores.map(|score| within(score - best));
        let [biases, driven, curved, map] = behind;
        let of = remembering.into_iter().zip(behind);
        let (of, _) = of.fold((SIX_BIASES, biases), |best, other| {
            if other.1 > best.1 { other } else { best }
        });
        let moments = bank.turn_on_moments(of);
        let (gyro, accel) = moments.split_at(3);
        let [gyro, accel] = [(gyro, sheet.gyro_bias), (accel, sheet.accel_bias)]
            .map(|(new, bias)| new.iter().sum::<f32>() / (bias * bias));
        self.head = Head {
            drives: base.drives.saturating_add(1),
            seconds: base.seconds + seconds,
            degc: [base.degc[0].min(degc[0]), base.degc[1].max(degc[1])],
            moments: [base.moments[0] + gyro, base.moments[1] + accel],
            count: base.count + 3.0,
            evidence: [driven, curved, map].map(|of| of - biases),
            shape: digest(shapes),
            judged,
            carried: remembering.map(|of| rehearsal.carried(of)),
            refuted: rehearsal.refutes(bank.takes_part(STORED), base.refuted),
        };
        self.has_map = true;
        let mut places = self.values.iter_mut();
        bank.remember(&mut |value| {
            if let Some(place) = places.next() {
                *place = value;
            }
        });
        if bank.biases() == STEPPED {
            self.loosen();
        }
    }

    /// The biases have stepped. The networks' hypotheses did not expect it: in the next drive their
    /// biases are open again.
    fn loosen(&mut self) {
        let (_, layers) = self.values.split_at_mut(REMEMBERED[0]);
        for layer in layers.chunks_mut(REMEMBERED[1]) {
            let covariances = layer.get_mut(24..).unwrap_or_default();
            for of_triad in covariances.chunks_mut(78) {
                // nine weights or elements, three biases
                for i in [9, 10, 11] {
                    if let Some(own) = of_triad.get_mut(i * (i + 1) / 2 + i) {
                        *own += (STEP * STEP) as f32;
                    }
                }
            }
        }
    }
}

const _: () = assert!(REMEMBERING[3] == MAP);

/// Means of each of [`REMEMBERING`].
const OF_UNIT: [usize; 4] = [6, 24, 24, 24];

/// Stored covariances of so many means, and whether each is used: those within a triad. `new`: no
/// others are stored.
fn covariances(of_unit: usize, new: bool) -> impl Iterator<Item = bool> {
    let half = of_unit / 2;
    let pairs = (0..of_unit).flat_map(|i| (0..=i).map(move |j| (i, j)));
    pairs
        .map(move |(i, j)| (i < half) == (j < half))
        .filter(move |used| !new || *used)
}

/// Offsets of the parts of a record, and its length.
struct Layout {
    has_map: bool,
    /// Bytes of bets.
    bets: usize,
    refuted: usize,
    values: usize,
    len: usize,
}

impl Layout {
    const NOW: Layout = Layout {
        has_map: true,
        bets: BETS,
        refuted: HEAD - 8,
        values: HEAD,
        len: LEN,
    };
    /// Version 3.
    const OLDER: Layout = Layout {
        has_map: false,
        bets: 3 * size_of::<Carried>(),
        refuted: START + 3 * size_of::<Carried>(),
        values: START + 3 * size_of::<Carried>() + 4,
        len: 2792,
    };
}

/// Evidence that counts in the next drive.
fn within(evidence: f64) -> f32 {
    if evidence.is_nan() {
        0.0
    } else {
        (evidence as f32).clamp(-EVIDENCE, EVIDENCE)
    }
}

/// Checksum of what the values of the output layers belong to: the hidden layers, and the scales.
fn digest(shapes: &Shapes) -> u32 {
    let mut digest = Zlib::new();
    for net in shapes.iter() {
        let scales = &net.normalisation;
        let all = [scales.input_offset, scales.input_scale, scales.output_scale];
        let hidden = net.weights.iter().take(HIDDEN);
        for value in all.into_iter().flatten().chain(hidden) {
            digest.add(&value.to_le_bytes());
        }
    }
    digest.value()
}

/// Weights of the hidden layers.
const HIDDEN: usize = 2 * lrnn_nostd::PARAMS_PER_LAYER;

#[cfg(test)]
mod tests;
