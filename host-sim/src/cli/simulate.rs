//! `host-sim simulate`.

use super::options::Simulation;
use super::output::{JsonOption, WrittenRecording, check_free, output_directory};
use super::progress;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::words::counted;
use host_estimation::analysis::doubts::finds_north;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::InitialAttitude;
use host_io::recordings::generic;
use host_io::recordings::record::{Record, TimedFix};
use host_lab::experiment::run::sessions;
use std::path::PathBuf;

const WRITING: &str = "writing the files";

/// Arguments of `simulate`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(flatten)]
    simulation: Simulation,
    /// Vehicle instead of the scenario's: road, city, traffic, train, ship, aircraft, hand-held,
    /// standing
    #[arg(long, value_name = "NAME")]
    vehicle: Option<String>,
    /// Simulate the drive to learn from instead of the one to judge on
    #[arg(long)]
    learning: bool,
    /// Directory of imu.csv, gnss.csv, truth.csv, temperature.csv, unit.toml, and of header.toml,
    /// which `replay csv` and `convert csv` read
    #[arg(long, value_name = "DIR", value_parser = output_directory())]
    out: PathBuf,
    /// Replace files of a recording that is not a simulation
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    json: JsonOption,
}

/// The file of the wheels, which only a scenario with wheels has.
const WHEELS: &str = "wheels.csv";
/// The files that are written.
const FILES: [&str; 7] = [
    "imu.csv",
    "gnss.csv",
    WHEELS,
    "truth.csv",
    "temperature.csv",
    "unit.toml",
    "header.toml",
];

impl Args {
    /// Whether the folder holds a simulation: unit file and header begin as they are written here.
    fn is_simulated(&self) -> bool {
        let has = |name, what: &str| {
            let text = std::fs::read_to_string(self.out.join(name));
            text.is_ok_and(|text| text.lines().take(2).any(|line| line.contains(what)))
        };
        has("unit.toml", generic::UNIT_BESIDE) && has("header.toml", "unit = ")
    }

    /// Simulates and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        check_free(&self.out, &FILES, self.force || self.is_simulated())?;
        let mut scenario = self.simulation.scenario.load()?;
        if let Some(name) = &self.vehicle {
            scenario.set_vehicle(name)?;
        }
        let shown = progress::plan(&[("simulating", 1.0), (WRITING, 0.6)]);
        let sessions = sessions(&scenario, self.simulation.seed);
        let (session, fixes) = sessions.simulate_with_fixes(self.learning);
        progress::stage(WRITING);
        // Each file appears whole. The samples come first, because their file is the longest.
        let fixes = fixes
            .iter()
            .map(|(time, fix)| TimedFix::arrived(*time, fix));
        let mut record = Record {
            fixes: fixes.collect(),
            ..Record::from_session(&session)
        };
        if let (Some(InitialAttitude::Standstill(s)), Some(fix)) =
            (record.initial_attitude, record.fixes.first())
            && !finds_north(&Assumptions::of(scenario.unit()), s as f64, fix.lat_deg)
        {
            record.initial_attitude = None; // it is found in motion
        }
        generic::write(&record, Some(scenario.unit()), &self.out)?;
        generic::write_truth(&session, &self.out.join("truth.csv"))?;
        generic::write_readings(&session, &self.out.join("temperature.csv"))?;
        let written: Vec<_> = FILES
            .into_iter()
            .filter(|name| *name != WHEELS || !record.wheels.is_empty())
            .collect();
        let of = WrittenRecording::of(&self.out, &written, &record, record.fixes.len(), &[]);
        self.json.write(&of)?;
        drop(shown);
        println!(
            "{}, {} in {}",
            counted(session.counts.len(), "sample"),
            counted(record.fixes.len(), "fix"),
            self.out.display()
        );
        Ok(())
    }
}
