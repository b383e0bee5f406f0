//! `host-sim run` and `host-sim simulate`.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_unit::Unit;
use std::path::Path;
use system::{horizontal, json};

fn host_sim(dir: &Path) -> Command {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir);
    command
}

#[test]
fn no_arguments_mean_the_papers_experiment() {
    let dir = tempfile::tempdir().unwrap();
    let out = host_sim(dir.path()).assert().success();
    let text = String::from_utf8_lossy(&out.get_output().stdout).into_owned();
    for part in [
        "scheme",
        "raw",
        "ls-bias",
        "ls-3x3",
        "rnn",
        "report: out/run-medium-1/index.html",
    ] {
        assert!(text.contains(part), "no '{part}' in:\n{text}");
    }
    the_first_page_shows(&text);
    let report = dir.path().join("out/run-medium-1");
    for file in [
        "index.html",
        "track.png",
        "error.png",
        "learning.png",
        "errors.png",
    ] {
        assert!(
            report.join(file).metadata().unwrap().len() > 5_000,
            "{file}"
        );
    }
    let page = std::fs::read_to_string(report.join("index.html")).unwrap();
    assert!(
        !page.contains("http://") || !page.contains("src=\"http"),
        "the page must be self-contained"
    );
}

/// docs/five-minutes.md has the verdict and the last errors of the first command as they are
/// printed.
fn the_first_page_shows(printed: &str) {
    let page = include_str!("../../../docs/five-minutes.md");
    let (_, verdict) = page.split_once("```text\n").unwrap();
    let (verdict, rest) = verdict.split_once("```").unwrap();
    assert!(printed.contains(verdict), "{verdict} is not in:\n{printed}");
    let rows = rest.lines().filter(|line| line.starts_with("| `"));
    let rows: Vec<Vec<&str>> = rows.map(|row| row.split(" | ").collect()).collect();
    assert_eq!(rows.len(), 6);
    let (_, last) = printed.rsplit_once(" 22 ").unwrap();
    for row in rows {
        let name = row[0].trim_matches(['|', ' ', '`']);
        let error = row[2].trim_end_matches(" |");
        let found = last
            .lines()
            .find(|line| line.contains(&format!("┆ {name} ")));
        let found = found.unwrap_or_default();
        assert!(found.contains(&format!(" {error} ")), "{name}: {found}");
    }
}

/// docs/five-minutes.md has rows of the first replay as they are printed, and a wrong unit file has
/// the effect that the page describes.
#[test]
fn the_first_page_shows_the_first_replay() {
    let dir = tempfile::tempdir().unwrap();
    let run = |args: &str| {
        let done = host_sim(dir.path())
            .args(args.split(' '))
            .assert()
            .success();
        String::from_utf8_lossy(&done.get_output().stdout).into_owned()
    };
    run("simulate --learning --out data");
    let printed = run("replay csv --header data/header.toml --learn-s 1600");
    let page = include_str!("../../../docs/five-minutes.md");
    let block = page.split("```text\n").nth(2).unwrap();
    let (block, _) = block.split_once("```").unwrap();
    assert_eq!(block.lines().count(), 4);
    for line in block.lines() {
        assert!(printed.contains(line), "{line} is not in:\n{printed}");
    }
    assert!(
        printed.contains("and stored it for the next power-on"),
        "{printed}"
    );
    assert!(printed.contains("Switched on again for the judged part, it corrects from power-on."));
    run("unit new --from stim300 --output my.toml");
    let printed = run("replay csv --header data/header.toml --learn-s 1600 --unit my.toml");
    assert!(
        printed.contains("corrects nothing; has proved nothing: "),
        "{printed}"
    );
    assert!(printed.contains("(raw) end 186 m off"), "{printed}");
}

#[test]
fn json_has_the_promised_shape_and_the_same_seed_gives_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let run = |name: &str, extra: &[&str]| {
        host_sim(dir.path())
            .args(["run", "--json", name, "--out", "report"])
            .args(extra)
            .assert()
            .success();
        std::fs::read(dir.path().join(name)).unwrap()
    };
    let first = run("a.json", &["--seed", "3"]);
    assert_eq!(first, run("b.json", &["--seed", "3"]));
    assert_ne!(first, run("c.json", &["--seed", "4"]));

    let results = json(&dir.path().join("a.json"));
    assert_eq!(
        (results["scenario"].as_str(), results["seed"].as_u64()),
        (Some("medium"), Some(3))
    );
    let rows = results["rows"].as_array().unwrap();
    // raw, two least squares, the networks, and the device after one and after four drives
    assert_eq!(rows.len(), 5 * 6);
    for row in rows {
        for field in [
            "d_north_m",
            "d_east_m",
            "d_vn_mps",
            "d_ve_mps",
            "horizontal_m",
        ] {
            assert!(row[field].as_f64().unwrap().is_finite(), "{field} in {row}");
        }
        let north_east = row["d_north_m"]
            .as_f64()
            .unwrap()
            .hypot(row["d_east_m"].as_f64().unwrap());
        assert!((north_east - row["horizontal_m"].as_f64().unwrap()).abs() < 1e-6);
    }
    for t in [5, 10, 15, 20, 22] {
        for scheme in ["raw", "ls-bias", "ls-3x3", "rnn"] {
            let _ = horizontal(&results, scheme, t);
        }
    }
}

/// Over several units: the raw errors are of the paper's size, and compensation takes most of them
/// away.
#[test]
fn compensation_reduces_the_error_over_units() {
    let dir = tempfile::tempdir().unwrap();
    let (mut raw, mut rnn) = (0.0, 0.0);
    for seed in 100..108 {
        let seed = seed.to_string();
        host_sim(dir.path())
            .args([
                "run", "--seed", &seed, "--json", "r.json", "--out", "report",
            ])
            .assert()
            .success();
        let results = json(&dir.path().join("r.json"));
        raw += horizontal(&results, "raw", 22) / 8.0;
        rnn += horizontal(&results, "rnn", 22) / 8.0;
    }
    assert!((1_000.0..20_000.0).contains(&raw), "raw {raw}");
    assert!(rnn < 0.5 * raw, "raw {raw}, rnn {rnn}");
}

/// The paper's protocol: learning and judgement on the same drive.
#[test]
fn in_sample_is_another_experiment() {
    let dir = tempfile::tempdir().unwrap();
    host_sim(dir.path())
        .args(["run", "--in-sample", "--json", "in.json"])
        .assert()
        .success();
    host_sim(dir.path())
        .args(["run", "--json", "out.json"])
        .assert()
        .success();
    let (inside, outside) = (
        json(&dir.path().join("in.json")),
        json(&dir.path().join("out.json")),
    );
    assert_ne!(inside["rows"], outside["rows"]);
    assert!(
        dir.path()
            .join("out/run-medium-1-in-sample/index.html")
            .exists()
    );
    assert!(horizontal(&inside, "rnn", 22) < horizontal(&inside, "raw", 22));
    let page = include_str!("../../../docs/paper.md");
    for t_min in [5, 10, 15, 20, 22] {
        let of = |scheme| horizontal(&inside, scheme, t_min);
        let [raw, bias, rnn] = ["raw", "ls-bias", "rnn"].map(of);
        let cells = format!("| {raw:.2} | {bias:.2} | {rnn:.2} | {:.2} |", rnn / raw);
        assert!(page.contains(&cells), "docs/paper.md: no {cells}");
    }
}

/// An IMU with white noise and pulses only: nothing to learn, so the corrected stream equals the
/// raw one bit for bit.
#[test]
fn on_white_noise_alone_the_compensator_stays_at_zero() {
    let dir = tempfile::tempdir().unwrap();
    // the datasheet still states biases that the simulated sensors do not have
    let mut unit = Unit::preset("medium").unwrap();
    let medium = ImuSpec::preset("medium").unwrap();
    unit.simulation = Some(medium.error_model(ErrorModelName::Noise));
    std::fs::write(
        dir.path().join("unit.toml"),
        toml::to_string(&unit).unwrap(),
    )
    .unwrap();
    std::fs::write(dir.path().join("noise.toml"), "unit = 'unit.toml'\n").unwrap();
    for seed in ["1", "2", "3"] {
        host_sim(dir.path())
            .args([
                "run",
                "--scenario",
                "./noise.toml",
                "--seed",
                seed,
                "--json",
                "n.json",
                "--out",
                "r",
            ])
            .assert()
            .success();
        let results = json(&dir.path().join("n.json"));
        for t in [5, 22] {
            assert_eq!(
                horizontal(&results, "rnn", t),
                horizontal(&results, "raw", t),
                "seed {seed}"
            );
        }
    }
}

#[test]
fn simulate_writes_three_tables_with_units() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("short.toml"),
        "[test]\nstandstill_s = 90\ndrive_s = 120\n",
    )
    .unwrap();
    host_sim(dir.path())
        .args([
            "simulate",
            "--scenario",
            "short.toml",
            "--out",
            "data",
            "--json",
            "s.json",
        ])
        .assert()
        .success();
    let args = "convert csv --header data/header.toml --to kf-gins --out text --json c.json";
    host_sim(dir.path())
        .args(args.split(' '))
        .assert()
        .success();
    let [made, converted] = ["s.json", "c.json"].map(|name| json(&dir.path().join(name)));
    for (of, count, last) in [
        (&made, 6, "data/header.toml"),
        (&converted, 2, "text/gnss.txt"),
    ] {
        let files = of["files"].as_array().unwrap();
        assert_eq!(
            (files.len(), files[count - 1].as_str().unwrap()),
            (count, last)
        );
        assert!(
            files
                .iter()
                .all(|file| dir.path().join(file.as_str().unwrap()).is_file())
        );
    }
    for field in ["samples", "times_s", "rate_hz", "fixes"] {
        assert!(
            !made[field].is_null() && made[field] == converted[field],
            "{field}"
        );
    }
    assert!(
        converted["notes"][0]
            .as_str()
            .unwrap()
            .contains("velocities are left out")
    );
    let lines = |name: &str| {
        let text = std::fs::read_to_string(dir.path().join("data").join(name)).unwrap();
        (
            text.lines().next().unwrap().to_string(),
            text.lines().count(),
        )
    };
    assert_eq!(
        lines("imu.csv"),
        (
            "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,dv_x_mps,dv_y_mps,dv_z_mps".into(),
            210 * 200 + 1
        )
    );
    assert_eq!(lines("gnss.csv").1, 212);
    assert_eq!(lines("truth.csv").1, 212);
    let (head, seconds) = lines("temperature.csv");
    assert_eq!(head, "t_s,x_degc,y_degc,z_degc,processor_degc");
    assert!((211..=212).contains(&seconds), "{seconds}");
}

#[test]
fn bad_input_exits_with_2_names_the_place_and_writes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("key.toml"), "name = 'x'\nspeeed = 3\n").unwrap();
    std::fs::write(dir.path().join("nan.toml"), "latitude_deg = nan\n").unwrap();
    std::fs::write(dir.path().join("garbage.toml"), [0xff, 0xfe, 0x00]).unwrap();
    let cases: [(&[&str], &str); 8] = [
        (&["run", "--scenario", "no-such"], "no-such"),
        (&["run", "--scenario", "missing.toml"], "missing.toml"),
        (&["run", "--scenario", "key.toml"], "key.toml:2: 'speeed'"),
        (&["run", "--scenario", "nan.toml"], "latitude_deg"),
        (&["run", "--scenario", "garbage.toml"], "garbage.toml"),
        (&["run", "--seed", "minus-one"], "--seed"),
        (&["simulate"], "--out"),
        (&["replay", "lasergyro", "missing.csv"], "missing.csv"),
    ];
    for (args, part) in cases {
        let out = host_sim(dir.path()).args(args).assert().code(2);
        let text = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(text.contains(part), "{args:?}: no '{part}' in: {text}");
        assert!(!text.contains("panicked"), "{text}");
    }
    assert!(!dir.path().join("out").exists());
}

#[test]
fn json_is_not_written_over_a_recording() {
    let dir = tempfile::tempdir().unwrap();
    let refused = |args: &[&str]| {
        let out = host_sim(dir.path()).args(args).assert().code(2);
        let text = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(
            text.contains("is not JSON, and would be overwritten"),
            "{text}"
        );
    };
    let text = "t_s,wx_radps\n0.01,0\n";
    std::fs::write(dir.path().join("rest.csv"), text).unwrap();
    refused(&["allan", "rest.csv", "--json", "rest.csv"]);
    let left = std::fs::read_to_string(dir.path().join("rest.csv")).unwrap();
    assert_eq!(left, text);
    // a header begins as an array of JSON does
    std::fs::write(dir.path().join("header.toml"), "[start]\n").unwrap();
    refused(&["simulate", "--out", "s", "--json", "header.toml"]);
    // what the command itself has written
    refused(&["simulate", "--out", "s", "--json", "s/imu.csv"]);
    let written = std::fs::read_to_string(dir.path().join("s/imu.csv")).unwrap();
    assert!(written.starts_with("t_s,"), "{}", &written[..40]);
}

#[test]
fn a_report_directory_with_somebody_elses_files_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("mine")).unwrap();
    std::fs::write(dir.path().join("mine/thesis.txt"), "years of work").unwrap();
    host_sim(dir.path())
        .args(["run", "--out", "mine", "--json", "x.json"])
        .assert()
        .code(2);
    assert_eq!(
        std::fs::read_to_string(dir.path().join("mine/thesis.txt")).unwrap(),
        "years of work"
    );
    assert!(!dir.path().join("x.json").exists(), "nothing half-written");
}

#[test]
fn a_reader_that_goes_away_stops_neither_the_work_nor_its_files() {
    let dir = tempfile::tempdir().unwrap();
    let commands: [&[&str]; 2] = [&["run", "--out", "report"], &["unit", "schema"]];
    for arguments in commands {
        let mut child = std::process::Command::new(system::host_sim_binary())
            .current_dir(dir.path())
            .args(arguments)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let out = child.wait_with_output().unwrap();
        let errors = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{arguments:?}: {}", out.status);
        assert_eq!(errors, "", "{arguments:?}");
    }
    assert!(dir.path().join("report/index.html").is_file());
}
