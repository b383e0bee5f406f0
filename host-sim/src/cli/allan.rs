//! `host-sim allan`.

use super::options::{UnitOption, positive, refused};
use super::output::JsonOption;
use super::progress;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_lab::analysis::allan::columns::{Choice, load};
use host_lab::analysis::allan::findings::Findings;
use host_lab::analysis::allan::{Column, at_rest};
use host_unit::Unit;
use std::path::PathBuf;

/// Arguments of `allan`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Recording at rest: CSV, plain or gzipped, with a header such as
    /// t_s,dtheta_x_rad,...,dv_z_mps
    #[arg(
        value_name = "FILE",
        required_unless_present = "unit",
        conflicts_with = "unit"
    )]
    file: Option<PathBuf>,
    #[command(flatten)]
    unit: UnitOption,
    /// Length of the simulation, s
    #[arg(
        long,
        value_name = "S",
        default_value_t = 7200,
        conflicts_with = "file"
    )]
    duration: u32,
    /// Errors of the simulation: noise, linear, thermal, nonlinear, all, all-x3
    #[arg(
        long,
        value_name = "NAME",
        default_value = "linear",
        conflicts_with = "file"
    )]
    error_model: String,
    /// Seed of the simulation
    #[arg(long, default_value_t = 1, conflicts_with = "file")]
    seed: u64,
    /// Only this column; may be given several times
    #[arg(long, value_name = "NAME")]
    column: Vec<String>,
    /// Samples per second, instead of the rate that the times in the file give
    #[arg(long, value_name = "HZ", conflicts_with = "unit")]
    rate: Option<f64>,
    #[command(flatten)]
    json: JsonOption,
    /// Directory of a page with pictures (PNG, SVG)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
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
        let first = match &self.file {
            Some(_) => (progress::READING, 0.5),
            None => (SIMULATING, 1.7),
        };
        let shown = progress::plan(&[first, (ANALYSING, 0.5), (progress::WRITING, 0.2)]);
        let (source, columns, spec) = match &self.file {
            Some(file) => (file.display().to_string(), self.read(file)?, None),
            None => self.simulate(&self.unit.load_or("medium")?)?,
        };
        progress::stage(ANALYSING);
        let findings = Findings::of(source, columns, spec.as_ref())?;
        progress::stage(progress::WRITING);
        let json = findings.json()?;
        let page = self
            .out
            .as_deref()
            .map(|dir| host_report::allan::write(&findings, dir))
            .transpose()?;
        self.json.write_text(&json)?;
        drop(shown);
        println!(
            "Allan deviation of {}\n\n{}",
            findings.source,
            host_report::allan::table(&findings)
        );
        findings.notes.iter().for_each(|note| println!("- {note}"));
        if let Some(page) = page {
            println!("\nreport: {}", page.display());
        }
        Ok(())
    }

    fn read(&self, file: &std::path::Path) -> Result<Vec<Column>, Error> {
        progress::scale_by(file);
        let rate = self.rate.map(|rate| positive("--rate", rate));
        load(
            file,
            &Choice {
                columns: self.column.clone(),
                rate_hz: rate.transpose()?,
            },
        )
    }

    fn simulate(&self, unit: &Unit) -> Result<(String, Vec<Column>, Option<ImuSpec>), Error> {
        let spec = unit.simulated();
        let model: ErrorModelName = self.error_model.parse()?;
        if !(10..=LONGEST_S).contains(&self.duration) {
            return Err(refused(
                "--duration",
                format!("{} s is out of range", self.duration),
                format!("give 10 to {LONGEST_S} s"),
            ));
        }
        let spec = spec.error_model(model);
        progress::scale(f64::from(self.duration) * f64::from(spec.rate_hz) / MEASURED);
        let mut columns = at_rest(&spec, self.duration, self.seed)?;
        if let Some(missing) = self
            .column
            .iter()
            .find(|name| columns.iter().all(|c| c.name != **name))
        {
            let known: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
            return Err(Error::unknown("sensor column", missing, &known));
        }
        columns.retain(|c| self.column.is_empty() || self.column.contains(&c.name));
        let source = format!(
            "unit {}, errors {model}, {} s at rest, seed {}",
            unit.name, self.duration, self.seed
        );
        Ok((source, columns, Some(spec)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_lab::analysis::allan::{Coefficient, Kind};
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
        let columns = at_rest(&spec, 7200.min(1_440_000 / spec.rate_hz), 1).unwrap();
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
