//! Watches a device: once a second its mode, faults, rates, learner, error bound and load.

use super::biases::{large, sheet};
use super::configure::record;
use super::faults::{self, Fault};
use super::info::board;
use super::learning::{Solution, Trials};
use super::link::Link;
use super::mode_name;
use super::proof::{Interruption, Nearest, Proofs};
use super::receiver::Antenna;
use super::steps::{LastFix, Settled, Step, StepInputs};
use super::times::Times;
use firmware::configuration::record::decode;
use firmware::control::HeadingSource;
use firmware::wire::command::{self, Counters, Health};
use host_core::error::Error;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two requests to the device.
const PERIOD: Duration = Duration::from_secs(1);

/// Status that a device reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Time since the watch began, s.
    pub time_s: f64,
    /// Mode in force.
    pub mode: &'static str,
    /// What is wrong now.
    pub faults: Vec<Fault>,
    /// Increase of each counter per second. `None` at first and after a restart.
    pub per_second: Option<BTreeMap<&'static str, f64>>,
    /// The counters since power-on.
    pub counters: BTreeMap<&'static str, u32>,
    /// The learner.
    pub learner: Learner,
    /// Its navigation solution; `None` while it does not navigate.
    pub solution: Option<Solution>,
    /// Its hypotheses; `None` on a board without a learner.
    pub trials: Option<Trials>,
    /// The hypothesis that is nearest to its proof, with its pace.
    pub nearest: Option<Nearest>,
    /// The last interruption of the navigation since the watch began, in s of the watch.
    pub interruption: Option<Interruption>,
    /// The steps on the way to a correction.
    pub steps: Vec<Step>,
    /// Proof, interruption and biases that are too large in words, for the reader.
    pub says: Vec<String>,
    /// Lever arm and delay of the fixes; `None` on a board without a learner.
    pub antenna: Option<Antenna>,
    /// The receiver's time of the samples.
    pub times: Option<Times>,
    /// Most metres that corrections within their limits can add to a free-inertial position 5, 10,
    /// 15, 20 and 22 min after the alignment.
    pub error_bound_m: [u32; 5],
    /// Load of the processor in the last whole second, %.
    pub busy_percent: Option<f64>,
    /// Load of the processor in the busiest second since power-on, %.
    pub busiest_percent: Option<f64>,
}

/// State of the learner.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Learner {
    /// The learner is aligned and compares itself with fixes.
    pub navigates: bool,
    /// The promoted hypothesis; 0 is the zero correction.
    pub winner: u8,
    /// Fixes learnt from.
    pub used_fixes: u32,
    /// Fixes refused.
    pub refused_fixes: u32,
    /// Times a hypothesis other than 0 was promoted.
    pub promotions: u32,
    /// Times the promoted hypothesis was given up for 0.
    pub rollbacks: u32,
    /// Source of the heading of its navigator, or of the alignment in progress.
    pub way: &'static str,
    /// Standard deviation of that heading, deg; `None` while it is unknown.
    pub heading_sigma_deg: Option<f64>,
    /// Mean normalised innovation squared of the last alignment in motion; 1 is as expected.
    pub residual: f64,
    /// Alignments in motion that were refused because the fixes contradicted them.
    pub refused_alignments: u32,
    /// Rests from which the gyros were learnt.
    pub rests: u32,
    /// Time of the rest in progress, s.
    pub rest_s: u32,
}

impl From<&Health> for Learner {
    fn from(health: &Health) -> Self {
        Self {
            navigates: health.navigates,
            winner: health.winner,
            used_fixes: health.used_fixes,
            refused_fixes: health.refused_fixes,
            promotions: health.promotions,
            rollbacks: health.rollbacks,
            way: heading_source_name(health.way),
            heading_sigma_deg: health
                .heading_sigma
                .map(|mrad| (f64::from(mrad) * 1e-3).to_degrees()),
            residual: f64::from(health.residual) / 100.0,
            refused_alignments: health.refused_alignments,
            rests: health.rests,
            rest_s: health.rest_s,
        }
    }
}

/// An event of a watch.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Event {
    /// Once a second.
    Status(Box<Status>),
    /// The device does not answer any more.
    Lost {
        /// Time since the watch began, s.
        time_s: f64,
        /// What is wrong, with the remedy.
        problem: String,
    },
    /// It answers again.
    Found {
        /// Time since the watch began, s.
        time_s: f64,
    },
}

/// Settings of a watch.
pub struct Watch<'w> {
    /// Opens the link: at first, and again when the device was lost.
    pub open: &'w mut dyn FnMut() -> Result<Link, Error>,
    /// Duration of the watch; unlimited if `None`.
    pub lasts: Option<Duration>,
    /// Ends the watch when set.
    pub stop: &'w AtomicBool,
    /// Receives the events. An error ends the watch: nobody reads any more.
    pub report: &'w mut dyn FnMut(&Event) -> io::Result<()>,
}

/// Watches a device. Tries to reach a lost device again once a second.
///
/// # Errors
/// The device cannot be reached at the beginning, or has another version of the link.
pub fn watch(watch: &mut Watch<'_>) -> Result<(), Error> {
    let begun = Instant::now();
    let mut link = Some(opened(watch)?);
    let mut last = Last::default();
    let mut rounds = 0;
    while !watch.stop.load(Ordering::Relaxed) && watch.lasts.is_none_or(|t| begun.elapsed() < t) {
        let was_lost = link.is_none();
        let answer = match link.take() {
            Some(link) => Ok(link),
            None => opened(watch),
        };
        let answer = answer.and_then(|mut link| {
            let status = Status::ask(&mut link, begun, &mut last)?;
            Ok((link, status))
        });
        let time_s = begun.elapsed().as_secs_f64();
        let mut events = Vec::new();
        match answer {
            Ok((found, status)) => {
                link = Some(found);
                if was_lost {
                    events.push(Event::Found { time_s });
                }
                events.push(Event::Status(Box::new(status)));
            }
            Err(error) if !was_lost => {
                last.lost();
                let problem = error.to_string();
                events.push(Event::Lost { time_s, problem });
            }
            Err(_) => {} // still lost
        }
        for event in &events {
            if (watch.report)(event).is_err() {
                return Ok(());
            }
        }
        rounds += 1;
        wait_until(begun + PERIOD * rounds, watch.stop);
    }
    Ok(())
}

/// The link to a device of this program's version.
fn opened(watch: &mut Watch<'_>) -> Result<Link, Error> {
    let mut link = (watch.open)()?.with_tries(3);
    link.version()?;
    Ok(link)
}

fn wait_until(due: Instant, stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed)
        && let Some(left) = due.checked_duration_since(Instant::now())
    {
        thread::sleep(left.min(Duration::from_millis(50)));
    }
}

/// Configuration and board are read once in so many statuses.
const REREAD: u32 = 10;

/// Values of the last status, to compare the next one with.
#[derive(Debug, Default)]
pub struct Last {
    /// The counters and the time of their request, if the device has answered since.
    counted: Option<(Instant, Counters)>,
    proofs: Proofs,
    last_fix: LastFix,
    /// Standard deviations of the biases as configured, rad/s, m/s2.
    sheet: Option<[f64; 2]>,
    settled: Settled,
    /// Until configuration and board are read again, statuses.
    rereads: u32,
}

impl Last {
    /// The device does not answer any more.
    pub fn lost(&mut self) {
        (self.counted, self.last_fix) = Default::default();
    }

    /// The configuration of the device may have changed.
    pub fn reread(&mut self) {
        self.rereads = 0;
    }

    /// Reads configuration and board, from time to time and after a restart.
    fn settle(&mut self, link: &mut Link, restarted: bool) -> Result<(), Error> {
        if restarted || self.rereads == 0 {
            let configuration = record(link)?.and_then(|bytes| decode(&bytes).ok());
            self.sheet = configuration.as_ref().map(sheet);
            let board = board(link)?;
            self.settled = Settled {
                activation: configuration.map(|of| of.correction.activation),
                stores: board.stores,
                stored: board.stored,
            };
            self.rereads = REREAD;
        }
        self.rereads -= 1;
        Ok(())
    }

    /// Whether it has answered since it was found.
    #[must_use]
    pub fn answered(&self) -> bool {
        self.counted.is_some()
    }

    /// Notes a status, and completes it with what has come of the ones before.
    fn complete(&mut self, status: &mut Status, before: Option<Counters>, now: &Counters) {
        let time_s = status.time_s;
        let candidates = status.trials.as_ref().and_then(Trials::candidates);
        let navigates = status.learner.navigates;
        let why = || explains(before.as_ref(), now, time_s);
        self.proofs.note(time_s, navigates, candidates, why);
        status.nearest = self.proofs.nearest();
        status.interruption = self.proofs.interruptions.last().cloned();
        let interruption = status.interruption.as_ref();
        let estimate = status.solution.as_ref().map(Solution::estimate_si);
        let said = [
            status.nearest.as_ref().map(Nearest::to_string),
            interruption.map(|of| format!("{of} (s of this watch)")),
            estimate
                .zip(self.sheet)
                .and_then(|(of, sheet)| large(of, sheet)),
        ];
        status.says = said.into_iter().flatten().collect();
    }
}

impl Status {
    /// Asks a device. `begun`: start of the watch; `last` is brought up to date.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn ask(link: &mut Link, begun: Instant, last: &mut Last) -> Result<Self, Error> {
        let (health, counters) = (link.health()?, link.counters()?);
        let antenna = link.antenna()?.map(Antenna::from);
        let now = Instant::now();
        let before = last.counted.replace((now, counters));
        let time_s = now.duration_since(begun).as_secs_f64();
        let mut status = Self {
            antenna,
            times: Some(link.times()?),
            solution: link.solution()?,
            trials: link.trials()?,
            ..Self::new(time_s, &health, &counters, (now, before))
        };
        last.settle(link, status.per_second.is_none())?;
        last.complete(&mut status, before.map(|of| of.1), &counters);
        let way = StepInputs {
            mode: health.mode,
            learner: &status.learner,
            progress: link.progress()?,
            nearest: status.nearest.as_ref(),
            good_fixes: counters.good_fixes,
            without_fix_s: last.last_fix.note(counters.good_fixes, time_s),
            silent: health.faults & command::fault::SILENT != 0,
            settled: last.settled,
        };
        status.steps = way.steps();
        Ok(status)
    }

    fn new(
        time_s: f64,
        health: &Health,
        counters: &Counters,
        (now, before): (Instant, Option<(Instant, Counters)>),
    ) -> Self {
        let percent = |permille: Option<u16>| permille.map(|value| f64::from(value) / 10.0);
        Self {
            time_s,
            mode: mode_name(health.mode),
            faults: faults::of_bits(health.faults),
            per_second: before.and_then(|(at, before)| {
                rates(counters, &before, now.duration_since(at).as_secs_f64())
            }),
            counters: named(counters).collect(),
            learner: Learner::from(health),
            solution: None,
            trials: None,
            nearest: None,
            interruption: None,
            steps: Vec::new(),
            says: Vec::new(),
            antenna: None,
            times: None,
            error_bound_m: health.error_bound_m,
            busy_percent: percent(health.busy),
            busiest_percent: percent(health.busiest),
        }
    }
}

/// What explains that the navigation has ended between two requests of the counters. `before`:
/// `None` where the device did not answer.
fn explains(before: Option<&Counters>, now: &Counters, time_s: f64) -> Option<String> {
    let Some(before) = before else {
        return Some(format!("a loss of the link until {time_s:.0} s"));
    };
    let grown = |of: fn(&Counters) -> u32| of(now).saturating_sub(of(before));
    let restarted = named(now)
        .zip(named(before))
        .any(|(now, before)| now.1 < before.1);
    let (missed, silences) = (grown(|of| of.missed), grown(|of| of.silences));
    match () {
        () if restarted => Some(format!("a restart of the device at {time_s:.0} s")),
        () if missed > 0 => Some(format!("{missed} missed frames at {time_s:.0} s")),
        () if silences > 0 => Some(format!("a silence of the sensor at {time_s:.0} s")),
        () => None,
    }
}

/// Name of a source of heading.
#[must_use]
pub fn heading_source_name(source: HeadingSource) -> &'static str {
    match source {
        HeadingSource::None => "none",
        HeadingSource::Gyrocompass => "gyrocompass",
        HeadingSource::Course => "course",
        HeadingSource::Velocity => "velocity",
        HeadingSource::Heading => "heading",
        HeadingSource::Known => "known state",
    }
}

/// Increase of each counter per second; `None` when one has decreased, because the device has
/// restarted.
fn rates(now: &Counters, before: &Counters, seconds: f64) -> Option<BTreeMap<&'static str, f64>> {
    let pairs = named(now).zip(named(before));
    let rate = |((name, now), (_, before)): ((_, u32), (_, u32))| {
        let grown = now.checked_sub(before)?;
        Some((name, f64::from(grown) / seconds))
    };
    (seconds > 0.0).then(|| pairs.map(rate).collect()).flatten()
}

/// Map of the counters by name.
#[must_use]
pub fn named_counters(counters: &Counters) -> BTreeMap<&'static str, u32> {
    named(counters).collect()
}

/// The counters with their names, in order.
fn named(counters: &Counters) -> impl Iterator<Item = (&'static str, u32)> + use<> {
    let &Counters {
        frames,
        others,
        bad_checksums,
        garbage,
        lost,
        missed,
        duplicates,
        jumps,
        silences,
        dropped,
        raw,
        saturated,
        blocks,
        given_up,
        requests,
        answered,
        fixes,
        good_fixes,
        entered: [detections, runs, step_asides],
        restarts,
        mended,
    } = counters;
    [
        ("frames", frames),
        ("other_messages", others),
        ("bad_checksums", bad_checksums),
        ("garbage_bytes", garbage),
        ("lost", lost),
        ("missed_frames", missed),
        ("duplicates", duplicates),
        ("jumps", jumps),
        ("silences", silences),
        ("dropped", dropped),
        ("raw_bytes", raw),
        ("saturated", saturated),
        ("blocks", blocks),
        ("blocks_given_up", given_up),
        ("requests", requests),
        ("answered", answered),
        ("fixes", fixes),
        ("good_fixes", good_fixes),
        ("detections", detections),
        ("runs", runs),
        ("step_asides", step_asides),
        ("sensor_restarts", restarts),
        ("memory_mended", mended),
    ]
    .into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_differences_in_a_second() {
        let before = Counters {
            frames: 1000,
            fixes: 3,
            ..Counters::default()
        };
        let now = Counters {
            frames: 1500,
            fixes: 5,
            ..before
        };
        let rates = rates(&now, &before, 2.0).expect("nothing became less");
        assert_eq!((rates["frames"], rates["fixes"]), (250.0, 1.0));
        assert_eq!(rates["garbage_bytes"], 0.0);
    }

    #[test]
    fn a_restart_has_no_rates() {
        let before = Counters {
            frames: 1000,
            ..Counters::default()
        };
        assert_eq!(rates(&Counters::default(), &before, 1.0), None);
        assert_eq!(rates(&before, &before, 0.0), None);
    }
}
