//! `host-sim replay blackbox`.

use super::output::JsonOption;
use clap::Args as ClapArgs;
use firmware::app::blackbox::What;
use firmware::app::blackbox::read::events;
use host_core::error::Error;
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

impl Blackbox {
    pub(super) fn run(&self) -> Result<(), Error> {
        let (configuration, memory) = read(&self.file)?;
        let events: Vec<Event> = events(&memory)
            .map(|event| Event {
                at_s: f64::from(event.at_ms) * 1e-3,
                what: format!("{:?}", event.what),
                value: match event.what {
                    What::Faults => names(event.value),
                    _ => event.value.to_string(),
                },
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
