//! The simulator: the true drive, the IMU with its errors, the noise of the receiver, and simulated
//! sessions.

pub mod gnss;
pub mod imu;
pub mod session;
#[cfg(test)]
mod session_tests;
pub mod truth;
pub mod wheels;
