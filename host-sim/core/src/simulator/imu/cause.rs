//! Groups of errors with a single cause each, for campaigns that show which cause makes a scheme
//! fail.
//!
//! A group has the linear errors of the unit and one cause more. Its size is a share of the bias b
//! that a filter of the unit must expect. The shares are assumed: large enough to be visible beside
//! the biases. A size that the unit's table `environment` gives is taken instead. Of errors that
//! older files have, which may be too small to be visible, the larger size is taken.

use super::error_model::ErrorModelName;
use super::nodes::NodesSpec;
use super::spec::ImuSpec;

/// Adds a cause to an IMU with linear errors. `own` is the IMU with all its errors, `b` the
/// expected bias of gyros and accelerometers in the units of the file.
type Add = fn(spec: &mut ImuSpec, own: &ImuSpec, b: [f64; 2]);

/// The causes, and real power-ons.
const CAUSES: [(ErrorModelName, Add); 23] = [
    (ErrorModelName::Hysteresis, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.hysteresis_dph = given(gyro.hysteresis_dph, 0.2 * b[0]);
        spec.accel.environment.hysteresis_ug = given(accel.hysteresis_ug, 0.2 * b[1]);
    }),
    (ErrorModelName::Gradient, |spec, own, b| {
        spec.gyro.gradient_dphpk = own.gyro.gradient_dphpk.max(0.02 * b[0]);
        spec.accel.gradient_ugpk = own.accel.gradient_ugpk.max(0.02 * b[1]);
    }),
    (ErrorModelName::Heating, |spec, own, b| {
        spec.gyro.heating_dphpkpmin = own.gyro.heating_dphpkpmin.max(0.3 * b[0]);
        spec.accel.heating_ugpkpmin = own.accel.heating_ugpkpmin.max(0.3 * b[1]);
    }),
    (ErrorModelName::ScaleTemperature, |spec, own, _| {
        let (gyro, accel) = (&own.gyro, &own.accel);
        let g = given(
            gyro.environment.scale_temperature_ppmpk,
            0.1 * gyro.scale_ppm,
        );
        let a = given(
            accel.environment.scale_temperature_ppmpk,
            0.1 * accel.scale_ppm,
        );
        spec.gyro.environment.scale_temperature_ppmpk = g;
        spec.accel.environment.scale_temperature_ppmpk = a;
    }),
    (ErrorModelName::StretchedWarmUp, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.stretched_warm_up_dph = given(gyro.stretched_warm_up_dph, 0.5 * b[0]);
        spec.accel.environment.stretched_warm_up_ug = given(accel.stretched_warm_up_ug, 0.5 * b[1]);
    }),
    (ErrorModelName::ModeHop, |spec, own, b| {
        let gyro = &own.gyro.environment;
        spec.gyro.environment.mode_hop_dph = given(gyro.mode_hop_dph, 0.1 * b[0]);
        spec.gyro.environment.mode_deflection_dph = given(gyro.mode_deflection_dph, 0.1 * b[0]);
    }),
    (ErrorModelName::Thermostat, |spec, own, b| {
        spec.gyro.temperature_dphpk = own.gyro.temperature_dphpk.max(0.05 * b[0]);
        spec.accel.temperature_ugpk = own.accel.temperature_ugpk.max(0.05 * b[1]);
        let nodes = spec.nodes.get_or_insert_with(NodesSpec::typical);
        let rise = nodes.final_rise_k();
        nodes.heater_set_k = given(nodes.heater_set_k, 1.5 * rise);
        nodes.heater_band_k = given(nodes.heater_band_k, 2.0);
        nodes.heater_w = given(nodes.heater_w, 2.0 * nodes.power_w);
    }),
    (ErrorModelName::Flicker, |spec, own, b| {
        spec.gyro.bias_instability_dph = own.gyro.bias_instability_dph.max(0.05 * b[0]);
        spec.accel.bias_instability_ug = own.accel.bias_instability_ug.max(0.05 * b[1]);
    }),
    (ErrorModelName::GSquare, |spec, own, b| {
        let own = own.gyro.environment.g_square_dphpg2;
        spec.gyro.environment.g_square_dphpg2 = given(own, 0.2 * b[0]);
    }),
    (ErrorModelName::Ageing, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.ageing_dphpsqrtyr = given(gyro.ageing_dphpsqrtyr, b[0]);
        spec.accel.environment.ageing_ugpsqrtyr = given(accel.ageing_ugpsqrtyr, b[1]);
        spec.world.power.age_days = given(own.world.power.age_days, 365.0);
    }),
    (ErrorModelName::Temperature, |spec, own, b| {
        let (gyro, accel) = (&own.gyro, &own.accel);
        spec.gyro.temperature_dphpk = gyro.temperature_dphpk.max(0.02 * b[0]);
        spec.gyro.temperature_dphpk2 = gyro.temperature_dphpk2.max(0.001 * b[0]);
        spec.accel.temperature_ugpk = accel.temperature_ugpk.max(0.02 * b[1]);
        spec.accel.temperature_ugpk2 = accel.temperature_ugpk2.max(0.001 * b[1]);
    }),
    (ErrorModelName::WarmUp, |spec, own, b| {
        spec.gyro.warm_up_dph = own.gyro.warm_up_dph.max(0.5 * b[0]);
        spec.accel.warm_up_ug = own.accel.warm_up_ug.max(0.5 * b[1]);
    }),
    (ErrorModelName::GSensitivity, |spec, own, b| {
        spec.gyro.g_sensitivity_dphpg = own.gyro.g_sensitivity_dphpg.max(0.3 * b[0]);
    }),
    (ErrorModelName::Magnetic, |spec, own, b| {
        spec.gyro.magnetic_dphpgauss = own.gyro.magnetic_dphpgauss.max(0.5 * b[0]);
    }),
    (ErrorModelName::Dither, |spec, own, _| {
        let own = own.gyro.dither.strip_residual_arcsec;
        spec.gyro.dither.strip_residual_arcsec = own.max(1.0);
    }),
    (ErrorModelName::Vibration, |spec, own, b| {
        let own = own.accel.vibration_rectification_ugpg2;
        spec.accel.vibration_rectification_ugpg2 = own.max(20.0 * b[1]);
    }),
    (ErrorModelName::SizeEffect, |spec, own, _| {
        spec.accel.size_effect_mm = own.accel.size_effect_mm.max(30.0);
    }),
    (ErrorModelName::Timing, |spec, own, _| {
        spec.accel.delay_s = own.accel.delay_s.max(2e-3);
    }),
    (ErrorModelName::Softening, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.softening_dph = given(gyro.softening_dph, b[0]);
        spec.accel.environment.softening_ug = given(accel.softening_ug, b[1]);
    }),
    (ErrorModelName::ThermalLag, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.thermal_lag_dph = given(gyro.thermal_lag_dph, 0.5 * b[0]);
        spec.accel.environment.thermal_lag_ug = given(accel.thermal_lag_ug, 0.5 * b[1]);
    }),
    (ErrorModelName::VibrationSaturation, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.environment.vibration_saturation_dph = given(gyro.vibration_saturation_dph, b[0]);
        spec.accel.environment.vibration_saturation_ug = given(accel.vibration_saturation_ug, b[1]);
    }),
    (ErrorModelName::SelfHeating, |spec, own, b| {
        let own = own.gyro.environment.self_heating_dphpdps;
        spec.gyro.environment.self_heating_dphpdps = given(own, 0.3 * b[0]);
    }),
    // Five recorded MEMS units over 31 sessions, with biases of 0.5 to 2 deg/s: new at a power-on
    // 0.003 to 0.05 deg/s, median 0.015; steps of 0.2 of a sigma; 0.25 of it in four months
    (ErrorModelName::Real, |spec, own, b| {
        let (gyro, accel) = (&own.gyro.environment, &own.accel.environment);
        spec.gyro.bias_turn_on_dph = 0.015 * b[0];
        spec.accel.bias_turn_on_ug = 0.015 * b[1];
        spec.gyro.environment.step_dph = given(gyro.step_dph, 0.2 * b[0]);
        spec.accel.environment.step_ug = given(accel.step_ug, 0.2 * b[1]);
        spec.gyro.environment.ageing_dphpsqrtyr = given(gyro.ageing_dphpsqrtyr, 0.44 * b[0]);
        spec.accel.environment.ageing_ugpsqrtyr = given(accel.ageing_ugpsqrtyr, 0.44 * b[1]);
        // a power-on a day
        let power = &mut spec.world.power;
        power.age_days = given(power.age_days, 120.0) + f64::from(power.power_ons);
    }),
];

fn given(own: f64, typical: f64) -> f64 {
    if own > 0.0 { own } else { typical }
}

impl ImuSpec {
    /// Adds the cause of a group, if it has one, to an IMU with the linear errors of `own`. The
    /// nodes are there, too, because without them nothing warms up.
    pub(super) fn add_cause(&mut self, name: ErrorModelName, own: &Self) {
        if let Some((_, add)) = CAUSES.iter().find(|(cause, _)| *cause == name) {
            self.nodes.get_or_insert_with(NodesSpec::typical);
            add(self, own, own.expected_bias());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Imu, PRESETS};
    use super::*;
    use crate::inertial::sins::Increment;
    use crate::inertial::units::{DEG_PER_H, G0, UG};
    use nalgebra::Vector3;

    /// The remaining dither is no systematic error; it is visible in the samples only.
    fn shows_in_samples(name: ErrorModelName) -> bool {
        name == ErrorModelName::Dither
    }

    /// Every group of a single cause differs from `linear` by that cause, is in range, and has an
    /// effect: in some second of an hour of turning and shaking the errors of the gyros or of the
    /// accelerometers differ by more than half a per cent of their bias.
    #[test]
    fn each_group_adds_its_cause_to_the_linear_errors() {
        let (names, real) = CAUSES.split_at(ErrorModelName::CAUSES.len());
        let names: Vec<_> = names.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ErrorModelName::CAUSES);
        assert_eq!(real.len(), 1);
        for (preset, _) in PRESETS {
            let mut unit = ImuSpec::preset(preset).unwrap();
            unit.rate_hz = 10;
            let mut linear = unit.error_model(ErrorModelName::Linear);
            linear.nodes.get_or_insert_with(NodesSpec::typical);
            let felt = |spec: &ImuSpec| {
                let mut imu = Imu::new(spec, 1, 2);
                imu.set_field(Vector3::new(0.3, 0.1, 0.4));
                let shake = |k: i32| f64::from(k % 3 - 1) * 0.05;
                let input = |k: i32| Increment {
                    dtheta: Vector3::repeat(0.01),
                    dv: Vector3::new(0.05, 0.1 + shake(k), shake(k) - 1.0) * (0.1 * G0),
                };
                let all = (0..36_000).map(|k| imu.measure(&input(k)));
                all.skip(1000).step_by(100).collect::<Vec<_>>()
            };
            let without = felt(&linear);
            for name in ErrorModelName::CAUSES {
                let spec = unit.error_model(name);
                spec.check().unwrap();
                assert_ne!(spec, linear, "{preset}: {name}");
                let with = felt(&spec);
                let pairs = || without.iter().zip(&with);
                if shows_in_samples(name) {
                    assert!(pairs().any(|(a, b)| a.0 != b.0), "{preset} {name}");
                    continue;
                }
                let most = |of: fn(&Increment) -> Vector3<f64>| {
                    let errors = pairs().map(|(a, b)| (of(&a.1) - of(&b.1)).norm() * 10.0);
                    errors.fold(0.0, f64::max)
                };
                let [gyro, accel] = unit.expected_bias();
                let shares = [
                    most(|w| w.dtheta) / DEG_PER_H / gyro,
                    most(|w| w.dv) / UG / accel,
                ];
                println!("{preset} {name}: {shares:?} of the biases");
                assert!(
                    shares[0].max(shares[1]) > 0.005,
                    "{preset} {name}: {shares:?}"
                );
            }
        }
    }

    #[test]
    fn the_size_of_the_file_is_taken() {
        let mut unit = ImuSpec::preset("medium").unwrap();
        unit.gyro.environment.hysteresis_dph = 0.007;
        let spec = unit.error_model(ErrorModelName::Hysteresis);
        assert_eq!(spec.gyro.environment.hysteresis_dph, 0.007);
        assert_eq!(
            unit.error_model(ErrorModelName::Linear)
                .gyro
                .environment
                .hysteresis_dph,
            0.0
        );
        assert_eq!(unit.error_model(ErrorModelName::Linear).nodes, None);
    }
}
