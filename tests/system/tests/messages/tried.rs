//! What was tried with files as people have them, and the table of it in fixtures/tried.md: every
//! row is made here from one drive that is right, and read by the program.

mod columns;
pub mod edits;
mod files;
mod statements;

use super::host_sim;
use crate::writers::{bag, csv, drive, ulog};
use edits::Case;
use host_core::inertial::session::Session;
use std::fmt::Write;
use std::path::Path;

const HEADING: &str = "| input | what is reported | result |\n|---|---|---|\n";

/// Files of one right drive.
fn prepare(dir: &Path, session: &Session) {
    csv(dir, session, true);
    let out = "convert csv --header header.toml --to kf-gins --velocity --out k";
    host_sim(dir, out).success();
    std::fs::write(dir.join("drive.mcap"), bag(session)).unwrap();
    std::fs::write(dir.join("flight.ulg"), ulog(session)).unwrap();
}

/// Copies what is in a folder.
fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let from = entry.unwrap().path();
        let to = to.join(from.file_name().unwrap());
        if from.is_dir() {
            std::fs::create_dir(&to).unwrap();
            copy(&from, &to);
        } else {
            std::fs::copy(from, to).unwrap();
        }
    }
}

/// What a command reports: notes, warnings and errors, one each; and the result in a word.
fn tried(dir: &Path, case: &Case) -> (Vec<String>, String) {
    (case.make)(dir);
    let out = host_sim(dir, case.args);
    let output = out.get_output();
    let code = output.status.code();
    let [stdout, stderr] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(!stderr.contains("panicked"), "{}: {stderr}", case.input);
    let notes = stdout.lines().filter_map(|line| {
        let note = line.strip_prefix("- ");
        note.or_else(|| line.strip_prefix("doubtful: "))
    });
    let mut printed: Vec<String> = notes.map(str::to_owned).collect();
    let mine = stderr.lines().filter(|line| {
        let usual = ["no unit is given", "--strict: was given"];
        !usual.iter().any(|part| line.contains(part))
    });
    printed.extend(mine.map(|line| line.trim_start_matches("host-sim: ").to_owned()));
    let result = match code {
        Some(0) => stdout.lines().last().unwrap_or_default(),
        _ if stderr.contains("--strict: was given") => "warned",
        _ => "refused",
    };
    (printed, result.to_owned())
}

/// Every case reports what its writer says, and the table of the file is what they report.
#[test]
fn the_file_says_what_was_tried_and_reported() {
    let right = tempfile::tempdir().unwrap();
    prepare(right.path(), &drive());
    let mut table = HEADING.to_owned();
    let mut wrong = Vec::new();
    for case in [statements::CASES, columns::CASES, files::CASES].concat() {
        let dir = tempfile::tempdir().unwrap();
        copy(right.path(), dir.path());
        let (printed, result) = tried(dir.path(), &case);
        let all = printed.join("; ");
        if !case.printed.iter().all(|part| all.contains(part)) || !result.contains(case.result) {
            wrong.push(format!("{}: {all} -> {result}", case.input));
        }
        let code = |text: &str| match text {
            "" => "nothing".to_owned(),
            text => format!("`{}`", text.replace('|', "\\|")),
        };
        let printed: Vec<String> = printed.iter().map(|text| code(text)).collect();
        let printed = if printed.is_empty() {
            code("")
        } else {
            printed.join("; ")
        };
        writeln!(table, "| {} | {printed} | {result} |", case.input).unwrap();
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    system::compare_table(HEADING, &table);
}
