//! `host-sim unit`, and `--unit` of the other commands.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use host_core::words::thousands;
use host_unit::presets;
use host_unit::sensor::FormatName;
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
        err.contains("'sensor.stim300.datagramm' is not a key of this table"),
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

/// docs/sensors.md: its commands make files that can be used, its tables `[sensor]` are good, and
/// each preset of a product has commands and a row with its bit rate.
#[test]
fn the_page_of_the_sensors_is_right() {
    let page = include_str!("../../../docs/sensors.md");
    let blocks = |language: &str| -> Vec<&str> {
        let begin = format!("```{language}\n");
        let blocks = page.split(&begin).skip(1);
        blocks
            .filter_map(|block| block.split("```").next())
            .collect()
    };
    let dir = tempfile::tempdir().unwrap();
    for block in blocks("sh") {
        for line in block.lines().filter(|line| line.starts_with("unit ")) {
            let args: Vec<&str> = line.split(' ').collect();
            let (code, out, err) = host_sim(dir.path(), &args, &"\n".repeat(60));
            let said = format!("{line}: {out}{err}");
            assert!(code == 0 && !said.contains("doubtful"), "{said}");
        }
        std::fs::remove_file(dir.path().join("my.toml")).unwrap();
    }
    let preset = presets::text("stim300").unwrap();
    let (_, errors) = preset.split_once("[gyro]").unwrap();
    let tables = blocks("toml");
    assert!(tables.len() >= 2);
    for table in tables {
        let text = format!("name = \"x\"\n{table}[gyro]{errors}");
        std::fs::write(dir.path().join("x.toml"), text).unwrap();
        let (code, out, err) = host_sim(dir.path(), &["unit", "check", "x.toml"], "");
        assert_eq!((code, &*out), (0, "x.toml: 'x' can be used\n"), "{err}");
    }
    for name in presets::names() {
        let text = presets::text(name).unwrap();
        let about = presets::title(&text);
        if about.contains("simulated") || about.contains("`replay") {
            continue;
        }
        let command = format!("--from {name}");
        assert!(page.contains(&command), "no command has {command}");
        let unit = host_unit::Unit::preset(name).unwrap();
        let mut rows = page.lines().filter(|row| row.starts_with("| ["));
        let row = rows.find(|row| row.contains(&format!("`{name}`")));
        let row = row.unwrap_or_else(|| panic!("no row has {name}"));
        let baud = thousands(unit.sensor.baud).replace('\u{a0}', " ");
        let read = unit.sensor.format != FormatName::Detect;
        assert_eq!(row.contains(&baud), read, "{name}: {baud}");
    }
}

/// A log of 100 s at 20 Hz: its bias in deg/h, and the second from which on it is shaken.
fn log(dir: &Path, name: &str, bias_dph: f64, shaken_s: f64) {
    let mut state = 1_u64;
    let mut noise = || {
        let mut one = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        (0..12).map(|_| one()).sum::<f64>()
    };
    let mut text = "t_s,gx_dps,gy_dps,gz_dps,ax_mps2,ay_mps2,az_mps2\n".to_owned();
    for k in 0..2000 {
        let t = f64::from(k) / 20.0;
        let shake = if t < shaken_s { 0.0 } else { 3.0 * t.sin() };
        let [x, y, z, a, b, c] = [(); 6].map(|()| 0.02 * noise());
        let x = x + bias_dph / 3600.0 + shake;
        let line = format!(
            "{t},{x},{y},{z},{},{},{}\n",
            0.1 * a,
            0.1 * b,
            -9.8087 + 0.1 * c
        );
        text += &line;
    }
    std::fs::write(dir.join(name), text).unwrap();
}

#[test]
fn logs_at_rest_become_a_unit_file_with_its_sources() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bias) in [("a.csv", 100.0), ("b.csv", 300.0), ("c.csv", 500.0)] {
        log(dir.path(), name, bias, 1e9);
    }
    let logs = [
        "unit",
        "from-log",
        "a.csv",
        "b.csv",
        "c.csv",
        "--latitude",
        "48.1",
    ];
    let more = [
        "--temperature",
        "10,20,30",
        "--preset",
        "stim300",
        "--output",
        "u.toml",
    ];
    let args = [&logs[..], &more[..]].concat();
    let (code, out, err) = host_sim(dir.path(), &args, "");
    assert_eq!(code, 0, "{err}");
    assert!(
        out.contains("Temperature law of the gyros, deg/h/K, from 10.0 to 30.0"),
        "{out}"
    );
    assert!(out.contains("x +20.0") || out.contains("x +19.9"), "{out}");
    assert!(out.contains("Against preset stim300: "), "{out}");
    let text = std::fs::read_to_string(dir.path().join("u.toml")).unwrap();
    for part in [
        "# Written by `host-sim unit from-log` from 3 logs, 300 s at rest",
        "# log: b.csv",
        "# Temperature law of the gyros",
        "format = \"stim300\" # source: datasheet",
        "# measured: root of squares: ",
        "scale_ppm = 500 # source: TS1524",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let (code, out, _) = host_sim(dir.path(), &["unit", "check", "u.toml"], "");
    assert!(code == 0 && out.contains("'STIM300' can be used"), "{out}");
    let (code, _, err) = host_sim(dir.path(), &args, "");
    assert!(
        code == 2 && err.contains("u.toml: is there already"),
        "{err}"
    );
    let short = [
        "unit",
        "from-log",
        "a.csv",
        "b.csv",
        "--temperature",
        "10",
        "--output",
        "v.toml",
    ];
    let (code, _, err) = host_sim(dir.path(), &short, "");
    assert!(
        code == 2 && err.contains("has 1 values for 2 logs"),
        "{err}"
    );
}

#[test]
fn a_log_that_moves_is_refused_with_the_place_and_no_file_is_written() {
    let dir = tempfile::tempdir().unwrap();
    log(dir.path(), "shaken.csv", 0.0, 40.0);
    let args = ["unit", "from-log", "shaken.csv"];
    let (code, _, err) = host_sim(dir.path(), &args, "");
    assert_eq!(code, 2, "{err}");
    for part in [
        "shaken.csv: is not at rest: it moves ",
        "first at 39.",
        "60 s at rest",
        "remedy",
    ] {
        assert!(err.contains(part), "{part}: {err}");
    }
    assert!(!dir.path().join("unit.toml").exists());
    log(dir.path(), "later.csv", 0.0, 80.0);
    let (code, out, err) = host_sim(dir.path(), &["unit", "from-log", "later.csv"], "");
    assert!(
        code == 0 && out.contains("later.csv: it moves "),
        "{out}{err}"
    );
}

/// A sensor that measures `1.03 f + 0.2` in x, on its six sides and four edges, 8 s each.
fn sides(dir: &Path, name: &str) {
    let g = 9.8087;
    let h = g * 0.5_f64.sqrt();
    let attitudes = [
        [g, 0.0, 0.0],
        [-g, 0.0, 0.0],
        [0.0, g, 0.0],
        [0.0, -g, 0.0],
        [0.0, 0.0, g],
        [0.0, 0.0, -g],
        [h, h, 0.0],
        [h, 0.0, h],
        [0.0, h, h],
        [h, -h, 0.0],
    ];
    let mut text = "t_s,gx_dps,gy_dps,gz_dps,ax_mps2,ay_mps2,az_mps2\n".to_owned();
    for (k, [x, y, z]) in attitudes.into_iter().enumerate() {
        for n in 0..250 {
            let t = 10.0 * k as f64 + f64::from(n) / 25.0;
            let rate = if n < 200 { 0.0 } else { 50.0 };
            let noise = 1e-3 * f64::from(n * 7919 % 101 - 50) / 50.0;
            let x = 1.03 * x + 0.2 + noise;
            text += &format!("{t:.2},{rate},{noise},0,{x},{},{}\n", y + noise, z - noise);
        }
    }
    std::fs::write(dir.join(name), text).unwrap();
}

#[test]
fn six_positions_become_calibrations_that_other_forms_keep() {
    let dir = tempfile::tempdir().unwrap();
    sides(dir.path(), "sides.csv");
    let args = "unit six-position sides.csv --latitude 48.1 --unit stim300 --output u.toml \
                --imu-tk a.calib --imu-calib a.yaml --kalibr k.yaml --weights w.bin --json j.json";
    let args: Vec<&str> = args.split_whitespace().collect();
    let (code, out, err) = host_sim(dir.path(), &args, "");
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("10 rests. "), "{out}");
    // the limits of the STIM300 are three times 2200 ug and 1 mrad
    assert!(
        out.contains("needs 3.0 times") && out.contains("needs 9.7 times"),
        "{out}"
    );
    let json = std::fs::read_to_string(dir.path().join("j.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let near = |value: &serde_json::Value, want: f64, sigma: &serde_json::Value| {
        let off = value.as_f64().unwrap() - want;
        assert!(
            off.abs() < 3.0 * sigma.as_f64().unwrap() && off.abs() < 2e-3,
            "{value} {want}"
        );
    };
    near(&json["map"][0][0], 0.029_126, &json["map_sigma"][0][0]);
    near(&json["bias"][0], 0.2, &json["bias_sigma"][0]);
    near(&json["bias"][1], 0.0, &json["bias_sigma"][1]);
    assert_eq!(json["covariance"].as_array().unwrap().len(), 13);
    assert_eq!(std::fs::read(dir.path().join("w.bin")).unwrap().len(), 684);
    let text = std::fs::read_to_string(dir.path().join("u.toml")).unwrap();
    assert!(
        text.contains("# M x: 0.029") && text.contains("# measured: largest"),
        "{text}"
    );
    // the same through the other tools' forms
    for form in ["a.calib", "a.yaml"] {
        let (code, out, err) = host_sim(dir.path(), &["unit", "calibration", form], "");
        assert!(code == 0 && out.contains("M +29"), "{form}: {out}{err}");
        assert!(
            out.contains("b +198") || out.contains("b +197"),
            "{form}: {out}"
        );
    }
    let again = ["unit", "calibration", "k.yaml", "--weights", "w.bin"];
    let (code, _, err) = host_sim(dir.path(), &again, "");
    assert!(
        code == 2 && err.contains("w.bin: is there already"),
        "{err}"
    );
    let (code, out, _) = host_sim(dir.path(), &["unit", "calibration", "k.yaml"], "");
    assert!(code == 0 && out.contains("has no biases"), "{out}");
}

#[test]
fn too_few_rests_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    log(dir.path(), "one.csv", 0.0, 1e9);
    let (code, _, err) = host_sim(dir.path(), &["unit", "six-position", "one.csv"], "");
    assert_eq!(code, 2);
    assert!(
        err.contains("one.csv: has one rest of 5 s") && err.contains("remedy"),
        "{err}"
    );
}
