//! Free-inertial navigation of several filters side by side: [`free_inertial`] with samples that
//! each filter corrects by its last estimate. The results have the same bits.
//!
//! [`free_inertial`]: crate::inertial::free_inertial::free_inertial

use crate::inertial::earth::Local;
use crate::inertial::ekf::{Aided, Regressor};
use crate::inertial::free_inertial::{FreeInertial, HEIGHT_LOOP};
use crate::inertial::lane::{Lane, M3, PLACES, V3, divided, scaled, sub, turned};
use crate::inertial::session::{EPOCH_S, Session};
use crate::inertial::sins::{Increment, Samples, Sins, Strapdown};
use crate::inertial::vectors::widest;
use fearless_simd::f64x8;

/// A filter that navigates without fixes from the end of epoch `until` on.
#[derive(Debug, Clone, Copy)]
pub struct Flight<'a> {
    /// The filter at that epoch.
    pub filter: &'a Aided,
    /// The session, to whose end it navigates.
    pub session: &'a Session,
    /// All increments of the session.
    pub increments: &'a [Increment],
    /// The epoch at which the fixes end.
    pub until: usize,
}

/// Whether a filter may navigate beside others: its parameters are slow, or follow the inputs.
#[must_use]
pub fn flies(filter: &Aided) -> bool {
    let simple =
        |regressor: Regressor| regressor.is_slow() || matches!(regressor, Regressor::Input(_));
    let mut parameters = filter.model.parameters.iter();
    filter.model.delay_s == 0.0
        && filter.sins.samples == Samples::One
        && parameters.all(|p| simple(p.regressor))
}

/// Navigates at most [`PLACES`] filters that [`flies`] accepts, over sessions of the same length
/// with the same steps, from the same epoch.
#[must_use]
pub fn free_abreast(flights: &[Flight<'_>]) -> Vec<FreeInertial> {
    if flights.is_empty() {
        return Vec::new();
    }
    widest!(simd => run::<f64x8<_>>(simd, flights))
}

/// The parts of a filter's errors that follow the inputs: the matrix of each triad.
fn matrices(filter: &Aided) -> [[[f64; 3]; 3]; 2] {
    let mut out = [[[0.0; 3]; 3]; 2];
    for (p, theta) in filter.model.parameters.iter().zip(&filter.theta) {
        if let Regressor::Input(axis) = p.regressor {
            out[p.triad.index()][p.axis][axis] += theta;
        }
    }
    out
}

/// The matrix of a triad for each filter.
#[inline(always)]
fn lanes_of<L: Lane>(kind: L::Kind, all: &[[[[f64; 3]; 3]; 2]; PLACES], triad: usize) -> M3<L> {
    let row = |r: usize| L::gathered(kind, |l| all[l][triad][r].into());
    [row(0), row(1), row(2)]
}

/// Errors that follow the inputs, on top of the slow ones.
#[inline(always)]
fn with_inputs<L: Lane>(slow: &V3<L>, by: &M3<L>, input: &V3<L>) -> V3<L> {
    let mut out = *slow;
    for (out, row) in out.iter_mut().zip(by) {
        *out = *out + row[0] * input[0] + row[1] * input[1] + row[2] * input[2];
    }
    out
}

#[inline(always)]
fn run<L: Lane>(kind: L::Kind, flights: &[Flight<'_>]) -> Vec<FreeInertial> {
    let flight = |l: usize| flights.get(l).unwrap_or(&flights[0]);
    let (session, from) = (flights[0].session, flights[0].until);
    let (n, dt) = (session.steps_per_epoch(), session.step_s());
    let begin = |flight: &Flight<'_>| {
        let sins = Sins::new(flight.filter.sins.nav);
        sins.with_samples(flight.session.samples())
    };
    let sins: Vec<Sins> = flights.iter().map(begin).collect();
    let mut nav = Strapdown::of(kind, |l| sins.get(l).unwrap_or(&sins[0]));
    let arm = L::gathered(kind, |l| flight(l).session.reference_arm);
    let by: [_; PLACES] = std::array::from_fn(|l| matrices(flight(l).filter));
    let moves = by.as_flattened().as_flattened().as_flattened();
    let moves = moves.iter().any(|x| *x != 0.0);
    let by = [lanes_of::<L>(kind, &by, 0), lanes_of::<L>(kind, &by, 1)];
    let mut notes = Notes::of(flights);
    notes.add(flights, &nav, from);
    for k in from..session.epochs() {
        let second = (((k * n) as f64 + 0.5) * dt / EPOCH_S) as usize;
        let slow: [_; PLACES] = std::array::from_fn(|l| {
            let filter = flight(l).filter;
            filter.model.slow_errors(&filter.theta, second)
        });
        let slow = [
            L::gathered(kind, |l| slow[l][0]),
            L::gathered(kind, |l| slow[l][1]),
        ];
        for i in k * n..(k + 1) * n {
            let dtheta = L::gathered(kind, |l| flight(l).increments[i].dtheta);
            let dv = L::gathered(kind, |l| flight(l).increments[i].dv);
            let mut error = slow;
            if moves {
                error = [
                    with_inputs(&slow[0], &by[0], &divided(&dtheta, dt)),
                    with_inputs(&slow[1], &by[1], &divided(&dv, dt)),
                ];
            }
            let dtheta = sub(&dtheta, &scaled(&error[0], dt));
            nav.step(&dtheta, &sub(&dv, &scaled(&error[1], dt)), dt);
        }
        let below = turned(&nav.nav.q_bn, &arm)[2];
        let truth = L::of(kind, |l| flight(l).session.reference[k + 1].position.h);
        nav.nav.damp_height(&HEIGHT_LOOP, truth + below, EPOCH_S);
        notes.add(flights, &nav, k + 1);
    }
    notes.out
}

/// The errors of all filters, and the Earth's properties at their origins.
struct Notes {
    out: Vec<FreeInertial>,
    /// The Earth's properties at the start of each.
    origins: Vec<Local>,
}

impl Notes {
    fn of(flights: &[Flight<'_>]) -> Self {
        let origin = |flight: &Flight<'_>| {
            let at = flight.session.reference[flight.until].position;
            Local::at(at.lat, at.h)
        };
        let empty = |flight: &Flight<'_>| {
            FreeInertial::with_room(flight.session.epochs() + 1 - flight.until)
        };
        Self {
            out: flights.iter().map(empty).collect(),
            origins: flights.iter().map(origin).collect(),
        }
    }

    /// Adds the errors at an epoch.
    fn add<L: Lane>(&mut self, flights: &[Flight<'_>], nav: &Strapdown<L>, epoch: usize) {
        let mut last: Option<(usize, Local)> = None;
        let each = self.out.iter_mut().zip(&self.origins).zip(flights);
        for (l, ((out, origin), flight)) in each.enumerate() {
            let at = |l: usize| flights[l].session.reference[epoch].position;
            let here = match last {
                Some((of, local)) if at(of) == at(l) => local,
                _ => Local::at(at(l).lat, at(l).h),
            };
            last = Some((l, here));
            let state = nav.nav.state(l);
            out.note_by(
                flight.session,
                &state,
                (flight.until, origin),
                (epoch, &here),
            );
        }
    }
}

#[cfg(test)]
mod tests;
