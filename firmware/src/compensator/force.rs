//! What brings a correction into force: at once, or no faster than the slew limit, and within the
//! limits.
//!
//! The slew limit is for what somebody decides: other networks, another mode. While the same
//! networks stay in force, the correction follows their output, however fast the sensor's error
//! changes. A correction that lags behind the error is an error by itself: with a limit of a
//! thousandth a second on everything, errors that follow the temperature were left up to twice as
//! large.

use super::proportional::Proportional;
use super::{Compensator, State};
use crate::model::Nets;
use lrnn_nostd::learn::kalman::Maps;

impl Compensator {
    pub(super) fn within_limit(&self, [gyro, accel]: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
        [
            gyro.map(|e| clip(e, self.limit.gyro)),
            accel.map(|e| clip(e, self.limit.accel)),
        ]
    }

    /// Errors in proportion to the samples, each element within `limit`: gyros, accelerometers. A
    /// new compensator has none. [`Self::force`] brings them into force.
    pub fn set_maps(&mut self, maps: &Maps<f32>, limit: [f32; 2]) {
        (self.maps, self.map_limit) = (*maps, limit);
        self.seal();
    }

    /// The maps, each element within the limit.
    pub(super) fn maps_within_limit(&self) -> Maps<f32> {
        let mut maps = self.maps;
        for (map, limit) in maps.iter_mut().zip(self.map_limit) {
            for element in map.as_flattened_mut() {
                *element = clip(*element, limit);
            }
        }
        maps
    }

    /// Brings the networks' output into force at once, within the limit, with their maps. What it
    /// changes by with their next step follows at once as well: at power-on that step is the first
    /// one that knows the temperature.
    pub fn force(&self, state: &mut State, output: &[[f32; 3]; 2]) {
        (state.estimate, state.maps) = (self.within_limit(*output), self.maps_within_limit());
        state.followed = Some(state.estimate);
        self.is_in_force(state);
    }

    /// Brings an estimate and maps that were in force before into force at once.
    pub fn force_with(&self, state: &mut State, estimate: &[[f32; 3]; 2], maps: &Maps<f32>) {
        (state.estimate, state.maps) = (self.within_limit(*estimate), *maps);
        state.followed = None;
        self.is_in_force(state);
    }

    /// Exchanges the networks for some whose output differs for the gyros alone, and brings that
    /// into force at once, within the limit. Accelerometers and maps go on as before.
    pub fn exchange_gyro(&mut self, state: &mut State, nets: Nets, output: [f32; 3]) {
        let followed = state.followed;
        self.exchange(state, nets, state.nets());
        let [_, accel] = state.estimate;
        state.estimate = self.within_limit([output, accel]);
        let [gyro, _] = state.estimate;
        state.followed = followed.map(|[_, accel]| [gyro, accel]);
        self.is_in_force(state);
    }

    /// The correction is zero at once.
    pub fn force_zero(&self, state: &mut State) {
        self.force_with(state, &[[0.0; 3]; 2], &Nets::NONE.maps);
    }

    /// Estimate and maps have changed.
    pub(super) fn is_in_force(&self, state: &mut State) {
        state.estimate_sum = state.estimate_sum();
        state.proportional = Proportional::of(&state.maps);
        self.make_due(state);
    }

    /// Moves estimate and maps to their targets: the estimate follows what the networks' output has
    /// changed by since the last block, and closes the rest of the gap within the slew limit. An
    /// element of a map moves by the same share of its limit as the estimate.
    pub(super) fn put_in_force(&self, state: &mut State, target: &[[f32; 3]; 2], maps: &Maps<f32>) {
        if !state.is_estimate_intact() {
            self.mend_estimate(state);
        }
        let slew = self
            .slew
            .map(|slew| [slew.gyro, slew.accel].map(|s| s * self.block_s));
        match slew {
            None => (state.estimate, state.maps) = (*target, *maps),
            Some(slew) => {
                let limits = [self.limit.gyro, self.limit.accel];
                let of_maps = state.maps.iter_mut().zip(maps).zip(slew.iter().zip(limits));
                for (((now, to), (slew, limit)), most) in of_maps.zip(self.map_limit) {
                    let share = if limit > 0.0 { slew / limit } else { 1.0 };
                    let now = now.as_flattened_mut().iter_mut();
                    for (now, to) in now.zip(to.as_flattened()) {
                        *now += clip(to - *now, share * most);
                    }
                }
                let last = state.followed.filter(|_| !state.off).unwrap_or(*target);
                let axes = state.estimate.iter_mut().zip(target.iter().zip(&last));
                for ((estimate, (target, last)), slew) in axes.zip(slew) {
                    for ((e, t), last) in estimate.iter_mut().zip(target).zip(last) {
                        let behind = last - *e;
                        *e = t - (behind - clip(behind, slew));
                    }
                }
                state.estimate = self.within_limit(state.estimate);
            }
        }
        state.followed = (!state.off).then_some(*target);
        self.is_in_force(state);
    }
}

/// Limits to `[-limit, limit]`; NaN becomes zero.
fn clip(x: f32, limit: f32) -> f32 {
    if x > limit {
        limit
    } else if x < -limit {
        -limit
    } else if x.is_nan() {
        0.0
    } else {
        x
    }
}

#[cfg(test)]
mod tests;
