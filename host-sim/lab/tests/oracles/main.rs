//! Tests against independent implementations and closed forms: of the navigator, the aided filters,
//! the device's navigator and learner, and the gradient of the network.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod consistency;
mod device_navigator;
mod ecef;
mod filter;
mod learner;
mod mechanisation;
mod network;
mod vehicles;
