//! How the navigator starts, and how it goes on across missing samples.

use super::FixLearner;
use super::events::{Fresh, Part};
use super::observe::STANDS_MPS;
use super::proportional::Proportional;
use crate::align::motion::{InMotion, MAX_HEADING, Shown};
use crate::control::{Reason, Way};
use crate::fix::{Fix, Heading};
use crate::learn::Report;
use crate::learn::prior::NAV;
use crate::learn::quantise::{Scale, divisor};
use crate::nav;
use crate::nav::vector::rotated;
use crate::nav::{Around, Beginning};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// Largest standard deviation of a heading that somebody gives, rad.
const MAX_GIVEN: f32 = 1.0;
/// Fixes after an alignment in motion in which it may still turn out to be wrong, and how many of
/// them are refused in a row when it is.
const PROBATION: u8 = 60;
const REFUSED: u8 = 5;

/// How the navigator was started.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Started {
    /// State at the end of the sample before.
    pub state: nav::State,
    /// Standard deviations of its errors, in the order of [`NAV`].
    pub sigmas: [f32; NAV],
    /// What gave the heading.
    pub way: Way,
    /// Mean normalised innovation squared of the alignment in motion; 0 without one.
    pub residual: f32,
    /// Time since the first sample, s.
    pub time_s: f64,
}

/// A navigator that is about to start. Its errors are in [`super::Work::scratch`].
#[derive(Debug, Clone)]
pub(super) struct Starting {
    pub step: Step,
    /// State at the end of sample `number`, and standard deviations of its errors.
    pub state: nav::State,
    pub sigmas: [f32; NAV],
    pub number: u32,
    /// What gave the heading, its standard deviation, rad, and the residual.
    pub way: Way,
    pub heading_sigma: f32,
    pub residual: f32,
    /// The fix, and its age, that the state is from.
    pub at: Option<(Fix, f32)>,
    /// What an alignment in motion has found of the sensors' errors.
    pub known: Option<([f32; OUTPUTS], Shown)>,
}

impl Starting {
    /// From a known state with these variances.
    pub fn new(state: nav::State, variance: [f32; NAV]) -> Starting {
        Starting {
            step: Step::Check,
            state,
            sigmas: variance.map(|v| libm::sqrtf(v.max(0.0))),
            number: 0,
            way: Way::None,
            heading_sigma: f32::INFINITY,
            residual: 0.0,
            at: None,
            known: None,
        }
    }
}

/// What comes next of a start.
#[derive(Debug, Clone)]
pub(super) enum Step {
    Check,
    Navigator(Beginning),
    /// What the fix shows of the antenna.
    Around,
    See(Around),
    Antenna(Option<nav::Seen>),
    Hypotheses,
    End,
    Done,
}

/// The first fixes after an alignment in motion: they show what it could not see, such as a
/// receiver that gives east before north.
#[derive(Debug, Clone, Copy, Default)]
pub struct Probation {
    left: u8,
    refused: u8,
}

impl Probation {
    fn begin() -> Probation {
        Probation {
            left: PROBATION,
            refused: 0,
        }
    }

    /// A fix of which a component was `refused`, or not.
    pub fn fix(&mut self, refused: bool) {
        self.left = self.left.saturating_sub(1);
        self.refused = if refused && self.left > 0 {
            self.refused + 1
        } else {
            0
        };
    }

    /// Whether it is over with a bad end; once.
    pub fn fails(&mut self) -> bool {
        let fails = self.refused >= REFUSED;
        if fails {
            *self = Probation::default();
        }
        fails
    }
}

impl Fresh {
    /// The fix of a vehicle that stands: what the receiver does not measure of its velocity is
    /// zero.
    fn standing(&self) -> Fix {
        let mut fix = self.fix;
        let measured = fix.sigmas.iter_mut().skip(3).zip(&mut fix.velocity);
        for (sigma, velocity) in measured.filter(|(sigma, _)| !sigma.is_finite()) {
            (*sigma, *velocity) = (STANDS_MPS, 0.0);
        }
        fix
    }
}

impl FixLearner<'_> {
    /// A part of what a fix leads to while nothing navigates. Gives the next one.
    pub(super) fn start_at(&mut self, part: Part, fresh: &Fresh) -> Option<Part> {
        let Some(align) = &mut self.align else {
            return None; // nothing navigates without a stream
        };
        match part {
            Part::Look => {
                let long = align.gathered() >= self.settings.align_s || align.is_over();
                if !(fresh.fix.has(0..3) && long) {
                    return self.start_at(Part::Motion, fresh);
                }
                if align.is_solving() {
                    return Some(Part::Sweep);
                }
                // in parts, until the next fix
                let place = &fresh.fix.position;
                align.solve(place.latitude, place.height);
                Some(Part::Motion)
            }
            Part::Sweep if align.sweep() => Some(Part::Sweep),
            Part::Sweep => Some(Part::End),
            Part::End => {
                align.end_piece();
                Some(Part::Carry)
            }
            Part::Carry => {
                align.carry();
                Some(Part::Judge)
            }
            Part::Judge => {
                align.judge();
                Some(Part::Start)
            }
            Part::Start => match self.start(&fresh.standing(), fresh.age) {
                Some(()) => None,
                None => Some(Part::Motion),
            },
            Part::Motion => {
                self.align_in_motion(&fresh.at_rest(), fresh.age, fresh.stands.is_some());
                None
            }
        }
    }

    /// Starts the navigator at a fix after a standstill if that alignment is good enough.
    #[inline(never)]
    fn start(&mut self, fix: &Fix, age: f32) -> Option<()> {
        let align = self.align.as_mut()?;
        let aligned = align.carried()?;
        let bias = [
            self.settings.sheet.gyro_bias,
            self.settings.sheet.accel_bias,
        ];
        let tilt = aligned.covariance(bias);
        let [.., [.., heading]] = tilt;
        if !(0.0..=MAX_HEADING * MAX_HEADING).contains(&heading) {
            align.restart(false); // a longer one would not do either
            return None;
        }
        let mut position = fix
            .position
            .displaced(fix.velocity.map(|v| v * f64::from(age)));
        let arm = self.memory.antenna.arm();
        if arm != [0.0; 3] {
            // the vehicle stands: the antenna does not move
            position = position.displaced(rotated(aligned.q_bn, arm.map(|m| -f64::from(m))));
        }
        let state = nav::State {
            position,
            velocity: fix.velocity,
            q_bn: aligned.q_bn,
        };
        let Transition {
            gamma: by, q: rest, ..
        } = self.work.scratch();
        (*by, *rest) = ([[0.0; OUTPUTS]; NAV], [[0.0; NAV]; NAV]);
        for i in 0..3 {
            by[i] = aligned.by[i];
            for (entry, &value) in rest[i].iter_mut().zip(&aligned.rest[i]) {
                *entry = value;
            }
        }
        for (k, sigma) in fix.sigmas.iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            if let Some(entry) = rest.get_mut(i).and_then(|row| row.get_mut(i)) {
                *entry = sigma * sigma;
            }
        }
        let variance = core::array::from_fn(|i| if i < 3 { tilt[i][i] } else { rest[i][i] });
        self.starting = Some(Starting {
            number: self.number(),
            way: Way::Gyrocompass,
            heading_sigma: libm::sqrtf(heading),
            at: Some((*fix, age)),
            ..Starting::new(state, variance)
        });
        Some(())
    }

    /// Number of the last sample.
    pub(super) fn number(&self) -> u32 {
        self.last.map_or(self.first, |(number, _)| number)
    }

    /// How the navigator was started.
    fn note(&mut self, of: &Starting) {
        let samples = of.number.wrapping_sub(self.first);
        self.started = Some(Started {
            state: of.state,
            sigmas: of.sigmas,
            way: of.way,
            residual: of.residual,
            time_s: f64::from(samples) * self.stream.map_or(0.0, |stream| stream.period_s),
        });
        self.probation = match of.way {
            Way::Course | Way::Velocity | Way::Heading => Probation::begin(),
            Way::None | Way::Gyrocompass | Way::Known => Probation::default(),
        };
    }

    /// A heading that somebody knows.
    pub(super) fn take_heading(&mut self, heading: Heading) -> Result<(), Reason> {
        let Heading { angle, sigma } = heading;
        if !(angle.abs() <= core::f32::consts::TAU && sigma > 0.0 && sigma <= MAX_GIVEN) {
            return Err(Reason::Range);
        }
        while self.align_part() {}
        if self.course.navigates() {
            return Err(Reason::Alignment);
        }
        let motion = self.course.motion_mut().filter(|motion| motion.has_begun());
        motion.ok_or(Reason::NotAvailable)?.heading(heading);
        Ok(())
    }

    /// How the navigator was started last; `None` before.
    #[must_use]
    pub fn started(&self) -> Option<&Started> {
        self.started.as_ref()
    }

    /// Standard deviation of the vehicle's heading, from that of the sensors' axes as their motion
    /// shows it: misalignments are between the two, and no motion shows them. rad.
    fn of_the_vehicle(&self, sigma: f32) -> f32 {
        let [gyro, accel] = self.settings.misalignment;
        libm::hypotf(sigma, libm::hypotf(gyro, accel))
    }

    /// The part of the report that tells of the alignment.
    pub(super) fn aligned(&self) -> Report {
        let before = self.tally.alignments;
        if let Some(starting) = &self.starting {
            return Report {
                way: starting.way,
                heading_sigma: self.of_the_vehicle(starting.heading_sigma),
                residual: starting.residual,
                refused_alignments: before,
                ..Report::default()
            };
        }
        if self.course.navigates() {
            let started = self.started.as_ref();
            return Report {
                way: started.map_or(Way::None, |started| started.way),
                heading_sigma: self.of_the_vehicle(self.memory.bank.error_doubt(2)),
                residual: started.map_or(0.0, |started| started.residual),
                refused_alignments: before,
                ..Report::default()
            };
        }
        let progress = self.course.motion().map(InMotion::progress);
        Report {
            way: progress.map_or(Way::None, |progress| progress.way),
            heading_sigma: progress.map_or(f32::INFINITY, |progress| {
                self.of_the_vehicle(progress.heading_sigma)
            }),
            residual: progress.map_or(0.0, |progress| progress.residual),
            refused_alignments: before.saturating_add(progress.map_or(0, |p| p.refused)),
            ..Report::default()
        }
    }

    /// One part of the navigator's start. No other work may be left. The start is given up without
    /// a stream, or when the state is outside the range of the equations.
    ///
    /// False: it is given up.
    #[inline(never)]
    pub(super) fn start_part(&mut self) -> bool {
        let Some(mut starting) = self.starting.take() else {
            return false;
        };
        match self.start_step(&starting) {
            Some(Step::Done) => true,
            Some(step) => {
                starting.step = step;
                self.starting = Some(starting);
                true
            }
            None => false,
        }
    }

    fn start_step(&mut self, starting: &Starting) -> Option<Step> {
        match &starting.step {
            Step::Check => Beginning::new(starting.state).ok().map(Step::Navigator),
            Step::Navigator(state) => {
                self.navigate(state)?;
                Some(Step::Around)
            }
            Step::Around => match &starting.at {
                Some((_, age)) if self.memory.antenna.estimates() => {
                    let sigma = self.memory.antenna.age_sigma();
                    Some(Step::See(self.course.navigator()?.around(*age, sigma)))
                }
                _ => Some(Step::Antenna(None)),
            },
            Step::See(around) => {
                let (fix, age) = starting.at.as_ref()?;
                let seen = (*age, self.memory.antenna.age_sigma());
                let navigator = self.course.navigator()?;
                Some(Step::Antenna(Some(
                    navigator.seen_between(fix, seen, around),
                )))
            }
            Step::Antenna(seen) => {
                self.start_antenna(starting, seen.as_ref());
                Some(Step::Hypotheses)
            }
            Step::Hypotheses => {
                self.start_hypotheses(starting);
                Some(Step::End)
            }
            Step::End => {
                self.proportional = Proportional::default();
                self.proportional.set(&self.course.navigator()?.state());
                self.note(starting);
                Some(Step::Done)
            }
            Step::Done => None,
        }
    }

    fn navigate(&mut self, state: &Beginning) -> Option<()> {
        let (stream, scale) = (self.stream?, self.scale?);
        let mut config = nav::Config::new(scale.lsb, stream.period_s, self.settings.noise);
        config.lever_arm = self.memory.antenna.arm();
        config.piece_samples = divisor(stream.block_samples, config.piece_samples);
        let refused = self.course.motion().map(|motion| motion.progress().refused);
        self.course.navigate(&config, state)?;
        self.tally.alignments = self.tally.alignments.saturating_add(refused.unwrap_or(0));
        Some(())
    }

    /// The antenna's errors, and what they add to the navigator's.
    #[inline(never)]
    fn start_antenna(&mut self, starting: &Starting, seen: Option<&nav::Seen>) {
        let applied = starting
            .known
            .map_or([0.0; OUTPUTS], |(applied, _)| applied);
        let scratch = self.work.scratch();
        (self.memory.antenna).navigates(&scratch.gamma, &scratch.q, &applied, seen);
        for (k, variance) in self.memory.antenna.unknown().into_iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            for of in [&mut scratch.q, &mut scratch.phi] {
                if let Some(entry) = of.get_mut(i).and_then(|row| row.get_mut(i)) {
                    *entry += variance;
                }
            }
        }
    }

    /// The hypotheses' means, of which the covariances follow as deferred work.
    #[inline(never)]
    fn start_hypotheses(&mut self, starting: &Starting) {
        let (bank, work) = (&mut self.memory.bank, &mut self.work);
        work.clear();
        self.memory.rehearsal.interrupted();
        if let Some((applied, shown)) = &starting.known {
            bank.start(work, applied, shown);
        } else {
            bank.align_means(&work.block().gamma, &[0.0; OUTPUTS]);
            work.alignment();
        }
    }

    /// Starts the navigator in a known state, instead of an alignment at standstill: for recordings
    /// that have none. `state` holds at the end of the last sample (before the first: at the
    /// stream's start); `sigmas` are the standard deviations of its errors, in the order of
    /// [`NAV`]. A navigator that was running is replaced; what has been learnt stays.
    ///
    /// To be called after [`begin`](crate::learn::Learner::begin). A stream of float samples must
    /// have begun, because their resolution follows from the first one.
    ///
    /// # Errors
    /// [`Reason::NotAvailable`] before that, [`Reason::Range`] for a state that the navigator does
    /// not accept.
    pub fn navigate_from(&mut self, state: nav::State, sigmas: &[f32; NAV]) -> Result<(), Reason> {
        let stream = self.stream.ok_or(Reason::NotAvailable)?;
        self.scale
            .get_or_insert_with(|| Scale::counts_of(stream.lsb));
        self.finish();
        let scratch = self.work.scratch();
        scratch.gamma = [[0.0; OUTPUTS]; NAV];
        scratch.q = [[0.0; NAV]; NAV];
        for (i, (row, sigma)) in scratch.q.iter_mut().zip(sigmas).enumerate() {
            if let Some(entry) = row.get_mut(i) {
                *entry = sigma * sigma;
            }
        }
        let variance = sigmas.map(|sigma| sigma * sigma);
        self.starting = Some(Starting {
            number: self.number(),
            way: Way::Known,
            ..Starting::new(state, variance)
        });
        while self.starting.is_some() {
            if !self.start_part() {
                return Err(Reason::Range);
            }
        }
        Ok(())
    }
}
