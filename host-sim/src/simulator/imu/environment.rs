//! Error terms that follow the temperature of each sensor, its past, its age, or the square of the
//! specific force: the tables `[simulation.gyro.environment]` and `[simulation.accel.environment]`.
//!
//! They are tables of terms like [`super::datasheet`], and all are off unless the file has them.
//! `triad/environment` has the equations. Filters are not told of these terms: an oracle that is
//! told of everything else does not know them.

use super::term::{Datasheet, Group, Kind, Range, Term, datasheet};
use crate::inertial::units::{DEG_PER_H, PPM, UG};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

type Gyro = Kind<GyroEnvironment>;
type Accel = Kind<AccelEnvironment>;

/// Days of a year.
pub(super) const YEAR_DAYS: f64 = 365.25;

datasheet! {
    /// Errors of a gyro triad by its environment. Values are standard deviations per axis unless a
    /// field says otherwise; all >= 0.
    GyroEnvironment in "gyro.environment" {
        /// Thermal hysteresis: half of the difference between the biases while warming and while
        /// cooling, deg/h. A play operator (Krasnosel'skii, Pokrovskii 1989). An uncompensated
        /// MEMS gyro has some 0.1 deg/s (ADIS16460, Analog Devices EngineerZone).
        #[serde(default, skip_serializing_if = "is_zero")]
        hysteresis_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.hysteresis_dph)
            .acts(|s, to| to.environment.hysteresis = s.hysteresis_dph * DEG_PER_H),
        /// Change of temperature that takes it from the middle of the loop to one side, K, > 0; a
        /// plain value.
        #[serde(default = "width", skip_serializing_if = "is_width")]
        hysteresis_width_k: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.hysteresis_width = s.hysteresis_width_k),
        /// Scale factor by temperature: error `k T rate`, ppm/K (scale factor temperature
        /// sensitivity, IEEE Std 528).
        #[serde(default, skip_serializing_if = "is_zero")]
        scale_temperature_ppmpk: Gyro::of(Group::Thermal)
            .acts(|s, to| to.environment.scale_temperature = s.scale_temperature_ppmpk * PPM),
        /// Warm-up that is no exponential: `b exp(-(t / tau)^beta)` (Kohlrausch), deg/h; repeats at
        /// every turn-on to 10 %.
        #[serde(default, skip_serializing_if = "is_zero")]
        stretched_warm_up_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.stretched_warm_up_dph)
            .acts(|s, to| to.environment.warm_up = s.stretched_warm_up_dph * DEG_PER_H),
        /// Its time tau, s, > 0: the median over units and axes.
        #[serde(default = "tau", skip_serializing_if = "is_tau")]
        stretched_warm_up_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_time = s.stretched_warm_up_time_s),
        /// Standard deviation of the logarithm of tau over units and axes.
        #[serde(default = "spread", skip_serializing_if = "is_spread")]
        stretched_warm_up_spread_ratio: Gyro::of(Group::Condition)
            .acts(|s, to| to.environment.warm_up_spread = s.stretched_warm_up_spread_ratio),
        /// Its exponent beta, > 0; a plain value. 1 is an exponential.
        #[serde(default = "beta", skip_serializing_if = "is_beta")]
        stretched_warm_up_exponent_ratio: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_exponent = s.stretched_warm_up_exponent_ratio),
        /// Bias of each longitudinal mode that the path-length control of a laser gyro may hold,
        /// deg/h. It changes when the control hops (Aronowitz, RTO AGARDograph 339, 1999).
        #[serde(default, skip_serializing_if = "is_zero")]
        mode_hop_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.mode_hop_dph)
            .acts(|s, to| to.environment.mode_bias = s.mode_hop_dph * DEG_PER_H),
        /// Bias by the deflection of the path-length control, deg/h for one mode.
        #[serde(default, skip_serializing_if = "is_zero")]
        mode_deflection_dph: Gyro::of(Group::Thermal)
            .acts(|s, to| to.environment.mode_deflection = s.mode_deflection_dph * DEG_PER_H),
        /// Change of temperature that makes the path one wavelength longer, K, > 0; a plain value.
        /// `lambda / (alpha L)`: 22.6 K for 632.8 nm, 28 cm and 1e-7 /K.
        #[serde(default = "mode", skip_serializing_if = "is_mode")]
        mode_k: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.mode_width = s.mode_k),
        /// Bias by the squares of the specific force: each element of the matrix from the three
        /// squares in body axes, deg/h/g^2 (acceleration-squared-sensitive drift rate, IEEE Std
        /// 528).
        #[serde(default, skip_serializing_if = "is_zero")]
        g_square_dphpg2: Gyro::of(Group::Nonlinear),
        /// Ageing: random walk of the bias with the time since calibration, deg/h/sqrt(year).
        /// Datasheets tell it as stability over a year (STIM300, TS1524).
        #[serde(default, skip_serializing_if = "is_zero")]
        ageing_dphpsqrtyr: Gyro::of(Group::Constant)
            .acts(|s, to| to.environment.ageing = s.ageing_dphpsqrtyr * DEG_PER_H),
    }
}

datasheet! {
    /// Errors of an accelerometer triad by its environment. Values are standard deviations per axis
    /// unless a field says otherwise; all >= 0.
    AccelEnvironment in "accel.environment" {
        /// Thermal hysteresis: half of the difference between the biases while warming and while
        /// cooling, ug.
        #[serde(default, skip_serializing_if = "is_zero")]
        hysteresis_ug: Accel::of(Group::Thermal)
            .bias(|s| s.hysteresis_ug)
            .acts(|s, to| to.environment.hysteresis = s.hysteresis_ug * UG),
        /// Change of temperature that takes it from the middle of the loop to one side, K, > 0; a
        /// plain value.
        #[serde(default = "width", skip_serializing_if = "is_width")]
        hysteresis_width_k: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.hysteresis_width = s.hysteresis_width_k),
        /// Scale factor by temperature: error `k T f`, ppm/K (IEEE Std 528).
        #[serde(default, skip_serializing_if = "is_zero")]
        scale_temperature_ppmpk: Accel::of(Group::Thermal)
            .acts(|s, to| to.environment.scale_temperature = s.scale_temperature_ppmpk * PPM),
        /// Warm-up that is no exponential: `b exp(-(t / tau)^beta)` (Kohlrausch), ug; repeats at
        /// every turn-on to 10 %.
        #[serde(default, skip_serializing_if = "is_zero")]
        stretched_warm_up_ug: Accel::of(Group::Thermal)
            .bias(|s| s.stretched_warm_up_ug)
            .acts(|s, to| to.environment.warm_up = s.stretched_warm_up_ug * UG),
        /// Its time tau, s, > 0: the median over units and axes.
        #[serde(default = "tau", skip_serializing_if = "is_tau")]
        stretched_warm_up_time_s: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_time = s.stretched_warm_up_time_s),
        /// Standard deviation of the logarithm of tau over units and axes.
        #[serde(default = "spread", skip_serializing_if = "is_spread")]
        stretched_warm_up_spread_ratio: Accel::of(Group::Condition)
            .acts(|s, to| to.environment.warm_up_spread = s.stretched_warm_up_spread_ratio),
        /// Its exponent beta, > 0; a plain value. 1 is an exponential.
        #[serde(default = "beta", skip_serializing_if = "is_beta")]
        stretched_warm_up_exponent_ratio: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_exponent = s.stretched_warm_up_exponent_ratio),
        /// Ageing: random walk of the bias with the time since calibration, ug/sqrt(year).
        /// Datasheets tell it as stability over a year (STIM300, TS1524).
        #[serde(default, skip_serializing_if = "is_zero")]
        ageing_ugpsqrtyr: Accel::of(Group::Constant)
            .acts(|s, to| to.environment.ageing = s.ageing_ugpsqrtyr * UG),
    }
}

impl Default for GyroEnvironment {
    /// No errors. Times and widths are those of a file that does not give them.
    fn default() -> Self {
        Self {
            hysteresis_width_k: width(),
            stretched_warm_up_time_s: tau(),
            stretched_warm_up_spread_ratio: spread(),
            stretched_warm_up_exponent_ratio: beta(),
            mode_k: mode(),
            ..Self::none()
        }
    }
}

impl Default for AccelEnvironment {
    /// No errors. Times and widths are those of a file that does not give them.
    fn default() -> Self {
        Self {
            hysteresis_width_k: width(),
            stretched_warm_up_time_s: tau(),
            stretched_warm_up_spread_ratio: spread(),
            stretched_warm_up_exponent_ratio: beta(),
            ..Self::none()
        }
    }
}

/// Values of conditions that a file does not give, and whether a value is that one.
macro_rules! unless_given {
    ($($value:ident, $is:ident = $number:expr;)+) => {
        $(
            fn $value() -> f64 {
                $number
            }

            fn $is(x: &f64) -> bool {
                x.to_bits() == f64::to_bits($number)
            }
        )+
    };
}

unless_given! {
    width, is_width = 5.0;
    tau, is_tau = 1200.0;
    spread, is_spread = 0.3;
    beta, is_beta = 0.6;
    mode, is_mode = 22.6;
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the form that serde asks for"
)]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Whether all terms of a table are off; then it is left out of files.
pub(super) fn is_off<S: Datasheet>(sheet: &S) -> bool {
    let mut sheet = sheet.clone();
    let mut terms = S::TERMS.iter().filter(|t| t.group() != Group::Condition);
    terms.all(|term| *term.of(&mut sheet) == 0.0)
}
