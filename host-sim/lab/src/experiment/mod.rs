//! Experiments: runs over simulated sessions, replays of recorded ones, and their results.

pub mod correction;
#[cfg(test)]
mod doubts_tests;
pub mod fog_mems;
pub mod hybrid;
pub mod kitti;
pub mod lasergyro;
pub mod outcome;
pub mod protocol;
pub mod results;
pub mod run;
pub mod sessions;
pub mod starting;
pub mod user_recording;
