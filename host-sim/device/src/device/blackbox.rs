//! Fetches what the black box of a device holds.

use super::configure::record;
use super::link::Link;
use firmware::app::blackbox::LEN;
use firmware::control::recording::{Order, Recording, State};
use firmware::wire::command::{Request, Response};
use host_core::error::Error;

/// What was fetched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fetched {
    /// Major, minor, patch of the device's firmware.
    pub firmware: [u16; 3],
    /// What the box tells of itself.
    pub recording: Recording,
    /// The configuration record in use; empty without one.
    pub configuration: Vec<u8>,
    /// The bytes of its memory.
    pub memory: Vec<u8>,
}

/// What the black box tells of itself.
///
/// # Errors
/// As [`Link::ask`]; the device has none.
pub fn recording(link: &mut Link) -> Result<Recording, Error> {
    link.ask(&Request::GetRecording, |answer| match answer {
        Response::Recording(recording) => Some(*recording),
        _ => None,
    })
}

/// Has the black box hold what it has, unless it does already, and reads it. The stream goes on.
/// `release`: it records again afterwards.
///
/// # Errors
/// As [`Link::ask`]; the device has none, or another layout.
pub fn fetch(link: &mut Link, release: bool) -> Result<Fetched, Error> {
    let version = link.version()?;
    let mut told = recording(link)?;
    if told.state != State::Holds {
        link.order(&Request::Record(Order::Hold))?;
        told = recording(link)?;
    }
    let read = |offset, length| Request::ReadRecording { offset, length };
    let memory = link.read(LEN, read)?;
    if memory.len() != LEN || told.len as usize != LEN {
        let problem = format!("a black box of {} bytes came, not of {LEN}", memory.len());
        return Err(link.error(problem, "use the host-sim of the device's version"));
    }
    let configuration = record(link)?.unwrap_or_default();
    if release {
        link.order(&Request::Record(Order::Release))?;
    }
    Ok(Fetched {
        firmware: version.firmware,
        recording: told,
        configuration,
        memory,
    })
}
