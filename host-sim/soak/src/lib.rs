//! The soak: the application for hours of simulated time, with random faults of every kind. The
//! desktop and the target run it from the same seed, and must send the same bytes.
//!
//! A vehicle stands and drives ([`world`]). Its sensor, receiver, navigation computer and user at
//! the command link work normally, with occasional disturbances ([`disturb`]). From time to time
//! the device is switched off, and restarts from its store. After each sample the output is checked
//! ([`run()`]): every byte leaves once and in order, unchanged where nothing is corrected, and
//! elsewhere as part of a good frame; nothing waits for ever; no counter goes back.
//!
//! All memory is in [`Memory`] and on the stack, so it cannot grow.
#![cfg_attr(not(test), no_std)]

pub mod disturb;
mod drive;
mod flash;
mod lines;
mod random;
mod report;
pub mod run;
pub mod sensor;
mod setup;
pub mod world;

pub use flash::Flash;
pub use run::{LINES, Memory, Plan, Report, Violation, Watch, run};
