//! Settings of the learner from fixes.

use super::bank::{Gates, Sizes};
use super::prior::{Datasheet, TURN_ON};
use crate::align::Sensors;
use crate::configuration::{Configuration, Triad, UNKNOWN, VehicleKind};
use crate::inputs::{Inputs, OWN};
use crate::nav::Noise;

/// Settings of the learner: sensors and receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Inputs of the networks.
    pub inputs: Inputs,
    /// Biases and ranges of the sensors.
    pub sheet: Datasheet,
    /// White noise of the sensors.
    pub noise: Noise,
    /// Limits at which an observation is refused and a hypothesis is promoted.
    pub gates: Gates,
    /// Length of an alignment that is not commanded, s, >= [`crate::align::LEAST_S`].
    pub align_s: f64,
    /// Least age of a fix when it arrives, s, 0 to 1. What a fix is later than the earliest is
    /// measured: see [`super::age`].
    pub fix_age_s: f32,
    /// Standard deviation of that least age, s, >= 0. 0: it is known exactly.
    pub fix_age_sigma: f32,
    /// Bias of the gyros by specific force, rad/s per m/s2.
    pub g_sensitivity: f32,
    /// Kind of the vehicle, and its forward axis in the sensor's axes: a unit vector, zero where
    /// the mounting is unknown.
    pub vehicle: VehicleKind,
    /// See [`Self::vehicle`].
    pub forward: [f32; 3],
    /// Lever arm from the IMU to the receiver's antenna in the sensor's axes, m.
    pub lever_arm: [f32; 3],
    /// Standard deviation of the lever arm along each axis, m, >= 0. 0: it is known exactly.
    pub lever_arm_sigma: f32,
    /// Rotation from the sensor's axes to body axes: unit quaternion w, x, y, z. Only for what the
    /// learner reports.
    pub mounting: [f32; 4],
    /// Wheels whose speed is reported.
    pub wheels: Option<Wheels>,
}

/// Wheels in the sensor's axes: see [`crate::configuration::Wheels`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheels {
    /// From the IMU to the axle that does not steer, m.
    pub lever_arm: [f32; 3],
    /// The vehicle's forward, right and down axis: unit vectors; `None` where the mounting is
    /// unknown.
    pub axes: Option<[[f32; 3]; 3]>,
    /// Distance of the measured axle ahead of that one, m.
    pub ahead: f32,
    /// Standard deviation of the speed's scale, as a ratio.
    pub scale: f32,
    /// Standard deviation of a speed, m/s.
    pub noise: f32,
    /// Age of a speed when its message leaves, beyond what that says, s.
    pub delay: f32,
}

impl Wheels {
    fn of(configuration: &Configuration) -> Option<Wheels> {
        let wheels = configuration.wheels?;
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Some(Wheels {
            lever_arm: configuration.in_sensor_axes(wheels.lever_arm),
            axes: (configuration.mounting != UNKNOWN)
                .then(|| axes.map(|axis| configuration.in_sensor_axes(axis))),
            ahead: wheels.ahead,
            scale: wheels.scale,
            noise: wheels.noise,
            delay: wheels.delay,
        })
    }
}

/// Rate (rad/s) and change of specific force (m/s2) that are usual in a vehicle: the networks'
/// inputs are near 1 there (assumed).
pub(crate) const fn usual(kind: VehicleKind) -> [f32; 2] {
    match kind {
        VehicleKind::Land => [0.2, 2.0],
        VehicleKind::Ship => [0.1, 1.0],
        VehicleKind::Air => [0.5, 5.0],
    }
}

/// Standard gravity as the networks see it, m/s2.
const GRAVITY: f32 = 9.8;

impl Settings {
    /// The medium laser-gyro IMU of `host-sim` (preset `medium`): 0.34 deg/h, 410 ug, 0.005
    /// deg/sqrt(h), 20 ug/sqrt(Hz). A receiver whose messages come after 100 ms, as at 115 200
    /// baud.
    pub const MEDIUM: Settings = Settings {
        inputs: OWN,
        sheet: Datasheet {
            scale: [20e-6, 100e-6],
            misalignment: [5e-5; 2],
            ..Datasheet::land_vehicle(1.63e-6, 4e-3)
        },
        noise: Noise {
            gyro: 1.46e-6,
            accel: 1.96e-4,
        },
        gates: Gates::USUAL,
        align_s: 100.0,
        g_sensitivity: 0.0,
        vehicle: VehicleKind::Land,
        forward: [1.0, 0.0, 0.0],
        fix_age_s: 0.1,
        fix_age_sigma: 0.0,
        lever_arm: [0.0; 3],
        lever_arm_sigma: 0.0,
        mounting: [1.0, 0.0, 0.0, 0.0],
        wheels: None,
    };

    /// Settings by a unit's configuration. A bias is the root of the squares of its part that is
    /// drawn at power-on and of its walk in an hour. The learner works in the sensor's own axes.
    #[must_use]
    pub fn of(configuration: &Configuration) -> Settings {
        let [gyro_bias, accel_bias] = [&configuration.gyro, &configuration.accel].map(bias);
        let share = |triad: &Triad, bias: f32| triad.bias_in_run / bias;
        let [rate, force] = usual(configuration.vehicle.kind);
        Settings {
            inputs: configuration.inputs,
            sheet: Datasheet {
                gyro_bias,
                accel_bias,
                walk_per_hour: [
                    share(&configuration.gyro, gyro_bias),
                    share(&configuration.accel, accel_bias),
                ],
                gravity: configuration.direction([0.0, 0.0, -GRAVITY]),
                range: [
                    rate.min(configuration.gyro.range),
                    force.min(configuration.accel.range),
                ],
                turn_on: TURN_ON,
                scale: [configuration.gyro.scale, configuration.accel.scale],
                misalignment: [
                    configuration.gyro.misalignment,
                    configuration.accel.misalignment,
                ],
            },
            noise: Noise {
                gyro: configuration.gyro.white_noise,
                accel: configuration.accel.white_noise,
            },
            gates: Gates::USUAL,
            align_s: f64::from(configuration.correction.align),
            g_sensitivity: configuration.gyro.g_sensitivity,
            vehicle: configuration.vehicle.kind,
            forward: configuration.direction([1.0, 0.0, 0.0]),
            fix_age_s: configuration.receiver.fix_delay,
            fix_age_sigma: configuration.receiver.fix_delay_sigma,
            lever_arm: configuration.in_sensor_axes(configuration.receiver.lever_arm),
            lever_arm_sigma: configuration.receiver.lever_arm_sigma,
            mounting: configuration.mounting,
            wheels: Wheels::of(configuration),
        }
    }

    /// Errors of gyros and accelerometers in proportion to the motion, as ratios: scale factor and
    /// misalignment together.
    #[must_use]
    pub fn in_proportion(&self) -> [f32; 2] {
        let Datasheet {
            scale,
            misalignment,
            ..
        } = self.sheet;
        [0, 1].map(|k| libm::hypotf(scale[k], misalignment[k]))
    }

    /// Errors in proportion to what the sensors feel, which most hypotheses do not estimate.
    pub(super) fn considered(&self) -> Sizes {
        Sizes {
            scale: self.sheet.scale,
            misalignment: self.sheet.misalignment,
            g_sensitivity: self.g_sensitivity,
        }
    }

    /// Datasheet for the alignment and the standstill detector.
    #[must_use]
    pub fn sensors(&self) -> Sensors {
        Sensors {
            noise: [self.noise.gyro, self.noise.accel],
            bias: [self.sheet.gyro_bias, self.sheet.accel_bias],
            walk: self.sheet.gyro_walk(),
        }
    }
}

/// Standard deviation of a bias, all its causes together.
fn bias(triad: &Triad) -> f32 {
    libm::hypotf(triad.bias_turn_on, triad.bias_in_run)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The learner's numbers for the medium laser gyro are those it has been tested with.
    #[test]
    fn the_default_configuration_is_the_medium_laser_gyro() {
        let of = Settings::of(&Configuration::default());
        assert_eq!(of, Settings::MEDIUM);
        let bits = |settings: &Settings| {
            let Datasheet {
                gyro_bias,
                accel_bias,
                walk_per_hour: [gyro, accel],
                gravity: [x, y, z],
                range: [rate, force],
                turn_on: [new, fresh],
                ..
            } = settings.sheet;
            let sheet = [
                gyro_bias, accel_bias, gyro, accel, x, y, z, rate, force, new, fresh,
            ];
            sheet.map(f32::to_bits)
        };
        assert_eq!(bits(&of), bits(&Settings::MEDIUM));
    }

    #[test]
    fn every_triad_has_its_own_walk_and_the_axes_are_the_sensors() {
        let mut configuration = Configuration::default();
        configuration.gyro.bias_turn_on = 3e-6;
        configuration.gyro.bias_in_run = 4e-6;
        configuration.accel.bias_in_run = 0.0;
        configuration.accel.range = 1.5;
        configuration.vehicle.kind = VehicleKind::Ship;
        // turned by 180 degrees about x: the sensor's y points left, its z up
        configuration.mounting = [0.0, 1.0, 0.0, 0.0];
        configuration.receiver.lever_arm = [1.0, 2.0, -3.0];
        configuration.receiver.lever_arm_sigma = 0.5;
        configuration.receiver.fix_delay_sigma = 0.03;
        let of = Settings::of(&configuration);
        let near = |a: f32, b: f32| (a - b).abs() <= 1e-6 * b.abs();
        assert!(near(of.sheet.gyro_bias, 5e-6));
        assert!(near(of.sheet.walk_per_hour[0], 0.8));
        assert_eq!(of.sheet.walk_per_hour[1], 0.0);
        assert_eq!(of.sheet.accel_bias, configuration.accel.bias_turn_on);
        assert_eq!(of.sheet.gravity, [0.0, 0.0, 9.8]);
        assert_eq!(of.sheet.range, [0.1, 1.0]);
        assert_eq!(of.lever_arm, [1.0, -2.0, 3.0]);
        assert_eq!((of.lever_arm_sigma, of.fix_age_sigma), (0.5, 0.03));
    }
}
