//! Errors of one triad that follow the temperature T of each sensor, its history, its age,
//! vibration and turning.
//!
//! ```text
//! hysteresis   p = clamp(p, T - w, T + w)        b = h (T - p) / w      play operator: |b| <= h
//! scale        e = k T x
//! warm-up      b = a (1 - left) exp(-(t / tau)^beta)                    left: of the last time on
//! mode hop     u = T / K + phase - n             b = s u + b_n          n hops when |u| > 0.6
//! ageing       b = sum over days of g z / sqrt(365.25)
//! steps        b = sum over power-ons of s z for one in ten of them
//! softening    b = s / (1 + exp(-(T - T_s) / w_s))
//! thermal lag  dU/dt = (T - U) / tau_U           b = l U / 10 K + q (U / 10 K)^2
//! vibration    b = r v / (v + v_0)                                      v: of the last second
//! self-heating dm/dt = (|rate| - m) / tau_m      b = d m
//! ```
//!
//! The bias b_n of a mode is constant: when the temperature comes back, the bias does, too. The
//! control hops back later than it hopped on, because it holds a mode 0.1 of a mode beyond the
//! middle between two (assumed). U follows T through the time before power-on. The vehicle has
//! stood before power-off for so long that m is zero.

use super::super::draws::normal3;
use super::super::environment::YEAR_DAYS;
use super::super::world::History;
use super::{SLOW_S, WARM_UP_REPEATABILITY};
use crate::inertial::session::Surroundings;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Deflection at which the control hops, modes.
const HOP_AT: f64 = 0.6;
/// Share of the power-ons at which the bias steps.
const STEPPING: f64 = 0.1;
/// Random streams of the unit behind the triad's own.
const AGEING: u64 = 2;
const STEPS: u64 = 5;
/// Random streams of the unit: the first of the modes; each mode has one.
const MODES: u64 = 1 << 32;

/// Numbers of the environment in SI; zero is off.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in super::super) struct Sizes {
    pub hysteresis: f64,
    pub hysteresis_width: f64,  // K
    pub scale_temperature: f64, // per K
    pub warm_up: f64,
    pub warm_up_time: f64,
    pub warm_up_spread: f64,
    pub warm_up_exponent: f64,
    pub mode_bias: f64,
    pub mode_deflection: f64,
    pub mode_width: f64, // K
    pub ageing: f64,     // per sqrt(year)
    pub step: f64,
    pub softening: f64,
    pub softening_centre: f64, // K
    pub softening_width: f64,  // K
    pub lag: f64,              // at 10 K
    pub lag_time: f64,
    pub shaken: f64,
    pub shaken_knee: f64, // (m/s2)^2
    pub turned: f64,      // per rad/s
    pub turned_time: f64,
}

/// Initial conditions of one triad.
pub(in super::super) struct Beginning<'a> {
    /// Seed of the unit, and the triad's stream of it; ageing and steps have others behind it.
    pub unit: (u64, u64),
    /// Random numbers of this turn-on.
    pub turn_on: ChaCha8Rng,
    pub history: History,
    pub age_days: f64,
    pub power_ons: u32,
    /// Turning points of the axes' temperatures before power-on, the last one at power-on, K.
    pub turning_points: &'a [Vector3<f64>],
    /// The temperatures in short steps: time, s before power-on (negative), ascending, the last one
    /// 0. Empty after a long soak.
    pub trail: &'a [(f64, Vector3<f64>)],
}

/// Temperature at which a thermal lag's size is given, K.
const LAG_K: f64 = 10.0;

/// The mode that the path-length control of an axis holds.
#[derive(Debug, Clone, Copy)]
struct Mode {
    number: i32,
    bias: f64,
}

/// Present state of the errors.
#[derive(Debug, Clone)]
pub(super) struct Environment {
    sizes: Sizes,
    hysteresis: Vector3<f64>,
    scale: Vector3<f64>,
    warm_up: Vector3<f64>,
    warm_up_time: Vector3<f64>,
    deflection: Vector3<f64>,
    phase: Vector3<f64>,
    aged: Vector3<f64>,
    play: Vector3<f64>,
    modes: [Mode; 3],
    unit: u64,
    softening: Vector3<f64>,
    /// Linear and quadratic coefficient of the thermal lag.
    lag: [Vector3<f64>; 2],
    /// Temperatures of the inner points, K.
    inner: Vector3<f64>,
    shaken: Vector3<f64>,
    turned: Vector3<f64>,
    /// Smoothed magnitude of the rate, rad/s.
    turning: f64,
    /// Scale factor error of the present second.
    pub scale_now: Vector3<f64>,
}

impl Environment {
    /// The state at power-on. `None` if all errors are off.
    pub fn new(sizes: &Sizes, begin: Beginning<'_>) -> Option<Self> {
        let s = sizes.clone();
        let off = [
            s.hysteresis,
            s.scale_temperature,
            s.warm_up,
            s.mode_bias,
            s.mode_deflection,
            s.ageing,
            s.step,
            s.softening,
            s.lag,
            s.shaken,
            s.turned,
        ];
        if off.iter().all(|x| *x == 0.0) {
            return None;
        }
        let (seed, number) = begin.unit;
        let mut unit = stream(seed, number);
        // all draws in the same order, whichever errors are on
        let hysteresis = normal3(&mut unit) * s.hysteresis;
        let scale = normal3(&mut unit) * s.scale_temperature;
        let warm_up = normal3(&mut unit) * s.warm_up;
        let warm_up_time =
            normal3(&mut unit).map(|z| s.warm_up_time * (s.warm_up_spread * z).exp());
        let deflection = normal3(&mut unit) * s.mode_deflection;
        let phase = Vector3::from_fn(|_, _| unit.random_range(-0.5..0.5));
        let mut turn_on = begin.turn_on;
        let gain = normal3(&mut turn_on).map(|z| 1.0 + WARM_UP_REPEATABILITY * z);
        let left = warm_up_time.map(|time| 1.0 - begin.history.left(time));
        let start = begin.turning_points.last().copied().unwrap_or_default();
        let mut new = Self {
            hysteresis,
            scale,
            warm_up: warm_up.component_mul(&gain).component_mul(&left),
            warm_up_time,
            deflection,
            phase,
            aged: aged(s.ageing, begin.age_days, stream(seed, number + AGEING))
                + stepped(s.step, begin.power_ons, stream(seed, number + STEPS)),
            play: begin.turning_points.first().copied().unwrap_or_default(),
            modes: [Mode {
                number: 0,
                bias: 0.0,
            }; 3],
            unit: seed,
            softening: normal3(&mut unit) * s.softening,
            lag: [(); 2].map(|()| normal3(&mut unit) * s.lag),
            inner: lived(begin.trail, s.lag_time).unwrap_or(start),
            shaken: normal3(&mut unit) * s.shaken,
            turned: normal3(&mut unit) * s.turned,
            turning: 0.0,
            scale_now: Vector3::zeros(),
            sizes: s,
        };
        begin.turning_points.iter().for_each(|t| new.follow(t));
        for axis in 0..3 {
            let number = new.deflected(axis, start[axis]).round() as i32;
            new.modes[axis] = new.mode(axis, number);
        }
        Some(new)
    }

    /// The bias `t` s after power-on.
    pub fn step(&mut self, t: f64, around: &Surroundings) -> Vector3<f64> {
        let axes = &around.axes;
        self.follow(axes);
        if t > 0.0 {
            self.inner = toward(&self.inner, axes, SLOW_S / self.sizes.lag_time);
            let keep = (-SLOW_S / self.sizes.turned_time).exp();
            self.turning = around.turning + (self.turning - around.turning) * keep;
        }
        self.scale_now = self.scale.component_mul(axes);
        let mut bias = self.aged;
        for i in 0..3 {
            let loop_side = (axes[i] - self.play[i]) / self.sizes.hysteresis_width;
            let late = (t / self.warm_up_time[i]).powf(self.sizes.warm_up_exponent);
            bias[i] += self.hysteresis[i] * loop_side + self.warm_up[i] * (-late).exp();
        }
        if self.sizes.mode_bias > 0.0 || self.sizes.mode_deflection > 0.0 {
            bias += self.path_length(axes);
        }
        bias + self.driven(axes, around.vibration)
    }

    /// Softening, thermal lag, vibration and self-heating.
    fn driven(&self, axes: &Vector3<f64>, vibration: f64) -> Vector3<f64> {
        let s = &self.sizes;
        let shaken = vibration / (vibration + s.shaken_knee);
        Vector3::from_fn(|i, _| {
            let above = (axes[i] - s.softening_centre) / s.softening_width;
            let inner = self.inner[i] / LAG_K;
            self.softening[i] / (1.0 + (-above).exp())
                + (self.lag[0][i] + self.lag[1][i] * inner) * inner
                + self.shaken[i] * shaken
                + self.turned[i] * self.turning
        })
    }

    fn follow(&mut self, axes: &Vector3<f64>) {
        let w = self.sizes.hysteresis_width;
        // not clamp(), which panics where a temperature is no number
        self.play = self.play.zip_map(axes, |p, t| p.max(t - w).min(t + w));
    }

    /// Bias of the modes, after the hops that are due.
    fn path_length(&mut self, axes: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let u = self.deflected(i, axes[i]);
            if (u - f64::from(self.modes[i].number)).abs() > HOP_AT {
                self.modes[i] = self.mode(i, u.round() as i32);
            }
            let Mode { number, bias } = self.modes[i];
            self.deflection[i] * (u - f64::from(number)) + bias
        })
    }

    /// Length of the path in modes.
    fn deflected(&self, axis: usize, temperature: f64) -> f64 {
        temperature / self.sizes.mode_width + self.phase[axis]
    }

    /// A mode of an axis, with the bias that belongs to it.
    fn mode(&self, axis: usize, number: i32) -> Mode {
        let mode = u64::from(number as u32);
        let mut rng = stream(self.unit, MODES + mode);
        Mode {
            number,
            bias: normal3(&mut rng)[axis] * self.sizes.mode_bias,
        }
    }
}

/// Value that follows `to` with a first-order lag, after `times` time constants.
fn toward(from: &Vector3<f64>, to: &Vector3<f64>, times: f64) -> Vector3<f64> {
    to + (from - to) * (-times).exp()
}

/// Temperatures of the inner points at power-on. Initially they were those of their surroundings.
fn lived(trail: &[(f64, Vector3<f64>)], time: f64) -> Option<Vector3<f64>> {
    let first = trail.first()?.1;
    let steps = trail.windows(2);
    let pairs = steps.filter_map(|pair| pair.first().zip(pair.last()));
    let follow = |inner: Vector3<f64>, (before, now): (&(f64, Vector3<f64>), &(f64, _))| {
        toward(
            &inner,
            &((before.1 + now.1) / 2.0),
            (now.0 - before.0) / time,
        )
    };
    Some(pairs.fold(first, follow))
}

/// Random walk of so many whole days.
fn aged(per_root_year: f64, days: f64, mut unit: ChaCha8Rng) -> Vector3<f64> {
    let per_day = per_root_year / YEAR_DAYS.sqrt();
    let days = if per_day > 0.0 { days as u32 } else { 0 };
    (0..days).map(|_| normal3(&mut unit) * per_day).sum()
}

/// Sum of the steps at so many power-ons.
fn stepped(size: f64, power_ons: u32, mut unit: ChaCha8Rng) -> Vector3<f64> {
    let power_ons = if size > 0.0 { power_ons } else { 0 };
    let step = |_| {
        let steps = unit.random_bool(STEPPING);
        let step = normal3(&mut unit) * size;
        if steps { step } else { Vector3::zeros() }
    };
    (0..power_ons).map(step).sum()
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

#[cfg(test)]
mod driven_tests;
#[cfg(test)]
mod tests;
