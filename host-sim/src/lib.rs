//! The desktop side of the IMU compensation co-processor: simulation of a strapdown system with
//! ring laser gyros, the learning experiment, replay of recorded data, campaigns, hardware in the
//! loop, and reports.

// The standard library's macros panic where nothing can be written. `cli::stdout` has others.
#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

#[cfg(feature = "tools")]
pub mod abuse;
#[cfg(feature = "tools")]
pub mod analysis;
#[cfg(feature = "tools")]
pub mod campaign;
#[cfg(feature = "tools")]
pub mod cli;
pub mod device;
pub mod error;
#[cfg(feature = "tools")]
pub mod experiment;
pub mod hil;
pub mod inertial;
#[cfg(feature = "tools")]
pub mod learning;
pub mod list;
pub mod output;
pub mod recordings;
#[cfg(feature = "tools")]
pub mod report;
pub mod simulator;
pub mod unit;
