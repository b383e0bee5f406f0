//! What real units over their power-ons show: `docs/figures/real-*.csv`, from the sessions in the
//! folder of recorded data (`../shared/data/sessions`, or `sessions` in `LRNN_DATA`).

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use host_lab::experiment::sessions::{PHASES, Row, shared};
use qemu::committed::Committed;
use qemu::images::{target_directory, workspace};
use serde_json::Value;

use crate::stage::{cargo_with, succeed};
use crate::table::markdown;

/// A unit: name of its table, unit file, folder of its sessions.
const UNITS: [(&str, &str, &str); 5] = [
    ("real-rc-car", "dot.toml", "morpinet-1"),
    ("real-car", "dot.toml", "wid"),
    ("real-hand-a", "broad.toml", "broad-a"),
    ("real-hand-b", "broad.toml", "broad-b"),
    ("real-hand-c", "broad.toml", "broad-c"),
];
/// A session whose truth is bad by its own description.
const BAD: [(&str, &str); 1] = [("morpinet-1", "j")];
/// The drives of the paper's test, and its time without fixes, s.
const PAPER: (&str, &str) = ("wid", "50");
/// The phases in the tables of the page; the files have all.
const SHOWN: [&str; 4] = ["none", "10 s", "40 s", "all"];
const HORIZONS: [f64; 4] = [5.0, 10.0, 30.0, 60.0];
/// The row with the number of sessions.
const COUNT: &str = "sessions";

/// Writes the tables, if the sessions are there.
pub fn write() -> Result<()> {
    let data = match std::env::var_os("LRNN_DATA") {
        Some(folder) => PathBuf::from(folder),
        None => workspace().join("../shared/data"),
    };
    let sessions = data.join("sessions");
    if !sessions.is_dir() {
        println!(
            "skipped: no sessions of real units in {}",
            sessions.display()
        );
        return Ok(());
    }
    UNITS.iter().try_for_each(|(name, unit, folder)| {
        write_unit(&sessions, name, unit, folder).with_context(|| (*name).to_owned())
    })
}

fn write_unit(sessions: &Path, name: &str, unit: &str, folder: &str) -> Result<()> {
    let mut headers: Vec<PathBuf> = fs::read_dir(sessions.join(folder))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_>>()?;
    headers.retain(|path| {
        let own = path
            .file_name()
            .map(|name| name.to_string_lossy().into_owned());
        path.join("header.toml").is_file()
            && !BAD
                .iter()
                .any(|(of, bad)| *of == folder && own.as_deref() == Some(bad))
    });
    headers.sort();
    let into = target_directory()?.join("figures");
    fs::create_dir_all(&into)?;
    let json = into.join(format!("{name}.json"));
    let mut run = cargo_with("run --quiet --release --package host-sim -- replay sessions");
    run.arg(sessions.join(unit));
    run.args(headers.iter().map(|path| path.join("header.toml")));
    if folder == PAPER.0 {
        run.args(["--paper", PAPER.1]);
    }
    succeed(run.arg("--json").arg(&json))?;
    let results: Value = serde_json::from_str(&fs::read_to_string(&json)?)?;
    let rows: Vec<Row> = serde_json::from_value(results["rows"].clone())?;
    ensure!(!rows.is_empty(), "no rows");
    fs::write(
        workspace().join(format!("docs/figures/{name}.csv")),
        csv(folder, &rows, headers.len()),
    )?;
    if let Some(rows) = results["paper"].as_array() {
        let file = workspace().join("docs/figures/real-paper.csv");
        fs::write(file, paper(folder, rows))?;
    }
    Ok(())
}

/// A row for each scheme, a column for each protocol.
fn paper(folder: &str, rows: &[Value]) -> String {
    let mut out = format!(
        "# `host-sim replay sessions --paper {}` on the drives of {folder}: horizontal error, m, \
         median over the drives (least to most), learner {}\n\
         scheme,same drive,second half,next drive\n",
        PAPER.1,
        firmware::learn::VERSION
    );
    let text = |row: &Value, key: &str| row[key].as_str().unwrap_or_default().to_owned();
    let mut schemes: Vec<String> = Vec::new();
    for row in rows {
        let scheme = text(row, "scheme");
        if !schemes.contains(&scheme) {
            schemes.push(scheme);
        }
    }
    for scheme in schemes {
        let cells = ["same drive", "second half", "next drive"].map(|case| {
            let own = rows
                .iter()
                .filter(|row| text(row, "scheme") == scheme && text(row, "judged_on") == case);
            let all: Vec<f64> = own.filter_map(|row| row["error_m"].as_f64()).collect();
            let ends = all
                .iter()
                .copied()
                .fold((f64::MAX, 0.0), |(least, most): (f64, f64), m| {
                    (least.min(m), most.max(m))
                });
            let [least, most] = [ends.0, ends.1].map(|m| median(vec![m]));
            format!("{} ({least} to {most})", median(all))
        });
        out += &format!("`{scheme}`,{}\n", cells.join(","));
    }
    out
}

/// A row for each phase and scheme, a column for each horizon. The first row of a phase has the
/// number of sessions, which is the same for all schemes of a cell.
fn csv(folder: &str, rows: &[Row], sessions: usize) -> String {
    let mut out = format!(
        "# `host-sim replay sessions` on {sessions} sessions of {folder}: median over the sessions \
         of the median horizontal error, m, learner {}\nfixes before,scheme,5 s,10 s,30 s,60 s\n",
        firmware::learn::VERSION
    );
    for phase in PHASES {
        let of: Vec<&Row> = rows.iter().filter(|row| row.phase == phase).collect();
        let of = shared(&of);
        let shown = match phase {
            "power-on" => "none",
            "end" => "all",
            other => &format!("{} s", other.trim_start_matches("fixes-")),
        };
        let counts = HORIZONS.map(|horizon| {
            let own = of.iter().filter(|row| row.horizon_s == horizon);
            let sessions: BTreeSet<usize> = own.map(|row| row.session).collect();
            sessions.len().to_string()
        });
        out += &format!("{shown},{COUNT},{}\n", counts.join(","));
        let mut schemes: Vec<&str> = Vec::new();
        for row in &of {
            if !schemes.contains(&row.scheme.as_str()) {
                schemes.push(&row.scheme);
            }
        }
        for scheme in schemes {
            let cells = HORIZONS.map(|horizon| {
                let own = of
                    .iter()
                    .filter(|row| row.scheme == scheme && row.horizon_s == horizon);
                median(own.map(|row| row.median_m).collect())
            });
            out += &format!("{shown},`{scheme}`,{}\n", cells.join(","));
        }
    }
    out
}

/// The table of a page: a row for each scheme, a column for each phase, with the errors after two
/// of the horizons.
pub fn table(of: &Committed) -> Result<String> {
    let mut phases: Vec<&str> = of.rows.iter().map(|row| row[0].as_str()).collect();
    phases.dedup();
    phases.retain(|phase| SHOWN.contains(phase));
    let mut header = vec!["scheme".to_owned()];
    header.extend(phases.iter().map(|phase| match *phase {
        "none" => "no fixes".to_owned(),
        "all" => "all fixes".to_owned(),
        time => format!("{time} of fixes"),
    }));
    let first = of.rows.iter().filter(|row| row[0] == phases[0]);
    let rows = first.map(|row| {
        let cell = |phase: &&str| {
            let key = format!("{phase},{}", row[1]);
            let [soon, late] = ["10 s", "60 s"].map(|horizon| of.cell(&key, horizon));
            Ok(format!("{} / {}", soon?, late?))
        };
        let cells = phases.iter().map(cell).collect::<Result<Vec<_>>>()?;
        Ok([vec![row[1].clone()], cells].concat())
    });
    let rows = rows.collect::<Result<Vec<_>>>()?;
    Ok(markdown(&header, rows.into_iter()))
}

fn median(mut of: Vec<f64>) -> String {
    of.sort_by(f64::total_cmp);
    let median = match of.len() {
        0 => return "-".into(),
        n if n % 2 == 1 => of[n / 2],
        n => f64::midpoint(of[n / 2 - 1], of[n / 2]),
    };
    match median {
        m if m < 10.0 => format!("{m:.1}"),
        m => format!("{m:.0}"),
    }
}
