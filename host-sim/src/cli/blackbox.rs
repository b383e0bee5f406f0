//! `host-sim replay blackbox`.

use crate::error::Error;
use crate::hil::blackbox::{Verdict, names, play, read};
use clap::Args as ClapArgs;
use firmware::app::blackbox::What;
use firmware::app::blackbox::read::events;
use std::path::PathBuf;

/// Arguments of `replay blackbox`.
#[derive(Debug, ClapArgs)]
pub(super) struct Blackbox {
    /// File of `device blackbox -o`
    file: PathBuf,
}

impl Blackbox {
    pub(super) fn run(&self) -> Result<(), Error> {
        let (told, memory) = read(&self.file)?;
        for event in events(&memory) {
            let value = match event.what {
                What::Faults => names(event.value),
                _ => event.value.to_string(),
            };
            println!(
                "{:>10.3} s  {:?} {value}",
                f64::from(event.at_ms) * 1e-3,
                event.what
            );
        }
        let mut differs = None;
        for page in play(told.as_ref(), &memory) {
            let verdict = match &page.verdict {
                Verdict::Agrees => "the same bytes and faults follow".into(),
                Verdict::NotPlayed(why) => format!("not played: {why}"),
                Verdict::Differs(at_us, what) => {
                    differs.get_or_insert(*at_us);
                    format!("DIFFERS at {:.6} s: {what}", *at_us as f64 * 1e-6)
                }
            };
            println!(
                "page {} from {:.6} s, {} pieces, {} bytes: {verdict}",
                page.number,
                page.at_us as f64 * 1e-6,
                page.pieces,
                page.bytes
            );
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
