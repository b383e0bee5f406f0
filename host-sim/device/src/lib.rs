//! A device at its command link, and hardware in the loop: a board at its lines against the same
//! application on the desktop.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod device;
pub mod hil;
