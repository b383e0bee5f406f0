//! The hypotheses in f64 with the desktop's f64 navigator, as a reference for the device's f32.

use firmware::learn::bank::{Bank, Gates, Scratch};
use host_core::inertial::ekf::{Block, Linearised, NAV, displaced};
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState, Sins};
use host_estimation::learning::aiding::fix_at;
use host_estimation::learning::fix_learner::datasheet;
use host_estimation::learning::teacher::{Assumptions, Start, aligned};
use lrnn_nostd::learn::kalman::{Correction, Transition};
use nalgebra::{DVector, SMatrix, Vector3};

/// A learner within a session.
pub struct F64Learner {
    /// The hypotheses.
    pub bank: Bank<f64>,
    scratch: Scratch<f64>,
    sins: Sins,
    linearised: Linearised,
    /// Correction of the increments of the present epoch: rad/s and m/s2.
    applied: [f64; 6],
}

impl F64Learner {
    /// Aligns and learns from the fixes up to epoch `until`. `None` when the standstill gives no
    /// attitude.
    pub fn taught(
        session: &Session,
        increments: &[Increment],
        assumptions: &Assumptions,
        until: usize,
    ) -> Option<Self> {
        let aligned = aligned(session, &increments)?;
        let Start { nav, sigma } = aligned.start(assumptions);
        let (a, v, p) = (sigma.tilt, sigma.velocity, sigma.position);
        let error_sigma = [a, a, sigma.heading, v, v, v, p, p, p];
        let sheet = datasheet(assumptions).cast();
        let mut learner = Self {
            bank: Bank::new(&sheet, EPOCH_S, error_sigma, Gates::default()),
            scratch: Scratch::ZEROED,
            sins: Sins::new(nav).with_samples(session.samples()),
            linearised: Linearised::new(&assumptions.prior, assumptions.noise),
            applied: [0.0; 6],
        };
        let n = session.steps_per_epoch();
        for epoch in increments.chunks(n).take(aligned.first) {
            learner.step(epoch);
        }
        let (by, rest) = aligned.errors(assumptions);
        let errors = &mut learner.scratch.block;
        (errors.gamma, errors.q) = (rows(&by), rows(&rest));
        learner.bank.align(&mut learner.scratch);
        for k in aligned.first..until {
            let fix = fix_at(session, k + 1)?;
            let epoch = &increments[k * n..(k + 1) * n];
            learner.learn(epoch, session.step_s(), &fix);
        }
        Some(learner)
    }

    /// The state with the estimates of the hypothesis in force.
    pub fn nav(&self) -> NavState {
        self.sins.nav
    }

    /// Navigates through an epoch and learns from the fix at its end. Returns the rejected
    /// observations, one bit each.
    pub fn learn(&mut self, epoch: &[Increment], dt: f64, fix: &Fix) -> u8 {
        let [a, b, c, d, e, f] = self.applied.map(|e| e * dt);
        for increment in epoch {
            let corrected = Increment {
                dtheta: increment.dtheta - Vector3::new(a, b, c),
                dv: increment.dv - Vector3::new(d, e, f),
            };
            self.sins.step(&corrected, dt);
            self.linearised.accumulate(&self.sins.nav, &corrected, dt);
        }
        let nav = self.sins.nav;
        self.scratch.block = transition(&self.linearised.take(&nav));
        let dp = nav.position.ned_from(&fix.position);
        let dv = nav.velocity - fix.velocity;
        let innovation = [dp.x, dp.y, dp.z, dv.x, dv.y, dv.z];
        let applied = Correction {
            estimate: self.applied,
            ..Correction::NONE
        };
        self.bank.propagate_mean(&self.scratch.block, &applied);
        self.bank.propagate_covariance(&mut self.scratch);
        let variance = fix.sigmas.map(|s| s * s);
        let refused = self.bank.fix(&innovation, &variance, true);
        let error = self.bank.feed_back();
        self.sins.nav = displaced(&nav, &DVector::from_row_slice(&error));
        self.step(epoch);
        refused
    }

    /// Gives the networks an epoch's increments. Their output applies to the next epoch.
    fn step(&mut self, epoch: &[Increment]) {
        let sum = epoch.iter().fold(Increment::default(), |sum, w| Increment {
            dtheta: sum.dtheta + w.dtheta,
            dv: sum.dv + w.dv,
        });
        let mean = |v: Vector3<f64>| <[f64; 3]>::from(v / EPOCH_S);
        self.bank.step([mean(sum.dtheta), mean(sum.dv)]);
        self.applied = *self.bank.estimate();
    }
}

fn transition(block: &Block) -> Transition<NAV, f64> {
    Transition {
        phi: rows(&block.phi),
        gamma: rows(&block.gamma),
        q: rows(&block.q),
        time: block.time,
        ..Transition::ZEROED
    }
}

fn rows<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> [[f64; C]; R] {
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}
