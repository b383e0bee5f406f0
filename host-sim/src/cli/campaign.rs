//! `host-sim campaign`.

use crate::campaign::{Campaign, Row, merge, paired_ratio, summarise};
use crate::error::Error;
use crate::imu::ErrorModelName;
use crate::output::write_atomic;
use crate::scenario::Scenario;
use clap::{Args as ClapArgs, Subcommand};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};

/// Arguments of `campaign`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    /// Number of runs: units, turn-ons and drives
    #[arg(long, default_value_t = 100)]
    runs: u32,
    /// Threads; the results do not depend on it [default: all cores]
    #[arg(long)]
    jobs: Option<usize>,
    /// Built-in scenario (medium, nav, tactical) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    scenario: String,
    /// Error groups, separated by commas
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "linear,thermal,nonlinear,all,all-x3,noise"
    )]
    models: Vec<String>,
    /// Directory of results
    #[arg(long, value_name = "DIR", default_value = "out/campaign")]
    out: PathBuf,
    /// Keep the runs that are finished already
    #[arg(long)]
    resume: bool,
    /// Only runs whose number modulo N is I; SLURM_ARRAY_TASK_ID and JOB_COMPLETION_INDEX give I when only /N is given
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Units, other than those judged, on which the classical filters are tuned for each error group
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=1000))]
    tuning_units: u32,
    /// Write the summary as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Sum up the directories of several shards
    Merge {
        /// Directories of the shards
        #[arg(required = true)]
        dirs: Vec<PathBuf>,
        /// Write the summary as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
}

impl Args {
    /// Runs or merges, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(Action::Merge { dirs, json }) = &self.action {
            return finish(&merge(dirs)?, json.as_deref());
        }
        let models: Result<Vec<ErrorModelName>, Error> =
            self.models.iter().map(|m| m.parse()).collect();
        let campaign = Campaign {
            scenario: Scenario::load(&self.scenario)?,
            runs: self.runs,
            shard: self.shard()?,
            models: models?,
            out: self.out.clone(),
            resume: self.resume,
            tuning_units: self.tuning_units,
        };
        if self.runs == 0 {
            return Err(option("--runs", "0 runs", "give at least 1"));
        }
        let mut pool = rayon::ThreadPoolBuilder::new();
        if let Some(jobs) = self.jobs {
            pool = pool.num_threads(jobs.max(1));
        }
        let pool = pool
            .build()
            .map_err(|e| option("--jobs", &e.to_string(), "give fewer"))?;
        let bar = ProgressBar::new(u64::from(self.runs / campaign.shard.1));
        if let Ok(style) = ProgressStyle::with_template(
            "{bar:30} {pos}/{len} runs, {elapsed} gone, {eta} to go {msg}",
        ) {
            bar.set_style(style);
        }
        bar.set_message("(tuning the classical filters first)");
        bar.tick();
        let rows = pool.install(|| {
            campaign.execute(&|_| {
                bar.set_message("");
                bar.inc(1);
            })
        });
        bar.finish_and_clear();
        finish(&rows?, self.json.as_deref())
    }

    /// Which part of the runs.
    fn shard(&self) -> Result<(u32, u32), Error> {
        let Some(text) = &self.shard else {
            return Ok((0, 1));
        };
        let wrong = || {
            option(
                "--shard",
                &format!("'{text}'"),
                "give I/N with I from 0 to N-1, or /N under SLURM or Kubernetes",
            )
        };
        let (i, n) = text.split_once('/').ok_or_else(wrong)?;
        let from_environment = || {
            ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"]
                .iter()
                .find_map(|v| std::env::var(v).ok())
        };
        let i = if i.is_empty() {
            from_environment().ok_or_else(wrong)?
        } else {
            i.to_string()
        };
        match (i.parse(), n.parse()) {
            (Ok(i), Ok(n)) if i < n => Ok((i, n)),
            _ => Err(wrong()),
        }
    }
}

fn option(name: &str, problem: &str, remedy: &str) -> Error {
    Error::Option {
        option: name.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

fn finish(rows: &[Row], json: Option<&Path>) -> Result<(), Error> {
    let summary = summarise(rows);
    if let Some(file) = json {
        let text =
            serde_json::to_vec_pretty(&summary).map_err(|e| Error::writing(file, e.into()))?;
        write_atomic(file, &text)?;
    }
    println!(
        "horizontal error at 22 min of coasting, m; interval: 95 % bootstrap of the median; ratio: median of the paired ratios to ekf6\n"
    );
    let mut table = Table::new();
    table.load_preset(UTF8_FULL_CONDENSED);
    table.set_header([
        "errors", "scheme", "n", "median", "95 %", "mean", "worst", "ratio", "95 %",
    ]);
    for s in summary.iter().filter(|s| s.t_min == 22) {
        let ratio = paired_ratio(rows, s.error_model, &s.scheme, "ekf6");
        let m = |x: f64| format!("{x:.0}");
        table.add_row([
            s.error_model.to_string(),
            s.scheme.clone(),
            s.n.to_string(),
            m(s.median_m),
            format!("{} .. {}", m(s.lo95_m), m(s.hi95_m)),
            m(s.mean_m),
            m(s.max_m),
            ratio.map_or(String::new(), |r| format!("{:.2}", r.0)),
            ratio.map_or(String::new(), |r| format!("{:.2} .. {:.2}", r.1, r.2)),
        ]);
    }
    println!("{table}");
    Ok(())
}
