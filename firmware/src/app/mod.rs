//! The whole flow in one pass: link, wire, sample, compensator, wire, link.
//!
//! A board calls [`App::poll`] whenever an interrupt has moved a byte, and at least once a
//! millisecond. This module touches no hardware, never waits and cannot fail.
//!
//! **Latency.** The correction in force is known before a frame arrives. Between its last byte in
//! and its first byte out there are one check, six subtractions and one change of the checksum, the
//! same for all axes. Networks, counters, the command link and the receiver come after the frame
//! has left, and the last two only while no frame is arriving.
//!
//! **Gaps.** Frames that are missing, damaged or marked invalid are never made up. The networks do
//! not step over a gap: the block in progress is given up, and the estimate in force is held until
//! the next whole block.
//!
//! Imports point from the bottom up: `counts`, `guard`, `hardware`, `config`, `phase`, `load`,
//! `job`, `lines`, `pulse`, `clock`, `blackbox`, `updates`; `setup`, `health`; `flow`; `server` and
//! `reverse`; `application`.

mod application;
pub mod blackbox;
mod clock;
mod config;
mod counts;
mod flow;
pub mod guard;
mod hardware;
mod health;
mod job;
mod lines;
mod load;
pub mod phase;
pub mod pulse;
mod reverse;
pub mod run;
mod server;
mod setup;
mod updates;

pub use application::{App, PATIENCE_US};
pub use config::{Activation, Config, StoreFaults};
pub use hardware::{COMMAND_BAUD, Hardware};
pub use job::{Done, Gives, Job, Jobs, Remembers, Stores};
pub use lines::Lines;
pub use phase::Phase;
pub use updates::{GivesUpdates, Updates, UpdatesThread};
