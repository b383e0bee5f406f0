//! `docs/ABUSE.md`: its introduction agrees with its rows. The rows are read from the
//! page, since a run of all of them takes hours.

use super::*;
use std::collections::BTreeMap;
use std::path::Path;

/// The cells of the rows of the table below this heading.
fn rows<'a>(page: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let (_, rest) = page
        .split_once(&format!("\n### {heading}\n"))
        .unwrap_or_else(|| panic!("no heading `{heading}`"));
    let lines = rest.lines().skip_while(|line| !line.starts_with('|'));
    let table = lines.take_while(|line| line.starts_with('|')).skip(2);
    table
        .map(|line| {
            let inside = line.trim_matches('|').split('|');
            inside.map(|cell| cell.trim().trim_matches('`')).collect()
        })
        .collect()
}

/// Values of a row that are only in the lists of the page: the worst run, and the share of the
/// gain.
#[derive(Default)]
struct Listed {
    run: BTreeMap<[String; 4], u32>,
    gain: BTreeMap<[String; 4], f64>,
}

impl Listed {
    fn of(page: &str) -> Self {
        let key = |cells: &[&str]| [cells[0], cells[1], cells[2], cells[3]].map(str::to_owned);
        let harming = rows(page, "Rows that harm");
        let losing = rows(page, "Rows in which the gain does not come back");
        let per_cent = |text: &str| text.parse::<f64>().unwrap() / 100.0;
        Self {
            run: harming
                .iter()
                .map(|of| (key(of), of[7].parse().unwrap()))
                .collect(),
            gain: losing.iter().map(|of| (key(of), per_cent(of[4]))).collect(),
        }
    }
}

fn share(text: &str) -> Option<f64> {
    let number = text.trim_end_matches('%').trim();
    (!number.is_empty()).then(|| number.parse::<f64>().unwrap() / 100.0)
}

/// A ratio. A bold one harms, even if its digits do not exceed the limit.
fn ratio(text: &str, limit: f64) -> f64 {
    let value: f64 = text.trim_matches('*').parse().unwrap();
    let bold = text.starts_with('*');
    if bold && value <= limit && limit - value < 0.005 {
        limit + 1e-9
    } else {
        value
    }
}

/// The number of runs of the command that made the page.
fn runs(page: &str) -> usize {
    let (_, after) = page.split_once(" --runs ").expect("the command");
    after.split_whitespace().next().unwrap().parse().unwrap()
}

/// The summaries of one table.
fn summaries(page: &str, activation: Activation, sensor: Sensor, listed: &Listed) -> Vec<Summary> {
    let runs = runs(page);
    let mut all = Vec::new();
    for cells in rows(page, &format!("{activation}, {sensor}")) {
        for (at, &computer) in Computer::ALL.iter().enumerate() {
            let [raw, corrected, median, worst] = [3, 4, 5, 6].map(|column| cells[column + 4 * at]);
            let case = cells[0].to_owned();
            let key = [&case, activation.name(), sensor.name(), computer.name()].map(str::to_owned);
            let least = share(cells[15]).filter(|gain| *gain >= 0.8);
            all.push(Summary {
                sensor,
                computer,
                activation,
                runs,
                raw_median_m: raw.parse().unwrap(),
                corrected_median_m: corrected.parse().unwrap(),
                ratio_median: ratio(median, LIMITS[0]),
                ratio_of_runs_median: f64::NAN,
                ratio_worst: ratio(worst, LIMITS[1]),
                ratio_worst_run: listed.run.get(&key).copied().unwrap_or(0),
                promoted_share: share(cells[1]).unwrap(),
                rolled_back_share: share(cells[2]).unwrap(),
                gain_kept: listed.gain.get(&key).copied().or(least),
                faults: 0,
                case,
            });
        }
    }
    all
}

#[test]
fn the_page_says_what_its_rows_say() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/ABUSE.md");
    let page = std::fs::read_to_string(path).unwrap();
    let listed = Listed::of(&page);
    let mut all = Vec::new();
    for sensor in [Sensor::Perfect, Sensor::Errors] {
        for activation in [Activation::Live, Activation::NextPowerOn] {
            all.extend(summaries(&page, activation, sensor, &listed));
        }
    }
    let cases = chosen(&[]).unwrap();
    let position = |of: &Summary| cases.iter().position(|case| case.name() == of.case);
    all.sort_by_key(|of| (of.sensor, of.activation, of.computer, position(of)));
    let command = page
        .lines()
        .find_map(|line| line.strip_prefix("    cargo run"));
    let command = format!("cargo run{}", command.expect("the command"));
    let right = markdown(&command, &Times::default(), &all);
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
