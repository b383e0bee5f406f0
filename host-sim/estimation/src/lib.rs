//! What computes from samples: learning, Allan deviation, and the limits of learning. The crate is
//! apart from `host-lab` because it alone of the two is optimised.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod analysis;
pub mod learning;
