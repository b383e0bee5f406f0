//! Groups of errors with a single cause each, for campaigns that ask under which one a scheme
//! falls.
//!
//! A group has the linear errors of the unit and one cause more. Its size is a share of the bias b
//! that a filter of the unit must expect. The shares are assumed: large enough to be seen beside
//! the biases. A size that the unit's table `environment` gives is taken instead. Of errors that
//! older files have, which may be too small to be seen, the larger size is taken.

use super::error_model::ErrorModelName;
use super::nodes::NodesSpec;
use super::spec::ImuSpec;

/// What a cause adds to an IMU with linear errors. `own` is the IMU with all its errors, `b` the
/// expected bias of gyros and accelerometers in the units of the file.
type Add = fn(spec: &mut ImuSpec, own: &ImuSpec, b: [f64; 2]);

/// The causes.
const CAUSES: [(ErrorModelName, Add); 10] = [
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
    use crate::inertial::units::G0;
    use nalgebra::Vector3;

    /// Every group of a single cause differs from `linear` by that cause, is in range, and is felt:
    /// in some second of an hour the errors differ by more than half a per cent of the bias.
    #[test]
    fn each_group_adds_its_cause_to_the_linear_errors() {
        assert_eq!(CAUSES.map(|(name, _)| name), ErrorModelName::CAUSES);
        for (preset, _) in PRESETS {
            let mut unit = ImuSpec::preset(preset).unwrap();
            unit.rate_hz = 10;
            let mut linear = unit.error_model(ErrorModelName::Linear);
            linear.nodes.get_or_insert_with(NodesSpec::typical);
            let felt = |spec: &ImuSpec| {
                let mut imu = Imu::new(spec, 1, 2);
                let input = Increment {
                    dtheta: Vector3::repeat(0.01),
                    dv: Vector3::new(0.05, 0.1, -1.0) * (0.1 * G0),
                };
                let all = (0..36_000).map(|_| imu.measure(&input).1);
                all.skip(1000).step_by(100).collect::<Vec<_>>()
            };
            let without = felt(&linear);
            for name in ErrorModelName::CAUSES {
                let spec = unit.error_model(name);
                spec.check().unwrap();
                assert_ne!(spec, linear, "{preset}: {name}");
                let with = felt(&spec);
                let pairs = without.iter().zip(&with);
                let most = pairs.map(|(a, b)| (a.dtheta - b.dtheta).norm() * 10.0);
                let most = most.fold(0.0, f64::max) / crate::inertial::units::DEG_PER_H;
                let bias = unit.expected_bias()[0];
                println!("{preset} {name}: {most:.4} deg/h of {bias:.4}");
                assert!(
                    most > 0.005 * bias,
                    "{preset} {name}: {most} of {bias} deg/h"
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
