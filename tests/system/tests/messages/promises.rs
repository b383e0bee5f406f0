//! Sentences of the pages that promise something of files and have no test elsewhere: each stands
//! in its page, and the program keeps it.

use super::host_sim;
use super::tried::edits::{fixes, gpsd, gzip, header, lines, scaled, text, write};
use crate::writers::{csv, drive, euroc};
use std::path::Path;

const YOUR_DATA: &str = include_str!("../../../../docs/your-data.md");
const USING: &str = include_str!("../../../../docs/USING.md");

const CSV: &str = "convert csv --header header.toml --to csv --out o";
const BESIDE: &str = "convert csv --header header.toml --fixes x.json --to csv --out o";

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
        printed: &["estimated: -1.99"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "the ground truth is thinned to fixes (`--fix-interval-s`, default 1,",
        make: |_| (),
        args: "convert euroc . --fix-interval-s 2 --to csv --out o",
        printed: &["35\u{a0}999 samples, 181 fixes"],
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
        printed: &["35\u{a0}999 samples, 361 fixes"],
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
        printed: &["35\u{a0}999 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "A key that is not in this table is refused.",
        make: |dir| header(dir, "[gnss]\n", "[gnss]\nantenna = 'roof'\n"),
        args: CSV,
        printed: &["antenna"],
        code: 2,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "Rates above 35 rad/s, accelerations above 1000 m/s\u{b2} and times that do not rise \
                   end the command.",
        make: |dir| scaled(dir, &[3], 1e6),
        args: CSV,
        printed: &["imu.csv:", "'gz'", "the limit is 35 rad/s"],
        code: 2,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "plain or packed (gzip, zstd), relative to the header",
        make: |dir| gzip(dir, "imu.csv", 1.0),
        args: CSV,
        printed: &["35\u{a0}999 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "one character, `tab` or `blank`; whether a line names the columns (else `\"1\"`, \
                   `\"2\"`, ...)",
        make: |dir| {
            text(dir, "imu.csv", |old| {
                let (_, rest) = old.split_once('\n').unwrap();
                rest.replace(',', "\t")
            });
            text(dir, "header.toml", |old| {
                let named = "[imu]\nseparator = 'tab'\nnames = false\n";
                let numbered = old.replace("'gx', 'gy', 'gz'", "'2', '3', '4'");
                let numbered = numbered.replace("'ax', 'ay', 'az'", "'5', '6', '7'");
                let numbered = numbered.replacen("column = 't'", "column = '1'", 1);
                numbered.replacen("[imu]\n", named, 1)
            });
        },
        args: CSV,
        printed: &["35\u{a0}999 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "three columns, or the two horizontal ones",
        make: |dir| header(dir, "'vn', 've', 'vd'", "'vn', 've'"),
        args: CSV,
        printed: &["35\u{a0}999 samples, 361 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "only lines with such values hold a fix",
        make: |dir| {
            text(dir, "gnss.csv", |old| {
                old.replacen("vd\n", "vd,quality\n", 1)
            });
            lines(dir, "gnss.csv", |k, cells| cells.push(k.to_string()));
            let valid = "[gnss]\nvalid = [{ column = 'quality', least = 10, most = 300 }]\n";
            header(dir, "[gnss]\n", valid);
        },
        args: CSV,
        printed: &["35\u{a0}999 samples, 291 fixes"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "seconds at rest from the first fix on, 90 s to a week",
        make: |dir| {
            text(dir, "header.toml", |old| {
                let rest = old.lines().filter(|line| !line.starts_with("standstill_s"));
                let rest: String = rest.map(|line| format!("{line}\n")).collect();
                rest.replace("[start]\n", "") + "[start]\nstandstill_s = 60\n"
            });
        },
        args: "replay csv --header header.toml --unit tactical",
        printed: &["standstill_s", "90"],
        code: 2,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "`mode` 0 and 1; `mode` 2 has no height.",
        make: |dir| {
            write(
                dir,
                "x.json",
                &gpsd(dir).replace("\"mode\":3", "\"mode\":2"),
            );
        },
        args: "convert csv --header header.toml --fixes x.json --to kf-gins --out o",
        printed: &["361 of 361 fixes lack position, height"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "`alt` or `altMSL` alone count as above the ellipsoid, with a note",
        make: |dir| write(dir, "x.json", &gpsd(dir).replace("altHAE", "altMSL")),
        args: BESIDE,
        printed: &[
            "361 fixes (gpsd)",
            "heights are not said to be above the ellipsoid",
        ],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "With several receivers the one with the most fixes counts",
        make: |dir| {
            let all = gpsd(dir);
            let of =
                |name: &str| all.replace("\"mode\"", &format!("\"device\":\"{name}\",\"mode\""));
            let few: String = of("b")
                .lines()
                .take(20)
                .map(|line| format!("{line}\n"))
                .collect();
            write(dir, "x.json", &(few + &of("a")));
        },
        args: BESIDE,
        printed: &[
            "361 fixes (gpsd)",
            "2 receivers are in the log; 'a' is used",
        ],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "What `gpspipe -r` writes is read as the sentences that it holds.",
        make: |dir| {
            let report = "{\"class\":\"VERSION\",\"release\":\"3.25\"}\n";
            let rmc = "$GPRMC,000101.00,A,4550.0,N,00543.0,E,,,,,*35\r\n";
            write(dir, "x.json", &(report.to_owned() + rmc));
        },
        args: BESIDE,
        printed: &["1 fix (NMEA)"],
        code: 0,
    },
    Promise {
        page: YOUR_DATA,
        sentence: "A log without a fix is refused, and the message lists what is in it.",
        make: |dir| {
            let tsip = [0x10, 0x46, 0, 0, 0x10, 3].repeat(50);
            std::fs::write(dir.join("x.json"), tsip).unwrap();
        },
        args: BESIDE,
        printed: &["has no fix; seen are TSIP (Trimble): 50 messages, not read"],
        code: 2,
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
