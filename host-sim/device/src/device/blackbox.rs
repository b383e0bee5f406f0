//! Reads the black box of a device.

use super::configure::record;
use super::link::Link;
use firmware::app::blackbox::LEN;
use firmware::control::recording::{Order, Recording, State};
use firmware::wire::command::{Request, Response};
use host_core::error::Error;

/// A black box as read from a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fetched {
    /// Major, minor, patch of the device's firmware.
    pub firmware: [u16; 3],
    /// State of the black box.
    pub recording: Recording,
    /// The configuration record in use; empty without one.
    pub configuration: Vec<u8>,
    /// The bytes of the black box's memory.
    pub memory: Vec<u8>,
}

/// State of the black box.
///
/// # Errors
/// As [`Link::ask`]; the device has no black box.
pub fn recording(link: &mut Link) -> Result<Recording, Error> {
    link.ask(&Request::GetRecording, |answer| match answer {
        Response::Recording(recording) => Some(*recording),
        _ => None,
    })
}

/// Stops the recording, unless it has stopped already, and reads it. The stream of samples
/// continues. `release`: the black box records again afterwards.
///
/// # Errors
/// As [`Link::ask`]; the device has no black box, or one of another layout.
pub fn fetch(link: &mut Link, release: bool) -> Result<Fetched, Error> {
    let version = link.version()?;
    let mut state = recording(link)?;
    if state.state != State::Holds {
        link.order(&Request::Record(Order::Hold))?;
        state = recording(link)?;
    }
    let read = |offset, length| Request::ReadRecording { offset, length };
    let memory = link.read(LEN, read)?;
    if memory.len() != LEN || state.len as usize != LEN {
        let problem = format!("a black box of {} bytes came, not of {LEN}", memory.len());
        return Err(link.error(problem, "use the host-sim of the device's version"));
    }
    let configuration = record(link)?.unwrap_or_default();
    if release {
        link.order(&Request::Record(Order::Release))?;
    }
    Ok(Fetched {
        firmware: version.firmware,
        recording: state,
        configuration,
        memory,
    })
}
