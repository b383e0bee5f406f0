//! Detection of standstill from the samples, half a second after the other.
//!
//! Such a window passes when three conditions hold:
//!
//! - **steady**: mean rate and specific force differ from those of the standstill so far by no more
//!   than noise and sway explain (5 sigma an axis).
//! - **slow**: biases allowed for, the rate is at most the Earth's.
//! - **level**: biases allowed for, the force is gravity's.
//!
//! A *rest*, which is believed without a receiver, is also **quiet**: its samples scatter no more
//! than 1.5 times as much as in the quietest two seconds so far, or than sway explains. An idling
//! engine shakes a car less than a road does, whatever the sensor's noise is. An engine that is
//! started at a standstill shakes more from one moment to the next, while mean rate and force stay:
//! after two such seconds its level counts as quiet. It does too where a receiver shows that the
//! vehicle stands.
//!
//! The mean rate of a rest is of its last seconds: of so many that the walk of the biases adds as
//! much to its error as noise does.
//!
//! Where wheels are reported, only windows in which they stand are looked at, so that the quietest
//! of them is a rest's. Wheels that stand do not make a rest of what is none: a vehicle on a ferry,
//! or with locked wheels.
//!
//! A vehicle that moves straight and evenly from power-on can pass too: a caller that knows a
//! velocity reports motion by [`Standstill::moves`].

use crate::nav::vector::{V32, add, dot, scale};
use crate::sample::{Counts, Lsb};

/// Datasheet of the sensors, for the detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensors {
    /// White noise of the gyros, rad/sqrt(s), and of the accelerometers, m/s/sqrt(s).
    pub noise: [f32; 2],
    /// Standard deviation of the biases, rad/s and m/s2.
    pub bias: [f32; 2],
    /// Random walk of the gyros' biases, rad/s/sqrt(s).
    pub walk: f32,
}

/// Length of a window, s.
pub const WINDOW_S: f32 = 0.5;
/// Windows in a row from which a standstill is one.
pub const RESTS: u32 = 4;
/// Windows at the end of a rest in which a departure may have begun.
const DEPARTS: usize = 2;
/// Windows over which the quietest scatter is taken, and after which a louder one is believed.
const LEVELS: usize = 4;
/// Largest scatter, in units of the quietest (`docs/REAL.md`: five real units).
const QUIET: f32 = 1.5;
/// Scatter that counts as quiet whatever the quietest was, rad/s and m/s2: people and wind sway a
/// standing vehicle so much, now and then (assumed).
const SWAYS: [f32; 2] = [1.5e-3, 0.07];
/// Scatter at rest, in units of that of a vehicle under way (assumed).
const QUIETER: f32 = 0.95;
/// Sway of a standing vehicle by people and wind: standard deviations of the mean rate (rad/s) and
/// specific force (m/s2) of a window. Assumed: 1e-4 rad and 5 mm/s at each end.
const SWAY: [f32; 2] = [2.8e-4, 0.014];
/// Largest deviation, in standard deviations.
const GATE: f32 = 5.0;
/// Largest bias, in standard deviations: datasheets are wrong by up to ten times.
const BIASES: f32 = 10.0;
/// Earth rate, rad/s.
const EARTH: f32 = 7.292e-5;
/// Least number of windows that a mean rate is of.
const LEAST_MEAN: f32 = 12.0;
/// Noise of such a mean in units of what white noise adds: vibration has low frequencies as well
/// (assumed).
const COLOURED: f32 = 2.0;
/// Gravity on Earth from 9 km high at the equator to the pole, m/s2.
const GRAVITY: [f32; 2] = [9.752, 9.833];

/// The detector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// Largest difference of a component from the mean so far, rad/s and m/s2.
    step: [f32; 2],
    /// Largest rate, and largest distance of the force from gravity's range.
    rate: f32,
    force: f32,
    window: Window,
    /// Scatter of the last windows, the oldest first, and the least mean of them.
    levels: [[f32; 2]; LEVELS],
    quietest: [f32; 2],
    /// Windows so far, up to [`LEVELS`].
    known: usize,
    /// Windows in a row of the standstill that were quiet.
    quiet: u32,
    /// Mean rate of these but the first [`RESTS`] and the last, whose rates wait, the oldest first:
    /// of so many windows at most.
    rest: V32,
    longest: u32,
    pending: [V32; DEPARTS],
    /// The standstill has had a rest.
    rested: bool,
    /// Windows in a row since then that were not quiet.
    louder: u32,
    /// Means of the standstill, and the number of its windows.
    mean: [V32; 2],
    windows: u32,
    /// A receiver has shown a standstill to be one, and the present one.
    confirmed: bool,
    shown: bool,
    /// A standstill has ended since [`Standstill::passes`] was called last.
    broken: bool,
    /// Difference of the last window's force from the mean before it, m/s2.
    change: f32,
    wheels: Wheels,
}

/// What the wheels have shown in the window in progress, or in the last one if they have shown
/// nothing since.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wheels {
    Unknown,
    Stand { fresh: bool },
    Turn { fresh: bool },
}

/// The window in progress.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Window {
    /// Rate and force of a count, rad/s and m/s2.
    worth: [f32; 2],
    first: Counts,
    samples: u32,
    /// Sums of the differences to the first sample, and of their squares over the axes, counts.
    sums: [V32; 2],
    squares: [f32; 2],
}

/// A rest in progress.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Mean rate of its last windows, rad/s, but for the first two seconds, in which a vehicle
    /// settles, and the last one, in which a departure may have begun.
    pub rate: V32,
    /// Time of that mean, s.
    pub seconds: f32,
    /// Time of the rest, s.
    pub stood_s: f32,
    /// Scatter of the last samples' rates, rad/s: the root of the variances' sum over the axes.
    pub scatter: f32,
}

/// Mean rate and force of a window, and their scatter from sample to sample: the root of the
/// variances' sum over the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WindowMean {
    mean: [V32; 2],
    scatter: [f32; 2],
}

impl Window {
    fn sample(&mut self, counts: &Counts) {
        if self.samples == 0 {
            self.first = *counts;
            (self.sums, self.squares) = ([[0.0; 3]; 2], [0.0; 2]);
        }
        self.samples = self.samples.saturating_add(1);
        let first = [self.first.dtheta, self.first.dv];
        let triads = [counts.dtheta, counts.dv].into_iter().zip(first);
        let sums = self.sums.iter_mut().zip(&mut self.squares);
        for ((now, first), (sums, squares)) in triads.zip(sums) {
            for ((now, first), sum) in now.into_iter().zip(first).zip(sums) {
                let off = now.wrapping_sub(first) as f32;
                *sum += off;
                *squares += off * off;
            }
        }
    }

    /// The window ends; `None`: it has no sample.
    fn end(&mut self) -> Option<WindowMean> {
        let n = core::mem::take(&mut self.samples) as f32;
        if n == 0.0 {
            return None;
        }
        let first = [self.first.dtheta, self.first.dv];
        Some(WindowMean {
            mean: [0, 1].map(|k| {
                let mean = |i: usize| first[k][i] as f32 + self.sums[k][i] / n;
                [0, 1, 2].map(|i| mean(i) * self.worth[k])
            }),
            scatter: [0, 1].map(|k| {
                let squares = self.squares[k] - dot(self.sums[k], self.sums[k]) / n;
                // no finer than a count on each axis
                let variance = (squares / (n - 1.0).max(1.0)).max(3.0);
                libm::sqrtf(variance) * self.worth[k]
            }),
        })
    }
}

impl Standstill {
    /// A detector with thresholds from the sensors' noise and biases, for samples of this count
    /// value, one every `sample_s` seconds (> 0).
    #[must_use]
    pub fn new(sensors: &Sensors, lsb: Lsb, sample_s: f64) -> Self {
        let sway = [0, 1].map(|k| {
            let noise = sensors.noise[k];
            libm::sqrtf(noise * noise / WINDOW_S + SWAY[k] * SWAY[k])
        });
        Self {
            step: sway.map(|sway| GATE * core::f32::consts::SQRT_2 * sway),
            rate: EARTH + GATE * sway[0] + BIASES * sensors.bias[0],
            force: GATE * sway[1] + BIASES * sensors.bias[1],
            window: Window {
                worth: [lsb.rad, lsb.mps].map(|worth| (worth / sample_s) as f32),
                first: Counts::default(),
                samples: 0,
                sums: [[0.0; 3]; 2],
                squares: [0.0; 2],
            },
            levels: [[0.0; 2]; LEVELS],
            quietest: [f32::INFINITY; 2],
            known: 0,
            quiet: 0,
            rest: [0.0; 3],
            // noise adds noise^2 / T to the variance, the walk walk^2 T / 2
            longest: (core::f32::consts::SQRT_2 * COLOURED * sensors.noise[0]
                / sensors.walk
                / WINDOW_S)
                .max(LEAST_MEAN) as u32, // `as` saturates
            pending: [[0.0; 3]; DEPARTS],
            rested: false,
            louder: 0,
            mean: [[0.0; 3]; 2],
            windows: 0,
            confirmed: false,
            shown: false,
            broken: false,
            change: 0.0,
            wheels: Wheels::Unknown,
        }
    }

    /// The wheels stand, or turn. While they turn no window passes, and none counts as quiet; a
    /// speed of wheels is believed for up to a second.
    pub fn wheels(&mut self, stand: bool) {
        self.wheels = match (self.wheels, stand) {
            (Wheels::Turn { fresh: true }, true) | (_, false) => Wheels::Turn { fresh: true },
            (_, true) => Wheels::Stand { fresh: true },
        };
    }

    /// Whether the wheels have turned in the window that ends.
    fn turned(&mut self) -> bool {
        let now = self.wheels;
        self.wheels = match now {
            Wheels::Stand { fresh: true } => Wheels::Stand { fresh: false },
            Wheels::Turn { fresh: true } => Wheels::Turn { fresh: false },
            _ => Wheels::Unknown,
        };
        matches!(now, Wheels::Turn { .. })
    }

    /// Takes a sample.
    pub fn sample(&mut self, counts: &Counts) {
        self.window.sample(counts);
    }

    /// Ends a window of half a second.
    pub fn end_window(&mut self) {
        let Some(of) = self.window.end() else {
            return;
        };
        if self.turned() {
            self.broken |= self.windows > 0;
            return self.moves();
        }
        let quiet = self.hears(of.scatter);
        let [rate, force] = of.mean;
        let difference = add(force, scale(self.mean[1], -1.0));
        self.change = libm::sqrtf(dot(difference, difference));
        let steady = self.windows > 0 && self.is_steady(&of.mean);
        let size = libm::sqrtf(dot(force, force));
        let slow = dot(rate, rate) <= self.rate * self.rate;
        let level = size >= GRAVITY[0] - self.force && size <= GRAVITY[1] + self.force;
        let stands = slow && level;
        self.broken |= self.windows > 0 && !(stands && steady);
        if !(stands && steady) {
            self.moves();
        }
        if !stands {
            return;
        }
        // a window that ends a standstill may begin another one
        self.windows = self.windows.saturating_add(1);
        let share = 1.0 / self.windows as f32;
        for (mean, now) in self.mean.iter_mut().zip(&of.mean) {
            for (mean, now) in mean.iter_mut().zip(now) {
                *mean += (now - *mean) * share;
            }
        }
        if quiet {
            self.louder = 0;
            self.rests(rate);
        } else {
            self.quiet = 0;
            self.gets_louder();
        }
    }

    /// A quiet window goes on with a rest, or begins one.
    fn rests(&mut self, rate: V32) {
        self.quiet = self.quiet.saturating_add(1);
        self.rested |= self.quiet >= RESTS;
        let [before, ..] = self.pending;
        self.pending.rotate_left(1);
        if let Some(last) = self.pending.last_mut() {
            *last = rate;
        }
        let windows = self.windows_of_mean();
        if windows == 0 {
            self.rest = [0.0; 3];
            return;
        }
        let share = 1.0 / windows as f32;
        for (mean, before) in self.rest.iter_mut().zip(before) {
            *mean += (before - *mean) * share;
        }
    }

    /// Windows in the mean of a rest.
    fn windows_of_mean(&self) -> u32 {
        let all = self.quiet.saturating_sub(RESTS + DEPARTS as u32);
        all.min(self.longest)
    }

    /// Notes the scatter of a window: whether it is quiet.
    fn hears(&mut self, scatter: [f32; 2]) -> bool {
        self.levels.rotate_left(1);
        if let Some(last) = self.levels.last_mut() {
            *last = scatter;
        }
        self.known = (self.known + 1).min(LEVELS);
        if self.known < LEVELS {
            return true; // nothing to compare with
        }
        let mut quiet = true;
        for (k, quietest) in self.quietest.iter_mut().enumerate() {
            let all: f32 = self.levels.iter().map(|level| level[k]).sum();
            *quietest = quietest.min(all / LEVELS as f32);
            quiet &= scatter[k] <= (QUIET * *quietest).max(SWAYS[k]);
        }
        quiet
    }

    /// A window of a standstill shakes more: its level counts as quiet when it has lasted.
    fn gets_louder(&mut self) {
        self.louder = if self.rested || self.shown {
            self.louder + 1
        } else {
            0
        };
        if self.louder >= LEVELS as u32 {
            self.louder = 0;
            let sum = |k: usize| self.levels.iter().map(|level| level[k]).sum::<f32>();
            self.quietest = [0, 1].map(|k| self.quietest[k].max(sum(k) / LEVELS as f32));
        }
    }

    fn is_steady(&self, now: &[V32; 2]) -> bool {
        [0, 1].into_iter().all(|k| {
            let mut pairs = now[k].iter().zip(&self.mean[k]);
            pairs.all(|(a, b)| (a - b).abs() <= self.step[k])
        })
    }

    /// Whether the vehicle has stood since the last call.
    pub fn passes(&mut self) -> bool {
        !core::mem::take(&mut self.broken) && self.windows > 0
    }

    /// Another source shows that the vehicle moves.
    pub fn moves(&mut self) {
        (self.windows, self.quiet, self.louder) = (0, 0, 0);
        (self.rested, self.shown) = (false, false);
    }

    /// Another source shows that the vehicle stands, as the detector finds.
    pub fn is_right(&mut self) {
        (self.confirmed, self.shown) = (true, true);
    }

    /// Another source shows that the vehicle is under way. Where no standstill has been confirmed,
    /// only what is quieter than the present moment may be one: a train that was never seen at rest
    /// is quiet on a straight line.
    pub fn is_under_way(&mut self) {
        if self.quiet >= RESTS && !self.confirmed {
            let [.., level] = self.levels;
            for (quietest, level) in self.quietest.iter_mut().zip(level) {
                *quietest = quietest.min(QUIETER * level / QUIET);
            }
        }
        self.moves();
    }

    /// Samples are missing: the window in progress restarts, and the vehicle may have moved.
    pub fn gap(&mut self) {
        self.window.samples = 0;
        self.moves();
    }

    /// The velocity that a vehicle may have gained in a second although it passed, m/s: a smooth
    /// departure begins below the thresholds.
    #[must_use]
    pub fn gain_mps(&self) -> f32 {
        self.change // over one second
    }

    /// The rest in progress, from two seconds on.
    #[must_use]
    pub fn rest(&self) -> Option<Rest> {
        let [.., [scatter, _]] = self.levels;
        (self.quiet >= RESTS).then_some(Rest {
            rate: self.rest,
            seconds: self.windows_of_mean() as f32 * WINDOW_S,
            stood_s: self.quiet as f32 * WINDOW_S,
            scatter,
        })
    }

    /// Seconds in a row that the vehicle has stood.
    #[must_use]
    pub fn seconds(&self) -> u32 {
        if self.louder == 0 {
            self.windows / 2
        } else {
            0
        }
    }
}

#[cfg(test)]
mod tests;
