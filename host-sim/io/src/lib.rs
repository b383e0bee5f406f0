//! What the desktop side reads and writes: recordings of many forms, and files that appear whole or
//! not at all.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod output;
pub mod recordings;
