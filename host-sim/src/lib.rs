//! The command line of the desktop programs. Their code is in the crates beside it: `host-core`,
//! `host-io`, `host-device`, `host-lab` and `host-report`.

// The standard library's macros panic where nothing can be written. `cli::stdout` has others.
#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod cli;
