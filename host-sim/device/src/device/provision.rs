//! Gives a device its key.

use super::info::board;
use super::key::{make_key, read_key};
use super::link::Link;
use super::store::settled;
use firmware::control::Mode;
use firmware::wire::command::key::Secret;
use firmware::wire::command::{Protection, Provision, Request, fault};
use host_core::error::Error;
use std::path::Path;

/// Gives the device the key of a file, which is created if it does not exist. If the device has a
/// key already, that key seals the request, so the link must have it. The device stores the key,
/// with the configuration and the weights in use, in mode bypass; then its mode is restored.
///
/// # Errors
/// As [`Link::ask`]; the file is not a key file; the device cannot store.
pub fn provision(link: &mut Link, file: &Path) -> Result<(), Error> {
    check(link)?;
    let made = !file.exists();
    // written before the device gets it: a key that is in no file would lock the device
    let secret = if made { make_key(file) } else { read_key(file) }?;
    let given = give(link, Some(secret));
    if given.is_err() && made && link.security().is_ok_and(|now| !has(now.protection)) {
        // the key is not in use
        let _ = std::fs::remove_file(file);
    }
    given
}

/// Makes the device work without a key.
///
/// # Errors
/// As [`Link::ask`]; the device cannot store.
pub fn open_by_choice(link: &mut Link) -> Result<(), Error> {
    check(link)?;
    give(link, None)
}

fn has(protection: Protection) -> bool {
    protection == Protection::Keyed
}

fn check(link: &mut Link) -> Result<(), Error> {
    link.version()?;
    if board(link)?.stores {
        return Ok(());
    }
    Err(link.error(
        "this board has no place to store a key",
        "use a board with flash for it",
    ))
}

fn give(link: &mut Link, secret: Option<Secret>) -> Result<(), Error> {
    let before = link.health()?.mode;
    link.order(&Request::SetMode(Mode::Bypass))?;
    let with = secret.map_or(Provision::OpenByChoice, Provision::Secret);
    let given = link.order(&Request::Provision(with));
    let stored = given.and_then(|()| {
        link.set_key(secret);
        settled(link)
    });
    link.order(&Request::SetMode(before))?;
    stored?;
    let wanted = match secret {
        Some(_) => Protection::Keyed,
        None => Protection::OpenByChoice,
    };
    if link.health()?.faults & fault::KEY != 0 {
        return Err(link.error(
            "the key is in use, but the store still has a record with the key before, or without one",
            "give it again; if that does not help, the flash is worn: replace the board",
        ));
    }
    if link.security()?.protection == wanted {
        return Ok(());
    }
    Err(link.error(
        "the device did not take the key",
        "send it again; if that does not help, use the host-sim of the device's version",
    ))
}
