//! One IMU at one turn-on. It turns perfect increments into pulse counts.

use super::delay::Delay;
use super::draws::{Draws, normal3};
use super::spec::ImuSpec;
use super::term::Datasheet;
use super::thermal::Block;
use super::triad::{SLOW_S, Sigmas, Triad};
use crate::inertial::session::Surroundings;
use crate::inertial::sins::Increment;
use crate::inertial::units::{ARCSEC, DEG_PER_H, G0, UG};
use firmware::sample::{Counts, Lsb};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Numbers of the random streams of the unit beside the first one: of its two triads,
const GYRO: u64 = 2;
const ACCEL: u64 = 3;
/// of the places of the accelerometers; then of the turn-on beside those of [`Draws`]: ambient
/// temperature, and bias instability of the two triads.
const PLACE: u64 = 4;
const AMBIENT: u64 = 5;
const FLICKER: [u64; 2] = [6, 7];
/// Of the unit: g-sensitivity of the gyros.
const G_SENSITIVITY: u64 = 8;

/// One IMU at one turn-on.
#[derive(Debug, Clone)]
pub struct Imu {
    gyro: Triad,
    accel: Triad,
    block: Block,
    around: Surroundings,
    /// Distance of each accelerometer from the common point, m. `None` if there is no size effect.
    places: Option<[Vector3<f64>; 3]>,
    /// Bias of the gyros by specific force, rad/s per m/s2. `None` if there is none.
    g_sensitivity: Option<Matrix3<f64>>,
    last_rate: Option<Vector3<f64>>,
    delay: Option<Delay>,
    dt: f64,
    samples_per_second: u32,
    sample: u64,
    draws: Draws,
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

impl Imu {
    /// `unit` seeds what belongs to the device. `turn_on` seeds what is new at every power-on,
    /// noise included.
    #[must_use]
    pub fn new(spec: &ImuSpec, unit: u64, turn_on: u64) -> Self {
        Self::with_draws(spec, unit, turn_on, Draws::of(turn_on, false))
    }

    /// The same with [`Draws`] of this turn-on, read from their start.
    #[must_use]
    pub fn with_draws(spec: &ImuSpec, unit: u64, turn_on: u64, mut draws: Draws) -> Self {
        let mut unit_rng = ChaCha8Rng::seed_from_u64(unit);
        let dt = 1.0 / f64::from(spec.rate_hz);
        let mut triad = |sigmas: Sigmas, separate: u64| {
            Triad::new(
                sigmas,
                &mut unit_rng,
                &mut draws.noise,
                stream(unit, separate),
            )
        };
        let [flicker_g, flicker_a] = FLICKER.map(|number| stream(turn_on, number));
        let gyro = triad(spec.gyro.sigmas(), GYRO)
            .with_dither(&spec.gyro.dither, dt)
            .with_flicker(flicker_g);
        let accel = triad(spec.accel.sigmas(), ACCEL).with_flicker(flicker_a);
        let per_force = spec.gyro.g_sensitivity_dphpg * DEG_PER_H / G0;
        let mut force_rng = stream(unit, G_SENSITIVITY);
        let mut place_rng = stream(unit, PLACE);
        let arm = 1e-3 * spec.accel.size_effect_mm;
        Self {
            gyro,
            accel,
            block: Block::new(&spec.block, &mut stream(turn_on, AMBIENT)),
            around: Surroundings::default(),
            places: (arm > 0.0).then(|| [(); 3].map(|()| normal3(&mut place_rng) * arm)),
            g_sensitivity: (per_force > 0.0).then(|| {
                let columns = [(); 3].map(|()| normal3(&mut force_rng) * per_force);
                Matrix3::from_columns(&columns)
            }),
            last_rate: None,
            delay: Delay::new(spec.accel.delay_s / dt),
            dt,
            samples_per_second: spec.rate_hz,
            sample: 0,
            draws,
        }
    }

    /// The random numbers, for the next IMU of this turn-on.
    ///
    /// # Panics
    /// The random numbers were not kept.
    #[must_use]
    pub fn into_draws(mut self) -> Draws {
        self.draws.rewind();
        self.draws
    }

    /// Value of one count of each triad.
    #[must_use]
    pub fn lsb(spec: &ImuSpec) -> Lsb {
        Lsb {
            rad: spec.gyro.pulse_arcsec * ARCSEC,
            mps: spec.accel.pulse_ugs * UG,
        }
    }

    /// Sets the magnetic field at the gyros, in body axes, gauss. It applies from the next whole
    /// second on. Without a call there is no field. The field of the Earth is `q_bn.inverse() *
    /// magnetic::dipole_field(position)`.
    pub fn set_field(&mut self, body: Vector3<f64>) {
        self.around.field = body;
    }

    /// Temperature and field in the present second.
    #[must_use]
    pub fn surroundings(&self) -> Surroundings {
        self.around
    }

    /// The next sample: its counts and its systematic error, which is all but white noise, the rest
    /// of the dither, and quantisation.
    pub fn measure(&mut self, perfect: &Increment) -> (Counts, Increment) {
        if self
            .sample
            .is_multiple_of(u64::from(self.samples_per_second))
        {
            self.move_slow();
        }
        self.sample += 1;
        let Draws {
            noise,
            separate: [gyro, accel],
        } = &mut self.draws;
        let mut turned = perfect.dtheta;
        if let Some(by_force) = &self.g_sensitivity {
            turned += by_force * perfect.dv;
        }
        let (dtheta, e_g) = self.gyro.measure(&turned, self.dt, [noise, gyro]);
        let mut felt = perfect.dv;
        if let Some(places) = &self.places {
            let rate = perfect.dtheta / self.dt;
            let last = self.last_rate.replace(rate).unwrap_or(rate);
            felt += size_effect(places, &rate, &(rate - last), self.dt);
        }
        if let Some(delay) = &mut self.delay {
            felt = delay.next(felt);
        }
        let (dv, e_a) = self.accel.measure(&felt, self.dt, [noise, accel]);
        (
            Counts { dtheta, dv },
            Increment {
                dtheta: e_g + (turned - perfect.dtheta),
                dv: e_a + (felt - perfect.dv),
            },
        )
    }

    fn move_slow(&mut self) {
        let t = self.sample as f64 * self.dt;
        if self.sample > 0 {
            self.block.step(t, SLOW_S);
        }
        self.around.temperature = self.block.now();
        let Draws {
            noise,
            separate: [gyro, accel],
        } = &mut self.draws;
        self.gyro.move_slow(t, &self.around, [noise, gyro]);
        self.accel.move_slow(t, &self.around, [noise, accel]);
    }
}

/// Velocity increment of accelerometers at `places` beyond that of a common point, along the axis
/// of each: `(w x (w x r) dt + dw x r)`. `dw`, the change of the rate, is taken from the middle of
/// the last sample to the middle of this one, so it is half a sample late.
fn size_effect(
    places: &[Vector3<f64>; 3],
    w: &Vector3<f64>,
    dw: &Vector3<f64>,
    dt: f64,
) -> Vector3<f64> {
    Vector3::from_fn(|i, _| {
        let r = &places[i];
        (w.cross(&w.cross(r)) * dt + dw.cross(r))[i]
    })
}
