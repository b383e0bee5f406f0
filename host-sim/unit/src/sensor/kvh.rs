//! The table of a KVH.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::{ImuFormat, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that the messages of a KVH do not contain. Source of all values: interface control
/// document 56-0298.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Kvh {
    /// Quantity of the gyro values (`=ROTFMT`). Default: delta.
    pub rotation: Rotation,
    /// Unit of the angles (`=ROTUNITS`). Default: rad.
    pub angle: Angle,
}

/// Quantity of the gyro values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rotation {
    /// Angle since the last message.
    #[default]
    Delta,
    /// Angular rate.
    Rate,
}

/// Unit of the angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Angle {
    /// Radians.
    #[default]
    Rad,
    /// Degrees.
    Deg,
}

/// Bytes of message A, the shortest.
const MESSAGE_A_LEN: usize = 36;

impl Section for Kvh {
    fn of(settings: &Settings) -> Self {
        Self {
            rotation: if settings.kvh.delta {
                Rotation::Delta
            } else {
                Rotation::Rate
            },
            angle: if settings.kvh.degrees {
                Angle::Deg
            } else {
                Angle::Rad
            },
        }
    }

    fn apply(&self, _: &Sensor, to: &mut Settings) -> Result<(), Finding> {
        to.kvh.delta = self.rotation == Rotation::Delta;
        to.kvh.degrees = self.angle == Angle::Deg;
        Ok(())
    }

    fn frame_len(&self, _: ImuFormat) -> usize {
        MESSAGE_A_LEN
    }
}
