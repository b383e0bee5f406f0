//! `host-sim report`: the page, its print and the JSON of one unit, compared with the commands that
//! give its parts alone, with errors that the test adds to the samples, and with what a recording
//! lacks.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

mod lacks;
mod looks;

use assert_cmd::Command;
use looks::{can_print, looks_right, prints_correctly};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use system::{host_sim_binary, json};

fn host_sim(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(host_sim_binary())
        .current_dir(dir)
        .args(args)
        .assert()
}

fn run(dir: &Path, args: &[&str]) -> String {
    let done = host_sim(dir, args).success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// The message of a command that fails.
fn complaint(dir: &Path, args: &[&str]) -> String {
    let done = host_sim(dir, args).code(2);
    let text = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        !text.contains("panicked") && text.contains("remedy"),
        "{args:?}: {text}"
    );
    text
}

/// A report of `from`, as data.
fn report(dir: &Path, from: &str) -> Value {
    let args = ["report", "--unit", "d/unit.toml", "--from", from];
    run(
        dir,
        &[&args[..], &["--json", "r.json", "--out", "r"]].concat(),
    );
    json(&dir.join("r.json"))
}

fn part<'v>(report: &'v Value, id: &str) -> &'v Value {
    let parts = report["parts"].as_array().unwrap();
    let hit = parts.iter().find(|part| part["id"] == id);
    hit.unwrap_or_else(|| panic!("no part '{id}'"))
}

/// Why a part is left out.
fn left_out(report: &Value, id: &str) -> String {
    let why = part(report, id)["left_out"].as_str();
    why.unwrap_or_else(|| panic!("'{id}' is there")).to_owned()
}

/// A drive of `drive_s` seconds after 120 s of standstill, in `d`.
fn drive(dir: &Path, drive_s: u32, more: &[&str]) {
    let text = format!("unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = {drive_s}\n");
    std::fs::write(dir.join("s.toml"), text).unwrap();
    let args = [
        "simulate",
        "--scenario",
        "s.toml",
        "--learning",
        "--out",
        "d",
    ];
    run(dir, &[&args[..], more].concat());
}

/// Reduces a file to the lines whose numbers `keep` selects.
fn cut(file: &Path, keep: impl Fn(usize) -> bool) {
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text
        .lines()
        .enumerate()
        .filter(|(k, _)| *k == 0 || keep(*k));
    let kept: Vec<&str> = lines.map(|(_, line)| line).collect();
    std::fs::write(file, kept.join("\n") + "\n").unwrap();
}

/// Every number of the report is that of the command that it names, and page and JSON have the
/// same sentences.
#[test]
fn a_drive_is_reported_with_the_figures_of_the_single_commands() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 420, &[]);
    let report_ = report(dir, "d");
    let page = std::fs::read_to_string(dir.join("r/index.html")).unwrap();
    run(
        dir,
        &[
            "replay",
            "csv",
            "--header",
            "d/header.toml",
            "--json",
            "replay.json",
        ],
    );
    assert_eq!(
        part(&report_, "navigation")["data"],
        json(&dir.join("replay.json"))
    );
    let learnable = [
        "learnability",
        "--unit",
        "d/unit.toml",
        "--units",
        "0",
        "--minutes",
        "6",
    ];
    run(dir, &[&learnable[..], &["--json", "l.json"]].concat());
    assert_eq!(
        part(&report_, "learnable")["data"],
        json(&dir.join("l.json"))
    );
    let commands = part(&report_, "made")["commands"].to_string();
    assert!(commands.contains("--units 0 --minutes 6") && commands.contains("replay csv --header"));
    // the standstill alone: samples at times up to 120 s are the first 12 000 lines
    cut(&dir.join("d/imu.csv"), |k| k <= 12_000);
    run(dir, &["allan", "d/imu.csv", "--json", "a.json"]);
    let noise = &part(&report_, "noise")["data"]["analyses"];
    assert_eq!(*noise, json(&dir.join("a.json"))["analyses"]);
    assert!(!noise.as_array().unwrap().is_empty());
    // rehearsals, weights, learnt errors and bound are there
    let rehearsed = &part(&report_, "rehearsals")["data"][0];
    assert!(rehearsed["fixes"].as_u64().unwrap() > 100, "{rehearsed}");
    assert!(
        part(&report_, "learnt")["data"][0]["rows"]
            .as_array()
            .unwrap()
            .len()
            > 10
    );
    let learnt = part(&report_, "learnt")["figures"].to_string();
    assert!(learnt.contains("against temperature"));
    assert!(
        part(&report_, "bound")["data"][0]["metres"][4]
            .as_u64()
            .unwrap()
            > 0
    );
    let files = part(&report_, "identity")["data"]["files"].to_string();
    for name in [
        "d/header.toml",
        "d/imu.csv",
        "d/gnss.csv",
        "d/unit.toml",
        "d/temperature.csv",
    ] {
        assert!(files.contains(name), "{name}: {files}");
    }
    looks_right(&report_, &page);
}

/// `--pdf` prints the page with a browser; without one it says what to install, and still writes
/// the page.
#[test]
fn the_page_is_printed_or_the_browser_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 300, &[]);
    let args = [
        "report", "--from", "d", "--json", "r.json", "--out", "r", "--pdf", "r.pdf",
    ];
    let without = Command::new(host_sim_binary())
        .current_dir(dir)
        .args(args)
        .env("PATH", dir)
        .assert();
    let text = String::from_utf8_lossy(&without.code(2).get_output().stderr).into_owned();
    for part in [
        "--pdf",
        "Chromium",
        "r/index.html",
        "apt-get install chromium",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let page = std::fs::read_to_string(dir.join("r/index.html")).unwrap();
    looks_right(&json(&dir.join("r.json")), &page);
    assert!(!dir.join("r.pdf").exists());
    if !can_print() {
        return println!("skipped: printing, because Chromium is missing");
    }
    let said = run(dir, &args);
    assert!(said.contains("printed: r.pdf"), "{said}");
    prints_correctly(&json(&dir.join("r.json")), &dir.join("r.pdf"));
}

/// The learnt error grows by the error that the test adds to the samples, and the same recording
/// gives the same bytes.
#[test]
fn an_added_error_is_found_and_the_same_recording_gives_the_same_bytes() {
    const UG: f64 = 9.806_65e-6;
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 300, &[]);
    let z = |report: &Value| {
        let rows = part(report, "learnt")["data"][0]["rows"]
            .as_array()
            .unwrap();
        rows.last().unwrap()["error_and_sigma"][5][0]
            .as_f64()
            .unwrap()
    };
    let before = z(&report(dir, "d/header.toml"));
    let files = ["index.html", "weights.bin"];
    let bytes = || files.map(|name| std::fs::read(dir.join("r").join(name)).unwrap());
    let once = bytes();
    report(dir, "d/header.toml");
    assert!(once == bytes(), "the same recording, and other bytes");
    let imu = dir.join("d/imu.csv");
    let text = std::fs::read_to_string(&imu).unwrap();
    let added_ug = 400.0;
    let mut changed = String::new();
    for (k, line) in text.lines().enumerate() {
        let (most, last) = line.rsplit_once(',').unwrap();
        match k {
            0 => writeln!(changed, "{line}").unwrap(),
            _ => {
                let dv: f64 = last.parse().unwrap();
                writeln!(changed, "{most},{}", dv + added_ug * UG * 0.01).unwrap();
            }
        }
    }
    std::fs::write(&imu, changed).unwrap();
    let found = z(&report(dir, "d/header.toml")) - before;
    println!("added {added_ug} ug, learnt {found:.1} ug more");
    assert!((found / added_ug - 1.0).abs() < 0.1, "{found}");
    assert!(once != bytes());
}

/// Noise at rest: the datasheet that simulated the samples lies within the interval of each white
/// noise, and a datasheet of half as much does not.
#[test]
fn noise_at_rest_is_compared_with_the_datasheet() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let preset = "../../host-sim/assets/units/tactical.toml";
    let preset = Path::new(env!("CARGO_MANIFEST_DIR")).join(preset);
    let unit = std::fs::read_to_string(preset).unwrap();
    drive(dir, 1200, &["--vehicle", "standing"]);
    let rest = report(dir, "d");
    let source = part(&rest, "noise")["data"]["source"]
        .as_str()
        .unwrap()
        .to_owned();
    assert!(source.contains("at rest throughout"), "{source}");
    run(dir, &["allan", "d/imu.csv", "--json", "a.json"]);
    let analyses = &part(&rest, "noise")["data"]["analyses"];
    assert_eq!(*analyses, json(&dir.join("a.json"))["analyses"]);
    let configured = part(&rest, "noise")["data"]["configured"][0][1]
        .as_f64()
        .unwrap();
    let table = toml::from_str::<toml::Table>(&unit).unwrap();
    let sheet = table["gyro"]["angle_random_walk_dpsqrth"]
        .as_float()
        .unwrap();
    assert!(
        (configured - sheet).abs() < 0.05 * sheet,
        "{configured} {sheet}"
    );
    let verdict = rest["verdict"].to_string();
    assert!(
        verdict.contains("White noise of the gyros") && verdict.contains("not above the 0.125")
    );
    // a better datasheet than that of the samples
    let key = |name: &str, to: f64| {
        let file = dir.join("d/unit.toml");
        let mut unit = std::fs::read_to_string(&file)
            .unwrap()
            .parse::<toml::Table>()
            .unwrap();
        unit.remove("simulation");
        unit["gyro"][name] = to.into();
        std::fs::write(file, unit.to_string()).unwrap();
    };
    key("angle_random_walk_dpsqrth", 0.4 * sheet);
    let verdict = report(dir, "d")["verdict"].to_string();
    assert!(
        verdict.contains("White noise of the gyros: above the"),
        "{verdict}"
    );
}
