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

fn text(dir: &Path, name: &str) -> String {
    String::from_utf8(read(dir, name)).unwrap()
}

#[test]
#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn threads_shards_and_interruptions_do_not_change_a_byte() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let base = ["--runs", "2", "--models", "noise", "--tuning-units", "1"];
    let run = |extra: &[&str]| {
        let args: Vec<&str> = base.iter().chain(extra).copied().collect();
        campaign(d, &args)
    };
    let printed = run(&[
        "--jobs",
        "1",
        "--out",
        "one",
        "--json",
        "one.json",
        "--ratios",
        "one-ratios.json",
        "--report",
        "page.html",
    ])
    .success();
    let page = text(d, "page.html");
    // terminal, JSON and page begin with one sentence
    let data: serde_json::Value = serde_json::from_slice(&read(d, "one.json")).unwrap();
    let verdict = data["verdict"].as_str().unwrap();
    let printed = String::from_utf8_lossy(&printed.get_output().stdout).into_owned();
    assert!(
        printed.lines().any(|line| line == verdict),
        "{verdict}: {printed}"
    );
    assert!(page.contains(verdict), "{verdict}");
    run(&[
        "--jobs",
        "2",
        "--out",
        "two",
        "--json",
        "two.json",
        "--ratios",
        "two-ratios.json",
        "--report",
        "page.html",
    ])
    .success();
    for (a, b) in [
        ("one.json", "two.json"),
        ("one-ratios.json", "two-ratios.json"),
        ("one/campaign.csv", "two/campaign.csv"),
    ] {
        assert!(read(d, a) == read(d, b), "{b}");
    }
    system::well_formed(&page).unwrap();
    let (head, commands) = page.split_once("<pre>").unwrap();
    assert!(
        head.contains("class=\"verdict\">Verdict: ") && head.contains("With 2 of at least 6 runs")
    );
    assert!(commands.contains("--report page.html") && !commands.contains("--jobs"));
    assert!(
        text(d, "page.html").split_once("<pre>").unwrap().0 == head,
        "two jobs"
    );

    // An interrupted campaign continues where it stopped: finished runs are not computed again.
    let lost = d.join("one/runs/000001.json");
    let kept = d.join("one/runs/000000.json");
    std::fs::remove_file(&lost).unwrap();
    let tuning = d.join("one/tuning.json");
    let dated = |path: &Path| path.metadata().unwrap().modified().unwrap();
    let before = (dated(&kept), dated(&tuning));
    run(&["--out", "one", "--resume", "--json", "resumed.json"]).success();
    assert_eq!((dated(&kept), dated(&tuning)), before);
    assert!(read(d, "one.json") == read(d, "resumed.json"), "resumed");

    // Shards have directories of their own, or share one, including the tuning.
    run(&["--shard", "0/2", "--out", "s0"]).success();
    run(&["--shard", "1/2", "--out", "s1"]).success();
    run(&["--shard", "0/2", "--out", "shared"]).success();
    let tuned = dated(&d.join("shared/tuning.json"));
    run(&["--shard", "1/2", "--out", "shared"]).success();
    assert_eq!(dated(&d.join("shared/tuning.json")), tuned);
    for dirs in [&["s0", "s1"][..], &["shared"]] {
        let files = [
            "--json",
            "merged.json",
            "--csv",
            "merged.csv",
            "--report",
            "m.html",
        ];
        let args: Vec<&str> = ["merge"]
            .iter()
            .chain(dirs)
            .chain(&files)
            .copied()
            .collect();
        campaign(d, &args).success();
        assert!(read(d, "one.json") == read(d, "merged.json"), "{dirs:?}");
        assert!(
            read(d, "one/campaign.csv") == read(d, "merged.csv"),
            "{dirs:?}"
        );
        assert!(text(d, "m.html").starts_with(head), "{dirs:?}");
    }
    let lonely = campaign(d, &["merge", "s1"]).success();
    let output = String::from_utf8_lossy(&lonely.get_output().stderr).into_owned();
    assert!(
        output.contains("missing between run 0 and run 1: 0;"),
        "{output}"
    );

    // The table has its columns, and a line with the figures for each row of each run.
    let table = text(d, "one/campaign.csv");
    let mut lines = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let column = |name: &str| head.iter().position(|column| *column == name).unwrap();
    for name in ["seed_turn_on", "tuned_walk_per_h", "fingerprint"] {
        column(name);
    }
    for run in ["000000", "000001"] {
        let rows = text(d, &format!("one/runs/{run}.json"));
        for row in serde_json::from_str::<Vec<serde_json::Value>>(&rows).unwrap() {
            let line = lines.find(|line| line[column("scheme")] == row["scheme"]);
            let line = line.unwrap_or_else(|| panic!("{row}"));
            assert_eq!(line.len(), head.len());
            let number = |name: &str| line[column(name)].parse::<f64>().unwrap();
            assert_eq!(
                row["horizontal_m"].as_array().unwrap().last().unwrap(),
                number("horizontal_22min_m")
            );
            assert_eq!(row["north_m"][0], number("north_5min_m"));
            assert_eq!(row["run"], number("run") as u64);
        }
    }
    assert!(lines.next().is_none());

    // Results of another campaign are never mixed in or removed.
    campaign(d, &["--runs", "1", "--models", "linear", "--out", "one"]).code(2);
    assert!(kept.exists());
    for wrong in [
        &["--shard", "2/2"][..],
        &["--models", "nonsense"],
        &["--start", "tepid"],
        &["--runs", "0"],
        &["merge", "nowhere"],
    ] {
        campaign(d, wrong).code(2);
    }

    // With white noise only, the gate leaves the correction at zero, so the networks cost nothing.
    let summary: serde_json::Value = serde_json::from_slice(&read(d, "one.json")).unwrap();
    let median = |scheme: &str| {
        let cells = summary["rows"].as_array().unwrap();
        let cell = cells
            .iter()
            .find(|c| c["scheme"] == scheme && c["t_min"] == 22)
            .unwrap();
        assert_eq!(cell["n"], 2);
        cell["median_m"].as_f64().unwrap()
    };
    assert_eq!(median("rnn-window"), median("floor"));
}

/// Earlier drives: an interruption and shards change nothing, and each row names its drives.
#[test]
fn earlier_drives_can_be_interrupted_and_divided() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let base = [
        "--runs",
        "2",
        "--models",
        "linear",
        "--tuning-units",
        "1",
        "--drives",
        "2,0,1,1",
        "--no-fixes",
        "--start",
        "mixed",
        "--schemes",
        "uncorrected,ekf6,ekf6-memory,device",
    ];
    let run = |extra: &[&str]| {
        let args: Vec<&str> = base.iter().chain(extra).copied().collect();
        campaign(d, &args)
    };
    let whole = [
        "--out",
        "whole",
        "--json",
        "whole.json",
        "--ratios",
        "r.json",
    ];
    run(&whole).success();
    std::fs::remove_file(d.join("whole/runs/000000.json")).unwrap();
    run(&["--out", "whole", "--resume", "--json", "resumed.json"]).success();
    assert!(read(d, "whole.json") == read(d, "resumed.json"));
    for shard in ["0/2", "1/2"] {
        run(&["--shard", shard, "--out", "shared"]).success();
    }
    let files = ["--json", "merged.json", "--csv", "merged.csv"];
    campaign(d, &[&["merge", "shared"][..], &files].concat()).success();
    assert!(read(d, "whole.json") == read(d, "merged.json"));
    assert!(read(d, "whole/campaign.csv") == read(d, "merged.csv"));

    let json =
        |name: &str| -> Vec<serde_json::Value> { serde_json::from_slice(&read(d, name)).unwrap() };
    let rows = json("whole/runs/000001.json");
    // four schemes and the floor after 0, 1 and 2 drives
    assert_eq!(rows.len(), 5 * 3);
    let starts = ["cold", "warm", "hot"];
    for row in &rows {
        assert!(starts.contains(&row["start"].as_str().unwrap()) && row["drives"].is_u64());
    }
    let whole: serde_json::Value = serde_json::from_slice(&read(d, "whole.json")).unwrap();
    let summary = whole["rows"].as_array().unwrap();
    let verdict = whole["verdict"].as_str().unwrap();
    assert!(
        verdict.starts_with("Verdict after 2 earlier drives: "),
        "{verdict}"
    );
    assert_eq!(summary.len(), 5 * 3 * 5);
    assert!(summary.iter().all(|cell| cell["start"] == "mixed"));
    let ratios = json("r.json");
    // each of five against four others at five times, for the group and over all groups
    assert_eq!(ratios.len(), 3 * 5 * 4 * 5 * 2);
    for drives in [0, 1, 2] {
        let of = |r: &&serde_json::Value| r["drives"] == drives && r["start"] == "mixed";
        assert_eq!(ratios.iter().filter(of).count(), ratios.len() / 3);
    }
    // another number of drives is another campaign
    campaign(
        d,
        &["--models", "linear", "--drives", "0,1", "--out", "whole"],
    )
    .code(2);
    for (wrong, remedy) in [
        (&["--drives", "1", "--ablation"][..], "leave --drives"),
        (&["--no-fixes", "--ablation"], "leave --drives"),
        (&["--drives", "0,1", "--results", "r.md"], "leave --drives"),
        (&["merge", "shared", "--results", "r.md"], "leave --drives"),
        (&["--drives", "65"], "64"),
        (
            &["--schemes", "ekf6", "--report", "p.html"],
            "add uncorrected",
        ),
        (&["--report", "."], "cannot be written"),
        (&["merge", "whole.json"], "directories (--out) of shards"),
        (&["--drives", "many"], "--drives"),
    ] {
        let failed = campaign(d, wrong).code(2);
        let message = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(message.contains(remedy), "{wrong:?}: {message}");
    }
    assert!(!d.join("r.md").exists());
}
