//! Sends a configuration to a device and reads it back.

use super::info::board;
use super::link::Link;
use super::refusal;
use firmware::configuration::record::{MAX_LEN, decode, encode};
use firmware::configuration::{Configuration, SCHEMA};
use firmware::control::{Mode, Reason};
use firmware::wire::command::{MAX_CHUNK, Request};
use host_core::error::Error;
use std::time::{Duration, Instant};

/// Longest wait for a device that fades out a correction before it accepts a configuration. A
/// longer fade is reported as an error.
const FADES: Duration = Duration::from_secs(20);
/// Time between two attempts meanwhile.
const AGAIN: Duration = Duration::from_millis(250);

/// The record of the configuration in use, as the device returns it; `None` without one.
///
/// # Errors
/// As [`Link::ask`].
pub fn record(link: &mut Link) -> Result<Option<Vec<u8>>, Error> {
    let read = |offset, length| Request::ReadConfiguration { offset, length };
    let bytes = link.read(MAX_LEN, read)?;
    Ok((!bytes.is_empty()).then_some(bytes))
}

/// The configuration in use; `None` without one.
///
/// # Errors
/// As [`Link::ask`], or this program cannot decode the record.
pub fn configuration(link: &mut Link) -> Result<Option<Configuration>, Error> {
    let Some(bytes) = record(link)? else {
        return Ok(None);
    };
    decode(&bytes).map(Some).map_err(|reason| {
        let problem = format!("its configuration cannot be read ({reason:?})");
        link.error(
            problem,
            "configure it again: host-sim device configure FILE",
        )
    })
}

/// Sends the bytes of a record. The device checks them as a whole and restarts with them.
/// The inner result is the device's refusal.
///
/// # Errors
/// As [`Link::request`].
pub fn send(link: &mut Link, record: &[u8]) -> Result<Result<(), Reason>, Error> {
    for (index, bytes) in record.chunks(MAX_CHUNK).enumerate() {
        let offset = (index * MAX_CHUNK) as u32;
        let piece = Request::WriteConfiguration { offset, bytes };
        if let Err(reason) = link.try_order(&piece)? {
            return Ok(Err(reason));
        }
    }
    let length = record.len() as u32;
    link.try_order(&Request::CommitConfiguration { length })
}

/// Configures a device: sets the mode bypass, sends the record, reads it back and compares byte for
/// byte. Waits up to 20 s for a correction that fades out. The device restarts in the mode of the
/// configuration. When it refuses, its old configuration and mode stay.
///
/// # Errors
/// As [`Link::ask`]; the device refuses, or it has another configuration afterwards.
pub fn configure(link: &mut Link, configuration: &Configuration) -> Result<(), Error> {
    let taken = board(link)?.schema;
    if taken != SCHEMA {
        let (problem, remedy) = refusal::schema(taken);
        return Err(link.error(problem, &remedy));
    }
    let record = encode(configuration);
    let before = link.health()?.mode;
    link.order(&Request::SetMode(Mode::Bypass))?;
    let begun = Instant::now();
    let mut sent = send(link, &record);
    // a correction may still be fading out
    while matches!(sent, Ok(Err(Reason::Mode))) && begun.elapsed() < FADES {
        std::thread::sleep(AGAIN);
        sent = send(link, &record);
    }
    // The answer to a commit may be lost, and the device already be in its new mode when the
    // request is repeated: so the configuration that it has decides.
    let holds = self::record(link)?;
    if holds.as_deref() == Some(&record) && sent.is_ok() {
        let mode = configuration.correction.mode;
        if link.health()?.mode != mode {
            link.order(&Request::SetMode(mode))?;
        }
        return Ok(());
    }
    let length = record.len() as u32;
    let error = match sent {
        Ok(Err(reason)) => link.refused(&Request::CommitConfiguration { length }, reason),
        Ok(Ok(())) => link.error(
            "the device holds another configuration than it was sent",
            "send it again; if that does not help, restart the device",
        ),
        Err(error) => error,
    };
    link.order(&Request::SetMode(before))?;
    Err(error)
}
