//! Ctrl-C in the middle of each command that takes long: files are complete or absent, no temporary
//! file is left, the exit code is the one in `--help`, and `--resume` continues.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// When Ctrl-C is sent.
#[derive(Debug, Clone, Copy)]
enum When {
    /// A file or a folder has a temporary name.
    Writing,
    /// This file exists.
    After(&'static str),
    /// It has used this processor time, hundredths of a second.
    Computing(u64),
}

/// A command, and when it is interrupted.
struct Long {
    args: &'static str,
    when: When,
    /// What must exist before.
    needs: Need,
}

/// Input of a command.
#[derive(Clone, Copy, PartialEq)]
enum Need {
    Nothing,
    /// A simulated drive in `d`.
    Drive,
    /// A board that passes its input on; its port replaces `PORT`.
    Board,
    /// A scenario file of a long drive.
    Scenario,
}

const fn long(args: &'static str, when: When, needs: Need) -> Long {
    Long { args, when, needs }
}

/// All commands that may take longer than two seconds.
const LONG: &[Long] = &[
    long(
        "--seed 3 --out o --json r.json",
        When::Writing,
        Need::Nothing,
    ),
    long(
        "run --seed 3 --out o --json r.json",
        When::Computing(30),
        Need::Nothing,
    ),
    long(
        "simulate --scenario long.toml --learning --out o",
        When::Writing,
        Need::Scenario,
    ),
    long(
        "replay csv --header d/header.toml --out o --json r.json --corrected c.csv",
        When::Computing(40),
        Need::Drive,
    ),
    long(
        "replay csv --header d/header.toml --out o --json r.json",
        When::Writing,
        Need::Drive,
    ),
    long(
        "convert csv --header d/header.toml --to csv --out o --force",
        When::Writing,
        Need::Drive,
    ),
    long(
        "convert csv --header d/header.toml --to kf-gins --out o --force",
        When::Writing,
        Need::Drive,
    ),
    long(
        "report --unit d/unit.toml --from d --out o --json r.json",
        When::Writing,
        Need::Drive,
    ),
    long(
        "allan d/imu.csv --out o --json r.json",
        When::Writing,
        Need::Drive,
    ),
    long(
        "allan --unit nav --duration 86400 --out o --json r.json",
        When::Computing(50),
        Need::Nothing,
    ),
    long(
        "learnability --unit nav --units 40 --json r.json",
        When::Computing(50),
        Need::Nothing,
    ),
    long(
        "soak --hours 2000 --json",
        When::Computing(50),
        Need::Nothing,
    ),
    long(
        "start --class ship-stim300 --seeds 2000 --json r.json",
        When::Computing(50),
        Need::Nothing,
    ),
    long(
        "hil --imu PORT --nav PORT --seconds 2000 --json r.json",
        When::Computing(50),
        Need::Board,
    ),
    long(
        "campaign --runs 40 --models noise --tuning-units 1 --schemes uncorrected,ekf6 --out o \
         --report r.html --json r.json",
        When::After("o/campaign.txt"),
        Need::Nothing,
    ),
    long(
        "fleet --units 40 --drives 1 --out o --output type.toml",
        When::After("o/runs/000000.json"),
        Need::Nothing,
    ),
];

/// Commands that continue with `--resume`, the file that is finished first, options for the
/// results, and the file with them; `o` is the directory.
const RESUMED: &[(&str, &str, &str, &str)] = &[
    (
        "campaign --runs 3 --jobs 1 --models noise --tuning-units 1 --schemes uncorrected,ekf6 --out o",
        "o/runs/000000.json",
        "--json r.json",
        "r.json",
    ),
    (
        "abuse --times 120,60,60 --sensors perfect --computers plain --cases none --runs 6 \
         --jobs 1 --out o",
        "o/runs/000000.json",
        "--json r.json",
        "r.json",
    ),
    (
        "fleet --units 6 --drives 1 --jobs 1 --shard 0/2 --out o",
        "o/runs/000000.json",
        "",
        "o/runs/000004.json",
    ),
];

/// Commands that end soon, or that are tested elsewhere.
const OTHERS: &[(&str, &str)] = &[
    ("unit", "reads and writes a small file"),
    (
        "device",
        "writes small files; its watch ends with 0: tests/device/watching.rs",
    ),
    ("completions", "prints"),
    ("manual", "writes small files"),
    ("serve", "is a program of its own: host-sim/live/tests"),
];

fn host_sim(dir: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// All files below a folder, and whatever has a temporary name.
fn below(dir: &Path) -> Vec<PathBuf> {
    let mut found = vec![];
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(below(&path));
        }
        if path.is_file() || is_temporary(&path) {
            found.push(path);
        }
    }
    found
}

fn is_temporary(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with(".host-sim-") || name.starts_with(".tmp")
}

/// Processor time of a process, hundredths of a second.
fn computed(child: &Child) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id()));
    let stat = stat.unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let mut fields = after.split_whitespace().skip(11);
    let mut next = || fields.next().and_then(|text| text.parse::<u64>().ok());
    next().unwrap_or(0) + next().unwrap_or(0)
}

/// Waits until the given moment. Returns whether the command was still running.
fn in_the_middle(dir: &Path, when: When, child: &mut Child) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(120) {
        let now = match when {
            When::Writing => below(dir).iter().any(|path| is_temporary(path)),
            When::After(file) => dir.join(file).exists(),
            When::Computing(ticks) => computed(child) >= ticks,
        };
        if now {
            return true;
        }
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("{when:?}: never");
}

/// Starts a command and interrupts it. `None`: it had ended before.
fn interrupted(dir: &Path, args: &[&str], when: When) -> Option<Output> {
    let mut child = host_sim(dir, args).spawn().unwrap();
    if in_the_middle(dir, when, &mut child) {
        let id = child.id().to_string();
        let mut kill = Command::new("kill");
        let sent = kill.args(["-INT", &id]).stderr(Stdio::null()).status();
        let sent = sent.unwrap();
        let output = child.wait_with_output().unwrap();
        let ended_before = output.status.code() == Some(0) || !sent.success();
        return (!ended_before).then_some(output);
    }
    None
}

/// Why a file is not complete.
fn fault(path: &Path) -> Option<&'static str> {
    if is_temporary(path) {
        return Some("is temporary");
    }
    let bytes = std::fs::read(path).unwrap();
    let ends = |end: &[u8]| bytes.trim_ascii_end().ends_with(end);
    let kind = path.extension().unwrap_or_default().to_string_lossy();
    match &*kind {
        "json" => serde_json::from_slice::<serde_json::Value>(&bytes)
            .err()
            .map(|_| "is no JSON"),
        "html" => (!ends(b"</html>")).then_some("does not end"),
        "png" => (!ends(b"IEND\xaeB`\x82")).then_some("does not end"),
        "svg" => (!ends(b"</svg>")).then_some("does not end"),
        "pdf" => (!ends(b"%%EOF")).then_some("does not end"),
        "bin" => (bytes.len() != 608).then_some("is no weights"),
        "txt" if !(path.ends_with("imu.txt") || path.ends_with("gnss.txt")) => {
            bytes.is_empty().then_some("is empty")
        }
        "csv" | "txt" => {
            let text = String::from_utf8_lossy(&bytes);
            let columns = |line: &str| line.split([',', ' ']).count();
            let mut lines = text.lines().map(columns);
            let first = lines.next();
            let even = lines.all(|n| Some(n) == first);
            (!even || !text.ends_with('\n')).then_some("is cut")
        }
        "toml" => toml::from_str::<toml::Table>(&String::from_utf8_lossy(&bytes))
            .err()
            .map(|_| "is no TOML"),
        _ => None,
    }
}

/// A board whose first connection is the sensor's line, and whose second one goes on from it.
fn board() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let accepted = |_| listener.accept().unwrap().0;
        let [mut sensor, mut computer] = [0, 1].map(accepted);
        std::io::copy(&mut sensor, &mut computer)
    });
    port
}

/// Writes a scenario with a drive of `drive_s` seconds.
fn scenario(dir: &Path, name: &str, drive_s: u32) {
    let text = format!("unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = {drive_s}\n");
    std::fs::write(dir.join(name), text).unwrap();
}

/// Prepares the input of a command; returns the port of a board. `drive` is the folder with the
/// drive.
fn prepare(dir: &Path, drive: &Path, needs: Need) -> String {
    match needs {
        Need::Nothing => {}
        Need::Board => return board(),
        Need::Scenario => scenario(dir, "long.toml", 14_000),
        Need::Drive => std::os::unix::fs::symlink(drive, dir.join("d")).unwrap(),
    }
    String::new()
}

/// Interrupts a command and checks the files that it leaves.
fn leaves_whole_files(case: &Long, drive: &Path) {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let port = prepare(dir, drive, case.needs);
    let before = below(dir);
    let words = case.args.split_whitespace();
    let args: Vec<&str> = words.map(|w| if w == "PORT" { &port } else { w }).collect();
    // the last file may have got its final name before the interruption
    let output = (0..5).find_map(|_| interrupted(dir, &args, case.when));
    let output = output.unwrap_or_else(|| panic!("{}: ends too soon", case.args));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{}: {said}", case.args);
    assert!(said.contains("interrupted"), "{}: {said}", case.args);
    for path in below(dir).iter().filter(|path| !before.contains(path)) {
        assert_eq!(fault(path), None, "{}: {}", case.args, path.display());
    }
}

#[test]
fn the_table_has_every_command() {
    let known = host_sim::cli::Cli::definition();
    for command in known.get_subcommands().map(clap::Command::get_name) {
        let begins = |args: &str| args.split_whitespace().next() == Some(command);
        let tested = LONG.iter().any(|of| begins(of.args))
            || RESUMED.iter().any(|of| begins(of.0))
            || OTHERS.iter().any(|(name, _)| *name == command);
        assert!(tested || command == "help", "{command} is in no table");
    }
}

#[test]
fn an_interrupted_command_leaves_whole_files_or_none() {
    let dir = tempfile::tempdir().unwrap();
    scenario(dir.path(), "s.toml", 1200);
    let args = "simulate --scenario s.toml --learning --out d";
    let args: Vec<&str> = args.split(' ').collect();
    let made = host_sim(dir.path(), &args).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    let drive = dir.path().join("d");
    std::thread::scope(|scope| {
        for cases in LONG.chunks(LONG.len().div_ceil(2)) {
            scope.spawn(|| {
                cases
                    .iter()
                    .for_each(|case| leaves_whole_files(case, &drive));
            });
        }
    });
}

/// Finished work is retained, and the results are those of an uninterrupted command.
#[test]
fn an_interrupted_command_goes_on() {
    for (args, first, more, file) in RESUMED {
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        let words: Vec<&str> = args.split_whitespace().collect();
        let output = interrupted(dir, &words, When::After(first));
        let output = output.unwrap_or_else(|| panic!("{args}: ends too soon"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(130), "{args}: {said}");
        for path in below(dir) {
            assert_eq!(fault(&path), None, "{args}: {}", path.display());
        }
        let finished = dir.join(first);
        let date = || finished.metadata().unwrap().modified().unwrap();
        let before = date();
        let run = |out: &str, resume: &str| {
            let words = format!("{args} {more} {resume}");
            let words: Vec<&str> = words.split_whitespace().collect();
            let words = words
                .iter()
                .map(|word| if *word == "o" { out } else { word });
            let output = host_sim(dir, &words.collect::<Vec<_>>()).output().unwrap();
            assert!(output.status.success(), "{args}: {output:?}");
            let file = match file.strip_prefix("o/") {
                Some(rest) => dir.join(out).join(rest),
                None => dir.join(file),
            };
            std::fs::read(file).unwrap()
        };
        let resumed = run("o", "--resume");
        assert_eq!(date(), before, "{args}: it was done again");
        assert!(resumed == run("whole", ""), "{args}: other bytes");
    }
}
