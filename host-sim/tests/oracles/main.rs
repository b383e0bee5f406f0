//! Independent implementations and closed forms, and what is held against them: the navigator, the aided filters, the device's
//! navigator, the network's gradient.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod consistency;
mod device_navigator;
mod ecef;
mod filter;
mod mechanisation;
mod network;
