//! The corrections that a scheme subtracts from the samples of a recording, for output of the
//! corrected recording. The scheme's row of the table was navigated with them.
//!
//! | scheme | subtracted |
//! |---|---|
//! | `raw` | nothing |
//! | `ls-bias`, `ls-3x3` | the fitted errors, from the first epoch on |
//! | `rnn` | the output of the two networks, from the first epoch on |
//! | `ekf6`, `ekf12`, `ekf24` | nothing while the filter learns, then its last estimate |
//! | `device` | what it had in force in each second, and after the split what it had stored |
//!
//! Before the first epoch nothing is subtracted. After the last one the last correction stays.

use host_core::inertial::ekf::Aided;
use host_core::inertial::session::EPOCH_S;
use host_core::inertial::sins::Increment;
use host_estimation::learning::baseline::LinearModel;
use host_io::recordings::gaps::{gaps, pairs};
use host_io::recordings::pace::Pace;
use host_io::recordings::record::{Kind, Record};
use nalgebra::Vector3;

/// Schemes whose corrections can be written.
pub const SCHEMES: [&str; 8] = [
    "raw", "ls-bias", "ls-3x3", "ekf6", "ekf12", "ekf24", "rnn", "device",
];

/// The correction by one scheme, which is subtracted.
#[derive(Debug, Clone)]
pub enum Correction {
    /// Nothing.
    Nothing,
    /// A function of each sample.
    Linear(LinearModel),
    /// The filter's last estimate, from this epoch on.
    Filter(Box<Aided>, usize),
    /// The errors of each epoch, rad/s and m/s2. The last ones stay.
    Epochs(Vec<[[f32; 3]; 2]>),
}

impl Correction {
    /// The correction of each sample of `record`, in the form of its samples. The first epoch is at
    /// time `begin` on the clock of the IMU, s.
    #[must_use]
    pub fn taken(&self, record: &Record, begin: f64) -> Vec<Increment> {
        let lengths = lengths(record);
        let samples = record.time.each().zip(record.samples.each()).zip(lengths);
        let taken = |((time, sample), length): ((f64, Increment), f64)| {
            let since = time - begin;
            match record.kind {
                _ if since <= SAME_S => Increment::default(),
                Kind::Rate => self.of(&sample, since, 0.0, 1.0),
                Kind::Increment => self.of(&sample, since, length, length),
            }
        };
        samples.map(taken).collect()
    }

    /// The correction of a sample that ends `since` seconds after the first epoch and covers
    /// `length` seconds, scaled to `weight` seconds.
    fn of(&self, sample: &Increment, since: f64, length: f64, weight: f64) -> Increment {
        let less = |corrected: Increment| Increment {
            dtheta: sample.dtheta - corrected.dtheta,
            dv: sample.dv - corrected.dv,
        };
        match self {
            Self::Nothing => Increment::default(),
            Self::Linear(model) => less(model.correct(sample, weight)),
            Self::Filter(_, from) if since < *from as f64 * EPOCH_S + SAME_S => {
                Increment::default()
            }
            Self::Filter(filter, _) => less(filter.corrected(sample, weight)),
            Self::Epochs(errors) => {
                let [rate, force] = mean(errors, since, length);
                Increment {
                    dtheta: rate * weight,
                    dv: force * weight,
                }
            }
        }
    }
}

/// Times closer than this are the same, s.
const SAME_S: f64 = 1e-6;

/// Durations of the increments, s.
fn lengths(record: &Record) -> Vec<f64> {
    let pace = Pace::of(&record.time);
    let (step, gaps) = (pace.step, gaps(&record.time, record.kind, &pace));
    let mut gaps = gaps.iter().map(|gap| gap.next).peekable();
    let length = |(k, [before, now]): (usize, [f64; 2])| match gaps.next_if_eq(&(k + 1)) {
        Some(_) => step,
        None => now - before,
    };
    let first = std::iter::once(step);
    first
        .chain(pairs(&record.time).enumerate().map(length))
        .collect()
}

/// Mean errors over the `length` seconds that end `since` seconds after the first epoch.
fn mean(errors: &[[[f32; 3]; 2]], since: f64, length: f64) -> [Vector3<f64>; 2] {
    let of = |epoch: usize| {
        let of = errors.get(epoch).or(errors.last());
        of.map_or([Vector3::zeros(); 2], |e| {
            e.map(|triad| Vector3::from(triad.map(f64::from)))
        })
    };
    // a sample that ends at an epoch belongs to the second before it
    let epoch = |t: f64| ((t / EPOCH_S).max(0.0)) as usize;
    let [first, last] = [epoch(since - length + SAME_S), epoch(since - SAME_S)];
    if first >= last {
        return of(last);
    }
    let share = ((since - last as f64 * EPOCH_S) / length).clamp(0.0, 1.0);
    let [a, b] = [of(first), of(last)];
    [0, 1].map(|k| a[k].lerp(&b[k], share))
}
