//! Where the outcomes of a replay go: the terminal, a page, and JSON.

use crate::error::Error;
use crate::experiment::outcome::{Outcome, table};
use crate::output::write_atomic;
use crate::report::outcomes::{self, Head};
use clap::Args as ClapArgs;
use std::path::{Path, PathBuf};

/// Where outcomes go.
#[derive(Debug, ClapArgs)]
pub(super) struct Output {
    /// Write the outcomes as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory of the page [default: out/replay-NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn no_attitude(file: &Path) -> Error {
    Error::Option {
        option: file.display().to_string(),
        problem: "the first part gives no attitude".into(),
        remedy: "the recording must start at rest with live accelerometers and gyros".into(),
    }
}

impl Output {
    /// Prints outcomes as a table with their notes, and writes JSON and page.
    pub(super) fn print(&self, name: &str, outcomes: &[Outcome]) -> Result<(), Error> {
        let default = || PathBuf::from(format!("out/replay-{name}"));
        let dir = self.out.clone().unwrap_or_else(default);
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let head = Head {
            title: format!("Replay {name}: learnt from one part, free inertial on another"),
            command: format!("host-sim {}", arguments.join(" ")),
        };
        let index = outcomes::write(&dir, &head, outcomes)?;
        if let Some(file) = &self.json {
            let text =
                serde_json::to_vec_pretty(outcomes).map_err(|e| Error::writing(file, e.into()))?;
            write_atomic(file, &text)?;
        }
        println!(
            "horizontal error in m, by seconds of free-inertial navigation\n\n{}",
            table(outcomes)
        );
        for outcome in outcomes {
            for note in &outcome.notes {
                println!("- {}, {}: {note}", outcome.recording, outcome.case);
            }
        }
        println!("\nreport: {}", index.display());
        Ok(())
    }
}
