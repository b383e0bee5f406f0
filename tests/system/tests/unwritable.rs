//! Standard output that cannot be written: every command ends with code 2 and says why. A reader
//! that has closed the pipe is an ordinary end.

#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

#[path = "device/software.rs"]
#[allow(dead_code, reason = "this test needs one kind of device")]
mod software;
#[path = "messages/writers.rs"]
#[allow(dead_code, reason = "this test needs some of the writers")]
mod writers;

use host_core::inertial::units::DEG;
use software::{Device, Kind};
use std::fs::{File, OpenOptions};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Each command and its arguments. Later ones need the files of earlier ones. DEVICE is the port of
/// a device, BOARD that of a board that passes its input on, ORIGIN the start position of the
/// drive.
const WORKS: &[(&str, &str)] = &[
    ("", "--out o"),
    ("run", "run --seed 3 --out o"),
    ("simulate", "simulate --out s"),
    (
        "convert csv",
        "convert csv --header header.toml --to kf-gins --out k --force",
    ),
    (
        "convert kf-gins",
        "convert kf-gins k/imu.txt k/gnss.txt --to csv --out c --force",
    ),
    (
        "convert mcap",
        "convert mcap in.mcap --to csv --out c --force",
    ),
    (
        "convert ulog",
        "convert ulog in.ulg --to csv --out c --force",
    ),
    ("convert ubx", "convert ubx in.ubx --to csv --out c --force"),
    ("convert euroc", "convert euroc . --to csv --out c --force"),
    (
        "replay csv",
        "replay csv --header header.toml --unit tactical --out o",
    ),
    (
        "replay kf-gins",
        "replay kf-gins k/imu.txt k/gnss.txt --unit tactical --attitude ATTITUDE --out o",
    ),
    (
        "replay mcap",
        "replay mcap in.mcap --velocity-topic /vel --standstill-s 120 --unit tactical --out o",
    ),
    (
        "replay ulog",
        "replay ulog in.ulg --fix-delay-s 0 --standstill-s 120 --unit tactical --out o",
    ),
    (
        "replay ubx",
        "replay ubx in.ubx --standstill-s 120 --unit tactical --out o",
    ),
    (
        "replay euroc",
        "replay euroc . --origin ORIGIN --unit tactical --out o",
    ),
    (
        "campaign",
        "campaign --runs 1 --models noise --tuning-units 1 --schemes uncorrected,ekf6 --out p",
    ),
    ("campaign merge", "campaign merge p --report p.html"),
    (
        "abuse",
        "abuse --times 120,60,60 --sensors perfect --computers plain --cases none --runs 1 --out a",
    ),
    ("abuse merge", "abuse merge a"),
    ("allan", "allan --unit nav --duration 3600 --out o"),
    (
        "learnability",
        "learnability --unit nav --units 0 --minutes 2 --out o",
    ),
    (
        "fleet",
        "fleet --units 10 --drives 2 --out f --output type.toml",
    ),
    ("fleet merge", "fleet merge f --output type.toml"),
    ("device info", "device --port DEVICE info"),
    ("device info", "device --port DEVICE info --json"),
    (
        "device configure",
        "device --port DEVICE configure tactical --no-store",
    ),
    ("device show", "device --port DEVICE show"),
    ("device mode", "device --port DEVICE mode"),
    (
        "device weights get",
        "device --port DEVICE weights get w.bin",
    ),
    (
        "device weights put",
        "device --port DEVICE weights put w.bin",
    ),
    ("device store", "device --port DEVICE store"),
    ("device watch", "device --port DEVICE watch"),
    ("device watch", "device --port DEVICE watch --json"),
    ("hil", "hil --imu BOARD --nav BOARD --seconds 2 --fast"),
    (
        "report",
        "report --unit unit.toml --from header.toml --out o",
    ),
    ("soak", "soak --hours 0.01"),
    ("start", "start --class laser-47 --seeds 1"),
    ("unit new", "unit new --from mems --output u.toml"),
    (
        "unit from-log",
        "unit from-log s/header.toml --output l.toml --force",
    ),
    ("unit calibration", "unit calibration c.yaml"),
    ("unit check", "unit check u.toml"),
    ("unit check", "unit check u.toml --json"),
    ("unit list", "unit list"),
    ("unit list", "unit list --json"),
    ("unit show", "unit show tactical"),
    ("unit schema", "unit schema"),
    ("completions", "completions bash"),
    ("manual", "manual --out m"),
];

/// Commands that print as others do, and why they are not in the other table.
const OTHERS: &[(&str, &str)] = &[
    ("device", "with --simulate it runs until it is stopped"),
    ("replay lasergyro", "needs recorded data"),
    ("replay fog-mems", "needs recorded data"),
    ("replay kitti", "needs recorded data"),
    ("replay sessions", "needs recorded data"),
    ("replay hybrid", "needs recorded data"),
    ("replay novatel", "needs recorded data"),
    (
        "replay blackbox",
        "needs the black box of a device that has moved",
    ),
    ("convert novatel", "needs recorded data"),
    ("device learnt commit", "needs a device that has learnt"),
    ("device heading", "needs a device that aligns itself"),
    ("device blackbox", "needs a device with a black box"),
    (
        "device provision",
        "needs a device with a place for its key",
    ),
    ("unit six-position", "needs rests in six attitudes"),
    (
        "device update",
        "needs a signed image for the device's board",
    ),
    (
        "device wheels",
        "needs a device with wheels, and standard input",
    ),
    ("serve", "is a program of its own: host-sim/live/tests"),
];

/// The paths of all commands, and of those that do something.
fn commands(of: &clap::Command, path: &str, all: &mut Vec<String>, works: &mut Vec<String>) {
    all.push(path.to_owned());
    if !of.is_subcommand_required_set() && !of.is_arg_required_else_help_set() {
        works.push(path.to_owned());
    }
    for sub in of.get_subcommands() {
        let below = format!("{path} {}", sub.get_name());
        commands(sub, below.trim(), all, works);
    }
}

fn known() -> [Vec<String>; 2] {
    let [mut all, mut works] = [vec![], vec![]];
    commands(&host_sim::cli::Cli::definition(), "", &mut all, &mut works);
    [all, works]
}

fn host_sim(dir: &Path, args: &str, stdout: impl Into<Stdio>) -> Output {
    // the questions of `unit new` are answered with their defaults
    let answers = dir.join("answers");
    std::fs::write(&answers, "\n".repeat(200)).unwrap();
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args.split_whitespace());
    command.stdin(File::open(answers).unwrap()).stdout(stdout);
    command.stderr(Stdio::piped()).output().unwrap()
}

/// A device without free space.
fn full() -> File {
    OpenOptions::new().write(true).open("/dev/full").unwrap()
}

/// The error in how a command ended that could not print.
fn fault(args: &str, output: &Output) -> Option<String> {
    let said = String::from_utf8_lossy(&output.stderr);
    let named = "host-sim: standard output: cannot be written (";
    let right = output.status.code() == Some(2) && said.contains(named) && said.contains("remedy");
    let last: String = said.lines().rev().take(3).collect::<Vec<_>>().join(" < ");
    (!right).then(|| format!("{args}: {:?}: {last}", output.status.code()))
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

#[test]
fn the_tables_have_every_command() {
    let [_, mut works] = known();
    let tables = WORKS.iter().chain(OTHERS).map(|(path, _)| *path);
    let mut named: Vec<&str> = tables.collect();
    named.sort_unstable();
    named.dedup();
    works.sort_unstable();
    assert_eq!(named, works);
}

#[test]
fn every_command_ends_with_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = writers::drive();
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).unwrap();
    writers::csv(dir, &session, true);
    writers::euroc(dir, &session);
    write("in.mcap", writers::bag(&session));
    write("in.ulg", writers::ulog(&session));
    write("in.ubx", writers::ubx(&session));
    let tactical = include_bytes!("../../../host-sim/assets/units/tactical.toml");
    write("unit.toml", tactical.to_vec());
    let calibration = "SM: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nbias: [0.1, 0, 0]\n";
    write("c.yaml", calibration.into());
    let start = writers::ORIGIN;
    let origin = format!("{},{},{}", start.lat / DEG, start.lon / DEG, start.h);
    let device = Device::start(&Kind::NEW);
    let faults: Vec<String> = WORKS
        .iter()
        .filter_map(|(_, args)| {
            let board = if args.contains("BOARD") {
                board()
            } else {
                String::new()
            };
            let args = args
                .replace("DEVICE", &device.port)
                .replace("BOARD", &board);
            let args = args
                .replace("ORIGIN", &origin)
                .replace("ATTITUDE", "0,0,23");
            fault(&args, &host_sim(dir, &args, full()))
        })
        .collect();
    assert!(faults.is_empty(), "{faults:#?}");
    // files are written all the same
    for file in [
        "k/imu.txt",
        "p.html",
        "type.toml",
        "w.bin",
        "u.toml",
        "m/host-sim.1",
    ] {
        assert!(dir.join(file).metadata().unwrap().len() > 0, "{file}");
    }
}

#[test]
fn questions_for_help_end_with_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let [all, _] = known();
    let helped = all.iter().filter(|path| *path != "serve");
    let mut questions: Vec<String> = helped
        .flat_map(|path| [format!("{path} --help"), format!("help {path}")])
        .collect();
    questions.extend(["-h".to_owned(), "--version".to_owned(), "-V".to_owned()]);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        questions.push(format!("completions {shell}"));
    }
    let faults = questions
        .iter()
        .filter_map(|args| fault(args, &host_sim(dir.path(), args, full())));
    let faults: Vec<String> = faults.collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Open, but for reading only.
#[test]
fn a_descriptor_that_cannot_be_written_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for args in ["unit list", "--version"] {
        let output = host_sim(dir.path(), args, File::open("/dev/null").unwrap());
        assert_eq!(fault(args, &output), None);
    }
}

#[test]
fn a_reader_that_is_gone_is_an_ordinary_end() {
    let dir = tempfile::tempdir().unwrap();
    let device = Device::start(&Kind::NEW);
    let watch = format!("device --port {} watch", device.port);
    for args in [
        "unit schema",
        "--help",
        "completions bash",
        "manual --out m",
        &watch,
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = host_sim(dir.path(), args, writer);
        assert_eq!(output.status.code(), Some(0), "{args}: {output:?}");
        assert!(output.stderr.is_empty(), "{args}: {output:?}");
    }
    assert!(dir.path().join("m/host-sim.1").exists());
}

/// Both are reported, and the exit code is that of the finding.
#[test]
fn what_a_command_found_comes_first() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("wrong.toml"), "name = 3\n").unwrap();
    let output = host_sim(dir.path(), "unit check wrong.toml --json", full());
    let said = String::from_utf8(output.stderr).unwrap();
    let [first, .., last] = said.lines().collect::<Vec<_>>()[..] else {
        panic!("{said}");
    };
    assert!(first.contains("wrong.toml"), "{said}");
    assert!(
        last.contains("standard output: cannot be written"),
        "{said}"
    );
}
