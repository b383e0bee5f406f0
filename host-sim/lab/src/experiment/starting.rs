//! The start of a user's recording, and its continuation after a gap of samples.
//!
//! A recording without a given attitude starts by the device's own alignment in motion
//! ([`in_motion`]). The session begins at the epoch where the attitude is known, with its standard
//! deviations, the same for all schemes. After a long gap of samples the attitude is found again in
//! the same way. All schemes continue from there and keep their estimates of the sensors.

use firmware::align::motion::Progress;
use firmware::control::HeadingSource;
use host_core::error::Error;
use host_core::inertial::ekf::InitialSigma;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::session::{Outage, Session, Start};
use host_core::inertial::units::DEG;
use host_core::words::counted;
use host_device::device::biases::large;
use host_estimation::learning::in_motion::{self, Aligned, VehicleKnowledge};
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::record::Record;
use host_io::recordings::{InitialAttitude, Prepared};
use host_unit::{Unit, around};
use std::ops::Range;
use std::path::Path;

/// A part of a recording is aligned again if it is at least this long, s.
const LEAST_PART: usize = 10;

/// The user's settings of the start.
#[derive(Debug, Clone, Copy)]
pub struct Wishes {
    /// Kind of the vehicle, and a rough heading.
    pub known: VehicleKnowledge,
    /// Errors of a given attitude, tilt and heading, rad.
    pub attitude_sigma: [f64; 2],
    /// Number of the part, counted from 1, that is used alone.
    pub part: Option<usize>,
}

impl Wishes {
    /// The settings by the recording and the unit's vehicle. `attitude_sigma`: errors of a given
    /// attitude, tilt and heading, rad. `part`: number of a part that is used alone.
    #[must_use]
    pub fn of(unit: &Unit, record: &Record, attitude_sigma: [f64; 2], part: Option<usize>) -> Self {
        Self {
            known: VehicleKnowledge {
                vehicle: unit.vehicle.kind,
                forward: unit.vehicle.mounting == around::MountingKnowledge::Known,
                heading: record.rough_heading,
            },
            attitude_sigma,
            part,
        }
    }
}

/// A session that can be navigated from its first epoch on.
#[derive(Debug, Clone)]
pub struct Started {
    /// The session.
    pub session: Session,
    /// Time of its first epoch on the IMU's clock, s.
    pub begin: f64,
    /// Notes for the reader, in sentences.
    pub notes: Vec<String>,
}

/// Finds the attitude of a recording and joins its parts. `file` is named in errors.
///
/// # Errors
/// No part gives an attitude: why not, and the remedy; there is no such part.
pub fn start(
    prepared: Prepared,
    wishes: &Wishes,
    assumptions: &Assumptions,
    file: &Path,
) -> Result<Started, Error> {
    let Prepared {
        session,
        attitude,
        begin,
        missing,
        mut notes,
    } = prepared;
    let all = parts(&session, &missing);
    let parts = chosen(&all, wishes.part, file)?;
    if all.len() > 1 {
        let spans: Vec<String> = all
            .iter()
            .map(|p| format!("{}-{} s", p.start, p.end))
            .collect();
        notes.push(format!("Its parts: {}.", spans.join(", ")));
    }
    let mut found: Vec<(Range<usize>, Begin)> = Vec::new();
    let mut furthest: Option<Progress> = None;
    for part in parts {
        let given = attitude.filter(|_| part.start == 0);
        match begin_of(&session, &part, given, wishes, assumptions) {
            Ok(begin) => found.push((part, begin)),
            Err(progress) => {
                notes.push(format!(
                    "No attitude is found between {} and {} s, so that part is not used.",
                    part.start, part.end
                ));
                furthest = furthest.or(Some(progress));
            }
        }
    }
    let Some(((first, how), rest)) = found.split_first() else {
        return Err(no_attitude(file, furthest.unwrap_or_default()));
    };
    let from = how.epoch(first);
    let mut session = session;
    session.start = how.start();
    let mut end = first.end;
    for (part, how) in rest {
        if let Some(resume) = how.start() {
            session.outages.push(Outage {
                epochs: end..how.epoch(part),
                resume,
            });
            end = part.end;
        }
    }
    notes.extend(found.iter().map(|(part, how)| how.note(part)));
    let start = session.start;
    let mut session = session.cut(&(from..end));
    session.start = start;
    Ok(Started {
        session,
        begin: begin + from as f64,
        notes,
    })
}

/// The start of a part.
enum Begin {
    Standstill(usize),
    Given(Start),
    Found(Aligned),
}

impl Begin {
    /// The first epoch of its navigation.
    fn epoch(&self, part: &Range<usize>) -> usize {
        match self {
            Self::Standstill(_) | Self::Given(_) => part.start,
            Self::Found(found) => found.epoch,
        }
    }

    fn start(&self) -> Option<Start> {
        match self {
            Self::Standstill(_) => None,
            Self::Given(start) => Some(*start),
            Self::Found(found) => Some(found.start),
        }
    }

    /// A sentence for the report.
    fn note(&self, part: &Range<usize>) -> String {
        match self {
            Self::Standstill(s) => {
                format!("Aligned by each scheme with its own samples on {s} s of standstill.")
            }
            Self::Given(start) => format!(
                "The attitude at the start was given, to {:.2} deg of tilt and {:.2} deg of heading.",
                start.sigma.tilt / DEG,
                start.sigma.heading / DEG
            ),
            Self::Found(found) => {
                let (roll, pitch, heading) = to_euler(&found.start.nav.q_bn);
                let again = match found.refused {
                    0 => String::new(),
                    n => format!(" {n} attempts before it were given up."),
                };
                // only the gyros' biases are found by the alignment
                let sheet = [found.datasheet, f64::INFINITY];
                let large = large([found.bias, [0.0; 3]], sheet);
                let large = large.map_or(String::new(), |says| format!(" Found: {says}."));
                format!(
                    "Aligned in motion from {} s on: at {} s roll {:.2}, pitch {:.2}, heading {:.2} deg, \
                     heading by {}, standard deviations {:.2} deg of tilt and {:.2} deg of heading, \
                     residual {:.2} (1 is expected). All schemes start there.{again}{large}",
                    part.start,
                    found.epoch,
                    roll / DEG,
                    pitch / DEG,
                    heading / DEG,
                    named(found.way),
                    found.start.sigma.tilt / DEG,
                    found.start.sigma.heading / DEG,
                    found.residual
                )
            }
        }
    }
}

/// The source of a heading, in words.
fn named(way: HeadingSource) -> &'static str {
    match way {
        HeadingSource::None => "nothing",
        HeadingSource::Gyrocompass => "the Earth's rotation",
        HeadingSource::Course => "the course of a land vehicle",
        HeadingSource::Velocity => "accelerations seen by sensors and receiver",
        HeadingSource::Heading => "the heading that was given",
        HeadingSource::Known => "the state that was given",
    }
}

/// The parts between gaps.
fn parts(session: &Session, missing: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut from = 0;
    let mut out = Vec::new();
    let end = session.epochs()..session.epochs();
    for gap in missing.iter().chain([&end]) {
        if gap.start > from {
            out.push(from..gap.start);
        }
        from = gap.end;
    }
    out
}

/// The parts that are used.
fn chosen(
    all: &[Range<usize>],
    number: Option<usize>,
    file: &Path,
) -> Result<Vec<Range<usize>>, Error> {
    let Some(number) = number else {
        let worth = |(k, part): &(usize, &Range<usize>)| *k == 0 || part.len() >= LEAST_PART;
        return Ok(all
            .iter()
            .enumerate()
            .filter(worth)
            .map(|(_, p)| p.clone())
            .collect());
    };
    let part = number.checked_sub(1).and_then(|k| all.get(k));
    part.map(|part| vec![part.clone()])
        .ok_or_else(|| Error::Option {
            option: "--part".into(),
            problem: format!(
                "is {number}, and {} has {}",
                file.display(),
                counted(all.len(), "part")
            ),
            remedy: format!("give 1 to {}", all.len()),
        })
}

fn begin_of(
    session: &Session,
    part: &Range<usize>,
    given: Option<InitialAttitude>,
    wishes: &Wishes,
    assumptions: &Assumptions,
) -> Result<Begin, Progress> {
    let known = match (given, part.start) {
        (Some(InitialAttitude::Standstill(s)), _) if s < part.end => {
            return Ok(Begin::Standstill(s));
        }
        (Some(InitialAttitude::Known(_)), _) => {
            return Ok(Begin::Given(given_start(session, wishes.attitude_sigma)));
        }
        (_, 0) => wishes.known,
        // the heading was that of the first fix
        _ => VehicleKnowledge {
            heading: None,
            ..wishes.known
        },
    };
    in_motion::align(session, part, known, assumptions).map(Begin::Found)
}

/// The state at the first epoch with an attitude that was given.
fn given_start(session: &Session, [tilt, heading]: [f64; 2]) -> Start {
    let [position, _, _, velocity, ..] = session.nearest_fix(0).start_sigmas();
    let sigma = InitialSigma {
        tilt,
        heading,
        velocity: velocity.min(1.0),
        position,
    };
    Start {
        nav: session.referenced(0),
        sigma,
    }
}

/// The error of a recording without an attitude.
fn no_attitude(file: &Path, progress: Progress) -> Error {
    let (why, remedy) = match progress.way {
        _ if progress.refused > 0 => (
            format!(
                "samples and fixes contradict each other ({} attempts were given up, the last \
                 residual is {:.1} where 1 is expected)",
                progress.refused, progress.residual
            ),
            "check axes, mounting, units, time offset (--estimate-time-offset) and the unit file, \
             or give roll, pitch and heading at the first fix",
        ),
        HeadingSource::None => (
            "the vehicle hardly moves, or its fixes have no velocity or close positions".to_owned(),
            "give a standstill of at least 90 s, or roll, pitch and heading at the first fix, or a \
             recording with turns and changes of speed",
        ),
        _ => (
            format!(
                "the heading is known to {:.0} deg only at the end (residual {:.1})",
                f64::from(progress.heading_sigma) / DEG,
                progress.residual
            ),
            "give a rough heading (heading_deg and heading_sigma_deg), roll, pitch and heading, or a \
             recording with more turns and changes of speed",
        ),
    };
    Error::Scenario {
        file: file.to_path_buf(),
        line: None,
        key: "start".into(),
        problem: format!("gives no attitude, and none is found in motion: {why}"),
        remedy: remedy.into(),
    }
}

#[cfg(test)]
mod sessions;
#[cfg(test)]
mod tests;
