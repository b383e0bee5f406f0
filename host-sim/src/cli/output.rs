//! Output of a command: the printed table, the report directory and the JSON file.

use super::options::{arguments, refused};
use super::progress::{self, ProgressLine};
use super::stdout;
use clap::Args as ClapArgs;
use clap::builder::{PathBufValueParser, TypedValueParser};
use host_core::error::Error;
use host_io::output::{check_directory, check_writable, write_atomic};
use host_io::recordings::record::Record;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Report;
use host_report::replay::Head;
use serde::Serialize;
use serde::de::IgnoredAny;
use std::path::{Path, PathBuf};

/// `--json`.
#[derive(Debug, Clone, ClapArgs)]
pub(super) struct JsonOption {
    /// Write the results as JSON to this file
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(json_file))]
    json: Option<PathBuf>,
}

impl JsonOption {
    /// Writes `value` if the option was given.
    pub(super) fn write<T: Serialize + ?Sized>(&self, value: &T) -> Result<(), Error> {
        match &self.json {
            Some(file) => write_json(file, value),
            None => Ok(()),
        }
    }

    /// The file, if the option was given.
    pub(super) fn file(&self) -> Option<&Path> {
        self.json.as_deref()
    }

    /// Writes a finished text if the option was given.
    pub(super) fn write_text(&self, text: &str) -> Result<(), Error> {
        match &self.json {
            Some(file) => write_over_json(file, text.as_bytes()),
            None => Ok(()),
        }
    }
}

/// The value of `--json`. A slip of the pen is found before the work.
fn json_file(file: PathBuf) -> Result<PathBuf, String> {
    match is_of_another_kind(&file) {
        false => can_be_written(file),
        true => Err(format!("{NOT_JSON}; remedy: {ANOTHER_NAME}")),
    }
}

/// A file that the command will write. That it can is checked before the work.
pub(super) fn output_file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(can_be_written)
}

/// A directory that the command will write to, as [`output_file`].
pub(super) fn output_directory() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|directory: PathBuf| {
        check_directory(&directory).map_err(|of| of.to_string())?;
        Ok::<_, String>(directory)
    })
}

fn can_be_written(file: PathBuf) -> Result<PathBuf, String> {
    check_writable(&file).map_err(|of| of.to_string())?;
    Ok(file)
}

const NOT_JSON: &str = "is there and is not JSON, and would be overwritten";
const ANOTHER_NAME: &str = "give another name, or delete that file first";

/// Whether a file is there that is not JSON, such as a recording or a unit file. A device or a pipe
/// loses nothing, and what cannot be opened is reported where it is written.
fn is_of_another_kind(file: &Path) -> bool {
    let read = file.is_file().then(|| std::fs::read(file).ok()).flatten();
    let is_other =
        |bytes: Vec<u8>| !bytes.is_empty() && serde_json::from_slice::<IgnoredAny>(&bytes).is_err();
    read.is_some_and(is_other)
}

/// Writes JSON, but not over a file of another kind, which this command may have written.
fn write_over_json(file: &Path, json: &[u8]) -> Result<(), Error> {
    match is_of_another_kind(file) {
        false => write_atomic(file, json),
        true => Err(refused(
            "--json",
            format!("is {}, which {NOT_JSON}", file.display()),
            ANOTHER_NAME,
        )),
    }
}

/// Refuses to write over a file that is there and is not `ours`, one that the same command may have
/// written before.
pub(super) fn check_ours(
    option: &str,
    file: &Path,
    ours: impl FnOnce(&[u8]) -> bool,
) -> Result<(), Error> {
    let there = file.is_file().then(|| std::fs::read(file).ok()).flatten();
    if there.is_some_and(|bytes| !bytes.is_empty() && !ours(&bytes)) {
        let problem = format!("is {}, which this command has not written", file.display());
        return Err(refused(option, problem, ANOTHER_NAME));
    }
    Ok(())
}

/// Refuses to write over files of `names` in `dir` that are there.
pub(super) fn check_free(dir: &Path, names: &[&str], force: bool) -> Result<(), Error> {
    let there = names
        .iter()
        .map(|name| dir.join(name))
        .find(|file| file.is_file());
    match there.filter(|_| !force) {
        None => Ok(()),
        Some(file) => Err(refused(
            "--out",
            format!(
                "has the file {}, which would be overwritten",
                file.display()
            ),
            "give another directory, or --force to replace the files",
        )),
    }
}

/// A recording that was written, as JSON.
#[derive(Debug, Serialize)]
pub(super) struct WrittenRecording<'a> {
    files: Vec<PathBuf>,
    /// Increments that were written: one less than rates that were read.
    pub(super) samples: usize,
    /// Times of the first and the last of them, s.
    times_s: Option<[f64; 2]>,
    rate_hz: usize,
    fixes: usize,
    /// Times of the first and the last fix, s.
    fix_times_s: Option<[f64; 2]>,
    notes: &'a [String],
}

impl<'a> WrittenRecording<'a> {
    /// Of a recording in the files `names` of `dir`, with so many of its fixes.
    pub(super) fn of(
        dir: &Path,
        names: &[&str],
        record: &Record,
        fixes: usize,
        notes: &'a [String],
    ) -> Self {
        let mut times = record.written_increments().map(|(time, _)| time);
        let first = times.next();
        let (samples, times_s) = first.map_or((0, None), |first| {
            let (n, last) = times.fold((1, first), |(n, _), time| (n + 1, time));
            (n, Some([first, last]))
        });
        let of_fixes = record.fixes.first().zip(record.fixes.last());
        Self {
            files: names.iter().map(|name| dir.join(name)).collect(),
            samples,
            times_s,
            rate_hz: record.rate_hz,
            fixes,
            fix_times_s: of_fixes.map(|(first, last)| [first.time, last.time]),
            notes,
        }
    }
}

/// Writes `value` to `file` as JSON.
pub(super) fn write_json<T: Serialize + ?Sized>(file: &Path, value: &T) -> Result<(), Error> {
    let text = serde_json::to_vec_pretty(value).map_err(|e| Error::writing(file, e.into()))?;
    write_over_json(file, &text)
}

/// `--json` and `--out` of a command that always writes a report.
#[derive(Debug, ClapArgs)]
pub(super) struct Output {
    #[command(flatten)]
    pub(super) json: JsonOption,
    /// Directory of the report [default: a directory in out/ named after the command]
    #[arg(long, value_name = "DIR", value_parser = output_directory())]
    out: Option<PathBuf>,
}

impl Output {
    /// The directory of the report; `name` is the default within `out`.
    pub(super) fn directory(&self, name: &str) -> PathBuf {
        let given = self.out.clone();
        given.unwrap_or_else(|| Path::new("out").join(name))
    }

    /// Prints the table and the notes of one experiment, and writes its report and JSON. The
    /// progress line `shown` is removed before they are printed.
    pub(super) fn leave_report(
        &self,
        name: &str,
        report: &Report,
        shown: ProgressLine,
    ) -> Result<(), Error> {
        progress::stage(progress::WRITING);
        // All faults of the results are found before anything is written.
        let json = host_report::json::json(&report.results)?;
        let page = host_report::page::write(&self.directory(name), report);
        drop(shown);
        let table = host_report::table::table(&report.results, stdout::width());
        println!("{}\n", report.title);
        for sentence in host_report::verdict::of_results(&report.results) {
            println!("{sentence}");
        }
        println!("\n{table}");
        for note in &report.notes {
            println!("- {note}");
        }
        // a full disk takes the files, and not the table
        let page = page?;
        self.json.write_text(&json)?;
        println!("\nreport: {}", page.display());
        Ok(())
    }

    /// As [`leave_report`], for the cases of a replay.
    pub(super) fn leave_outcomes(
        &self,
        name: &str,
        outcomes: &[Outcome],
        shown: ProgressLine,
    ) -> Result<(), Error> {
        progress::stage(progress::WRITING);
        let head = Head {
            title: format!("Replay {name}: learnt from one part, free inertial on another"),
            command: format!("host-sim {}", arguments()),
        };
        let directory = self.directory(&format!("replay-{name}"));
        let page = host_report::replay::write(&directory, &head, outcomes);
        drop(shown);
        let table = host_report::replay::text(outcomes, stdout::width());
        if outcomes.len() > 1 {
            println!("{}\n", host_report::verdict::headline(outcomes));
        }
        for outcome in outcomes {
            println!("{}, {}:", outcome.recording, outcome.case);
            for sentence in host_report::verdict::of_outcome(outcome) {
                println!("  {sentence}");
            }
        }
        println!(
            "\nhorizontal error in m, by seconds of free-inertial navigation (\u{25c2}: the device)"
        );
        let mut starts: Vec<&str> = outcomes.iter().map(|of| of.start.as_str()).collect();
        starts.dedup();
        for start in starts {
            println!("{start}");
        }
        println!("\n{table}");
        for outcome in outcomes {
            for note in &outcome.notes {
                println!("- {}, {}: {note}", outcome.recording, outcome.case);
            }
        }
        let page = page?;
        self.json.write(&host_report::json::outcomes(outcomes))?;
        println!("\nreport: {}", page.display());
        Ok(())
    }
}
