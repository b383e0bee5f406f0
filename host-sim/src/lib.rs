//! Desktop side of the IMU compensation co-processor: a ring-laser-gyro SINS simulation, the learning experiment, replay of
//! recorded data, and the report.

pub mod align;
pub mod allan;
pub mod baseline;
pub mod campaign;
pub mod cli;
pub mod coast;
pub mod earth;
pub mod ekf;
pub mod error;
pub mod experiment;
pub mod gnss;
pub mod harm;
pub mod hil;
pub mod imu;
pub mod input;
pub mod kalman;
pub mod learnability;
pub mod learning;
pub mod output;
pub mod promotion;
pub mod reference;
pub mod replay;
pub mod report;
pub mod rotation;
pub mod scenario;
pub mod session;
pub mod sins;
pub mod study;
pub mod teacher;
pub mod truth;
pub mod twin;
pub mod units;
