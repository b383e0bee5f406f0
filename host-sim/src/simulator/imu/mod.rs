//! The laser-gyro IMU: datasheet in, pulse counts out.
//!
//! [`ImuSpec`] holds the numbers, [`Imu`] is one unit at one turn-on. Each error has a cause of its own that a zero switches
//! off, and a cause that is switched on or off changes no random draw of another. The slow physics behind the fast models:
//! [`lock_in`] for the angle random walk, [`thermal`] for the warm-up.

mod datasheet;
mod delay;
mod draws;
mod error_model;
pub mod lock_in;
pub mod magnetic;
mod model;
mod spec;
mod term;
pub mod thermal;
mod triad;

pub use datasheet::{AccelSpec, GyroSpec};
pub use draws::Draws;
pub use error_model::ErrorModelName;
pub use model::Imu;
pub use spec::{BlockSpec, DitherSpec, ImuSpec, PRESETS};
pub use term::Group;

#[cfg(test)]
mod causes_tests;
#[cfg(test)]
mod spec_tests;
#[cfg(test)]
mod tests;
