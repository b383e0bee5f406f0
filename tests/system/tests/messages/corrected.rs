//! `replay --corrected`: the recording with corrected samples. Navigation with them has the errors
//! that the table states for the scheme.

use super::{complaint, host_sim};
use crate::writers::{bag, csv, drive, euroc};
use serde_json::Value;
use std::io::Read;
use std::path::Path;

/// Replays with `args` and returns the outcome (JSON).
fn replay(dir: &Path, args: &str) -> Value {
    let args = format!("replay {args} --unit tactical --json r.json --out page");
    host_sim(dir, &args).success();
    let bytes = std::fs::read(dir.join("r.json")).unwrap();
    let outcomes: Value = serde_json::from_slice(&bytes).unwrap();
    outcomes[0].clone()
}

/// Errors north and east of a scheme at all times, m.
fn errors(outcome: &Value, scheme: &str) -> Vec<f64> {
    let rows = outcome["rows"].as_array().unwrap();
    let of = rows.iter().filter(|row| row["scheme"] == scheme);
    let value = |row: &Value, key: &str| row[key].as_f64().unwrap();
    of.flat_map(|row| ["d_north_m", "d_east_m"].map(|key| value(row, key)))
        .collect()
}

/// The largest difference of two lists of equal length.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert!(!a.is_empty() && a.len() == b.len());
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f64::max)
}

/// With `--start own`, `ls-bias`, `ls-3x3` and `rnn` start as `raw` does, with their own samples.
/// So `raw` on the corrected file is that scheme.
#[test]
fn the_corrected_file_replays_raw_as_the_scheme_did() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = drive();
    csv(dir, &session, false);
    std::fs::write(dir.join("in.mcap"), bag(&session)).unwrap();
    let run = |args: &str| drop(host_sim(dir, args).success());
    run("convert csv --header header.toml --to kf-gins --velocity --out k");
    let kf = "k/gnss.txt --standstill-s 120 --start own";
    for scheme in ["ls-bias", "ls-3x3", "rnn"] {
        let write = format!("--start own --corrected out/c.csv --force --corrected-by {scheme}");
        let outcome = replay(dir, &format!("csv --header header.toml {write}"));
        let notes = outcome["notes"].to_string();
        let note = format!("out/c.csv holds the samples as {scheme} has corrected them: 36000 of");
        assert!(notes.contains(&note), "{notes}");
        let meant = errors(&outcome, scheme);
        let raw = errors(&outcome, "raw");
        let again = replay(dir, "csv --header header.toml out/c.csv --start own");
        let off = apart(&errors(&again, "raw"), &meant);
        assert!(off < 1e-3, "{scheme}: {off} m");
        assert!(apart(&raw, &meant) > 1.0, "{scheme} corrects something");

        let write = format!("--corrected c.txt --force --corrected-by {scheme}");
        replay(dir, &format!("kf-gins k/imu.txt {kf} {write}"));
        let again = replay(dir, &format!("kf-gins c.txt {kf}"));
        let off = apart(&errors(&again, "raw"), &meant);
        assert!(off < 1e-3, "kf-gins {scheme}: {off} m");
    }
    // a format that is not written, as text of KF-GINS
    let write = "--corrected c.txt --force --corrected-by rnn --corrected-format kf-gins \
                 --corrected-shift 100";
    let source = "mcap in.mcap --velocity-topic /vel --standstill-s 120 --start own";
    let outcome = replay(dir, &format!("{source} {write}"));
    let meant = errors(&outcome, "rnn");
    run("convert mcap in.mcap --velocity-topic /vel --to kf-gins --shift 100 --velocity --out m");
    let again = replay(
        dir,
        "kf-gins c.txt m/gnss.txt --standstill-s 120 --start own",
    );
    let off = apart(&errors(&again, "raw"), &meant);
    assert!(off < 1e-2, "mcap: {off} m");
}

/// A correction of zero gives the same bytes in every format, and a correction begins at the time
/// when it was learnt.
#[test]
fn what_is_not_corrected_stays_to_the_byte() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = drive();
    csv(dir, &session, true);
    euroc(dir, &session);
    let raw = "--corrected c --force --corrected-by raw";
    let same = |name: &str, whole: bool| {
        let [a, b] = [name, "c"].map(|name| std::fs::read(dir.join(name)).unwrap());
        assert!((a == b) == whole, "{name}");
    };
    replay(dir, &format!("csv --header header.toml {raw}"));
    same("imu.csv", true);
    replay(dir, &format!("euroc . {raw}"));
    same("mav0/imu0/data.csv", true);
    replay(
        dir,
        "csv --header header.toml --corrected c.gz --corrected-by raw",
    );
    let packed = std::fs::File::open(dir.join("c.gz")).unwrap();
    let mut unpacked = Vec::new();
    let mut decoder = flate2::read::GzDecoder::new(packed);
    decoder.read_to_end(&mut unpacked).unwrap();
    std::fs::write(dir.join("c"), unpacked).unwrap();
    same("imu.csv", true);
    replay(
        dir,
        "csv --header header.toml --learn-s 200 --corrected c --force --corrected-by ekf6",
    );
    same("imu.csv", false);
    let [old, new] = ["imu.csv", "c"].map(|name| std::fs::read_to_string(dir.join(name)).unwrap());
    let changed: Vec<usize> = old
        .lines()
        .zip(new.lines())
        .enumerate()
        .filter_map(|(k, (a, b))| (a != b).then_some(k))
        .collect();
    // The first fix within the motion is at 1 s, so the first 200 s end at 201 s: a line of names,
    // and 100 samples a second.
    assert_eq!((changed[0], changed.last()), (20_101, Some(&36_000)));
    assert_eq!(changed.len(), 15_900);
}

#[test]
fn wrong_targets_are_named_before_the_work() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = drive();
    csv(dir, &session, true);
    std::fs::write(dir.join("in.mcap"), bag(&session)).unwrap();
    std::fs::create_dir(dir.join("folder")).unwrap();
    let before = std::fs::read(dir.join("imu.csv")).unwrap();
    for (source, args, part) in [
        (
            "csv",
            "--corrected imu.csv",
            "--corrected: 'imu.csv' is a file of the recording itself",
        ),
        (
            "csv",
            "--corrected header.toml",
            "--corrected: 'header.toml' is a file of the recording itself",
        ),
        (
            "csv",
            "--corrected gnss.csv --force",
            "--corrected: 'gnss.csv' is a file of the recording itself",
        ),
        (
            "csv",
            "--corrected in.mcap",
            "--corrected: 'in.mcap' is there already; remedy: give another file, or --force",
        ),
        (
            "csv",
            "--corrected ./imu.csv --force",
            "--corrected: './imu.csv' is a file of the recording itself",
        ),
        ("csv", "--corrected folder", "folder: cannot be written"),
        (
            "csv",
            "--corrected imu.csv/c.csv",
            "imu.csv/c.csv: cannot be written",
        ),
        (
            "csv",
            "--corrected c --corrected-by best",
            "possible values: raw, ls-bias",
        ),
        ("csv", "--corrected-by rnn", "--corrected <FILE>"),
        (
            "csv",
            "--corrected c --corrected-format kf-gins --corrected-shift=-9",
            "--corrected-shift: -8.98 s is not a second of the week",
        ),
        (
            "mcap",
            "--corrected c.mcap",
            "--corrected-format: this format is read but not written",
        ),
    ] {
        let source = match source {
            "csv" => "csv --header header.toml",
            _ => "mcap in.mcap --standstill-s 120",
        };
        let text = complaint(dir, &format!("replay {source} {args}"));
        assert!(text.contains(part), "{args}: no '{part}' in: {text}");
    }
    assert!(std::fs::read(dir.join("imu.csv")).unwrap() == before);
    assert!(!dir.join("c").exists() && !dir.join("out").exists());
}
