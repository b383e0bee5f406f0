//! Dynamics of the errors that the antenna sees, with lever arm and age among them.

use super::{Antenna, STATES, state};
use crate::learn::prior::NAV;
use crate::nav::ANTENNA;
use lrnn_nostd::learn::kalman::Transition;

/// Standard deviation of their changes in an hour, m and s (assumed: load of the receiver).
const WALK: [f32; ANTENNA] = [0.01, 0.01, 0.01, 0.002];
const HOUR_S: f32 = 3600.0;
impl Antenna {
    /// The interval of the navigation errors with the antenna's beside them; `None`: no time has
    /// passed.
    pub(super) fn extended(&self, block: Option<&Transition<NAV>>) -> Transition<STATES> {
        let mut all = self.moves(block);
        if let Some(block) = block {
            let pairs = all.q.iter_mut().zip(&block.q);
            pairs.for_each(|(to, of)| copy(to, of));
        }
        all
    }

    /// The transition without the noise: enough for the means.
    pub(super) fn moves(&self, block: Option<&Transition<NAV>>) -> Transition<STATES> {
        let mut all = Transition::ZEROED;
        for (i, row) in all.phi.iter_mut().enumerate() {
            match block.and_then(|block| block.phi.get(i)) {
                Some(phi) => copy(row, phi),
                None => row.iter_mut().skip(i).take(1).for_each(|one| *one = 1.0),
            }
            if i >= NAV {
                continue;
            }
            let mut changes = [0.0; ANTENNA];
            for (k, (before, effect)) in self.before.iter().zip(&self.effect).enumerate() {
                let phi = row.get(state(k)).copied().unwrap_or(0.0);
                let own = state(k) == i;
                for ((change, before), effect) in changes.iter_mut().zip(before).zip(effect) {
                    *change -= phi * before;
                    *change += if own { *effect } else { 0.0 };
                }
            }
            let entries = row.iter_mut().skip(NAV).zip(changes);
            entries.for_each(|(entry, change)| *entry = change);
        }
        if let Some(block) = block {
            let pairs = all.gamma.iter_mut().zip(&block.gamma);
            pairs.for_each(|(to, of)| *to = *of);
            all.time = block.time;
        }
        all
    }

    /// Adds the changes of lever arm and age, and what they do to the errors that the antenna sees.
    pub(super) fn wander(&self, all: &mut Transition<STATES>) {
        for j in 0..ANTENNA {
            let walk = WALK.get(j).copied().unwrap_or(0.0);
            let uncertain = self.sigma.get(j).copied().unwrap_or(0.0) > 0.0;
            let jump = if j + 1 == ANTENNA { self.jump } else { 0.0 };
            let variance = walk * walk * (all.time / HOUR_S) + jump;
            let mut column = [0.0; STATES];
            for (k, row) in self.effect.iter().enumerate() {
                if let (Some(to), Some(of)) = (column.get_mut(state(k)), row.get(j)) {
                    *to = *of;
                }
            }
            if let Some(own) = column.get_mut(NAV + j).filter(|_| uncertain) {
                *own = 1.0;
                for (row, a) in all.q.iter_mut().zip(column) {
                    let entries = row.iter_mut().zip(column);
                    entries.for_each(|(entry, b)| *entry += variance * a * b);
                }
            }
        }
    }
}

/// Copies the shorter row to the beginning of the longer one.
pub(super) fn copy(to: &mut [f32; STATES], of: &[f32; NAV]) {
    to.iter_mut().zip(of).for_each(|(to, of)| *to = *of);
}
