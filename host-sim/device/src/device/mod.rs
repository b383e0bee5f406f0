//! A device at the end of its command link: what it is, how it is configured, what it reports.
//!
//! [`Link`] sends requests and decodes the answers. Everything else here uses it. The refusals and
//! the faults of a device are described in [`refusal`] and [`faults`].

pub mod biases;
mod blackbox;
mod commit;
mod configure;
pub mod faults;
mod info;
mod key;
mod learning;
mod link;
mod port;
pub mod proof;
mod provision;
mod receiver;
pub mod refusal;
mod reset;
pub mod sign;
pub mod steps;
mod store;
mod times;
mod update;
mod watch;
mod weights;

pub use blackbox::{Fetched, fetch, recording};
pub use commit::commit;
pub use configure::{configuration, configure, record, send};
pub use info::{Info, LineInfo, Memory, Protected, StoreState, Updates, info};
pub use key::{make_key, read_key};
pub use learning::{HORIZONS_S, Solution, Trial, Trials, usual};
pub use link::{Link, images, load, set_up};
pub use port::Port;
pub use provision::{open_by_choice, provision};
pub use receiver::{Antenna, Receiver};
pub use reset::Start;
pub use store::{can_store, store};
pub use times::Times;
pub use update::{Tried, Update};
pub use watch::{Event, Last, Learner, Status, Watch, named_counters, watch};
pub use weights::{calibrated, check_image, clipped};

use firmware::control::Mode;

/// Name of a mode on command lines and in the unit's file.
#[must_use]
pub const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Bypass => "bypass",
        Mode::Frozen => "frozen",
        Mode::Shadow => "shadow",
        Mode::Learn => "learn",
    }
}

/// All modes.
pub const MODES: [Mode; 4] = [Mode::Bypass, Mode::Frozen, Mode::Shadow, Mode::Learn];
