//! The IMU with laser gyros: it turns a datasheet and perfect increments into pulse counts.
//!
//! [`ImuSpec`] holds the numbers. [`Imu`] is one unit at one turn-on. The table of error terms is
//! in `datasheet`: one entry is one error. Zero switches an error off. Switching an error on or off
//! changes no random number of another error. Two fast models are derived from slower physics,
//! which their tests simulate: [`lock_in`] for the angle random walk, [`thermal`] for the warm-up.

mod cause;
mod datasheet;
mod delay;
mod dither;
mod draws;
mod environment;
mod error_model;
mod heat;
pub mod lock_in;
pub mod magnetic;
mod model;
mod motion_level;
pub mod nodes;
mod spec;
mod term;
pub mod thermal;
pub mod thermometer;
mod triad;
mod unit_errors;
pub mod world;

pub use datasheet::{AccelSpec, GyroSpec};
pub use dither::DitherSpec;
pub use draws::Draws;
pub use environment::{AccelEnvironment, GyroEnvironment};
pub use error_model::ErrorModelName;
pub use model::Imu;
pub use nodes::NodesSpec;
pub use spec::{BlockSpec, ImuSpec, PRESETS};
pub use term::Group;
pub use thermometer::ThermometerSpec;
pub use unit_errors::UnitErrors;
pub use world::World;

#[cfg(test)]
mod causes_tests;
#[cfg(test)]
mod spec_tests;
#[cfg(test)]
mod tests;
