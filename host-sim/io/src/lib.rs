//! Input and output of the desktop programs: recordings in many formats, and output files that
//! appear whole or not at all.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod output;
pub mod recordings;
