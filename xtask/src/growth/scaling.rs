//! Campaigns of growing length on one core and on several: whole processes of the released program,
//! in turn, so that other load on the machine affects all of them. Where the system reports it
//! (Linux), the time that threads waited for a core is subtracted.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use qemu::images::target_directory;

use crate::stage::{cargo_with, succeed};

/// Numbers of runs of the campaigns.
const RUNS: [u32; 3] = [2, 4, 8];
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

/// One execution of a campaign.
#[derive(Clone, Copy, Debug)]
struct Run {
    wall: f64,
    /// Time that all its threads together were ready to run but waited, s.
    waited: f64,
    cpu: Option<f64>,
}

impl Run {
    /// The time without the waiting, which the threads that had runs to do shared equally.
    fn undisturbed(self, runs: u32, jobs: usize) -> f64 {
        self.wall - self.waited / jobs.min(runs as usize) as f64
    }
}

/// All of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scaling {
    pub cells: Vec<Cell>,
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
        let place = target_directory()?.join("xtask-growth");
        let cores = std::thread::available_parallelism()?.get();
        let campaign = Prepared::new(program, place)?;
        let jobs = jobs(cores);
        let mut all: Vec<Vec<Run>> = vec![Vec::new(); RUNS.len() * jobs.len()];
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
            wall: spread(times.iter().map(|t| t.undisturbed(runs, jobs)).collect())[1],
            cpu: times
                .iter()
                .map(|t| t.cpu)
                .collect::<Option<Vec<_>>>()
                .map(|cpu| spread(cpu)[1]),
        });
        let longest = &all[all.len() - jobs.len()..];
        let pairs = || longest[0].iter().zip(&longest[jobs.len() - 1]);
        let most = RUNS[RUNS.len() - 1];
        let free =
            pairs().map(|(one, many)| one.undisturbed(most, 1) / many.undisturbed(most, cores));
        Ok(Self {
            cells: cells.collect(),
            ratio: [
                spread(free.collect()),
                spread(pairs().map(|(one, many)| one.wall / many.wall).collect()),
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

/// Smallest, median and largest of at least one value.
fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    [values[0], values[values.len() / 2], values[last]]
}

/// A campaign whose filters are already tuned, so that only runs are measured.
struct Prepared {
    program: PathBuf,
    place: PathBuf,
}

impl Prepared {
    fn new(program: PathBuf, place: PathBuf) -> Result<Self> {
        if place.exists() {
            fs::remove_dir_all(&place).with_context(|| place.display().to_string())?;
        }
        let prepared = Self { program, place };
        prepared.start(1, 1, false)?;
        Ok(prepared)
    }

    /// Runs it; returns the time that its threads waited, s.
    fn start(&self, runs: u32, jobs: usize, resume: bool) -> Result<f64> {
        let mut command = Command::new(&self.program);
        command
            .args(["campaign", "--models", "all", "--tuning-units", "1"])
            .args(["--runs", &runs.to_string(), "--jobs", &jobs.to_string()])
            .arg("--out")
            .arg(&self.place)
            .args(resume.then_some("--resume"))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let mut child = command
            .spawn()
            .with_context(|| self.program.display().to_string())?;
        let mut waited = 0.0_f64;
        loop {
            // The share of the last threads is lost when they end.
            waited = waited.max(waiting(child.id()).unwrap_or(0.0));
            if let Some(status) = child.try_wait()? {
                ensure!(status.success(), "{status}: {}", self.program.display());
                return Ok(waited);
            }
            sleep(LOOK);
        }
    }

    fn run(&self, runs: u32, jobs: usize) -> Result<Run> {
        let done = self.place.join("runs");
        fs::remove_dir_all(&done).with_context(|| done.display().to_string())?;
        let (start, before) = (Instant::now(), children());
        let waited = self.start(runs, jobs, true)?;
        Ok(Run {
            wall: start.elapsed().as_secs_f64(),
            waited,
            cpu: children().zip(before).map(|(now, then)| now - then),
        })
    }
}

/// Time between two looks at a running campaign. What its threads wait after the last look is not
/// seen.
const LOOK: Duration = Duration::from_millis(5);

/// The time that the threads of a process have waited for a core so far, together, s. `None` once
/// it has ended, or where the system does not report it.
fn waiting(process: u32) -> Option<f64> {
    let tasks = fs::read_dir(format!("/proc/{process}/task")).ok()?;
    let of = |task: fs::DirEntry| {
        let text = fs::read_to_string(task.path().join("schedstat")).ok()?;
        // time run, time waited (ns), turns
        text.split(' ').nth(1)?.parse::<f64>().ok()
    };
    let all: Option<Vec<f64>> = tasks.map(|task| of(task.ok()?)).collect();
    all.filter(|all| !all.is_empty())
        .map(|all| all.iter().sum::<f64>() * 1e-9)
}

/// Processor time of this process's finished children, s; Linux only.
fn children() -> Option<f64> {
    let stat = fs::read_to_string(Path::new("/proc/self/stat")).ok()?;
    // Fields follow the name in brackets, which may contain spaces: field 3 is the first. User and
    // system time of children are fields 16 and 17, in 1/100 s.
    let (_, fields) = stat.rsplit_once(") ")?;
    let times = fields.split(' ').skip(13).take(2);
    let ticks: Vec<f64> = times.filter_map(|field| field.parse().ok()).collect();
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / 100.0)
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
    fn the_middle_of_three_is_the_median() {
        assert_eq!(spread(vec![9.0, 1.0, 2.0]), [1.0, 2.0, 9.0]);
    }

    #[test]
    fn waiting_is_shared_by_the_threads() {
        let run = Run {
            wall: 10.0,
            waited: 6.0,
            cpu: None,
        };
        let jobs = [(8, 1), (8, 2), (1, 2)].map(|(runs, jobs)| run.undisturbed(runs, jobs));
        assert_eq!(jobs, [4.0, 7.0, 4.0]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_process_that_sleeps_waits_for_no_core() {
        let mut child = Command::new("sleep").arg("2").spawn().expect("a shell");
        sleep(Duration::from_millis(200));
        let waited = waiting(child.id()).expect("Linux tells");
        assert!(waited < 1.0, "{waited} s");
        child.kill().expect("it sleeps");
        child.wait().expect("it ends");
        assert_eq!(waiting(child.id()), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_childs_processor_time_is_seen() {
        let before = children().expect("Linux tells");
        let busy = "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done";
        succeed(Command::new("sh").args(["-c", busy])).expect("a shell");
        let used = children().expect("Linux tells") - before;
        assert!(used > 0.01 && used < 100.0, "{used} s");
    }
}
