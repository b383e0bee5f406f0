//! `host-sim replay` and `convert` of recordings of messages: one simulated drive in every format
//! replays to the same result as from CSV, with the defects of real recordings, and from files of
//! corrected samples. The writers here follow the documentation of each format; independent writers
//! make the files of `tests/qemu/tests/readers.rs`.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

mod at_rest;
mod corrected;
mod damaged;
mod defects;
mod page;
mod promises;
mod reports;
mod tried;
mod writers;

use assert_cmd::Command;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::units::DEG;
use serde_json::Value;
use std::path::Path;
use writers::{ORIGIN, bag, csv, drive, euroc, pvts, ubx, ulog};

fn host_sim(dir: &Path, args: &str) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args.split(' ')).assert()
}

fn complaint(dir: &Path, args: &str) -> String {
    let out = host_sim(dir, args).code(2);
    let text = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(!text.contains("panicked"), "{args}: {text}");
    text
}

/// Horizontal errors of some schemes at the end.
fn replay(dir: &Path, args: &str) -> [f64; 3] {
    let args = format!("replay {args} --unit tactical --strict --json r.json --out page");
    host_sim(dir, &args).success();
    let bytes = std::fs::read(dir.join("r.json")).unwrap();
    let outcomes: Value = serde_json::from_slice(&bytes).unwrap();
    let rows = outcomes[0]["rows"].as_array().unwrap();
    ["raw", "ls-bias", "ekf6"].map(|scheme| {
        let of = rows.iter().rfind(|r| r["scheme"] == scheme).unwrap();
        of["horizontal_m"].as_f64().unwrap()
    })
}

/// Whether errors are equal within this relative tolerance.
fn same(got: [f64; 3], want: [f64; 3], share: f64) -> bool {
    got.iter().zip(want).all(|(a, b)| (a - b).abs() < share * b)
}

#[test]
fn one_drive_gives_the_same_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = drive();
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).unwrap();
    csv(dir, &session, true);
    let rates = replay(dir, "csv --header header.toml");
    write("in.mcap", bag(&session));
    let got = replay(dir, "mcap in.mcap --velocity-topic /vel --standstill-s 120");
    assert!(same(got, rates, 1e-5), "mcap {got:?} csv {rates:?}");

    // fixes from a receiver's log beside the same samples, in the digits of UBX
    let log = pvts(&session, 0).into_iter().flat_map(|(_, bytes)| bytes);
    write("fixes.ubx", log.collect());
    let got = replay(dir, "csv --header header.toml --fixes fixes.ubx");
    assert!(same(got, rates, 0.05), "--fixes {got:?} csv {rates:?}");

    // half a count of a gyro is 0.4 deg/h, but vibration makes it noise
    write("in.ubx", ubx(&session));
    let got = replay(dir, "ubx in.ubx --standstill-s 120");
    assert!(same(got, rates, 0.3), "ubx {got:?} csv {rates:?}");

    csv(dir, &session, false);
    let increments = replay(dir, "csv --header header.toml");
    write("in.ulg", ulog(&session));
    let got = replay(dir, "ulog in.ulg --fix-delay-s 0 --standstill-s 120");
    assert!(
        same(got, increments, 1e-2),
        "ulog {got:?} csv {increments:?}"
    );

    euroc(dir, &session);
    let start = &session.reference[0];
    let (roll, pitch, heading) = to_euler(&start.q_bn);
    let origin = format!("{},{},{}", ORIGIN.lat / DEG, ORIGIN.lon / DEG, ORIGIN.h);
    let known = replay(dir, &format!("euroc . --origin {origin} --start own"));
    let angles = [roll, pitch, heading]
        .map(|angle| (angle / DEG).to_string())
        .join(",");
    let arguments = format!("mcap in.mcap --velocity-topic /vel --attitude {angles} --start own");
    let bag = replay(dir, &arguments);
    assert!(
        (known[0] - bag[0]).abs() < 0.1 * bag[0],
        "euroc {known:?} mcap {bag:?}"
    );

    // a log of increments has one for each sample, rates one less
    for (source, samples) in [
        ("mcap in.mcap", "35\u{a0}999"),
        ("ulog in.ulg", "36\u{a0}000"),
        ("ubx in.ubx", "35\u{a0}999"),
        ("euroc .", "35\u{a0}999"),
    ] {
        let out = host_sim(dir, &format!("convert {source} --to csv --out c --force")).success();
        let text = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
        assert!(
            text.contains(&format!("{samples} samples, 361 fixes")),
            "{source}: {text}"
        );
    }
}

#[test]
fn wrong_files_and_options_of_messages_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    std::fs::write(dir.join("junk"), b"nothing of all that").unwrap();
    for (args, part) in [
        ("replay mcap missing", "missing: no such file"),
        ("replay mcap junk", "junk: 'MCAP, byte 8' is no MCAP file"),
        ("replay ulog junk", "junk: 'ULog, byte 16' is no ULog file"),
        (
            "replay ubx junk",
            "junk: 'UBX' has 19 bytes and no UBX message",
        ),
        ("replay euroc junk", "junk: is a file, not a folder"),
        ("convert mcap junk --to csv --out o", "junk: 'MCAP, byte 8'"),
        (
            "replay mcap junk --mounting x,y,z",
            "--mounting: 'x,y,z' must name three axes",
        ),
        ("replay mcap junk --max-gap-s 0", "--max-gap-s: is 0"),
        ("replay ulog junk --fix-delay-s 99", "--fix-delay-s: is 99"),
        (
            "replay ulog junk --attitude 1,2",
            "--attitude: [1.0, 2.0] is not an attitude",
        ),
        (
            "allan junk --duration 60",
            "--duration: is for the simulation of a unit; remedy: leave it out",
        ),
        ("replay euroc junk --origin 1,2", "--origin: is [1.0, 2.0]"),
        ("replay euroc junk --fix-sigma 0,1", "--fix-sigma: is 0"),
        (
            "replay ulog junk --attitude-from-log --standstill-s 90",
            "cannot be used with",
        ),
    ] {
        let text = complaint(dir, args);
        assert!(text.contains(part), "{args}: no '{part}' in: {text}");
    }
    assert!(!dir.join("o").exists() && !dir.join("out").exists());
}
