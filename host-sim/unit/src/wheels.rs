//! The table `[wheels]`: wheels whose speed a host reports to the device.

use super::finding::Finding;
use super::reverse::scaled;
use firmware::configuration;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Wheels whose speed a host reports, over the command link (`host-sim device wheels`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Wheels {
    /// From the IMU to the middle of the axle that does not steer: forward, right, down, m, each
    /// -100 to 100. Default: [0, 0, 0]. Source: measured on the vehicle.
    #[schemars(inner(range(min = -100, max = 100)))]
    pub lever_arm_m: [f64; 3],
    /// The axle whose speed is reported, as the mean over its wheels. Default: fixed.
    pub axle: Axle,
    /// Distance between the axles, m, 0 to 100; needed for an axle that steers. Default: 0.
    #[schemars(range(min = 0, max = 100))]
    pub wheelbase_m: f64,
    /// Standard deviation of the speed's scale, percent, 0 to 50. The device estimates it from
    /// fixes. Default: 2. Source: how the circumference was found.
    #[schemars(range(min = 0, max = 50))]
    pub scale_percent: f64,
    /// Standard deviation of a reported speed, resolution included, m/s, 0.001 to 10. Default:
    /// 0.05. Source: the vehicle's bus, pulses per metre.
    #[schemars(range(min = 0.001, max = 10))]
    pub noise_mps: f64,
    /// Age of a speed when it is reported, beyond what the report says, ms, 0 to 1000. Default: 50
    /// (assumed). Source: the vehicle's bus.
    #[schemars(range(min = 0, max = 1000))]
    pub delay_ms: f64,
}

/// The axle whose speed is reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axle {
    /// It does not steer: the rear one of a car, either one of a trailer or a tracked vehicle.
    #[default]
    Fixed,
    /// It steers: the front one of a car.
    Steered,
}

impl Default for Wheels {
    fn default() -> Self {
        Self {
            lever_arm_m: [0.0; 3],
            axle: Axle::Fixed,
            wheelbase_m: 0.0,
            scale_percent: 2.0,
            noise_mps: 0.05,
            delay_ms: 50.0,
        }
    }
}

impl Wheels {
    /// The device's.
    pub(super) fn configuration(&self) -> Result<configuration::Wheels, Finding> {
        let ahead = match self.axle {
            Axle::Fixed => 0.0,
            Axle::Steered if self.wheelbase_m > 0.0 => self.wheelbase_m,
            Axle::Steered => {
                return Err(Finding::wrong(
                    "wheels.wheelbase_m",
                    "is missing for an axle that steers",
                    "give the distance between the axles, or axle = \"fixed\"",
                ));
            }
        };
        Ok(configuration::Wheels {
            lever_arm: self.lever_arm_m.map(|m| m as f32),
            ahead: ahead as f32,
            scale: (self.scale_percent * PERCENT) as f32,
            noise: self.noise_mps as f32,
            delay: (self.delay_ms * MS) as f32,
        })
    }

    /// The table that gives these.
    pub(super) fn of(wheels: &configuration::Wheels) -> Self {
        Self {
            lever_arm_m: wheels.lever_arm.map(|m| scaled(m, 1.0)),
            axle: if wheels.ahead > 0.0 {
                Axle::Steered
            } else {
                Axle::Fixed
            },
            wheelbase_m: scaled(wheels.ahead, 1.0),
            scale_percent: scaled(wheels.scale, PERCENT),
            noise_mps: scaled(wheels.noise, 1.0),
            delay_ms: scaled(wheels.delay, MS),
        }
    }
}

const PERCENT: f64 = 0.01;
const MS: f64 = 1e-3;
