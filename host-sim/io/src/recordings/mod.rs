//! Recorded data: the file formats, their tracks, and the sessions made of them.

pub mod calibration;
pub mod clocks;
pub mod columns;
pub mod corrected;
pub mod euroc;
pub mod fog_mems;
pub mod gaps;
pub mod generic;
pub mod gpsd;
pub mod increments;
pub(crate) mod input;
pub mod kfgins;
pub mod kitti;
pub mod lasergyro;
pub mod mcap;
pub mod novatel;
pub(crate) mod nowhere;
pub mod pace;
pub mod read;
pub mod receiver;
pub mod record;
pub mod rtklib;
pub(crate) mod session;
pub(crate) mod stamped;
pub mod table;
pub mod track;
pub mod ubx;
pub mod ulog;
pub(crate) mod week;
mod zstd;

/// Seconds in a day, and in a week.
pub(crate) const DAY_S: f64 = 86_400.0;
pub(crate) const WEEK_S: f64 = 604_800.0;

pub use input::Progress;
pub use lasergyro::{ACCEL_LSB_MPS, GYRO_LSB_RAD, HEADER, RATE_HZ, Recording, load};
pub use session::{InitialAttitude, Prepared};
pub use stamped::Reading;
