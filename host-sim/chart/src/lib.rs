//! Pictures of results, as SVG and PNG. The crate is apart from `host-report` because it alone of
//! the two is optimised.

#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod axis;
pub mod palette;
pub mod picture;
