//! `host-sim device watch`.

use super::software::{Device, Kind};
use super::{UNIT, command, output};
use host_unit::Unit;
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// A running `device watch`, with its output lines.
struct Watch {
    child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Watch {
    fn start(port: &str) -> Self {
        let mut child = Command::new(system::host_sim_binary())
            .args(["device", "--port", port, "--json", "watch"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
        Self { child, lines }
    }

    /// The next JSON object that it prints.
    fn next(&mut self) -> Value {
        let line = self.lines.next().expect("it goes on").expect("text");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn a_watch_reports_faults_with_their_remedy_and_rates() {
    let device = Device::start(&Kind::NEW);
    let text = output(&device.port, &["watch", "--seconds", "3", "--json"]);
    let lines: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(lines[0]["per_second"].is_null());
    for line in &lines {
        assert_eq!(
            (&line["event"], &line["mode"]),
            (&"status".into(), &"bypass".into())
        );
        let fault = &line["faults"][0];
        assert_eq!(fault["name"], "NOT_CONFIGURED");
        let says = fault["says"].as_str().unwrap();
        assert!(says.contains("no configuration"), "{says}");
        assert!(
            fault["remedy"]
                .as_str()
                .unwrap()
                .contains("device configure")
        );
    }
    // 250 frames a second; the computer may be late
    let rate = lines[2]["per_second"]["frames"].as_f64().unwrap();
    assert!((150.0..=350.0).contains(&rate), "{rate}");
    let learner = &lines[2]["learner"];
    assert_eq!(learner["way"], "none");
    assert!(learner["heading_sigma_deg"].is_null(), "{learner}");
    assert_eq!(learner["refused_alignments"], 0);
    // nothing to prove and nothing lost yet
    assert_eq!(lines[2]["says"], serde_json::json!([]), "{text}");
    assert!(lines[2]["nearest"].is_null() && lines[2]["interruption"].is_null());
    let text = output(&device.port, &["watch", "--seconds", "1"]);
    assert!(text.contains("heading by none, unknown"), "{text}");
    assert!(
        text.contains("FAULT NOT_CONFIGURED: ") && text.contains("remedy: "),
        "{text}"
    );
    assert!(
        text.contains("learner") && text.contains("error bound"),
        "{text}"
    );
    // no antenna was configured
    assert!(!text.contains("antenna"), "{text}");
}

#[test]
fn a_lost_device_is_reported_and_found_again() {
    let unit: Unit = toml::from_str(UNIT).unwrap();
    let configuration = unit.configuration().unwrap();
    let device = Device::start(&Kind::NEW);
    let port = device.port.clone();
    let mut watch = Watch::start(&port);
    assert_eq!(watch.next()["event"], "status");
    drop(device);
    let lost = watch.next();
    assert_eq!(lost["event"], "lost", "{lost}");
    assert!(
        lost["problem"].as_str().unwrap().contains("remedy"),
        "{lost}"
    );
    let kind = Kind {
        configuration: Some(configuration),
        ..Kind::NEW
    };
    let _device = Device::again(&port, &kind);
    assert_eq!(watch.next()["event"], "found");
    let status = watch.next();
    assert_eq!(
        (&status["event"], &status["mode"]),
        (&"status".into(), &"shadow".into())
    );
    assert!(
        status["per_second"].is_null(),
        "another start has no rates: {status}"
    );
}

#[test]
fn a_device_that_is_not_there_at_first_ends_the_watch() {
    let device = Device::start(&Kind::NEW);
    let port = device.port.clone();
    drop(device);
    let assert = command(&port, &["watch"])
        .timeout(Duration::from_secs(30))
        .assert()
        .code(2);
    let text = String::from_utf8_lossy(&assert.get_output().stderr).into_owned();
    assert!(text.contains("does not connect"), "{text}");
}

#[cfg(unix)]
#[test]
fn an_interruption_ends_a_watch_without_an_error() {
    let device = Device::start(&Kind::NEW);
    let mut watch = Watch::start(&device.port);
    assert_eq!(watch.next()["event"], "status");
    let process = watch.child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &process]).status();
    assert!(sent.expect("kill").success());
    assert_eq!(watch.child.wait().expect("it ends").code(), Some(0));
}
