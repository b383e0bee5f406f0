//! An attitude as a chain of turns about the body's own axes, with the rate that follows from the
//! rates of the angles.

use super::dual::Dual;
use crate::inertial::rotation::from_rotvec;
use nalgebra::{UnitQuaternion, Vector3};

/// An attitude and the body's rate against the navigation axes, in body axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turned {
    pub(super) q_bn: UnitQuaternion<f64>,
    pub(super) omega: Vector3<f64>,
}

impl Turned {
    /// Forward is north, right is east.
    pub(super) fn level() -> Self {
        Self {
            q_bn: UnitQuaternion::identity(),
            omega: Vector3::zeros(),
        }
    }

    /// Turns about the down axis.
    pub(super) fn yaw(self, angle: Dual) -> Self {
        self.by(Vector3::z(), angle)
    }

    /// Turns about the right axis: nose up.
    pub(super) fn pitch(self, angle: Dual) -> Self {
        self.by(Vector3::y(), angle)
    }

    /// Turns about the forward axis: right side down.
    pub(super) fn roll(self, angle: Dual) -> Self {
        self.by(Vector3::x(), angle)
    }

    fn by(self, axis: Vector3<f64>, angle: Dual) -> Self {
        let turn = from_rotvec(&(axis * angle.value));
        Self {
            q_bn: self.q_bn * turn,
            omega: turn.inverse_transform_vector(&self.omega) + axis * angle.rate,
        }
    }
}
