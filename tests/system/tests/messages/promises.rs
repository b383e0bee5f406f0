//! Sentences of the pages that promise something of files and have no test elsewhere: each stands
//! in its page, and the program keeps it.

use super::host_sim;
use super::tried::edits::{fixes, gpsd, text, write};
use crate::writers::{csv, drive, euroc};
use std::path::Path;

const YOUR_DATA: &str = include_str!("../../../../docs/your-data.md");
const USING: &str = include_str!("../../../../docs/USING.md");

/// A sentence of a page, and how it is tried.
struct Promise {
    page: &'static str,
    sentence: &'static str,
    make: fn(&Path),
    args: &'static str,
    /// Parts of what is printed.
    printed: &'static [&'static str],
    code: i32,
}

const PROMISES: &[Promise] = &[
    Promise {
        page: YOUR_DATA,
        sentence: "Fixes before or after the samples are counted.",
        make: |dir| {
            write(dir, "x.json", &gpsd(dir));
            text(dir, "imu.csv", |old| {
                old.lines()
                    .take(20_001)
                    .map(|line| format!("{line}\n"))
                    .collect()
            });
        },
        args: "convert csv --header header.toml --fixes x.json --to csv --out o",
        printed: &[
            "361 fixes (gpsd)",
            "160 of them before or after the samples",
        ],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "`--gnss-order` gives another.",
        make: |_| (),
        args: "convert kf-gins k/imu.txt k/gnss.txt --gnss-order sigma-velocity --to csv --out o",
        printed: &["k/gnss.txt:1: column", "standard deviation"],
        code: 2,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "`--part N` uses one part alone.",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                let all = old.lines().enumerate();
                let kept = all.filter(|(k, _)| !(20_000..23_000).contains(k));
                kept.map(|(_, line)| format!("{line}\n")).collect()
            });
        },
        args: "replay csv --header header.toml --unit tactical --part 3",
        printed: &["--part", "2"],
        code: 2,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "added to these times, s, or `\"estimate\"`",
        make: |dir| {
            fixes(dir, &[0], |t| t + 2.0);
            text(dir, "header.toml", |old| {
                old.replace("[gnss]\n", "[gnss]\ntime_offset_s = 'estimate'\n")
            });
        },
        args: "replay csv --header header.toml --unit tactical --strict",
        printed: &["-2.0"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "the ground truth is thinned to fixes (`--fix-interval-s`, default 1,",
        make: |_| (),
        args: "convert euroc . --fix-interval-s 2 --to csv --out o",
        printed: &["36000 samples, 181 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "Files on the command line replace those that the header names: first that of \
                   the IMU, then that of the fixes",
        make: |dir| {
            for name in ["imu.csv", "gnss.csv"] {
                std::fs::rename(dir.join(name), dir.join(format!("other-{name}"))).unwrap();
            }
        },
        args: "convert csv --header header.toml other-imu.csv other-gnss.csv --to csv --out o",
        printed: &["36000 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "The names are looked for in the first 256 lines",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                "a line of a logger\n".repeat(255) + old
            });
        },
        args: "convert csv --header header.toml --to csv --out o",
        printed: &["36000 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: USING,
        sentence: "It does not stop the replay unless you give `--strict`.",
        make: |dir| fixes(dir, &[4, 5, 6], |v| 3.6 * v),
        args: "replay csv --header header.toml --unit tactical",
        printed: &["warning: 'gnss.velocity.unit'", "| device "],
        code: 0,
    },
];

/// A page as one line.
fn words(page: &str) -> String {
    page.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn promises_of_the_pages_are_kept() {
    let session = drive();
    let mut wrong = Vec::new();
    for promise in PROMISES {
        let sentence = words(promise.sentence);
        let (page, small) = (words(promise.page), words(promise.page).to_lowercase());
        if !page.contains(&sentence) && !small.contains(&sentence.to_lowercase()) {
            wrong.push(format!("no page says: {sentence}"));
        }
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        csv(dir, &session, true);
        euroc(dir, &session);
        host_sim(
            dir,
            "convert csv --header header.toml --to kf-gins --velocity --out k",
        )
        .success();
        (promise.make)(dir);
        let out = host_sim(dir, promise.args);
        let output = out.get_output();
        let printed = [&output.stdout[..], &output.stderr].concat();
        let printed = String::from_utf8_lossy(&printed).into_owned();
        let has_all = promise.printed.iter().all(|part| printed.contains(part));
        if output.status.code() != Some(promise.code) || !has_all || printed.contains("panicked") {
            wrong.push(format!("{sentence}: {:?}: {printed}", output.status));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
