//! Experiments: runs over simulated sessions, replays of recorded ones, and their results.

pub mod correction;
pub mod doubts;
pub mod error_bound;
pub mod fog_mems;
pub mod hybrid;
pub mod kitti;
pub mod lasergyro;
pub mod outcome;
pub mod protocol;
pub mod results;
pub mod run;
pub mod scenario;
pub mod sessions;
pub mod starting;
pub mod time_offset;
pub mod user_recording;
