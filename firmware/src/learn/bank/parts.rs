//! The time update over an interval, a fix, and the networks' step, in parts that are each short
//! enough to be computed between two samples. To compute all of it at once, call [`Bank::work`]
//! until it is false.

use super::table::LARGEST;
use super::{Bank, HYPOTHESES, NAV, OUTPUTS, STORED, TRIADS, ZERO_CORRECTION, index};
use crate::align::motion::Shown;
use crate::fix::OBSERVATIONS;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{
    COVARIANCE_PARTS, DEFERRED_PARTS, MAX_DEFERRED, Transition, Workspace,
};

// Parts are numbered in the order in which they are computed. Each constant is the first part of
// its kind: covariances, all parts of one hypothesis after the other's; the observations of a fix;
// the end of the fix; the networks' step; no part left.

const UPDATE: usize = HYPOTHESES * COVARIANCE_PARTS;
/// An observation: its acceptance, and then the hypotheses.
const OBSERVATION: usize = 1 + HYPOTHESES;
/// Observations that are deferred together, and the change that they make in the largest
/// covariance.
const GROUP: usize = OBSERVATION * MAX_DEFERRED + DEFERRED_PARTS;
const FINISH_UPDATE: usize = UPDATE + OBSERVATIONS / MAX_DEFERRED * GROUP;
const FIX_IS_OVER: usize = FINISH_UPDATE + HYPOTHESES;
const STEP: usize = FIX_IS_OVER + 1;
const END: usize = STEP + HYPOTHESES;

/// Deferred work, in this order: the covariances over an interval, a fix at its end, the networks'
/// step.
#[derive(Clone, Debug)]
pub struct Work<T: Real = f32> {
    next: usize,
    block: Transition<NAV, T>,
    workspace: Workspace<NAV, OUTPUTS, T>,
    fix: Option<([T; OBSERVATIONS], [T; OBSERVATIONS])>,
    /// Refusals of the fix count.
    counts: bool,
    inputs: Option<[[T; 3]; TRIADS]>,
    accepted: bool,
    /// The interval is an alignment instead: `block.gamma` and `block.q` then hold its `by` and
    /// `rest`.
    aligns: bool,
    /// The alignment has estimated the sensors' errors: `block.phi` holds its whole covariance.
    knows: bool,
    /// What it has shown of them, until the hypotheses have learnt it. It comes first.
    shown: Option<Learnt<T>>,
    /// The refused observations of the last fix, one bit each.
    pub refused: u8,
}

/// What an alignment has shown of the sensors' errors, before the navigator's errors follow from
/// them. The hypotheses learn it as a fix of a navigator whose errors are the observed ones.
#[derive(Clone, Debug)]
struct Learnt<T> {
    by: [[T; OUTPUTS]; NAV],
    z: [T; OBSERVATIONS],
    variance: [T; OBSERVATIONS],
    /// The alignment's estimate of the sensors' errors.
    applied: [T; OUTPUTS],
}

const _: () = assert!(OBSERVATIONS == OUTPUTS);

impl<T: Real> Work<T> {
    /// All zeros, so that a static one takes no room in flash.
    pub const ZEROED: Self = Self {
        next: 0,
        block: Transition::ZEROED,
        workspace: Workspace::ZEROED,
        fix: None,
        counts: false,
        inputs: None,
        accepted: false,
        aligns: false,
        knows: false,
        shown: None,
        refused: 0,
    };

    /// All parts are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.next >= END
    }

    /// An interval that the navigator has passed. Its means are propagated already
    /// ([`Bank::propagate_mean`]).
    pub fn interval(&mut self, block: &Transition<NAV, T>) {
        self.block = *block;
        self.aligns = false;
        self.shown = None;
        self.next = 0;
    }

    /// A new navigator, whose means are set already ([`Bank::align_means`]). Its errors by the
    /// sensors' errors and the covariance of its others are in [`Work::scratch`].
    pub fn alignment(&mut self) {
        (self.aligns, self.knows) = (true, false);
        self.shown = None;
        self.next = 0;
    }

    /// A fix at the end of the interval. An observation of infinite variance is not measured: it
    /// neither scores nor teaches.
    pub fn fix(&mut self, z: [T; OBSERVATIONS], variance: [T; OBSERVATIONS]) {
        self.fix = Some((z, variance));
        self.counts = true;
        self.refused = 0;
        self.next = self.next.min(UPDATE);
    }

    /// Whether refusals of the last fix count: see [`super::Gates::escape`].
    pub fn counts_refusals(&mut self, counts: bool) {
        self.counts = counts;
    }

    /// Memory that an alignment may use until the navigator that it starts has its first work.
    /// Then `gamma` are the navigator's errors by the sensors' errors, `q` is the covariance of its
    /// others, and `phi` that of both if the alignment has estimated the sensors' errors.
    pub fn scratch(&mut self) -> &mut Transition<NAV, T> {
        &mut self.block
    }

    /// The interval whose covariances are computed.
    pub fn block(&self) -> &Transition<NAV, T> {
        &self.block
    }

    /// Another fix in place of that at the end of the interval, before it is computed.
    pub fn replace_fix(&mut self, (z, variance): ([T; OBSERVATIONS], [T; OBSERVATIONS])) {
        if let Some(fix) = &mut self.fix {
            *fix = (z, variance);
        }
    }

    /// The networks step at the end.
    pub fn step(&mut self, inputs: [[T; 3]; TRIADS]) {
        self.inputs = Some(inputs);
        self.next = self.next.min(STEP);
    }

    /// Drops all work.
    pub fn clear(&mut self) {
        self.next = END;
        self.fix = None;
        self.shown = None;
        self.inputs = None;
    }
}

impl<T: Real> Bank<T> {
    /// The navigator has passed an interval with the estimate `applied` (rad/s, m/s^2) subtracted:
    /// propagates the means. The covariances follow by [`Work::interval`] and [`Bank::work`].
    pub fn propagate_mean(&mut self, block: &Transition<NAV, T>, applied: &[T; OUTPUTS]) {
        self.each(|h| h.propagate_mean(block, applied));
    }

    /// A new navigator that was aligned. Its initial errors are `by` (rad, m/s, m for 1 rad/s or 1
    /// m/s^2) times the sensors' errors during the alignment, from which `applied` had been
    /// subtracted. This sets the means; the covariances follow by [`Work::alignment`] and
    /// [`Bank::work`]. What was learnt stays.
    pub fn align_means(&mut self, by: &[[T; OUTPUTS]; NAV], applied: &[T; OUTPUTS]) {
        self.believed = false;
        self.each(|h| h.align_mean(by, applied));
    }

    /// A new navigator from an alignment that has estimated the sensors' errors too: `applied`. Its
    /// errors are in [`Work::scratch`]. First the hypotheses learn what was `shown` of the sensors;
    /// that counts for none of them, because all of them profit.
    pub fn start(&mut self, work: &mut Work<T>, applied: &[T; OUTPUTS], shown: &Shown) {
        work.alignment();
        work.knows = true;
        let to = |x: f32| T::from_f64(f64::from(x));
        let mut learnt = Learnt {
            by: [[T::ZERO; OUTPUTS]; NAV],
            z: shown.z.map(to),
            variance: shown.variance.map(to),
            applied: *applied,
        };
        for (k, row) in shown.rows.iter().enumerate() {
            if let Some(of) = learnt.by.get_mut(index(k)) {
                *of = row.map(to);
            }
        }
        self.align_means(&learnt.by, &shown.from.map(to));
        work.shown = Some(learnt);
    }

    /// After [`Bank::align_means`], when `applied` was estimated by the alignment: the zero
    /// correction has no parameters for the sensors' errors, but it does not deny them. It believes
    /// the alignment as it is.
    fn believe_alignment(&mut self) {
        self.believed = true;
        let nothing = [[T::ZERO; OUTPUTS]; NAV];
        self.some(1 << ZERO_CORRECTION | 1 << STORED, |h| {
            h.align_mean(&nothing, &[T::ZERO; OUTPUTS]);
        });
    }

    /// Computes one part of `work`, some ten thousand instructions. True: there is more.
    pub fn work(&mut self, work: &mut Work<T>) -> bool {
        match work.next {
            part @ 0..UPDATE => {
                let (which, part) = (part / COVARIANCE_PARTS, part % COVARIANCE_PARTS);
                self.propagate_covariance(which, part, work);
            }
            part @ UPDATE..FINISH_UPDATE => self.update(part - UPDATE, work),
            part @ FINISH_UPDATE..FIX_IS_OVER if work.fix.is_some() || work.shown.is_some() => {
                self.some(1 << (part - FINISH_UPDATE), |h| h.finish_update());
            }
            FIX_IS_OVER => {
                if let Some(learnt) = work.shown.take() {
                    self.align_means(&work.block.gamma, &learnt.applied);
                    self.believe_alignment();
                    work.next = 0;
                    return true;
                }
                if work.fix.take().is_some() {
                    self.choose();
                }
            }
            part @ STEP..END => {
                if let Some(inputs) = work.inputs {
                    self.step(1 << (part - STEP), inputs);
                }
            }
            _ => {}
        }
        work.next = match work.next + 1 {
            UPDATE if work.fix.is_none() && work.shown.is_none() => STEP,
            next => next,
        };
        if work.next == STEP && work.inputs.is_none() {
            work.next = END;
        }
        if work.is_done() {
            work.inputs = None;
        }
        !work.is_done()
    }

    /// A part of a hypothesis' covariance over the interval, or after the alignment.
    fn propagate_covariance(&mut self, which: usize, part: usize, work: &mut Work<T>) {
        let (block, workspace) = (&work.block, &mut work.workspace);
        if !work.aligns {
            return self.some(1 << which, |h| {
                h.propagate_covariance(part, block, workspace)
            });
        }
        if let Some(learnt) = &work.shown {
            let nothing = [[T::ZERO; NAV]; NAV];
            return self.some(1 << which, |h| {
                h.align_covariance(part, &learnt.by, &nothing, workspace);
            });
        }
        let (by, rest) = (&block.gamma, &block.q);
        let rest = match which {
            ZERO_CORRECTION | STORED if work.knows => block.phi,
            ZERO_CORRECTION | STORED => self.unmodelled(by, rest),
            _ => *rest,
        };
        self.some(1 << which, |h| {
            h.align_covariance(part, by, &rest, workspace);
        });
    }

    fn update(&mut self, part: usize, work: &mut Work<T>) {
        let (group, part) = (part / GROUP, part % GROUP);
        if part >= OBSERVATION * MAX_DEFERRED {
            return self.some(1 << LARGEST, |h| _ = h.apply_deferred());
        }
        let (k, part) = (
            group * MAX_DEFERRED + part / OBSERVATION,
            part % OBSERVATION,
        );
        let learnt = work.shown.as_ref();
        let learnt = learnt.map(|of| (of.z, of.variance));
        let Some((z, variance)) = learnt.or(work.fix) else {
            return;
        };
        let (Some(&z), Some(&variance)) = (z.get(k), variance.get(k)) else {
            return;
        };
        if !variance.is_finite() {
            return; // not measured
        }
        let Some(which) = part.checked_sub(1) else {
            work.accepted = learnt.is_some() || self.accepts(k, z, variance, work.counts);
            work.refused |= u8::from(!work.accepted) << k;
            return;
        };
        if work.accepted {
            let i = index(k);
            self.some(1 << which, |h| h.update(i, h.innovation(i, z, variance)));
        }
    }
}

#[cfg(test)]
mod tests;
