//! The error terms of gyros and accelerometers: one entry a number.
//!
//! An entry is the key in presets and scenario files, whose ending is the unit (`p` stands for
//! `per`). With it come the documentation, the group of errors, the range, how the number acts on a
//! triad, the parameters of a filter that models the error, and how much it adds to the bias that
//! other filters expect. The simulator, the oracle, the error groups, the checks and the tests
//! follow from these tables. A new error is an entry here. If no number of
//! [`Sigmas`](super::triad::Sigmas) acts as it does, it needs code in `triad`, too. The errors that
//! follow the temperature of each sensor, its history and its age have tables of the same kind in
//! [`super::environment`].

use super::dither::DitherSpec;
use super::environment::{AccelEnvironment, GyroEnvironment, is_off};
use super::term::{At, Group, Kind, Range, Term, datasheet};
use super::triad::{WARM_UP_REPEATABILITY, flicker};
use crate::inertial::ekf::{Parameter, Regressor};
use crate::inertial::units::{ARCSEC, DEG, DEG_PER_H, DEG_PER_SQRT_H, G0, PPM, UG, UG_PER_SQRT_HZ};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

type Gyro = Kind<GyroSpec>;
type Accel = Kind<AccelSpec>;

const SQUARE_G: f64 = G0 * G0;
/// Longest delay between the triads, s.
const LONGEST_DELAY_S: f64 = 0.1;

datasheet! {
    /// Statistics of a gyro triad. Values are standard deviations per axis unless a field says
    /// otherwise; all >= 0.
    GyroSpec in "gyro" {
        /// Bias of the unit, the same at every turn-on, deg/h.
        bias_unit_dph: Gyro::of(Group::Constant)
            .bias(|s| s.bias_unit_dph)
            .acts(|s, to| to.bias_unit = s.bias_unit_dph * DEG_PER_H)
            .parameters(|s, at| vec![Parameter {
                walk: s.rate_random_walk_dphpsqrth / 60.0 * DEG_PER_H,
                ..at.constant(
                    Regressor::One,
                    s.bias_unit_dph.hypot(s.bias_turn_on_dph) * DEG_PER_H,
                )
            }])
            .large(1.0),
        /// Bias that is new at every turn-on, deg/h.
        bias_turn_on_dph: Gyro::of(Group::Constant)
            .bias(|s| s.bias_turn_on_dph)
            .acts(|s, to| to.bias_turn_on = s.bias_turn_on_dph * DEG_PER_H),
        /// Rate random walk K, deg/h/sqrt(h); a plain value.
        #[serde(default)]
        rate_random_walk_dphpsqrth: Gyro::of(Group::Wander)
            .acts(|s, to| to.walk = s.rate_random_walk_dphpsqrth * DEG_PER_H / 60.0),
        /// In-run bias drift (first-order Gauss-Markov), deg/h.
        bias_drift_dph: Gyro::of(Group::Wander)
            .bias(|s| s.bias_drift_dph)
            .acts(|s, to| to.drift = s.bias_drift_dph * DEG_PER_H)
            .parameters(|s, at| drift(at, s.bias_drift_dph * DEG_PER_H, s.bias_drift_time_s)),
        /// Its time constant, s, > 0.
        bias_drift_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.drift_time = s.bias_drift_time_s),
        /// Bias instability B (flicker, 1/f noise), deg/h; a plain value. Its Allan deviation is
        /// flat at 0.664 B.
        #[serde(default, skip_serializing_if = "is_zero")]
        bias_instability_dph: Gyro::of(Group::Wander)
            .bias(|s| flicker::SPREAD * s.bias_instability_dph)
            .acts(|s, to| to.instability = s.bias_instability_dph * DEG_PER_H)
            .parameters(|s, at| instability(at, s.bias_instability_dph * DEG_PER_H)),
        /// Angle random walk without the part of lock-in (see [`DitherSpec`]), deg/sqrt(h); a plain
        /// value.
        angle_random_walk_dpsqrth: Gyro::of(Group::Noise)
            .acts(|s, to| to.noise = s.total_angle_random_walk_dpsqrth() * DEG_PER_SQRT_H),
        /// Warm-up: bias at power-on that decays, deg/h; repeats at every turn-on to 10 %.
        warm_up_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.warm_up_dph)
            .acts(|s, to| to.warm_up = s.warm_up_dph * DEG_PER_H)
            .parameters(|s, at| warm_up(at, s.warm_up_dph * DEG_PER_H, s.warm_up_time_s))
            .large(3.0),
        /// Its time constant, s, > 0; a plain value.
        warm_up_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.warm_up_time = s.warm_up_time_s),
        /// Scale factor asymmetry: error `a |rate|`, ppm.
        scale_asymmetry_ppm: Gyro::of(Group::Nonlinear)
            .acts(|s, to| to.asymmetry = s.scale_asymmetry_ppm * PPM)
            .parameters(|s, at| vec![
                at.constant(Regressor::Magnitude(at.axis), s.scale_asymmetry_ppm * PPM),
            ])
            .large(1000.0),
        /// Scale factor error, ppm.
        scale_ppm: Gyro::of(Group::Constant)
            .acts(|s, to| to.scale = s.scale_ppm * PPM)
            .parameters(|s, at| matrix(at, s.scale_ppm, s.misalignment_arcsec))
            .large(5000.0),
        /// Each off-diagonal element of the misalignment matrix, arcsec.
        misalignment_arcsec: Gyro::of(Group::Constant)
            .acts(|s, to| to.misalignment = s.misalignment_arcsec * ARCSEC)
            .large(300.0),
        /// Bias per kelvin of difference from the calibration temperature, deg/h/K.
        #[serde(default)]
        temperature_dphpk: Gyro::of(Group::Thermal)
            .acts(|s, to| to.thermal[0] = s.temperature_dphpk * DEG_PER_H)
            .parameters(|s, at| vec![
                at.constant(Regressor::Temperature, s.temperature_dphpk * DEG_PER_H),
            ])
            .large(0.2),
        /// Bias per squared difference from the calibration temperature, deg/h/K^2.
        #[serde(default)]
        temperature_dphpk2: Gyro::of(Group::Thermal)
            .acts(|s, to| to.thermal[1] = s.temperature_dphpk2 * DEG_PER_H)
            .parameters(|s, at| vec![
                at.constant(Regressor::TemperatureSquare, s.temperature_dphpk2 * DEG_PER_H),
            ])
            .large(0.02),
        /// Bias per heating rate of the block, deg/h/(K/min).
        #[serde(default)]
        heating_dphpkpmin: Gyro::of(Group::Thermal)
            .acts(|s, to| to.thermal[2] = s.heating_dphpkpmin * 60.0 * DEG_PER_H)
            .parameters(|s, at| vec![
                at.constant(Regressor::Heating, s.heating_dphpkpmin * 60.0 * DEG_PER_H),
            ])
            .large(3.0),
        /// Bias per product of heating rate and temperature, deg/h/(K^2/min).
        #[serde(default)]
        heating_temperature_dphpk2pmin: Gyro::of(Group::Thermal)
            .acts(|s, to| to.thermal[3] = s.heating_temperature_dphpk2pmin * 60.0 * DEG_PER_H)
            .parameters(|s, at| vec![at.constant(
                Regressor::HeatingTemperature,
                s.heating_temperature_dphpk2pmin * 60.0 * DEG_PER_H,
            )])
            .large(0.4),
        /// Bias per temperature difference across the block, deg/h/K.
        #[serde(default)]
        gradient_dphpk: Gyro::of(Group::Thermal)
            .acts(|s, to| to.thermal[4] = s.gradient_dphpk * DEG_PER_H)
            .parameters(|s, at| {
                vec![at.constant(Regressor::Gradient, s.gradient_dphpk * DEG_PER_H)]
            })
            .large(1.0),
        /// Scale factor non-linearity: error `n rate (rate / nonlinearity_rate)^2`, ppm.
        #[serde(default)]
        nonlinearity_ppm: Gyro::of(Group::Nonlinear)
            .acts(|s, to| to.cubic = s.cubic())
            .parameters(|s, at| vec![at.constant(Regressor::Cube(at.axis), s.cubic())])
            .large(2e5),
        /// Rate at which the non-linearity is given, deg/s, > 0; a plain value.
        #[serde(default = "hundred")]
        nonlinearity_rate_dps: Gyro::of(Group::Condition).within(Range::Positive),
        /// Bias per magnetic field: each element of the matrix from the field in body axes to the
        /// bias, deg/h/gauss.
        #[serde(default)]
        magnetic_dphpgauss: Gyro::of(Group::Other)
            .acts(|s, to| to.magnetic = s.magnetic_dphpgauss * DEG_PER_H)
            .parameters(|s, at| {
                let sigma = s.magnetic_dphpgauss * DEG_PER_H;
                (0..3).map(|j| at.constant(Regressor::Field(j), sigma)).collect()
            })
            .large(3.0),
        /// Bias per specific force: each element of the matrix from the specific force in body axes
        /// to the bias, deg/h/g.
        #[serde(default, skip_serializing_if = "is_zero")]
        g_sensitivity_dphpg: Gyro::of(Group::Other)
            .parameters(|s, at| {
                let sigma = s.g_sensitivity_dphpg * DEG_PER_H / G0;
                (0..3).map(|j| at.constant(Regressor::Force(j), sigma)).collect()
            })
            .large(1.0),
        /// Angle of one output pulse, arcsec, > 0; a plain value.
        pulse_arcsec: Gyro::of(Group::Noise)
            .within(Range::Positive)
            .acts(|s, to| to.pulse = s.pulse_arcsec * ARCSEC),
        ;
        /// Dither and lock-in.
        #[serde(default)]
        dither: DitherSpec,
        /// Errors by temperature, history, age and squares of the specific force. Off without this
        /// table.
        #[serde(default, skip_serializing_if = "is_off")]
        environment: GyroEnvironment
    }
}

impl GyroSpec {
    /// Whole angle random walk, of lock-in and of everything else, deg/sqrt(h): what a filter
    /// should expect.
    #[must_use]
    pub fn total_angle_random_walk_dpsqrth(&self) -> f64 {
        let lock_in = self.dither.angle_random_walk() / DEG_PER_SQRT_H;
        self.angle_random_walk_dpsqrth.hypot(lock_in)
    }

    /// Factor of the cube of the rate, 1/(rad/s)^2.
    fn cubic(&self) -> f64 {
        self.nonlinearity_ppm * PPM / (self.nonlinearity_rate_dps * DEG).powi(2)
    }
}

datasheet! {
    /// Statistics of an accelerometer triad. Values are standard deviations per axis unless a field
    /// says otherwise; all >= 0.
    AccelSpec in "accel" {
        /// Bias of the unit, the same at every turn-on, ug.
        bias_unit_ug: Accel::of(Group::Constant)
            .bias(|s| s.bias_unit_ug)
            .acts(|s, to| to.bias_unit = s.bias_unit_ug * UG)
            .parameters(|s, at| vec![Parameter {
                walk: s.acceleration_random_walk_ugpsqrth / 60.0 * UG,
                ..at.constant(Regressor::One, s.bias_unit_ug.hypot(s.bias_turn_on_ug) * UG)
            }]),
        /// Bias that is new at every turn-on, ug.
        bias_turn_on_ug: Accel::of(Group::Constant)
            .bias(|s| s.bias_turn_on_ug)
            .acts(|s, to| to.bias_turn_on = s.bias_turn_on_ug * UG),
        /// Acceleration random walk, ug/sqrt(h); a plain value.
        #[serde(default)]
        acceleration_random_walk_ugpsqrth: Accel::of(Group::Wander)
            .acts(|s, to| to.walk = s.acceleration_random_walk_ugpsqrth * UG / 60.0),
        /// In-run bias drift (first-order Gauss-Markov), ug.
        bias_drift_ug: Accel::of(Group::Wander)
            .bias(|s| s.bias_drift_ug)
            .acts(|s, to| to.drift = s.bias_drift_ug * UG)
            .parameters(|s, at| drift(at, s.bias_drift_ug * UG, s.bias_drift_time_s)),
        /// Its time constant, s, > 0.
        bias_drift_time_s: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.drift_time = s.bias_drift_time_s),
        /// Bias instability B (flicker, 1/f noise), ug; a plain value. Its Allan deviation is flat
        /// at 0.664 B.
        #[serde(default, skip_serializing_if = "is_zero")]
        bias_instability_ug: Accel::of(Group::Wander)
            .bias(|s| flicker::SPREAD * s.bias_instability_ug)
            .acts(|s, to| to.instability = s.bias_instability_ug * UG)
            .parameters(|s, at| instability(at, s.bias_instability_ug * UG)),
        /// Velocity random walk, ug/sqrt(Hz); a plain value.
        velocity_random_walk_ugpsqrthz: Accel::of(Group::Noise)
            .acts(|s, to| to.noise = s.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ),
        /// Warm-up: bias at power-on that decays, ug; repeats at every turn-on to 10 %.
        warm_up_ug: Accel::of(Group::Thermal)
            .bias(|s| s.warm_up_ug)
            .acts(|s, to| to.warm_up = s.warm_up_ug * UG)
            .parameters(|s, at| warm_up(at, s.warm_up_ug * UG, s.warm_up_time_s)),
        /// Its time constant, s, > 0; a plain value.
        warm_up_time_s: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.warm_up_time = s.warm_up_time_s),
        /// Scale factor asymmetry: error `a |f|`, ppm.
        scale_asymmetry_ppm: Accel::of(Group::Nonlinear)
            .acts(|s, to| to.asymmetry = s.scale_asymmetry_ppm * PPM)
            .parameters(|s, at| vec![
                at.constant(Regressor::Magnitude(at.axis), s.scale_asymmetry_ppm * PPM),
            ]),
        /// Scale factor error, ppm.
        scale_ppm: Accel::of(Group::Constant)
            .acts(|s, to| to.scale = s.scale_ppm * PPM)
            .parameters(|s, at| matrix(at, s.scale_ppm, s.misalignment_arcsec)),
        /// Each off-diagonal element of the misalignment matrix, arcsec.
        misalignment_arcsec: Accel::of(Group::Constant)
            .acts(|s, to| to.misalignment = s.misalignment_arcsec * ARCSEC),
        /// Bias per kelvin of difference from the calibration temperature, ug/K.
        #[serde(default)]
        temperature_ugpk: Accel::of(Group::Thermal)
            .acts(|s, to| to.thermal[0] = s.temperature_ugpk * UG)
            .parameters(|s, at| vec![at.constant(Regressor::Temperature, s.temperature_ugpk * UG)])
            .large(300.0),
        /// Bias per squared difference from the calibration temperature, ug/K^2.
        #[serde(default)]
        temperature_ugpk2: Accel::of(Group::Thermal)
            .acts(|s, to| to.thermal[1] = s.temperature_ugpk2 * UG)
            .parameters(|s, at| vec![
                at.constant(Regressor::TemperatureSquare, s.temperature_ugpk2 * UG),
            ]),
        /// Bias per heating rate of the block, ug/(K/min).
        #[serde(default)]
        heating_ugpkpmin: Accel::of(Group::Thermal)
            .acts(|s, to| to.thermal[2] = s.heating_ugpkpmin * 60.0 * UG)
            .parameters(|s, at| {
                vec![at.constant(Regressor::Heating, s.heating_ugpkpmin * 60.0 * UG)]
            }),
        /// Bias per product of heating rate and temperature, ug/(K^2/min).
        #[serde(default)]
        heating_temperature_ugpk2pmin: Accel::of(Group::Thermal)
            .acts(|s, to| to.thermal[3] = s.heating_temperature_ugpk2pmin * 60.0 * UG)
            .parameters(|s, at| vec![at.constant(
                Regressor::HeatingTemperature,
                s.heating_temperature_ugpk2pmin * 60.0 * UG,
            )]),
        /// Bias per temperature difference across the block, ug/K.
        #[serde(default)]
        gradient_ugpk: Accel::of(Group::Thermal)
            .acts(|s, to| to.thermal[4] = s.gradient_ugpk * UG)
            .parameters(|s, at| vec![at.constant(Regressor::Gradient, s.gradient_ugpk * UG)])
            .large(300.0),
        /// Second-order non-linearity K2, ug/g^2. It also rectifies the vibration that the samples
        /// contain.
        k2_ugpg2: Accel::of(Group::Nonlinear)
            .acts(|s, to| to.quadratic = s.k2_ugpg2 * UG / SQUARE_G)
            .parameters(|s, at| {
                let sigma = s.k2_ugpg2 * (UG / SQUARE_G);
                vec![at.constant(Regressor::Product(at.axis, at.axis), sigma)]
            })
            .large(3e4),
        /// Cross coupling K_ip: error `k f_i f_p` with the pendulous axis p of x, y, z along y, z,
        /// x (IEEE 1293), ug/g^2.
        #[serde(default)]
        cross_coupling_ugpg2: Accel::of(Group::Nonlinear)
            .acts(|s, to| to.cross = s.cross_coupling_ugpg2 * UG / SQUARE_G)
            .parameters(|s, at| {
                let sigma = s.cross_coupling_ugpg2 * (UG / SQUARE_G);
                vec![at.constant(Regressor::Product(at.axis, (at.axis + 1) % 3), sigma)]
            })
            .large(3e5),
        /// Rectification of the vibration above the sample rate, on which K2 does not act, ug/g^2
        /// rms.
        #[serde(default)]
        vibration_rectification_ugpg2: Accel::of(Group::Nonlinear)
            .acts(|s, to| to.rectification = s.vibration_rectification_ugpg2 * UG / SQUARE_G)
            .parameters(|s, at| {
                let rectified = s.vibration_rectification_ugpg2 * s.vibration_above_ratio;
                vec![at.constant(Regressor::Vibration(at.axis), rectified * (UG / SQUARE_G))]
            })
            .large(3e7),
        /// Mean square of the vibration above the sample rate over that of the last second's
        /// samples; a plain value.
        #[serde(default = "one")]
        vibration_above_ratio: Accel::of(Group::Condition)
            .acts(|s, to| to.above_ratio = s.vibration_above_ratio),
        /// Size effect: each component of the distance of each accelerometer from the common point,
        /// mm, after the compensation by the maker.
        #[serde(default)]
        size_effect_mm: Accel::of(Group::Other)
            .parameters(|s, at| {
                let sigma = 1e-3 * s.size_effect_mm;
                (0..3).map(|j| at.constant(Regressor::Arm(j), sigma)).collect()
            })
            .large(300.0),
        /// Delay of the accelerometer samples behind the gyro samples, s, at most 0.1; a plain
        /// value. Filters model it by
        /// [`ErrorModel::delay_s`](crate::inertial::ekf::ErrorModel::delay_s).
        #[serde(default)]
        delay_s: Accel::of(Group::Other).within(Range::UpTo(LONGEST_DELAY_S)).large(0.05),
        /// Velocity of one output pulse, ug s (1 ug s = 9.80665e-6 m/s), > 0; a plain value.
        pulse_ugs: Accel::of(Group::Noise)
            .within(Range::Positive)
            .acts(|s, to| to.pulse = s.pulse_ugs * UG),
        ;
        /// Errors by temperature, history and age. Off without this table.
        #[serde(default, skip_serializing_if = "is_off")]
        environment: AccelEnvironment
    }
}

/// A bias that drifts as a first-order Gauss-Markov process.
fn drift(at: At, sigma: f64, time_s: f64) -> Vec<Parameter> {
    vec![Parameter {
        walk: sigma * (2.0 / time_s).sqrt(),
        time_s,
        ..at.constant(Regressor::One, sigma)
    }]
}

/// Bias instability: the Gauss-Markov processes that it is made of.
fn instability(at: At, b: f64) -> Vec<Parameter> {
    let processes = flicker::times_s().into_iter();
    processes
        .flat_map(|time_s| drift(at, flicker::FLOOR * b, time_s))
        .collect()
}

/// A bias that decays after power-on, and by how much it differs from turn-on to turn-on.
fn warm_up(at: At, sigma: f64, time_s: f64) -> Vec<Parameter> {
    let sigma = sigma * 1f64.hypot(WARM_UP_REPEATABILITY);
    vec![at.constant(Regressor::Decay(time_s), sigma)]
}

/// A row of the matrix of scale factor and misalignment.
fn matrix(at: At, scale_ppm: f64, misalignment_arcsec: f64) -> Vec<Parameter> {
    let sigma = |j| match j == at.axis {
        true => scale_ppm * PPM,
        false => misalignment_arcsec * ARCSEC,
    };
    (0..3)
        .map(|j| at.constant(Regressor::Input(j), sigma(j)))
        .collect()
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the form that serde asks for"
)]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

fn one() -> f64 {
    1.0
}

fn hundred() -> f64 {
    100.0
}
