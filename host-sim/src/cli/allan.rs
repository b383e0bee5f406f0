//! `host-sim allan`.

use super::at_rest::{self, AtRest};
use super::options::{UnitOption, positive, refused, seed};
use super::output::{JsonOption, output_directory};
use super::report::rest::{self, Rest};
use super::{progress, stdout};
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_estimation::analysis::allan::columns::Choice;
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::allan::{Column, at_rest as simulate_rest};
use host_io::recordings::record::Record;
use host_unit::Unit;
use std::path::PathBuf;

/// Arguments of `allan`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Recording at rest: CSV, plain or gzipped, with a header such as
    /// t_s,dtheta_x_rad,...,dv_z_mps, or any of those that replay reads: the header.toml of a CSV,
    /// KF-GINS text, MCAP, ULog, UBX, a NovAtel log, an EuRoC folder
    #[arg(value_name = "FILE", required_unless_present_any = ["unit", "header"])]
    file: Option<PathBuf>,
    /// Meaning of the columns of a CSV, as for `replay csv`; FILE replaces the one that it names
    #[arg(long, value_name = "FILE.toml")]
    header: Option<PathBuf>,
    /// With a recording the unit's datasheet stands beside its noise; without one the unit is
    /// simulated
    #[command(flatten)]
    unit: UnitOption,
    /// Length of the simulation, s [default: 7200]
    #[arg(long, value_name = "S")]
    duration: Option<u32>,
    /// Errors of the simulation: noise, linear, thermal, nonlinear, all, all-x3 [default: linear]
    #[arg(long, value_name = "NAME")]
    error_model: Option<String>,
    /// Seed of the simulation [default: 1]
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Only this column; may be given several times
    #[arg(long, value_name = "NAME")]
    column: Vec<String>,
    /// Samples per second, instead of the rate that the times in the file give
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Lines of a CSV before the names of its columns [default: they are looked for]
    #[arg(long, value_name = "N", conflicts_with = "header")]
    skip_lines: Option<usize>,
    #[command(flatten)]
    json: JsonOption,
    /// Directory of a page with pictures (PNG, SVG)
    #[arg(long, value_name = "DIR", value_parser = output_directory())]
    out: Option<PathBuf>,
    /// Options of `replay` for this form of recording, after --
    #[arg(last = true, value_name = "OPTIONS OF REPLAY")]
    options: Vec<String>,
}

const SIMULATING: &str = "simulating the unit at rest";
const ANALYSING: &str = "computing the deviations";
/// Samples of the simulation whose stages were measured: 7200 s at 200 Hz.
const MEASURED: f64 = 1_440_000.0;

/// Longest simulation, s.
const LONGEST_S: u32 = 86_400;

impl Args {
    /// Reads or simulates, analyses, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let recorded = self.file.is_some() || self.header.is_some();
        let first = match recorded {
            true => (progress::READING, 0.5),
            false => (SIMULATING, 1.7),
        };
        let shown = progress::plan(&[first, (ANALYSING, 0.5), (progress::WRITING, 0.2)]);
        let findings = match recorded {
            true => self.of_recording()?,
            false => {
                if self.rate.is_some() {
                    let remedy = "give it with a recording; the unit has its rate";
                    return Err(refused("--rate", "is for recordings", remedy));
                }
                let (source, columns, spec) = self.simulate(&self.unit.load_or("medium")?)?;
                progress::stage(ANALYSING);
                Findings::of(source, columns, spec.as_ref())?
            }
        };
        progress::stage(progress::WRITING);
        let json = host_report::json::findings(&findings)?;
        let page = self
            .out
            .as_deref()
            .map(|dir| host_report::allan::write(&findings, dir))
            .transpose();
        drop(shown);
        println!(
            "Allan deviation of {}\n\n{}\n\n{}",
            findings.source,
            host_report::allan::verdict(&findings),
            host_report::allan::table(&findings, stdout::width())
        );
        findings.notes.iter().for_each(|note| println!("- {note}"));
        self.json.write_text(&json)?;
        if let Some(page) = page? {
            println!("\nreport: {}", page.display());
        }
        Ok(())
    }

    /// The noise of a recording, beside the datasheet of the unit if it is given.
    fn of_recording(&self) -> Result<Findings, Error> {
        let given = [
            ("--duration", self.duration.is_some()),
            ("--error-model", self.error_model.is_some()),
            ("--seed", self.seed.is_some()),
        ];
        if let Some((option, _)) = given.into_iter().find(|(_, given)| *given) {
            let remedy = "leave it out, or leave the recording out to simulate the unit";
            return Err(refused(option, "is for the simulation of a unit", remedy));
        }
        let unit = self.unit.load()?;
        let rest = self.read()?;
        progress::stage(ANALYSING);
        let mut findings = Findings::of(rest.source, rest.columns, None)?;
        findings.notes.extend(rest.notes);
        Ok(match unit {
            Some(unit) => findings.beside(&unit.simulated()),
            None => findings,
        })
    }

    /// The sensors of the recording.
    fn read(&self) -> Result<Rest, Error> {
        let (file, header) = (self.file.as_deref(), self.header.as_deref());
        if let (Some(file), None) = (file, header) {
            progress::scale_by(file);
        }
        let choice = || {
            let rate = self.rate.map(|rate| positive("--rate", rate));
            Ok(Choice {
                columns: self.column.clone(),
                rate_hz: rate.transpose()?,
                skip_lines: self.skip_lines,
            })
        };
        match at_rest::read(file, header, choice, &self.options, false)? {
            AtRest::Record(record) => self.of_record(&record),
            AtRest::Columns(columns, notes) => Ok(Rest {
                source: file.map(|f| f.display().to_string()).unwrap_or_default(),
                columns,
                notes,
            }),
        }
    }

    /// The sensors of a recording that is at rest throughout.
    fn of_record(&self, record: &Record) -> Result<Rest, Error> {
        let found = rest::throughout(record)?;
        let mut rest = found.map_err(|why| {
            let remedy = "give a recording at rest, better of hours";
            refused(
                record.file.display().to_string(),
                format!("has too little: {why}"),
                remedy,
            )
        })?;
        let of_columns = [
            ("--rate", self.rate.is_some()),
            ("--skip-lines", self.skip_lines.is_some()),
        ];
        if let Some((option, _)) = of_columns.into_iter().find(|(_, given)| *given) {
            let remedy = "leave it out; this recording says it itself";
            return Err(refused(
                option,
                "is for CSV files without a header.toml",
                remedy,
            ));
        }
        self.keep(&mut rest.columns)?;
        rest.notes.extend(record.notes.iter().cloned());
        Ok(rest)
    }

    /// Keeps the columns that are wanted.
    fn keep(&self, columns: &mut Vec<Column>) -> Result<(), Error> {
        let is_there = |name: &&String| columns.iter().any(|c| c.name == **name);
        if let Some(missing) = self.column.iter().find(|name| !is_there(name)) {
            let known: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
            return Err(Error::unknown("sensor column", missing, &known));
        }
        columns.retain(|c| self.column.is_empty() || self.column.contains(&c.name));
        Ok(())
    }

    fn simulate(&self, unit: &Unit) -> Result<(String, Vec<Column>, Option<ImuSpec>), Error> {
        let spec = unit.simulated();
        let model: ErrorModelName = self.error_model.as_deref().unwrap_or("linear").parse()?;
        let (duration, seed) = (self.duration.unwrap_or(7200), self.seed.unwrap_or(1));
        if !(10..=LONGEST_S).contains(&duration) {
            return Err(refused(
                "--duration",
                format!("{duration} s is out of range"),
                format!("give 10 to {LONGEST_S} s"),
            ));
        }
        let spec = spec.error_model(model);
        progress::scale(f64::from(duration) * f64::from(spec.rate_hz) / MEASURED);
        let mut columns = simulate_rest(&spec, duration, seed)?;
        self.keep(&mut columns)?;
        let source = format!(
            "unit {}, errors {model}, {duration} s at rest, seed {seed}",
            unit.name
        );
        Ok((source, columns, Some(spec)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_estimation::analysis::allan::{Coefficient, Kind};
    use host_unit::presets;

    /// Distance of `truth` from the interval, in half widths of it. 0 inside.
    fn outside(c: &Coefficient, truth: f64) -> f64 {
        let half = 0.5 * (c.high - c.low);
        (c.low - truth).max(truth - c.high).max(0.0) / half
    }

    /// Whether an interval that holds the truth is also narrow enough. Beside the coarse pulses of
    /// the accelerometers of `medium`, two hours give upper ends only.
    fn is_sharp(kind: Kind, preset: &str, c: &Coefficient, truth: f64) -> bool {
        let within = |part: f64| c.is_seen() && (c.value / truth - 1.0).abs() < part;
        match (kind, c.symbol, preset) {
            (Kind::Accel, "N" | "Q", "medium") => c.high < 2.1 * truth,
            (_, "N", _) => truth == 0.0 || within(0.05),
            (Kind::Accel, "B", "fog" | "mems") => within(0.4),
            _ => true,
        }
    }

    /// Two hours of a preset, or less if it is faster than 200 Hz.
    fn findings(preset: &str) -> Findings {
        let spec = Unit::preset(preset).unwrap().simulated();
        let spec = spec.error_model(ErrorModelName::Linear);
        let columns = simulate_rest(&spec, 7200.min(1_440_000 / spec.rate_hz), 1).unwrap();
        assert_eq!(columns.len(), 6);
        Findings::of(preset.to_owned(), columns, Some(&spec)).unwrap()
    }

    #[test]
    fn every_preset_gets_its_noise_back_in_every_column() {
        let (mut all, mut missed, mut wrong) = (0, 0, vec![]);
        for preset in presets::names() {
            let found = findings(preset);
            let configured = found.configured.unwrap();
            let noted = |text: &str| found.notes.iter().any(|note| note.contains(text));
            // a configured value is empty only where the notes say so, or where there is none
            let [gyro, accel] = &configured;
            assert_eq!(gyro[0].is_none(), noted("Q of the gyros is left empty"));
            assert!(
                [accel[0], gyro[1], accel[1], gyro[3], accel[3]]
                    .iter()
                    .all(Option::is_some)
            );
            let flicker = matches!(preset, "fog" | "mems");
            assert_eq!(
                [gyro[2].is_some(), accel[2].is_some()],
                [flicker; 2],
                "{preset}"
            );
            assert_eq!(
                noted("by less than a pulse"),
                preset == "medium",
                "{preset}"
            );
            assert_eq!(found.analyses.len(), 6, "{preset}");
            for analysis in &found.analyses {
                let truth = configured[usize::from(analysis.kind == Kind::Accel)];
                for (c, truth) in analysis.coefficients.iter().zip(truth) {
                    let Some(truth) = truth else { continue };
                    let off = outside(c, truth);
                    let sharp = is_sharp(analysis.kind, preset, c, truth);
                    let at = format!("{preset} {} {c:?}, {truth}: {off:.2}", analysis.column);
                    println!("{at}");
                    all += 1;
                    missed += usize::from(off > 0.0);
                    // one half width beyond the end is four standard deviations
                    if off >= 1.0 || !sharp {
                        wrong.push(at);
                    }
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
        // 5 % are expected to miss
        assert!(20 * missed <= all, "{missed} of {all} intervals miss");
    }
}
