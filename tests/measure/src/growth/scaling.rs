//! Campaigns of growing length on one core and on several: whole processes of the released program,
//! in turn, so that other load on the machine affects all of them. Where the system reports it
//! (Linux), the time that threads waited for a core is subtracted.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use qemu::images::target_directory;

use crate::child::{self, Used, spread};
use crate::stage::{cargo_with, succeed};

/// Numbers of runs of the campaigns.
const RUNS: [u32; 3] = [2, 4, 8];
/// Numbers of earlier drives, and runs of these campaigns.
const DRIVES: [u32; 4] = [0, 1, 2, 4];
pub const DRIVES_RUNS: u32 = 2;
/// How often each campaign is run.
const ROUNDS: usize = 5;
/// Samples of a run: 300 s of standstill and 2 x 22 min at 100 Hz, measured with one group of
/// errors and with noise alone.
pub const SAMPLES: f64 = 2.0 * 100.0 * (300.0 + 2.0 * 1320.0);

/// One campaign: medians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    pub runs: u32,
    pub jobs: usize,
    /// From start to exit on an otherwise idle machine, s.
    pub wall: f64,
    /// Processor time of all its threads, s; `None` where the system does not report it.
    pub cpu: Option<f64>,
}

/// The time of a campaign without waiting. The waiting time is divided equally among the threads
/// that had runs.
fn undisturbed(used: &Used, runs: u32, jobs: usize) -> f64 {
    used.wall_s - used.waited_s / jobs.min(runs as usize) as f64
}

/// A campaign with earlier drives of each unit: medians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drives {
    pub drives: u32,
    /// As in [`Cell`], s.
    pub wall: f64,
    pub cpu: Option<f64>,
}

/// All measurements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scaling {
    pub cells: Vec<Cell>,
    pub drives: Vec<Drives>,
    /// Time with one job over time with all cores, in pairs, longest campaign: smallest, median,
    /// largest; on an otherwise idle machine, and as measured.
    pub ratio: [[f64; 3]; 2],
    /// Largest number of cores used.
    pub cores: usize,
}

impl Scaling {
    /// Builds `host-sim` and runs it.
    pub fn measure() -> Result<Self> {
        succeed(&mut cargo_with(
            "build --quiet --release --package host-sim",
        ))?;
        let program = target_directory()?.join("release/host-sim");
        let folder = target_directory()?.join("xtask-growth");
        let cores = std::thread::available_parallelism()?.get();
        let campaign = Prepared::new(&program, folder.join("runs-and-cores"), 0)?;
        let jobs = jobs(cores);
        let mut all: Vec<Vec<Used>> = vec![Vec::new(); RUNS.len() * jobs.len()];
        for round in 0..ROUNDS {
            eprintln!("      round {} of {ROUNDS}", round + 1);
            let cells = RUNS.iter().flat_map(|r| jobs.iter().map(move |j| (r, j)));
            for (times, (runs, jobs)) in all.iter_mut().zip(cells) {
                times.push(campaign.run(*runs, *jobs)?);
            }
        }
        let cells = RUNS.iter().flat_map(|r| jobs.iter().map(move |j| (*r, *j)));
        let cells = cells.zip(&all).map(|((runs, jobs), times)| Cell {
            runs,
            jobs,
            wall: spread(times.iter().map(|t| undisturbed(t, runs, jobs)).collect())[1],
            cpu: median_cpu(times),
        });
        let longest = &all[all.len() - jobs.len()..];
        let pairs = || longest[0].iter().zip(&longest[jobs.len() - 1]);
        let most = RUNS[RUNS.len() - 1];
        let free =
            pairs().map(|(one, many)| undisturbed(one, most, 1) / undisturbed(many, most, cores));
        Ok(Self {
            cells: cells.collect(),
            drives: with_drives(&program, &folder)?,
            ratio: [
                spread(free.collect()),
                spread(
                    pairs()
                        .map(|(one, many)| one.wall_s / many.wall_s)
                        .collect(),
                ),
            ],
            cores,
        })
    }

    /// The campaigns with this number of jobs, in order of runs.
    pub fn with(&self, jobs: usize) -> impl Iterator<Item = &Cell> {
        self.cells.iter().filter(move |cell| cell.jobs == jobs)
    }

    /// The numbers of jobs that were measured.
    pub fn jobs(&self) -> Vec<usize> {
        jobs(self.cores)
    }
}

/// 1, 2, 4 ... and all cores.
fn jobs(cores: usize) -> Vec<usize> {
    let mut jobs: Vec<usize> = (0..).map(|k| 1 << k).take_while(|j| *j < cores).collect();
    jobs.push(cores.max(1));
    jobs
}

/// Median of the processor time, where the system reports it, s.
fn median_cpu(times: &[Used]) -> Option<f64> {
    let cpu: Option<Vec<f64>> = times.iter().map(|t| t.cpu_s).collect();
    cpu.map(|cpu| spread(cpu)[1])
}

/// Campaigns with earlier drives, with one job, in turn.
fn with_drives(program: &Path, folder: &Path) -> Result<Vec<Drives>> {
    let mut all = Vec::new();
    for drives in DRIVES {
        eprintln!("      filters for {drives} earlier drives");
        let folder = folder.join(format!("drives-{drives}"));
        all.push((Prepared::new(program, folder, drives)?, Vec::new()));
    }
    for round in 0..ROUNDS {
        eprintln!("      drives, round {} of {ROUNDS}", round + 1);
        for (campaign, times) in &mut all {
            times.push(campaign.run(DRIVES_RUNS, 1)?);
        }
    }
    let median = |(campaign, times): &(Prepared, Vec<Used>)| {
        let walls = times.iter().map(|t| undisturbed(t, DRIVES_RUNS, 1));
        Drives {
            drives: campaign.drives,
            wall: spread(walls.collect())[1],
            cpu: median_cpu(times),
        }
    };
    Ok(all.iter().map(median).collect())
}

/// A campaign whose filters are already tuned, so that only runs are measured.
struct Prepared {
    program: PathBuf,
    /// Its directory, which holds this one campaign.
    folder: PathBuf,
    /// Earlier drives of each unit.
    drives: u32,
}

impl Prepared {
    fn new(program: &Path, folder: PathBuf, drives: u32) -> Result<Self> {
        if folder.exists() {
            fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
        }
        let prepared = Self {
            program: program.to_path_buf(),
            folder,
            drives,
        };
        child::run(&mut prepared.command(1, 1, false))?;
        Ok(prepared)
    }

    fn command(&self, runs: u32, jobs: usize, resume: bool) -> Command {
        let mut command = Command::new(&self.program);
        command
            .args(["campaign", "--models", "all", "--tuning-units", "1"])
            .args(["--runs", &runs.to_string(), "--jobs", &jobs.to_string()])
            .args(["--drives", &self.drives.to_string()])
            .arg("--out")
            .arg(&self.folder)
            .args(resume.then_some("--resume"));
        command
    }

    fn run(&self, runs: u32, jobs: usize) -> Result<Used> {
        self.forget()?;
        child::run(&mut self.command(runs, jobs, true))
    }

    /// Deletes the finished runs.
    fn forget(&self) -> Result<()> {
        let done = self.folder.join("runs");
        fs::remove_dir_all(&done).with_context(|| done.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_double_up_to_the_cores() {
        assert_eq!(jobs(1), [1]);
        assert_eq!(jobs(2), [1, 2]);
        assert_eq!(jobs(6), [1, 2, 4, 6]);
    }

    #[test]
    fn waiting_is_shared_by_the_threads() {
        let used = Used {
            wall_s: 10.0,
            waited_s: 6.0,
            ..Used::default()
        };
        let jobs = [(8, 1), (8, 2), (1, 2)].map(|(runs, jobs)| undisturbed(&used, runs, jobs));
        assert_eq!(jobs, [4.0, 7.0, 4.0]);
    }
}
