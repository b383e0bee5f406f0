//! No command replaces a file that a user needs, or drops an option without a word.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use std::fs;
use std::path::Path;

fn host_sim(dir: &Path, args: &str) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command
        .current_dir(dir)
        .args(args.split_whitespace())
        .assert()
}

/// What a command that is refused says.
fn refused(dir: &Path, args: &str) -> String {
    let done = host_sim(dir, args).code(2);
    String::from_utf8_lossy(&done.get_output().stderr).into_owned()
}

/// A corrected recording never replaces a file of the recording, and a simulation no recording.
#[test]
fn files_of_a_recording_stay() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let simulate = "simulate --vehicle standing --scenario tactical --out own";
    host_sim(dir, simulate).success();
    let files = [
        "imu.csv",
        "gnss.csv",
        "unit.toml",
        "truth.csv",
        "header.toml",
    ];
    let content = |name: &str| fs::read(dir.join("own").join(name)).unwrap();
    let before = files.map(content);
    for name in files {
        let replay = format!(
            "replay csv --header own/header.toml --truth own/truth.csv --learn-s 400 --out page \
             --corrected own/{name} --force"
        );
        let said = refused(dir, &replay);
        assert!(
            said.contains("a file of the recording itself"),
            "{name}: {said}"
        );
    }
    assert!(files.map(content) == before);
    // again over a simulation, but not over a recording with files of the same names
    host_sim(dir, simulate).success();
    fs::write(dir.join("own/unit.toml"), "name = \"mine\"\n").unwrap();
    let said = refused(dir, simulate);
    assert!(said.contains("would be overwritten"), "{said}");
    assert_eq!(content("unit.toml"), b"name = \"mine\"\n");
}

/// What `convert` says it has written is in the file.
#[test]
fn samples_that_are_written_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let rows: String = (0..3000)
        .map(|n| {
            format!(
                "{:.2},0.001,0.002,0.003,0.1,0.2,-9.8\n",
                f64::from(n) * 0.01
            )
        })
        .collect();
    fs::write(dir.join("imu.csv"), format!("t,gx,gy,gz,ax,ay,az\n{rows}")).unwrap();
    fs::write(
        dir.join("gnss.csv"),
        "t,lat,lon,h\n1,45,7,100\n2,45,7,100\n",
    )
    .unwrap();
    let header = "[imu]\nfile = \"imu.csv\"\naxes = \"x y z\"\n\
                  time = { column = \"t\", unit = \"s\" }\n\
                  gyro = { columns = [\"gx\", \"gy\", \"gz\"], unit = \"rad/s\" }\n\
                  accel = { columns = [\"ax\", \"ay\", \"az\"], unit = \"m/s2\" }\n\
                  [gnss]\nfile = \"gnss.csv\"\ntime = { column = \"t\", unit = \"s\" }\n\
                  latitude = { column = \"lat\", unit = \"deg\" }\n\
                  longitude = { column = \"lon\", unit = \"deg\" }\n\
                  height = { column = \"h\", unit = \"m\" }\n";
    fs::write(dir.join("header.toml"), header).unwrap();
    host_sim(
        dir,
        "convert csv --header header.toml --to csv --out o --json c.json",
    )
    .success();
    let said: serde_json::Value =
        serde_json::from_slice(&fs::read(dir.join("c.json")).unwrap()).unwrap();
    let written = fs::read_to_string(dir.join("o/imu.csv")).unwrap();
    assert_eq!(said["samples"], written.lines().count() - 1);
    let first = written.lines().nth(1).unwrap().split(',').next().unwrap();
    assert_eq!(said["times_s"][0], first.parse::<f64>().unwrap());
    for (option, name) in [("--shift 5", "--shift"), ("--velocity", "--velocity")] {
        let convert = format!("convert csv --header header.toml --to csv --out p {option}");
        let said = refused(dir, &convert);
        assert!(
            said.contains(name) && said.contains("--to kf-gins"),
            "{said}"
        );
    }
}

/// Outputs of one command that would replace each other, or a file that it has not written.
#[test]
fn outputs_replace_no_other_file() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let campaign = "campaign --runs 1 --models noise --tuning-units 1";
    for outputs in [
        "--results a.md --csv a.csv",
        "--results a.md --report a.md",
        "--json j.json --ratios j.json",
    ] {
        let said = refused(dir, &format!("{campaign} --out c {outputs}"));
        assert!(said.contains("would be written twice"), "{outputs}: {said}");
    }
    fs::write(dir.join("my.toml"), "name = \"mine\"\n").unwrap();
    for command in [
        format!("{campaign} --out c --report my.toml"),
        "replay sessions my.toml a.toml --page my.toml".to_owned(),
    ] {
        let said = refused(dir, &command);
        assert!(said.contains("has not written"), "{command}: {said}");
    }
    assert_eq!(fs::read(dir.join("my.toml")).unwrap(), b"name = \"mine\"\n");
}

/// A remedy that is followed to the letter makes no other number of it.
#[test]
fn remedies_do_what_was_meant() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let unit = "name = \"u\"\n[gyro]\nbias_turn_on_dps = 0.003\n";
    fs::write(dir.join("u.toml"), unit).unwrap();
    let said = refused(dir, "unit check u.toml");
    assert!(said.contains("the value in dph, not in dps"), "{said}");
    let said = refused(dir, "soak --hours 0.01 --rate 7");
    assert!(said.contains("give 100, 200, 250, 500 or 1000"), "{said}");
    let said = refused(dir, "device --port tcp:127.0.0.1 info");
    assert!(said.contains("tcp:HOST:PORT"), "{said}");
    let said = refused(dir, "fleet --units 9 --drives 2");
    assert!(said.contains("give at least 10"), "{said}");
}
