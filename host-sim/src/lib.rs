//! The desktop side of the IMU compensation co-processor: simulation of a strapdown system with
//! ring laser gyros, the learning experiment, replay of recorded data, campaigns, hardware in the
//! loop, and reports.

pub mod abuse;
pub mod analysis;
pub mod campaign;
pub mod cli;
pub mod device;
pub mod error;
pub mod experiment;
pub mod hil;
pub mod inertial;
pub mod learning;
pub mod output;
pub mod recordings;
pub mod report;
pub mod simulator;
pub mod unit;
