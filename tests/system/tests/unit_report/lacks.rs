//! Incomplete recordings, bad input, and real recordings.

use crate::looks::looks_right;
use crate::{complaint, cut, drive, left_out, part, report, run};
use system::{data_dir, json, well_formed};

/// The part of the report that needs missing data says so in a sentence.
#[test]
fn each_part_says_why_it_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 300, &[]);
    let imu = dir.join("d/imu.csv");
    let whole = std::fs::read(&imu).unwrap();

    std::fs::remove_file(dir.join("d/temperature.csv")).unwrap();
    let without = report(dir, "d");
    let text = part(&without, "learnt")["sentences"].to_string();
    assert!(text.contains("Against temperature: left out"), "{text}");

    // 30 s of the 120 s standstill
    cut(&imu, |k| k <= 3000);
    let short = report(dir, "d");
    assert!(
        left_out(&short, "noise").contains("too short"),
        "{}",
        left_out(&short, "noise")
    );
    for id in ["navigation", "rehearsals", "learnt", "weights", "bound"] {
        assert!(
            left_out(&short, id).contains("30 s"),
            "{id}: {}",
            left_out(&short, id)
        );
    }
    let verdict = short["verdict"][0].as_str().unwrap();
    assert!(verdict.contains("is not known, because"), "{verdict}");

    // a gap of 2 s after 50 s of standstill
    std::fs::write(&imu, &whole).unwrap();
    cut(&imu, |k| !(5000..5200).contains(&k));
    let gap = report(dir, "d");
    assert!(
        left_out(&gap, "noise").contains("samples are missing"),
        "{}",
        left_out(&gap, "noise")
    );
    assert!(
        part(&gap, "identity")["data"]["source"]
            .to_string()
            .contains("the longest 2.01 s")
    );

    // samples alone: no fixes, no header
    std::fs::write(&imu, &whole).unwrap();
    let alone = report(dir, "d/imu.csv");
    assert!(left_out(&alone, "navigation").contains("samples alone"));
    assert!(
        !part(&alone, "noise")["data"]["analyses"]
            .as_array()
            .unwrap()
            .is_empty()
    );
    well_formed(&std::fs::read_to_string(dir.join("r/index.html")).unwrap()).unwrap();
}

/// Bad input ends with file, line or option, and a remedy, and leaves nothing.
#[test]
fn bad_input_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 120, &[]);
    let fails = |from: &[&str], more: &[&str], says: &[&str]| {
        let args = [&["report", "--out", "x", "--from"], from, more].concat();
        let text = complaint(dir, &args);
        assert!(
            says.iter().all(|part| text.contains(part)),
            "{args:?}: {text}"
        );
        assert!(!dir.join("x").exists(), "{args:?}");
    };
    fails(&["none.mcap"], &[], &["none.mcap: no such file"]);
    std::fs::write(dir.join("odd.bin"), [7; 5000]).unwrap();
    fails(&["odd.bin"], &[], &["odd.bin", "no form that is known"]);
    std::fs::create_dir(dir.join("empty")).unwrap();
    fails(&["empty"], &[], &["empty", "without header.toml"]);
    fails(&["d"], &["--unit", "none"], &["no unit 'none'"]);
    fails(
        &["d"],
        &["--unit", "d/imu.csv.toml"],
        &["d/imu.csv.toml: no such file"],
    );
    fails(
        &["d"],
        &["--", "--no-such-option"],
        &["--no-such-option", "replay csv --help"],
    );
    fails(
        &["d"],
        &["--", "--learn-s", "9999"],
        &["--learn-s", "9999 s of a recording"],
    );
    fails(
        &["d/imu.csv"],
        &["--", "--learn-s", "60"],
        &["belongs to `replay`"],
    );
    fails(
        &["device:tcp:127.0.0.1:1"],
        &[],
        &["tcp:127.0.0.1:1", "does not connect"],
    );
    let long = "x".repeat(300);
    fails(&["d"], &["--date", &long], &["--date", "at most 200"]);
    let imu = dir.join("d/imu.csv");
    let text = std::fs::read_to_string(&imu).unwrap();
    let line = text.lines().nth(41).unwrap();
    let broken = line.replacen(',', ",oops", 1);
    std::fs::write(&imu, text.replace(line, &broken)).unwrap();
    fails(&["d"], &[], &["d/imu.csv:42", "oops"]);
    fails(&["d/imu.csv"], &[], &["d/imu.csv:42", "oops"]);
    std::fs::write(&imu, &text).unwrap();
    std::fs::write(dir.join("d/temperature.csv"), "t_s,x,y,z\n1,2,3\n").unwrap();
    fails(&["d"], &[], &["temperature.csv:2", "not four numbers"]);
    std::fs::create_dir(dir.join("mine")).unwrap();
    std::fs::write(dir.join("mine/notes.txt"), "keep me").unwrap();
    let args = ["report", "--from", "d/imu.csv", "--out", "mine"];
    assert!(complaint(dir, &args).contains("holds other files and no report of ours"));
}

/// Real recordings: the report states harm where there is harm, and analyses noise at rest.
#[test]
fn recorded_drives_and_a_unit_at_rest_are_reported() {
    let Some(data) = data_dir() else {
        return println!("skipped: no recorded data (LRNN_DATA)");
    };
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let at = |name: &str| {
        data.join(name)
            .canonicalize()
            .unwrap()
            .display()
            .to_string()
    };
    let drive = at("kitti-2011_09_30_drive_0034.csv.gz");
    let args = [
        "report", "--unit", "kitti", "--from", &drive, "--json", "k.json", "--out", "k",
    ];
    let said = run(dir, &args);
    let nothing = "Verdict: the device does nothing in any of 2 cases; ";
    assert!(said.starts_with(nothing), "{said}");
    run(
        dir,
        &[
            "replay", "kitti", &drive, "--unit", "kitti", "--json", "o.json",
        ],
    );
    let drive = json(&dir.join("k.json"));
    assert_eq!(
        part(&drive, "navigation")["data"],
        json(&dir.join("o.json"))
    );
    let rest = at("lasergyro-static.csv.gz");
    let args = [
        "report", "--unit", "ld-a15", "--from", &rest, "--json", "g.json", "--out", "g",
    ];
    run(dir, &args);
    run(dir, &["allan", &rest, "--json", "a.json"]);
    let rest_ = json(&dir.join("g.json"));
    assert_eq!(
        part(&rest_, "noise")["data"]["analyses"],
        json(&dir.join("a.json"))["analyses"]
    );
    assert!(
        !part(&rest_, "navigation")["data"]
            .as_array()
            .unwrap()
            .is_empty()
    );
    let page = std::fs::read_to_string(dir.join("g/index.html")).unwrap();
    looks_right(&rest_, &page);
}
