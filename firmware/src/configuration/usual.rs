//! A configuration to begin with.

use super::{
    Activation, Configuration, Correction, Identity, Receiver, ReceiverProtocol, SerialLines,
    Triad, Vehicle, VehicleKind,
};
use crate::compensator::Limit;
use crate::control::Mode;
use crate::inputs::OWN;
use heapless::String;

/// A correction may be as large as so many standard deviations of the bias, at power-on and in run
/// together, unless the file gives a limit. Of a unit that is as its sheet says, one axis in 370
/// has a greater bias and is corrected by that much only. More would let the networks do more harm
/// than they can do good.
pub const LIMIT_SIGMAS: f32 = 3.0;

impl Default for Configuration {
    /// The medium laser-gyro IMU of `host-sim` (preset `medium`: 0.34 deg/h, 410 ug, 0.005
    /// deg/sqrt(h), 20 ug/sqrt(Hz)) in a land vehicle, with its axes along the body's. Its format
    /// is detected. Each network gets its own triad. Lever arm and delay of the fixes are known
    /// exactly. Mode bypass, limits of [`LIMIT_SIGMAS`], slew one thousandth of that a second.
    fn default() -> Configuration {
        let limit =
            |sheet: &Triad| LIMIT_SIGMAS * libm::hypotf(sheet.bias_turn_on, sheet.bias_in_run);
        let limit = Limit {
            gyro: limit(&MEDIUM_GYRO),
            accel: limit(&MEDIUM_ACCEL),
        };
        Configuration {
            identity: Identity {
                name: String::try_from("medium").unwrap_or_default(),
                serial: String::new(),
            },
            lines: SerialLines::DEFAULT,
            sensor: None,
            rate: 1000.0,
            mounting: [1.0, 0.0, 0.0, 0.0],
            gyro: MEDIUM_GYRO,
            accel: MEDIUM_ACCEL,
            receiver: Receiver {
                protocol: ReceiverProtocol::Ubx,
                lever_arm: [0.0; 3],
                lever_arm_sigma: 0.0,
                fix_delay: 0.1,
                fix_delay_sigma: 0.0,
                pulse: false,
                heading_offset: 0.0,
            },
            vehicle: Vehicle {
                kind: VehicleKind::Land,
                speed: 50.0,
            },
            correction: Correction {
                mode: Mode::Bypass,
                activation: Activation::NextPowerOn,
                limit,
                slew: Limit {
                    gyro: limit.gyro * 1e-3,
                    accel: limit.accel * 1e-3,
                },
                block: 1.0,
                align: 100.0,
                silence_us: 100_000,
                mark: true,
                check_rate: true,
            },
            inputs: OWN,
            wheels: None,
        }
    }
}

/// 0.34 deg/h together, of which a twentieth walks in an hour.
const MEDIUM_GYRO: Triad = Triad {
    bias_turn_on: 1.627_961_3e-6,
    bias_in_run: 8.150_000_5e-8,
    white_noise: 1.46e-6,
    scale: 20e-6,
    misalignment: 5e-5,
    g_sensitivity: 0.0,
    range: 7.0,
};
/// 410 ug together, of which a twentieth walks in an hour.
const MEDIUM_ACCEL: Triad = Triad {
    bias_turn_on: 3.994_997e-3,
    bias_in_run: 2.000_000_1e-4,
    white_noise: 1.96e-4,
    scale: 100e-6,
    misalignment: 5e-5,
    g_sensitivity: 0.0,
    range: 98.0,
};
