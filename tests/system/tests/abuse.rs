//! `host-sim abuse`: its files, its merging, and its messages.

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

/// Options for the shortest possible drives.
const SHORT: [&str; 7] = [
    "abuse",
    "--times",
    "120,60,60",
    "--sensors",
    "perfect",
    "--computers",
    "plain",
];

#[test]
fn two_cases_give_rows_and_a_page_and_merge_to_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let with = |more: &[&str]| host_sim(d, &[&SHORT[..], more].concat()).success();
    let cases = ["--cases", "none,late-0.5+coloured:ended", "--runs", "2"];
    let whole = [
        &cases[..],
        &["--json", "whole.json", "--results", "page.md"],
    ]
    .concat();
    let done = with(&whole);
    let text = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(text.contains("late-0.5+coloured:ended"), "{text}");
    let rows = json(&d.join("whole.json"));
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 2 * 2, "cases and activations");
    for row in rows {
        for key in [
            "raw_median_m",
            "corrected_median_m",
            "ratio_median",
            "ratio_worst",
            "promoted_share",
            "rolled_back_share",
        ] {
            assert!(row[key].is_number(), "{key}: {row}");
        }
        assert_eq!(
            (&row["runs"], &row["sensor"]),
            (&2.into(), &"perfect".into())
        );
        assert!(row["case"].is_string() && row["activation"].is_string());
    }
    let page = std::fs::read_to_string(d.join("page.md")).unwrap();
    assert!(
        page.contains("--results page.md") && page.contains("| `none` |"),
        "{page}"
    );
    let csv = std::fs::read_to_string(d.join("page.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + rows.len(), "{csv}");
    // existing results are not computed again, and two shards give the same
    let resumed = [&cases[..], &["--resume", "--json", "again.json"]].concat();
    with(&resumed);
    for shard in ["0/2", "1/2"] {
        let out = format!("out/{}", &shard[..1]);
        with(&[&cases[..], &["--shard", shard, "--out", &out]].concat());
    }
    let merge = ["abuse", "merge", "out/0", "out/1", "--json", "merged.json"];
    host_sim(d, &merge).success();
    for file in ["again.json", "merged.json"] {
        assert_eq!(json(&d.join(file)).as_array().unwrap(), rows, "{file}");
    }
}

#[test]
fn errors_are_reported_with_their_remedy() {
    let dir = tempfile::tempdir().unwrap();
    for (args, words) in [
        (&["--cases", "lat-0.5"][..], "did you mean 'late-0.5'"),
        (&["--sensors", "perfekt"], "did you mean 'perfect'"),
        (
            &["--cases", "creep+ship"],
            "a vehicle cannot move in two ways",
        ),
        (
            &["--cases", "none", "--set", "late-0.5.delay_s=1"],
            "none of the cases that are run",
        ),
        (
            &["--cases", "late-0.5", "--set", "late-0.5.delay=1"],
            "delay_s",
        ),
        (
            &["--cases", "late-0.5", "--set", "late-0.5"],
            "CASE.KEY=VALUE",
        ),
        (&["--times", "300,900"], "three numbers"),
    ] {
        let failed = host_sim(dir.path(), &[&["abuse"], args].concat()).failure();
        let text = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
        assert!(text.contains(words), "{args:?}: {text}");
    }
}
