//! `host-sim run`.

use super::options::Simulation;
use super::output::Output;
use super::progress;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_lab::experiment::run::{Options, run};

/// Seconds of each stage of the default scenario on two busy cores.
const STAGES: [(&str, f64); 5] = [
    ("simulating the drives", 1.9),
    ("learning from the first drive", 0.3),
    ("navigating the second drive", 0.9),
    ("the device on earlier drives", 4.0),
    (progress::WRITING, 0.4),
];
/// Samples of the drives of that scenario.
const MEASURED: f64 = 744_000.0;

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
        let shown = progress::plan(&STAGES);
        progress::scale(scenario.samples() / MEASURED);
        let mut report = run(&scenario, &options, &progress::stage)?;
        report.set_up.push(("command".into(), self.command()));
        let suffix = if self.in_sample { "-in-sample" } else { "" };
        let name = format!("run-{}-{seed}{suffix}", scenario.name);
        self.output.leave_report(&name, &report, shown)
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
