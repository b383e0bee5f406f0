//! `host-sim start`, and `host-sim simulate` with other vehicles than a car on the road.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use std::path::Path;
use system::json;

fn host_sim(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args).assert()
}

#[test]
fn the_table_has_the_classes_that_were_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let classes = "laser-47,straight";
    let start = |jobs: &str, file: &str| {
        let args = ["start", "--seeds", "2", "--class", classes, "--jobs", jobs];
        let files = ["--json", file, "--results", "start.md"];
        host_sim(d, &[&args[..], &files].concat()).success()
    };
    let done = start("1", "one.json");
    let text = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    for part in ["laser-47", "2 of 2", "traps", "straight"] {
        assert!(text.contains(part), "no '{part}' in:\n{text}");
    }
    let all = json(&d.join("one.json"));
    assert_eq!((&all["seeds"], &all["whole"]), (&2.into(), &true.into()));
    let [laser, straight] = &all["classes"].as_array().unwrap()[..] else {
        panic!("{all}");
    };
    assert_eq!(
        (&laser["class"], &laser["unit"], &laser["goal"]),
        (&"laser-47".into(), &"medium".into(), &"start".into())
    );
    assert_eq!(straight["goal"], "trap");
    assert_eq!(
        (&laser["started"]["k"], &laser["right"]["k"]),
        (&2.into(), &2.into())
    );
    assert_eq!(laser["silently_wrong"], 0);
    // the alignment at standstill takes 100 s, and a fix must come
    let [first, second] = &laser["trials"].as_array().unwrap()[..] else {
        panic!("{laser}");
    };
    for trial in [first, second] {
        let started = &trial["started"];
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        assert!(
            (100.0..120.0).contains(&number(&started["at_s"])),
            "{trial}"
        );
        assert!(number(&started["attitude"]["heading_deg"]).abs() < 3.0);
        assert!(number(&started["attitude"]["tilt_deg"]) < 0.1);
        assert!(number(&started["later"][1]["heading_deg"]).abs() < 1.0);
        assert!(number(&trial["fixes"]) > 500.0);
    }
    assert_ne!(first["started"], second["started"]);
    let page = std::fs::read_to_string(d.join("start.md")).unwrap();
    assert!(page.contains("| laser-47 | 2 of 2 |"), "{page}");
    assert!(
        page.contains("cargo run --release -- start --seeds 2"),
        "{page}"
    );
    // the number of threads changes nothing
    start("2", "two.json");
    assert_eq!(json(&d.join("two.json")), all);
}

#[test]
fn bad_options_are_refused_with_a_remedy() {
    let dir = tempfile::tempdir().unwrap();
    for (args, message) in [
        (&["--class", "lazer-47"][..], "there is no class 'lazer-47'"),
        (&["--class", "lazer-47"], "laser-47"),
        (&["--seeds", "0"], "--seeds: is 0; remedy: give at least 1"),
        (&["--rate-hz", "3", "--seeds", "1"], "give 1, 2, 5 or 10"),
        (&["--rate-hz", "21"], "21"),
        (&["--fix-delay-ms", "2000"], "--fix-delay-ms: is 2000"),
        (&["--lever-arm-m", "1,2"], "forward,right,down"),
        (&["--unit", "no-such"], "there is no unit 'no-such'"),
    ] {
        let refused = host_sim(dir.path(), &[&["start"], args].concat()).code(2);
        let text = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(text.contains(message), "{args:?}: {text}");
    }
}

/// A ship's files have no standstill, and the same command gives the same bytes.
#[test]
fn any_vehicle_can_be_simulated() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let scenario =
        "vehicle = 'ship'\nunit = 'tactical'\n[test]\nstandstill_s = 90\ndrive_s = 120\n";
    std::fs::write(d.join("ship.toml"), scenario).unwrap();
    std::fs::write(d.join("learn.toml"), "[learn]\ndrive_s = 1800\n").unwrap();
    std::fs::write(d.join("city.toml"), "[city]\nstops = false\n").unwrap();
    std::fs::write(d.join("fast.toml"), "[gnss]\nrate_hz = 5\n").unwrap();
    let simulate = |extra: &[&str], out: &str| {
        let args = ["simulate", "--scenario", "ship.toml", "--out", out];
        host_sim(d, &[&args[..], extra].concat()).success();
        std::fs::read(d.join(out).join("imu.csv")).unwrap()
    };
    let ship = simulate(&[], "ship");
    assert_eq!(ship, simulate(&["--vehicle", "ship"], "again"));
    let header = std::fs::read_to_string(d.join("ship/header.toml")).unwrap();
    assert!(header.contains("heading_deg") && !header.contains("standstill_s"));
    for vehicle in [
        "road",
        "city",
        "aircraft",
        "traffic",
        "train",
        "hand-held",
        "standing",
    ] {
        assert_ne!(ship, simulate(&["--vehicle", vehicle], vehicle));
        let header = std::fs::read_to_string(d.join(vehicle).join("header.toml")).unwrap();
        assert!(header.contains("standstill_s = 90"), "{vehicle}");
    }
    for (args, message) in [
        (
            &["simulate", "--vehicle", "boat", "--out", "o"][..],
            "there is no vehicle 'boat'",
        ),
        (
            &["run", "--scenario", "ship.toml"],
            "'vehicle' is 'ship', which never stands",
        ),
        (
            &["campaign", "--runs", "1", "--scenario", "ship.toml"],
            "'vehicle' is 'ship', which never stands",
        ),
        (
            &["campaign", "--runs", "1", "--vehicle", "tran"],
            "there is no vehicle 'tran'",
        ),
        (
            &["campaign", "--runs", "1", "--scenario", "city.toml"],
            "'city' is given, but `campaign` does not use it",
        ),
        (
            &["campaign", "--runs", "1", "--scenario", "fast.toml"],
            "'gnss.rate_hz' is 5, but `campaign` takes one fix a second",
        ),
        (
            &["run", "--scenario", "fast.toml"],
            "'gnss.rate_hz' is 5, but `run` takes one fix a second",
        ),
        (
            &["campaign", "--runs", "1", "--scenario", "learn.toml"],
            "'learn' is given, but `campaign` does not use it",
        ),
    ] {
        let refused = host_sim(d, args).code(2);
        let text = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
        assert!(text.contains(message), "{text}");
    }
}

/// A standstill is declared only where it shows north: with other sensors a replay finds the
/// attitude in motion.
#[test]
fn a_standstill_is_declared_where_it_shows_north() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    for (unit, declared) in [("tactical", true), ("mems", false)] {
        let scenario = format!("unit = '{unit}'\n[test]\nstandstill_s = 90\ndrive_s = 120\n");
        std::fs::write(d.join("scenario.toml"), scenario).unwrap();
        let args = ["simulate", "--scenario", "scenario.toml", "--out", unit];
        host_sim(d, &args).success();
        let header = std::fs::read_to_string(d.join(unit).join("header.toml")).unwrap();
        assert_eq!(header.contains("\nstandstill_s = "), declared, "{unit}");
    }
}

/// A receiver with 5 fixes a second, half a second late: the file has the fixes of all arrivals, at
/// the times that follow from the unit's delay, 0.1 s before them. The true position was passed 0.4
/// s earlier.
#[test]
fn simulated_files_have_the_fixes_of_the_true_receiver() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let scenario = "vehicle = 'train'\nunit = 'tactical'\n[gnss]\nlatency_s = 0.5\nrate_hz = 5\n\
                    horizontal_m = 0.001\n[train]\nstop_every_s = 0\n\
                    [test]\nstandstill_s = 0\ndrive_s = 120\n";
    std::fs::write(d.join("s.toml"), scenario).unwrap();
    host_sim(d, &["simulate", "--scenario", "s.toml", "--out", "o"]).success();
    let rows = |file: &str| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(d.join("o").join(file)).unwrap();
        let numbers = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
        text.lines().skip(1).map(numbers).collect()
    };
    let (fixes, truth) = (rows("gnss.csv"), rows("truth.csv"));
    // arrivals from 0.6 to 120 s
    assert_eq!((fixes.len(), truth.len()), (598, 121));
    assert!((fixes[0][0] - 0.5).abs() < 1e-9, "{}", fixes[0][0]);
    // the fix that arrives at a second, and the true position at that second
    let metres = 6.37e6_f64.to_radians();
    let mut compared = 0;
    for fix in &fixes {
        let arrival = fix[0] + 0.1;
        if (arrival - arrival.round()).abs() > 1e-6 {
            continue;
        }
        let at = &truth[arrival.round() as usize];
        let north = (at[1] - fix[1]) * metres;
        let east = (at[2] - fix[2]) * metres * at[1].to_radians().cos();
        let behind = north.hypot(east);
        assert!((behind - 20.0).abs() < 0.2, "{arrival}: {behind}");
        compared += 1;
    }
    assert_eq!(compared, 120);
}
