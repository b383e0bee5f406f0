//! Programs that are measured as whole processes: time, processor time, and peak memory. Linux
//! reports the last two; elsewhere they are unknown.

use std::fs;
use std::io::{Read, Seek};
use std::path::Path;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

/// Resources that a process used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Used {
    /// From start to exit, s.
    pub wall_s: f64,
    /// Time that all its threads together were ready to run but waited, s.
    pub waited_s: f64,
    /// Processor time of all its threads, s.
    pub cpu_s: Option<f64>,
    /// Most memory that was resident, MiB.
    pub peak_mib: Option<f64>,
    /// Its standard output.
    pub output: String,
}

/// Time between two samples of a running process. Waiting and memory growth after the last sample
/// are missed.
const LOOK: Duration = Duration::from_millis(5);

/// Runs a program to its end, and no other at the same time.
///
/// # Errors
/// It cannot be started, or it fails; then the error contains its standard error output.
pub fn run(command: &mut Command) -> Result<Used> {
    let program = command.get_program().display().to_string();
    let mut printed = tempfile::tempfile()?;
    let mut said = tempfile::tempfile()?;
    command
        .stdout(printed.try_clone()?)
        .stderr(said.try_clone()?);
    let (start, before) = (Instant::now(), children());
    let mut used = Used::default();
    let mut child = command.spawn().with_context(|| program.clone())?;
    let status = loop {
        let id = child.id();
        // The share of the last threads is lost when they end.
        used.waited_s = used.waited_s.max(waiting(id).unwrap_or(0.0));
        used.peak_mib = peak(id).or(used.peak_mib);
        if let Some(status) = child.try_wait()? {
            break status;
        }
        sleep(LOOK);
    };
    ensure!(
        status.success(),
        "{status}: {program}: {}",
        text(&mut said)?
    );
    used.wall_s = start.elapsed().as_secs_f64();
    used.cpu_s = children().zip(before).map(|(now, then)| now - then);
    used.output = text(&mut printed)?;
    Ok(used)
}

/// The content of a file.
fn text(file: &mut fs::File) -> Result<String> {
    let mut bytes = Vec::new();
    file.rewind()?;
    file.read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Smallest, median and largest of at least one value.
pub fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    [values[0], values[values.len() / 2], values[last]]
}

/// Most memory of a process that has been resident so far, MiB. `None` once it has ended.
fn peak(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib / 1024.0)
}

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
    fn the_middle_of_three_is_the_median() {
        assert_eq!(spread(vec![9.0, 1.0, 2.0]), [1.0, 2.0, 9.0]);
    }

    #[test]
    fn what_a_process_prints_is_read_and_its_failure_is_an_error() {
        let sh = |text: &str| run(Command::new("sh").args(["-c", text]));
        assert_eq!(sh("echo a; echo b").expect("a shell").output, "a\nb\n");
        let error = sh("echo why >&2; exit 3").expect_err("it fails");
        assert!(error.to_string().contains("why"), "{error}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_process_that_sleeps_waits_for_no_core() {
        let mut child = Command::new("sleep").arg("2").spawn().expect("a shell");
        sleep(Duration::from_millis(200));
        let waited = waiting(child.id()).expect("Linux reports it");
        assert!(waited < 1.0, "{waited} s");
        child.kill().expect("it sleeps");
        child.wait().expect("it ends");
        assert_eq!(waiting(child.id()), None);
        assert_eq!(peak(child.id()), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn processor_time_and_memory_of_a_process_are_measured() {
        // a string of 2^24 characters, then 0.2 s in which it is there
        let busy = "a=x; i=0; while [ $i -lt 24 ]; do a=$a$a; i=$((i+1)); done; sleep 0.2";
        let used = run(Command::new("sh").args(["-c", busy])).expect("a shell");
        let peak = used.peak_mib.expect("Linux reports it");
        assert!(peak > 16.0 && peak < 1000.0, "{peak} MiB");
        let busy = "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done";
        let used = run(Command::new("sh").args(["-c", busy])).expect("a shell");
        let cpu = used.cpu_s.expect("Linux reports it");
        assert!(cpu > 0.01 && cpu < 100.0, "{cpu} s");
        assert!(used.peak_mib.expect("Linux reports it") < peak);
    }
}
