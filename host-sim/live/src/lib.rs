//! What a device does, live: a page in the browser, Foxglove's protocol, and MCAP recordings.
//!
//! ```text
//! lines --taps--> samples --> windows --\
//!                                        hub --> web: the page's events
//! command link --device--> status ------/    \-> record: Foxglove, MCAP
//!                  ^------ orders <---- web: the page's buttons
//! ```
//!
//! It is a program of its own, so that `host-sim` compiles without a web server.

mod device;
mod history;
mod hub;
mod options;
mod pairs;
mod record;
mod samples;
mod serve;
mod taps;
mod web;
mod window;

pub use options::Options;
pub use serve::serve;
