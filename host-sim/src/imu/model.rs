//! One IMU at one turn-on: turns perfect increments into pulse counts.

use super::spec::{AccelSpec, GyroSpec, ImuSpec};
use crate::sins::Increment;
use crate::units::{ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, G0, PPM, UG, UG_PER_SQRT_HZ};
use firmware::sample::{Counts, Lsb};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Repeatability of the warm-up's amplitude from turn-on to turn-on (assumed).
const WARM_UP_REPEATABILITY: f64 = 0.1;
/// Word period over which the slow errors are held, s.
const SLOW_S: f64 = 1.0;

fn normal3(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| StandardNormal.sample(rng))
}

/// Errors of one triad; `x` is its input, rate or specific force in body axes, SI.
#[derive(Debug, Clone)]
struct Triad {
    // drawn with the unit
    bias_unit: Vector3<f64>,
    matrix: Matrix3<f64>, // scale on the diagonal, misalignment beside it
    asymmetry: Vector3<f64>,
    k2: Vector3<f64>, // per (m/s2)
    warm_up: Vector3<f64>,
    warm_up_time: f64,
    // drawn at turn-on
    bias_turn_on: Vector3<f64>,
    warm_up_gain: Vector3<f64>,
    // moves
    drift: Vector3<f64>,
    drift_sigma: f64,
    drift_time: f64,
    noise: f64, // per sqrt(s)
    pulse: f64,
    remainder: Vector3<f64>,
    // bias + warm-up + drift of the present second
    slow: Vector3<f64>,
}

/// Numbers of a triad in SI, in one order for both kinds.
struct Si {
    bias_unit: f64,
    bias_turn_on: f64,
    drift: f64,
    drift_time: f64,
    noise: f64,
    scale: f64,
    asymmetry: f64,
    k2: f64,
    misalignment: f64,
    warm_up: f64,
    warm_up_time: f64,
    pulse: f64,
}

impl From<&GyroSpec> for Si {
    fn from(s: &GyroSpec) -> Self {
        Self {
            bias_unit: s.bias_unit_dph * DEG_PER_H,
            bias_turn_on: s.bias_turn_on_dph * DEG_PER_H,
            drift: s.bias_drift_dph * DEG_PER_H,
            drift_time: s.bias_drift_time_s,
            noise: s.angle_random_walk_dpsqrth * DEG_PER_SQRT_H,
            scale: s.scale_ppm * PPM,
            asymmetry: s.scale_asymmetry_ppm * PPM,
            k2: 0.0,
            misalignment: s.misalignment_arcsec * ARCSEC,
            warm_up: s.warm_up_dph * DEG_PER_H,
            warm_up_time: s.warm_up_time_s,
            pulse: s.pulse_arcsec * ARCSEC,
        }
    }
}

impl From<&AccelSpec> for Si {
    fn from(s: &AccelSpec) -> Self {
        Self {
            bias_unit: s.bias_unit_ug * UG,
            bias_turn_on: s.bias_turn_on_ug * UG,
            drift: s.bias_drift_ug * UG,
            drift_time: s.bias_drift_time_s,
            noise: s.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ,
            scale: s.scale_ppm * PPM,
            asymmetry: s.scale_asymmetry_ppm * PPM,
            k2: s.k2_ugpg2 * UG / (G0 * G0),
            misalignment: s.misalignment_arcsec * ARCSEC,
            warm_up: s.warm_up_ug * UG,
            warm_up_time: s.warm_up_time_s,
            pulse: s.pulse_ugs * UG,
        }
    }
}

impl Triad {
    fn new(si: &Si, unit: &mut ChaCha8Rng, turn_on: &mut ChaCha8Rng) -> Self {
        let bias_unit = normal3(unit) * si.bias_unit;
        let mut matrix = Matrix3::from_fn(|_, _| {
            let z: f64 = StandardNormal.sample(unit);
            z * si.misalignment
        });
        matrix.set_diagonal(&(normal3(unit) * si.scale));
        let asymmetry = normal3(unit) * si.asymmetry;
        let k2 = normal3(unit) * si.k2;
        let warm_up = normal3(unit) * si.warm_up;
        Self {
            bias_unit,
            matrix,
            asymmetry,
            k2,
            warm_up,
            warm_up_time: si.warm_up_time,
            bias_turn_on: normal3(turn_on) * si.bias_turn_on,
            warm_up_gain: Vector3::repeat(1.0) + normal3(turn_on) * WARM_UP_REPEATABILITY,
            drift: normal3(turn_on) * si.drift,
            drift_sigma: si.drift,
            drift_time: si.drift_time,
            noise: si.noise,
            pulse: si.pulse,
            remainder: Vector3::zeros(),
            slow: Vector3::zeros(),
        }
    }

    /// Moves the slow errors to `t` seconds after power-on, `SLOW_S` after the last call.
    fn move_slow(&mut self, t: f64, rng: &mut ChaCha8Rng) {
        let keep = (-SLOW_S / self.drift_time).exp();
        self.drift =
            self.drift * keep + normal3(rng) * (self.drift_sigma * (1.0 - keep * keep).sqrt());
        let decay = (-t / self.warm_up_time).exp();
        self.slow = self.bias_unit
            + self.bias_turn_on
            + self.drift
            + self.warm_up.component_mul(&self.warm_up_gain) * decay;
    }

    /// Error without white noise and quantisation, for the input `x`.
    fn error(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.slow
            + self.matrix * x
            + self.asymmetry.component_mul(&x.abs())
            + self.k2.component_mul(&x.component_mul(x))
    }

    /// Counts of one word whose perfect increment is `d`; also the integral of the systematic error.
    fn word(
        &mut self,
        d: &Vector3<f64>,
        dt: f64,
        rng: &mut ChaCha8Rng,
    ) -> ([i32; 3], Vector3<f64>) {
        let systematic = self.error(&(d / dt)) * dt;
        let noise = normal3(rng) * (self.noise * dt.sqrt());
        let pulses = (d + systematic + noise) / self.pulse + self.remainder;
        let whole = pulses.map(f64::round);
        self.remainder = pulses - whole;
        ([whole.x as i32, whole.y as i32, whole.z as i32], systematic)
    }
}

/// One IMU at one turn-on.
#[derive(Debug, Clone)]
pub struct Imu {
    gyro: Triad,
    accel: Triad,
    dt: f64,
    words_per_second: u32,
    word: u64,
    rng: ChaCha8Rng,
}

impl Imu {
    /// `unit` seeds what belongs to the device, `turn_on` what is new at every power-on (noise included).
    #[must_use]
    pub fn new(spec: &ImuSpec, unit: u64, turn_on: u64) -> Self {
        let mut unit_rng = ChaCha8Rng::seed_from_u64(unit);
        let mut rng = ChaCha8Rng::seed_from_u64(turn_on);
        rng.set_stream(1);
        let gyro = Triad::new(&Si::from(&spec.gyro), &mut unit_rng, &mut rng);
        let accel = Triad::new(&Si::from(&spec.accel), &mut unit_rng, &mut rng);
        Self {
            gyro,
            accel,
            dt: 1.0 / f64::from(spec.rate_hz),
            words_per_second: spec.rate_hz,
            word: 0,
            rng,
        }
    }

    /// Value of one count of each triad.
    #[must_use]
    pub fn lsb(spec: &ImuSpec) -> Lsb {
        Lsb {
            rad: spec.gyro.pulse_arcsec * ARCSEC,
            mps: spec.accel.pulse_ugs * UG,
        }
    }

    /// Next word: counts, and the systematic error in it (white noise and quantisation left out).
    pub fn measure(&mut self, perfect: &Increment) -> (Counts, Increment) {
        if self.word.is_multiple_of(u64::from(self.words_per_second)) {
            let t = self.word as f64 * self.dt;
            self.gyro.move_slow(t, &mut self.rng);
            self.accel.move_slow(t, &mut self.rng);
        }
        self.word += 1;
        let (dtheta, e_g) = self.gyro.word(&perfect.dtheta, self.dt, &mut self.rng);
        let (dv, e_a) = self.accel.word(&perfect.dv, self.dt, &mut self.rng);
        (
            Counts { dtheta, dv },
            Increment {
                dtheta: e_g,
                dv: e_a,
            },
        )
    }
}
