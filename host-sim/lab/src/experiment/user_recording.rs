//! A user's own recording: learning on its first part, judging on the rest. The reference is the
//! fixes, or a better solution if one is given. Errors below the noise of the fixes are therefore
//! meaningless.

mod replay;

pub use replay::{Replayed, Step, Wanted, no_attitude, replay};

use crate::experiment::correction::Correction;
use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Begins, Settings, Split, judge_and_correct};
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_estimation::analysis::doubts::{Class, Says, Warning, doubts};
use host_estimation::analysis::time_offset::{contradicted, settle};
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::record::Record;
use host_unit::scenario::network::NetworkSpec;
use std::ops::Range;

/// Shortest part to learn from after the standstill, and shortest part to be judged on, s.
pub const LEAST_S: usize = 20;
/// Shorter learning parts have windows of one second, as in the replays of short recordings, s.
const SHORT_S: usize = 300;
/// Time for which fixes aid the navigators after a gap of samples before they are judged, s.
const SETTLE_S: usize = 60;
/// Largest number of times in the table.
const MOST_TIMES: usize = 7;

/// The user's choices.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Sensors.
    pub assumptions: Assumptions,
    /// The device of the same unit.
    pub device: Device,
    /// Epochs to learn from, standstill included. By default the standstill and half of the rest.
    pub learn: Option<usize>,
    /// Where the navigators begin the judged part.
    pub begins: Begins,
}

impl Plan {
    /// Settles the time offset of the fixes, estimated from the data if `estimates`, and looks for
    /// contradictions to `says`. `given`: the user has named the assumed unit. Returns a sentence
    /// for the report, and warnings.
    pub fn examine(
        &self,
        record: &mut Record,
        says: &Says,
        given: bool,
        estimates: bool,
    ) -> (Option<String>, Vec<Warning>) {
        let wanted = estimates || record.estimates_offset;
        let note = settle(record, wanted);
        let assumed = &self.assumptions;
        let clock = |record: &Record| contradicted(record).filter(|_| !wanted);
        let warnings = doubts(record, says, Class { assumed, given }, &clock);
        (note, warnings)
    }

    /// The learning part and the judged part. Navigation without fixes does not survive missing
    /// samples, so that the judged part ends where they begin.
    ///
    /// # Errors
    /// The possible range (empty for a recording that is too short) when the choice lies outside.
    pub fn split(&self, session: &Session) -> Result<Split, (usize, usize)> {
        let (standstill, all) = (session.standstill, session.epochs());
        let possible: Vec<Range<usize>> = whole(session)
            .into_iter()
            .filter_map(|part| {
                let settle = match part.start {
                    0 => standstill + LEAST_S,
                    // a new attitude has to settle
                    start => start + LEAST_S.max(SETTLE_S.min(part.len() / 2)),
                };
                let last = part.end.checked_sub(LEAST_S)?;
                (settle <= last).then_some(settle..part.end)
            })
            .collect();
        let learn = self.learn.or_else(|| {
            let half = standstill + (all - standstill) / 2;
            let middle = |part: &Range<usize>| match part.end - LEAST_S {
                last if (part.start..=last).contains(&half) => half,
                last if last < half => usize::midpoint(part.start, last),
                _ => part.start,
            };
            let best = possible.iter().max_by_key(|part| {
                let learn = middle(part);
                learn.min(part.end - learn)
            });
            best.map(middle)
        });
        let fits = |learn: usize| {
            let part = possible
                .iter()
                .find(|part| (part.start..=part.end - LEAST_S).contains(&learn))?;
            Some(Split {
                learn: 0..learn,
                judge: learn..part.end,
            })
        };
        let least = possible
            .first()
            .map_or(standstill + LEAST_S, |part| part.start);
        let most = possible.last().map(|part| part.end - LEAST_S);
        learn
            .and_then(fits)
            .ok_or((least, most.unwrap_or_else(|| all.saturating_sub(LEAST_S))))
    }

    fn settings(&self, session: &Session, split: &Split) -> Settings {
        let network = match split.learn.len() - session.standstill < SHORT_S {
            true => NetworkSpec::short(),
            false => NetworkSpec::default(),
        };
        Settings {
            assumptions: self.assumptions,
            device: self.device.clone(),
            start_sigma: None,
            begins: self.begins,
            network: NetworkSpec {
                held_back: 0.33,
                ..network
            },
            promoted_only: true,
            times_s: times(split.judge.len()),
        }
    }

    /// Learns and judges; `split` is from [`Plan::split`]. `None` when the standstill gives no
    /// attitude.
    ///
    /// # Errors
    /// As [`judge_and_correct`].
    pub fn replay(
        &self,
        name: &str,
        session: &Session,
        split: &Split,
    ) -> Result<Option<Outcome>, Error> {
        let replayed = self.replay_and_correct(name, session, split, None)?;
        Ok(replayed.map(|(outcome, _)| outcome))
    }

    /// [`Plan::replay`], with the corrections by the scheme `corrected_by`.
    ///
    /// # Errors
    /// As [`judge_and_correct`].
    pub fn replay_and_correct(
        &self,
        name: &str,
        session: &Session,
        split: &Split,
        corrected_by: Option<&str>,
    ) -> Result<Option<(Outcome, Correction)>, Error> {
        let settings = self.settings(session, split);
        judge_and_correct(name, session, split, &settings, corrected_by)
    }
}

/// The parts of a session between outages.
fn whole(session: &Session) -> Vec<Range<usize>> {
    let mut from = 0;
    let mut out = Vec::new();
    for outage in &session.outages {
        out.push(from..outage.epochs.start);
        from = outage.epochs.end;
    }
    out.push(from..session.epochs());
    out
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
