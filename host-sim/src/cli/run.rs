//! `host-sim run`.

use super::options::Simulation;
use super::output::Output;
use super::progress::Stages;
use crate::error::Error;
use crate::experiment::run::{Options, run};
use clap::Args as ClapArgs;

/// Arguments of `run`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(flatten)]
    simulation: Simulation,
    /// The paper's own protocol: judge on the same drive that was learnt from
    #[arg(long)]
    in_sample: bool,
    #[command(flatten)]
    output: Output,
}

impl Args {
    /// Simulates, learns, judges, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let scenario = self.simulation.scenario.load()?;
        let seed = self.simulation.seed;
        let options = Options {
            seed,
            in_sample: self.in_sample,
        };
        let stages = Stages::new();
        let mut report = run(&scenario, &options, &|stage| stages.begin(stage))?;
        report.set_up.push(("command".into(), self.command()));
        let suffix = if self.in_sample { "-in-sample" } else { "" };
        stages.begin("writing the report");
        let name = format!("run-{}-{seed}{suffix}", scenario.name);
        let done = self.output.leave_report(&name, &report);
        stages.end();
        done
    }

    fn command(&self) -> String {
        let Simulation { scenario, seed } = &self.simulation;
        let in_sample = if self.in_sample { " --in-sample" } else { "" };
        format!(
            "cargo run --release -- run {} --seed {seed}{in_sample}",
            scenario.typed()
        )
    }
}
