//! The one error type of this package, for bad input and unwritable output. It gives the problem,
//! its location and the remedy.
//!
//! `Display` gives one line without the program's name, ready for `eprintln!("host-sim: {error}")`.
//! The program prints that line and exits with [`Error::code`]. Most variants are about input that
//! the user can correct. Mistakes of the program itself are panics, not errors.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Bad input or unwritable output. Line numbers start at 1 and count the header.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is not there.
    #[error(
        "{}: no such file; remedy: check the path: one on the command line is relative to the current \
         directory, one in a file to that file",
        .file.display()
    )]
    Missing {
        /// Path as given.
        file: PathBuf,
    },
    /// A file where a folder is wanted.
    #[error("{}: is a file, not a folder; remedy: give the path of a folder", .path.display())]
    NoFolder {
        /// Path as given.
        path: PathBuf,
    },
    /// A folder where a file is wanted.
    #[error(
        "{}: is a folder, not a file; remedy: give the path of a file in it",
        .file.display()
    )]
    Folder {
        /// Path as given.
        file: PathBuf,
    },
    /// Bytes where text is wanted.
    #[error(
        "{}: is not text (not UTF-8); remedy: check that it is the file that you mean; a text of \
         another encoding is to be saved as UTF-8",
        .file.display()
    )]
    NotText {
        /// Path as given.
        file: PathBuf,
    },
    /// A file of a kind that is known and not read, by its first bytes.
    #[error("{}: is {kind}; remedy: {remedy}", .file.display())]
    OtherKind {
        /// Path as given.
        file: PathBuf,
        /// Kind of the file.
        kind: &'static str,
        /// How to get what is read.
        remedy: &'static str,
    },
    /// The file is there but cannot be read.
    #[error(
        "{}: cannot be read ({source}); remedy: check that you may read it and that its disk is \
         healthy",
        .file.display()
    )]
    Unreadable {
        /// Path as given.
        file: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Compressed data that end early or whose check sum is wrong.
    #[error(
        "{}: the compressed data {fault} after {bytes} unpacked bytes{}; remedy: get the file \
         again, it is incomplete or damaged",
        .file.display(), behind(.line)
    )]
    Packed {
        /// Path as given.
        file: PathBuf,
        /// Bytes that were unpacked.
        bytes: u64,
        /// Last complete line of a text, else 0.
        line: usize,
        /// `end` or `are damaged`.
        fault: &'static str,
    },
    /// No data in the file.
    #[error(
        "{}: {found}; remedy: give a file with {expected}",
        .file.display()
    )]
    Empty {
        /// Path as given.
        file: PathBuf,
        /// What was found instead: nothing, or the header alone.
        found: &'static str,
        /// Description of the expected content.
        expected: String,
    },
    /// The first line does not name the expected columns.
    #[error(
        "{}:1: header is '{found}'; remedy: the first line must be '{expected}'",
        .file.display()
    )]
    Header {
        /// Path as given.
        file: PathBuf,
        /// The first line, shortened if long.
        found: String,
        /// The header line.
        expected: String,
    },
    /// A line has too few or too many values.
    #[error(
        "{}:{line}: {found} columns instead of {expected}; remedy: give one value for each of \
         {columns}",
        .file.display()
    )]
    ColumnCount {
        /// Path as given.
        file: PathBuf,
        /// Line.
        line: usize,
        /// Values on this line.
        found: usize,
        /// Columns of the header, or of the format.
        expected: usize,
        /// Names of the columns.
        columns: String,
    },
    /// A value is not a finite number, or not an integer where one is needed, or outside its range.
    #[error("{}:{line}: column '{field}': '{text}' is {fault}; remedy: {remedy}", .file.display())]
    Value {
        /// Path as given.
        file: PathBuf,
        /// Line.
        line: usize,
        /// Column.
        field: String,
        /// The text found.
        text: String,
        /// The fault: `not a number`, `not finite`, `out of range`, ...
        fault: &'static str,
        /// How to correct it.
        remedy: String,
    },
    /// The time does not increase from one line to the next.
    #[error(
        "{}:{line}: column '{field}': time {now} follows {before}; remedy: {}",
        .file.display(), in_order(.before, .now)
    )]
    TimeBack {
        /// Path as given.
        file: PathBuf,
        /// Line.
        line: usize,
        /// Column of the time.
        field: String,
        /// Time on the line before, in the column's unit.
        before: f64,
        /// Time on this line.
        now: f64,
    },
    /// An unknown name of a scenario, a preset, a scheme and so on.
    #[error(
        "there is no {kind} '{name}'{}; remedy: one of {}",
        nearest(.name, .known),
        .known.join(", ")
    )]
    UnknownName {
        /// Kind of the name, for example `scenario`.
        kind: &'static str,
        /// The name given.
        name: String,
        /// All known names.
        known: Vec<String>,
    },
    /// A scenario file that cannot be used: unknown key, wrong type, value out of range.
    #[error(
        "{}{}: '{key}' {problem}; remedy: {remedy}",
        .file.display(), .line.map_or(String::new(), |line| format!(":{line}"))
    )]
    Scenario {
        /// Path as given.
        file: PathBuf,
        /// Line, where it is known.
        line: Option<usize>,
        /// Key with its table, for example `gyro.bias_deg_per_h`.
        key: String,
        /// What is wrong, as the rest of a sentence.
        problem: String,
        /// How to correct it.
        remedy: String,
    },
    /// Several faults of one file, one a line.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<Error>),
    /// A wrong command-line option, or options that cannot be combined.
    #[error("{option}: {problem}; remedy: {remedy}")]
    Option {
        /// The option with its dashes.
        option: String,
        /// What is wrong.
        problem: String,
        /// How to correct it.
        remedy: String,
    },
    /// A command whose job is to compare has found a difference.
    #[error("{what}: {difference}; remedy: {remedy}")]
    Differs {
        /// What was compared.
        what: String,
        /// The difference.
        difference: String,
        /// The remedy.
        remedy: String,
    },
    /// The user has interrupted the command.
    #[error("interrupted; {0}")]
    Interrupted(
        /// What has been written, and how to continue.
        String,
    ),
    /// A file or directory cannot be written.
    #[error(
        "{}: cannot be written ({source}); remedy: {}",
        .path.display(), another_place(.source)
    )]
    Unwritable {
        /// The file or directory that was to be written.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The report directory holds files that are no report.
    #[error(
        "{}: {holds} and is not overwritten; remedy: give a new or an empty directory, or one \
         with a report of this program",
        .dir.display()
    )]
    NotOurs {
        /// Directory as given.
        dir: PathBuf,
        /// Content of the directory.
        holds: &'static str,
    },
    /// A result that is NaN or infinite, or curves of different lengths. The run has failed and
    /// nothing is written.
    #[error(
        "result '{item}': '{field}' {problem}, so nothing was written; remedy: look for the first \
         bad value in the run's inputs"
    )]
    BadResult {
        /// For example `row 3 (10 min, rnn)` or a curve's name.
        item: String,
        /// Field.
        field: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A picture could not be drawn.
    #[error(
        "picture '{picture}': {problem}; remedy: please report this fault of the program with the \
         command that you gave"
    )]
    Drawing {
        /// File name of the picture.
        picture: &'static str,
        /// What the drawing library says.
        problem: String,
    },
}

impl Error {
    /// The exit code of the program: 1 for a check that found a difference, 130 for an
    /// interruption, else 2.
    #[must_use]
    pub fn code(&self) -> u8 {
        match self {
            Self::Differs { .. } => 1,
            Self::Interrupted(_) => 130,
            _ => 2,
        }
    }

    /// A check of `what` has found this difference.
    #[must_use]
    pub fn differs(
        what: impl Into<String>,
        difference: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Differs {
            what: what.into(),
            difference: difference.into(),
            remedy: remedy.into(),
        }
    }

    /// Reading `file` failed with `source`: [`Error::Missing`], [`Error::Folder`],
    /// [`Error::NoFolder`], [`Error::NotText`] or [`Error::Unreadable`].
    #[must_use]
    pub fn reading(file: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind as Kind;
        let file = file.to_path_buf();
        match source.kind() {
            Kind::NotADirectory if file.is_file() => Self::NoFolder { path: file },
            // a path that continues below a file does not exist, too
            Kind::NotFound | Kind::NotADirectory => Self::Missing { file },
            Kind::IsADirectory => Self::Folder { file },
            Kind::InvalidData => Self::NotText { file },
            _ => Self::Unreadable { file, source },
        }
    }

    /// Writing `path` failed with `source`.
    #[must_use]
    pub fn writing(path: &Path, source: std::io::Error) -> Self {
        Self::Unwritable {
            path: path.to_path_buf(),
            source,
        }
    }

    /// Unpacking `file` failed after `bytes` bytes of its content, behind `line` of a text.
    #[must_use]
    pub fn unpacking(file: &Path, bytes: u64, line: usize, source: &std::io::Error) -> Self {
        Self::Packed {
            file: file.to_path_buf(),
            bytes,
            line,
            fault: match source.kind() {
                std::io::ErrorKind::UnexpectedEof => "end",
                _ => "are damaged",
            },
        }
    }

    /// `name` is not among `known`. The message offers the nearest known name.
    #[must_use]
    pub fn unknown(kind: &'static str, name: &str, known: &[&str]) -> Self {
        let known = known.iter().map(ToString::to_string).collect();
        Self::UnknownName {
            kind,
            name: name.to_owned(),
            known,
        }
    }
}

/// `text` shortened to fit into a message, with control characters escaped.
#[must_use]
pub fn excerpt(text: &str) -> String {
    const LONGEST: usize = 80;
    let shown: String = text
        .chars()
        .take(LONGEST)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(LONGEST).is_some() {
        shown + "..."
    } else {
        shown
    }
}

/// `, behind line 7` of a text.
fn behind(line: &usize) -> String {
    match line {
        0 => String::new(),
        line => format!(", behind line {line}"),
    }
}

/// The remedy for a time that does not increase.
fn in_order(before: &f64, now: &f64) -> &'static str {
    match () {
        () if before == now => {
            "the same time comes twice: leave one of the lines out, or write the times with all \
             their digits"
        }
        () if *now < 0.1 * before => {
            "the clock begins anew there (a counter that wraps, or a restart): add what it has \
             counted before, or cut the file there; else sort the lines"
        }
        () => "sort the lines, the time must increase from line to line",
    }
}

/// The remedy for a place where nothing can be written.
fn another_place(source: &io::Error) -> &'static str {
    match source.kind() {
        ErrorKind::AlreadyExists | ErrorKind::NotADirectory => {
            "a file stands where a folder is wanted: give another name, or remove it"
        }
        ErrorKind::IsADirectory => "a folder has this name: give the name of a file",
        _ => "choose a place with free space that you may write to",
    }
}

/// `, did you mean 'x'?` if one of `known` is near to `name`, else an empty string.
fn nearest(name: &str, known: &[String]) -> String {
    let close = nearest_name(name, known);
    close.map_or(String::new(), |close| format!(", did you mean '{close}'?"))
}

/// The one of `known` that is nearest to `name`, within two edits and half of its characters.
#[must_use]
pub fn nearest_name<'k>(name: &str, known: &'k [String]) -> Option<&'k str> {
    let best = known.iter().map(|k| (edits(name, k), k)).min();
    best.filter(|(distance, _)| *distance <= 2.min(name.chars().count() / 2))
        .map(|(_, close)| close.as_str())
}

/// Levenshtein distance: the number of single-character insertions, deletions and replacements.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests;
