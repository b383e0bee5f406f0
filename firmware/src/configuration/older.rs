//! Configurations as earlier schemas have them, so that a device keeps what its store holds when
//! its firmware is renewed.

use super::{
    Configuration, Correction, Identity, Receiver, ReceiverProtocol, Sensor, SerialLines, Triad,
    Vehicle,
};
use crate::inputs::Inputs;
use serde::Deserialize;

/// Schemas 1 to 3, with which later ones begin: without the networks' inputs, which follow from
/// schema 4 on, cut-through (5) and wheels (6).
#[derive(Deserialize)]
pub struct Older<R> {
    identity: Identity,
    lines: SerialLines,
    sensor: Option<Sensor>,
    rate: f64,
    mounting: [f32; 4],
    gyro: Triad,
    accel: Triad,
    receiver: R,
    vehicle: Vehicle,
    correction: Correction,
}

/// Schemas 2 and 3.
pub type Schema3 = Older<Receiver>;

/// Schema 1: of the receiver it has protocol, lever arm and delay only.
pub type Schema1 = Older<Receiver1>;

impl<R: Into<Receiver>> Older<R> {
    /// The configuration with these inputs of the networks.
    pub fn with(self, inputs: Inputs) -> Configuration {
        Configuration {
            identity: self.identity,
            lines: self.lines,
            sensor: self.sensor,
            rate: self.rate,
            mounting: self.mounting,
            gyro: self.gyro,
            accel: self.accel,
            receiver: self.receiver.into(),
            vehicle: self.vehicle,
            correction: self.correction,
            inputs,
            wheels: None,
        }
    }
}

#[derive(Deserialize)]
pub struct Receiver1 {
    protocol: ReceiverProtocol,
    lever_arm: [f32; 3],
    fix_delay: f32,
}

impl From<Receiver1> for Receiver {
    /// Lever arm and delay count as known exactly, which is what they meant in schema 1.
    fn from(configuration: Receiver1) -> Receiver {
        Receiver {
            protocol: configuration.protocol,
            lever_arm: configuration.lever_arm,
            lever_arm_sigma: 0.0,
            fix_delay: configuration.fix_delay,
            fix_delay_sigma: 0.0,
            pulse: false,
            heading_offset: 0.0,
        }
    }
}
