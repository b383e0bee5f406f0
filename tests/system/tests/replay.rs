//! `host-sim replay lasergyro`.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use serde_json::Value;
use std::io::Write;
use std::path::Path;

fn replay(dir: &Path, file: &Path, extra: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command
        .current_dir(dir)
        .args(["replay", "lasergyro"])
        .arg(file)
        .args(["--json", "r.json"])
        .args(extra)
        .assert()
}

fn horizontal(dir: &Path, scheme: &str, t_min: u64) -> f64 {
    system::horizontal(&system::json(&dir.join("r.json")), scheme, t_min)
}

/// The recording's documentation gives 7 / 33 / 88 / 175 / 218 m for a plain strapdown after an
/// inertial-frame alignment of 480 s.
#[test]
fn the_real_recording_has_the_documented_error_and_compensation_does_no_harm() {
    let Some(data) = system::data_dir() else {
        println!("skipped: no recorded data; remedy: set LRNN_DATA to its folder");
        return;
    };
    let file = data.join("lasergyro-static.csv.gz");
    let dir = tempfile::tempdir().unwrap();
    replay(dir.path(), &file, &[]).success();
    for (t, want) in [(5, 7.0), (10, 33.0), (15, 88.0), (20, 175.0), (22, 218.0)] {
        let got = horizontal(dir.path(), "raw", t);
        assert!(
            (0.8..1.25).contains(&(got / want)),
            "{t} min: {got} m, documented {want} m"
        );
    }
    for learn in ["300", "480", "540"] {
        replay(dir.path(), &file, &["--learn-s", learn]).success();
        let (raw, rnn) = (
            horizontal(dir.path(), "raw", 20),
            horizontal(dir.path(), "rnn", 20),
        );
        assert!(
            rnn <= 1.05 * raw,
            "learning {learn} s: raw {raw} m, rnn {rnn} m"
        );
        let [none, learner] = ["uncorrected", "device"].map(|s| horizontal(dir.path(), s, 20));
        assert!(
            learner <= 1.02 * none,
            "learning {learn} s: none {none} m, device {learner} m"
        );
    }
}

#[test]
fn broken_recordings_are_named_with_line_and_column() {
    let dir = tempfile::tempdir().unwrap();
    let header =
        "gyro_x_pulses,gyro_y_pulses,gyro_z_pulses,accel_x_pulses,accel_y_pulses,accel_z_pulses\n";
    let cases = [
        ("empty.csv", String::new(), "empty.csv"),
        ("header.csv", header.to_string(), "header.csv"),
        (
            "columns.csv",
            format!("{header}0,0,2,0,0,80\n1,2,3\n"),
            "columns.csv:3",
        ),
        (
            "nan.csv",
            format!("{header}0,0,2,0,NaN,80\n"),
            "nan.csv:2: column 'accel_y_pulses'",
        ),
        (
            "short.csv",
            format!("{header}{}", "0,0,2,0,0,80\n".repeat(500)),
            "--learn-s",
        ),
        (
            "dead.csv",
            format!("{header}{}", "0,0,0,0,0,0\n".repeat(90_000)),
            "dead.csv",
        ),
    ];
    for (name, text, part) in cases {
        let file = dir.path().join(name);
        std::fs::File::create(&file)
            .unwrap()
            .write_all(text.as_bytes())
            .unwrap();
        let out = replay(dir.path(), &file, &[]).code(2);
        let stderr = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(
            stderr.contains(part) && !stderr.contains("panicked"),
            "{name}: no '{part}' in: {stderr}"
        );
        assert!(
            !dir.path().join("r.json").exists() && !dir.path().join("out").exists(),
            "{name}: nothing half-written"
        );
    }
}

/// Other recordings: each command runs, and each names a broken or missing file.
#[test]
fn other_recordings_run_and_wrong_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| {
        let mut command = Command::new(system::host_sim_binary());
        command
            .current_dir(dir.path())
            .arg("replay")
            .args(args)
            .assert()
    };
    std::fs::write(dir.path().join("junk"), "not a recording\n1,2\n").unwrap();
    for args in [
        &["fog-mems", "junk", "junk"][..],
        &["kitti", "junk"],
        &["hybrid", "junk"],
        &["novatel", "junk"],
        &["kitti", "missing"],
    ] {
        let out = run(args).code(2);
        let stderr = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(
            stderr.contains(args[1]) && !stderr.contains("panicked"),
            "{args:?}: {stderr}"
        );
    }
    let Some(data) = system::data_dir() else {
        println!("skipped: no recorded data; remedy: set LRNN_DATA to its folder");
        return;
    };
    let file = |name: &str| data.join(name).to_string_lossy().into_owned();
    let (mems, fog) = (file("fog-mems-mems.csv.gz"), file("fog-mems-fog.csv.gz"));
    run(&["fog-mems", &mems, &fog, "--json", "f.json"]).success();
    let outcomes: Value =
        serde_json::from_slice(&std::fs::read(dir.path().join("f.json")).unwrap()).unwrap();
    assert_eq!(
        outcomes.as_array().unwrap().len(),
        6,
        "three lengths, both roles"
    );
    run(&["novatel", &file("novatel-ins2.gps"), "--inventory"]).success();
}

/// A black box holds a fraction of a second of the sensor's line and no fixes: it is refused as a
/// session by what it holds.
#[test]
fn a_black_box_is_no_session() {
    let dir = tempfile::tempdir().unwrap();
    let head = "4c524242020001020000000000000000000000000000000000000000ad22b417";
    let memory = head.to_owned() + &"0".repeat(2 * (3328 - 32));
    let content = serde_json::json!({
        "blackbox": 1, "firmware": [0, 1, 0], "holds_because": "it was asked to",
        "configuration": "", "memory": memory,
    });
    std::fs::write(dir.path().join("box.json"), content.to_string()).unwrap();
    let done = Command::new(system::host_sim_binary())
        .current_dir(dir.path())
        .args(["replay", "sessions", "medium", "box.json"])
        .assert()
        .failure();
    let said = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        said.contains("box.json: is a black box: 0 bytes of the sensor's line"),
        "{said}"
    );
    assert!(said.contains("replay blackbox"), "{said}");
}

/// Sessions that cannot be of one unit, in the order of time, are refused by name before any is
/// read; so is a memory that is no store.
#[test]
fn sessions_that_do_not_belong_together_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let sensors = "[sensor]\nformat = 'detect'\nrate_hz = 120\n\
                   [gyro]\nbias_turn_on_dph = 7200\nbias_in_run_dph = 10\n\
                   angle_random_walk_dpsqrth = 0.4\n\
                   [accel]\nbias_turn_on_ug = 20000\nbias_in_run_ug = 30\n\
                   velocity_random_walk_ugpsqrthz = 120\n";
    write("unit.toml", &format!("name = 'U'\nserial = 'A'\n{sensors}"));
    write("none.toml", &format!("name = 'U'\n{sensors}"));
    write("foreign", &"store".repeat(60_000));
    let entries = |unit: &str, of: [&str; 2]| {
        let [one, two] = of;
        format!("unit = \"{unit}\"\n[[session]]\nfile = \"1\"\n{one}\n[[session]]\n{two}\n")
    };
    let cases = [
        (
            "unit.toml",
            ["serial = 'A'", "file = '2'\nserial = 'B'"],
            "2: is of the unit with serial 'B'",
        ),
        (
            "none.toml",
            ["serial = 'A'", "file = '2'"],
            "the unit file has no serial number",
        ),
        (
            "unit.toml",
            ["date = 2026-01-02", "file = '2'\ndate = '2026-01-01'"],
            "before the session above",
        ),
        ("unit.toml", ["", "file = '1'"], "1: is given twice"),
    ];
    for (unit, of, expected) in cases {
        write("table.toml", &entries(unit, of));
        let said = refusal(dir.path(), &["table.toml"]);
        assert!(said.contains(expected), "{said}");
        assert!(said.contains("remedy: "), "{said}");
    }
    let said = refusal(dir.path(), &["unit.toml", "1", "--memory", "foreign"]);
    assert!(said.contains("--memory foreign: "), "{said}");
    assert!(said.contains("holds no good record of a store"), "{said}");
}

fn refusal(dir: &Path, args: &[&str]) -> String {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(["replay", "sessions"]);
    let done = command.args(args).assert().code(2);
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}
