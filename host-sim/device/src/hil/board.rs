//! State of a board before a run, restored afterwards.

use crate::device::{self, Link, configure, set_up};
use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::wire::command::{Counters, Request};
use host_core::error::Error;
use std::time::Duration;

/// State of the board that is restored after the run.
#[derive(Debug)]
pub(super) struct Before {
    mode: Mode,
    images: Vec<u8>,
    configuration: Option<Configuration>,
}

impl Before {
    /// Reads the state from the board.
    pub(super) fn of(link: &mut Link) -> Result<Self, Error> {
        Ok(Self {
            mode: link.health()?.mode,
            images: link.images()?,
            configuration: device::configuration(link)?,
        })
    }

    /// Whether the board had no configuration.
    pub(super) fn was_unconfigured(&self) -> bool {
        self.configuration.is_none()
    }

    /// Restores the state.
    pub(super) fn restore(&self, link: &mut Link) -> Result<(), Error> {
        link.order(&Request::SetMode(Mode::Bypass))?;
        if let Some(configuration) = &self.configuration {
            configure(link, configuration)?;
            link.order(&Request::SetMode(Mode::Bypass))?;
        }
        link.orders(&set_up(&self.images, self.mode))
    }
}

/// The counters once the `sent` fixes of the run have arrived: the receiver line is slower than the
/// sensor line and may still carry the last ones. What does not arrive is waited for until two
/// seconds pass without another fix.
pub(super) fn settled(link: &mut Link, begun: &Counters, sent: usize) -> Result<Counters, Error> {
    let mut last = link.counters()?;
    let mut unchanged = 0;
    while (last.good_fixes.wrapping_sub(begun.good_fixes) as usize) < sent && unchanged < 10 {
        std::thread::sleep(Duration::from_millis(200));
        let now = link.counters()?;
        let another = now.good_fixes != last.good_fixes;
        unchanged = if another { 0 } else { unchanged + 1 };
        last = now;
    }
    Ok(last)
}
