//! `host-sim campaign`.

use super::options::{ScenarioOption, arguments, arguments_without, pool, refused, shard};
use super::output::{JsonOption, check_ours, write_json};
use super::progress::{self, bar};
use super::stdout;
use clap::{Args as ClapArgs, Subcommand};
use host_core::error::Error;
use host_io::output::{check_writable, write_atomic};
use host_lab::campaign::{
    Campaign, Group, Merged, NONE, Progress, Row, SCHEMES, Study, Summary, Topic, causes_csv,
    merge, missing, ratios, ratios_csv, results, studies, summarise, to_csv,
};
use host_report::campaign::Origin;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Keys of a scenario that a campaign would ignore: its drives and its networks are its own.
const IGNORED: [&str; 4] = ["heading_deg", "learn", "test", "network"];

/// Arguments of `campaign`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    /// Number of runs, each with its own unit, turn-on and drive
    #[arg(long, default_value_t = 100)]
    runs: u32,
    /// Threads, on which the results do not depend [default: all cores]
    #[arg(long)]
    jobs: Option<usize>,
    #[command(flatten)]
    scenario: ScenarioOption,
    /// Groups of simulated errors, separated by commas; also real (power-ons as of recorded units)
    /// and groups of a single cause, of the sensors: hysteresis, gradient, heating, self-heating,
    /// scale-temperature, softening, stretched-warm-up, thermal-lag, mode-hop, thermostat, flicker,
    /// g-square, ageing, temperature, warm-up, g-sensitivity, magnetic, dither, vibration,
    /// vibration-saturation, size-effect, timing; or of the fixes: coloured-fixes,
    /// optimistic-fixes, late-fixes, lever-arm, gaps, multipath. A name may join both
    /// (noise+late-fixes) and end with +told, if the schemes shall model the cause
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "linear,thermal,nonlinear,all,all-x3,noise"
    )]
    models: Vec<String>,
    /// Vehicle instead of the scenario's: road, city, traffic, train, aircraft, hand-held, standing
    #[arg(long, value_name = "NAME")]
    vehicle: Option<String>,
    /// How warm the unit is at power-on, instead of the scenario's: cold, warm, hot, mixed
    #[arg(long, value_name = "NAME")]
    start: Option<String>,
    /// Directory of results
    #[arg(long, value_name = "DIR", default_value = "out/campaign")]
    out: PathBuf,
    /// Keep the runs that an interrupted campaign has finished
    #[arg(long)]
    resume: bool,
    /// Only the runs whose number modulo N is I. With /N alone, I is SLURM_ARRAY_TASK_ID or
    /// JOB_COMPLETION_INDEX
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Further units on which the classical filters are tuned for each error group. 0: they are
    /// not tuned, and know how much the simulation changes at a power-on
    #[arg(long, default_value_t = 12, allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    tuning_units: u32,
    /// Schemes, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    schemes: Vec<String>,
    /// Earlier drives of the same unit before the judged one, each on another day: one number, or
    /// several separated by commas; 0 to 64
    #[arg(long, value_delimiter = ',', value_name = "NUMBERS", default_value = "0",
          value_parser = clap::value_parser!(u32).range(0..=64))]
    drives: Vec<u32>,
    /// The judged drive has no fixes after its standstill
    #[arg(long)]
    no_fixes: bool,
    /// Also run the studies of docs/RESULTS.md on this many units each: every single cause of
    /// errors, with and without +told, every kind of start, every vehicle, and earlier drives
    #[arg(long, value_name = "UNITS", value_parser = clap::value_parser!(u32).range(1..))]
    studies: Option<u32>,
    /// Also judge the learner's hypotheses: each alone, and the learner without some of them. These
    /// rows are not the device: what proves itself corrects at once
    #[arg(long)]
    ablation: bool,
    #[command(flatten)]
    files: Files,
}

/// Files to write beside the printed tables.
#[derive(Debug, Clone, ClapArgs)]
struct Files {
    #[command(flatten)]
    json: JsonOption,
    /// Write the paired ratios of every scheme to every other as JSON
    #[arg(long, value_name = "FILE")]
    ratios: Option<PathBuf>,
    /// Write all runs as CSV [default: DIR/campaign.csv; none for a shard and for merge]
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the tables with explanations as Markdown, and every pair of schemes beside it as CSV
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// Write a page (HTML): verdict, and each scheme against no correction, with the harm
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl Files {
    /// Checks that all files can be written, before hours of work.
    fn check(&self) -> Result<(), Error> {
        let Self {
            json,
            ratios,
            csv,
            results,
            report,
        } = self;
        let beside = |end| results.as_ref().map(|file| file.with_extension(end));
        let all = [
            json.file().map(Path::to_owned),
            ratios.clone(),
            csv.clone(),
            results.clone(),
            beside("csv"),
            beside("causes.csv"),
            report.clone(),
        ];
        let all: Vec<PathBuf> = all.into_iter().flatten().collect();
        for (at, file) in all.iter().enumerate() {
            if all.iter().skip(at + 1).any(|other| other == file) {
                let problem = format!("'{}' would be written twice", file.display());
                let remedy =
                    "give each output a name of its own; --results writes a .csv beside it";
                return Err(refused("--results", problem, remedy));
            }
            check_writable(file)?;
        }
        (report.as_deref()).map_or(Ok(()), |file| {
            check_ours("--report", file, host_report::page::is_ours)
        })
    }
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Combine the results of several shards
    Merge {
        /// Directories of the shards
        #[arg(required = true)]
        dirs: Vec<PathBuf>,
        #[command(flatten)]
        files: Files,
    },
}

impl Args {
    /// Runs or merges, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(Action::Merge { dirs, files }) = &self.action {
            let merged = merge(dirs)?;
            warn_of_gaps(&merged);
            return finish(&merged, &[], files);
        }
        let mut scenario = self.scenario.load()?;
        if let Some(start) = &self.start {
            scenario.set_start(start)?;
        }
        if let Some(name) = &self.vehicle {
            scenario.set_vehicle(name)?;
        }
        scenario.vehicle_stands("give a vehicle that stands for 300 s first")?;
        scenario.gives_none_of(&scenario.other_vehicles(), "campaign")?;
        scenario.one_fix_a_second("campaign")?;
        scenario.gives_none_of(&IGNORED, "campaign")?;
        let models: Result<Vec<Group>, Error> = self.models.iter().map(|m| m.parse()).collect();
        let campaign = Campaign {
            scenario,
            runs: self.runs,
            shard: shard(self.shard.as_deref())?,
            models: models?,
            out: self.out.clone(),
            resume: self.resume,
            schemes: self.schemes()?.to_vec(),
            ablation: self.ablation,
            tuning_units: self.tuning_units,
            drives: self
                .drives
                .iter()
                .copied()
                .collect::<BTreeSet<u32>>()
                .into_iter()
                .collect(),
            fixes: !self.no_fixes,
        };
        self.fit_together()?;
        self.files.check()?;
        let pool = pool(self.jobs)?;
        let done = pool.install(|| execute(&campaign, ""))?;
        let mut further = Vec::new();
        for Study { topic, campaign } in self.further(&campaign)? {
            let done = pool.install(|| execute(&campaign, &format!("{topic}: ")))?;
            further.push((topic, done.rows));
        }
        println!("vehicle: {}", campaign.scenario.vehicle_name);
        let mut files = self.files.clone();
        if campaign.shard.1 == 1 && files.csv.is_none() {
            files.csv = Some(self.out.join("campaign.csv"));
        }
        finish(&done, &further, &files)
    }

    /// The studies beside the campaign.
    fn further(&self, campaign: &Campaign) -> Result<Vec<Study>, Error> {
        match self.studies {
            None => Ok(Vec::new()),
            Some(_) if campaign.shard.1 != 1 => {
                let remedy = "run them on one machine, without --shard";
                Err(refused(
                    "--studies",
                    "studies are not divided into shards",
                    remedy,
                ))
            }
            Some(runs) => studies(campaign, runs),
        }
    }
    /// Refuses options that exclude each other.
    fn fit_together(&self) -> Result<(), Error> {
        if self.runs == 0 {
            return Err(refused("--runs", "0 runs", "give at least 1"));
        }
        let plain = self.drives.iter().all(|&drives| drives == 0) && !self.no_fixes;
        if self.ablation && !plain {
            let problem = "parts of the bank have no memory, and learn nothing without fixes";
            return Err(refused(
                "--ablation",
                problem,
                "leave --drives and --no-fixes out",
            ));
        }
        if self.files.results.is_some() && !plain {
            return Err(not_for_results());
        }
        let none = self.schemes()?.iter().any(|name| name == NONE);
        if self.files.report.is_some() && !self.schemes.is_empty() && !none {
            let problem =
                "its page compares with the scheme 'uncorrected', which --schemes leaves out";
            return Err(refused("--report", problem, "add uncorrected to --schemes"));
        }
        Ok(())
    }

    /// The schemes asked for; each must exist.
    fn schemes(&self) -> Result<&[String], Error> {
        let known = || SCHEMES.iter().map(|(name, _)| *name);
        for name in &self.schemes {
            if !known().any(|k| k == name) {
                let all: Vec<&str> = known().collect();
                return Err(Error::unknown("scheme", name, &all));
            }
        }
        Ok(&self.schemes)
    }
}

/// The error for `--results` of other runs: its text describes one judged drive with fixes.
fn not_for_results() -> Error {
    let problem = "its text is for drives with fixes and without earlier drives";
    let remedy = "take --json or --csv, or leave --drives and --no-fixes out";
    refused("--results", problem, remedy)
}

/// Runs a campaign behind progress bars: first the tuning of the classical filters, then the runs.
fn execute(campaign: &Campaign, label: &str) -> Result<Merged, Error> {
    let units = campaign.tuning_units * campaign.tuning_rounds();
    let tuning = bar(
        u64::from(units),
        "{bar:30} {prefix}tuning the classical filters first: {pos}/{len} units, {elapsed} \
         elapsed, {eta} left",
    );
    tuning.set_prefix(label.to_owned());
    tuning.tick();
    let runs = OnceLock::new();
    let runs = || {
        runs.get_or_init(|| {
            tuning.finish_and_clear();
            let runs = bar(
                campaign.wanted().len() as u64,
                "{bar:30} {prefix}{pos}/{len} runs, {elapsed} elapsed, {eta} left",
            );
            runs.set_prefix(label.to_owned());
            runs.tick();
            runs
        })
    };
    let done = campaign.execute(&|progress| match progress {
        Progress::TuningUnit => {
            tuning.inc(1);
            if tuning.position() >= u64::from(units) {
                runs();
            }
        }
        Progress::Run => runs().inc(1),
    });
    runs().finish_and_clear();
    done
}

/// Warns of runs that are missing between the first and the last.
fn warn_of_gaps(merged: &Merged) {
    let runs = missing(&merged.rows);
    let (Some(last), false) = (merged.rows.iter().map(|row| row.run).max(), runs.is_empty()) else {
        return;
    };
    let runs: Vec<String> = runs.iter().map(u32::to_string).collect();
    progress::say(&format!(
        "missing between run 0 and run {last}: {}; remedy: start their shards again with --resume",
        runs.join(", ")
    ));
}

/// The output of `--json`.
#[derive(Serialize)]
struct JsonOutput<'a> {
    /// The first sentence of the verdict; none without the scheme `uncorrected`.
    verdict: Option<&'a str>,
    rows: &'a [Summary],
}

fn finish(done: &Merged, further: &[(Topic, Vec<Row>)], files: &Files) -> Result<(), Error> {
    let setting = &done.tuning.setting;
    if files.results.is_some() && (setting.drives != [0] || !setting.fixes) {
        return Err(not_for_results());
    }
    let summary = summarise(&done.rows, setting.start);
    let ratios = ratios(&done.rows, setting.start);
    let said = host_report::campaign::verdict(done, &summary, &ratios, further);
    for sentence in &said {
        println!("{sentence}");
    }
    if !said.is_empty() {
        println!();
    }
    println!(
        "{}",
        host_report::campaign::tables(&summary, &ratios, stdout::width())
    );
    files.json.write(&JsonOutput {
        verdict: said.first().map(String::as_str),
        rows: &summary,
    })?;
    if let Some(file) = &files.ratios {
        write_json(file, &ratios)?;
    }
    if let Some(file) = &files.csv {
        let bytes = to_csv(done).map_err(|error| Error::writing(file, error))?;
        write_atomic(file, &bytes)?;
    }
    if let Some(file) = &files.results {
        let text = results(&command(), done, &summary, &ratios, further);
        write_atomic(file, text.as_bytes())?;
        write_atomic(&file.with_extension("csv"), ratios_csv(&ratios).as_bytes())?;
        if let Some((_, rows)) = further.iter().find(|(topic, _)| *topic == Topic::Causes) {
            write_atomic(
                &file.with_extension("causes.csv"),
                causes_csv(rows).as_bytes(),
            )?;
        }
    }
    if let Some(file) = &files.report {
        let made = Origin {
            commands: vec![format!("host-sim {}", arguments_without("--jobs"))],
        };
        let page = host_report::campaign::document(done, &summary, &ratios, further, &made)?;
        write_atomic(file, page.page()?.as_bytes())?;
    }
    Ok(())
}

/// The command line as it would be typed in the repository.
fn command() -> String {
    format!("cargo run --release -- {}", arguments())
}
