//! What the learner knows at the end of the fixes.

use crate::learning::corrected::compensated_motion;
use crate::learning::teacher::Assumptions;
use crate::learning::window::{compensator, increments_from, read_temperature};
use firmware::compensator::{self, Compensator};
use firmware::learn::bank::HYPOTHESES;
use firmware::model::Nets;
use host_core::inertial::free_inertial::{FreeInertial, free_inertial};
use host_core::inertial::session::Session;
use host_core::inertial::sins::NavState;
use lrnn_nostd::State;

/// The result of learning at the end of the fixes.
#[derive(Debug, Clone)]
pub struct Learnt {
    /// Networks of the hypothesis in force, its biases folded in.
    pub nets: Nets,
    /// Their states after the last block.
    pub states: [State; 2],
    /// Their output for the next block: rad/s and m/s2.
    pub estimate: [[f32; 3]; 2],
    /// The navigator's solution with the estimates of the hypothesis in force.
    pub nav: NavState,
    /// The hypothesis in force.
    pub running: usize,
    /// Log-likelihoods of the hypotheses, relative to that of the zero correction.
    pub evidence: [f64; HYPOTHESES],
}

impl Learnt {
    /// Free-inertial navigation from the navigator's solution, on counts that the networks continue
    /// to correct without learning. `session` and `until` as in [`learn`](super::learn).
    #[must_use]
    pub fn free_inertial(
        &self,
        session: &Session,
        assumptions: &Assumptions,
        until: usize,
    ) -> FreeInertial {
        let (compensator, mut state) = self.compensator(session, assumptions);
        if session.gather == 1 {
            let corrected = compensated_motion(session, compensator, state, until);
            return free_inertial(session, &corrected, self.nav, until, session.epochs());
        }
        let first = until * session.samples_per_epoch();
        let after = session.counts.part(first..session.counts.len());
        let corrected = (first..).zip(after.each()).map(|(k, counts)| {
            read_temperature(session, k, &mut state);
            compensator.process(&mut state, counts).0
        });
        let increments = increments_from(session, until, corrected);
        free_inertial(session, &increments, self.nav, until, session.epochs())
    }

    /// The compensator with the learnt networks.
    fn compensator(
        &self,
        session: &Session,
        assumptions: &Assumptions,
    ) -> (Compensator, compensator::State) {
        let Nets { gyro, accel, maps } = self.nets;
        let mut compensator = compensator(session, &[gyro, accel], assumptions);
        compensator.set_maps(&maps, [1.0; 2]); // nothing limits them here
        let mut state = compensator.power_on(true);
        state.off = false;
        state.set_nets(self.states);
        compensator.force(&mut state, &self.estimate);
        (compensator, state)
    }
}
