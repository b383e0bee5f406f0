//! `host-sim serve` as used: by HTTP, in a browser at a board in QEMU, and in the recording that it
//! leaves.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

mod browser;
mod chromium;
mod http;
mod recording;
mod server;
