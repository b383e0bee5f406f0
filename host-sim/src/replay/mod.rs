//! Recorded data: its files and its use as input of the experiment.

pub mod axes;
mod build;
pub mod files;
pub mod fog_mems;
pub mod generic;
pub mod hybrid;
mod input;
pub mod kfgins;
pub mod kitti;
pub mod lasergyro;
mod lasergyro_file;
pub mod novatel;
pub mod outcome;
pub mod own;
pub mod protocol;
pub mod record;
pub mod track;
pub mod words;

pub use build::Begin;
pub use lasergyro_file::{ACCEL_LSB_MPS, GYRO_LSB_RAD, HEADER, RATE_HZ, Recording, data_dir, load};
