//! Recordings of any form, read by named options: those of the commands `replay`, `convert` and
//! `report`, and of Python's `read`.

pub mod beside;
pub mod form;
pub mod messages;
mod open;
pub mod options;
pub mod progress;
pub mod record_options;
pub mod source;

pub use open::{Loaded, Opened, Source, open};
