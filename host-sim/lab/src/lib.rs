//! Computations about the device: the paper's experiment, replays, campaigns, abuse, and the limits
//! of learning.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod abuse;
pub mod analysis;
pub mod campaign;
pub mod experiment;
pub mod learning;
