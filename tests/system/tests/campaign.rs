//! `host-sim campaign`: the same bytes whatever the number of threads, shards and interruptions.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use std::path::Path;

fn campaign(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir).arg("campaign").args(args).assert()
}

fn read(dir: &Path, name: &str) -> Vec<u8> {
    std::fs::read(dir.join(name)).unwrap()
}

#[test]
fn threads_shards_and_interruptions_do_not_change_a_byte() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let base = ["--runs", "2", "--models", "noise", "--tuning-units", "1"];
    let run = |extra: &[&str]| {
        let args: Vec<&str> = base.iter().chain(extra).copied().collect();
        campaign(d, &args)
    };
    run(&["--jobs", "1", "--out", "one", "--json", "one.json"]).success();
    run(&["--jobs", "2", "--out", "two", "--json", "two.json"]).success();
    assert!(read(d, "one.json") == read(d, "two.json"), "two");

    // an interrupted campaign goes on where it was: the finished runs are not computed again
    let lost = d.join("one/runs/000001.json");
    let kept = d.join("one/runs/000000.json");
    std::fs::remove_file(&lost).unwrap();
    let before = kept.metadata().unwrap().modified().unwrap();
    run(&["--out", "one", "--resume", "--json", "resumed.json"]).success();
    assert_eq!(kept.metadata().unwrap().modified().unwrap(), before);
    assert!(read(d, "one.json") == read(d, "resumed.json"), "resumed");

    run(&["--shard", "0/2", "--out", "s0"]).success();
    run(&["--shard", "1/2", "--out", "s1"]).success();
    campaign(d, &["merge", "s0", "s1", "--json", "merged.json"]).success();
    assert!(read(d, "one.json") == read(d, "merged.json"), "merged");

    // results of another campaign are never mixed in or removed
    campaign(d, &["--runs", "1", "--models", "linear", "--out", "one"]).code(2);
    assert!(kept.exists());
    for wrong in [
        &["--shard", "2/2"][..],
        &["--models", "nonsense"],
        &["--runs", "0"],
        &["merge", "nowhere"],
    ] {
        campaign(d, wrong).code(2);
    }

    // on white noise the gate leaves the correction at zero, so the networks cost nothing at all
    let summary: serde_json::Value = serde_json::from_slice(&read(d, "one.json")).unwrap();
    let median = |scheme: &str| {
        let cells = summary.as_array().unwrap();
        let cell = cells
            .iter()
            .find(|c| c["scheme"] == scheme && c["t_min"] == 22)
            .unwrap();
        assert_eq!(cell["n"], 2);
        cell["median_m"].as_f64().unwrap()
    };
    assert_eq!(median("rnn-window"), median("floor"));
}
