//! Recorded data: its files and its use as input of the experiment.

pub mod axes;
pub mod fog_mems;
mod input;
pub mod kitti;
pub mod lasergyro;
mod lasergyro_file;
pub mod outcome;
pub mod protocol;
pub mod track;
pub mod words;

pub use lasergyro_file::{ACCEL_LSB_MPS, GYRO_LSB_RAD, HEADER, RATE_HZ, Recording, data_dir, load};
