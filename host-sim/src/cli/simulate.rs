//! `host-sim simulate`.

use crate::error::Error;
use crate::experiment::run::sessions;
use crate::experiment::scenario::Scenario;
use crate::recordings::generic;
use crate::recordings::record::Record;
use clap::Args as ClapArgs;
use std::path::PathBuf;

/// Arguments of `simulate`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Built-in scenario (medium, nav, tactical) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    scenario: String,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The session to learn from instead of the one to be judged on
    #[arg(long)]
    learning: bool,
    /// Directory for imu.csv, gnss.csv, truth.csv, and header.toml for `replay csv` and `convert csv`
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Args {
    /// Simulates and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let scenario = Scenario::load(&self.scenario)?;
        let progress = super::run::Progress::new();
        progress.stage("simulating");
        let session = sessions(&scenario, self.seed)?.simulate(self.learning);
        progress.stage("writing");
        // nothing half-written: each file appears whole, and the words, which are the longest, first
        generic::write(&Record::from_session(&session), &self.out)?;
        generic::write_truth(&session, &self.out.join("truth.csv"))?;
        progress.end();
        println!(
            "{} words, {} fixes in {}",
            session.counts.len(),
            session.fixes.len(),
            self.out.display()
        );
        Ok(())
    }
}
