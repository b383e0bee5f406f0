//! What the device's memory is worth to each sensor with a preset: `docs/figures/sensors.csv`, from
//! a short campaign each.
//!
//! A datasheet does not say which part of a bias comes back at the next power-on. So each sensor is
//! simulated twice: with biases that are new at every power-on, and with biases of which a third is
//! new and the rest the unit's own.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use host_core::simulator::imu::ImuSpec;
use host_lab::campaign::median_of;
use host_unit::Unit;
use qemu::committed::Committed;

use super::{campaign_folder, named};
use crate::stage::{cargo_with, succeed};
use crate::table::{markdown, thousands};

/// Presets of products that the device reads. `kvh1775` has the numbers of `kvh1750`.
const SENSORS: [&str; 9] = [
    "hg1700",
    "kvh1750",
    "hg4930",
    "stim300",
    "adis16495",
    "adis16505",
    "vn-100",
    "mti-10",
    "icm-42688",
];
/// The share of a bias that is new at each power-on, and its name in the table.
const NEW: [(f64, &str); 2] = [(1.0, "all"), (1.0 / 3.0, "a third")];
/// Times without fixes, min.
const MINUTES: [&str; 2] = ["5", "22"];
/// Schemes with their earlier drives, and their columns in the file.
const SCHEMES: [(&str, &str, &str); 4] = [
    ("uncorrected", "1", "uncorrected"),
    ("ekf6", "1", "ekf6"),
    ("device", "1", "device 1"),
    ("device", "4", "device 4"),
];
/// Columns of the file before and behind these.
const ROW: [&str; 3] = ["preset", "new", "minutes"];
const HARM: [&str; 4] = ["worse 1", "worst 1", "worse 4", "worst 4"];
const UNITS: &str = "10";

/// Runs the campaigns, which go on where they were interrupted, and writes the file.
pub fn sensors() -> Result<()> {
    let mut rows = Vec::new();
    for sensor in SENSORS {
        for (share, name) in NEW {
            eprintln!("{sensor}, {name}");
            let runs = campaign(sensor, share).with_context(|| sensor.to_owned())?;
            for minutes in MINUTES {
                let mut row = vec![sensor.to_owned(), name.to_owned(), minutes.to_owned()];
                row.extend(cells(&runs, minutes).with_context(|| sensor.to_owned())?);
                rows.push(row);
            }
        }
    }
    let learner = firmware::learn::VERSION;
    let schemes = SCHEMES.map(|(.., column)| column);
    let header = [&ROW[..], &schemes, &HARM].concat();
    let file = Committed {
        name: "sensors".to_owned(),
        made_by: format!("`cargo xtask figures sensors`, {UNITS} units a row, learner {learner}"),
        header: header.into_iter().map(str::to_owned).collect(),
        rows,
    };
    file.write()
}

/// The errors of a sensor by its datasheet, with this share of the biases new at each power-on.
fn simulated(unit: &Unit, share: f64) -> ImuSpec {
    let mut spec = unit.simulated();
    let own = (1.0 - share * share).sqrt();
    spec.gyro.bias_unit_dph = own * unit.gyro.bias_turn_on_dph;
    spec.gyro.bias_turn_on_dph = share * unit.gyro.bias_turn_on_dph;
    spec.accel.bias_unit_ug = own * unit.accel.bias_turn_on_ug;
    spec.accel.bias_turn_on_ug = share * unit.accel.bias_turn_on_ug;
    spec
}

/// All runs of a sensor, one a row.
fn campaign(sensor: &str, share: f64) -> Result<Committed> {
    let unit = Unit::preset(sensor).context("no such preset")?;
    let simulation = Some(simulated(&unit, share));
    let text = Unit { simulation, ..unit }.to_text(sensor)?;
    let folder = campaign_folder(&format!("sensors-{sensor}-{share:.2}"))?;
    fs::create_dir_all(&folder)?;
    let [file, csv] = ["unit.toml", "runs.csv"].map(|name| folder.join(name));
    fs::write(&file, text)?;
    run(named(&file), named(&folder), named(&csv))?;
    Committed::parse(sensor, &format!("# {sensor}\n{}", fs::read_to_string(csv)?))
}

fn run(unit: &Path, folder: &Path, csv: &Path) -> Result<()> {
    let mut run = cargo_with("run --quiet --release --package host-sim -- campaign --resume");
    run.args(["--runs", UNITS, "--models", "all", "--start", "mixed"])
        .args(["--drives", "1,4", "--vehicle", "road"])
        .args([
            "--tuning-units",
            "0",
            "--schemes",
            "uncorrected,ekf6,device",
        ]);
    run.arg("--unit").arg(unit).arg("--out").arg(folder);
    succeed(run.arg("--csv").arg(csv))
}

/// The medians of the schemes, m, and for each number of earlier drives how many units are worse
/// than uncorrected, and the largest quotient of both errors.
fn cells(runs: &Committed, minutes: &str) -> Result<Vec<String>> {
    let of = |scheme, drives| errors(runs, scheme, drives, minutes);
    let mut cells = Vec::new();
    for (scheme, drives, _) in SCHEMES {
        let mut errors = of(scheme, drives)?;
        ensure!(errors.len().to_string() == UNITS, "{} runs", errors.len());
        cells.push(format!("{:.0}", median_of(&mut errors)));
    }
    for drives in ["1", "4"] {
        cells.extend(harm(runs, drives, minutes)?);
    }
    Ok(cells)
}

/// How many units the device makes worse than uncorrected, and the largest quotient.
pub fn harm(runs: &Committed, drives: &str, minutes: &str) -> Result<[String; 2]> {
    let of = |scheme| errors(runs, scheme, drives, minutes);
    let ratios = of("device")?.into_iter().zip(of("uncorrected")?);
    let worse = ratios.map(|(d, u)| d / u).filter(|ratio| *ratio > 1.0);
    let worse: Vec<f64> = worse.collect();
    let worst = worse.iter().copied().fold(1.0, f64::max);
    Ok([worse.len().to_string(), format!("{worst:.1}")])
}

/// The errors of a scheme, in the order of the runs.
fn errors(runs: &Committed, scheme: &str, drives: &str, minutes: &str) -> Result<Vec<f64>> {
    let at = |name: &str| runs.header.iter().position(|column| column == name);
    let named = ["scheme", "drives"].map(at);
    let error = at(&format!("horizontal_{minutes}min_m")).context("no such time")?;
    let is = |row: &&Vec<String>| {
        let cells = named.map(|at| at.map(|at| row[at].as_str()));
        cells == [Some(scheme), Some(drives)]
    };
    let found = runs.rows.iter().filter(is);
    Ok(found
        .map(|row| row[error].parse())
        .collect::<Result<_, _>>()?)
}

/// Metres, or kilometres from 10 km on.
fn length(metres: &str) -> Result<String> {
    let m: f64 = metres.parse()?;
    Ok(match m < 10_000.0 {
        true => format!("{m:.0}"),
        false => format!("{} km", thousands(m / 1000.0)),
    })
}

/// The table of docs/sensors.md.
pub fn table(of: &Committed) -> Result<String> {
    let header = [
        "preset",
        "biases: new at power-on",
        "`uncorrected`",
        "`ekf6`",
        "`device` after 1 drive",
        "after 4 drives",
        "worse after 1 drive",
        "after 4 drives",
    ];
    let mut rows = Vec::new();
    for pair in of.rows.chunks(MINUTES.len()) {
        let cells = |column: &str| -> Result<Vec<&str>> {
            let at = of.header.iter().position(|name| name == column);
            let at = at.with_context(|| format!("no column {column}"))?;
            Ok(pair.iter().map(|row| &*row[at]).collect())
        };
        let mut row = vec![format!("`{}`", pair[0][0]), pair[0][1].clone()];
        for (.., column) in SCHEMES {
            let lengths: Result<Vec<String>> = cells(column)?.into_iter().map(length).collect();
            row.push(lengths?.join(" / "));
        }
        for drives in ["1", "4"] {
            let counts = cells(&format!("worse {drives}"))?;
            let ratios = cells(&format!("worst {drives}"))?;
            row.push(match counts.iter().all(|count| *count == "0") {
                true => "none".to_owned(),
                false => format!("{}, {} times", counts.join(" / "), ratios.join(" / ")),
            });
        }
        rows.push(row);
    }
    Ok(markdown(&header.map(str::to_owned), rows.into_iter()))
}

#[cfg(test)]
mod tests {
    use qemu::images::workspace;

    use super::*;

    /// The page, in one line.
    fn page() -> String {
        let page = fs::read_to_string(workspace().join("docs/sensors.md"));
        page.expect("the page").replace('\n', " ")
    }

    /// How many units are worse 5 min after the last fix, and by how much at worst.
    fn harm(of: &Committed, new: &str, drives: &str) -> String {
        let (mut worse, mut worst) = (0, 1.0_f64);
        for sensor in SENSORS {
            let row = format!("{sensor},{new},5");
            let cell = |column: &str| of.cell(&row, &format!("{column} {drives}"));
            worse += cell("worse")
                .expect("a count")
                .parse::<u32>()
                .expect("a count");
            worst = worst.max(cell("worst").expect("a ratio").parse().expect("a ratio"));
        }
        let units = SENSORS.len() * UNITS.parse::<usize>().expect("a number");
        format!("{worse} of {units} units, at worst {worst:.1} times")
    }

    /// The harm that the page states is that of the file.
    #[test]
    fn the_page_of_the_sensors_states_the_harm() {
        let of = Committed::read("sensors").expect("the file");
        let page = page();
        for (_, new) in NEW {
            for drives in ["1", "4"] {
                let harm = harm(&of, new, drives);
                assert!(page.contains(&harm), "{new}, {drives} drives: {harm}");
            }
        }
        assert!(page.contains(&format!("{UNITS} simulated units")));
    }

    /// What the page says of all rows.
    #[test]
    fn the_page_of_the_sensors_states_the_gain() {
        let of = Committed::read("sensors").expect("the file");
        let page = page();
        let metres = |row: &str, column: &str| -> f64 {
            let cell = of.cell(row, column).expect("a cell");
            cell.parse().expect("a number")
        };
        let left = SENSORS.map(|sensor| {
            let row = format!("{sensor},a third,5");
            metres(&row, "device 4") / metres(&row, "uncorrected")
        });
        let [least, most] = [f64::min, f64::max].map(|of| left.into_iter().reduce(of));
        let left = format!("{:.2} to {:.2} of", least.expect("one"), most.expect("one"));
        assert!(page.contains(&left), "{left}");
        for cells in &of.rows {
            let row = cells[..3].join(",");
            for device in ["device 1", "device 4"] {
                assert!(metres(&row, "ekf6") < metres(&row, device), "{row}");
            }
        }
    }
}
