//! `host-sim report` of recordings of messages.

use crate::writers::{ORIGIN, bag, drive, euroc, ubx, ulog};
use crate::{complaint, host_sim};
use host_core::inertial::units::DEG;
use serde_json::Value;
use std::path::Path;

/// The report of a recording, as data. The page is there, too.
fn report(dir: &Path, from: &str, options: &str) -> Value {
    let args = format!("report --unit tactical --from {from} --json r.json --out r -- {options}");
    host_sim(dir, &args).success();
    let page = std::fs::read_to_string(dir.join("r/index.html")).unwrap();
    assert!(page.contains("<svg") && page.contains(from), "{from}");
    serde_json::from_slice(&std::fs::read(dir.join("r.json")).unwrap()).unwrap()
}

fn part<'v>(report: &'v Value, id: &str) -> &'v Value {
    let parts = report["parts"].as_array().unwrap();
    parts.iter().find(|part| part["id"] == id).unwrap()
}

/// In every format the parts are present, the files have their hashes, and there is no warning
/// about units.
#[test]
fn a_recording_of_every_form_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let session = drive();
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).unwrap();
    write("in.mcap", bag(&session));
    write("in.ubx", ubx(&session));
    write("in.ulg", ulog(&session));
    std::fs::create_dir(dir.join("room")).unwrap();
    euroc(&dir.join("room"), &session);
    let origin = format!("{},{},{}", ORIGIN.lat / DEG, ORIGIN.lon / DEG, ORIGIN.h);
    for (from, options, file) in [
        (
            "in.mcap",
            "--velocity-topic /vel --standstill-s 120",
            "in.mcap",
        ),
        ("in.mcap", "--standstill-s 120", "in.mcap"), // fixes without velocities
        ("in.ubx", "--standstill-s 120", "in.ubx"),
        ("in.ulg", "--fix-delay-s 0 --standstill-s 120", "in.ulg"),
        ("room", &format!("--origin {origin}"), "imu0/data.csv"),
    ] {
        let reported = report(dir, from, options);
        let text = reported.to_string();
        assert!(!text.contains("NaN"), "{from}");
        let rows = &part(&reported, "navigation")["data"][0]["rows"];
        assert!(
            rows.as_array().is_some_and(|rows| rows.len() > 10),
            "{from}: {rows}"
        );
        let warnings = &part(&reported, "navigation")["data"][0]["warnings"];
        let doubts = warnings.as_array().map_or(0, Vec::len);
        assert_eq!(doubts, 0, "{from} {options}: {warnings}");
        let files = part(&reported, "identity")["data"]["files"].to_string();
        assert!(files.contains(file), "{from}: {files}");
        let commands = part(&reported, "made")["commands"].to_string();
        assert!(commands.contains("host-sim replay"), "{from}: {commands}");
    }
    let wrong = complaint(
        dir,
        "report --unit tactical --from in.mcap --out r -- --instance 3",
    );
    assert!(
        wrong.contains("--instance") && wrong.contains("replay mcap --help"),
        "{wrong}"
    );
}
