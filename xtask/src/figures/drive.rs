//! The table of the default scenario in README.md: made from docs/figures/drive.csv, which holds
//! the errors of each seed.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result, ensure};
use qemu::images::{target_directory, workspace};
use serde::Deserialize;

use crate::markers;
use crate::stage::{cargo_with, succeed};
use crate::table::markdown;

/// Seeds of the default scenario, from 1 on.
const SEEDS: u32 = 60;
/// The committed errors.
const CSV: &str = "docs/figures/drive.csv";
const HEADER: &str = "seed,t_min,scheme,horizontal_m";
/// Schemes of the table, and what stands in its header.
const SCHEMES: [(&str, &str); 3] = [
    ("raw", "`raw`: as measured"),
    ("ls-bias", "`ls-bias`: constant bias"),
    ("rnn", "`rnn`: the networks"),
];

/// `--json` of `host-sim run`, as far as it is wanted here.
#[derive(Deserialize)]
struct Run {
    rows: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    t_min: u32,
    scheme: String,
    horizontal_m: f64,
}

/// Simulates all seeds and writes the errors, then the table.
pub fn measure() -> Result<()> {
    succeed(&mut cargo_with("build --quiet --release --bin host-sim"))?;
    let target = target_directory()?;
    let folder = target.join("figures");
    fs::create_dir_all(&folder)?;
    let json = folder.join("drive.json");
    let mut lines = format!("{HEADER}\n");
    for seed in 1..=SEEDS {
        eprint!("\rseed {seed} of {SEEDS}");
        let mut run = std::process::Command::new(target.join("release/host-sim"));
        run.args(["run", "--seed", &seed.to_string(), "--json"])
            .arg(&json)
            .arg("--out")
            .arg(folder.join("drive"))
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null());
        succeed(&mut run)?;
        let run: Run = serde_json::from_str(&fs::read_to_string(&json)?)?;
        for row in run.rows {
            let (minutes, scheme) = (row.t_min, row.scheme.replace(',', ""));
            lines += &format!("{seed},{minutes},{scheme},{:.3}\n", row.horizontal_m);
        }
    }
    eprintln!();
    let path = workspace().join(CSV);
    fs::create_dir_all(path.parent().context("a folder")?)?;
    fs::write(&path, lines).context(CSV)?;
    write()
}

/// Writes the table from the committed errors.
pub fn write() -> Result<()> {
    markers::write_in("README.md", "figures drive", &committed()?)
}

/// The table of the committed errors.
pub fn committed() -> Result<String> {
    let text = fs::read_to_string(workspace().join(CSV)).context(CSV)?;
    table(&text).context(CSV)
}

/// Errors by minute and scheme, in the order of the seeds.
type Errors = BTreeMap<u32, BTreeMap<String, Vec<f64>>>;

fn table(csv: &str) -> Result<String> {
    let mut lines = csv.lines();
    ensure!(lines.next() == Some(HEADER), "the header is not {HEADER}");
    let mut errors = Errors::new();
    for line in lines {
        let cells: Vec<_> = line.split(',').collect();
        let [_, minutes, scheme, metres] = cells[..] else {
            anyhow::bail!("{line}");
        };
        let of = errors.entry(minutes.parse()?).or_default();
        of.entry(scheme.to_owned())
            .or_default()
            .push(metres.parse()?);
    }
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

    #[test]
    fn the_table_is_of_all_seeds() {
        let mut csv = format!("{HEADER}\n");
        for (seed, [raw, bias, rnn]) in [[4.0, 3.0, 1.0], [6.0, 2.0, 5.0], [100.0, 9.0, 8.0]]
            .iter()
            .enumerate()
        {
            for (scheme, metres) in [("raw", raw), ("ls-bias", bias), ("rnn", rnn)] {
                csv += &format!("{seed},5,{scheme},{metres}\n");
            }
        }
        let text = table(&csv).expect("a table");
        assert!(
            text.contains("| 5 | 6 / 37 / 100 | 3 / 5 / 9 | 5 / 5 / 8 |"),
            "{text}"
        );
        assert!(text.contains("in 2 of the 3 runs"), "{text}");
        assert!(table("seed\n").is_err() && table(&format!("{HEADER}\n")).is_err());
        assert_eq!(summary(&[1.0, 2.0]), "2 / 2 / 2");
    }
}
