//! The IMU compensation co-processor, without any hardware in it: everything here runs and is
//! tested on the desktop.
//!
//! Data flows one way; each arrow is one public function:
//!
//! ```text
//! bytes -> link -> wire -> sample -> compensator( normalise -> lrnn_nostd -> bound ) -> wire -> link -> bytes
//! ```
#![cfg_attr(not(test), no_std)]

pub mod align;
pub mod app;
pub mod compensator;
pub mod control;
pub mod error_bound;
pub mod fix;
pub mod learn;
pub mod link;
pub mod model;
pub mod nav;
pub mod sample;
pub mod store;
pub mod units;
pub mod wire;
