//! Campaigns that take hours, and go on where an interrupted one has stopped: what memory over
//! power-offs is worth, `docs/figures/memory*.csv`, and abuse, `docs/ABUSE.md`.

use std::fs;

use anyhow::{Context, Error, Result};
use qemu::committed::Committed;
use qemu::images::workspace;
use serde_json::Value;

use super::sensors::harm;
use super::{campaign_folder, named};
use crate::stage::{cargo_with, succeed};

/// Time without fixes, min.
const T_MIN: u64 = 22;
/// The filters that are compared, and which of them are the rivals that know time or temperature.
const FILTERS: [&str; 4] = [
    "ekf6-memory",
    "ekf-exp-memory",
    "ekf-temp-memory",
    "ekf-inputs-memory",
];
const CAUSES: &str = "linear,thermal,all-x3,hysteresis,stretched-warm-up,thermostat,temperature,\
                      warm-up,softening,thermal-lag,vibration-saturation";
/// Vehicles whose scale factors and misalignments show, and the schemes that are compared there.
const VEHICLES: [&str; 3] = ["road", "hand-held", "aircraft"];
const LINEAR: [&str; 4] = ["uncorrected", "ekf6-tight", "ekf24-tight", "device"];

/// Schemes on units that step and age.
const REAL: [&str; 5] = [
    "uncorrected",
    "ekf6-memory",
    "ekf6-tight",
    "ekf24-tight",
    "device",
];

/// The rows of a campaign at the end of the time without fixes.
struct Rows(Vec<Value>);

/// Runs a campaign without fixes in the judged drive, whose filters know what is new at a power-on.
fn campaign(name: &str, runs: u32, schemes: &[String], words: &[&str]) -> Result<(String, Rows)> {
    let folder = campaign_folder(name)?;
    let json = folder.join("rows.json");
    let mut own = vec!["campaign", "--runs"];
    let (runs, schemes) = (runs.to_string(), schemes.join(","));
    own.extend([
        &*runs,
        "--start",
        "mixed",
        "--no-fixes",
        "--tuning-units",
        "0",
    ]);
    own.extend(words);
    own.extend(["--schemes", &schemes]);
    let mut run = cargo_with("run --quiet --release --package host-sim --");
    run.args(&own).args(["--resume", "--out"]).arg(&folder);
    succeed(run.arg("--json").arg(&json))?;
    let read: Value = serde_json::from_str(&fs::read_to_string(&json)?)?;
    let rows = read["rows"].as_array().context("no rows")?.iter();
    let rows = rows.filter(|row| row["t_min"] == T_MIN).cloned().collect();
    let learner = firmware::learn::VERSION;
    let made = format!("# `host-sim {}`, learner {learner}\n", own.join(" "));
    Ok((made, Rows(rows)))
}

impl Rows {
    /// A figure of a scheme, m.
    fn of(&self, errors: &str, drives: u64, scheme: &str, figure: &str) -> Result<f64> {
        let is = |row: &&Value| {
            row["error_model"] == errors && row["drives"] == drives && row["scheme"] == scheme
        };
        let found = self.0.iter().find(is).and_then(|row| row[figure].as_f64());
        found.with_context(|| format!("no {figure} of {scheme}, {errors}, {drives} drives"))
    }

    fn median(&self, errors: &str, drives: u64, scheme: &str) -> Result<f64> {
        self.of(errors, drives, scheme, "median_m")
    }

    /// The median of a filter and, in brackets, of it used as the device is.
    fn filter(&self, errors: &str, drives: u64, filter: &str) -> Result<String> {
        let own = self.median(errors, drives, filter)?;
        let frozen = self.median(errors, drives, &format!("{filter}-frozen"));
        Ok(match frozen {
            Ok(frozen) if drives > 0 => format!("{own:.0} ({frozen:.0})"),
            _ => format!("{own:.0}"),
        })
    }
}

/// Units of the table of vehicles, and of the cases of the first rest.
const FEW: u32 = 16;
const RESTS: &str = "20";

/// Abuse, and the first rest with the activations and sensors that it is for.
pub fn abuse() -> Result<()> {
    let host_sim = || cargo_with("run --quiet --release --package host-sim -- abuse");
    let folder = |name| Ok::<_, Error>(named(&campaign_folder(name)?).to_owned());
    let (all, rests) = (folder("abuse")?, folder("abuse-rests")?);
    let mut run = host_sim();
    run.args(["--runs", "20", "--resume", "--out"]).arg(&all);
    succeed(&mut run)?;
    let cases: Vec<_> = host_lab::abuse::at_power_on().collect();
    let sensors = "perfect,errors,mems,mems-perfect,consumer,consumer-perfect";
    let mut run = host_sim();
    run.args([
        "--runs",
        RESTS,
        "--resume",
        "--sensors",
        sensors,
        "--cases",
        &cases.join(","),
    ]);
    run.args(["--activations", "first-rest,first-rest-new", "--out"])
        .arg(&rests);
    succeed(&mut run)?;
    succeed(
        host_sim()
            .arg("merge")
            .args([&all, &rests])
            .arg("--results")
            .arg("docs/ABUSE.md"),
    )
}

/// The schemes that are compared over power-offs.
fn schemes() -> Vec<String> {
    let mut schemes = vec!["uncorrected".to_owned(), "limit".into(), "device".into()];
    schemes.extend(FILTERS.map(str::to_owned));
    schemes.extend(FILTERS.map(|filter| format!("{filter}-frozen")));
    schemes
}

fn save(name: &str, text: &str) -> Result<()> {
    Ok(fs::write(
        workspace().join(format!("docs/figures/{name}.csv")),
        text,
    )?)
}

/// The header of a table of filters, with further columns.
fn header(first: &str, more: &str) -> String {
    let filters = FILTERS.map(|filter| format!("`{filter}`")).join(",");
    format!("{first},`uncorrected`,{filters},`limit`,{more}\n")
}

/// The cells of a row of such a table.
fn cells(rows: &Rows, errors: &str, drives: u64) -> Result<Vec<String>> {
    let median = |scheme| Ok(format!("{:.0}", rows.median(errors, drives, scheme)?));
    let filters = FILTERS.map(|filter| rows.filter(errors, drives, filter));
    let cells = [median("uncorrected")].into_iter().chain(filters);
    cells.chain([median("limit")]).collect()
}

/// Memory over power-offs with all causes.
pub fn memory() -> Result<()> {
    let words = ["--models", "all", "--drives", "0,1,2,4,8"];
    let (mut out, rows) = campaign("memory", 100, &schemes(), &words)?;
    out += &header("earlier drives", "`device` (95 % of the median) / mean");
    for drives in [0, 1, 2, 4, 8] {
        let of = |figure| rows.of("all", drives, "device", figure);
        let [low, median, high, mean] = ["lo95_m", "median_m", "hi95_m", "mean_m"].map(of);
        out += &format!(
            "{drives},{},{:.0} ({:.0} .. {:.0}) / {:.0}\n",
            cells(&rows, "all", drives)?.join(","),
            median?,
            low?,
            high?,
            mean?
        );
    }
    save("memory", &out)
}

/// Memory over power-offs with single causes.
pub fn causes() -> Result<()> {
    const DRIVES: u64 = 8;
    let words = ["--models", CAUSES, "--drives", "8"];
    let (mut out, rows) = campaign("memory-causes", 24, &schemes(), &words)?;
    out += &header("errors", "`device`,ratio,frozen");
    for errors in CAUSES.split(',') {
        let device = rows.median(errors, DRIVES, "device")?;
        let least = |filters: &[&str], ending: &str| {
            let each = filters.iter().map(|of| format!("{of}{ending}"));
            each.map(|scheme| rows.median(errors, DRIVES, &scheme))
                .try_fold(f64::INFINITY, |least, m| Ok::<_, Error>(least.min(m?)))
        };
        let [best, frozen] = [least(&FILTERS[1..3], "")?, least(&FILTERS[..3], "-frozen")?];
        out += &format!(
            "{errors},{},{device:.0},{:.2},{:.2}\n",
            cells(&rows, errors, DRIVES)?.join(","),
            device / best,
            device / frozen
        );
    }
    save("memory-causes", &out)
}

/// Memory over power-offs that are like those of recorded units.
pub fn real() -> Result<()> {
    let words = ["--models", "real", "--drives", "1,2,4,8"];
    let schemes = REAL.map(str::to_owned);
    let (mut out, rows) = campaign("memory-real", 48, &schemes, &words)?;
    let csv = campaign_folder("memory-real")?.join("campaign.csv");
    let runs = Committed::parse(
        "memory-real",
        &format!("# campaign\n{}", fs::read_to_string(csv)?),
    )?;
    let names = REAL.map(|name| format!("`{name}`")).join(",");
    out += &format!("earlier drives,{names},worse,worst\n");
    for drives in [1, 2, 4, 8] {
        let cells = REAL.map(|scheme| Ok(format!("{:.0}", rows.median("real", drives, scheme)?)));
        let cells = cells.into_iter().collect::<Result<Vec<_>>>()?.join(",");
        let [worse, worst] = harm(&runs, &drives.to_string(), &T_MIN.to_string())?;
        out += &format!("{drives},{cells},{worse},{worst}\n");
    }
    save("memory-real", &out)
}

/// Memory over power-offs in other vehicles.
pub fn vehicles() -> Result<()> {
    let mut out = String::new();
    let mut body = String::new();
    for vehicle in VEHICLES {
        let words = [
            "--models",
            "linear",
            "--drives",
            "1,2,4,8",
            "--vehicle",
            vehicle,
        ];
        let schemes = LINEAR.map(str::to_owned);
        let (made, rows) = campaign(&format!("memory-{vehicle}"), FEW, &schemes, &words)?;
        if out.is_empty() {
            let names = LINEAR.map(|name| format!("`{name}`")).join(",");
            out = format!("{made}vehicle,earlier drives,{names}\n");
        }
        for drives in [1, 2, 4, 8] {
            let cells =
                LINEAR.map(|scheme| Ok(format!("{:.0}", rows.median("linear", drives, scheme)?)));
            let cells = cells.into_iter().collect::<Result<Vec<_>>>()?.join(",");
            body += &format!("{vehicle},{drives},{cells}\n");
        }
    }
    save("memory-vehicles", &(out + &body))
}
