//! Stores a device's configuration and weights, so that they survive a power cycle.

use super::info::board;
use super::link::Link;
use firmware::control::{Mode, Reason};
use firmware::wire::command::{Request, fault};
use host_core::error::Error;
use std::thread;
use std::time::Duration;

/// Longest time until a device compares once more what it has stored, ms.
const COMPARES_MS: u32 = 250;

/// Whether the board can store.
///
/// # Errors
/// As [`Link::ask`].
pub fn can_store(link: &mut Link) -> Result<bool, Error> {
    Ok(board(link)?.stores)
}

/// Stores configuration and weights, and sets the mode `after`. The device stores in mode bypass
/// only, because its processor halts meanwhile.
///
/// # Errors
/// As [`Link::ask`]; the device cannot store, or it failed.
pub fn store(link: &mut Link, after: Mode) -> Result<(), Error> {
    link.order(&Request::SetMode(Mode::Bypass))?;
    let stored = link
        .order(&Request::StoreImage)
        .and_then(|()| settled(link));
    link.order(&Request::SetMode(after))?;
    stored
}

/// Waits until the device has stored what it was asked to, and checks that it has: it is busy until
/// then, and does not store the same again.
pub(super) fn settled(link: &mut Link) -> Result<(), Error> {
    loop {
        match link.try_order(&Request::StoreImage)? {
            Ok(()) => break,
            // it compares no more often than that
            Err(Reason::Wait(ms)) if ms <= COMPARES_MS => {
                thread::sleep(Duration::from_millis(ms.into()));
            }
            Err(_) => return link.order(&Request::StoreImage), // the refusal in words
        }
    }
    if link.health()?.faults & fault::STORE == 0 {
        return Ok(());
    }
    Err(link.error(
        "the device could not store: what it was sent is in use, but only until it is switched off",
        "try again: host-sim device store; if it fails again, the flash is worn",
    ))
}
