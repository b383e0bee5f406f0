//! `host-sim abuse`.

use super::interrupt::asked;
use super::options::{arguments, pool, refused, shard};
use super::output::{JsonOption, output_file};
use super::progress::bar;
use super::stdout;
use clap::{Args as ClapArgs, Subcommand};
use host_core::error::Error;
use host_io::output::write_atomic;
use host_lab::abuse::{
    Abuse, Activation, Case, Computer, Judged, Sensor, Times, chosen, csv, fix_learner, markdown,
    merge, summarise,
};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Arguments of `abuse`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    /// Units, each with its own errors, drives and fixes
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=4000))]
    runs: u32,
    /// Sensors, separated by commas: perfect, errors, errors-x3, mems, mems-perfect, consumer,
    /// consumer-perfect
    #[arg(long, value_delimiter = ',', default_value = "perfect,errors")]
    sensors: Vec<Sensor>,
    /// Threads, on which the results do not depend [default: all cores]
    #[arg(long)]
    jobs: Option<usize>,
    /// Directory of results
    #[arg(long, value_name = "DIR", default_value = "out/abuse")]
    out: PathBuf,
    /// Keep what an interrupted run of this command has finished
    #[arg(long)]
    resume: bool,
    /// Only the units whose number modulo N is I
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Standstill, drive with fixes, and drive without, s
    #[arg(long, value_delimiter = ',', value_name = "SECONDS", default_value = "300,900,1320",
          value_parser = clap::value_parser!(u32).range(60..=3600))]
    times: Vec<u32>,
    #[command(flatten)]
    what: Selection,
    #[command(flatten)]
    files: Files,
}

/// Cases, and navigation computers behind the device.
#[derive(Debug, Clone, ClapArgs)]
struct Selection {
    /// Cases of docs/ABUSE.md, separated by commas; + joins several, and :ended after a name ends
    /// it ten minutes before the fixes [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    cases: Vec<String>,
    /// Another value of a case's parameter; may be given several times
    #[arg(long, value_name = "CASE.KEY=VALUE")]
    set: Vec<String>,
    /// Navigation computers, separated by commas: plain, biases, gauss-markov
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "plain,biases,gauss-markov"
    )]
    computers: Vec<Computer>,
    /// When corrections act, separated by commas: live, next-power-on, next-power-on-aided,
    /// first-rest, first-rest-new
    #[arg(long, value_delimiter = ',', default_value = "live,next-power-on")]
    activations: Vec<Activation>,
}

/// Files to write beside the printed table.
#[derive(Debug, Clone, ClapArgs)]
struct Files {
    #[command(flatten)]
    json: JsonOption,
    /// Write a page in Markdown with what matters, and all rows beside it as CSV
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    results: Option<PathBuf>,
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

impl Selection {
    /// The cases with the given values.
    fn cases(&self) -> Result<Vec<Case>, Error> {
        let mut cases = chosen(&self.cases)?;
        for text in &self.set {
            let wrong = |problem: String| {
                let remedy = "give CASE.KEY=VALUE as in the table of docs/ABUSE.md";
                refused(format!("--set {text}"), problem, remedy)
            };
            let split = text.split_once('=').and_then(|(path, value)| {
                let (case, key) = path.rsplit_once('.')?;
                Some((case, key, value.parse::<f64>().ok()?))
            });
            let (row, key, value) = split.ok_or_else(|| wrong("is not an assignment".into()))?;
            let of_row = |case: &&mut Case| case.name().split(['+', ':']).any(|part| part == row);
            let mut found = cases.iter_mut().filter(of_row).peekable();
            if found.peek().is_none() {
                return Err(wrong(format!("'{row}' is none of the cases that are run")));
            }
            found.try_for_each(|case| case.set(row, key, value))?;
        }
        Ok(cases)
    }
}

impl Args {
    /// Runs or merges, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(Action::Merge { dirs, files }) = &self.action {
            let rows = merge(dirs)?;
            return finish(&rows, &Times::default(), files);
        }
        let [standstill_s, aided_s, free_s] = self.times[..] else {
            let remedy = "give standstill, drive with fixes and drive without, s";
            return Err(refused("--times", "are not three numbers", remedy));
        };
        if standstill_s < 90 {
            let remedy =
                "give a standstill of at least 90 s, of which a computer aligns itself in a third";
            return Err(refused(
                "--times",
                format!("begin with {standstill_s} s"),
                remedy,
            ));
        }
        let times = Times {
            standstill_s,
            aided_s,
            free_s,
        };
        let abuse = Abuse {
            cases: self.what.cases()?,
            sensors: self.sensors.clone(),
            computers: self.what.computers.clone(),
            activations: self.what.activations.clone(),
            times,
            runs: self.runs,
            shard: shard(self.shard.as_deref())?,
            out: self.out.clone(),
            resume: self.resume,
        };
        let pool = pool(self.jobs)?;
        let stop = asked();
        let bar = bar(
            abuse.length(),
            "{bar:30} {pos}/{len} cases, {elapsed} elapsed, {eta} left",
        );
        bar.tick();
        let rows = pool.install(|| abuse.execute(&fix_learner, &stop, &|| bar.inc(1)));
        bar.finish_and_clear();
        let rows = rows?;
        if stop.load(Ordering::Relaxed) {
            // an interrupted abuse is no result
            let text = "the same command with --resume goes on";
            return Err(Error::Interrupted(text.into()));
        }
        finish(&rows, &times, &self.files)
    }
}

fn finish(rows: &[Judged], times: &Times, files: &Files) -> Result<(), Error> {
    let mut names: Vec<String> = Vec::new();
    for row in rows {
        if !names.contains(&row.case) {
            names.push(row.case.clone());
        }
    }
    let usual = chosen(&[])?;
    let rank = |name: &String| usual.iter().position(|case| case.name() == name);
    names.sort_by_key(|name| rank(name).unwrap_or(usize::MAX));
    let cases = chosen(&names)?;
    let all = summarise(rows, &cases);
    println!("{}", host_report::abuse::table(&all, stdout::width()));
    files.json.write(&all)?;
    if let Some(file) = &files.results {
        let command = format!("cargo run --release -- {}", arguments());
        let rows = file.with_extension("csv");
        let name = rows.file_name().unwrap_or_default().to_string_lossy();
        write_atomic(
            file,
            markdown((&command, &host_lab::version()), &name, times, &all).as_bytes(),
        )?;
        write_atomic(&rows, csv(&all).as_bytes())?;
    }
    Ok(())
}
