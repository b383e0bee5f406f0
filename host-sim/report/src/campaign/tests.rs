//! The page of artificial campaigns.

use super::{Origin, document};
use crate::document::Document;
use host_core::error::Error;
use host_core::simulator::imu::ErrorModelName;
use host_core::simulator::imu::world::StartName;
use host_lab::campaign::Merged;
use host_lab::campaign::{Row, SCHEMES, Topic, Tuning, ratios, summarise};
use host_lab::experiment::run::TIMES_MIN;

fn row(group: ErrorModelName, run: u32, scheme: &str, drives: u32, m: f64) -> Row {
    Row {
        error_model: group.into(),
        run,
        scheme: scheme.into(),
        horizontal_m: [m; TIMES_MIN.len()],
        north_m: [m; TIMES_MIN.len()],
        east_m: [0.0; TIMES_MIN.len()],
        start: StartName::Cold,
        drives,
    }
}

fn page_of(rows: Vec<Row>, drives: &[u32]) -> Result<Document, Error> {
    page_with(rows, drives, &[])
}

fn page_with(
    rows: Vec<Row>,
    drives: &[u32],
    studied: &[(Topic, Vec<Row>)],
) -> Result<Document, Error> {
    let cold = StartName::Cold;
    let (summary, paired) = (summarise(&rows, cold), ratios(&rows, cold));
    let mut tuning = Tuning::default();
    tuning.setting.drives = drives.to_vec();
    let merged = Merged {
        rows,
        tuning,
        fingerprint: "x".into(),
    };
    let made = Origin {
        commands: vec!["host-sim campaign".into()],
    };
    document(&merged, &summary, &paired, studied, &made)
}

/// Nine runs of two groups. The sign test decides if eight agree. The device halves the errors of
/// one group, except in one run, and changes nothing in the other. There each classical filter is
/// three times worse than none.
fn rows(drives: u32) -> Vec<Row> {
    let mut rows = vec![];
    for run in 0..9_u32 {
        for group in [ErrorModelName::Noise, ErrorModelName::All] {
            let noise = group == ErrorModelName::Noise;
            for (scheme, _) in SCHEMES {
                let m = match (scheme, noise) {
                    ("uncorrected", _) | ("device", true) => 100.0,
                    ("device", false) if run == 3 => 250.0,
                    ("oracle" | "limit", _) => 10.0,
                    (_, true) => 300.0,
                    (_, false) => 50.0,
                };
                rows.push(row(group, run, scheme, drives, m));
            }
        }
    }
    rows
}

#[test]
fn the_verdict_comes_first_and_counts_the_harm() {
    let document = page_of(rows(0), &[0]).unwrap();
    let verdict = document.verdict();
    assert_eq!(
        verdict[0],
        "Verdict: the device helps by 29 %: the error after 22 min without fixes is 0.71 times the \
         uncorrected one (median of 9 runs, 95 % interval 0.71 to 0.71; worse in 1 of 18 \
         comparisons)."
    );
    assert_eq!(
        verdict[1],
        "The device is worse than no correction in: all 1 of 9 runs (at worst 2.50 times the \
         uncorrected error)."
    );
    // 33 schemes less none, the device, two that cannot be built and twelve with a memory
    assert!(
        verdict[2].contains("noise: 17 of 17, most of all "),
        "{verdict:?}"
    );
    let page = document.page().unwrap();
    let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("no {part}"));
    assert!(
        at("\"verdict\">Verdict: ") < at("Errors: noise")
            && at("Errors: noise") < at("Errors: all")
    );
    assert!(page.contains("1 of 9") && page.contains("host-sim campaign</pre>"));
    // on the first screen, of both groups and of all: a picture each, and one for a telephone
    assert_eq!(page.matches("<svg").count(), 2 * (1 + 3));
    let first = at("<figure");
    for later in ["<details", "<table", "<nav", "<h2"] {
        assert!(
            first < at(later) && at("<ul class=\"big\">") < at(later),
            "{later}"
        );
    }
    assert!(at("class=\"verdict\"") < first);
    for outside in ["<script", "<link", "<img", "url(", "@import", "src="] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(!page.contains("memory-frozen"), "before the first drive");
    assert!(page.len() < 1_000_000, "{}", page.len());
}

#[test]
fn small_quotients_keep_two_figures() {
    let of = [0.00174, 0.05, 0.5, 1.0, 2.345, 12.3, 0.0].map(super::quotient);
    assert_eq!(
        of,
        ["0.0017", "0.050", "0.50", "1.00", "2.35", "12", "0.00"]
    );
}

#[test]
fn a_device_that_does_harm_is_named_in_the_first_words() {
    let mut rows = rows(0);
    for row in &mut rows {
        let harmed = row.scheme == "device" && row.error_model == ErrorModelName::Noise.into();
        if harmed {
            row.horizontal_m = [120.0; TIMES_MIN.len()];
        }
    }
    let document = page_of(rows, &[0]).unwrap();
    let first = &document.verdict()[0];
    assert!(
        first
            .starts_with("Verdict: the device harms in 1 of 2 groups of errors: noise (1.20 times"),
        "{first}"
    );
}

#[test]
fn every_scheme_is_explained_where_it_stands_and_in_the_list() {
    let page = page_of(rows(4), &[4]).unwrap().page().unwrap();
    let page = page.replace('\u{2011}', "-");
    for (scheme, _) in SCHEMES.iter().filter(|(name, _)| *name != "uncorrected") {
        let rows = page
            .matches(&format!("<summary>{scheme}</summary>"))
            .count();
        assert_eq!(rows, 3, "{scheme}");
        assert!(
            page.contains(&format!("<td class=\"text\">{scheme}</td>")),
            "{scheme}"
        );
    }
}

#[test]
fn numbers_of_earlier_drives_stand_apart_and_gaps_are_reported() {
    let mut all = rows(0);
    all.extend(rows(4));
    all.retain(|row| row.run != 2);
    let document = page_of(all, &[0, 4]).unwrap();
    let verdict = document.verdict().join("\n");
    assert!(
        verdict.starts_with("Verdict after 4 earlier drives: "),
        "{verdict}"
    );
    assert!(verdict.contains("not the whole campaign: 2."), "{verdict}");
    let page = document.page().unwrap();
    assert!(page.contains("id=\"noise-0\"") && page.contains("id=\"noise-4\""));
}

#[test]
fn without_none_there_is_no_page() {
    let mut rows = rows(0);
    rows.retain(|row| row.scheme != "uncorrected");
    let error = page_of(rows, &[0]).unwrap_err().to_string();
    assert!(
        error.contains("--report") && error.contains("remedy"),
        "{error}"
    );
}

/// A study in which the device does harm: the verdict reports it, and its table marks it.
#[test]
fn the_harm_of_a_study_is_in_the_verdict_and_in_its_part() {
    let harmful = |row: &Row| {
        let mut row = row.clone();
        if row.scheme == "device" && row.error_model == ErrorModelName::Noise.into() {
            row.horizontal_m = row.horizontal_m.map(|m| 3.0 * m);
        }
        row
    };
    let study = |change: &dyn Fn(&Row) -> Row| rows(0).iter().map(change).collect::<Vec<Row>>();
    let studied = [
        (Topic::Vehicle("train"), study(&harmful)),
        (Topic::Start("hot"), study(&Row::clone)),
    ];
    let document = page_with(rows(0), &[0], &studied).unwrap();
    let harm = "Harm in the studies below: in 1 of 4 groups of errors the device makes it worse in \
                most runs, vehicle train: noise (3.00 times); in single runs it is worse than no \
                correction in 11 of 36 comparisons.";
    assert!(
        document.verdict().contains(&harm.to_owned()),
        "{:#?}",
        document.verdict()
    );
    let page = document.page().unwrap();
    assert!(page.contains("id=\"study-vehicle-train\"><h2>Study: vehicle train</h2>"));
    let table = page.split("id=\"study-vehicle-train\"").nth(1).unwrap();
    let row = table
        .split("<tr>")
        .find(|row| row.contains(">noise<"))
        .unwrap();
    assert!(
        row.contains("\u{25b2} worse") && row.contains(">9 of 9<"),
        "{row}"
    );
    let without = page_with(rows(0), &[0], &studied[1..]).unwrap();
    assert!(
        without
            .verdict()
            .iter()
            .any(|of| of.starts_with("In none of 2 groups of errors of the studies"))
    );
}
