//! Errors of one triad that follow the temperature T of each sensor, its past, and its age.
//!
//! ```text
//! hysteresis   p = clamp(p, T - w, T + w)        b = h (T - p) / w      play operator: |b| <= h
//! scale        e = k T x
//! warm-up      b = a (1 - left) exp(-(t / tau)^beta)                    left: of the last time on
//! mode hop     u = T / K + phase - n             b = s u + b_n          n hops when |u| > 0.6
//! ageing       b = sum over days of g z / sqrt(365.25)
//! ```
//!
//! A mode keeps its bias b_n: when the temperature comes back, the bias does, too. The control hops
//! back later than it hopped on, because it holds a mode 0.1 of a mode beyond the middle between
//! two (assumed).

use super::super::draws::normal3;
use super::super::environment::YEAR_DAYS;
use super::super::world::History;
use super::WARM_UP_REPEATABILITY;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Deflection at which the control hops, modes.
const HOP_AT: f64 = 0.6;
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
}

/// What one triad begins with.
pub(in super::super) struct Beginning<'a> {
    /// Seed of the unit, and the triad's stream of it; the ageing has the next but one.
    pub unit: (u64, u64),
    /// Draws what is new at this turn-on.
    pub turn_on: ChaCha8Rng,
    pub history: History,
    pub age_days: f64,
    /// Temperatures of the axes that the past went through, the last one at power-on, K.
    pub past: &'a [Vector3<f64>],
}

/// Which mode the path-length control of an axis holds.
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
    /// Scale factor error of the present second.
    pub scale_now: Vector3<f64>,
}

impl Environment {
    /// At power-on. `None` if all is off.
    pub fn new(sizes: &Sizes, begin: Beginning<'_>) -> Option<Self> {
        let s = sizes.clone();
        let off = [
            s.hysteresis,
            s.scale_temperature,
            s.warm_up,
            s.mode_bias,
            s.mode_deflection,
            s.ageing,
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
        let start = begin.past.last().copied().unwrap_or_default();
        let mut new = Self {
            hysteresis,
            scale,
            warm_up: warm_up.component_mul(&gain).component_mul(&left),
            warm_up_time,
            deflection,
            phase,
            aged: aged(s.ageing, begin.age_days, stream(seed, number + 2)),
            play: begin.past.first().copied().unwrap_or_default(),
            modes: [Mode {
                number: 0,
                bias: 0.0,
            }; 3],
            unit: seed,
            scale_now: Vector3::zeros(),
            sizes: s,
        };
        begin.past.iter().for_each(|t| new.follow(t));
        for axis in 0..3 {
            let number = new.deflected(axis, start[axis]).round() as i32;
            new.modes[axis] = new.mode(axis, number);
        }
        Some(new)
    }

    /// The bias `t` s after power-on, with these temperatures of the axes, K.
    pub fn step(&mut self, t: f64, axes: &Vector3<f64>) -> Vector3<f64> {
        self.follow(axes);
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
        bias
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

/// Random walk of so many whole days.
fn aged(per_root_year: f64, days: f64, mut unit: ChaCha8Rng) -> Vector3<f64> {
    let per_day = per_root_year / YEAR_DAYS.sqrt();
    let days = if per_day > 0.0 { days as u32 } else { 0 };
    (0..days).map(|_| normal3(&mut unit) * per_day).sum()
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

#[cfg(test)]
mod tests;
