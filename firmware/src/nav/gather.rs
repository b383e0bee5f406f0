//! From samples to pieces: exact sums of counts, and beside them in f32 what the sums leave out
//! (coning, sculling, rotation).
//!
//! `phi` is the rotation vector from the piece's start to a sample's start; `d` and `e` are the
//! rotation vector and the velocity of the sample itself, with coning and sculling from three
//! samples (Savage 1998; Ignagni 1998; coefficients as in
//! `host_sim::inertial::sins::Samples::Three`):
//!
//! ```text
//! phi   <- phi + d + phi x d / 2 + (phi x (phi x d) - d x (phi x d)) / 12
//! gamma <- gamma + R(phi) (I + d x / 2 + d x d x / 6) e
//! ```
//!
//! The first line is the Baker-Campbell-Hausdorff series to third order.
//!
//! Both results are stored as differences from the plain sums, so that f32 rounds only second-order
//! terms: 3e-10 rad/sqrt(s) at 100 deg/s and 200 Hz, a thousandth of the angle random walk of a
//! laser gyro.

use super::fixed::{ANGLE, Scale, TIME, VELOCITY, add as sum_of, from_f32, from_f64, to_f64};
use super::solution::LONGEST_S;
use super::vector::{V, V32, add, cross, dot, scale, widen};
use crate::sample::{Counts, Lsb};
use lrnn_nostd::learn::kalman::Maps;

/// A piece ends early when it has turned by this, rad: the series above stay short.
const TURN: f32 = 0.25;
/// Pieces that missing samples may fill together.
const REPEATED: u32 = 10;
/// Largest plausible angle (rad) and change of velocity (m/s) of a sample along an axis: 5700 deg/s
/// and 2000 m/s2 at 200 Hz.
const PLAUSIBLE: [f32; 2] = [0.5, 10.0];
/// Bounds of the sums of a piece, rad and m/s; larger ones are in no navigator's range.
const MOST: [f64; 2] = [2.0, 16_000.0];

/// Increments of one sample in f32, less the sensors' estimated errors.
#[derive(Debug, Clone, Copy, Default)]
struct Increment {
    angle: V32,
    velocity: V32,
}

/// Corrected rotation vector and change of velocity of a whole piece, in the axes the body had at
/// its start, fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Piece {
    /// Rotation vector, rad.
    pub phi: [i64; 3],
    /// Integral of specific force, m/s.
    pub velocity: [i64; 3],
    /// Duration, s.
    pub time: i64,
}

impl Piece {
    /// Rotation vector, rad.
    pub fn phi(&self) -> V {
        self.phi.map(|x| to_f64(x, ANGLE))
    }

    /// Integral of specific force, m/s.
    pub fn velocity(&self) -> V {
        self.velocity.map(|x| to_f64(x, VELOCITY))
    }

    /// Duration, s.
    pub fn time(&self) -> f64 {
        to_f64(self.time, TIME)
    }
}

/// Accumulates the samples of a piece.
#[derive(Debug, Clone)]
pub struct Gather {
    worth: [Scale; 2],
    sample_s: f64,
    sample: i64,
    piece_samples: u16,
    // most samples of a piece that repeats one
    longest: u16,
    lsb32: [f32; 2],
    // estimated errors of the sensors per sample, rad and m/s
    in_sample: [V32; 2],
    exact: [[i64; 3]; 2],
    // errors in proportion, axis by cause
    maps: Maps<f32>,
    sum: [[i64; 3]; 2],
    samples: u16,
    phi: V32,
    beyond_angle: V32,
    beyond_velocity: V32,
    past: [Increment; 2],
    last: Counts,
}

impl Gather {
    pub fn new(lsb: Lsb, sample_s: f64, piece_samples: u16) -> Self {
        let longest = (LONGEST_S / sample_s) as u16; // `as` saturates
        Self {
            worth: [
                Scale::new(lsb.rad, ANGLE, MOST[0]),
                Scale::new(lsb.mps, VELOCITY, MOST[1]),
            ],
            sample_s,
            sample: from_f64(sample_s, TIME),
            piece_samples: piece_samples.min(longest),
            longest,
            lsb32: [lsb.rad as f32, lsb.mps as f32],
            in_sample: [[0.0; 3]; 2],
            exact: [[0; 3]; 2],
            maps: [[[0.0; 3]; 3]; 2],
            sum: [[0; 3]; 2],
            samples: 0,
            phi: [0.0; 3],
            beyond_angle: [0.0; 3],
            beyond_velocity: [0.0; 3],
            past: [Increment::default(); 2],
            last: Counts::default(),
        }
    }

    /// [`Self::set_estimate`], and errors in proportion to the samples. These are taken off the
    /// sums of a piece: coning and sculling are small enough without.
    pub fn set_correction(&mut self, estimate: [V32; 2], maps: Maps<f32>) {
        self.set_estimate(estimate);
        self.maps = maps;
    }

    /// Errors of the sensors from the next piece on, rad/s and m/s2. The caller ends the piece in
    /// progress first.
    pub fn set_estimate(&mut self, estimate: [V32; 2]) {
        self.in_sample = estimate.map(|e| scale(e, self.sample_s as f32));
        let [gyro, accel] = estimate.map(|e| widen(e).map(|x| x * self.sample_s));
        self.exact = [
            gyro.map(|x| from_f64(x, ANGLE)),
            accel.map(|x| from_f64(x, VELOCITY)),
        ];
    }

    /// Whether no sample has come since the last piece ended.
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Takes a sample. An implausible one is replaced by the last good one; the result is then
    /// false.
    pub fn sample(&mut self, counts: &Counts) -> bool {
        let [angle, velocity] = self.increments(counts);
        let within = |v: &V32, limit: f32| v.iter().all(|x| x.abs() <= limit);
        let good = within(&angle, PLAUSIBLE[0]) && within(&velocity, PLAUSIBLE[1]);
        if good {
            self.last = *counts;
            self.add(counts, Increment { angle, velocity });
        } else {
            let counts = self.last;
            let [angle, velocity] = self.increments(&counts);
            self.add(&counts, Increment { angle, velocity });
        }
        good
    }

    /// Takes the same sample at most `samples` times and returns how often: to the end of the
    /// piece, or of another [`REPEATED`] times its length, when it is long. The rotation within
    /// them is to the first order only.
    pub fn repeat(&mut self, counts: &Counts, samples: u32) -> u32 {
        if samples <= u32::from(self.piece_samples) || !self.is_empty() {
            return u32::from(self.sample(counts));
        }
        let [angle, velocity] = self.increments(counts);
        let turn = libm::sqrtf(dot(angle, angle));
        let most = u32::from(self.piece_samples).saturating_mul(REPEATED);
        let most = most.min(u32::from(self.longest));
        // `as` saturates
        let times = samples.min(most).min((TURN / turn.max(1e-9)) as u32).max(1);
        let n = times as f32;
        for (sum, counts) in self.sum.iter_mut().zip([&counts.dtheta, &counts.dv]) {
            for (sum, count) in sum.iter_mut().zip(counts) {
                *sum += i64::from(*count) * i64::from(times);
            }
        }
        self.samples = u16::try_from(times).unwrap_or(u16::MAX);
        self.beyond_velocity = scale(cross(angle, velocity), 0.5 * n * n);
        self.phi = scale(angle, n);
        self.past = [Increment { angle, velocity }; 2];
        times
    }

    fn increments(&self, counts: &Counts) -> [V32; 2] {
        let of = |counts: &[i32; 3], lsb: f32, error: &V32| -> V32 {
            [
                counts[0] as f32 * lsb - error[0],
                counts[1] as f32 * lsb - error[1],
                counts[2] as f32 * lsb - error[2],
            ]
        };
        [
            of(&counts.dtheta, self.lsb32[0], &self.in_sample[0]),
            of(&counts.dv, self.lsb32[1], &self.in_sample[1]),
        ]
    }

    fn add(&mut self, counts: &Counts, sample: Increment) {
        for (sum, counts) in self.sum.iter_mut().zip([&counts.dtheta, &counts.dv]) {
            for (sum, count) in sum.iter_mut().zip(counts) {
                *sum += i64::from(*count);
            }
        }
        self.samples += 1;

        let (coning, sculling) = three_samples(&self.past, &sample);
        self.past = [sample, self.past[0]];
        let d = add(sample.angle, coning);
        let e = add(sample.velocity, sculling);

        let in_sample = cross(d, e);
        let in_sample_2 = cross(d, in_sample);
        let within = add(scale(in_sample, 0.5), scale(in_sample_2, 1.0 / 6.0));
        let e = add(e, within);
        let phi = self.phi;
        let n2 = dot(phi, phi);
        let turned = cross(phi, e);
        let turned_2 = cross(phi, turned);
        let sine = 1.0 - n2 * (1.0 / 6.0) * (1.0 - n2 * (1.0 / 20.0));
        let cosine = 0.5 - n2 * (1.0 / 24.0) * (1.0 - n2 * (1.0 / 30.0));
        let small = add(sculling, within);
        let turn = add(scale(turned, sine), scale(turned_2, cosine));
        self.beyond_velocity = add(self.beyond_velocity, add(small, turn));

        let once = cross(phi, d);
        let twice = add(cross(phi, once), cross(once, d));
        let beyond = add(scale(once, 0.5), scale(twice, 1.0 / 12.0));
        let beyond = add(coning, beyond);
        self.beyond_angle = add(self.beyond_angle, beyond);
        self.phi = add(phi, add(sample.angle, beyond));
    }

    /// Whether the piece must end now.
    pub fn is_full(&self) -> bool {
        self.samples >= self.piece_samples || dot(self.phi, self.phi) > TURN * TURN
    }

    /// The piece so far; the next sample begins another one.
    pub fn end(&mut self) -> Piece {
        let samples = i64::from(self.samples);
        let [angle, velocity] = self.sum;
        let [gyro, accel] = self.exact;
        let [of_angle, of_velocity] = &self.worth;
        // counts, less the estimated errors, and what the sums leave out
        let corrected = |sums: [i64; 3], of: &Scale, errors: [i64; 3], beyond: [i64; 3]| {
            let less = errors.map(|error| -error * samples);
            sum_of(sums.map(|sum| of.of(sum)), sum_of(less, beyond))
        };
        let [of_angles, of_velocities] = &self.maps;
        let proportional = |map: &[V32; 3], sums: [i64; 3], lsb: f32| {
            let felt = sums.map(|sum| sum as f32 * lsb);
            map.map(|row| -dot(row, felt))
        };
        if self.maps != [[[0.0; 3]; 3]; 2] {
            let [of_angle, of_velocity] = self.lsb32;
            let (turn, gain) = (
                proportional(of_angles, angle, of_angle),
                proportional(of_velocities, velocity, of_velocity),
            );
            self.beyond_angle = add(self.beyond_angle, turn);
            self.beyond_velocity = add(self.beyond_velocity, gain);
        }
        let beyond = self.beyond_angle.map(|x| from_f32(x, ANGLE));
        let phi = corrected(angle, of_angle, gyro, beyond);
        let beyond = self.beyond_velocity.map(|x| from_f32(x, VELOCITY));
        let piece = Piece {
            phi,
            velocity: corrected(velocity, of_velocity, accel, beyond),
            time: self.sample * samples,
        };
        self.sum = [[0; 3]; 2];
        self.samples = 0;
        self.phi = [0.0; 3];
        self.beyond_angle = [0.0; 3];
        self.beyond_velocity = [0.0; 3];
        piece
    }
}

/// Coning (rad) and sculling (m/s) of the newest sample with the two before it.
fn three_samples([b, a]: &[Increment; 2], sample: &Increment) -> (V32, V32) {
    let earlier = |b: V32, a: V32| add(scale(b, 17.0 / 120.0), scale(a, -1.0 / 60.0));
    let (angle, velocity) = (earlier(b.angle, a.angle), earlier(b.velocity, a.velocity));
    let coning = cross(angle, sample.angle);
    let sculling = add(cross(angle, sample.velocity), cross(velocity, sample.angle));
    let coning_ab = cross(a.angle, b.angle);
    let sculling_ab = add(cross(a.angle, b.velocity), cross(a.velocity, b.angle));
    (
        add(coning, scale(coning_ab, -1.0 / 40.0)),
        add(sculling, scale(sculling_ab, -1.0 / 40.0)),
    )
}
