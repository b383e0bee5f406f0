//! Coasts: navigation without fixes from states of the reference, with a scheme's increments.

use super::reference::Reference;
use super::rivals::with_rests;
use super::timeline::Timeline;
use super::{Assumed, Row};
use host_core::inertial::sins::{Increment, NavState, Sins};
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use std::ops::Range;

/// Least time between the starts of two coasts, s, and most coasts in a session.
const APART_S: f64 = 5.0;
const MOST: f64 = 60.0;
/// A coast is judged at the state of the reference that is nearest to its horizon, at most this far
/// from it, s.
const NEAR_S: f64 = 0.3;

/// How a scheme navigates.
pub enum Scheme<'a> {
    /// With these increments.
    Increments(&'a [Increment]),
    /// With zero velocity wherever the vehicle stands, less these biases: rad/s, m/s2.
    Rests([Vector3<f64>; 2], &'a [Range<usize>]),
}

/// Where coasts begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Starts {
    /// All along the session, from this time on, s.
    From(f64),
    /// One, which ends with the session.
    End,
    /// One, at this time, s.
    At(f64),
    /// One, after this number of steps, from this state.
    Own(usize, NavState),
}

/// Errors of the coasts of one horizon: horizontal position, m, and attitude, rad.
type Errors = Vec<[f64; 2]>;

/// Coasts of one session.
pub struct Coasts<'a> {
    /// The session.
    pub timeline: &'a Timeline,
    /// The states that it is judged by.
    pub reference: &'a Reference,
    /// What is assumed of the sensors.
    pub assumed: &'a Assumed,
    /// Horizons, s, rising.
    pub horizons: &'a [f64],
}

impl Coasts<'_> {
    /// Errors of a scheme at each horizon.
    pub fn errors(&self, scheme: &Scheme<'_>, starts: Starts) -> Vec<Errors> {
        match starts {
            Starts::End => (0..self.horizons.len())
                .map(|k| {
                    let horizon = self.horizons[k..=k].to_vec();
                    let long = self.timeline.step_at(horizon[0]);
                    let end = self.reference.states.last().map_or(0, |(step, _)| *step);
                    if long >= end {
                        return Vec::new();
                    }
                    let at = self.reference.near(end - long);
                    self.coast(scheme, at, &horizon)
                        .remove(0)
                        .into_iter()
                        .collect()
                })
                .collect(),
            Starts::From(time) => self.along(scheme, time),
            Starts::At(time) => self.one(scheme, self.reference.near(self.timeline.step_at(time))),
            Starts::Own(step, nav) => self.one(scheme, &(step, nav)),
        }
    }

    fn one(&self, scheme: &Scheme<'_>, at: &(usize, NavState)) -> Vec<Errors> {
        let errors = self.coast(scheme, at, self.horizons).into_iter();
        errors.map(|error| error.into_iter().collect()).collect()
    }

    fn along(&self, scheme: &Scheme<'_>, from_s: f64) -> Vec<Errors> {
        let mut out = vec![Vec::new(); self.horizons.len()];
        let duration = self.timeline.duration_s();
        let apart = self.timeline.step_at(APART_S.max(duration / MOST)).max(1);
        let mut next = self.timeline.step_at(from_s);
        for at in &self.reference.states {
            if at.0 < next {
                continue;
            }
            next = at.0 + apart;
            for (errors, error) in out.iter_mut().zip(self.coast(scheme, at, self.horizons)) {
                errors.extend(error);
            }
        }
        out
    }

    /// The errors at each horizon of a coast from a state; `None` beyond the end.
    fn coast(
        &self,
        scheme: &Scheme<'_>,
        (from, nav): &(usize, NavState),
        horizons: &[f64],
    ) -> Vec<Option<[f64; 2]>> {
        let step_s = self.timeline.step_s;
        let judged: Vec<Option<&(usize, NavState)>> = horizons
            .iter()
            .map(|horizon| {
                let at = *from + (horizon / step_s).round() as usize;
                let near = self.reference.near(at);
                let off = near.0.abs_diff(at) as f64 * step_s;
                (off <= NEAR_S && near.0 > *from).then_some(near)
            })
            .collect();
        let to = judged.iter().flatten().map(|(at, _)| *at).max();
        let mut out = vec![None; horizons.len()];
        let Some(to) = to else {
            return out;
        };
        let mut note = |step: usize, nav: &NavState| {
            for (slot, judged) in out.iter_mut().zip(&judged) {
                if let Some((_, truth)) = judged.filter(|(at, _)| *at == step) {
                    *slot = Some(error(nav, truth));
                }
            }
        };
        match scheme {
            Scheme::Increments(increments) => {
                let mut sins = Sins::new(*nav).with_samples(self.timeline.session.samples());
                for step in *from..to {
                    sins.step(&increments[step], step_s);
                    note(step + 1, &sins.nav);
                }
            }
            Scheme::Rests(biases, rests) => {
                let from = (*from, nav);
                with_rests(self.timeline, self.assumed, from, biases, rests, note, to);
            }
        }
        out
    }

    /// The rows of a scheme.
    pub fn rows(
        &self,
        (session, scheme, phase): (usize, &str, &str),
        navigates: &Scheme<'_>,
        starts: Starts,
    ) -> Vec<Row> {
        let errors = self.errors(navigates, starts);
        let of = |(horizon_s, errors): (&f64, Errors)| {
            let worst = errors
                .iter()
                .map(|[position, _]| *position)
                .reduce(f64::max)?;
            Some(Row {
                session,
                name: self.timeline.name.clone(),
                scheme: scheme.to_owned(),
                phase: phase.to_owned(),
                horizon_s: *horizon_s,
                coasts: errors.len(),
                median_m: median(errors.iter().map(|[position, _]| *position)),
                worst_m: worst,
                attitude_deg: median(errors.iter().map(|[_, attitude]| attitude / DEG)),
            })
        };
        self.horizons.iter().zip(errors).filter_map(of).collect()
    }
}

fn error(nav: &NavState, truth: &NavState) -> [f64; 2] {
    let position = nav.position.ned_from(&truth.position);
    [position.xy().norm(), nav.q_bn.angle_to(&truth.q_bn)]
}

/// The median, the mean of the middle two of an even number; NaN of none.
pub fn median(numbers: impl Iterator<Item = f64>) -> f64 {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.sort_by(f64::total_cmp);
    match numbers.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => numbers[n / 2],
        n => f64::midpoint(numbers[n / 2 - 1], numbers[n / 2]),
    }
}
