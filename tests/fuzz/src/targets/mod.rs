//! One file a target.
//!
//! Each says what must hold for any input, and panics where it does not.

pub mod app;
pub mod calibration;
pub mod command;
pub mod configuration;
pub mod csv;
pub mod drive;
pub mod fixes;
pub mod image;
pub mod mcap;
pub mod novatel;
pub mod receiver;
pub mod requests;
pub mod store;
pub mod stream;
pub mod ulog;
pub mod unit;
pub mod update;
