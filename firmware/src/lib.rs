//! The IMU compensation co-processor, without its hardware: all of this crate runs and is tested on
//! the desktop.
//!
//! Data flows one way; each arrow is one public function:
//!
//! ```text
//! bytes -> link -> wire -> sample -> compensator -> wire -> link -> bytes
//!                             |
//!                             +-> learn (align, nav, bank of hypotheses) <- fixes, references
//! ```
//!
//! Imports point one way, from the bottom of this list to its top:
//!
//! | module | content |
//! |---|---|
//! | [`units`], [`sample`] | units; one inertial sample, its scale and timing |
//! | [`control`] | what may be asked of the device |
//! | [`fix`], [`model`] | one fix of a receiver; the pair of networks |
//! | [`inputs`] | what drives the networks |
//! | [`remainder`] | corrections smaller than a sample's resolution |
//! | [`link`] | lines of bytes, and the clock |
//! | [`wire`] | frames of sensors, receivers and the command link |
//! | [`nav`], [`align`] | strapdown navigation and self-alignment |
//! | [`compensator`], [`error_bound`] | correction of samples, and its effect at worst |
//! | [`configuration`] | the configuration of a device |
//! | [`plausibility`] | the configuration against the measurements |
//! | [`learn`] | learning from references and from fixes |
//! | [`store`] | weights and configuration in flash |
//! | [`update`] | updates of the firmware: two slots in flash |
//! | [`app`] | the application, which composes all of them |
#![cfg_attr(not(test), no_std)]

pub mod align;
pub mod app;
pub mod compensator;
pub mod configuration;
pub mod control;
pub mod error_bound;
pub mod fix;
pub mod inputs;
pub mod learn;
pub mod link;
pub mod model;
pub mod nav;
pub mod plausibility;
pub mod remainder;
pub mod sample;
pub mod store;
pub mod units;
pub mod update;
pub mod wheels;
pub mod wire;
