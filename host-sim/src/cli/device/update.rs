//! `host-sim device update`.

use crate::cli::progress::bar;
use firmware::wire::command::Request;
use host_core::error::Error;
use host_device::device::{Link, Tried, Update};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// Erasing a part of the flash, behind which an answer waits, takes up to 4 s: tries, half a second
/// apart.
const TRIES: u32 = 20;
/// An update proves itself in ten seconds, if the sensor sends.
const PATIENCE: Duration = Duration::from_secs(45);

/// Result of an update.
#[derive(Serialize)]
pub(super) struct Done {
    /// Version of the firmware.
    version: String,
    /// `confirmed`, `on trial`, or `ready` for the next start.
    state: &'static str,
    /// The result in a sentence.
    pub says: String,
}

/// Sends an update, restarts the device with it, and waits until it is confirmed.
pub(super) fn run(
    link: &mut Link,
    file: &Path,
    older: bool,
    restart: bool,
    open: &mut dyn FnMut() -> Result<Link, Error>,
) -> Result<Done, Error> {
    let update = Update::read(file)?;
    let version = update.version();
    let bar = bar(0, "update {bar:30} {percent} %, {eta} left");
    link.set_tries(TRIES);
    let sent = update.send(link, older, &mut |sent, all| {
        bar.set_length(all as u64);
        bar.set_position(sent as u64);
    });
    bar.finish_and_clear();
    sent?;
    if !restart {
        return Ok(Done {
            says: format!("firmware {version} is on the device; the next start tries it"),
            version,
            state: "ready",
        });
    }
    link.order(&Request::Restart)?;
    let (state, says) = match update.tried(open, PATIENCE)? {
        Tried::Confirmed => (
            "confirmed",
            format!("firmware {version} runs, has proved itself and stays"),
        ),
        Tried::OnTrial => (
            "on trial",
            format!(
                "firmware {version} runs on trial: it stays when the sensor has sent for ten \
                 seconds without a fault that the device did not have before (device info); else \
                 the next start goes back"
            ),
        ),
        Tried::WentBack => {
            return Err(link.error(
                format!("firmware {version} failed, and the device went back to the one before"),
                "report it, with the output of `host-sim device info`",
            ));
        }
    };
    Ok(Done {
        version,
        state,
        says,
    })
}
