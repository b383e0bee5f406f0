//! Results of an experiment: rows of the table, curves, and the other contents of a report.

use crate::experiment::outcome::Bench;
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::session::EPOCH_S;
use host_core::inertial::units::MIN;
use host_estimation::learning::device::Course;

/// Version of the JSON of `run` and `replay`. 1 had no version, and the row `rnn-kalman` in place
/// of `device`; in 2 the navigators of a replay began at states of their own, and `start` is not
/// there.
pub const SCHEMA: u32 = 3;

/// Errors of one scheme at one time, compared with the reference.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Seconds since the start of free-inertial navigation.
    pub t_s: u32,
    /// `raw`, `ls-bias`, `ls-3x3`, `ekf6`, `ekf12`, `ekf24`, `rnn`, `device`.
    pub scheme: String,
    /// Position error north, m.
    pub d_north_m: f64,
    /// Position error east, m.
    pub d_east_m: f64,
    /// North velocity error, m/s.
    pub d_vn_mps: f64,
    /// East velocity error, m/s.
    pub d_ve_mps: f64,
    /// Horizontal position error, m.
    pub horizontal_m: f64,
}

impl Row {
    /// Row of the table after `t_s` seconds of free-inertial navigation, if it lasts that long.
    #[must_use]
    pub fn of(free: &FreeInertial, scheme: &str, t_s: u32) -> Option<Self> {
        let k = t_s as usize;
        let (p, v) = (free.position.get(k)?, free.velocity.get(k)?);
        Some(Self {
            t_s,
            scheme: scheme.to_string(),
            d_north_m: p.x,
            d_east_m: p.y,
            d_vn_mps: v.x,
            d_ve_mps: v.y,
            horizontal_m: p.xy().norm(),
        })
    }
}

/// The result table; its serialised form is the `--json` format and stays stable.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Results {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Scenario name, or `lasergyro` and so on for a replay.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// One row for each time and scheme, times ascending, schemes in display order within a time.
    pub rows: Vec<Row>,
    /// What the device did in the last drive that it learnt from.
    #[serde(skip)]
    pub device: Option<Course>,
}

/// One curve: same length of `x` and `y`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    /// Legend text: a scheme's name or `reference`; for learning `network: part`, as in
    /// `gyros: held back`.
    pub name: String,
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates.
    pub y: Vec<f64>,
}

/// True sensor error and the output of the network, for one axis (the paper's figure 2).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ErrorTrace {
    /// For example `gyro x`.
    pub axis: String,
    /// For example `deg/h`.
    pub unit: String,
    /// Minutes since power-on.
    pub t_min: Vec<f64>,
    /// Slow error of the sensor (running median over a minute); empty if it is not known
    /// (recordings).
    pub truth: Vec<f64>,
    /// Estimate of the teacher while learning; NaN where there was none; may be empty.
    pub teacher: Vec<f64>,
    /// Output of the network.
    pub network: Vec<f64>,
}

/// Curves of the pictures of an experiment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves {
    /// East (x) and north (y) of the reference and of each scheme, m.
    pub track: Vec<Curve>,
    /// Horizontal error in metres over minutes, one curve for each scheme.
    pub error_over_time: Vec<Curve>,
    /// Cost over passes, one curve for each network and part of the data (learnt from, held back).
    pub learning: Vec<Curve>,
    /// Sensor errors of six axes on the data learnt from, gyros first.
    pub traces: Vec<ErrorTrace>,
}

impl Curves {
    /// Track and errors of several solutions beside the reference's track (north, east, m). Only
    /// errors at epochs that are `judged` are shown.
    #[must_use]
    pub fn of(
        solutions: &[(&str, FreeInertial)],
        reference: &[[f64; 2]],
        judged: impl Fn(&usize) -> bool,
    ) -> Self {
        let curve = |name: &str, points: Vec<(f64, f64)>| {
            let (x, y) = points.into_iter().unzip();
            Curve {
                name: name.to_owned(),
                x,
                y,
            }
        };
        let track = |p: &[[f64; 2]]| p.iter().map(|p| (p[1], p[0])).collect();
        let error = |c: &FreeInertial| {
            let all = c.position.iter().enumerate().filter(|(k, _)| judged(k));
            all.map(|(k, p)| (k as f64 * EPOCH_S / MIN, p.xy().norm()))
                .collect()
        };
        let mut out = Self::default();
        out.track.push(curve("reference", track(reference)));
        for (scheme, c) in solutions {
            out.track.push(curve(scheme, track(&c.track)));
            out.error_over_time.push(curve(scheme, error(c)));
        }
        out
    }
}

/// Contents of the page.
#[derive(Debug, Clone)]
pub struct Report {
    /// One line.
    pub title: String,
    /// The table.
    pub results: Results,
    /// Labels and values of the set-up: preset, rates, durations, seeds, settings of learning. The
    /// value labelled `command` is the command that regenerates this report.
    pub set_up: Vec<(String, String)>,
    /// Notes for the reader, in sentences: the alignment, whether the correction stayed at zero and
    /// why, and so on.
    pub notes: Vec<String>,
    /// Curves of the pictures.
    pub curves: Curves,
    /// The device's results in a replay.
    pub bench: Option<Box<Bench>>,
}
