//! What is remembered of a unit over power-off.
//!
//! Two hypotheses of the bank divide what they learn into what the unit is and what this turn-on is
//! ([`super::bank::REMEMBERING`]). The first part is stored, with its covariance, and is their
//! prior in the next drive. Of the second part the scatter is stored: how much of a bias is new at
//! every turn-on. A datasheet tells it seldom; the learner finds it.
//!
//! Little-endian bytes:
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 2 | version of this layout, 1 |
//! | 2 | 2 | drives that have taught something |
//! | 4 | 4 | seconds of navigation beside fixes in them, f32 |
//! | 8 | 8 | lowest and highest temperature of these seconds, degrees C, two f32 |
//! | 16 | 8 | second moments of turn-on biases: gyros, accelerometers, two f32 |
//! | 24 | 4 | number of moments in each sum, f32 |
//! | 28 | 4 | evidence of the hypothesis `driven` against `biases`, f32 |
//! | 32 | 4 | CRC-32 of the networks' hidden layers and scales, to which the values belong |
//! | 36 | 108 | `biases`: 6 means, lower triangle of their covariance, f32 |
//! | 144 | 1296 | `driven`: 24 means, lower triangle of their covariance, f32 |
//!
//! A sum of moments is in squares of the datasheet's bias.

use super::MEMORY_LEN;
use super::bank::{Bank, DRIVEN, REMEMBERED, SIX_BIASES};
use super::prior::{Datasheet, LearnerNet};
use crate::wire::checksum::Zlib;
use crate::wire::field::take;

const VERSION: u16 = 1;
const HEAD: usize = 36;
const VALUES: usize = REMEMBERED[0] + REMEMBERED[1];
/// Length of the bytes.
pub const LEN: usize = HEAD + 4 * VALUES;
const _: () = assert!(LEN <= MEMORY_LEN);

/// The datasheet's scatter of the turn-on counts as so many moments: two drives.
const TOLD: f32 = 6.0;
/// Scatter of the turn-on at least and at most, as a share of the bias.
const SCATTER: [f32; 2] = [0.01, 0.9];
/// A fleet's scatter of the turn-on counts as so many moments: ten drives.
const MOMENTS: f32 = 30.0;
/// By how much each variance grows from drive to drive, as a share of its prior: sensors age, and a
/// unit that never changed would never be learnt anew. (Assumed: a hundredth of the bias in a
/// drive.)
const AGES: f32 = 1e-4;
/// Evidence of earlier drives that counts in the next, at most.
const EVIDENCE: f32 = 20.0;

/// How the units of a type differ, and the turn-ons of each, in units of the networks' output
/// scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Standard deviation over units of the output layer's three columns, > 0.
    pub columns: [f32; 3],
    /// The same of its biases, > 0.
    pub bias: f32,
    /// Standard deviation of a bias that is new at each turn-on, > 0.
    pub turn_on: f32,
}

/// What is known of a unit, without the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Head {
    /// Drives that have taught something; 0: nothing is known.
    pub drives: u16,
    /// Seconds of navigation beside fixes in them.
    pub seconds: f32,
    /// Lowest and highest temperature of these seconds, degrees C.
    pub degc: [f32; 2],
    moments: [f32; 2],
    count: f32,
    evidence: f32,
    shape: u32,
}

impl Head {
    /// Nothing is known.
    pub const NEW: Head = Head {
        drives: 0,
        seconds: 0.0,
        degc: [f32::INFINITY, f32::NEG_INFINITY],
        moments: [0.0; 2],
        count: 0.0,
        evidence: 0.0,
        shape: 0,
    };

    /// Scatter of the turn-on, as a share of the datasheet's bias: gyros, accelerometers.
    pub fn turn_on(&self, told: &Datasheet) -> [f32; 2] {
        let [gyro, accel] = self.moments;
        let of = |(sum, told): (f32, f32)| {
            let variance = (TOLD * told * told + sum) / (TOLD + self.count);
            libm::sqrtf(variance).clamp(SCATTER[0], SCATTER[1])
        };
        [(gyro, told.turn_on[0]), (accel, told.turn_on[1])].map(of)
    }
}

/// What is known of a unit.
#[derive(Debug, Clone)]
pub struct Unit {
    /// Counters and scatter.
    pub head: Head,
    values: [f32; VALUES],
}

impl Unit {
    /// Nothing is known.
    pub const NEW: Unit = Unit {
        head: Head::NEW,
        values: [0.0; VALUES],
    };

    /// Reads the bytes of [`Unit::write`] in place. Bytes of another layout, or with values that
    /// cannot be, leave nothing known.
    pub fn read(&mut self, bytes: &[u8]) {
        self.head = Head::NEW;
        let number = |at: usize| f32::from_le_bytes(take(bytes, at));
        let version = u16::from_le_bytes(take(bytes, 0));
        if bytes.len() < LEN || version != VERSION {
            return;
        }
        let head = Head {
            drives: u16::from_le_bytes(take(bytes, 2)),
            seconds: number(4),
            degc: [number(8), number(12)],
            moments: [number(16), number(20)],
            count: number(24),
            evidence: number(28),
            shape: u32::from_le_bytes(take(bytes, 32)),
        };
        for (i, value) in self.values.iter_mut().enumerate() {
            *value = number(HEAD + 4 * i);
        }
        let not_negative = |x: f32| x >= 0.0 && x.is_finite();
        let [gyro, accel] = head.moments;
        let counts = [gyro, accel, head.count, head.seconds];
        if counts.into_iter().all(not_negative) && head.evidence.is_finite() {
            self.head = head;
        }
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
            7 => head.evidence,
            8 => return head.shape.to_le_bytes(),
            _ => self
                .values
                .get(index - HEAD / 4)
                .copied()
                .unwrap_or_default(),
        };
        number.to_le_bytes()
    }

    /// Gives a bank that has begun what is known, if it belongs to networks of this shape.
    pub fn recall(&self, bank: &mut Bank, driven: &[LearnerNet<f32>; 2]) -> bool {
        let known = self.head.count > 0.0 && self.head.shape == shape(driven);
        let evidence = f64::from(self.head.evidence.clamp(-EVIDENCE, EVIDENCE));
        known && bank.recall(&self.values, AGES, evidence)
    }

    /// What a fleet teaches of a unit that has not driven yet: its networks have this shape, and
    /// their output layers and biases this spread.
    pub fn of_type(driven: &[LearnerNet<f32>; 2], sheet: &Datasheet, spread: &[Spread; 2]) -> Unit {
        let mut unit = Unit::NEW;
        let told = [sheet.gyro_bias, sheet.accel_bias];
        let share = |k: usize| {
            let scale = driven[k].normalisation.output_scale[0];
            (scale / told[k], spread[k].turn_on * scale / told[k])
        };
        let [(of_gyro, gyro), (of_accel, accel)] = [share(0), share(1)];
        let count = MOMENTS;
        unit.head = Head {
            moments: [count * gyro * gyro, count * accel * accel],
            count,
            shape: shape(driven),
            ..Head::NEW
        };
        // without the networks, the biases are the datasheet's
        let alone = [1.0 / of_gyro, 1.0 / of_accel];
        let biases = (0..2).flat_map(|k| [alone[k]; 3]);
        let layers = (0..2).flat_map(|k| {
            let [a, b, c] = spread[k].columns;
            let bias = spread[k].bias;
            [a, b, c, a, b, c, a, b, c, bias, bias, bias]
        });
        let (of_biases, of_layers) = unit.values.split_at_mut(REMEMBERED[0]);
        spread_over(of_biases, 6, biases);
        spread_over(of_layers, 24, layers);
        unit
    }

    /// Takes down what a bank knows at the end of a drive, before which `base` was known. Deferred
    /// work must be done. `degc`: the temperatures that the drive has covered.
    pub fn remember(
        &mut self,
        base: &Head,
        bank: &mut Bank,
        sheet: &Datasheet,
        driven: &[LearnerNet<f32>; 2],
        (seconds, degc): (f32, [f32; 2]),
    ) {
        let evidence = bank.score(DRIVEN) - bank.score(SIX_BIASES);
        let evidence = if evidence.is_finite() {
            evidence as f32
        } else {
            0.0
        };
        let of = if evidence > 0.0 { DRIVEN } else { SIX_BIASES };
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
            evidence: evidence.clamp(-EVIDENCE, EVIDENCE),
            shape: shape(driven),
        };
        let mut places = self.values.iter_mut();
        bank.remember(&mut |value| {
            if let Some(place) = places.next() {
                *place = value;
            }
        });
    }
}

/// Means of zero, and independent errors of these standard deviations: in the order of
/// [`Unit::values`].
fn spread_over(values: &mut [f32], count: usize, sigmas: impl Iterator<Item = f32>) {
    values.fill(0.0);
    let covariance = values.get_mut(count..).unwrap_or_default();
    for (i, sigma) in sigmas.enumerate() {
        if let Some(own) = covariance.get_mut(i * (i + 1) / 2 + i) {
            *own = sigma * sigma;
        }
    }
}

/// Checksum of what the values of the output layer belong to: the hidden layers, and the scales.
fn shape(nets: &[LearnerNet<f32>; 2]) -> u32 {
    let mut digest = Zlib::new();
    for net in nets {
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
