//! `host-sim report`: the page, the PDF and the JSON of one unit, held against the commands that
//! give its parts alone, against errors that the test itself put into the samples, and against
//! what a recording lacks.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use assert_cmd::Command;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use system::{data_dir, host_sim_binary, json};

fn host_sim(dir: &Path, args: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(host_sim_binary())
        .current_dir(dir)
        .args(args)
        .assert()
}

fn run(dir: &Path, args: &[&str]) -> String {
    let done = host_sim(dir, args).success();
    String::from_utf8(done.get_output().stdout.clone()).unwrap()
}

/// The message of a command that fails.
fn complaint(dir: &Path, args: &[&str]) -> String {
    let done = host_sim(dir, args).code(2);
    let text = String::from_utf8_lossy(&done.get_output().stderr).into_owned();
    assert!(
        !text.contains("panicked") && text.contains("remedy"),
        "{args:?}: {text}"
    );
    text
}

/// A report of `from`, as data.
fn report(dir: &Path, from: &str) -> Value {
    let args = ["report", "--unit", "d/unit.toml", "--from", from];
    run(
        dir,
        &[&args[..], &["--json", "r.json", "--out", "r"]].concat(),
    );
    json(&dir.join("r.json"))
}

fn part<'v>(report: &'v Value, id: &str) -> &'v Value {
    let parts = report["parts"].as_array().unwrap();
    let hit = parts.iter().find(|part| part["id"] == id);
    hit.unwrap_or_else(|| panic!("no part '{id}'"))
}

/// Why a part is left out.
fn left_out(report: &Value, id: &str) -> String {
    let why = part(report, id)["left_out"].as_str();
    why.unwrap_or_else(|| panic!("'{id}' is there")).to_owned()
}

/// A drive of `drive_s` seconds after 120 s of standstill, in `d`.
fn drive(dir: &Path, drive_s: u32, more: &[&str]) {
    let text = format!("unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = {drive_s}\n");
    std::fs::write(dir.join("s.toml"), text).unwrap();
    let args = [
        "simulate",
        "--scenario",
        "s.toml",
        "--learning",
        "--out",
        "d",
    ];
    run(dir, &[&args[..], more].concat());
}

/// The lines of a file that `keep` keeps, by their numbers.
fn cut(file: &Path, keep: impl Fn(usize) -> bool) {
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text
        .lines()
        .enumerate()
        .filter(|(k, _)| *k == 0 || keep(*k));
    let kept: Vec<&str> = lines.map(|(_, line)| line).collect();
    std::fs::write(file, kept.join("\n") + "\n").unwrap();
}

/// The text of the PDF as poppler reads it; `None` where that is not installed.
fn pdf_text(file: &Path) -> Option<String> {
    let read = std::process::Command::new("pdftotext")
        .arg("-layout")
        .arg(file)
        .arg("-")
        .output();
    match read {
        Ok(read) => {
            assert!(read.status.success() && read.stderr.is_empty(), "{read:?}");
            Some(String::from_utf8(read.stdout).unwrap())
        }
        Err(_) => {
            println!("skipped: the PDF's text, because pdftotext is missing (poppler-utils)");
            None
        }
    }
}

/// Whether all elements of a page end where they should.
fn well_formed(page: &str) -> Result<(), String> {
    const VOID: [&str; 3] = ["meta", "br", "link"];
    let (mut open, mut rest) = (vec![], page);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let Some(end) = rest.find('>') else {
            return Err(rest.to_owned());
        };
        let (tag, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        let name = tag
            .trim_start_matches('/')
            .split([' ', '\n', '/'])
            .next()
            .unwrap();
        if tag.starts_with('!') || tag.ends_with('/') || VOID.contains(&name) {
            continue;
        }
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return Err(format!("</{name}> ends nothing"));
            }
            continue;
        }
        if ["script", "style"].contains(&name) {
            let close = format!("</{name}>");
            let Some(at) = rest.find(&close) else {
                return Err(close);
            };
            rest = &rest[at + close.len()..];
            continue;
        }
        open.push(name);
    }
    if open.is_empty() {
        Ok(())
    } else {
        Err(format!("{open:?} never end"))
    }
}

/// Every number of the report is that of the command that it names, and page, PDF and JSON have
/// the same sentences.
#[test]
fn a_drive_is_reported_with_the_figures_of_the_single_commands() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 420, &[]);
    let report_ = report(dir, "d");
    let page = std::fs::read_to_string(dir.join("r/index.html")).unwrap();
    run(
        dir,
        &[
            "replay",
            "csv",
            "--header",
            "d/header.toml",
            "--json",
            "replay.json",
        ],
    );
    assert_eq!(
        part(&report_, "navigation")["data"],
        json(&dir.join("replay.json"))
    );
    let learnable = [
        "learnability",
        "--unit",
        "d/unit.toml",
        "--units",
        "0",
        "--minutes",
        "6",
    ];
    run(dir, &[&learnable[..], &["--json", "l.json"]].concat());
    assert_eq!(
        part(&report_, "learnable")["data"],
        json(&dir.join("l.json"))
    );
    let commands = part(&report_, "made")["commands"].to_string();
    assert!(commands.contains("--units 0 --minutes 6") && commands.contains("replay csv --header"));
    // the standstill alone: samples at times up to 120 s are the first 12 000 lines
    cut(&dir.join("d/imu.csv"), |k| k <= 12_000);
    run(dir, &["allan", "d/imu.csv", "--json", "a.json"]);
    let noise = &part(&report_, "noise")["data"]["analyses"];
    assert_eq!(*noise, json(&dir.join("a.json"))["analyses"]);
    assert!(!noise.as_array().unwrap().is_empty());
    // rehearsals, weights, learnt errors and bound are there
    let rehearsed = &part(&report_, "rehearsals")["data"][0];
    assert!(rehearsed["fixes"].as_u64().unwrap() > 100, "{rehearsed}");
    assert!(
        part(&report_, "learnt")["data"][0]["rows"]
            .as_array()
            .unwrap()
            .len()
            > 10
    );
    let learnt = part(&report_, "learnt")["figures"].to_string();
    assert!(learnt.contains("against temperature"));
    assert!(
        part(&report_, "bound")["data"][0]["metres"][4]
            .as_u64()
            .unwrap()
            > 0
    );
    let files = part(&report_, "identity")["data"]["files"].to_string();
    for name in [
        "d/header.toml",
        "d/imu.csv",
        "d/gnss.csv",
        "d/unit.toml",
        "d/temperature.csv",
    ] {
        assert!(files.contains(name), "{name}: {files}");
    }
    looks_right(&report_, &page, &dir.join("r/report.pdf"));
}

/// Page and PDF: whole, alone, and with the verdict and the numbers of the JSON.
fn looks_right(report: &Value, page: &str, pdf: &Path) {
    well_formed(page).unwrap();
    let outside = ["<link", "<img", " src=", "@import", "url(http", "fetch("];
    assert!(outside.iter().all(|what| !page.contains(what)));
    let addresses =
        page.matches("http").count() - page.matches("http://www.w3.org/2000/svg").count();
    assert_eq!(addresses, 0, "only the name space of SVG is an address");
    let verdict = report["verdict"].as_array().unwrap();
    assert!(verdict[0].as_str().unwrap().starts_with("Verdict: "));
    let flat = |text: &str| {
        text.replace(['\u{2011}', '\u{2212}'], "-")
            .replace('\u{a0}', " ")
    };
    let page = flat(page);
    for sentence in verdict {
        let sentence = flat(sentence.as_str().unwrap()).replace('"', "&quot;");
        assert!(page.contains(&sentence), "{sentence}");
    }
    let bytes = std::fs::read(pdf).unwrap();
    assert!(bytes.starts_with(b"%PDF-1.7") && bytes.trim_ascii_end().ends_with(b"%%EOF"));
    let Some(text) = pdf_text(pdf) else { return };
    let text = flat(&text).split_whitespace().collect::<Vec<_>>().join(" ");
    for row in report["parts"].as_array().unwrap().iter().flat_map(|part| {
        let tables = part["tables"].as_array().unwrap().iter();
        tables
            .flat_map(|table| table["rows"].as_array().unwrap())
            .take(4)
    }) {
        let number = flat(row[row.as_array().unwrap().len() - 1].as_str().unwrap());
        let word = number.split(' ').next().unwrap();
        assert!(word.len() > 60 || text.contains(word), "{number}");
    }
    assert!(text.contains(&flat(verdict[0].as_str().unwrap())), "{text}");
    assert!(text.contains("page 1 of"), "numbers of pages");
    for part in report["parts"].as_array().unwrap() {
        let title = part["title"].as_str().unwrap();
        // among the contents, and above the part
        assert!(text.matches(title).count() >= 2, "{title}");
    }
}

/// An error that the test adds to the samples is what is learnt more, and the same recording gives
/// the same bytes.
#[test]
fn an_added_error_is_found_and_the_same_recording_gives_the_same_bytes() {
    const UG: f64 = 9.806_65e-6;
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 300, &[]);
    let z = |report: &Value| {
        let rows = part(report, "learnt")["data"][0]["rows"]
            .as_array()
            .unwrap();
        rows.last().unwrap()["error_and_sigma"][5][0]
            .as_f64()
            .unwrap()
    };
    let before = z(&report(dir, "d/header.toml"));
    let files = ["index.html", "report.pdf", "weights.bin"];
    let bytes = || files.map(|name| std::fs::read(dir.join("r").join(name)).unwrap());
    let once = bytes();
    report(dir, "d/header.toml");
    assert!(once == bytes(), "the same recording, and other bytes");
    let imu = dir.join("d/imu.csv");
    let text = std::fs::read_to_string(&imu).unwrap();
    let added_ug = 400.0;
    let mut changed = String::new();
    for (k, line) in text.lines().enumerate() {
        let (most, last) = line.rsplit_once(',').unwrap();
        match k {
            0 => writeln!(changed, "{line}").unwrap(),
            _ => {
                let dv: f64 = last.parse().unwrap();
                writeln!(changed, "{most},{}", dv + added_ug * UG * 0.01).unwrap();
            }
        }
    }
    std::fs::write(&imu, changed).unwrap();
    let found = z(&report(dir, "d/header.toml")) - before;
    println!("added {added_ug} ug, learnt {found:.1} ug more");
    assert!((found / added_ug - 1.0).abs() < 0.1, "{found}");
    assert!(once != bytes());
}

/// Noise at rest: the datasheet that simulated the samples lies within the interval of each white
/// noise, and a datasheet of half as much does not.
#[test]
fn noise_at_rest_is_compared_with_the_datasheet() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let preset = "../../host-sim/assets/units/tactical.toml";
    let preset = Path::new(env!("CARGO_MANIFEST_DIR")).join(preset);
    let unit = std::fs::read_to_string(preset).unwrap();
    drive(dir, 1200, &["--vehicle", "standing"]);
    let rest = report(dir, "d");
    let source = part(&rest, "noise")["data"]["source"]
        .as_str()
        .unwrap()
        .to_owned();
    assert!(source.contains("at rest throughout"), "{source}");
    run(dir, &["allan", "d/imu.csv", "--json", "a.json"]);
    let analyses = &part(&rest, "noise")["data"]["analyses"];
    assert_eq!(*analyses, json(&dir.join("a.json"))["analyses"]);
    let told = part(&rest, "noise")["data"]["configured"][0][1]
        .as_f64()
        .unwrap();
    let table = toml::from_str::<toml::Table>(&unit).unwrap();
    let sheet = table["gyro"]["angle_random_walk_dpsqrth"]
        .as_float()
        .unwrap();
    assert!((told - sheet).abs() < 0.05 * sheet, "{told} {sheet}");
    let verdict = rest["verdict"].to_string();
    assert!(
        verdict.contains("White noise of the gyros") && verdict.contains("not above the 0.125")
    );
    // a better datasheet than the samples deserve
    let key = |name: &str, to: f64| {
        let file = dir.join("d/unit.toml");
        let mut unit = std::fs::read_to_string(&file)
            .unwrap()
            .parse::<toml::Table>()
            .unwrap();
        unit.remove("simulation");
        unit["gyro"][name] = to.into();
        std::fs::write(file, unit.to_string()).unwrap();
    };
    key("angle_random_walk_dpsqrth", 0.4 * sheet);
    let verdict = report(dir, "d")["verdict"].to_string();
    assert!(
        verdict.contains("White noise of the gyros: above the"),
        "{verdict}"
    );
}

/// What a recording lacks is said in a sentence of the part that needs it.
#[test]
fn each_part_says_why_it_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 300, &[]);
    let imu = dir.join("d/imu.csv");
    let whole = std::fs::read(&imu).unwrap();

    std::fs::remove_file(dir.join("d/temperature.csv")).unwrap();
    let without = report(dir, "d");
    let text = part(&without, "learnt")["sentences"].to_string();
    assert!(text.contains("Against temperature: left out"), "{text}");

    // 30 s of the 120 s standstill
    cut(&imu, |k| k <= 3000);
    let short = report(dir, "d");
    assert!(
        left_out(&short, "noise").contains("too short"),
        "{}",
        left_out(&short, "noise")
    );
    for id in ["navigation", "rehearsals", "learnt", "weights", "bound"] {
        assert!(
            left_out(&short, id).contains("30 s"),
            "{id}: {}",
            left_out(&short, id)
        );
    }
    let verdict = short["verdict"][0].as_str().unwrap();
    assert!(verdict.contains("is not known, because"), "{verdict}");

    // a gap of 2 s after 50 s of standstill
    std::fs::write(&imu, &whole).unwrap();
    cut(&imu, |k| !(5000..5200).contains(&k));
    let gap = report(dir, "d");
    assert!(
        left_out(&gap, "noise").contains("samples are missing"),
        "{}",
        left_out(&gap, "noise")
    );
    assert!(
        part(&gap, "identity")["data"]["source"]
            .to_string()
            .contains("the longest 2.01 s")
    );

    // samples alone: no fixes, no header
    std::fs::write(&imu, &whole).unwrap();
    let alone = report(dir, "d/imu.csv");
    assert!(left_out(&alone, "navigation").contains("samples alone"));
    assert!(
        !part(&alone, "noise")["data"]["analyses"]
            .as_array()
            .unwrap()
            .is_empty()
    );
    well_formed(&std::fs::read_to_string(dir.join("r/index.html")).unwrap()).unwrap();
}

/// Bad input ends with file, line or option, and a remedy, and leaves nothing.
#[test]
fn bad_input_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    drive(dir, 120, &[]);
    let fails = |from: &[&str], more: &[&str], says: &[&str]| {
        let args = [&["report", "--out", "x", "--from"], from, more].concat();
        let text = complaint(dir, &args);
        assert!(
            says.iter().all(|part| text.contains(part)),
            "{args:?}: {text}"
        );
        assert!(!dir.join("x").exists(), "{args:?}");
    };
    fails(&["none.mcap"], &[], &["none.mcap: no such file"]);
    std::fs::write(dir.join("odd.bin"), [7; 5000]).unwrap();
    fails(&["odd.bin"], &[], &["odd.bin", "no form that is known"]);
    std::fs::create_dir(dir.join("empty")).unwrap();
    fails(&["empty"], &[], &["empty", "without header.toml"]);
    fails(&["d"], &["--unit", "none"], &["no unit 'none'"]);
    fails(
        &["d"],
        &["--unit", "d/imu.csv.toml"],
        &["d/imu.csv.toml: no such file"],
    );
    fails(
        &["d"],
        &["--", "--no-such-option"],
        &["--no-such-option", "replay csv --help"],
    );
    fails(
        &["d"],
        &["--", "--learn-s", "9999"],
        &["--learn-s", "9999 s of a recording"],
    );
    fails(
        &["d/imu.csv"],
        &["--", "--learn-s", "60"],
        &["belongs to `replay`"],
    );
    fails(
        &["device:tcp:127.0.0.1:1"],
        &[],
        &["tcp:127.0.0.1:1", "does not connect"],
    );
    let long = "x".repeat(300);
    fails(&["d"], &["--date", &long], &["--date", "at most 200"]);
    let imu = dir.join("d/imu.csv");
    let text = std::fs::read_to_string(&imu).unwrap();
    let line = text.lines().nth(41).unwrap();
    let broken = line.replacen(',', ",oops", 1);
    std::fs::write(&imu, text.replace(line, &broken)).unwrap();
    fails(&["d"], &[], &["d/imu.csv:42", "oops"]);
    fails(&["d/imu.csv"], &[], &["d/imu.csv:42", "oops"]);
    std::fs::write(&imu, &text).unwrap();
    std::fs::write(dir.join("d/temperature.csv"), "t_s,x,y,z\n1,2,3\n").unwrap();
    fails(&["d"], &[], &["temperature.csv:2", "not four numbers"]);
    std::fs::create_dir(dir.join("mine")).unwrap();
    std::fs::write(dir.join("mine/notes.txt"), "keep me").unwrap();
    let args = ["report", "--from", "d/imu.csv", "--out", "mine"];
    assert!(complaint(dir, &args).contains("holds other files and no report of ours"));
}

/// Real recordings: harm is said where there is harm, and noise at rest is analysed.
#[test]
fn recorded_drives_and_a_unit_at_rest_are_reported() {
    let Some(data) = data_dir() else {
        return println!("skipped: no recorded data (LRNN_DATA)");
    };
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let at = |name: &str| {
        data.join(name)
            .canonicalize()
            .unwrap()
            .display()
            .to_string()
    };
    let drive = at("kitti-2011_09_30_drive_0034.csv.gz");
    let args = [
        "report", "--unit", "kitti", "--from", &drive, "--json", "k.json", "--out", "k",
    ];
    let said = run(dir, &args);
    assert!(said.starts_with("Verdict: harm."), "{said}");
    run(
        dir,
        &[
            "replay", "kitti", &drive, "--unit", "kitti", "--json", "o.json",
        ],
    );
    let drive = json(&dir.join("k.json"));
    assert_eq!(
        part(&drive, "navigation")["data"],
        json(&dir.join("o.json"))
    );
    assert!(
        said.contains("ends worse than no correction in 0"),
        "{said}"
    );
    let rest = at("lasergyro-static.csv.gz");
    let args = [
        "report", "--unit", "ld-a15", "--from", &rest, "--json", "g.json", "--out", "g",
    ];
    run(dir, &args);
    run(dir, &["allan", &rest, "--json", "a.json"]);
    let rest_ = json(&dir.join("g.json"));
    assert_eq!(
        part(&rest_, "noise")["data"]["analyses"],
        json(&dir.join("a.json"))["analyses"]
    );
    assert!(
        !part(&rest_, "navigation")["data"]
            .as_array()
            .unwrap()
            .is_empty()
    );
    let page = std::fs::read_to_string(dir.join("g/index.html")).unwrap();
    looks_right(&rest_, &page, &dir.join("g/report.pdf"));
}
