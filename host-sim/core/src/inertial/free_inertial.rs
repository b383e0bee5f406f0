//! Free-inertial navigation from an alignment or from a given state, and its error against a
//! reference.

use crate::inertial::align;
use crate::inertial::earth::Local;
use crate::inertial::ekf::{Aided, SlowErrors};
use crate::inertial::motion::{Increments, Motion};
use crate::inertial::session::Session;
use crate::inertial::sins::{HeightLoop, Increment, NavState, Sins};
use nalgebra::Vector3;
use std::cell::Cell;

/// Damping of the vertical channel by the (barometric) reference height.
pub(in crate::inertial) const HEIGHT_LOOP: HeightLoop = HeightLoop { time_s: 30.0 };

/// Navigation errors at every epoch of a free-inertial run. Index 0 is its start.
#[derive(Debug, Clone, Default)]
pub struct FreeInertial {
    /// Position error north, east, down, m.
    pub position: Vec<Vector3<f64>>,
    /// Velocity error north, east, down, m/s.
    pub velocity: Vec<Vector3<f64>>,
    /// Navigated position relative to the start, north, east, m.
    pub track: Vec<[f64; 2]>,
}

impl FreeInertial {
    /// Empty, with capacity for `epochs` epochs.
    pub(in crate::inertial) fn with_room(epochs: usize) -> Self {
        Self {
            position: Vec::with_capacity(epochs),
            velocity: Vec::with_capacity(epochs),
            track: Vec::with_capacity(epochs),
        }
    }

    /// Adds the errors of `nav` at epoch `epoch` of a run that began at epoch `from`.
    pub fn note(&mut self, session: &Session, nav: &NavState, from: usize, epoch: usize) {
        let local = |epoch: usize| {
            let at = session.reference[epoch].position;
            Local::at(at.lat, at.h)
        };
        self.note_by(session, nav, (from, &local(from)), (epoch, &local(epoch)));
    }

    /// As [`Self::note`], with the Earth's properties at the reference's positions at both epochs.
    pub(in crate::inertial) fn note_by(
        &mut self,
        session: &Session,
        nav: &NavState,
        (from, origin): (usize, &Local),
        (epoch, here): (usize, &Local),
    ) {
        let truth = &session.reference[epoch];
        let arm = nav.q_bn * session.reference_arm;
        self.position
            .push(nav.position.ned_by(&truth.position, here) + arm);
        self.velocity.push(nav.velocity - truth.velocity);
        let start = session.reference[from].position;
        let p = nav.position.ned_by(&start, origin) + arm;
        self.track.push([p.x, p.y]);
    }
}

/// Self-alignment over the standstill of the session, then free-inertial navigation to the end.
/// Epoch 0 of the result is the end of the standstill. `None` if the standstill does not give an
/// attitude.
#[must_use]
pub fn aligned_free_inertial(session: &Session, increments: &[Increment]) -> Option<FreeInertial> {
    let first = session.standstill;
    let start = &session.reference[first];
    let q_bn = align::inertial_frame(
        &increments[..first * session.steps_per_epoch()],
        session.step_s(),
        session.samples(),
        session.reference[0].position,
    )?;
    let nav = NavState {
        position: start.position,
        velocity: start.velocity,
        q_bn,
    };
    Some(free_inertial(
        session,
        &increments,
        nav,
        first,
        session.epochs(),
    ))
}

/// Free-inertial navigation from `nav` at epoch `from` to epoch `to`. The reference height damps
/// the vertical channel. The horizontal channels are free.
#[must_use]
pub fn free_inertial(
    session: &Session,
    increments: &dyn Motion,
    nav: NavState,
    from: usize,
    to: usize,
) -> FreeInertial {
    let n = session.steps_per_epoch();
    let mut sins = Sins::new(nav).with_samples(session.samples());
    let mut out = FreeInertial::default();
    out.note(session, &sins.nav, from, from);
    for k in from..to {
        for increment in increments.epoch(k, n).iter() {
            sins.step(increment, session.step_s());
        }
        let below = (sins.nav.q_bn * session.reference_arm).z;
        let height = session.reference[k + 1].position.h + below;
        sins.damp_height(&HEIGHT_LOOP, height, crate::inertial::session::EPOCH_S);
        out.note(session, &sins.nav, from, k + 1);
    }
    out
}

/// Free inertial from the filter's state at epoch `until` with its last estimate of the errors, to
/// the end of the session. `increments` are those of the whole session.
#[must_use]
pub fn from_filter(
    filter: &Aided,
    session: &Session,
    increments: &[Increment],
    until: usize,
) -> FreeInertial {
    let (n, dt) = (session.steps_per_epoch(), session.step_s());
    let slow = Cell::new(SlowErrors::default());
    let corrected = |k: usize| {
        let mut now = slow.get();
        let around = [&increments[k], &increments[k - 1]];
        let time = (k as f64 + 0.5) * dt;
        let out = filter.corrected_at(around[0], around[1], dt, time, &mut now);
        slow.set(now);
        out
    };
    let epoch = |k: usize| (k * n..(k + 1) * n).map(corrected).collect();
    let corrected = Increments::Made(Box::new(epoch));
    free_inertial(
        session,
        &corrected,
        filter.sins.nav,
        until,
        session.epochs(),
    )
}

/// Free-inertial navigation from the first state of the reference to the end, without any
/// correction.
#[must_use]
pub fn from_reference(session: &Session) -> FreeInertial {
    free_inertial(
        session,
        &session.increments(),
        session.reference[0],
        0,
        session.epochs(),
    )
}
