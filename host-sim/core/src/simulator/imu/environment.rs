//! Error terms that follow the temperature of each sensor, its history, its age, vibration,
//! turning, or the square of the specific force: the tables `[simulation.gyro.environment]` and
//! `[simulation.accel.environment]`.
//!
//! They are tables of terms like [`super::datasheet`], and all are off unless the file has them.
//! `triad/environment` has the equations. No filter models these terms, not even the oracle that
//! models all others.

use super::term::{Datasheet, Group, Kind, Range, Term, datasheet};
use crate::inertial::units::{DEG, DEG_PER_H, G0, PPM, UG};
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
        /// Change of temperature from the middle of the loop to one side, K, > 0; a plain value.
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
        /// Time constant tau of the stretched warm-up, s, > 0: the median over units and axes.
        #[serde(default = "tau", skip_serializing_if = "is_tau")]
        stretched_warm_up_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_time = s.stretched_warm_up_time_s),
        /// Standard deviation of the logarithm of tau over units and axes.
        #[serde(default = "spread", skip_serializing_if = "is_spread")]
        stretched_warm_up_spread_ratio: Gyro::of(Group::Condition)
            .acts(|s, to| to.environment.warm_up_spread = s.stretched_warm_up_spread_ratio),
        /// Exponent beta of the stretched warm-up, > 0; a plain value. 1 is an exponential.
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
        /// Softening of the adhesive or potting that holds the sensing element: a bias
        /// `b / (1 + exp(-(T - centre) / width))`, deg/h. Above its glass transition the polymer
        /// lets go of its stress (Zhang, Park and Judy, J. Microelectromech. Syst. 16, 2007, on
        /// the stress of the die attach).
        #[serde(default, skip_serializing_if = "is_zero")]
        softening_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.softening_dph)
            .acts(|s, to| to.environment.softening = s.softening_dph * DEG_PER_H),
        /// Temperature at the middle of the transition, above that of the calibration, K; a plain
        /// value of the type.
        #[serde(default = "centre", skip_serializing_if = "is_centre")]
        softening_centre_k: Gyro::of(Group::Condition)
            .acts(|s, to| to.environment.softening_centre = s.softening_centre_k),
        /// Width of the transition, K, > 0; a plain value of the type.
        #[serde(default = "transition", skip_serializing_if = "is_transition")]
        softening_width_k: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.softening_width = s.softening_width_k),
        /// Bias by the temperature U of an inner point, which lags the temperature at the
        /// thermometer: `b U / 10 K + c (U / 10 K)^2`, each of b and c with this standard
        /// deviation, deg/h. The inner point is a capacity behind a conductance: a potted coil, a
        /// proof mass in gas (Incropera and DeWitt, chapter 5).
        #[serde(default, skip_serializing_if = "is_zero")]
        thermal_lag_dph: Gyro::of(Group::Thermal)
            .bias(|s| s.thermal_lag_dph)
            .acts(|s, to| to.environment.lag = s.thermal_lag_dph * DEG_PER_H),
        /// Time constant of that lag, s, > 0; a plain value of the type.
        #[serde(default = "lag", skip_serializing_if = "is_lag")]
        thermal_lag_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.lag_time = s.thermal_lag_time_s),
        /// Bias by vibration that saturates: `b v / (v + knee)`, deg/h; v is the mean square of the
        /// specific force about its mean in the last second, of all axes, with what is above the
        /// sample rate. A servo or a stop limits the rectification (vibration rectification, IEEE
        /// Std 1293).
        #[serde(default, skip_serializing_if = "is_zero")]
        vibration_saturation_dph: Gyro::of(Group::Nonlinear)
            .bias(|s| s.vibration_saturation_dph)
            .acts(|s, to| to.environment.shaken = s.vibration_saturation_dph * DEG_PER_H),
        /// Vibration that gives half of the limit, g^2, > 0; a plain value of the type. A road at
        /// 50 km/h has about the default.
        #[serde(default = "knee", skip_serializing_if = "is_knee")]
        vibration_knee_g2: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.shaken_knee = s.vibration_knee_g2 * (G0 * G0)),
        /// Self-heating: bias by the mean magnitude of the rate, which a lag smooths, deg/h for 1
        /// deg/s. A closed loop dissipates power by the rate.
        #[serde(default, skip_serializing_if = "is_zero")]
        self_heating_dphpdps: Gyro::of(Group::Thermal)
            .acts(|s, to| to.environment.turned = s.self_heating_dphpdps * DEG_PER_H / DEG),
        /// Time constant of that lag, s, > 0; a plain value of the type.
        #[serde(default = "self_lag", skip_serializing_if = "is_self_lag")]
        self_heating_time_s: Gyro::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.turned_time = s.self_heating_time_s),
        /// Bias by the squares of the specific force: each element of the matrix from the three
        /// squares in body axes, deg/h/g^2 (acceleration-squared-sensitive drift rate, IEEE Std
        /// 528).
        #[serde(default, skip_serializing_if = "is_zero")]
        g_square_dphpg2: Gyro::of(Group::Nonlinear),
        /// Ageing: random walk of the bias with the time since calibration, deg/h/sqrt(year).
        /// Datasheets give it as stability over a year (STIM300, TS1524).
        #[serde(default, skip_serializing_if = "is_zero")]
        ageing_dphpsqrtyr: Gyro::of(Group::Constant)
            .acts(|s, to| to.environment.ageing = s.ageing_dphpsqrtyr * DEG_PER_H),
        /// Steps: at one power-on in ten the bias changes for good by this much, deg/h (of units
        /// followed over 31 sessions, docs/REAL.md).
        #[serde(default, skip_serializing_if = "is_zero")]
        step_dph: Gyro::of(Group::Constant)
            .acts(|s, to| to.environment.step = s.step_dph * DEG_PER_H),
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
        /// Change of temperature from the middle of the loop to one side, K, > 0; a plain value.
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
        /// Time constant tau of the stretched warm-up, s, > 0: the median over units and axes.
        #[serde(default = "tau", skip_serializing_if = "is_tau")]
        stretched_warm_up_time_s: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_time = s.stretched_warm_up_time_s),
        /// Standard deviation of the logarithm of tau over units and axes.
        #[serde(default = "spread", skip_serializing_if = "is_spread")]
        stretched_warm_up_spread_ratio: Accel::of(Group::Condition)
            .acts(|s, to| to.environment.warm_up_spread = s.stretched_warm_up_spread_ratio),
        /// Exponent beta of the stretched warm-up, > 0; a plain value. 1 is an exponential.
        #[serde(default = "beta", skip_serializing_if = "is_beta")]
        stretched_warm_up_exponent_ratio: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.warm_up_exponent = s.stretched_warm_up_exponent_ratio),
        /// Softening of the adhesive or potting that holds the sensing element: a bias
        /// `b / (1 + exp(-(T - centre) / width))`, ug. Above its glass transition the polymer
        /// lets go of its stress (Zhang, Park and Judy, J. Microelectromech. Syst. 16, 2007, on
        /// the stress of the die attach).
        #[serde(default, skip_serializing_if = "is_zero")]
        softening_ug: Accel::of(Group::Thermal)
            .bias(|s| s.softening_ug)
            .acts(|s, to| to.environment.softening = s.softening_ug * UG),
        /// Temperature at the middle of the transition, above that of the calibration, K; a plain
        /// value of the type.
        #[serde(default = "centre", skip_serializing_if = "is_centre")]
        softening_centre_k: Accel::of(Group::Condition)
            .acts(|s, to| to.environment.softening_centre = s.softening_centre_k),
        /// Width of the transition, K, > 0; a plain value of the type.
        #[serde(default = "transition", skip_serializing_if = "is_transition")]
        softening_width_k: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.softening_width = s.softening_width_k),
        /// Bias by the temperature U of an inner point, which lags the temperature at the
        /// thermometer: `b U / 10 K + c (U / 10 K)^2`, each of b and c with this standard
        /// deviation, ug. The inner point is a capacity behind a conductance: a potted coil, a
        /// proof mass in gas (Incropera and DeWitt, chapter 5).
        #[serde(default, skip_serializing_if = "is_zero")]
        thermal_lag_ug: Accel::of(Group::Thermal)
            .bias(|s| s.thermal_lag_ug)
            .acts(|s, to| to.environment.lag = s.thermal_lag_ug * UG),
        /// Time constant of that lag, s, > 0; a plain value of the type.
        #[serde(default = "lag", skip_serializing_if = "is_lag")]
        thermal_lag_time_s: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.lag_time = s.thermal_lag_time_s),
        /// Bias by vibration that saturates: `b v / (v + knee)`, ug; v is the mean square of the
        /// specific force about its mean in the last second, of all axes, with what is above the
        /// sample rate. A servo or a stop limits the rectification (vibration rectification, IEEE
        /// Std 1293).
        #[serde(default, skip_serializing_if = "is_zero")]
        vibration_saturation_ug: Accel::of(Group::Nonlinear)
            .bias(|s| s.vibration_saturation_ug)
            .acts(|s, to| to.environment.shaken = s.vibration_saturation_ug * UG),
        /// Vibration that gives half of the limit, g^2, > 0; a plain value of the type. A road at
        /// 50 km/h has about the default.
        #[serde(default = "knee", skip_serializing_if = "is_knee")]
        vibration_knee_g2: Accel::of(Group::Condition)
            .within(Range::Positive)
            .acts(|s, to| to.environment.shaken_knee = s.vibration_knee_g2 * (G0 * G0)),
        /// Ageing: random walk of the bias with the time since calibration, ug/sqrt(year).
        /// Datasheets give it as stability over a year (STIM300, TS1524).
        #[serde(default, skip_serializing_if = "is_zero")]
        ageing_ugpsqrtyr: Accel::of(Group::Constant)
            .acts(|s, to| to.environment.ageing = s.ageing_ugpsqrtyr * UG),
        /// Steps: at one power-on in ten the bias changes for good by this much, ug.
        #[serde(default, skip_serializing_if = "is_zero")]
        step_ug: Accel::of(Group::Constant)
            .acts(|s, to| to.environment.step = s.step_ug * UG),
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
            softening_centre_k: centre(),
            softening_width_k: transition(),
            thermal_lag_time_s: lag(),
            vibration_knee_g2: knee(),
            self_heating_time_s: self_lag(),
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
            softening_centre_k: centre(),
            softening_width_k: transition(),
            thermal_lag_time_s: lag(),
            vibration_knee_g2: knee(),
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
    centre, is_centre = 12.0;
    transition, is_transition = 3.0;
    lag, is_lag = 1200.0;
    knee, is_knee = 0.002;
    self_lag, is_self_lag = 300.0;
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
