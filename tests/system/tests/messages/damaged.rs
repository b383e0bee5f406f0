//! Every command that reads a file gets it missing, empty, as a folder, as noise, cut in the
//! middle, with a value that is not a number, or with an extra column. Each ends with code 2 and a
//! line that names the file, the line where there is one, and a remedy for this very fault.

use crate::writers::{bag, csv, drive, euroc, ubx, ulog};
use std::path::Path;
use std::process::Command;

/// Damage to a file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    Missing,
    Empty,
    Folder,
    Noise,
    /// The first half, plus half a line or a frame.
    Cut,
    /// The second value of a line in the middle is not a number.
    NotANumber,
    /// A line in the middle has one value too many.
    Column,
}

use Damage::{Column, Cut, Empty, Folder, Missing, Noise, NotANumber};

/// Damage for a text of lines.
const TEXT: &[Damage] = &[Missing, Empty, Folder, Noise, Cut, NotANumber, Column];
/// Damage for a text of samples or fixes, whose end may be missing, and values too.
const SAMPLES: &[Damage] = &[Missing, Empty, Folder, Noise, Column];
/// Damage for a text of samples or fixes in which a missing value is a fault.
const VALUES: &[Damage] = &[Missing, Empty, Folder, Noise, NotANumber, Column];
/// Damage for a text with keys.
const KEYS: &[Damage] = &[Missing, Empty, Folder, Noise, Cut];
/// Damage for a log whose end may be missing, since recorders lose power. The rest is read.
const LOG: &[Damage] = &[Missing, Empty, Folder, Noise];
/// Damage for our binary files.
const WHOLE: &[Damage] = &[Missing, Empty, Folder, Noise, Cut];

/// A command that reads `FILE`, the good file, and the kinds of damage.
struct Reader(&'static str, &'static str, &'static [Damage]);

const READERS: &[Reader] = &[
    Reader("unit check FILE", "unit.toml", KEYS),
    Reader(
        "unit check FILE --json",
        "unit.toml",
        &[Missing, Folder, Noise],
    ),
    Reader("allan --duration 60 --unit FILE", "unit.toml", KEYS),
    Reader("campaign --runs 1 --unit FILE", "unit.toml", KEYS),
    Reader("fleet --units 1 --unit FILE", "unit.toml", KEYS),
    Reader("learnability --unit FILE", "unit.toml", KEYS),
    Reader("start --unit FILE", "unit.toml", KEYS),
    Reader(
        "hil --imu tcp:127.0.0.1:1 --nav tcp:127.0.0.1:1 --unit FILE",
        "unit.toml",
        KEYS,
    ),
    Reader(
        "device --port tcp:127.0.0.1:1 configure FILE",
        "unit.toml",
        KEYS,
    ),
    Reader(
        "device --port tcp:127.0.0.1:1 weights put FILE",
        "weights.bin",
        WHOLE,
    ),
    Reader(
        "device --port tcp:127.0.0.1:1 --key FILE info",
        "device.key",
        WHOLE,
    ),
    Reader(
        "hil --imu tcp:127.0.0.1:1 --nav tcp:127.0.0.1:1 --command tcp:127.0.0.1:1 --key FILE",
        "device.key",
        WHOLE,
    ),
    Reader(
        "run --scenario FILE",
        "scenario.toml",
        &[Missing, Folder, Noise, Cut],
    ),
    Reader(
        "simulate --out o --scenario FILE",
        "scenario.toml",
        &[Missing, Folder, Noise, Cut],
    ),
    Reader("replay csv --header FILE", "header.toml", KEYS),
    Reader(
        "replay csv --header header.toml FILE gnss.csv",
        "imu.csv",
        SAMPLES,
    ),
    Reader(
        "replay csv --header header.toml imu.csv FILE",
        "gnss.csv",
        VALUES,
    ),
    Reader(
        "replay csv --header header.toml --truth FILE",
        "gnss.csv",
        VALUES,
    ),
    Reader(
        "replay csv --header header.toml --fixes FILE",
        "in.ubx",
        LOG,
    ),
    Reader(
        "convert csv --to csv --out o --force --header header.toml FILE",
        "imu.csv",
        SAMPLES,
    ),
    Reader(
        "replay kf-gins FILE k/gnss.txt --standstill-s 100",
        "k/imu.txt",
        SAMPLES,
    ),
    Reader(
        "replay kf-gins k/imu.txt FILE --standstill-s 100",
        "k/gnss.txt",
        SAMPLES,
    ),
    Reader(
        "replay kf-gins k/imu.txt k/gnss.txt --truth FILE",
        "k/truth.txt",
        TEXT,
    ),
    Reader(
        "convert kf-gins FILE k/gnss.txt --to csv --out o --force",
        "k/imu.txt",
        SAMPLES,
    ),
    Reader("replay mcap FILE", "in.mcap", LOG),
    Reader("replay ulog FILE", "in.ulg", LOG),
    Reader("replay ubx FILE", "in.ubx", LOG),
    Reader("replay novatel FILE", "", LOG),
    Reader("replay novatel FILE --inventory", "", LOG),
    Reader("convert novatel FILE --to csv --out o --force", "", LOG),
    Reader("replay euroc FILE", "", &[Missing, Empty, Noise]),
    Reader("replay euroc room", "room/mav0/imu0/data.csv", SAMPLES),
    Reader(
        "replay euroc room",
        "room/mav0/state_groundtruth_estimate0/data.csv",
        SAMPLES,
    ),
    Reader("replay lasergyro FILE", "pulses.csv", TEXT),
    Reader("replay hybrid FILE", "pulses.csv", TEXT),
    Reader("replay kitti FILE", "", LOG),
    Reader("replay fog-mems FILE FILE", "", LOG),
    Reader("replay blackbox FILE", "box.json", WHOLE),
    Reader("allan FILE", "rest.csv", VALUES),
    Reader("report --from FILE", "rest.csv", VALUES),
    Reader("report --from FILE", "header.toml", &[Missing, Noise]),
    Reader("report --from rest.csv --unit FILE", "unit.toml", KEYS),
    Reader(
        "fleet --recordings FILE",
        "",
        &[Missing, Empty, Folder, Noise],
    ),
    Reader("campaign merge FILE", "", &[Missing, Empty, Folder, Noise]),
    Reader("abuse merge FILE", "", &[Missing, Empty, Folder, Noise]),
    Reader("fleet merge FILE", "", &[Missing, Empty, Folder, Noise]),
    Reader("campaign merge c", "c/campaign.txt", &[Missing]),
    Reader("campaign merge c", "c/tuning.json", WHOLE),
    Reader(
        "campaign merge c",
        "c/runs/000000.json",
        &[Empty, Folder, Noise, Cut],
    ),
];

/// Wrong words in a good file, and the expected message.
const WRONG: &[(&str, &str, [&str; 2], &[&str])] = &[
    (
        "unit check FILE",
        "unit.toml",
        ["bias_turn_on_dph", "bias_turn_on_degps"],
        &["bias_turn_on_degps", "remedy"],
    ),
    (
        "unit check FILE",
        "unit.toml",
        ["rate_hz =", "rate_hz = \"fast\" #"],
        &["rate_hz", "remedy"],
    ),
    (
        "replay csv --header FILE",
        "header.toml",
        ["'rad/s'", "'furlong'"],
        &["furlong", "deg/s", "remedy"],
    ),
    (
        "replay csv --header FILE",
        "header.toml",
        ["'gx'", "'wx'"],
        &["'wx'", "gx", "remedy"],
    ),
];

fn host_sim(dir: &Path, args: &str) -> std::process::Output {
    let mut command = Command::new(system::host_sim_binary());
    let output = command
        .current_dir(dir)
        .args(args.split_whitespace())
        .output();
    output.unwrap()
}

/// Bytes without a pattern.
fn noise() -> Vec<u8> {
    let mut state = 1_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 56) as u8
    };
    (0..5000).map(|_| next()).collect()
}

/// Good files of every kind.
fn prepare(dir: &Path) {
    let write = |name: &str, bytes: &[u8]| std::fs::write(dir.join(name), bytes).unwrap();
    let session = drive();
    csv(dir, &session, true);
    write("in.mcap", &bag(&session));
    write("in.ulg", &ulog(&session));
    write("in.ubx", &ubx(&session));
    std::fs::create_dir(dir.join("room")).unwrap();
    euroc(&dir.join("room"), &session);
    let done = host_sim(dir, "convert csv --header header.toml --to kf-gins --out k");
    assert!(done.status.success(), "{done:?}");
    let truth: String = (0..400)
        .map(|s| format!("0 {s}.0 48.0 11.0 500.0 0 0 0 0.1 0.2 30.0\n"))
        .collect();
    write("k/truth.txt", truth.as_bytes());
    let unit = host_sim(dir, "unit show tactical");
    write("unit.toml", &unit.stdout);
    write("weights.bin", &[7; 608]);
    write("device.key", "5a".repeat(32).as_bytes());
    let scenario = "unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = 300\n";
    write("scenario.toml", scenario.as_bytes());
    let rest: String = (0..9000)
        .map(|k| format!("{},{}e-6,0,0,0,0,{}\n", f64::from(k) * 0.01, k % 7, -0.098))
        .collect();
    let head = "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps\n";
    write("rest.csv", [head, &rest].concat().as_bytes());
    let head = "gyro_x_pulses,gyro_y_pulses,gyro_z_pulses,accel_x_pulses,accel_y_pulses,\
                accel_z_pulses\n";
    write(
        "pulses.csv",
        [head, &"1,2,3,4,5,6\n".repeat(90_000)].concat().as_bytes(),
    );
    write("box.json", b"{\"blackbox\": 1, \"firmware\": [0, 1, 0]}");
    let campaign =
        "campaign --runs 1 --models noise --tuning-units 1 --schemes uncorrected --out c";
    assert!(host_sim(dir, campaign).status.success());
}

/// Writes a damaged file at `at`. Returns the damaged line, if there is one.
fn spoil(at: &Path, good: &[u8], damage: Damage) -> Option<usize> {
    let write = |bytes: &[u8]| std::fs::write(at, bytes).unwrap();
    let lines: Vec<&[u8]> = good.split(|byte| *byte == b'\n').collect();
    let middle = lines.len() / 2;
    let separator = match lines[middle].contains(&b',') {
        true => b',',
        false => b' ',
    };
    let changed = |line: Vec<u8>| {
        let mut lines = lines.clone();
        lines[middle] = &line;
        write(&lines.join(&b'\n'));
        Some(middle + 1)
    };
    match damage {
        Missing => {}
        Empty => write(b""),
        Folder => std::fs::create_dir(at).unwrap(),
        Noise => write(&noise()),
        Cut => {
            let half = lines[..middle].join(&b'\n').len();
            write(&good[..half + lines[middle].len() / 2]);
        }
        NotANumber => {
            let mut values: Vec<&[u8]> = lines[middle].split(|byte| *byte == separator).collect();
            let second = values.iter().skip(1).position(|value| !value.is_empty());
            values[second.unwrap() + 1] = b"NaN";
            return changed(values.join(&separator));
        }
        Column => return changed([lines[middle], &[separator, b'1']].concat()),
    }
    None
}

/// What is wrong with a complaint.
fn fault(output: &std::process::Output, name: &str, line: Option<usize>) -> Option<String> {
    let said = [&output.stderr[..], &output.stdout].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    let location = line.map_or_else(|| name.to_owned(), |line| format!("{name}:{line}"));
    let fault = match () {
        () if output.status.code() != Some(2) => "the exit code",
        () if said.contains("panicked") => "a panic",
        () if !said.contains(&location) => "no location",
        () if !said.contains("remedy") => "no remedy",
        () if said.contains("os error") || said.contains("cannot be read") => "no words",
        () if said.chars().any(|c| c.is_control() && c != '\n') => "bytes of the file",
        () if said.lines().any(|line| line.len() > 700) => "too long",
        () => return None,
    };
    Some(format!(
        "{fault} (not {location}): {:?}: {said}",
        output.status.code()
    ))
}

/// Removes a file or a folder.
fn remove(path: &Path) {
    let _ = std::fs::remove_file(path).or_else(|_| std::fs::remove_dir_all(path));
}

#[test]
fn every_damaged_file_is_named_with_a_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    prepare(dir);
    let mut faults = vec![];
    for Reader(args, name, damages) in READERS {
        let good = std::fs::read(dir.join(name)).unwrap_or_default();
        // a file that the command finds by itself is damaged where it is
        let given = args.contains("FILE");
        let kind = Path::new(name).extension().unwrap_or_default();
        let own = format!("damaged.{}", kind.to_string_lossy());
        let at = if given { &own } else { *name };
        let args = args.replace("FILE", at);
        for damage in *damages {
            remove(&dir.join(at));
            let line = spoil(&dir.join(at), &good, *damage);
            let output = host_sim(dir, &args);
            // `merge` is given the folder
            let named = if at.starts_with("c/campaign") {
                "c"
            } else {
                at
            };
            if let Some(fault) = fault(&output, named, line) {
                faults.push(format!("{args}, {damage:?}: {fault}"));
            }
        }
        remove(&dir.join(at));
        if !given {
            std::fs::write(dir.join(at), &good).unwrap();
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn wrong_words_in_a_file_are_named_with_a_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    prepare(dir);
    for (args, name, [from, to], parts) in WRONG {
        let good = std::fs::read_to_string(dir.join(name)).unwrap();
        let bad = good.replacen(from, to, 1);
        assert_ne!(good, bad, "{name}: no {from}");
        let at = format!("wrong-{name}");
        std::fs::write(dir.join(&at), bad).unwrap();
        let output = host_sim(dir, &args.replace("FILE", &at));
        assert_eq!(fault(&output, &at, None), None, "{args}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        for part in *parts {
            assert!(said.contains(part), "{args}: no {part}: {said}");
        }
    }
}

/// A text of samples or fixes that ends in the middle, or lacks a value, is read with a note.
#[test]
fn a_text_that_is_cut_or_lacks_a_value_is_read_with_a_note() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    prepare(dir);
    let csv = "convert csv --to csv --out o --force --header header.toml";
    let missing = "1 line of damaged holds no whole sample";
    let cut = "the file ends within this line";
    for (args, name, damage, note) in [
        (format!("{csv} damaged"), "imu.csv", Cut, cut),
        (format!("{csv} damaged"), "imu.csv", NotANumber, missing),
        (format!("{csv} imu.csv damaged"), "gnss.csv", Cut, cut),
        (
            "convert kf-gins damaged k/gnss.txt --to csv --out o --force".into(),
            "k/imu.txt",
            Cut,
            cut,
        ),
        (
            "convert kf-gins damaged k/gnss.txt --to csv --out o --force".into(),
            "k/imu.txt",
            NotANumber,
            missing,
        ),
        (
            "convert kf-gins k/imu.txt damaged --to csv --out o --force".into(),
            "k/gnss.txt",
            Cut,
            cut,
        ),
    ] {
        let good = std::fs::read(dir.join(name)).unwrap();
        spoil(&dir.join("damaged"), &good, damage);
        let output = host_sim(dir, &args);
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success() && printed.contains(note),
            "{args}, {damage:?}: {printed}"
        );
    }
}

/// A log that ends in the middle is read as far as it goes, or refused with a remedy.
#[test]
fn a_log_that_is_cut_is_read_or_named() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    prepare(dir);
    for (args, name) in [
        ("convert mcap FILE --to csv --out o --force", "in.mcap"),
        ("convert ulog FILE --to csv --out o --force", "in.ulg"),
        ("convert ubx FILE --to csv --out o --force", "in.ubx"),
    ] {
        let good = std::fs::read(dir.join(name)).unwrap();
        let at = format!("cut-{name}");
        std::fs::write(dir.join(&at), &good[..good.len() / 2 + 3]).unwrap();
        let output = host_sim(dir, &args.replace("FILE", &at));
        match output.status.code() {
            Some(0) => assert!(dir.join("o/imu.csv").exists(), "{args}"),
            _ => assert_eq!(fault(&output, &at, None), None, "{args}"),
        }
    }
}
