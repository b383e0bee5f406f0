//! `host-sim replay blackbox`.

use super::output::JsonOption;
use clap::Args as ClapArgs;
use firmware::app::blackbox::read::events;
use firmware::app::blackbox::{AppState, EventKind};
use host_core::error::Error;
use host_device::device::{MODES, mode_name};
use host_device::hil::blackbox::{self, Verdict, names, play, read};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `replay blackbox`.
#[derive(Debug, ClapArgs)]
pub(super) struct Blackbox {
    /// File of `device blackbox -o`
    file: PathBuf,
    #[command(flatten)]
    json: JsonOption,
}

/// The output of `--json`.
#[derive(Debug, Serialize)]
struct Played<'a> {
    events: &'a [Event],
    pages: &'a [Page],
}

#[derive(Debug, Serialize)]
struct Event {
    at_s: f64,
    what: String,
    value: String,
}

/// A page of the recording, and whether the application here does the same.
#[derive(Debug, Serialize)]
struct Page {
    number: u32,
    at_s: f64,
    pieces: usize,
    bytes: usize,
    verdict: String,
}

impl Page {
    fn of(page: &blackbox::Page) -> Self {
        Self {
            number: page.number,
            at_s: page.at_us as f64 * 1e-6,
            pieces: page.pieces,
            bytes: page.bytes,
            verdict: match &page.verdict {
                Verdict::Agrees => "the same bytes and faults follow".into(),
                Verdict::NotPlayed(why) => format!("not played: {why}"),
                Verdict::Differs(at_us, what) => {
                    format!("DIFFERS at {:.6} s: {what}", *at_us as f64 * 1e-6)
                }
            },
        }
    }
}

const STAGES: [(AppState, &str); 5] = [
    (AppState::Start, "start"),
    (AppState::Detect, "looking for the format"),
    (AppState::Run, "run"),
    (
        AppState::FaultUnits,
        "bytes pass: the units of the samples are not known",
    ),
    (AppState::FaultNetwork, "bytes pass: the networks failed"),
];

/// The value of an event in words; the number itself where it has no name.
fn value(what: EventKind, value: u32) -> String {
    let stage = STAGES.iter().find(|(stage, _)| *stage as u32 == value);
    let mode = MODES.into_iter().find(|mode| *mode as u32 == value);
    let name = match (what, value) {
        (EventKind::Faults, _) => return names(value),
        (EventKind::Nets, _) => return format!("{value:#010x}"),
        (EventKind::Fix, _) => return format!("valid at {:.3} s", f64::from(value) * 1e-3),
        (EventKind::Mode, _) => mode.map(mode_name),
        (EventKind::Stage, _) => stage.map(|(_, name)| *name),
        (EventKind::Start, 0) => Some("with blank memory"),
        (EventKind::Start, 1) => Some("after a reset"),
        (EventKind::Alignment | EventKind::Rest, 1) => Some("begun"),
        (EventKind::Rest, 0) => Some("over"),
        (EventKind::Alignment, 2) => Some("finished"),
        _ => None,
    };
    name.map_or_else(|| value.to_string(), str::to_owned)
}

impl Blackbox {
    pub(super) fn run(&self) -> Result<(), Error> {
        let (configuration, memory) = read(&self.file)?;
        let events: Vec<Event> = events(&memory)
            .map(|event| Event {
                at_s: f64::from(event.at_ms) * 1e-3,
                what: format!("{:?}", event.what),
                value: value(event.what, event.value),
            })
            .collect();
        let pages = play(configuration.as_ref(), &memory);
        let differs = pages.iter().find_map(|page| match page.verdict {
            Verdict::Differs(at_us, _) => Some(at_us),
            _ => None,
        });
        let pages: Vec<Page> = pages.iter().map(Page::of).collect();
        self.json.write(&Played {
            events: &events,
            pages: &pages,
        })?;
        for Event { at_s, what, value } in &events {
            println!("{at_s:>10.3} s  {what} {value}");
        }
        for Page {
            number,
            at_s,
            pieces,
            bytes,
            verdict,
        } in &pages
        {
            println!("page {number} from {at_s:.6} s, {pieces} pieces, {bytes} bytes: {verdict}");
        }
        let Some(at_us) = differs else {
            return Ok(());
        };
        Err(Error::differs(
            self.file.display().to_string(),
            format!(
                "the device did something else at {:.6} s",
                at_us as f64 * 1e-6
            ),
            "play it with the host-sim of the device's version; if it still differs, the device's \
             memory or processor has failed",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_and_stages_have_names() {
        assert_eq!(value(EventKind::Mode, 3), "learn");
        assert_eq!(value(EventKind::Stage, 2), "run");
        assert_eq!(value(EventKind::Stage, 9), "9");
        assert_eq!(value(EventKind::Start, 1), "after a reset");
        assert_eq!(value(EventKind::Restart, 2), "2");
        assert_eq!(value(EventKind::Nets, 255), "0x000000ff");
    }
}
