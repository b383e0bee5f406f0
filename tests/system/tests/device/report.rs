//! `host-sim report` of a device.

use super::software::{Device, Kind};
use super::{file, json, output};
use assert_cmd::Command;
use serde_json::Value;
use std::path::Path;

/// The report of a device contains what `info` and `weights get` print, and sentences for what the
/// device does not know. Nothing in the device changes.
#[test]
fn a_device_is_reported_and_not_changed() {
    let directory = tempfile::tempdir().unwrap();
    let unit = file(directory.path(), "", "");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let device = Device::start(&Kind::NEW);
    let port = &device.port;
    let report = |more: &[&str]| {
        let from = format!("device:{port}");
        let (out, data) = (path("r"), path("r.json"));
        let args = ["report", "--from", &from, "--out", &out, "--json", &data];
        let mut command = Command::new(system::host_sim_binary());
        command.args(args).args(more).assert().success();
        system::json(Path::new(&data))
    };
    let part = |report: &Value, id: &str| {
        let parts = report["parts"].as_array().unwrap();
        parts.iter().find(|part| part["id"] == id).unwrap().clone()
    };
    let empty = report(&[]);
    let verdict = empty["verdict"].to_string();
    assert!(
        verdict.contains("no configuration and corrects nothing"),
        "{verdict}"
    );
    assert!(part(&empty, "bound")["left_out"].is_string());

    output(port, &["configure", &unit, "--no-store"]);
    let networks = host_device::device::images(&host_device::hil::networks());
    std::fs::write(path("w.bin"), &networks).unwrap();
    output(port, &["weights", "put", &path("w.bin")]);
    let reported = report(&["--unit", &unit]);
    assert_eq!(std::fs::read(path("r/weights.bin")).unwrap(), networks);
    let (info, mut of_report) = (
        json(port, &["info"]),
        part(&reported, "device")["data"].clone(),
    );
    let read = of_report["info"].take();
    for key in [
        "firmware",
        "board",
        "name",
        "serial",
        "mode",
        "error_bound_m",
        "memory",
    ] {
        assert_eq!(read[key], info[key], "{key}");
    }
    assert_eq!(
        part(&reported, "bound")["data"][0]["metres"],
        info["error_bound_m"]
    );
    for id in ["noise", "navigation", "rehearsals", "learnt"] {
        let why = part(&reported, id)["left_out"].as_str().unwrap().to_owned();
        assert!(why.contains("does not report"), "{id}: {why}");
    }
    let same = part(&reported, "identity")["sentences"].to_string();
    assert!(!same.contains("not configured for this unit"), "{same}");
    let other = report(&["--unit", "tactical"]);
    let differs = part(&other, "identity")["sentences"].to_string();
    assert!(
        differs.contains("not configured for this unit"),
        "{differs}"
    );
    let again = json(port, &["info"]);
    assert_eq!(
        (&again["mode"], &again["name"]),
        (&info["mode"], &info["name"])
    );
}
