//! Experiments with the device: the paper's experiment, replays, campaigns and abuse. What computes
//! is in the crates below; this one is not optimised.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod abuse;
pub mod campaign;
pub mod experiment;

/// Version of the program and of the device's learner, on which results depend.
#[must_use]
pub fn version() -> String {
    let learner = firmware::learn::VERSION;
    format!("{}, learner {learner}", env!("CARGO_PKG_VERSION"))
}
