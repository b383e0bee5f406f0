//! Runs of the default scenario over many seeds: docs/figures/drive.csv, and the table of README.md
//! that is made from it.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use qemu::committed::Committed;
use qemu::images::target_directory;
use serde::Deserialize;

use super::measured::committed;
use crate::stage::{cargo_with, succeed};
use crate::table::markdown;

/// Seeds of the default scenario, from 1 on.
const SEEDS: u32 = 60;
const DRIVE: [&str; 4] = ["seed", "t_min", "scheme", "horizontal_m"];
/// Schemes of the table, and their names in its header.
const SCHEMES: [(&str, &str); 3] = [
    ("raw", "`raw`: as measured"),
    ("ls-bias", "`ls-bias`: constant bias"),
    ("rnn", "`rnn`: the networks"),
];
/// The used part of `--json` of `host-sim run`.
#[derive(Deserialize)]
struct Run {
    rows: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    t_s: u32,
    scheme: String,
    horizontal_m: f64,
}

/// Runs all seeds.
fn simulate() -> Result<Vec<(u32, Run)>> {
    succeed(&mut cargo_with("build --quiet --release --bin host-sim"))?;
    let target = target_directory()?;
    let folder = target.join("figures");
    fs::create_dir_all(&folder)?;
    let json = folder.join("drive.json");
    let mut runs = Vec::new();
    for seed in 1..=SEEDS {
        eprint!("\rseed {seed} of {SEEDS}");
        let mut run = Command::new(target.join("release/host-sim"));
        run.args(["run", "--seed", &seed.to_string(), "--json"])
            .arg(&json)
            .arg("--out")
            .arg(folder.join("drive"))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        succeed(&mut run)?;
        runs.push((seed, serde_json::from_str(&fs::read_to_string(&json)?)?));
    }
    eprintln!();
    Ok(runs)
}

/// Simulates all seeds of the default scenario and writes the errors.
pub fn runs() -> Result<()> {
    let mut rows = Vec::new();
    for (seed, run) in simulate()? {
        rows.extend(run.rows.into_iter().map(|row| {
            let (minutes, scheme) = ((row.t_s / 60).to_string(), row.scheme.replace(',', ""));
            let metres = format!("{:.3}", row.horizontal_m);
            vec![seed.to_string(), minutes, scheme, metres]
        }));
    }
    committed("drive", "runs", &DRIVE, rows).write()
}

/// Errors by minute and scheme, in the order of the seeds.
type Errors = BTreeMap<u32, BTreeMap<String, Vec<f64>>>;

fn errors(of: &Committed) -> Result<Errors> {
    ensure!(of.header == DRIVE, "the header is not {DRIVE:?}");
    let mut errors = Errors::new();
    for row in &of.rows {
        let by_scheme = errors.entry(row[1].parse()?).or_default();
        let metres = by_scheme.entry(row[2].clone()).or_default();
        metres.push(row[3].parse()?);
    }
    Ok(errors)
}

/// The table of README.md.
pub fn drive_table(of: &Committed) -> Result<String> {
    let errors = errors(of)?;
    let mut header = vec!["min".to_owned()];
    header.extend(SCHEMES.map(|(_, title)| title.to_owned()));
    let mut rows = Vec::new();
    for (minutes, schemes) in &errors {
        let mut row = vec![minutes.to_string()];
        for (name, _) in SCHEMES {
            let of = schemes.get(name).with_context(|| name.to_owned())?;
            row.push(summary(of));
        }
        rows.push(row);
    }
    let (_, last) = errors.last_key_value().context("no errors")?;
    let better = last["rnn"].iter().zip(&last["ls-bias"]);
    let better = better.filter(|(rnn, bias)| rnn < bias).count();
    Ok(format!(
        "{}\nThe networks beat `ls-bias` in {better} of the {} runs.\n",
        markdown(&header, rows.into_iter()),
        last["rnn"].len()
    ))
}

/// Median, mean and worst.
fn summary(errors: &[f64]) -> String {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let median = f64::midpoint(sorted[(n - 1) / 2], sorted[n / 2]);
    let mean = sorted.iter().sum::<f64>() / n as f64;
    format!("{median:.0} / {mean:.0} / {:.0}", sorted[n - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(name: &str, header: &[&str], lines: &str) -> Committed {
        let text = format!("# by hand\n{}\n{lines}", header.join(","));
        Committed::parse(name, &text).expect("a table")
    }

    #[test]
    fn the_table_is_of_all_seeds() {
        let mut lines = String::new();
        for (seed, [raw, bias, rnn]) in [[4.0, 3.0, 1.0], [6.0, 2.0, 5.0], [100.0, 9.0, 8.0]]
            .iter()
            .enumerate()
        {
            for (scheme, metres) in [("raw", raw), ("ls-bias", bias), ("rnn", rnn)] {
                lines += &format!("{seed},5,{scheme},{metres}\n");
            }
        }
        let text = drive_table(&parsed("drive", &DRIVE, &lines)).expect("a table");
        assert!(
            text.contains("| 5 | 6 / 37 / 100 | 3 / 5 / 9 | 5 / 5 / 8 |"),
            "{text}"
        );
        assert!(text.contains("in 2 of the 3 runs"), "{text}");
        assert!(drive_table(&parsed("drive", &["seed"], "1\n")).is_err());
        assert!(drive_table(&parsed("drive", &DRIVE, "")).is_err());
        assert_eq!(summary(&[1.0, 2.0]), "2 / 2 / 2");
    }
}
