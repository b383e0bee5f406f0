//! The application as a black box between four lines: bytes in, bytes out, time.

mod command;
mod device;
mod frames;
mod holes;
mod identity;
mod reverse;
mod sums;
