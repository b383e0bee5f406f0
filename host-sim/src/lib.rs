//! Desktop side of the IMU compensation co-processor: a ring-laser-gyro SINS simulation, the learning experiment, replay of
//! recorded data, and the report.

pub mod analysis;
pub mod campaign;
pub mod cli;
pub mod error;
pub mod experiment;
pub mod hil;
pub mod inertial;
pub mod learning;
pub mod output;
pub mod recordings;
pub mod report;
pub mod simulator;
