//! Learning on the device.

pub mod bank;
pub mod prior;
