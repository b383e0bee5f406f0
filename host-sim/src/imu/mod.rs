//! The laser-gyro IMU: datasheet in, pulse counts out.

mod model;
mod spec;

pub use model::Imu;
pub use spec::{AccelSpec, GyroSpec, ImuSpec, PRESETS};

#[cfg(test)]
mod tests;
