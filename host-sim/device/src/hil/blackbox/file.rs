//! The file of a black box: JSON, so that it can be read and sent by mail.

use crate::device::Fetched;
use firmware::app::blackbox::read::{HEAD_LEN, Head};
use firmware::app::blackbox::{Cause, LEN, State};
use firmware::configuration::Configuration;
use firmware::configuration::record::decode;
use host_core::error::Error;
use host_io::output::write_atomic;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the file.
const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Content {
    blackbox: u32,
    firmware: [u16; 3],
    /// Why the recording stopped, in words for the reader; `memory` has it, too.
    holds_because: String,
    /// Hexadecimal.
    configuration: String,
    memory: String,
}

/// Writes a black box that was read from a device.
///
/// # Errors
/// The file cannot be written.
pub fn write(file: &Path, fetched: &Fetched) -> Result<(), Error> {
    let content = Content {
        blackbox: VERSION,
        firmware: fetched.firmware,
        holds_because: because(fetched.recording.state, fetched.recording.cause).into(),
        configuration: hex(&fetched.configuration),
        memory: hex(&fetched.memory),
    };
    let text = serde_json::to_string_pretty(&content)
        .map_err(|error| refused(file, &error.to_string(), "report it"))?;
    write_atomic(file, (text + "\n").as_bytes())
}

/// Reads a file: the configuration, if the device had one, and the bytes of the black box.
///
/// # Errors
/// The file cannot be read, or is not a black box of this version.
pub fn read(file: &Path) -> Result<(Option<Configuration>, Vec<u8>), Error> {
    let text = std::fs::read(file).map_err(|error| Error::reading(file, error))?;
    let remedy = "give a file that `device blackbox -o FILE` has written";
    let content: Content = serde_json::from_slice(&text)
        .map_err(|error| refused(file, &format!("is not a black box ({error})"), remedy))?;
    let bytes = |name: &str, text: &str| {
        unhex(text).ok_or_else(|| refused(file, &format!("{name} is not hexadecimal"), remedy))
    };
    let configuration = bytes("configuration", &content.configuration)?;
    let memory = bytes("memory", &content.memory)?;
    let head = memory.get(..HEAD_LEN).and_then(Head::parse);
    if content.blackbox != VERSION || memory.len() != LEN || head.is_none() {
        let other = "use the host-sim of the version that has written the file";
        return Err(refused(file, "holds a black box of another version", other));
    }
    let configuration = if configuration.is_empty() {
        None
    } else {
        let decoded = decode(&configuration);
        let other = "use the host-sim of the device's version";
        Some(
            decoded
                .map_err(|reason| refused(file, &format!("configuration: {reason:?}"), other))?,
        )
    };
    Ok((configuration, memory))
}

/// Why a recording stopped, in words.
pub fn because(state: State, cause: Cause) -> &'static str {
    match (state, cause) {
        (State::Records, _) | (_, Cause::None) => "it records",
        (_, Cause::Fault) => "a fault came",
        (_, Cause::Request) => "it was asked to",
        (_, Cause::Reset) => "the device was reset",
    }
}

fn refused(file: &Path, problem: &str, remedy: &str) -> Error {
    Error::Option {
        option: file.display().to_string(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn unhex(text: &str) -> Option<Vec<u8>> {
    if !text.is_ascii() || !text.len().is_multiple_of(2) {
        return None;
    }
    let pairs = (0..text.len()).step_by(2);
    pairs
        .map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok())
        .collect()
}
