//! Errors of one triad at one turn-on. The same equations serve gyros and accelerometers.

pub(super) mod environment;
pub(super) mod flicker;

use super::dither::DitherSpec;
use super::draws::{Normals, normal3};
use super::world::History;
use crate::inertial::ekf::{Parameter, Regressor};
use crate::inertial::session::{Surroundings, Temperature};
use crate::inertial::units::ARCSEC;
use environment::{Beginning, Environment, Sizes};
use flicker::Flicker;
use nalgebra::{Matrix3, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Repeatability of the warm-up's amplitude from turn-on to turn-on (assumed).
pub(super) const WARM_UP_REPEATABILITY: f64 = 0.1;
/// Period over which the slow errors are constant, s.
pub(super) const SLOW_S: f64 = 1.0;
/// The three gyros dither at different frequencies, because otherwise they would excite one another
/// (assumed: 7 % apart).
const DITHER_APART: [f64; 3] = [0.93, 1.0, 1.07];

/// Numbers of a triad in SI, in one form for gyros and accelerometers. Numbers that do not apply
/// are zero.
#[derive(Debug, Clone, Default)]
pub(super) struct Sigmas {
    pub bias_unit: f64,
    pub bias_turn_on: f64,
    pub drift: f64,
    pub drift_time: f64,
    pub instability: f64, // the coefficient B
    pub walk: f64,        // per sqrt(s)
    pub noise: f64,       // per sqrt(s)
    pub scale: f64,
    pub asymmetry: f64,
    pub quadratic: f64,
    pub cubic: f64,
    pub cross: f64,
    pub rectification: f64,
    pub above_ratio: f64,
    pub misalignment: f64,
    pub warm_up: f64,
    pub warm_up_time: f64,
    pub thermal: [f64; 5], // times T, T^2, dT/dt, T dT/dt, gradient
    pub magnetic: f64,     // per gauss
    pub pulse: f64,
    pub environment: Sizes,
}

/// The dither that remains after stripping: a sinusoid in the angle, taken at the ends of the
/// samples.
#[derive(Debug, Clone)]
struct Residual {
    amplitude: f64,
    noise: f64,
    omega: [f64; 3],
    turn: [(f64, f64); 3], // sine and cosine of the phase of one increment
    phase: [(f64, f64); 3],
    last: Vector3<f64>,
}

impl Residual {
    fn new(dither: &DitherSpec, dt: f64) -> Option<Self> {
        let amplitude = dither.strip_residual_arcsec * ARCSEC;
        let omega = DITHER_APART.map(|x| std::f64::consts::TAU * dither.frequency_hz * x);
        (amplitude > 0.0).then(|| Self {
            amplitude,
            noise: amplitude * dither.amplitude_noise_arcsec / dither.amplitude_arcsec,
            omega,
            turn: omega.map(|w| (w * dt).sin_cos()),
            phase: [(0.0, 1.0); 3],
            last: Vector3::zeros(),
        })
    }

    /// Sets the phases to those of the time `t`, so that rounding errors do not accumulate.
    fn rebase(&mut self, t: f64) {
        self.phase = self.omega.map(|w| (w * t).sin_cos());
    }

    fn step(&mut self, normals: &mut Normals) -> Vector3<f64> {
        for ((s, c), (ts, tc)) in self.phase.iter_mut().zip(self.turn) {
            (*s, *c) = (*s * tc + *c * ts, *c * tc - *s * ts);
        }
        let z = normals.three();
        let angle = Vector3::from_fn(|i, _| (self.amplitude + self.noise * z[i]) * self.phase[i].0);
        let change = angle - self.last;
        self.last = angle;
        change
    }
}

/// The sample period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Period {
    /// Seconds.
    pub s: f64,
    /// One over it.
    pub per_s: f64,
    /// Its square root.
    pub root_s: f64,
}

impl Period {
    /// The period of a sample rate, Hz.
    pub fn of(rate_hz: f64) -> Self {
        let s = 1.0 / rate_hz;
        Self {
            s,
            per_s: rate_hz,
            root_s: s.sqrt(),
        }
    }
}

/// Errors of one triad. Its input `x` is rate or specific force in body axes, SI.
#[derive(Debug, Clone)]
pub(super) struct Triad {
    // drawn for the unit
    bias_unit: Vector3<f64>,
    matrix: Matrix3<f64>, // scale on the diagonal, misalignment beside it
    asymmetry: Vector3<f64>,
    quadratic: Vector3<f64>, // per x
    cubic: Vector3<f64>,     // per x^2
    cross: Vector3<f64>,     // per x
    rectification: Vector3<f64>,
    warm_up: Vector3<f64>,
    thermal: [Vector3<f64>; 5],
    magnetic: Matrix3<f64>,
    // drawn at each turn-on
    bias_turn_on: Vector3<f64>,
    warm_up_gain: Vector3<f64>,
    // changes with time
    sigmas: Sigmas,
    drift: Vector3<f64>,
    walk: Vector3<f64>,
    /// One over the size of a pulse.
    per_pulse: f64,
    remainder: Vector3<f64>,
    residual: Option<Residual>,
    flicker: Option<Flicker>,
    environment: Option<Environment>,
    /// Number of samples, and sums of x and x^2 over the present second. Used only if vibration is
    /// rectified.
    vibration: (f64, Vector3<f64>, Vector3<f64>),
    /// Sum of the slow errors of the present second.
    slow: Vector3<f64>,
}

impl Triad {
    /// Draws from the common random numbers of the unit and from `separate`, a stream of this
    /// triad.
    pub fn new(
        sigmas: Sigmas,
        unit: &mut ChaCha8Rng,
        turn_on: &mut Normals,
        mut separate: ChaCha8Rng,
    ) -> Self {
        let bias_unit = normal3(unit) * sigmas.bias_unit;
        let mut matrix = Matrix3::from_fn(|_, _| {
            let z: f64 = StandardNormal.sample(unit);
            z * sigmas.misalignment
        });
        matrix.set_diagonal(&(normal3(unit) * sigmas.scale));
        let asymmetry = normal3(unit) * sigmas.asymmetry;
        let quadratic = normal3(unit) * sigmas.quadratic;
        let warm_up = normal3(unit) * sigmas.warm_up;
        let bias_turn_on = turn_on.three() * sigmas.bias_turn_on;
        let warm_up_gain = Vector3::repeat(1.0) + turn_on.three() * WARM_UP_REPEATABILITY;
        let drift = turn_on.three() * sigmas.drift;
        Self {
            bias_unit,
            matrix,
            asymmetry,
            quadratic,
            cubic: normal3(&mut separate) * sigmas.cubic,
            cross: normal3(&mut separate) * sigmas.cross,
            rectification: normal3(&mut separate) * sigmas.rectification,
            warm_up,
            thermal: sigmas.thermal.map(|sigma| normal3(&mut separate) * sigma),
            magnetic: Matrix3::from_fn(|_, _| {
                let z: f64 = StandardNormal.sample(&mut separate);
                z * sigmas.magnetic
            }),
            bias_turn_on,
            warm_up_gain,
            per_pulse: 1.0 / sigmas.pulse,
            sigmas,
            drift,
            walk: Vector3::zeros(),
            remainder: Vector3::zeros(),
            residual: None,
            flicker: None,
            environment: None,
            vibration: Default::default(),
            slow: Vector3::zeros(),
        }
    }

    /// Adds the remaining part of `dither` after stripping, in samples of `dt` seconds.
    pub fn with_dither(mut self, dither: &DitherSpec, dt: f64) -> Self {
        self.residual = Residual::new(dither, dt);
        self
    }

    /// Starts the warm-up with the part that remains after the time before power-on.
    pub fn with_history(mut self, history: &History) -> Self {
        self.warm_up *= 1.0 - history.left(self.sigmas.warm_up_time);
        self
    }

    /// Adds the errors that follow temperature, history and age.
    pub fn with_environment(mut self, begin: Beginning<'_>) -> Self {
        self.environment = Environment::new(&self.sigmas.environment, begin);
        self
    }

    /// Adds the bias instability, which draws from `turn_on`, a stream of its own.
    pub fn with_flicker(mut self, turn_on: ChaCha8Rng) -> Self {
        self.flicker = Flicker::new(self.sigmas.instability, turn_on);
        self
    }

    /// Updates the slow errors to `t` seconds after power-on, `SLOW_S` after the last call.
    pub fn move_slow(
        &mut self,
        t: f64,
        around: &Surroundings,
        [noise, separate]: [&mut Normals; 2],
    ) {
        let s = &self.sigmas;
        let keep = (-SLOW_S / s.drift_time).exp();
        self.drift = self.drift * keep + noise.three() * (s.drift * (1.0 - keep * keep).sqrt());
        if s.walk > 0.0 {
            self.walk += separate.three() * (s.walk * SLOW_S.sqrt());
        }
        if let Some(residual) = &mut self.residual {
            residual.rebase(t);
        }
        let flicker = self.flicker.as_mut().map(Flicker::step);
        let environment = self.environment.as_mut();
        let environment = environment.map(|e| e.step(t, around));
        let decay = (-t / s.warm_up_time).exp();
        self.slow = self.bias_unit
            + self.bias_turn_on
            + self.drift
            + self.walk
            + self.warm_up.component_mul(&self.warm_up_gain) * decay
            + self.thermal_bias(&around.temperature)
            + self.magnetic * around.field
            + self.rectified()
            + flicker.unwrap_or_default()
            + environment.unwrap_or_default();
    }

    /// c1 T + c2 T^2 + c3 dT/dt + c4 T dT/dt + c5 G.
    fn thermal_bias(&self, at: &Temperature) -> Vector3<f64> {
        let [c1, c2, c3, c4, c5] = &self.thermal;
        let (t, rate) = (at.offset, at.rate);
        (c1 + c2 * t + c4 * rate) * t + c3 * rate + c5 * at.gradient
    }

    /// Bias from the vibration above the sample rate, by the mean square of the samples of the last
    /// second about their mean.
    fn rectified(&mut self) -> Vector3<f64> {
        let (n, sum, squares) = std::mem::take(&mut self.vibration);
        if n == 0.0 {
            return Vector3::zeros();
        }
        let mean = sum / n;
        let mean_square = squares / n - mean.component_mul(&mean);
        self.rectification.component_mul(&mean_square) * self.sigmas.above_ratio
    }

    /// Error without white noise and quantisation, for the input `x`.
    fn error(&self, x: &Vector3<f64>) -> Vector3<f64> {
        let pendulous = Vector3::new(x.y, x.z, x.x);
        let per_x = self.quadratic.component_mul(x)
            + self.cross.component_mul(&pendulous)
            + self.cubic.component_mul(&x.component_mul(x));
        let error = self.slow
            + self.matrix * x
            + self.asymmetry.component_mul(&x.abs())
            + per_x.component_mul(x);
        match &self.environment {
            Some(environment) => error + environment.scale_now.component_mul(x),
            None => error,
        }
    }

    /// The part of a parameter that belongs to the unit: see [`super::UnitErrors`].
    pub fn of_unit(&self, p: &Parameter) -> f64 {
        let i = p.axis;
        let [c1, c2, c3, c4, c5] = &self.thermal;
        match p.regressor {
            Regressor::One if p.time_s.is_infinite() => self.bias_unit[i],
            Regressor::Input(j) => self.matrix[(i, j)],
            Regressor::Magnitude(_) => self.asymmetry[i],
            Regressor::Product(j, k) if j == k => self.quadratic[i],
            Regressor::Product(..) => self.cross[i],
            Regressor::Cube(_) => self.cubic[i],
            Regressor::Temperature => c1[i],
            Regressor::TemperatureSquare => c2[i],
            Regressor::Heating => c3[i],
            Regressor::HeatingTemperature => c4[i],
            Regressor::Gradient => c5[i],
            Regressor::Field(j) => self.magnetic[(i, j)],
            Regressor::Vibration(_) => self.rectification[i] * self.sigmas.above_ratio,
            Regressor::Decay(_) => self.warm_up[i],
            _ => 0.0,
        }
    }

    /// Standard deviation of the part of a parameter that is new at a turn-on; `value` is the
    /// unit's part.
    pub fn turn_on(&self, p: &Parameter, value: f64) -> f64 {
        match p.regressor {
            Regressor::One if p.time_s.is_infinite() => self.sigmas.bias_turn_on,
            Regressor::One => p.sigma,
            Regressor::Decay(_) => value.abs() * WARM_UP_REPEATABILITY,
            _ => 0.0,
        }
    }

    /// Counts of one sample whose perfect increment is `d`, and the integral of its systematic
    /// error.
    pub fn measure(
        &mut self,
        d: &Vector3<f64>,
        period: &Period,
        [noise, separate]: [&mut Normals; 2],
    ) -> ([i32; 3], Vector3<f64>) {
        let x = d * period.per_s;
        if self.sigmas.rectification > 0.0 {
            self.vibration.0 += 1.0;
            self.vibration.1 += x;
            self.vibration.2 += x.component_mul(&x);
        }
        let systematic = self.error(&x) * period.s;
        let mut noise = noise.three() * (self.sigmas.noise * period.root_s);
        if let Some(residual) = &mut self.residual {
            noise += residual.step(separate);
        }
        let pulses = (d + systematic + noise) * self.per_pulse + self.remainder;
        let counts: [i32; 3] = std::array::from_fn(|i| rounded(pulses[i]));
        let whole = match counts
            .iter()
            .all(|count| count.unsigned_abs() < MOST_PULSES)
        {
            true => Vector3::from(counts.map(f64::from)),
            false => pulses.map(f64::round),
        };
        self.remainder = pulses - whole;
        (counts, systematic)
    }
}

/// Pulses of a sample that no `i32` has saturated.
const MOST_PULSES: u32 = 1 << 30;

/// The nearest whole number, halves away from zero: [`f64::round`] and the conversion, without a
/// call.
#[inline(always)]
fn rounded(x: f64) -> i32 {
    const BELOW_HALF: f64 = 0.5_f64.next_down();
    (x + BELOW_HALF.copysign(x)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        let half = [
            0.5,
            1.5,
            -0.5,
            -2.5,
            0.499_999_999_999_999_94,
            2.4,
            -7.6,
            1e9 + 0.5,
        ];
        let next = half
            .iter()
            .flat_map(|x: &f64| [x.next_up(), *x, x.next_down()]);
        let other = [0.0, -0.0, 3e9, -3e9, f64::NAN, f64::INFINITY];
        for x in next.chain(other) {
            assert_eq!(rounded(x), x.round() as i32, "{x}");
        }
    }
}
