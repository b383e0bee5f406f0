//! Inertial navigation: Earth, rotations, units, the strapdown navigator, self-alignment,
//! free-inertial navigation, the aided Kalman filter, and the session of increments and fixes that
//! all of them work on.

pub mod align;
pub mod axes;
pub mod counts;
pub mod earth;
pub mod ekf;
pub mod free_inertial;
pub mod gnss;
mod lane;
pub mod motion;
pub mod rotation;
mod series;
pub mod session;
pub mod sins;
pub mod units;
mod vectors;

pub use lane::PLACES;
