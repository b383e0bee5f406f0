//! The black box: a ring in RAM of what the device last saw and did, for whoever looks for the
//! cause of a fault.
//!
//! It holds the sensor's bytes as they came, with their times, the correction whenever it changed,
//! and the fault bits. The ring has [`PAGES`] pages. Each begins with a [`Key`], which is all that
//! the bytes that leave depend on besides the bytes that come. So a page can be played to the same
//! application on a desktop, which must send the same bytes: see [`super::App::resume`]. Beside the
//! pages is a list of [`Event`]s, which reaches further back: faults, modes, starts of the sensor,
//! fixes.
//!
//! The first fault while samples flow, or a request, makes it hold what it has. After a fault it
//! still records until two more pages are full. It records again when it is released. Its memory
//! survives a reset if the board lets it. A reset makes it hold, too.
//!
//! **Layout** (little-endian; all numbers below are bytes):
//!
//! | offset | length | content |
//! |---|---|---|
//! | 0 | 32 | head |
//! | 32 | 480 | 30 events of 16: see [`Event`] |
//! | 512 | 2816 | 4 pages of 704: see [`read::Page`] |
//!
//! The head has magic `LRBB`, version u16, state u8, cause u8, faults at the cause u32, its time
//! u64 in microseconds, events so far u32, pages so far u32, and CRC-32 (zlib's) of these 28 bytes.
//! It changes when the state does, at every page and at every event. A page contains its own number
//! and length. What a page says is judged by playing it, and by the checksums of its frames.

mod event;
mod key;
mod memory;
pub mod read;
mod record;

pub use crate::control::recording::{Cause, State};
pub use event::{Event, EventKind};
pub use key::{AppState, KEY_LEN, Key};
pub use memory::{LEN, Memory, PAGES, VERSION};
pub use record::BlackBox;
pub(in crate::app) use record::Noted;
