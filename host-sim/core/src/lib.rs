//! Computations that all desktop programs share: inertial navigation, the aided filter, the
//! simulator of sensors and drives, long lists, and the one error type.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod error;
pub mod inertial;
pub mod list;
pub mod simulator;
pub mod words;
