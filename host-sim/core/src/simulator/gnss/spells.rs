//! Intermittent errors: gaps without fixes, and bursts of multipath.
//!
//! Both follow the two-state Markov channel of E. Lutz and others ("The land mobile satellite
//! communication channel", IEEE Transactions on Vehicular Technology 40(2), 1991): good and bad
//! times alternate, and the length of each is exponentially distributed. The first time is good.
//! Measured lengths have longer tails: L. E. Braten and T. Tjelta ("Semi-Markov multistate modeling
//! of the land mobile propagation channel for geostationary satellites", IEEE Transactions on
//! Antennas and Propagation 50(12), 2002) find a power law in the open and log-normal ones in the
//! shade.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1, StandardNormal};
use serde::{Deserialize, Serialize};

/// Times without fixes: tunnels, bridges, leaves. Off while the mean interval is 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gaps {
    /// Mean time from the end of a gap to the next one, s; 0 is never.
    pub mean_interval_s: f64,
    /// Mean length of a gap, s, > 0. The default of 10 s is assumed: a bridge or a short tunnel.
    pub mean_length_s: f64,
}

impl Default for Gaps {
    fn default() -> Self {
        Self {
            mean_interval_s: 0.0,
            mean_length_s: 10.0,
        }
    }
}

/// Times in which reflected signals shift the fix, and the receiver does not report it. The shift
/// is drawn for each burst and is constant in it. Off while the mean interval is 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Multipath {
    /// Mean time from the end of a burst to the next one, s; 0 is never.
    pub mean_interval_s: f64,
    /// Mean length of a burst, s, > 0. The default of 10 s is assumed: 100 m of a street.
    pub mean_length_s: f64,
    /// Standard deviation of the shift of the horizontal position per axis, m (assumed).
    pub horizontal_m: f64,
    /// Standard deviation of the shift of the vertical position, m (assumed).
    pub vertical_m: f64,
    /// Standard deviation of the shift of the velocity per axis, m/s (assumed).
    pub velocity_mps: f64,
    /// Bursts shift the fix only in streets: while a car is slower than 15 m/s.
    pub in_streets: bool,
}

/// Speed below which a car is taken to be in a street between houses, m/s (assumed). The limit in
/// built-up areas is 50 km/h, 13.9 m/s, in most of Europe. The simulated cars drive 15 m/s at most
/// in town and mostly faster on country roads. A car that stands is in its street too.
pub const STREET_MPS: f64 = 15.0;

impl Default for Multipath {
    fn default() -> Self {
        Self {
            mean_interval_s: 0.0,
            mean_length_s: 10.0,
            horizontal_m: 10.0,
            vertical_m: 15.0,
            velocity_mps: 0.2,
            in_streets: false,
        }
    }
}

/// Alternating good and bad times.
pub(super) struct Spells {
    /// Mean length of good and bad times, s. Never bad if the first is 0.
    means_s: [f64; 2],
    bad: bool,
    until_s: f64,
    now_s: f64,
    step_s: f64,
    rng: ChaCha8Rng,
}

impl Spells {
    pub(super) fn gaps(spec: &Gaps, step_s: f64, rng: ChaCha8Rng) -> Self {
        Self::new([spec.mean_interval_s, spec.mean_length_s], step_s, rng)
    }

    fn new(means_s: [f64; 2], step_s: f64, mut rng: ChaCha8Rng) -> Self {
        let first: f64 = Exp1.sample(&mut rng);
        Self {
            means_s,
            bad: false,
            until_s: means_s[0] * first,
            now_s: 0.0,
            step_s,
            rng,
        }
    }

    /// Whether the next epoch is bad, and how many bad times began since the one before it.
    fn next(&mut self) -> (bool, u32) {
        let mut began = 0;
        while self.means_s[0] > 0.0 && self.until_s <= self.now_s {
            self.bad = !self.bad;
            began += u32::from(self.bad);
            let length: f64 = Exp1.sample(&mut self.rng);
            self.until_s += self.means_s[usize::from(self.bad)] * length;
        }
        self.now_s += self.step_s;
        (self.bad, began)
    }

    /// Whether the next epoch is bad.
    pub(super) fn next_is_bad(&mut self) -> bool {
        self.next().0
    }
}

/// The state of the bursts of multipath.
pub(super) struct Bursts {
    spells: Spells,
    sigmas: [f64; 6],
    shift: [f64; 6],
    /// Speed from which on there are no bursts, m/s.
    until_mps: f64,
    rng: ChaCha8Rng,
}

impl Bursts {
    pub(super) fn new(spec: &Multipath, step_s: f64, [times, shifts]: [ChaCha8Rng; 2]) -> Self {
        let (h, v, s) = (spec.horizontal_m, spec.vertical_m, spec.velocity_mps);
        let means_s = [spec.mean_interval_s, spec.mean_length_s];
        Self {
            spells: Spells::new(means_s, step_s, times),
            sigmas: [h, h, v, s, s, s],
            shift: [0.0; 6],
            until_mps: if spec.in_streets {
                STREET_MPS
            } else {
                f64::INFINITY
            },
            rng: shifts,
        }
    }

    /// The shift at the next epoch, position (m) and velocity (m/s), if it is in a burst. The
    /// bursts begin and end at any speed, so that their times do not depend on the drive.
    pub(super) fn next(&mut self, speed_mps: f64) -> Option<[f64; 6]> {
        let (bad, began) = self.spells.next();
        if began > 0 {
            self.shift = self.sigmas.map(|sigma| {
                let z: f64 = StandardNormal.sample(&mut self.rng);
                sigma * z
            });
        }
        (bad && speed_mps < self.until_mps).then_some(self.shift)
    }
}
