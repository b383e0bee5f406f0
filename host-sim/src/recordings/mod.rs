//! Recorded data: its files, their axes and tracks, and the sessions made of them.

pub mod axes;
pub(crate) mod build;
pub mod files;
pub mod fog_mems;
pub mod generic;
pub(crate) mod input;
pub mod kfgins;
pub mod kitti;
pub mod lasergyro_file;
pub mod novatel;
pub mod read;
pub mod record;
pub mod track;
pub mod words;

pub use build::Begin;
pub use lasergyro_file::{ACCEL_LSB_MPS, GYRO_LSB_RAD, HEADER, RATE_HZ, Recording, data_dir, load};
