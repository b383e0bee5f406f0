//! A fix of a GNSS receiver.

use crate::inertial::earth::Geodetic;
use nalgebra::Vector3;

/// One fix, at the boundary between two epochs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Position.
    pub position: Geodetic,
    /// Velocity, NED, m/s.
    pub velocity: Vector3<f64>,
}
