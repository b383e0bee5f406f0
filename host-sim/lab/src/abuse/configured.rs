//! Wrong configurations of the device. The navigation computer always has the correct values.

use super::names::Sensor as Kind;
use firmware::configuration::Configuration;
use host_unit::Unit;
use host_unit::around::Kind as VehicleKind;
use host_unit::sensor::{FormatName, Sensor};
use nalgebra::{Quaternion, UnitQuaternion};

/// An error of the configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The biases of the datasheet are this many times the true ones.
    Biases(f64),
    /// The same factor for the white noise.
    Noise(f64),
    /// The same factor for scale factors and misalignments.
    Scale(f64),
    /// The mounting is off by these angles about forward, right and down, deg.
    Mounting([f64; 3]),
    /// The configured lever arm, m.
    LeverArm([f64; 3]),
    /// The configured delay of the fixes, s.
    Delay(f64),
    /// Lever arm and delay are configured as not measured, as by a unit file without them.
    Unmeasured,
    /// The vehicle is configured as a ship.
    Ship,
    /// The vehicle is configured as an aircraft.
    Aircraft,
}

/// The unit whose datasheet the device and the navigation computer get.
pub(super) fn unit(sensor: Kind) -> Unit {
    Unit::preset(sensor.preset()).unwrap_or_default()
}

impl Fault {
    pub(super) fn on_unit(self, unit: &mut Unit) {
        let (g, a) = (&mut unit.gyro, &mut unit.accel);
        match self {
            Self::Biases(factor) => {
                g.bias_turn_on_dph *= factor;
                g.bias_in_run_dph *= factor;
                a.bias_turn_on_ug *= factor;
                a.bias_in_run_ug *= factor;
            }
            Self::Noise(factor) => {
                g.angle_random_walk_dpsqrth *= factor;
                a.velocity_random_walk_ugpsqrthz *= factor;
            }
            Self::Scale(factor) => {
                g.scale_ppm *= factor;
                g.misalignment_mrad *= factor;
                a.scale_ppm *= factor;
                a.misalignment_mrad *= factor;
            }
            Self::LeverArm(arm) => unit.receiver.lever_arm_m = arm,
            Self::Delay(delay) => unit.receiver.fix_delay_ms = 1e3 * delay,
            Self::Unmeasured => {
                unit.receiver.lever_arm_sigma_m = None;
                unit.receiver.fix_delay_sigma_ms = 100.0;
            }
            Self::Ship => unit.vehicle.kind = VehicleKind::Ship,
            Self::Aircraft => unit.vehicle.kind = VehicleKind::Air,
            Self::Mounting(_) => {}
        }
    }

    pub(super) fn on_configuration(self, configuration: &mut Configuration) {
        if let Self::Mounting(degrees) = self {
            let [roll, pitch, yaw] = degrees.map(f64::to_radians);
            let wrong = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let [w, x, y, z] = configuration.mounting.map(f64::from);
            let q = wrong * UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
            configuration.mounting = [q.w, q.i, q.j, q.k].map(|x| x as f32);
        }
    }
}

/// The device's configuration for a kind of sensor, with these faults: its preset with frames of
/// this format.
///
/// # Errors
/// Why a device would reject the configuration.
pub(super) fn configuration(
    faults: impl Iterator<Item = Fault> + Clone,
    (sensor, format): (Kind, FormatName),
) -> Result<Configuration, String> {
    let mut unit = unit(sensor);
    let baud = unit.sensor.baud;
    unit.sensor = Sensor {
        rate_hz: Some(100.0),
        baud,
        ..Sensor::of(format)
    };
    faults.clone().for_each(|fault| fault.on_unit(&mut unit));
    let configuration = unit.configuration();
    let mut configuration =
        configuration.map_err(|found| format!("{} {}", found.key, found.problem))?;
    faults.for_each(|fault| fault.on_configuration(&mut configuration));
    Ok(configuration)
}
