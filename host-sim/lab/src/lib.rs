//! Experiments with the device: the paper's experiment, replays, campaigns and abuse. What computes
//! is in the crates below; this one is not optimised.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod abuse;
pub mod campaign;
pub mod experiment;
