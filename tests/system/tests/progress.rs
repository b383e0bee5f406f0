//! Long commands show on a terminal their progress and the remaining time, and write none of it to
//! a file.

use std::path::Path;
use std::process::Command;
use system::host_sim_binary;

/// Output of a command on a terminal; `None` where no program can provide a terminal.
fn on_a_terminal(dir: &Path, args: &[&str]) -> Option<String> {
    let words = [host_sim_binary().to_string_lossy().into_owned()].into_iter();
    let words = words.chain(args.iter().map(|word| (*word).to_owned()));
    let line = words.map(|word| format!("'{word}'")).collect::<Vec<_>>();
    let output = Command::new("script")
        .current_dir(dir)
        .args(["-q", "-e", "-c", &line.join(" "), "typescript"])
        .env("TERM", "xterm")
        .output();
    match output {
        Ok(output) => {
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(output.status.success(), "{args:?}: {text}");
            Some(text)
        }
        Err(error) => {
            println!("skipped: there is no program `script` of util-linux ({error})");
            None
        }
    }
}

/// Every stage of a command shows the remaining time. A stage that is missing in the plan would
/// show none.
#[test]
fn each_stage_shows_the_time_that_is_left() {
    let dir = tempfile::tempdir().expect("a directory");
    let dir = dir.path();
    std::fs::write(
        dir.join("short.toml"),
        "[learn]\nstandstill_s = 120\ndrive_s = 400\n[test]\nstandstill_s = 120\ndrive_s = 300\n",
    )
    .expect("it is written");
    let simulated = [
        "simulate",
        "--scenario",
        "short.toml",
        "--learning",
        "--out",
        "d",
    ];
    let header = ["replay", "csv", "--header", "d/header.toml", "--out", "r"];
    let unit = [
        "report",
        "--unit",
        "d/unit.toml",
        "--from",
        "d",
        "--out",
        "u",
    ];
    let run = ["run", "--scenario", "short.toml", "--out", "o"];
    let allan = ["allan", "--unit", "nav", "--duration", "600"];
    let convert = [
        "convert",
        "csv",
        "--header",
        "d/header.toml",
        "--to",
        "csv",
        "--out",
        "c",
        "--force",
    ];
    // those that take long; a short one may be over before it is drawn
    let cases: [(&[&str], &[&str]); 6] = [
        (&simulated, &["simulating"]),
        (
            &header,
            &["reading the recording", "aligning, learning, navigating"],
        ),
        (&unit, &["reading the recording", "writing the report"]),
        (
            &run,
            &["simulating the drives", "the device on earlier drives"],
        ),
        (&allan, &["simulating the unit at rest"]),
        (&convert, &["reading the recording"]),
    ];
    for (args, stages) in cases {
        let Some(text) = on_a_terminal(dir, args) else {
            return;
        };
        for stage in stages {
            let shown = text.split('\r').any(|line| {
                let after = line.split(&format!(" {stage}, about ")).nth(1);
                after.is_some_and(|rest| rest.contains(" left"))
            });
            assert!(shown, "{args:?}: {stage} in {text:?}");
        }
    }
}
