//! Configurations as earlier schemas have them, so that a device keeps what its store holds when
//! its firmware is renewed.

use super::{
    Configuration, Correction, Identity, Receiver, ReceiverProtocol, Sensor, SerialLines, Triad,
    Vehicle,
};
use crate::inputs::{Inputs, OWN};
use serde::Deserialize;

/// Schemas 2 and 3, with which schema 4 begins: without the networks' inputs, which follow.
#[derive(Deserialize)]
pub struct Schema3 {
    identity: Identity,
    lines: SerialLines,
    sensor: Option<Sensor>,
    rate: f64,
    mounting: [f32; 4],
    gyro: Triad,
    accel: Triad,
    receiver: Receiver,
    vehicle: Vehicle,
    correction: Correction,
}

impl Schema3 {
    /// With these inputs of the networks.
    pub fn with(self, inputs: Inputs) -> Configuration {
        Configuration {
            identity: self.identity,
            lines: self.lines,
            sensor: self.sensor,
            rate: self.rate,
            mounting: self.mounting,
            gyro: self.gyro,
            accel: self.accel,
            receiver: self.receiver,
            vehicle: self.vehicle,
            correction: self.correction,
            inputs,
        }
    }
}

/// Schema 1: of the receiver it has protocol, lever arm and delay only.
#[derive(Deserialize)]
pub struct Schema1 {
    identity: Identity,
    lines: SerialLines,
    sensor: Option<Sensor>,
    rate: f64,
    mounting: [f32; 4],
    gyro: Triad,
    accel: Triad,
    receiver: Receiver1,
    vehicle: Vehicle,
    correction: Correction,
}

#[derive(Deserialize)]
struct Receiver1 {
    protocol: ReceiverProtocol,
    lever_arm: [f32; 3],
    fix_delay: f32,
}

impl From<Schema1> for Configuration {
    /// Lever arm and delay stay exactly as told, which is what they meant in schema 1.
    fn from(told: Schema1) -> Configuration {
        let Receiver1 {
            protocol,
            lever_arm,
            fix_delay,
        } = told.receiver;
        Configuration {
            identity: told.identity,
            lines: told.lines,
            sensor: told.sensor,
            rate: told.rate,
            mounting: told.mounting,
            gyro: told.gyro,
            accel: told.accel,
            receiver: Receiver {
                protocol,
                lever_arm,
                lever_arm_sigma: 0.0,
                fix_delay,
                fix_delay_sigma: 0.0,
                pulse: false,
                heading_offset: 0.0,
            },
            vehicle: told.vehicle,
            correction: told.correction,
            inputs: OWN,
        }
    }
}
