//! A user's own recording: learnt from its first part, judged on the rest. The reference is the
//! fixes, or a better solution if one is given. Errors below the noise of the fixes therefore mean
//! nothing.

use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Settings, Split, judge};
use crate::inertial::ekf::InitialSigma;
use crate::inertial::session::Session;
use crate::learning::teacher::Assumptions;
use crate::learning::window::NetworkSpec;

/// Shortest part to learn from after the standstill, and shortest part to be judged on, s.
pub const LEAST_S: usize = 20;
/// Shorter learning parts have windows of one second, as in the replays of short recordings, s.
const SHORT_S: usize = 300;
/// Most times in the table.
const MOST_TIMES: usize = 7;

/// What the user may choose.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Sensors.
    pub assumptions: Assumptions,
    /// Errors of a given initial attitude, tilt and heading, rad. Not used with a standstill.
    pub attitude_sigma: [f64; 2],
    /// Epochs to learn from, standstill included. By default the standstill and half of the rest.
    pub learn: Option<usize>,
}

impl Plan {
    /// Epochs to learn from.
    ///
    /// # Errors
    /// The possible range (empty for a recording that is too short) when the choice lies outside.
    pub fn learn(&self, session: &Session) -> Result<usize, (usize, usize)> {
        let (still, all) = (session.standstill, session.epochs());
        let range = (still + LEAST_S, all.saturating_sub(LEAST_S));
        let learn = self.learn.unwrap_or(still + (all - still) / 2);
        let fits = (range.0..=range.1).contains(&learn);
        if fits { Ok(learn) } else { Err(range) }
    }

    fn settings(&self, session: &Session, learn: usize) -> Settings {
        let [tilt, heading] = self.attitude_sigma;
        let [position, _, _, velocity, ..] = session.nearest_fix(0).start_sigmas();
        let given = InitialSigma {
            tilt,
            heading,
            velocity,
            position,
        };
        let network = match learn - session.standstill < SHORT_S {
            true => NetworkSpec::short(),
            false => NetworkSpec::default(),
        };
        Settings {
            assumptions: self.assumptions,
            start_sigma: (session.standstill == 0).then_some(given),
            network: NetworkSpec {
                held_back: 0.33,
                ..network
            },
            promoted_only: true,
            times_s: times(session.epochs() - learn),
        }
    }

    /// Learns and judges; `learn` is from [`Plan::learn`]. `None` when the standstill gives no
    /// attitude.
    #[must_use]
    pub fn replay(&self, name: &str, session: &Session, learn: usize) -> Option<Outcome> {
        let settings = self.settings(session, learn);
        let split = Split::forward(session.epochs(), learn);
        let mut outcome = judge(name, session, &split, &settings)?;
        outcome.notes.push(match session.standstill {
            0 => "The attitude at the start was given.".to_owned(),
            s => format!("Aligned by each scheme with its own samples on {s} s of standstill."),
        });
        Some(outcome)
    }
}

/// Round times over a judged part of `length` s, and its end.
fn times(length: usize) -> Vec<u32> {
    let steps = [5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200];
    let step = steps.into_iter().find(|s| length / s < MOST_TIMES);
    let step = step.unwrap_or(14_400);
    let mut out: Vec<usize> = (1..)
        .map(|k| k * step)
        .take_while(|t| *t <= length)
        .collect();
    if out.last().is_none_or(|last| length - last > step / 3) {
        out.push(length);
    }
    out.into_iter()
        .filter_map(|t| u32::try_from(t).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_round_and_reach_the_end() {
        assert_eq!(times(1320), [300, 600, 900, 1200, 1320]);
        assert_eq!(times(49), [10, 20, 30, 40, 49]);
        assert_eq!(times(20), [5, 10, 15, 20]);
        assert_eq!(times(500), [120, 240, 360, 480]);
    }
}
