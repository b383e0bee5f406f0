//! The samples of a session corrected by a compensator. They are computed epoch by epoch where that
//! gives the same bits as all at once, so that no corrected copy of a long recording is in memory.

use super::window::{corrected_increments, read_temperature};
use firmware::compensator::{Compensator, State};
use host_core::inertial::motion::Increments;
use host_core::inertial::session::{Session, to_si};
use std::cell::RefCell;

/// The estimated errors of each block of a whole session from power-on: rad/s and m/s2.
#[must_use]
pub fn estimates(session: &Session, compensator: &Compensator) -> Vec<[[f32; 3]; 2]> {
    let mut state = compensator.power_on(false);
    let blocks = session.counts.each().enumerate().filter_map(|(k, counts)| {
        read_temperature(session, k, &mut state);
        let block = compensator.process(&mut state, counts).1?;
        Some([block.rate_error, block.force_error])
    });
    blocks.collect()
}

/// The corrected increments of the whole session from power-on.
#[must_use]
pub fn corrected_motion(session: &Session, compensator: Compensator) -> Increments<'_> {
    if session.gather != 1 {
        let all = 0..session.epochs();
        return Increments::All(corrected_increments(session, &compensator, all));
    }
    let state = compensator.power_on(false);
    compensated_motion(session, compensator, state, 0)
}

/// The increments of a session, one a sample, behind a compensator in `state` before epoch `first`.
/// A request for an earlier epoch restarts the computation.
#[must_use]
pub fn compensated_motion(
    session: &Session,
    compensator: Compensator,
    state: State,
    first: usize,
) -> Increments<'_> {
    let n = session.samples_per_epoch();
    let now = RefCell::new((first, state.clone()));
    Increments::Made(Box::new(move |k| {
        let mut now = now.borrow_mut();
        if k < now.0 {
            *now = (first, state.clone());
        }
        let mut made = Vec::with_capacity(n);
        while now.0 <= k {
            let (epoch, state) = &mut *now;
            made.clear();
            let samples = *epoch * n..(*epoch + 1) * n;
            let counts = session.counts.block(samples.clone());
            for (at, counts) in samples.zip(counts.iter()) {
                read_temperature(session, at, state);
                let corrected = compensator.process(state, *counts).0;
                made.push(to_si(&corrected, &session.lsb));
            }
            *epoch += 1;
        }
        made
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learning::teacher::Assumptions;
    use crate::learning::window::{compensate, compensator, normalisation, start};
    use host_core::inertial::motion::Motion;
    use host_core::simulator::imu::{ErrorModelName, ImuSpec};
    use host_core::simulator::session::{SessionConfig, simulate};
    use lrnn_nostd::Net;

    /// Samples computed epoch by epoch are those of the whole session to the last bit, also after a
    /// request for an earlier epoch.
    #[test]
    fn epochs_are_made_as_the_whole_session_is() {
        let spec = ImuSpec::preset("medium").unwrap();
        let spec = spec.error_model(ErrorModelName::All);
        let config = SessionConfig {
            heading: 0.7,
            ..SessionConfig::new(&spec, [20.0, 40.0], [1, 2, 3])
        };
        let mut session = simulate(&config).0;
        let assumptions = Assumptions::of_simulated(&spec);
        // networks with an output from the first epoch on
        let mut nets = normalisation(&assumptions).map(|n| Net::new(start(3, 1.0).weights, n));
        nets.iter_mut()
            .for_each(|net| net.weights.layers[2].b = [0.3; 3]);
        let with = |session: &Session| compensator(session, &nets, &assumptions);
        for gather in [1, 10] {
            session.gather = gather;
            let (steps, all) = (session.steps_per_epoch(), 0..session.epochs());
            let whole = corrected_increments(&session, &with(&session), all);
            assert_ne!(whole, session.increments());
            let made = corrected_motion(&session, with(&session));
            let raw = session.motion();
            for k in [0, 1, 2, 7, 30, 59, 7, 8, 0] {
                let range = k * steps..(k + 1) * steps;
                assert_eq!(*made.epoch(k, steps), whole[range.clone()], "{gather} {k}");
                assert_eq!(*raw.epoch(k, steps), session.increments()[range]);
            }
            assert_eq!(*made.beginning(5, steps), whole[..5 * steps]);
            let doubled =
                |w: &host_core::inertial::sins::Increment| host_core::inertial::sins::Increment {
                    dtheta: w.dtheta * 2.0,
                    dv: w.dv,
                };
            let twice = made.map(doubled);
            assert_eq!(twice.epoch(9, steps)[0], doubled(&whole[9 * steps]));
        }
        let all = compensate(&session, &with(&session)).estimates;
        assert_eq!(estimates(&session, &with(&session)), all);
    }
}
