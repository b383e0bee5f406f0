//! `host-sim start`.

use super::interrupt::asked;
use super::options::{UnitOption, arguments, pool, refused, within};
use super::output::{JsonOption, output_file};
use super::progress::bar;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_io::output::write_atomic;
use host_lab::campaign::start::{Receiver, Study, Summary, chosen, markdown};
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `start`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Classes, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    class: Vec<String>,
    /// Trials of each class, each with its own turn-on and journey
    #[arg(long, default_value_t = 50)]
    seeds: u32,
    /// Threads, on which the results do not depend [default: all cores]
    #[arg(long)]
    jobs: Option<usize>,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    receiver: ReceiverOptions,
    #[command(flatten)]
    json: JsonOption,
    /// Write the tables with explanations as Markdown
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    results: Option<PathBuf>,
}

/// Differences of the receiver from the unit's.
#[derive(Debug, ClapArgs)]
struct ReceiverOptions {
    /// Fixes a second
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=20))]
    rate_hz: u32,
    /// Configured time from validity to arrival of a fix, ms [default: the unit's]
    #[arg(long, value_name = "MS")]
    fix_delay_ms: Option<f64>,
    /// Configured lever arm from the IMU to the antenna, m [default: the unit's]
    #[arg(
        long,
        value_name = "FORWARD,RIGHT,DOWN",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    lever_arm_m: Vec<f64>,
    /// The fixes have no vertical velocity, as those of NMEA
    #[arg(long)]
    horizontal_velocity: bool,
    /// The fixes have no velocity at all
    #[arg(long)]
    positions_only: bool,
    /// Standard deviation of the positions along an axis, m [default: 1, vertically 1.5]
    #[arg(long, value_name = "M")]
    position_sigma_m: Option<f64>,
}

impl ReceiverOptions {
    fn receiver(&self) -> Result<Receiver, Error> {
        let delay = self.fix_delay_ms;
        let delay = delay.map(|ms| within("--fix-delay-ms", ms, [0.0, 1000.0]));
        let arm = match self.lever_arm_m[..] {
            [] => None,
            [x, y, z] if [x, y, z].iter().all(|m| m.abs() <= 100.0) => Some([x, y, z]),
            _ => {
                return Err(refused(
                    "--lever-arm-m",
                    format!("{:?} is not a lever arm", self.lever_arm_m),
                    "give forward,right,down in m, each -100 to 100",
                ));
            }
        };
        let mut noise = Receiver::default().noise;
        if let Some(metres) = self.position_sigma_m {
            let metres = within("--position-sigma-m", metres, [1e-3, 100.0])?;
            noise.vertical_m *= metres / noise.horizontal_m;
            noise.horizontal_m = metres;
        }
        Ok(Receiver {
            rate_hz: self.rate_hz,
            delay_s: delay.transpose()?.map(|ms| 1e-3 * ms),
            lever_arm: arm,
            horizontal_velocity: self.horizontal_velocity,
            positions_only: self.positions_only,
            noise,
        })
    }
}

impl Args {
    /// Runs the trials, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if self.seeds == 0 {
            return Err(refused("--seeds", "is 0", "give at least 1"));
        }
        let study = Study {
            classes: chosen(&self.class)?,
            seeds: self.seeds,
            unit: self.unit.load()?,
            receiver: self.receiver.receiver()?,
        };
        let pool = pool(self.jobs)?;
        let stop = asked();
        let bar = bar(
            study.trials() as u64,
            "{bar:30} {pos}/{len} trials, {elapsed} elapsed, {eta} left",
        );
        bar.tick();
        let tried = pool.install(|| study.execute(&stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let tried = tried?;
        let summaries: Vec<Summary> = tried.iter().map(|t| t.summary.clone()).collect();
        println!(
            "{}",
            host_report::start::tables(&summaries, super::stdout::width())
        );
        let done: usize = tried.iter().map(|t| t.trials.len()).sum();
        let whole = done == study.trials();
        self.json.write(&json!({
            "seeds": self.seeds,
            "whole": whole,
            "classes": tried,
        }))?;
        if !whole {
            // an interrupted study is no result
            let text = format!("{done} of {} trials are done", study.trials());
            return Err(Error::Interrupted(text));
        }
        if let Some(file) = &self.results {
            let command = format!("cargo run --release -- {}", arguments());
            write_atomic(file, markdown(&command, &summaries).as_bytes())?;
        }
        Ok(())
    }
}
