//! The filters with feedback from fixes, beside KF-GINS: a drive of 27 minutes at 200 samples and
//! one position a second, in the files that KF-GINS reads.
//!
//! KF-GINS calls a sample an epoch. Its covariance of 21 states is propagated with each sample by
//! dense products, and its program reads and writes text, three lines a sample. Ours accumulates
//! the transition and propagates the covariance once a fix. So ours is also measured with the
//! covariance propagated at each sample, and the text of KF-GINS is a part of its time.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::session::Session;
use host_core::inertial::units::{DEG, DEG_PER_H, DEG_PER_SQRT_H, PPM};
use host_core::simulator::session::{SessionConfig, simulate};
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::kfgins::{self, Form};
use host_io::recordings::record::Record;
use host_unit::Unit;
use serde::Deserialize;

use super::{Programs, ROUNDS, peak, seconds};
use crate::child::{self, Used, spread};
use crate::table::{markdown, thousands};

/// Standstill and drive, s.
const LENGTH_S: [f64; 2] = [300.0, 1320.0];
/// The second of the week at which the drive begins.
const WEEK_S: f64 = 1000.0;
/// The unit of the drive.
const UNIT: &str = "medium";
/// The remedy where KF-GINS is missing.
const REMEDY: &str = "build it with -DCMAKE_BUILD_TYPE=Release \
                      (https://github.com/i2Nav-WHU/KF-GINS), then KFGINS=/path/to/KF-GINS cargo \
                      xtask beside";

/// A row of our program's output.
#[derive(Clone, Debug, Deserialize)]
struct Filtered {
    filter: String,
    states: usize,
    each_sample: bool,
    samples: usize,
    /// Elapsed time and processor time, s.
    seconds: [f64; 2],
    horizontal_m: f64,
}

/// One program's runs: processor time, s.
struct Row {
    name: String,
    states: usize,
    times: Vec<f64>,
    horizontal_m: f64,
}

/// Measures both programs, and returns the table.
pub fn measure(programs: &Programs) -> Result<String> {
    let unit = Unit::load(UNIT)?;
    let session = drive(&unit);
    let files = Files::write(programs, &session, &unit)?;
    let theirs = std::env::var_os("KFGINS").map(PathBuf::from);
    if theirs.is_none() {
        eprintln!("skipped: KF-GINS, which KFGINS does not name; to see it beside us: {REMEDY}");
    }
    let (mut ours, mut kf_gins): (Vec<Vec<Filtered>>, Vec<Used>) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        eprintln!("      round {} of {ROUNDS}", round + 1);
        let mut command = Command::new(&programs.ours);
        command
            .arg("filter")
            .args([&files.imu, &files.gnss, &files.truth])
            .arg(UNIT);
        let line = child::run(&mut command)?.output;
        ours.push(serde_json::from_str(&line).with_context(|| format!("it printed {line:?}"))?);
        if let Some(program) = &theirs {
            kf_gins.push(child::run(Command::new(program).arg(&files.config))?);
        }
    }
    let first = ours.first().context("no round")?;
    let samples = session.counts.len();
    ensure!(
        first.iter().all(|row| row.samples == samples),
        "{samples} samples were written, and other numbers read: {first:?}"
    );
    let mut rows: Vec<Row> = (0..first.len()).map(|k| ours_as_row(&ours, k)).collect();
    if !kf_gins.is_empty() {
        rows.push(Row {
            name: "KF-GINS, each sample, with its text files".to_owned(),
            states: 21,
            times: kf_gins.iter().filter_map(|used| used.cpu_s).collect(),
            horizontal_m: solution_error(&files.solution, &session)?,
        });
    }
    text(&session, &rows, &kf_gins)
}

fn ours_as_row(rounds: &[Vec<Filtered>], k: usize) -> Row {
    let first = &rounds[0][k];
    let how = if first.each_sample {
        "each sample"
    } else {
        "once a fix"
    };
    Row {
        name: format!("`{}`, covariance {how}", first.filter),
        states: first.states,
        times: rounds.iter().map(|round| round[k].seconds[1]).collect(),
        horizontal_m: first.horizontal_m,
    }
}

fn text(session: &Session, rows: &[Row], kf_gins: &[Used]) -> Result<String> {
    let samples = session.counts.len() as f64;
    let mut out = format!(
        "**Filters**: {} samples (200 a second) of `{UNIT}` with a position a second, one core, \
         processor time; medians and ranges of {ROUNDS} processes in turn on the same files. An \
         epoch is a sample, as KF-GINS counts. Ours is the filter alone, in memory.\n\n",
        thousands(samples)
    );
    let header = ["", "states", "s", "epochs/s", "horizontal RMS, m"].map(str::to_owned);
    let cells = rows.iter().map(|row| {
        ensure!(
            !row.times.is_empty(),
            "{}: no processor time is known",
            row.name
        );
        let times = spread(row.times.clone());
        Ok(vec![
            row.name.clone(),
            row.states.to_string(),
            seconds(times),
            thousands(samples / times[1]),
            format!("{:.2}", row.horizontal_m),
        ])
    });
    let cells = cells.collect::<Result<Vec<_>>>()?;
    out += &markdown(&header, cells.into_iter());
    match kf_gins {
        [] => out += "\nKF-GINS was not there.\n\n",
        runs => writeln!(out, "\nKF-GINS held at most {} MiB.\n", peak(runs))?,
    }
    Ok(out)
}

/// The drive and its session.
fn drive(unit: &Unit) -> Session {
    let mut imu = unit.simulated();
    imu.rate_hz = 200;
    let config = SessionConfig {
        start: Geodetic {
            lat: 28.2 * DEG,
            lon: 112.9 * DEG,
            h: 60.0,
        },
        heading: 35.0 * DEG,
        ..SessionConfig::new(&imu, [LENGTH_S[0], LENGTH_S[1]], [1, 2, 3])
    };
    simulate(&config).0
}

/// The files of the drive.
struct Files {
    imu: PathBuf,
    gnss: PathBuf,
    truth: PathBuf,
    /// KF-GINS' configuration, and the solution that it writes.
    config: PathBuf,
    solution: PathBuf,
}

impl Files {
    fn write(programs: &Programs, session: &Session, unit: &Unit) -> Result<Self> {
        let at = |name: &str| programs.folder.join(name);
        let files = Self {
            imu: at("imu.txt"),
            gnss: at("gnss.txt"),
            truth: at("truth.txt"),
            config: at("kf-gins.yaml"),
            solution: at("KF_GINS_Navresult.nav"),
        };
        let form = Form {
            shift_s: WEEK_S,
            velocity: false,
        };
        kfgins::write(
            &Record::from_session(session),
            form,
            &files.imu,
            &files.gnss,
        )?;
        let mut truth = String::new();
        for (k, state) in session.reference.iter().enumerate() {
            let (p, v) = (state.position, state.velocity);
            let (roll, pitch, yaw) = to_euler(&state.q_bn);
            let [lat, lon, roll, pitch, yaw] = [p.lat, p.lon, roll, pitch, yaw].map(|x| x / DEG);
            let time = WEEK_S + k as f64;
            writeln!(
                truth,
                "0 {time} {lat} {lon} {} {} {} {} {roll} {pitch} {yaw}",
                p.h, v.x, v.y, v.z
            )?;
        }
        let save = |path: &Path, text: String| {
            fs::write(path, text).with_context(|| path.display().to_string())
        };
        save(&files.truth, truth)?;
        save(
            &files.config,
            configuration(programs, session, unit, &files),
        )?;
        Ok(files)
    }
}

/// Configuration of KF-GINS: the state at the start, and the same sensor model as that of our
/// filter.
fn configuration(programs: &Programs, session: &Session, unit: &Unit, files: &Files) -> String {
    let assumptions = Assumptions::of(unit);
    let start = session.referenced(0);
    let sigma = assumptions.initial_sigma(&start, &session.nearest_fix(0).start_sigmas());
    let (roll, pitch, yaw) = to_euler(&start.q_bn);
    let [lat, lon] = [start.position.lat, start.position.lon].map(|x| x / DEG);
    let attitude = [roll, pitch, yaw].map(|x| x / DEG);
    let three = |x: f64| [x; 3];
    let milligal = 1e-5; // its unit of specific force, m/s2
    let attitude_sigma = [sigma.tilt, sigma.tilt, sigma.heading].map(|x| x / DEG);
    format!(
        "imupath: {:?}\ngnsspath: {:?}\noutputpath: {:?}\nimudatalen: 7\nimudatarate: 200\n\
         starttime: {}\nendtime: -1\ninitpos: [{lat}, {lon}, {}]\ninitvel: [{}, {}, {}]\n\
         initatt: {attitude:?}\ninitgyrbias: [0, 0, 0]\ninitaccbias: [0, 0, 0]\n\
         initgyrscale: [0, 0, 0]\ninitaccscale: [0, 0, 0]\ninitposstd: {:?}\ninitvelstd: {:?}\n\
         initattstd: {attitude_sigma:?}\nimunoise:\n  arw: {:?}\n  vrw: {:?}\n  gbstd: {:?}\n  \
         abstd: {:?}\n  gsstd: {:?}\n  asstd: {:?}\n  corrtime: 4.0\nantlever: [0, 0, 0]\n",
        files.imu,
        files.gnss,
        programs.folder,
        WEEK_S + session.dt,
        start.position.h,
        start.velocity.x,
        start.velocity.y,
        start.velocity.z,
        three(sigma.position),
        three(sigma.velocity),
        three(assumptions.noise.gyro / DEG_PER_SQRT_H),
        three(assumptions.noise.accel * 60.0),
        three(assumptions.prior.gyro_bias / DEG_PER_H),
        three(assumptions.prior.accel_bias / milligal),
        three(assumptions.prior.scale[0] / PPM),
        three(assumptions.prior.scale[1] / PPM),
    )
}

/// Root of the mean square of the horizontal error of KF-GINS' solution at whole seconds, m.
fn solution_error(file: &Path, session: &Session) -> Result<f64> {
    let text = fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let (mut sum, mut count) = (0.0, 0.0);
    for line in text.lines() {
        let numbers: Vec<f64> = line
            .split_whitespace()
            .filter_map(|x| x.parse().ok())
            .collect();
        let [_, time, lat, lon, h, ..] = numbers[..] else {
            continue;
        };
        let since = time - WEEK_S;
        let truth = session.reference.get(since.round() as usize);
        let Some(truth) = truth.filter(|_| (since - since.round()).abs() < 1e-4) else {
            continue;
        };
        let [lat, lon] = [lat, lon].map(|x| x * DEG);
        let off = Geodetic { lat, lon, h }.ned_from(&truth.position);
        sum += off.xy().norm_squared();
        count += 1.0;
    }
    ensure!(
        count >= session.epochs() as f64 - 2.0,
        "{}: {count} whole seconds",
        file.display()
    );
    Ok((sum / count).sqrt())
}
