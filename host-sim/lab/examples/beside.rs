//! Our side of `cargo xtask beside`: does the work of another program on the same files, in one
//! process, and measures its processor time. Prints one line of JSON.
//!
//! ```text
//! beside allan INCREMENTS.f64 HZ
//! beside filter IMU.txt GNSS.txt TRUTH.csv UNIT.toml
//! ```

use std::path::Path;

use host_core::error::Error;
use host_core::inertial::ekf::{Aided, ErrorModel};
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG_PER_H;
use host_estimation::analysis::allan::{Kind, Series, analyse};
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::{InitialAttitude, kfgins};
use host_unit::Unit;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let line = match words[..] {
        ["allan", file, hz] => serde_json::to_string(&allan(Path::new(file), hz.parse()?)?)?,
        ["filter", imu, gnss, truth, unit] => {
            let session = session(Path::new(imu), Path::new(gnss), Path::new(truth))?;
            serde_json::to_string(&filters(&session, &Unit::load(unit)?))?
        }
        _ => return Err("give allan FILE HZ, or filter IMU GNSS TRUTH UNIT".into()),
    };
    println!("{line}");
    Ok(())
}

/// Processor time of this process so far, all threads, s.
fn processor_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Elapsed time and processor time of a piece of work, s.
fn timed<T>(work: impl FnOnce() -> T) -> (T, [f64; 2]) {
    let (start, before) = (std::time::Instant::now(), processor_s());
    let done = work();
    (
        done,
        [start.elapsed().as_secs_f64(), processor_s() - before],
    )
}

#[derive(Serialize)]
struct Deviations {
    /// The whole analysis: deviations, their intervals, the fit of five noises.
    seconds: [f64; 2],
    /// Averaging time, s, and deviation, rad/s.
    curve: Vec<(f64, f64)>,
}

/// Analyses one column of increments, a file of plain numbers (f64, little endian).
fn allan(file: &Path, rate_hz: f64) -> Result<Deviations, Failure> {
    let bytes = std::fs::read(file)?;
    let (eights, _) = bytes.as_chunks();
    let increments = eights.iter().map(|b| f64::from_le_bytes(*b)).collect();
    drop(bytes);
    let series = Series {
        column: "increments".into(),
        kind: Kind::Gyro,
        rate_hz,
        increments,
    };
    let (analysis, seconds) = timed(|| analyse(series));
    let curve = analysis.ok_or("the column never changes")?.curve;
    let points = curve.iter().map(|p| (p.tau_s, p.deviation * DEG_PER_H));
    Ok(Deviations {
        seconds,
        curve: points.collect(),
    })
}

/// The drive with the true attitude at its start.
fn session(imu: &Path, gnss: &Path, truth: &Path) -> Result<Session, Error> {
    let mut record = kfgins::read(imu, gnss, None)?;
    let truth = kfgins::read_truth(truth)?;
    let attitude = truth.at(record.first_epoch()).q_bn;
    record.initial_attitude = Some(InitialAttitude::Known(attitude));
    record.truth = Some(truth);
    record.session()
}

#[derive(Serialize)]
struct Filtered {
    filter: &'static str,
    /// Number of states: navigation errors and sensor errors.
    states: usize,
    /// Whether the covariance is propagated at each sample, as in KF-GINS, or once a fix.
    each_sample: bool,
    samples: usize,
    seconds: [f64; 2],
    /// Root mean square of the horizontal error at the fixes, m.
    horizontal_m: f64,
}

/// The filters beside the networks, on all samples and fixes of the drive.
fn filters(session: &Session, unit: &Unit) -> Vec<Filtered> {
    let assumptions = Assumptions::of(unit);
    let prior = assumptions.walking(assumptions.datasheet_walk()).prior;
    let models = [
        ("ekf12", ErrorModel::with_scale(&prior)),
        ("ekf24", ErrorModel::with_matrices(&prior)),
    ];
    let both = models
        .into_iter()
        .flat_map(|m| [(m.clone(), false), (m, true)]);
    both.map(|((filter, model), each_sample)| {
        let ((states, horizontal_m), seconds) =
            timed(|| filtered(session, &assumptions, model, each_sample));
        Filtered {
            filter,
            states,
            each_sample,
            samples: session.counts.len(),
            seconds,
            horizontal_m,
        }
    })
    .collect()
}

/// Number of states, and the horizontal error.
fn filtered(
    session: &Session,
    assumptions: &Assumptions,
    model: ErrorModel,
    each_sample: bool,
) -> (usize, f64) {
    let start = session.referenced(0);
    let sigma = assumptions.initial_sigma(&start, &session.nearest_fix(0).start_sigmas());
    let mut filter = Aided::new(start, &sigma, model, assumptions.noise);
    let increments = session.increments();
    let seconds = increments.chunks_exact(session.samples_per_epoch());
    let mut squares = 0.0;
    for (k, second) in (1..).zip(seconds) {
        for (i, increment) in second.iter().enumerate() {
            filter.step(increment, session.dt);
            if each_sample && i + 1 < second.len() {
                filter.take(None);
            }
        }
        filter.take(session.fixes.get(k).and_then(Option::as_ref));
        let off = filter
            .sins
            .nav
            .position
            .ned_from(&session.referenced(k).position);
        squares += off.xy().norm_squared();
    }
    let mean = squares / session.epochs().max(1) as f64;
    (filter.p.nrows(), mean.sqrt())
}
