//! Sensor-error models that are linear in their parameters, as a classical calibration filter
//! estimates them.

use crate::inertial::rotation::skew;
use crate::inertial::session::{EPOCH_S, Surroundings};
use crate::inertial::sins::Increment;
use nalgebra::{DVector, Vector3};
use std::sync::Arc;

/// Factor of a parameter in the sensor error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regressor {
    /// One: a bias.
    One,
    /// Input of the same triad along an axis (0, 1, 2): scale factor or misalignment.
    Input(usize),
    /// Magnitude of that input: scale-factor asymmetry.
    Magnitude(usize),
    /// Product of that input along two axes: K2 of an accelerometer when they are the same, cross
    /// coupling when not.
    Product(usize, usize),
    /// Cube of that input: non-linearity of a gyro's scale factor.
    Cube(usize),
    /// Difference of the block's temperature from its calibration temperature, K.
    Temperature,
    /// Its square, K^2.
    TemperatureSquare,
    /// Its rate, K/s.
    Heating,
    /// Temperature times rate, K^2/s.
    HeatingTemperature,
    /// Temperature difference across the block, K.
    Gradient,
    /// Specific force along an axis, m/s2: g-sensitivity of a gyro.
    Force(usize),
    /// Magnetic field along an axis, gauss.
    Field(usize),
    /// Distance of the accelerometer from the common point along an axis, m. It gives the size
    /// effect `w x (w x r) + dw/dt x r`.
    Arm(usize),
    /// Mean square of the vibration along an axis that the samples of the last second contain,
    /// (m/s2)^2.
    Vibration(usize),
    /// Mean square of the vibration in the samples of the last second, sum over the axes, (m/s2)^2.
    Shaking,
    /// Hours since power-on: a ramp.
    Hours,
    /// `exp(-t / time)` with t since power-on and the time in s: a warm-up of known time constant.
    Decay(f64),
    /// Reading of the thermometer of the axis minus [`REFERENCE_DEGC`], K.
    Reading,
    /// Its square, K^2.
    ReadingSquare,
    /// Its rate, K/s.
    ReadingRate,
}

/// Inputs of the errors at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inputs {
    /// Rate, rad/s, body axes.
    pub rate: Vector3<f64>,
    /// Specific force, m/s2, body axes.
    pub force: Vector3<f64>,
    /// Derivative of the rate, rad/s2.
    pub rate_change: Vector3<f64>,
    /// Derivative of the specific force, m/s3.
    pub force_change: Vector3<f64>,
    /// Time since power-on, s.
    pub time: f64,
}

/// Data of other sources for one second: thermometers, a magnetometer, the samples of the second
/// before.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AuxiliaryData {
    /// Temperature of the block and magnetic field in body axes.
    pub around: Surroundings,
    /// Mean square of the specific force about its mean over the second before, each axis,
    /// (m/s2)^2.
    pub vibration: Vector3<f64>,
    /// Readings of the thermometers of the axes minus [`REFERENCE_DEGC`], K, and their rate of
    /// change, K/s.
    pub readings: [Vector3<f64>; 2],
}

/// Temperature that readings are compared with, degrees C.
pub const REFERENCE_DEGC: f64 = 25.0;
/// Deviation from it, K, and rate, K/s, at which a law of temperature reaches its prior.
const SPAN_K: f64 = 30.0;
const SPAN_KPS: f64 = 1.0 / 60.0;

/// The part of the sensor errors that is taken as constant within a second, as the simulator does;
/// see [`Regressor::is_slow`].
#[derive(Debug, Clone, Copy, Default)]
pub struct SlowErrors {
    /// The second since power-on that it belongs to.
    second: Option<usize>,
    error: [Vector3<f64>; 2],
    /// Whether some parameters add another part, which follows the motion.
    moves: bool,
}

/// Which triad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triad {
    /// Gyros, input in rad/s.
    Gyro,
    /// Accelerometers, input in m/s2.
    Accel,
}

/// One parameter: its axis, its prior, and how it changes (first-order Gauss-Markov process, or
/// random walk if `time_s` is infinite).
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// The triad with the error.
    pub triad: Triad,
    /// The axis with the error.
    pub axis: usize,
    /// Its factor in the error.
    pub regressor: Regressor,
    /// Prior standard deviation, SI.
    pub sigma: f64,
    /// Process noise density, SI per sqrt(s).
    pub walk: f64,
    /// Correlation time, s; infinite for a random walk.
    pub time_s: f64,
}

/// A model: its parameters in state order.
#[derive(Debug, Clone, Default)]
pub struct ErrorModel {
    /// All parameters.
    pub parameters: Vec<Parameter>,
    /// Known data of each second since power-on. Beyond the end of the list all values count as
    /// zero.
    pub known: Arc<[AuxiliaryData]>,
    /// Known delay of the accelerometer samples behind the gyro samples, s.
    pub delay_s: f64,
}

/// Prior standard deviations of the groups of parameters, and the drift of the biases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Gyro bias, rad/s.
    pub gyro_bias: f64,
    /// Accelerometer bias, m/s2.
    pub accel_bias: f64,
    /// Standard deviation that the random walk of a bias reaches in one hour, relative to its
    /// prior.
    pub walk_per_hour: f64,
    /// Scale factor, as a fraction, gyros then accelerometers.
    pub scale: [f64; 2],
    /// Misalignment, rad, gyros then accelerometers.
    pub misalignment: [f64; 2],
}

impl ErrorModel {
    /// Six biases, scale factors on the diagonal: what `ekf12` estimates.
    #[must_use]
    pub fn with_scale(prior: &Prior) -> Self {
        let mut model = Self::biases(prior);
        model.extend(|axis, triad| {
            vec![Parameter::constant(
                triad,
                axis,
                Regressor::Input(axis),
                prior.scale[triad.index()],
            )]
        });
        model
    }

    /// Six biases and full 3x3 matrices: what `ekf24` estimates.
    #[must_use]
    pub fn with_matrices(prior: &Prior) -> Self {
        let mut model = Self::biases(prior);
        model.extend(|axis, triad| {
            let sigma = |j: usize| {
                if j == axis {
                    prior.scale[triad.index()]
                } else {
                    prior.misalignment[triad.index()]
                }
            };
            (0..3)
                .map(|j| Parameter::constant(triad, axis, Regressor::Input(j), sigma(j)))
                .collect()
        });
        model
    }

    /// Six biases with a ramp each. In one hour a ramp reaches the size of the prior of the bias.
    #[must_use]
    pub fn with_ramps(prior: &Prior) -> Self {
        let mut model = Self::biases(prior);
        let sigma = [prior.gyro_bias, prior.accel_bias];
        model.extend(|axis, triad| {
            vec![Parameter::constant(
                triad,
                axis,
                Regressor::Hours,
                sigma[triad.index()],
            )]
        });
        model
    }

    /// Six biases, and on each axis three exponentials of the time since power-on, with these time
    /// constants (s). Each has the standard deviation `share` of the bias's.
    #[must_use]
    pub fn with_exponentials(prior: &Prior, times: [f64; 3], share: f64) -> Self {
        let mut model = Self::biases(prior);
        let sigma = [prior.gyro_bias, prior.accel_bias].map(|sigma| sigma * share);
        model.extend(|axis, triad| {
            let of = |time| {
                Parameter::constant(triad, axis, Regressor::Decay(time), sigma[triad.index()])
            };
            times.map(of).to_vec()
        });
        model
    }

    /// Six biases, and on each axis a law of its thermometer: in proportion to the reading, to its
    /// square and to its rate. At 30 K from [`REFERENCE_DEGC`], or at 1 K/min, each has the
    /// standard deviation `share` of the bias's.
    #[must_use]
    pub fn with_temperatures(prior: &Prior, known: Arc<[AuxiliaryData]>, share: f64) -> Self {
        let mut model = Self::biases(prior);
        let sigma = [prior.gyro_bias, prior.accel_bias].map(|sigma| sigma * share);
        model.extend(|axis, triad| {
            let laws = [
                (Regressor::Reading, SPAN_K),
                (Regressor::ReadingSquare, SPAN_K * SPAN_K),
                (Regressor::ReadingRate, SPAN_KPS),
            ];
            let of =
                |(law, span)| Parameter::constant(triad, axis, law, sigma[triad.index()] / span);
            laws.map(of).to_vec()
        });
        Self { known, ..model }
    }

    /// Adds parameters for each axis of each triad.
    pub fn extend(&mut self, mut parameters: impl FnMut(usize, Triad) -> Vec<Parameter>) {
        for triad in [Triad::Gyro, Triad::Accel] {
            for axis in 0..3 {
                self.parameters.extend(parameters(axis, triad));
            }
        }
    }

    /// Six biases that walk.
    #[must_use]
    pub fn biases(prior: &Prior) -> Self {
        let bias = |triad, axis, sigma: f64| Parameter {
            triad,
            axis,
            regressor: Regressor::One,
            sigma,
            walk: sigma * prior.walk_per_hour / 60.0,
            time_s: f64::INFINITY,
        };
        let gyros = (0..3).map(|axis| bias(Triad::Gyro, axis, prior.gyro_bias));
        let accels = (0..3).map(|axis| bias(Triad::Accel, axis, prior.accel_bias));
        Self {
            parameters: gyros.chain(accels).collect(),
            ..Self::default()
        }
    }

    /// Number of parameters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parameters.len()
    }

    /// True if the model has no parameter and no delay.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parameters.is_empty() && self.delay_s == 0.0
    }

    /// Errors of gyros (rad/s) and accelerometers (m/s2) for parameters `theta` and the inputs.
    /// `slow` stores the slow part for further calls in the same second with the same `theta`.
    #[must_use]
    pub fn error(
        &self,
        theta: &DVector<f64>,
        now: &Inputs,
        slow: &mut SlowErrors,
    ) -> [Vector3<f64>; 2] {
        let second = (now.time / EPOCH_S) as usize;
        if slow.second != Some(second) {
            *slow = self.slow(theta, second);
        }
        let mut out = slow.error;
        let known = AuxiliaryData::default();
        let moving = if slow.moves {
            &self.parameters[..]
        } else {
            &[]
        };
        for (p, t) in moving.iter().zip(theta.iter()) {
            if !p.regressor.is_slow() {
                out[p.triad.index()][p.axis] += t * p.value(now, &known);
            }
        }
        out[1] -= now.force_change * self.delay_s;
        out
    }

    /// Increments from power-on without the errors of the sensors for parameters `theta`.
    #[must_use]
    pub fn all_corrected(
        &self,
        theta: &DVector<f64>,
        increments: &[Increment],
        dt: f64,
    ) -> Vec<Increment> {
        let mut slow = SlowErrors::default();
        let each = increments.iter().enumerate().map(|(k, w)| {
            let around = [&increments[k.saturating_sub(1)], w];
            self.corrected(theta, around, dt, (k as f64 + 0.5) * dt, &mut slow)
        });
        each.collect()
    }

    /// The second of two increments without the errors of the sensors for parameters `theta`, at
    /// `time` seconds after power-on. `slow` as for [`Self::error`].
    #[must_use]
    pub fn corrected(
        &self,
        theta: &DVector<f64>,
        [before, increment]: [&Increment; 2],
        dt: f64,
        time: f64,
        slow: &mut SlowErrors,
    ) -> Increment {
        let per_s = 1.0 / dt;
        let now = Inputs {
            rate: increment.dtheta * per_s,
            force: increment.dv * per_s,
            rate_change: (increment.dtheta - before.dtheta) * (per_s * per_s),
            force_change: (increment.dv - before.dv) * (per_s * per_s),
            time,
        };
        let [gyro, accel] = self.error(theta, &now, slow);
        Increment {
            dtheta: increment.dtheta - gyro * dt,
            dv: increment.dv - accel * dt,
        }
    }

    /// The slow part of the error in the middle of a second.
    fn slow(&self, theta: &DVector<f64>, second: usize) -> SlowErrors {
        let now = Inputs {
            time: (second as f64 + 0.5) * EPOCH_S,
            ..Inputs::default()
        };
        let known = self.known_at(now.time);
        let mut error = [Vector3::zeros(); 2];
        for (p, t) in self.parameters.iter().zip(theta.iter()) {
            if p.regressor.is_slow() {
                error[p.triad.index()][p.axis] += t * p.value(&now, &known);
            }
        }
        SlowErrors {
            second: Some(second),
            error,
            moves: self.parameters.iter().any(|p| !p.regressor.is_slow()),
        }
    }

    /// The slow part of the errors of gyros (rad/s) and accelerometers (m/s2) in the middle of a
    /// second.
    pub(super) fn slow_errors(&self, theta: &DVector<f64>, second: usize) -> [Vector3<f64>; 2] {
        self.slow(theta, second).error
    }

    /// Known data of the second that contains `time` (s since power-on).
    pub(super) fn known_at(&self, time: f64) -> AuxiliaryData {
        let second = (time / EPOCH_S) as usize;
        self.known.get(second).copied().unwrap_or_default()
    }
}

impl Regressor {
    /// True if it depends on the time alone and hardly changes within a second.
    #[must_use]
    pub fn is_slow(self) -> bool {
        !matches!(
            self,
            Self::Input(_)
                | Self::Magnitude(_)
                | Self::Product(..)
                | Self::Cube(_)
                | Self::Force(_)
                | Self::Arm(_)
        )
    }
}

impl Triad {
    /// 0 for gyros, 1 for accelerometers.
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }
}

impl Parameter {
    /// A constant parameter.
    #[must_use]
    pub fn constant(triad: Triad, axis: usize, regressor: Regressor, sigma: f64) -> Self {
        Self {
            triad,
            axis,
            regressor,
            sigma,
            walk: 0.0,
            time_s: f64::INFINITY,
        }
    }

    /// The share that remains after `t` seconds.
    pub(super) fn keeps(&self, t: f64) -> f64 {
        if self.time_s.is_finite() {
            (-t / self.time_s).exp()
        } else {
            1.0
        }
    }

    /// Derivative of the error of the axis by this parameter.
    pub(super) fn value(&self, now: &Inputs, known: &AuxiliaryData) -> f64 {
        let input = match self.triad {
            Triad::Gyro => &now.rate,
            Triad::Accel => &now.force,
        };
        let block = &known.around.temperature;
        match self.regressor {
            Regressor::One => 1.0,
            Regressor::Input(axis) => input[axis],
            Regressor::Magnitude(axis) => input[axis].abs(),
            Regressor::Product(i, j) => input[i] * input[j],
            Regressor::Cube(axis) => input[axis].powi(3),
            Regressor::Hours => now.time / 3600.0,
            Regressor::Decay(tau) => (-now.time / tau).exp(),
            Regressor::Temperature => block.offset,
            Regressor::TemperatureSquare => block.offset * block.offset,
            Regressor::Heating => block.rate,
            Regressor::HeatingTemperature => block.rate * block.offset,
            Regressor::Gradient => block.gradient,
            Regressor::Force(axis) => now.force[axis],
            Regressor::Field(axis) => known.around.field[axis],
            Regressor::Arm(j) => {
                let (w, i) = (&now.rate, self.axis);
                let centre = if i == j { w.norm_squared() } else { 0.0 };
                w[i] * w[j] - centre + skew(&now.rate_change)[(i, j)]
            }
            Regressor::Vibration(axis) => known.vibration[axis],
            Regressor::Shaking => known.vibration.sum(),
            Regressor::Reading => known.readings[0][self.axis],
            Regressor::ReadingSquare => known.readings[0][self.axis].powi(2),
            Regressor::ReadingRate => known.readings[1][self.axis],
        }
    }
}
