//! The errors that a simulated unit has at every turn-on, for filters that know them.

use super::triad::Triad;
use crate::inertial::ekf::{self, Parameter, Regressor};
use nalgebra::{Matrix3, Vector3};

/// The constants of one unit: a value for each parameter of a filter
/// ([`super::ImuSpec::parameters`]).
#[derive(Debug, Clone)]
pub struct UnitErrors {
    pub(super) gyro: Triad,
    pub(super) accel: Triad,
    pub(super) places: Option<[Vector3<f64>; 3]>,
    pub(super) g_sensitivity: Option<Matrix3<f64>>,
}

impl UnitErrors {
    /// The part of a parameter that belongs to the unit, SI. Biases that wander have none; for a
    /// warm-up it is the part that remains after a start as warm as this one.
    #[must_use]
    pub fn value(&self, p: &Parameter) -> f64 {
        let at = (p.axis, p.regressor);
        match (p.triad, at) {
            (ekf::Triad::Gyro, (axis, Regressor::Force(j))) => {
                self.g_sensitivity.map_or(0.0, |matrix| matrix[(axis, j)])
            }
            (ekf::Triad::Accel, (axis, Regressor::Arm(j))) => {
                self.places.map_or(0.0, |places| places[axis][j])
            }
            (ekf::Triad::Gyro, _) => self.gyro.of_unit(p),
            (ekf::Triad::Accel, _) => self.accel.of_unit(p),
        }
    }

    /// Standard deviation of the part that is new at this turn-on, SI. `value`: the unit's part.
    #[must_use]
    pub fn turn_on(&self, p: &Parameter, value: f64) -> f64 {
        match p.triad {
            ekf::Triad::Gyro => self.gyro.turn_on(p, value),
            ekf::Triad::Accel => self.accel.turn_on(p, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ErrorModelName, Imu, ImuSpec};
    use super::*;
    use crate::inertial::ekf::{AuxiliaryData, ErrorModel, Inputs, SlowErrors};
    use crate::inertial::sins::Increment;
    use nalgebra::DVector;

    /// Two turn-ons of one unit without any error that is new at a turn-on: the model's error for
    /// the unit's values is the simulated error, sample by sample.
    #[test]
    fn the_values_of_a_unit_make_its_errors() {
        let mut spec = ImuSpec::preset("medium").unwrap();
        spec.rate_hz = 10;
        let mut spec = spec.error_model(ErrorModelName::All);
        spec.gyro.g_sensitivity_dphpg = 0.1;
        for off in [
            &mut spec.gyro.bias_turn_on_dph,
            &mut spec.gyro.bias_drift_dph,
            &mut spec.gyro.rate_random_walk_dphpsqrth,
            &mut spec.gyro.warm_up_dph, // repeats to 10 %: below
            &mut spec.accel.bias_turn_on_ug,
            &mut spec.accel.bias_drift_ug,
            &mut spec.accel.acceleration_random_walk_ugpsqrth,
            &mut spec.accel.warm_up_ug,
            &mut spec.accel.vibration_rectification_ugpg2, // needs a second of samples
            &mut spec.accel.size_effect_mm,                // half a sample late
            &mut spec.accel.delay_s,
        ] {
            *off = 0.0;
        }
        for turn_on in [1, 2] {
            let mut imu = Imu::new(&spec, 77, turn_on);
            imu.set_field(Vector3::new(0.3, -0.1, 0.4));
            let unit = imu.unit_errors();
            let mut model = ErrorModel::default();
            model.extend(|axis, triad| spec.parameters(triad, axis));
            let theta = model.parameters.iter().map(|p| unit.value(p));
            let theta = DVector::from_vec(theta.collect());
            assert!(theta.iter().all(|value| *value != 0.0));
            assert!(model.parameters.iter().all(|p| unit.turn_on(p, 1.0) == 0.0));
            for k in 0..100 {
                let (x, dt) = (0.1 * f64::from(k % 7 - 3), 0.1);
                let (rate, force) = (Vector3::new(x, 0.2, -x), Vector3::new(2.0, x, -9.8));
                let perfect = Increment {
                    dtheta: rate * dt,
                    dv: force * dt,
                };
                let (_, got) = imu.measure(&perfect);
                model.known = vec![AuxiliaryData {
                    around: imu.surroundings(),
                    ..AuxiliaryData::default()
                }]
                .into();
                let now = Inputs {
                    rate,
                    force,
                    ..Inputs::default()
                };
                let [gyro, accel] = model.error(&theta, &now, &mut SlowErrors::default());
                // the g-sensitivity changes the gyros' input, on which their other errors act
                assert!((got.dtheta / dt - gyro).norm() < 1e-4 * gyro.norm(), "{k}");
                assert!((got.dv / dt - accel).norm() < 1e-9 * accel.norm(), "{k}");
            }
        }
    }

    #[test]
    fn what_is_new_at_a_turn_on_is_the_datasheets() {
        let spec = ImuSpec::preset("medium").unwrap();
        let unit = Imu::new(&spec, 5, 6).unit_errors();
        let parameters = spec.parameters(ekf::Triad::Gyro, 1);
        let of = |wanted: Regressor| parameters.iter().find(|p| p.regressor == wanted).unwrap();
        let dph = crate::inertial::units::DEG_PER_H;
        let bias = of(Regressor::One);
        assert!((unit.turn_on(bias, unit.value(bias)) / dph - 0.02).abs() < 1e-12);
        let drift = parameters.iter().find(|p| p.time_s == 3600.0).unwrap();
        assert_eq!(unit.value(drift), 0.0);
        assert!((unit.turn_on(drift, 0.0) / dph - 0.01).abs() < 1e-12);
        let decay = of(Regressor::Decay(900.0));
        let value = unit.value(decay);
        assert!((unit.turn_on(decay, value) / value.abs() - 0.1).abs() < 1e-12);
        let scale = of(Regressor::Input(1));
        assert_eq!(unit.turn_on(scale, unit.value(scale)), 0.0);
    }
}
