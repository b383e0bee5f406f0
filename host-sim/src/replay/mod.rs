//! Recorded data: its files and its use as input of the experiment.

pub mod lasergyro;
mod lasergyro_file;

pub use lasergyro_file::{ACCEL_LSB_MPS, GYRO_LSB_RAD, HEADER, RATE_HZ, Recording, data_dir, load};
