//! Start of the navigator, and its course across missing samples.

use super::FixLearner;
use super::observe::STANDS_MPS;
use super::proportional::Proportional;
use super::take::Fresh;
use crate::align::MAX_NORTH;
use crate::align::motion::{BiasObservations, InMotion};
use crate::control::{HeadingSource, Reason};
use crate::fix::{Fix, Heading, OBSERVATIONS};
use crate::learn::Report;
use crate::learn::prior::NAV;
use crate::learn::quantise::{Scale, divisor};
use crate::nav;
use crate::nav::vector::{V32, dot, rotated};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

/// Largest standard deviation of a heading that somebody gives, rad.
const MAX_GIVEN: f32 = 1.0;
/// Seconds with fixes after an alignment in motion in which it may still turn out to be wrong, and
/// how many of them in a row show that, by a refused fix.
const PROBATION: u8 = 60;
const REFUSED: u8 = 5;
/// Later, a navigator is given up when seconds with refused fixes whose errors are large and point
/// the same way as before are ahead by so many (assumed). A receiver that is worse than it says
/// errs in all directions, one that is late errs less, and one that is displaced still measures the
/// velocity.
const WRONG: u8 = 60;
/// What is learnt is in doubt, and not stored, while they are ahead by more than so many.
const DOUBT: u8 = 5;
/// Large errors: of the velocity, m/s, and of the position where no velocity is measured, m.
const LARGE: [f32; 2] = [2.0, 20.0];

/// A start of the navigator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Started {
    /// State at the end of the sample before.
    pub state: nav::State,
    /// Standard deviations of its errors, in the order of [`NAV`].
    pub sigmas: [f32; NAV],
    /// Source of the heading.
    pub way: HeadingSource,
    /// Mean normalised innovation squared of the alignment in motion; 0 without one.
    pub residual: f32,
    /// Time since the first sample, s.
    pub time_s: f64,
}

/// A navigator that is about to start. Its errors are in [`super::Scratch::block`].
#[derive(Debug, Clone)]
pub(super) struct Starting {
    /// State at the end of sample `number`, and standard deviations of its errors.
    pub state: nav::State,
    pub sigmas: [f32; NAV],
    pub number: u32,
    /// Source of the heading, and the residual.
    pub way: HeadingSource,
    pub residual: f32,
    /// The fix, and its age, that the state is from.
    pub at: Option<(Fix, f32)>,
    /// Sensor errors found by an alignment in motion.
    pub known: Option<([f32; OUTPUTS], BiasObservations)>,
}

impl Starting {
    /// A start from a known state with these variances.
    pub fn new(state: nav::State, variance: [f32; NAV]) -> Starting {
        Starting {
            state,
            sigmas: variance.map(|v| libm::sqrtf(v.max(0.0))),
            number: 0,
            way: HeadingSource::None,
            residual: 0.0,
            at: None,
            known: None,
        }
    }
}

/// What fixes show of the navigator: after an alignment in motion, what that could not see, such as
/// a receiver that gives east before north; later, that it has lost its way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Probation {
    left: u8,
    refused: u8,
    /// Errors of the last second's fix, and the balance of [`WRONG`].
    errors: V32,
    wrong: u8,
}

/// Verdict on a navigator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It may go on.
    Good,
    /// It was aligned wrongly.
    Misaligned,
    /// It has lost its way, and what it has learnt is wrong.
    Wrong,
}

impl Probation {
    fn begin() -> Probation {
        Probation {
            left: PROBATION,
            ..Probation::default()
        }
    }

    /// What has been learnt is in doubt.
    pub fn doubts(&self) -> bool {
        self.wrong > DOUBT
    }

    /// The first fix of a second: errors of the navigator by it, and its components that were
    /// `refused`, one bit each.
    pub fn fix(&mut self, z: &[f32; OBSERVATIONS], measured: &[bool; OBSERVATIONS], refused: u8) {
        self.left = self.left.saturating_sub(1);
        self.refused = if refused != 0 && self.left > 0 {
            self.refused + 1
        } else {
            0
        };
        let [north, east, down, vn, ve, vd] = *z;
        let [.., level, _, _] = *measured;
        let [of_velocity, of_position] = LARGE;
        let (errors, of, large) = if level {
            ([vn, ve, vd], refused >> 3, of_velocity)
        } else {
            ([north, east, down], refused, of_position)
        };
        let errors = core::array::from_fn(|i| if of >> i & 1 == 1 { errors[i] } else { 0.0 });
        let same = dot(errors, self.errors) > 0.0 && dot(errors, errors) > large * large;
        self.wrong = if same {
            self.wrong.saturating_add(1)
        } else {
            self.wrong.saturating_sub(1)
        };
        self.errors = errors;
    }

    /// The verdict; a bad one once.
    pub fn verdict(&mut self) -> Verdict {
        let verdict = if self.refused >= REFUSED {
            Verdict::Misaligned
        } else if self.wrong >= WRONG {
            Verdict::Wrong
        } else {
            return Verdict::Good;
        };
        *self = Probation::default();
        verdict
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
    /// Processes a fix while nothing navigates. An alignment at standstill is solved for its
    /// position, and the next fix starts the navigator.
    pub(super) fn start_from(&mut self, fresh: &Fresh) {
        let Some(align) = &mut self.navigation.align else {
            return; // nothing navigates without a stream
        };
        let long = align.gathered() >= self.settings.align_s || align.is_over();
        if fresh.fix.has(0..3) && long {
            if !align.is_solved() {
                let place = &fresh.fix.position;
                align.solve(place.latitude, place.height);
            } else if self.start(&fresh.standing(), fresh.age).is_some() {
                return;
            }
        }
        self.align_in_motion(fresh);
    }

    /// Starts the navigator at a fix after a standstill if that alignment is good enough.
    #[inline(never)]
    fn start(&mut self, fix: &Fix, age: f32) -> Option<()> {
        let align = self.navigation.align.as_mut()?;
        let aligned = align.aligned()?;
        let bias = [
            self.settings.sheet.gyro_bias,
            self.settings.sheet.accel_bias,
        ];
        let tilt = aligned.covariance(bias);
        let [.., [.., heading]] = tilt;
        if !(0.0..=MAX_NORTH * MAX_NORTH).contains(&heading) {
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
        } = &mut self.memory.scratch.block;
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
        self.navigate_since(&Starting {
            number: self.number(),
            way: HeadingSource::Gyrocompass,
            at: Some((*fix, age)),
            ..Starting::new(state, variance)
        });
        Some(())
    }

    /// Number of the last sample.
    pub(super) fn number(&self) -> u32 {
        self.samples
            .last
            .map_or(self.samples.first, |(number, _)| number)
    }

    /// Records a start of the navigator.
    fn note(&mut self, of: &Starting) {
        let samples = of.number.wrapping_sub(self.samples.first);
        self.navigation.started = Some(Started {
            state: of.state,
            sigmas: of.sigmas,
            way: of.way,
            residual: of.residual,
            time_s: f64::from(samples) * self.samples.stream.map_or(0.0, |stream| stream.period_s),
        });
        self.navigation.probation = match of.way {
            HeadingSource::Course | HeadingSource::Velocity | HeadingSource::Heading => {
                Probation::begin()
            }
            HeadingSource::None | HeadingSource::Gyrocompass | HeadingSource::Known => {
                Probation::default()
            }
        };
    }

    /// A heading that somebody knows.
    pub(super) fn take_heading(&mut self, heading: Heading) -> Result<(), Reason> {
        let Heading { angle, sigma } = heading;
        if !(angle.abs() <= core::f32::consts::TAU && sigma > 0.0 && sigma <= MAX_GIVEN) {
            return Err(Reason::Range);
        }
        if self.navigation.course.navigates() {
            return Err(Reason::Alignment);
        }
        let motion = self
            .navigation
            .course
            .motion_mut()
            .filter(|motion| motion.has_begun() && motion.knows_forward());
        motion.ok_or(Reason::NotAvailable)?.heading(heading);
        Ok(())
    }

    /// The last start of the navigator; `None` before.
    #[must_use]
    pub fn started(&self) -> Option<&Started> {
        self.navigation.started.as_ref()
    }

    /// Standard deviation of the vehicle's heading, from that of the sensors' axes as their motion
    /// shows it: misalignments are between the two, and no motion shows them. rad.
    fn of_the_vehicle(&self, sigma: f32) -> f32 {
        let [gyro, accel] = self.settings.sheet.misalignment;
        libm::hypotf(sigma, libm::hypotf(gyro, accel))
    }

    /// The part of the report on the alignment.
    pub(super) fn aligned(&self) -> Report {
        let before = self.tally.alignments;
        if self.navigation.course.navigates() {
            let started = self.navigation.started.as_ref();
            return Report {
                way: started.map_or(HeadingSource::None, |started| started.way),
                heading_sigma: self.of_the_vehicle(self.memory.bank.error_doubt(2)),
                residual: started.map_or(0.0, |started| started.residual),
                refused_alignments: before,
                ..Report::default()
            };
        }
        let progress = self.navigation.course.motion().map(InMotion::progress);
        Report {
            way: progress.map_or(HeadingSource::None, |progress| progress.way),
            heading_sigma: progress.map_or(f32::INFINITY, |progress| {
                self.of_the_vehicle(progress.heading_sigma)
            }),
            residual: progress.map_or(0.0, |progress| progress.residual),
            refused_alignments: before.saturating_add(progress.map_or(0, |p| p.refused)),
            ..Report::default()
        }
    }

    /// Starts the navigator. `None`: there is no stream, or the state is outside the range of the
    /// equations.
    #[inline(never)]
    pub(super) fn navigate_since(&mut self, starting: &Starting) -> Option<()> {
        self.navigate(starting.state)?;
        self.navigation.astray = false;
        let navigator = self.navigation.course.navigator()?;
        let antenna = &self.memory.antenna;
        let innovation = (starting.at.as_ref())
            .filter(|_| antenna.estimates())
            .map(|(fix, age)| navigator.antenna_innovation(fix, *age, antenna.age_sigma()));
        self.memory.bank.set_rest(navigator.at_rest());
        self.start_antenna(starting, innovation.as_ref());
        self.start_hypotheses(starting);
        self.motion.proportional = Proportional::default();
        self.motion
            .proportional
            .set(&self.navigation.course.navigator()?.state());
        self.note(starting);
        Some(())
    }

    fn navigate(&mut self, state: nav::State) -> Option<()> {
        let (stream, scale) = (self.samples.stream?, self.samples.scale?);
        let mut config = nav::Config::new(scale.lsb, stream.period_s, self.settings.noise);
        config.lever_arm = self.memory.antenna.arm();
        config.piece_samples = divisor(stream.block_samples, config.piece_samples);
        let refused = self
            .navigation
            .course
            .motion()
            .map(|motion| motion.progress().refused);
        self.navigation.course.navigate(&config, state)?;
        self.tally.alignments = self.tally.alignments.saturating_add(refused.unwrap_or(0));
        Some(())
    }

    /// The antenna's errors, and what they add to the navigator's.
    #[inline(never)]
    fn start_antenna(&mut self, starting: &Starting, innovation: Option<&nav::AntennaInnovation>) {
        let applied = starting
            .known
            .map_or([0.0; OUTPUTS], |(applied, _)| applied);
        let scratch = &mut self.memory.scratch.block;
        (self.memory.antenna).navigates(&scratch.gamma, &scratch.q, &applied, innovation);
        for (k, variance) in self.memory.antenna.unknown().into_iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            for of in [&mut scratch.q, &mut scratch.phi] {
                if let Some(entry) = of.get_mut(i).and_then(|row| row.get_mut(i)) {
                    *entry += variance;
                }
            }
        }
    }

    #[inline(never)]
    fn start_hypotheses(&mut self, starting: &Starting) {
        self.memory.rehearsal.interrupted();
        let (bank, scratch) = (&mut self.memory.bank, &mut self.memory.scratch);
        match &starting.known {
            Some((applied, observed)) => bank.start(scratch, applied, observed),
            None => bank.align(scratch),
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
        let stream = self.samples.stream.ok_or(Reason::NotAvailable)?;
        self.samples
            .scale
            .get_or_insert_with(|| Scale::counts_of(stream.lsb));
        let scratch = &mut self.memory.scratch.block;
        scratch.gamma = [[0.0; OUTPUTS]; NAV];
        scratch.q = [[0.0; NAV]; NAV];
        for (i, (row, sigma)) in scratch.q.iter_mut().zip(sigmas).enumerate() {
            if let Some(entry) = row.get_mut(i) {
                *entry = sigma * sigma;
            }
        }
        let variance = sigmas.map(|sigma| sigma * sigma);
        let starting = Starting {
            number: self.number(),
            way: HeadingSource::Known,
            ..Starting::new(state, variance)
        };
        self.navigate_since(&starting).ok_or(Reason::Range)
    }
}
