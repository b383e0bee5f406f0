//! `docs/ABUSE.md` is what its rows, `docs/ABUSE.csv`, give: a run of all of them takes hours.

use super::*;
use std::path::Path;

fn page(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    std::fs::read_to_string(path.join(name)).unwrap()
}

/// A row of the file.
fn summary(row: &csv::StringRecord) -> Summary {
    let number = |column: usize| row[column].parse::<f64>().unwrap();
    // a row that harms, although its rounded ratios do not exceed the limits
    let rounded = &row[13] == "1" && number(7) <= LIMITS[0] && number(8) <= LIMITS[1];
    // the metres say on which side of the limit a rounded ratio is
    let near_gain = (number(7) - 1.0 / LIMITS[0]).abs() < 0.005;
    let ratio_median = if near_gain {
        number(6) / number(5)
    } else {
        number(7)
    };
    Summary {
        case: row[0].to_owned(),
        activation: row[1].parse().unwrap(),
        sensor: row[2].parse().unwrap(),
        computer: row[3].parse().unwrap(),
        runs: row[4].parse().unwrap(),
        raw_median_m: number(5),
        corrected_median_m: number(6),
        ratio_median,
        ratio_of_runs_median: f64::NAN,
        ratio_worst: if rounded { LIMITS[1] + 1e-9 } else { number(8) },
        ratio_worst_run: row[9].parse().unwrap_or(0),
        runs_worse: row[14].parse().unwrap(),
        promoted_share: number(10),
        rolled_back_share: number(11),
        gain_kept: row[12].parse().ok(),
        faults: 0,
    }
}

#[test]
fn the_page_says_what_its_rows_say() {
    let [page, rows] = ["ABUSE.md", "ABUSE.csv"].map(page);
    let mut rows = csv::Reader::from_reader(rows.as_bytes());
    let all: Vec<Summary> = rows.records().map(|row| summary(&row.unwrap())).collect();
    assert!(all.len() > 1000, "{}", all.len());
    let command = page
        .lines()
        .find_map(|line| line.strip_prefix("    cargo run"));
    let command = format!("cargo run{}", command.expect("the command"));
    let version = page
        .split_once("(version ")
        .and_then(|(_, rest)| rest.split_once(')'));
    let (version, _) = version.expect("the version");
    let right = markdown((&command, version), "ABUSE.csv", &Times::default(), &all);
    if page == right {
        return;
    }
    let mut builder = tempfile::Builder::new();
    let remedy = builder.prefix("ABUSE-").suffix(".md").tempfile().unwrap();
    let (_, remedy) = remedy.keep().unwrap();
    std::fs::write(&remedy, &right).unwrap();
    let remedy = remedy.display();
    for (line, (written, right)) in (1..).zip(page.lines().zip(right.lines())) {
        assert_eq!(
            written, right,
            "docs/ABUSE.md:{line}; as it should be: {remedy}"
        );
    }
    panic!("docs/ABUSE.md has other lines at its end; as it should be: {remedy}");
}

/// The file that is written has the columns that are read here.
#[test]
fn written_rows_are_read_back() {
    let rows = page("ABUSE.csv");
    let mut read = csv::Reader::from_reader(rows.as_bytes());
    let all: Vec<Summary> = read.records().map(|row| summary(&row.unwrap())).collect();
    let again = super::csv(&all);
    let mut again = csv::Reader::from_reader(again.as_bytes());
    assert_eq!(again.headers().unwrap(), read.headers().unwrap());
    for (row, of) in again.records().zip(&all) {
        let row = summary(&row.unwrap());
        assert_eq!(
            (row.case.as_str(), row.harms()),
            (of.case.as_str(), of.harms())
        );
        assert_eq!(row.gain_kept, of.gain_kept);
    }
}
