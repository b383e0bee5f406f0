//! Errors of GNSS fixes: white noise, coloured noise, gaps, multipath, latency and lever arm. All
//! but the white noise are off by default. Each term has its own random numbers, so switching one
//! on does not change the others.

mod antenna;
#[cfg(test)]
mod antenna_tests;
mod coloured;
mod spells;
#[cfg(test)]
mod tests;

pub use antenna::{AntennaPrior, antenna};
pub use coloured::Coloured;
pub use spells::{Gaps, Multipath};

use crate::inertial::gnss::Fix;
use crate::inertial::session::EPOCH_S;
use crate::inertial::sins::NavState;
use crate::simulator::truth::Truth;
use antenna::Path;
use coloured::Wander;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use spells::{Bursts, Spells};

/// Stream of the random numbers of the coloured errors. The white noise has stream 0.
const COLOURED_STREAM: u64 = 1;
/// Stream of the gaps.
const GAPS_STREAM: u64 = 2;
/// Streams of the times and of the shifts of multipath.
const MULTIPATH_STREAMS: [u64; 2] = [3, 4];

/// Errors of the receiver: standard deviations per axis, and the accuracy that it reports.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSpec {
    /// White part of the horizontal position, m, > 0.
    pub horizontal_m: f64,
    /// White part of the vertical position, m, > 0.
    pub vertical_m: f64,
    /// White part of the velocity, m/s, > 0.
    pub velocity_mps: f64,
    /// Reported accuracy divided by the true one, 0.01 to 100. A receiver reports its own estimate
    /// (u-blox M8 protocol specification, UBX-NAV-PVT, fields hAcc, vAcc and sAcc), which may be
    /// wrong.
    pub told_factor: f64,
    /// Coloured errors.
    pub coloured: Coloured,
    /// Times without fixes.
    pub gaps: Gaps,
    /// Bursts of multipath. The reported accuracy does not contain them.
    pub multipath: Multipath,
    /// True time from validity to arrival of a fix, s, 0 to 5. Without it fixes arrive at once, and
    /// filters and the device are configured accordingly.
    pub latency_s: Option<f64>,
    /// True position of the antenna relative to the IMU: forward, right, down, m, each -100 to 100.
    /// Without it the antenna is at the IMU, and filters and the device are configured accordingly.
    pub lever_arm_m: Option<[f64; 3]>,
    /// Fixes a second, 1 to 20.
    pub rate_hz: u32,
    /// Assumed age and lever arm, used where the true ones are given above. A scenario takes them
    /// from its unit.
    #[serde(skip)]
    pub assumed_antenna: AntennaPrior,
}

impl Default for GnssSpec {
    /// A single-frequency receiver in the open: 1 m, 1.5 m, 0.05 m/s.
    fn default() -> Self {
        Self {
            horizontal_m: 1.0,
            vertical_m: 1.5,
            velocity_mps: 0.05,
            told_factor: 1.0,
            coloured: Coloured::default(),
            gaps: Gaps::default(),
            multipath: Multipath::default(),
            latency_s: None,
            lever_arm_m: None,
            rate_hz: 1,
            assumed_antenna: AntennaPrior::default(),
        }
    }
}

impl GnssSpec {
    /// Standard deviations of the white noise of north, east, down position (m), then velocity
    /// (m/s).
    #[must_use]
    pub fn sigmas(&self) -> [f64; 6] {
        let (h, v, s) = (self.horizontal_m, self.vertical_m, self.velocity_mps);
        [h, h, v, s, s, s]
    }

    /// Standard deviations that the receiver reports: those of white and coloured errors together,
    /// times [`told_factor`](Self::told_factor).
    #[must_use]
    pub fn reported_sigmas(&self) -> [f64; 6] {
        let (white, coloured) = (self.sigmas(), self.coloured.sigmas());
        std::array::from_fn(|i| self.told_factor * white[i].hypot(coloured[i]))
    }

    /// Assumed latency and lever arm. They are zero where the true ones are not given, because then
    /// there are none.
    #[must_use]
    pub fn antenna_prior(&self) -> AntennaPrior {
        let AntennaPrior {
            age_s,
            lever_arm_m,
            lever_arm_sigma_m,
        } = self.assumed_antenna;
        let arm = self.lever_arm_m.map(|_| (lever_arm_m, lever_arm_sigma_m));
        let (lever_arm_m, lever_arm_sigma_m) = arm.unwrap_or_default();
        AntennaPrior {
            age_s: self.latency_s.map_or([0.0; 2], |_| age_s),
            lever_arm_m,
            lever_arm_sigma_m,
        }
    }

    /// The fixes of a drive and when they arrive, s after power-on, [`Self::rate_hz`] a second.
    /// Each was valid at the antenna by the latency earlier; before power-on none was. Their ages
    /// are the assumed ones.
    #[must_use]
    pub fn of_drive(&self, truth: &Truth, rng: &mut ChaCha8Rng) -> Vec<(f64, Option<Fix>)> {
        let rate = self.rate_hz.max(1) as usize;
        let step_s = EPOCH_S / rate as f64;
        let samples = truth.epochs.len().saturating_sub(1) * truth.samples_per_epoch;
        let seconds = (samples as f64 * truth.dt).round() as usize;
        let arrivals: Vec<f64> = (0..=seconds * rate).map(|k| k as f64 * step_s).collect();
        let late_s = self.latency_s.unwrap_or(0.0);
        let arm = Vector3::from(self.lever_arm_m.unwrap_or_default());
        let mut path = Path::new(truth);
        let antenna_at = |arrival: &f64| {
            let sample = ((arrival - late_s) / truth.dt).max(0.0);
            let at = path.at(sample);
            match self.lever_arm_m {
                Some(_) => antenna(truth, &at, sample, &arm),
                None => at,
            }
        };
        let states: Vec<NavState> = arrivals.iter().map(antenna_at).collect();
        let [age_s, _] = self.antenna_prior().age_s;
        let arrived = |(arrival, fix): (f64, Option<Fix>)| {
            let valid = fix.filter(|_| arrival >= late_s);
            (arrival, valid.map(|fix| Fix { age_s, ..fix }))
        };
        let fixes = self.fixes(&states, step_s, rng);
        arrivals.into_iter().zip(fixes).map(arrived).collect()
    }

    /// A fix of the true state with white noise only.
    #[must_use]
    pub fn fix(&self, truth: &NavState, rng: &mut ChaCha8Rng) -> Fix {
        let noise = self.sigmas().map(|s| {
            let z: f64 = StandardNormal.sample(rng);
            s * z
        });
        let position = truth
            .position
            .displaced(&Vector3::new(noise[0], noise[1], noise[2]));
        let velocity = truth.velocity + Vector3::new(noise[3], noise[4], noise[5]);
        Fix::new(position, velocity, self.reported_sigmas())
    }

    /// The fixes of these true states of the antenna, which are `step_s` apart, with all errors
    /// but latency and lever arm.
    #[must_use]
    pub fn fixes(&self, truth: &[NavState], step_s: f64, rng: &mut ChaCha8Rng) -> Vec<Option<Fix>> {
        let mut wander = Wander::new(&self.coloured, step_s, stream(rng, COLOURED_STREAM));
        let mut gaps = Spells::gaps(&self.gaps, step_s, stream(rng, GAPS_STREAM));
        let streams = MULTIPATH_STREAMS.map(|number| stream(rng, number));
        let mut bursts = Bursts::new(&self.multipath, step_s, streams);
        let fix = |at: &NavState| {
            let mut fix = self.fix(at, rng);
            let burst = bursts.next(at.velocity.norm());
            for error in [wander.next(), burst].iter().flatten() {
                add(&mut fix, error);
            }
            (!gaps.next_is_bad()).then_some(fix)
        };
        truth.iter().map(fix).collect()
    }
}

/// Random numbers that are independent of those of `rng`, which stays as it is.
fn stream(rng: &ChaCha8Rng, stream: u64) -> ChaCha8Rng {
    let mut own = rng.clone();
    own.set_stream(stream);
    own
}

/// Adds an error to position (m) and velocity (m/s).
fn add(fix: &mut Fix, error: &[f64; 6]) {
    let [n, e, d, velocity @ ..] = *error;
    fix.position = fix.position.displaced(&Vector3::new(n, e, d));
    fix.velocity += Vector3::from(velocity);
}
