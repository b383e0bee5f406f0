//! One IMU at one turn-on. It turns perfect increments into pulse counts.

use super::delay::Delay;
use super::draws::{Draws, normal3};
use super::heat::Heat;
use super::motion_level::MotionLevel;
use super::spec::ImuSpec;
use super::term::Datasheet;
use super::triad::environment::Beginning;
use super::triad::{Period, SLOW_S, Sigmas, Triad};
use super::unit_errors::UnitErrors;
use crate::inertial::session::{Readings, Surroundings};
use crate::inertial::sins::Increment;
use crate::inertial::units::{ARCSEC, DEG_PER_H, G0, UG};
use firmware::sample::{Counts, Lsb};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Numbers of the random streams of the unit beside the first one: of its two triads,
const GYRO: u64 = 2;
const ACCEL: u64 = 3;
/// of the positions of the accelerometers; then of the turn-on beside those of [`Draws`]: bias
/// instability of the two triads. Those of the thermal state are in `heat`.
const POSITIONS: u64 = 4;
const FLICKER: [u64; 2] = [6, 7];
/// Streams of the unit: g-sensitivity of the gyros, and their sensitivity to the squares of the
/// specific force.
const G_SENSITIVITY: u64 = 8;
const G_SQUARE: u64 = 15;
/// Streams of the unit and of the turn-on: environment of the two triads. Their ageing has the next
/// two streams of the unit, and their steps 16 and 17.
const ENVIRONMENT: [u64; 2] = [11, 12];

/// One IMU at one turn-on.
#[derive(Debug, Clone)]
pub struct Imu {
    gyro: Triad,
    accel: Triad,
    heat: Heat,
    around: Surroundings,
    /// `None` if no error follows it.
    moved: Option<MotionLevel>,
    /// Distance of each accelerometer from the common point, m. `None` if there is no size effect.
    places: Option<[Vector3<f64>; 3]>,
    /// Bias of the gyros by specific force, rad/s per m/s2. `None` if there is none.
    g_sensitivity: Option<Matrix3<f64>>,
    /// Bias of the gyros by the squares of the specific force, rad/s per (m/s2)^2. `None` if there
    /// is none.
    g_square: Option<Matrix3<f64>>,
    last_rate: Option<Vector3<f64>>,
    delay: Option<Delay>,
    period: Period,
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

    /// As [`Self::new`], with [`Draws`] of this turn-on, read from their start.
    #[must_use]
    pub fn with_draws(spec: &ImuSpec, unit: u64, turn_on: u64, mut draws: Draws) -> Self {
        let mut unit_rng = ChaCha8Rng::seed_from_u64(unit);
        let period = Period::of(f64::from(spec.rate_hz));
        let mut triad = |sigmas: Sigmas, separate: u64| {
            Triad::new(
                sigmas,
                &mut unit_rng,
                &mut draws.noise,
                stream(unit, separate),
            )
        };
        let [flicker_g, flicker_a] = FLICKER.map(|number| stream(turn_on, number));
        let heat = Heat::new(spec, unit, turn_on);
        let history = heat.history();
        let (turning_points, trail) = (heat.turning_points(), heat.trail());
        let begin = |number: u64| Beginning {
            unit: (unit, number),
            turn_on: stream(turn_on, number),
            history,
            age_days: spec.world.power.age_days,
            power_ons: spec.world.power.power_ons,
            turning_points: &turning_points,
            trail: &trail,
        };
        let [sigmas_g, sigmas_a] = sigmas(spec);
        let gyro = triad(sigmas_g, GYRO)
            .with_history(&history)
            .with_environment(begin(ENVIRONMENT[0]))
            .with_dither(&spec.gyro.dither, period.s)
            .with_flicker(flicker_g);
        let accel = triad(sigmas_a, ACCEL)
            .with_history(&history)
            .with_environment(begin(ENVIRONMENT[1]))
            .with_flicker(flicker_a);
        let per_force = spec.gyro.g_sensitivity_dphpg * DEG_PER_H / G0;
        let per_square = spec.gyro.environment.g_square_dphpg2 * DEG_PER_H / (G0 * G0);
        let mut position_rng = stream(unit, POSITIONS);
        let arm = 1e-3 * spec.accel.size_effect_mm;
        Self {
            gyro,
            accel,
            heat,
            around: Surroundings::default(),
            moved: MotionLevel::of(spec),
            places: (arm > 0.0).then(|| [(); 3].map(|()| normal3(&mut position_rng) * arm)),
            g_sensitivity: matrix(per_force, stream(unit, G_SENSITIVITY)),
            g_square: matrix(per_square, stream(unit, G_SQUARE)),
            last_rate: None,
            delay: Delay::new(spec.accel.delay_s / period.s),
            period,
            samples_per_second: spec.rate_hz,
            sample: 0,
            draws,
        }
    }

    /// The errors that the unit has at every turn-on.
    #[must_use]
    pub fn unit_errors(&self) -> UnitErrors {
        UnitErrors {
            gyro: self.gyro.clone(),
            accel: self.accel.clone(),
            places: self.places,
            g_sensitivity: self.g_sensitivity,
        }
    }

    /// The random numbers, for the next IMU of this turn-on.
    ///
    /// # Panics
    /// The random numbers were not stored.
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

    /// Sets the height of the vehicle, m, for the lapse rate of the air. It applies from the next
    /// whole second on. The first call sets the height of the start.
    pub fn set_height(&mut self, height: f64) {
        self.heat.set_height(height);
    }

    /// Readings of the thermometers of the unit and of the processor in the present second.
    #[must_use]
    pub fn readings(&self) -> Readings {
        self.heat.thermometers().readings()
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
        self.heat.turn(&perfect.dtheta);
        let Draws {
            noise,
            separate: [gyro, accel],
        } = &mut self.draws;
        let mut turned = perfect.dtheta;
        if let Some(by_force) = &self.g_sensitivity {
            turned += by_force * perfect.dv;
        }
        if let Some(by_square) = &self.g_square {
            turned += by_square * perfect.dv.component_mul(&perfect.dv) * self.period.per_s;
        }
        let (dtheta, e_g) = self.gyro.measure(&turned, &self.period, [noise, gyro]);
        let mut felt = perfect.dv;
        if let Some(places) = &self.places {
            let rate = perfect.dtheta * self.period.per_s;
            let last = self.last_rate.replace(rate).unwrap_or(rate);
            felt += size_effect(places, &rate, &(rate - last), self.period.s);
        }
        if let Some(delay) = &mut self.delay {
            felt = delay.next(felt);
        }
        if let Some(moved) = &mut self.moved {
            let per_s = self.period.per_s;
            moved.add(&(turned * per_s), &(felt * per_s));
        }
        let (dv, e_a) = self.accel.measure(&felt, &self.period, [noise, accel]);
        (
            Counts { dtheta, dv },
            Increment {
                dtheta: e_g + (turned - perfect.dtheta),
                dv: e_a + (felt - perfect.dv),
            },
        )
    }

    fn move_slow(&mut self) {
        let t = self.sample as f64 * self.period.s;
        if self.sample > 0 {
            self.heat.step(t, SLOW_S);
        }
        self.around.temperature = self.heat.now();
        self.around.axes = self.heat.axes();
        if let Some(moved) = &mut self.moved {
            [self.around.vibration, self.around.turning] = moved.take();
        }
        let Draws {
            noise,
            separate: [gyro, accel],
        } = &mut self.draws;
        self.gyro.move_slow(t, &self.around, [noise, gyro]);
        self.accel.move_slow(t, &self.around, [noise, accel]);
    }
}

/// The numbers of the two triads in SI.
fn sigmas(spec: &ImuSpec) -> [Sigmas; 2] {
    let mut both = [spec.gyro.sigmas(), spec.accel.sigmas()];
    spec.gyro.environment.act(&mut both[0]);
    spec.accel.environment.act(&mut both[1]);
    both
}

/// A matrix whose elements are drawn with `sigma`, column by column. `None` if it is zero.
fn matrix(sigma: f64, mut unit: ChaCha8Rng) -> Option<Matrix3<f64>> {
    let mut column = || normal3(&mut unit) * sigma;
    (sigma > 0.0).then(|| Matrix3::from_columns(&[column(), column(), column()]))
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
