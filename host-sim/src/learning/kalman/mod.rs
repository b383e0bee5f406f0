//! Learning from plain fixes with the product's own bank of hypotheses (LEARNING section 5), over a navigator in f64.

use crate::inertial::ekf::{Block, Linearised, NAV, Prior, displaced};
use crate::inertial::free_inertial::{Coast, coast};
use crate::inertial::gnss::Fix;
use crate::inertial::session::{EPOCH_S, Session};
use crate::inertial::sins::{Increment, NavState, Samples, Sins};
use crate::learning::teacher::{Aligned, Assumptions, Start, aligned, fix_at};
use firmware::learn::bank::{Bank, Gates};
use firmware::learn::prior::Datasheet;
use lrnn_nostd::Real;
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};
use nalgebra::{DVector, SMatrix, Vector3};
use std::ops::Range;

/// A learner on its way through a session.
#[derive(Debug, Clone)]
pub struct Student<T: Real> {
    /// The hypotheses.
    pub bank: Bank<T>,
    sins: Sins,
    linearised: Linearised,
    /// Taken out of the words of the present epoch: rad/s and m/s2.
    applied: [T; 6],
}

/// What the learner is told of the sensors.
#[must_use]
pub fn datasheet(assumptions: &Assumptions) -> Datasheet {
    let Prior {
        gyro_bias,
        accel_bias,
        ..
    } = assumptions.prior;
    Datasheet::land_vehicle(gyro_bias as f32, accel_bias as f32)
}

impl<T: Real> Student<T> {
    /// Starts from a known state; `samples` is what its words need ([`Session::samples`]).
    #[must_use]
    pub fn new(
        Start { nav, sigma }: &Start,
        assumptions: &Assumptions,
        gates: Gates<T>,
        samples: Samples,
    ) -> Self {
        let (a, v, p) = (sigma.tilt, sigma.velocity, sigma.position);
        let error_sigma = [a, a, sigma.heading, v, v, v, p, p, p].map(T::from_f64);
        Self {
            bank: Bank::new(&datasheet(assumptions).cast(), EPOCH_S, error_sigma, gates),
            sins: Sins::new(*nav).with_samples(samples),
            linearised: Linearised::new(&assumptions.prior, assumptions.noise),
            applied: [T::ZERO; 6],
        }
    }

    /// The initial state is that of a self-alignment on words as they came, and its errors hang together with the sensors'.
    pub fn align(&mut self, aligned: &Aligned, assumptions: &Assumptions) {
        let (by, rest) = aligned.errors(assumptions);
        self.bank
            .align(&array(&by), &array(&rest), &[T::ZERO; OUTPUTS]);
    }

    /// Learns from the fixes at the ends of these epochs.
    pub fn attend(&mut self, session: &Session, words: &[Increment], epochs: Range<usize>) {
        let n = session.steps_per_epoch();
        for k in epochs {
            let (fix, sigmas) = fix_at(session, k + 1);
            let words = &words[k * n..(k + 1) * n];
            self.learn(words, session.step_s(), &fix, &sigmas);
        }
    }

    /// The state with what the running hypothesis knows.
    #[must_use]
    pub fn nav(&self) -> NavState {
        self.sins.nav
    }

    /// The networks take an epoch's words; what they say holds for the next.
    pub fn look(&mut self, words: &[Increment]) {
        let sum = words.iter().fold(Increment::default(), |sum, w| Increment {
            dtheta: sum.dtheta + w.dtheta,
            dv: sum.dv + w.dv,
        });
        let mean = |v: Vector3<f64>| <[f64; 3]>::from(v / EPOCH_S).map(T::from_f64);
        self.bank.step([mean(sum.dtheta), mean(sum.dv)]);
        self.applied = *self.bank.estimate();
    }

    /// A word without the errors.
    #[must_use]
    pub fn corrected(&self, word: &Increment, dt: f64) -> Increment {
        let [a, b, c, d, e, f] = self.applied.map(|e| e.to_f64() * dt);
        Increment {
            dtheta: word.dtheta - Vector3::new(a, b, c),
            dv: word.dv - Vector3::new(d, e, f),
        }
    }

    /// Navigates through an epoch and learns from the fix at its end. Gives which observations were refused.
    pub fn learn(&mut self, words: &[Increment], dt: f64, fix: &Fix, sigmas: &[f64; 6]) -> u8 {
        for word in words {
            let corrected = self.corrected(word, dt);
            self.sins.step(&corrected, dt);
            self.linearised.accumulate(&self.sins.nav, &corrected, dt);
        }
        let nav = self.sins.nav;
        let block = transition(&self.linearised.take(&nav));
        self.bank.propagate(&block, &self.applied);
        let dp = nav.position.ned_from(&fix.position);
        let dv = nav.velocity - fix.velocity;
        let z = [dp.x, dp.y, dp.z, dv.x, dv.y, dv.z].map(T::from_f64);
        let refused = self.bank.fix(&z, &sigmas.map(|s| T::from_f64(s * s)));
        let e = self.bank.feed_back().map(T::to_f64);
        self.sins.nav = displaced(&nav, &DVector::from_row_slice(&e));
        self.look(words);
        refused
    }
}

/// A block in the bank's number type.
fn transition<T: Real>(block: &Block) -> Transition<NAV, T> {
    Transition {
        phi: array(&block.phi),
        gamma: array(&block.gamma),
        q: array(&block.q),
        time: T::from_f64(block.time),
    }
}

/// Rows of a matrix in the bank's number type.
fn array<T: Real, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> [[T; C]; R] {
    std::array::from_fn(|i| std::array::from_fn(|j| T::from_f64(m[(i, j)])))
}

/// Aligns, learns from the fixes up to epoch `until`. `None` when the standstill gives no attitude.
#[must_use]
pub fn taught<T: Real>(
    session: &Session,
    words: &[Increment],
    assumptions: &Assumptions,
    gates: Gates<T>,
    until: usize,
) -> Option<Student<T>> {
    let aligned = aligned(session, words)?;
    let start = aligned.start(assumptions);
    let mut student = Student::new(&start, assumptions, gates, session.samples());
    let n = session.steps_per_epoch();
    for epoch in words.chunks(n).take(aligned.first) {
        student.look(epoch);
    }
    student.align(&aligned, assumptions);
    student.attend(session, words, aligned.first..until);
    Some(student)
}

/// Free inertial from the student's state on words that its networks, no longer taught, go on correcting.
#[must_use]
pub fn coasted<T: Real>(
    mut student: Student<T>,
    session: &Session,
    words: &[Increment],
    until: usize,
) -> Coast {
    let (n, dt) = (session.steps_per_epoch(), session.step_s());
    let nav = student.nav();
    let mut corrected = vec![Increment::default(); until * n];
    for epoch in words[until * n..].chunks(n) {
        corrected.extend(epoch.iter().map(|w| student.corrected(w, dt)));
        student.look(epoch);
    }
    coast(session, &corrected, nav, until, session.epochs())
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;
