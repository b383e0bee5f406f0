//! The soak: the application for hours of simulated time, with random faults of every kind. The
//! desktop and the target run it from the same seed, and must send the same bytes.
//!
//! A vehicle stands and drives ([`world`]). Its sensor, receiver, navigation computer and person at
//! the command link do what they should, and now and then what they should not ([`disturb`]). Now
//! and then the device is switched off, and begins with what its store holds. After each sample it
//! is checked what left ([`run()`]): every byte once and in its place, unchanged where nothing is
//! corrected, and elsewhere a good frame; nothing waits for ever; no counter goes back.
//!
//! All memory is in [`Memory`] and on the stack, so nothing can grow.
#![cfg_attr(not(test), no_std)]

pub mod disturb;
mod flash;
mod lines;
mod random;
pub mod run;
pub mod world;

pub use flash::Flash;
pub use run::{LINES, Memory, Plan, Report, Violation, Watch, run};
