//! The whole flow in one pass: link -> wire -> sample -> compensator -> wire -> link.
//!
//! A board calls [`App::poll`] whenever an interrupt has moved a byte and at least once a millisecond. No hardware, no
//! waiting and nothing that can fail is in here.

mod config;

pub use config::{Config, Kvh, Nets};

use crate::link::{Clock, Line};

/// The four lines of a device.
#[derive(Debug, Default)]
pub struct Lines<S, N, C, G> {
    /// The sensor: frames in, requests out.
    pub sensor: S,
    /// The navigation computer: frames out, requests in.
    pub navigation: N,
    /// The command link.
    pub command: C,
    /// The receiver: fixes in.
    pub gnss: G,
}

/// The application.
#[derive(Debug)]
pub struct App {
    #[expect(dead_code, reason = "the flow comes with the next commit")]
    config: Config,
}

impl App {
    /// From its configuration; nothing happens before the first [`App::poll`].
    pub fn new(config: Config) -> App {
        App { config }
    }

    /// One pass. True: there was work, call again at once; false: sleep until the next interrupt.
    pub fn poll<S: Line, N: Line, C: Line, G: Line>(
        &mut self,
        lines: &mut Lines<S, N, C, G>,
        clock: &impl Clock,
    ) -> bool {
        let _ = clock.now_us();
        let mut piece = [0; 64];
        let received = lines.sensor.receive(&mut piece).unwrap_or(0);
        let _ = lines
            .navigation
            .send(piece.get(..received).unwrap_or_default());
        received > 0
    }
}
