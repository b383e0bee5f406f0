//! The navigation solution of a device's learner, and the state of its hypotheses.

use super::link::Link;
use super::proof;
use firmware::control::Reason;
use firmware::learn::bank::{KEYS, NAMES};
use firmware::wire::command::{Progress, Request, Response};
use host_core::error::Error;
use serde::Serialize;

pub use firmware::learn::rehearsal::HORIZONS_S;
use firmware::learn::rehearsal::of_100;

/// Navigation solution of the learner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Solution {
    /// Latitude and longitude, deg.
    pub place_deg: [f64; 2],
    /// Height, m.
    pub height_m: f64,
    /// Velocity north, east, down, m/s.
    pub velocity_mps: [f64; 3],
    /// Roll, pitch and heading, deg.
    pub attitude_deg: [f64; 3],
    /// Estimated errors of the gyros, deg/h, and of the accelerometers, mg.
    pub estimate: [f64; 6],
    /// Their standard deviations.
    pub sigma: [f64; 6],
}

impl Solution {
    /// The estimated errors, rad/s and m/s2.
    #[must_use]
    pub fn estimate_si(&self) -> [[f64; 3]; 2] {
        let [a, b, c, x, y, z] = self.estimate;
        let rate = |dph: f64| dph.to_radians() / 3600.0;
        let force = |mg: f64| mg * 1e-3 * firmware::units::G;
        [[a, b, c].map(rate), [x, y, z].map(force)]
    }
}

/// State of one hypothesis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// Its name as a key.
    pub key: &'static str,
    /// Its name.
    pub name: &'static str,
    /// Whether it is enabled.
    pub enabled: bool,
    /// Whether it has the most evidence.
    pub leads: bool,
    /// Whether it has proved itself.
    pub proved: bool,
    /// Log-likelihood relative to the zero correction's.
    pub evidence: f32,
    /// How near its proof is, of 100.
    pub proof: u8,
    /// Wealth of the bets that it is worth its use, in stakes.
    pub capital: f32,
    /// Wealth of the bets that it does no harm, in stakes.
    pub check: f32,
}

/// State of all hypotheses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trials {
    /// Each hypothesis.
    pub each: Vec<Trial>,
    /// Rehearsals that have ended, at each of [`HORIZONS_S`].
    pub rehearsals: [u16; 6],
}

impl Trials {
    /// The hypotheses as candidates for a proof.
    #[must_use]
    pub fn candidates(&self) -> Option<proof::Candidates> {
        let each = self.each.iter().map(|trial| proof::Candidate {
            enabled: trial.enabled,
            proved: trial.proved,
            capital: trial.capital,
        });
        each.collect::<Vec<_>>().try_into().ok()
    }
}

/// Gyro values from rad/s to deg/h, then accelerometer values from m/s2 to mg.
#[must_use]
pub fn usual(of: [[f32; 3]; 2]) -> [f64; 6] {
    let [gyro, accel] = of.map(|triad| triad.map(f64::from));
    let [a, b, c] = gyro.map(|rate| rate.to_degrees() * 3600.0);
    let [x, y, z] = accel.map(|force| force / firmware::units::G * 1e3);
    [a, b, c, x, y, z]
}

/// Roll, pitch and heading (0 to 360), deg, of body axes to north-east-down.
fn attitude([w, x, y, z]: [f64; 4]) -> [f64; 3] {
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, heading.rem_euclid(std::f64::consts::TAU)].map(f64::to_degrees)
}

impl Link {
    /// The learner's navigation solution; `None` while it does not navigate.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn solution(&mut self) -> Result<Option<Solution>, Error> {
        self.perhaps(&Request::GetSolution, |answer| match answer {
            Response::Solution(solution) => Some(Solution {
                place_deg: solution.place.map(f64::to_degrees),
                height_m: solution.height.into(),
                velocity_mps: solution.velocity.map(f64::from),
                attitude_deg: attitude(solution.attitude.map(f64::from)),
                estimate: usual(solution.estimate),
                sigma: usual(solution.sigma),
            }),
            _ => None,
        })
    }

    /// State of the hypotheses; `None` on a board without a learner.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn trials(&mut self) -> Result<Option<Trials>, Error> {
        self.perhaps(&Request::GetTrials, |answer| {
            let Response::Trials(trials) = answer else {
                return None;
            };
            let bit = |bits: u8, index: usize| bits >> index & 1 == 1;
            let trial = |(index, (key, name)): (usize, (&&'static str, &&'static str))| Trial {
                key,
                name,
                enabled: bit(trials.enabled, index),
                leads: usize::from(trials.leading) == index,
                proved: bit(trials.proved, index),
                evidence: trials.evidence[index],
                proof: of_100(trials.proof[index], bit(trials.proved, index)),
                capital: trials.proof[index],
                check: trials.check[index],
            };
            Some(Trials {
                each: KEYS.iter().zip(&NAMES).enumerate().map(trial).collect(),
                rehearsals: trials.ended,
            })
        })
    }

    /// How far the learner is on its way to a correction; `None` on a board without a learner.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn progress(&mut self) -> Result<Option<Progress>, Error> {
        self.perhaps(&Request::GetProgress, |answer| match answer {
            Response::Progress(progress) => Some(*progress),
            _ => None,
        })
    }

    /// The answer, or `None` where the device has none (`NotAvailable`).
    fn perhaps<T>(
        &mut self,
        request: &Request,
        read: impl Fn(&Response) -> Option<T>,
    ) -> Result<Option<T>, Error> {
        match self.request(request, read)? {
            Err(Reason::NotAvailable) => Ok(None),
            other => other
                .map(Some)
                .map_err(|reason| self.refused(request, reason)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitudes_in_degrees() {
        let [s, c] = [30f64, 30.0].map(|deg| (deg / 2.0).to_radians());
        let near = |q: [f64; 4], deg: [f64; 3]| {
            let got = attitude(q);
            assert!(
                got.iter().zip(deg).all(|(a, b)| (a - b).abs() < 1e-9),
                "{got:?}"
            );
        };
        let (s, c) = (s.sin(), c.cos());
        near([c, s, 0.0, 0.0], [30.0, 0.0, 0.0]);
        near([c, 0.0, s, 0.0], [0.0, 30.0, 0.0]);
        near([c, 0.0, 0.0, -s], [0.0, 0.0, 330.0]);
    }

    #[test]
    fn errors_in_usual_units() {
        let rate = (1f64 / 3600.0).to_radians() as f32;
        let [a, .., z] = usual([[rate, 0.0, 0.0], [0.0, 0.0, 0.009_806_65]]);
        assert!((a - 1.0).abs() < 1e-6 && (z - 1.0).abs() < 1e-6, "{a} {z}");
    }
}
