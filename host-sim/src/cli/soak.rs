//! `host-sim soak`.

use super::options::{refused, seed};
use super::progress::bar;
use clap::Args as ClapArgs;
use firmware::app::App;
use firmware::app::blackbox::LEN;
use firmware::configuration::Configuration;
use host_core::error::Error;
use host_core::words::thousands;
use host_device::hil::blackbox::{Verdict, play};
use indicatif::ProgressBar;
use serde::Serialize;
use soak::disturb::KINDS;
use soak::{Memory, Plan, Report, Watch};
use std::collections::BTreeMap;
use std::time::Instant;

/// Arguments of `soak`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Simulated time, hours
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// Samples a second
    #[arg(long, default_value_t = 200)]
    rate: u32,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Result of a soak, as printed.
#[derive(Serialize)]
struct Outcome {
    seed: u64,
    seconds: u32,
    rate: u32,
    digest: String,
    samples: u64,
    bytes_in: u64,
    bytes_out: u64,
    power_ons: u32,
    unchanged: u64,
    corrected: u64,
    corrected_bursts: u64,
    no_room: u64,
    navigated_s: u32,
    stored: u32,
    store_failed: u32,
    most_passes: u32,
    blackbox_pages_played: u64,
    blackbox_pages_not_played: u64,
    disturbances: BTreeMap<String, u32>,
    violation: Option<String>,
    took_s: f64,
}

/// Samples a second that a soak can have.
const RATES: [u32; 5] = [100, 200, 250, 500, 1000];

/// Plays the black box before each reset, and shows the progress.
struct Looks {
    bar: ProgressBar,
    played: u64,
    not_played: u64,
    differs: Option<String>,
}

impl Watch for Looks {
    fn minute(&mut self, report: &Report) {
        self.bar.inc(1);
        self.bar
            .set_message(format!("{} power-ons", report.power_ons));
    }

    fn drive_over(&mut self, configuration: &Configuration, app: &App) -> bool {
        let mut memory = vec![0; LEN];
        app.read_recording(0, &mut memory);
        for page in play(Some(configuration), &memory) {
            match page.verdict {
                Verdict::Agrees => self.played += 1,
                Verdict::NotPlayed(_) => self.not_played += 1,
                Verdict::Differs(..) => {
                    self.differs.get_or_insert(format!("{page:?}"));
                }
            }
        }
        self.differs.is_none()
    }
}

impl Args {
    /// Runs the soak.
    pub(super) fn run(&self) -> Result<(), Error> {
        let seconds = (self.hours * 3600.0).round();
        if !(1.0..=1e8).contains(&seconds) {
            let problem = format!("{} hours", self.hours);
            return Err(refused("--hours", problem, "give 0.001 to 20000"));
        }
        if !RATES.contains(&self.rate) {
            let problem = format!("no format has {} samples a second", self.rate);
            let remedy = "give 100, 200, 250, 500 or 1000";
            return Err(refused("--rate", problem, remedy));
        }
        let plan = Plan {
            seed: self.seed,
            seconds: seconds as u32,
            rate: self.rate,
        };
        let mut looks = Looks {
            bar: bar(
                u64::from(plan.seconds / 60),
                "{bar:30} {pos}/{len} min, {msg}, {elapsed} elapsed, {eta} left",
            ),
            played: 0,
            not_played: 0,
            differs: None,
        };
        let begun = Instant::now();
        let mut memory = Box::new(Memory::ZEROED);
        let report = soak::run(&mut memory, &plan, &mut looks);
        looks.bar.finish_and_clear();
        let outcome = outcome(&plan, &report, &looks, begun.elapsed().as_secs_f64());
        print(&outcome, self.json)?;
        match outcome.violation {
            None => Ok(()),
            Some(what) => Err(Error::differs(
                format!("--seed {}", self.seed),
                what,
                "this is a defect of the device: the same seed shows it again",
            )),
        }
    }
}

fn outcome(plan: &Plan, report: &Report, looks: &Looks, took_s: f64) -> Outcome {
    let kinds = KINDS.iter().zip(report.begun);
    let violation = report
        .violation
        .map(|(what, sample)| format!("{what:?} at sample {sample}"));
    Outcome {
        seed: plan.seed,
        seconds: plan.seconds,
        rate: plan.rate,
        digest: format!("{:016x}", report.digest),
        samples: report.samples,
        bytes_in: report.came,
        bytes_out: report.left,
        power_ons: report.power_ons,
        unchanged: report.same,
        corrected: report.corrected,
        corrected_bursts: report.corrected_bursts,
        no_room: report.full,
        navigated_s: report.navigated,
        stored: report.stored,
        store_failed: report.failed,
        most_passes: report.passes,
        blackbox_pages_played: looks.played,
        blackbox_pages_not_played: looks.not_played,
        disturbances: kinds
            .map(|((kind, _), n)| (format!("{kind:?}"), n))
            .collect(),
        violation: match &looks.differs {
            Some(page) => violation.map(|v| format!("{v}, {page}")),
            None => violation,
        },
        took_s,
    }
}

fn print(outcome: &Outcome, json: bool) -> Result<(), Error> {
    let value = serde_json::to_value(outcome)
        .map_err(|error| refused("--json", error.to_string(), "report it"))?;
    if json {
        println!("{value:#}");
        return Ok(());
    }
    for (name, value) in value.as_object().into_iter().flatten() {
        match value.as_object() {
            Some(counts) => {
                for (kind, count) in counts {
                    println!("{name:>26}  {kind} {count}");
                }
            }
            None => {
                let plain = || value.to_string().trim_matches('"').to_owned();
                let number = value.as_u64().filter(|_| name != "seed");
                println!("{name:>26}  {}", number.map_or_else(plain, thousands));
            }
        }
    }
    Ok(())
}
