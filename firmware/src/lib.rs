//! The IMU compensation co-processor, without any hardware in it: everything here runs and is tested on the desktop.
//!
//! Data flows one way; each arrow is one public function:
//!
//! ```text
//! bytes -> wire -> sample -> compensator( normalise -> lrnn_nostd -> bound ) -> wire -> bytes
//! ```
#![cfg_attr(not(test), no_std)]

pub mod compensator;
pub mod sample;
pub mod wire;
