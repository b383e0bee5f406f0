//! `host-sim unit`, and `--unit` of the other commands.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use std::path::Path;

/// Runs in `dir` with this input. Returns exit code, output and errors.
fn host_sim(dir: &Path, args: &[&str], input: &str) -> (i32, String, String) {
    let mut command = Command::new(system::host_sim_binary());
    let assert = command
        .current_dir(dir)
        .args(args)
        .write_stdin(input)
        .assert();
    let output = assert.get_output();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(!err.contains("panicked"), "{args:?}: {err}");
    (output.status.code().unwrap(), out, err)
}

#[test]
fn a_unit_file_is_made_by_answers_and_never_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let new = ["unit", "new", "--from", "stim300", "--output", "u.toml"];
    let (code, out, err) = host_sim(dir.path(), &new, "my sensor\nN1\n");
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("u.toml is written"), "{out}");
    assert!(err.contains("Name of the unit [STIM300]: "), "{err}");
    let written = std::fs::read_to_string(dir.path().join("u.toml")).unwrap();
    assert!(
        written.starts_with("#:schema unit.schema.json\n"),
        "{written}"
    );
    assert!(written.contains("name = \"my sensor\""), "{written}");
    let (_, schema, _) = host_sim(dir.path(), &["unit", "schema"], "");
    let beside = std::fs::read_to_string(dir.path().join("unit.schema.json")).unwrap();
    assert_eq!(beside, schema);
    let (code, out, _) = host_sim(dir.path(), &["unit", "check", "u.toml"], "");
    assert_eq!(
        (code, out.as_str()),
        (0, "u.toml: 'my sensor' can be used\n")
    );

    let (code, _, err) = host_sim(dir.path(), &new, "other\n");
    assert!(code == 2 && err.contains("is there already"), "{err}");
    let kept = std::fs::read_to_string(dir.path().join("u.toml")).unwrap();
    assert_eq!(kept, written);
    let force = [&new[..], &["--force"]].concat();
    let (code, ..) = host_sim(dir.path(), &force, "other\n");
    assert_eq!(code, 0);
    let (code, _, err) = host_sim(dir.path(), &["unit", "new"], "only a name\n");
    assert!(code == 2 && err.contains("the answers ended"), "{err}");
    assert!(!dir.path().join("unit.toml").exists());
}

#[test]
fn check_reports_all_mistakes_with_file_line_field_and_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let (_, text, _) = host_sim(dir.path(), &["unit", "show", "stim300"], "");
    let text = text.replace("scale_ppm = 500", "scale_ppm = -500");
    let text = text.replace("datagram = \"0x91\"", "datagramm = \"0x91\"");
    std::fs::write(dir.path().join("u.toml"), text).unwrap();
    let (code, _, err) = host_sim(dir.path(), &["unit", "check", "u.toml"], "");
    assert_eq!(code, 2);
    assert!(
        err.contains("'sensor.stim300.datagramm' is no key of this table"),
        "{err}"
    );
    assert!(err.contains("remedy: write 'datagram'"), "{err}");
    assert!(
        err.contains("'gyro.scale_ppm' is -500; remedy: give a number from 0"),
        "{err}"
    );
    let (code, _, err) = host_sim(dir.path(), &["run", "--unit", "u.toml"], "");
    assert!(
        code == 2 && err.contains("'gyro.scale_ppm' is -500"),
        "{err}"
    );
    assert!(!dir.path().join("out").exists());
}

#[test]
fn presets_are_listed_and_shown_with_their_sources() {
    let dir = tempfile::tempdir().unwrap();
    let (_, list, _) = host_sim(dir.path(), &["unit", "list"], "");
    for name in [
        "medium",
        "stim300",
        "kvh1775",
        "hg9900",
        "ld-a15",
        "vn-100",
        "icm-42688",
    ] {
        assert!(
            list.lines().any(|line| line.starts_with(name)),
            "{name}: {list}"
        );
        let (code, text, _) = host_sim(dir.path(), &["unit", "show", name], "");
        assert_eq!(code, 0);
        assert!(
            text.contains("# source: ") || text.contains("# assumed"),
            "{text}"
        );
        std::fs::write(dir.path().join("p.toml"), text).unwrap();
        let (code, ..) = host_sim(dir.path(), &["unit", "check", "p.toml"], "");
        assert_eq!(code, 0, "{name}");
    }
    let (code, _, err) = host_sim(dir.path(), &["unit", "show", "stim30"], "");
    assert!(code == 2 && err.contains("did you mean 'stim300'"), "{err}");
}

/// Each command that needs a sensor takes the same option, and refuses an unknown name in the same
/// way.
#[test]
fn every_command_takes_the_same_option() {
    let dir = tempfile::tempdir().unwrap();
    for args in [
        &["run"][..],
        &["campaign"],
        &["simulate", "--out", "d"],
        &["learnability"],
        &["allan"],
        &["replay", "lasergyro", "x.csv"],
        &["replay", "kitti", "x.csv"],
        &["replay", "fog-mems", "x.csv", "y.csv"],
        &["replay", "hybrid", "x.csv"],
        &["hil", "--imu", "tcp:nonsense", "--nav", "tcp:nonsense"],
    ] {
        let given = [args, &["--unit", "no-such"]].concat();
        let (code, _, err) = host_sim(dir.path(), &given, "");
        assert_eq!(code, 2, "{args:?}");
        assert!(
            err.contains("there is no unit 'no-such'"),
            "{args:?}: {err}"
        );
        let old = [args, &["--preset", "nav"]].concat();
        let (code, _, err) = host_sim(dir.path(), &old, "");
        assert!(
            code == 2 && err.contains("give --unit NAME"),
            "{args:?}: {err}"
        );
    }
}

/// The whole file that docs/your-imu.md shows.
#[test]
fn the_unit_file_of_the_page_is_good() {
    let page = include_str!("../../../docs/your-imu.md");
    let (_, file) = page.split_once("```toml\n").unwrap();
    let (file, _) = file.split_once("```").unwrap();
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("my.toml"), file).unwrap();
    let (code, out, err) = host_sim(dir.path(), &["unit", "check", "my.toml"], "");
    assert_eq!(code, 0, "{out}{err}");
    // the output of two commands with this file, as shown in the page
    let commands = [
        "allan --unit my.toml --out allan",
        "learnability --unit my.toml",
    ];
    let shown = page.split("```text\n").skip(1);
    for (command, shown) in commands.into_iter().zip(shown) {
        let args: Vec<&str> = command.split(' ').collect();
        let (code, out, err) = host_sim(dir.path(), &args, "");
        assert_eq!(code, 0, "{err}");
        let (shown, _) = shown.split_once("```").unwrap();
        assert!(shown.lines().count() >= 3);
        for line in shown.lines() {
            assert!(out.contains(line), "{command}: {line} is not in:\n{out}");
        }
    }
}
