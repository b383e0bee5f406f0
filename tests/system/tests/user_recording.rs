//! `host-sim replay` and `convert` of a user recording: csv, kf-gins, novatel.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use firmware::sample::Lsb;
use firmware::wire::novatel::inspvas::Inspvas;
use firmware::wire::novatel::{Header, Log, Repr};
use host_core::inertial::counts::quantise;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use serde_json::Value;
use std::path::Path;

fn host_sim(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).args(args).assert()
}

fn complaint(dir: &Path, args: &[&str]) -> String {
    let out = host_sim(dir, args).code(2);
    let text = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(!text.contains("panicked"), "{args:?}: {text}");
    text
}

/// Horizontal error of a scheme at the last time of the one outcome.
fn last(file: &Path, scheme: &str) -> f64 {
    let outcomes: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let rows = outcomes[0]["rows"].as_array().unwrap();
    let of = rows.iter().rfind(|r| r["scheme"] == scheme).unwrap();
    of["horizontal_m"].as_f64().unwrap()
}

/// A simulated drive is converted through every format and stays equal bit for bit; each format
/// replays to the same result.
#[test]
fn a_simulated_recording_goes_through_all_text_forms() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(
        at("s.toml"),
        "unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = 300\n",
    )
    .unwrap();
    let run = |args: &[&str]| drop(host_sim(dir.path(), args).success());
    run(&[
        "simulate",
        "--scenario",
        "s.toml",
        "--learning",
        "--out",
        "d",
    ]);
    let header = ["--header", "d/header.toml"];
    run(&[
        &["convert", "csv"],
        &header[..],
        &["--to", "kf-gins", "--velocity", "--out", "k"],
    ]
    .concat());
    let kf = ["k/imu.txt", "k/gnss.txt", "--standstill-s", "120"];
    run(&[
        &["convert", "kf-gins"],
        &kf[..],
        &["--to", "csv", "--out", "back"],
    ]
    .concat());
    for name in ["imu.csv", "gnss.csv", "header.toml"] {
        let [a, b] = ["d", "back"].map(|d| std::fs::read_to_string(at(d).join(name)).unwrap());
        // only the simulation knows its unit
        let a = a.trim_start_matches("unit = \"unit.toml\"\n\n");
        assert!(a == b, "{name} has changed");
    }
    let options = ["--json", "r.json", "--out", "page"];
    let csv = ["replay", "csv", "--header", "d/header.toml"];
    let mut ends = Vec::new();
    // the header names the unit file; a preset's name on the command line comes before it
    for source in [
        &csv[..],
        &[&csv[..], &["--unit", "tactical"]].concat(),
        &[&["replay", "kf-gins"], &kf[..], &["--unit", "d/unit.toml"]].concat(),
    ] {
        run(&[source, &options].concat());
        let page = std::fs::read_to_string(at("page").join("index.html")).unwrap();
        assert!(page.contains("learn 0-270 s, judge 270-420 s") && page.contains("<svg"));
        ends.push(["raw", "ls-bias", "ls-3x3", "ekf6", "rnn"].map(|s| last(&at("r.json"), s)));
    }
    assert_eq!(ends[0], ends[1]);
    assert_eq!(ends[0], ends[2]);
    run(&[&csv[..], &["--unit", "nav"], &options].concat());
    let nav = ["raw", "ls-bias", "ls-3x3", "ekf6", "rnn"].map(|s| last(&at("r.json"), s));
    assert_ne!(nav, ends[0]);
    let [raw, bias, ..] = ends[0];
    assert!(bias < 0.5 * raw, "{ends:?}");
    doubted(dir.path());
}

/// A right header causes no warning, not even with `--strict`. A wrong one is reported with its
/// remedy, and stops the replay with `--strict`.
fn doubted(dir: &Path) {
    let args = ["replay", "csv", "--header", "d/header.toml", "--strict"];
    let out = host_sim(dir, &[&args[..], &["--json", "w.json"]].concat()).success();
    let stderr = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(!stderr.contains("warning:"), "{stderr}");
    let outcomes: Value =
        serde_json::from_slice(&std::fs::read(dir.join("w.json")).unwrap()).unwrap();
    assert_eq!(outcomes[0]["warnings"], Value::Array(Vec::new()));
    let header = dir.join("d/header.toml");
    let text = std::fs::read_to_string(&header).unwrap();
    std::fs::write(&header, text.replace("unit = \"rad\"", "unit = \"deg\"")).unwrap();
    let text = complaint(dir, &args);
    assert!(
        text.contains("d/header.toml: warning: 'imu.gyro.unit'"),
        "{text}"
    );
    assert!(
        text.contains("the unit 'rad'") && text.contains("--strict"),
        "{text}"
    );
}

/// A log of raw increments and INSPVAS, type 11 (HG1700: 2^-33 rad, 2^-27 ft/s, 100 Hz), axes
/// forward-right-down.
fn log(session: &Session) -> Vec<u8> {
    let lsb = Lsb {
        rad: 0.5_f64.powi(33),
        mps: 0.5_f64.powi(27) * 0.3048,
    };
    let samples = quantise(session.increments(), &lsb).unwrap();
    let mut out = Vec::new();
    for (k, sample) in samples.iter().enumerate() {
        if k % 100 == 0 {
            let state = &session.reference[k / 100];
            let (roll, pitch, heading) = to_euler(&state.q_bn);
            let v = state.velocity;
            let second = 1000.0 + (k / 100) as f64;
            let ins = Inspvas {
                header_time: (2100, (second * 1e3) as u32),
                week: 2100,
                second_of_week: second,
                position: [
                    state.position.lat / DEG,
                    state.position.lon / DEG,
                    state.position.h,
                ],
                velocity: [v.x, v.y, -v.z],
                attitude: [roll, pitch, heading].map(|a| a / DEG),
                status: 3,
            };
            out.extend(ins.emit());
        }
        let second = 1000.0 + 0.01 * (k + 1) as f64;
        let repr = Repr {
            log: Log::Rawimusx,
            header: Header {
                week: 2100,
                millisecond: (second * 1e3) as u32,
                ..Header::default()
            },
            lead: [0, 11, 0x34, 0x08],
            second_of_week: second,
            status: 0,
            gyro: sample.dtheta,
            accel: sample.dv,
        };
        let mut buffer = [0; 128];
        let n = repr.emit(&mut buffer).unwrap();
        out.extend(&buffer[..n]);
    }
    out
}

#[test]
fn a_log_of_raw_increments_and_solutions_is_replayed_and_converted() {
    let imu = ImuSpec::preset("tactical").unwrap();
    let config = SessionConfig {
        imu: &imu,
        gnss: &GnssSpec::default(),
        start: host_core::inertial::earth::Geodetic {
            lat: 0.8,
            lon: 0.1,
            h: 300.0,
        },
        heading: 0.4,
        standstill_s: 10.0,
        drive_s: 200.0,
        segments: None,
        vibration: 1.0,
        unit: 1,
        turn_on: 2,
        drive: 3,
    };
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("in.gps"), log(&simulate(&config).0)).unwrap();
    let source = ["in.gps", "--mounting", "x y z"];
    let replay = [
        "--unit",
        "tactical",
        "--attitude-sigma",
        "0.01,0.01",
        "--json",
        "r.json",
    ];
    host_sim(
        dir.path(),
        &[&["replay", "novatel"], &source[..], &replay].concat(),
    )
    .success();
    let [raw, ekf] = ["raw", "ekf6"].map(|s| last(&dir.path().join("r.json"), s));
    assert!(raw < 500.0 && ekf < raw, "{raw} {ekf}");
    for to in ["csv", "kf-gins"] {
        host_sim(
            dir.path(),
            &[
                &["convert", "novatel"],
                &source[..],
                &["--to", to, "--out", to],
            ]
            .concat(),
        )
        .success();
    }
    let imu = std::fs::read_to_string(dir.path().join("kf-gins/imu.txt")).unwrap();
    assert_eq!(imu.lines().count(), 21_000);
    assert!(imu.starts_with("1000.01 "), "{}", &imu[..80]);
    host_sim(
        dir.path(),
        &[
            "replay",
            "csv",
            "--header",
            "csv/header.toml",
            "--out",
            "page",
        ],
    )
    .success();
}

#[test]
fn wrong_files_and_options_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("junk", "not a recording\n1,2\n");
    let imu: String = (1..=6000)
        .map(|k| format!("{:.2} 0 0 0 0 0 -0.0981\n", 0.01 * f64::from(k)))
        .collect();
    let gnss: String = (0..=60).map(|k| format!("{k} 45 7 80 1 1 2\n")).collect();
    write("imu.txt", &imu);
    write("gnss.txt", &gnss);
    write("bad.txt", &imu.replace("30.00 0", "30.00 x"));
    let attitude = ["--attitude", "0,0,0"];
    for (args, part) in [
        (&["replay", "csv", "--header", "junk"][..], "junk:1:"),
        (&["replay", "csv", "--header", "missing"], "missing"),
        (
            &[
                "replay",
                "kf-gins",
                "bad.txt",
                "gnss.txt",
                "--attitude",
                "0,0,0",
            ],
            "bad.txt:3000: column 'dtheta_x_rad'",
        ),
        (
            &["replay", "kf-gins", "imu.txt", "gnss.txt"],
            "'start' gives no attitude, and none is found in motion",
        ),
        (
            &[
                "replay",
                "kf-gins",
                "imu.txt",
                "gnss.txt",
                "--attitude",
                "0,0",
            ],
            "--attitude",
        ),
        (
            &[
                "replay", "kf-gins", "imu.txt", "gnss.txt", "--truth", "junk",
            ],
            "junk:1:",
        ),
        (&["replay", "novatel", "junk"], "junk"),
        (
            &[
                "convert",
                "kf-gins",
                "imu.txt",
                "gnss.txt",
                "--to",
                "kf-gins",
                "--velocity",
                "--out",
                "o",
            ],
            "--velocity",
        ),
        (
            &[
                "convert", "kf-gins", "imu.txt", "gnss.txt", "--to", "kf-gins", "--shift", "-9",
                "--out", "o",
            ],
            "--shift",
        ),
    ] {
        let text = complaint(dir.path(), args);
        assert!(text.contains(part), "{args:?}: no '{part}' in: {text}");
    }
    for (option, value) in [
        ("--learn-s", "59"),
        ("--unit", "best"),
        ("--attitude-sigma", "1"),
    ] {
        let source = ["replay", "kf-gins", "imu.txt", "gnss.txt"];
        let text = complaint(
            dir.path(),
            &[&source[..], &attitude, &[option, value]].concat(),
        );
        let named = text.contains(option) || text.contains("'best'");
        assert!(named, "{option}: {text}");
    }
    assert!(!dir.path().join("out").exists() && !dir.path().join("o").exists());
    let Some(data) = system::data_dir() else {
        println!("skipped: no recorded data; remedy: set LRNN_DATA to its folder");
        return;
    };
    let log = data.join("novatel-ins2.gps").canonicalize().unwrap();
    let log = log.to_str().unwrap();
    let text = complaint(dir.path(), &["replay", "novatel", log]);
    assert!(text.contains("'RAWIMUSX' is not among"), "{text}");
    host_sim(dir.path(), &["replay", "novatel", log, "--inventory"]).success();
}

/// Samples of two hours wait in a temporary file. Without space for it they are refused; a file of
/// half the length is not.
#[test]
fn a_long_recording_needs_space_for_temporary_files() {
    let dir = tempfile::tempdir().unwrap();
    let header = "[imu]\nfile = \"imu.csv\"\ntime = { column = \"t\", unit = \"s\" }\n\
         gyro = { columns = [\"x\", \"y\", \"z\"], unit = \"rad/s\" }\n\
         accel = { columns = [\"a\", \"b\", \"c\"], unit = \"m/s^2\" }\naxes = \"x y z\"\n\
         [start]\nstandstill_s = 90\nlatitude_deg = 45.0\nlongitude_deg = 7.0\nheight_m = 100.0\n";
    std::fs::write(dir.path().join("header.toml"), header).unwrap();
    let write = |samples: u32| {
        let mut text = "t,x,y,z,a,b,c\n".to_owned();
        for k in 0..samples {
            text += &format!("{},5e-5,0,-5e-5,0,0,-9.8\n", f64::from(k) / 200.0);
        }
        std::fs::write(dir.path().join("imu.csv"), text).unwrap();
    };
    let said = || {
        let mut command = Command::new(system::host_sim_binary());
        let args = ["replay", "csv", "--header", "header.toml", "--out", "out"];
        // no recording is that long, so it ends after reading
        let args = args.into_iter().chain(["--learn-s", "99999999"]);
        let command = command.current_dir(dir.path()).args(args);
        let out = command.env("TMPDIR", "nowhere").assert().code(2);
        String::from_utf8_lossy(&out.get_output().stderr).into_owned()
    };
    write(700_000);
    assert!(said().contains("host-sim: --learn-s: "), "{}", said());
    write(1_450_000);
    let text = said();
    let named = text.contains("nowhere/a temporary file: cannot be written");
    let remedy = text.contains("; remedy: choose a place with free space");
    assert!(named && remedy, "{text}");
    assert!(!dir.path().join("out").exists());
}
