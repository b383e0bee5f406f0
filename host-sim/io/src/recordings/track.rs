//! Navigation states at uneven times, and interpolation between them.

use host_core::inertial::earth::{Geodetic, wrapped};
use host_core::inertial::sins::NavState;

/// States at rising times, at least one.
#[derive(Debug, Clone, Default)]
pub struct Track {
    time: Vec<f64>,
    states: Vec<NavState>,
    /// The states lack the attitude.
    flat: bool,
}

impl Track {
    /// A track of `states` at `time`. Times must rise, and both lists must have the same length.
    #[must_use]
    pub fn new(time: Vec<f64>, states: Vec<NavState>) -> Self {
        debug_assert!(time.len() == states.len() && time.is_sorted());
        Self {
            time,
            states,
            flat: false,
        }
    }

    /// The same track, whose attitudes mean nothing.
    #[must_use]
    pub fn without_attitude(self) -> Self {
        Self { flat: true, ..self }
    }

    /// Whether its states have an attitude.
    #[must_use]
    pub fn has_attitude(&self) -> bool {
        !self.flat
    }

    /// The same states `seconds` later.
    #[must_use]
    pub fn shifted(mut self, seconds: f64) -> Self {
        self.time.iter_mut().for_each(|t| *t += seconds);
        self
    }

    /// First and last time, if there is a state.
    #[must_use]
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((*self.time.first()?, *self.time.last()?))
    }

    /// State at `t`, interpolated between its neighbours: position and velocity linearly, attitude
    /// along the shortest rotation. Before the first and after the last state that state is held.
    #[must_use]
    pub fn at(&self, t: f64) -> NavState {
        let next = self.time.partition_point(|x| *x < t);
        if next == 0 || next == self.time.len() {
            return self.states[next.min(self.states.len() - 1)];
        }
        let (t0, t1) = (self.time[next - 1], self.time[next]);
        let (a, b) = (&self.states[next - 1], &self.states[next]);
        let share = (t - t0) / (t1 - t0);
        let mix = |x: f64, y: f64| x + (y - x) * share;
        NavState {
            position: Geodetic {
                lat: mix(a.position.lat, b.position.lat),
                lon: a.position.lon + wrapped(b.position.lon - a.position.lon) * share,
                h: mix(a.position.h, b.position.h),
            },
            velocity: a.velocity.lerp(&b.velocity, share),
            q_bn: a.q_bn.slerp(&b.q_bn, share),
        }
    }

    /// Whether there is a state at `t`, or one before and one after it at most `most` apart. A
    /// single state covers all times.
    #[must_use]
    pub fn covers(&self, t: f64, most: f64) -> bool {
        let next = self.time.partition_point(|x| *x < t - 1e-6);
        match (next.checked_sub(1), self.time.get(next)) {
            _ if self.time.len() == 1 => true,
            (_, Some(at)) if (at - t).abs() < 1e-6 => true,
            (Some(before), Some(after)) => after - self.time[before] <= most,
            _ => false,
        }
    }

    /// Computes the components of velocities that are not `measured` from the positions of the
    /// neighbours. The first and the last state use their only neighbour.
    pub fn differentiate(&mut self, measured: &[[bool; 3]]) {
        let last = self.states.len().saturating_sub(1);
        let velocity = |k: usize| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            let time = self.time[b] - self.time[a];
            let moved = self.states[b].position.ned_from(&self.states[a].position);
            if time > 0.0 {
                moved / time
            } else {
                moved * 0.0
            }
        };
        let all: Vec<_> = (0..self.states.len()).map(velocity).collect();
        for ((state, v), measured) in self.states.iter_mut().zip(all).zip(measured) {
            for (axis, _) in measured.iter().enumerate().filter(|(_, known)| !**known) {
                state.velocity[axis] = v[axis];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::rotation::{from_euler, to_euler};
    use nalgebra::Vector3;

    fn state(north_m: f64, heading: f64) -> NavState {
        let home = Geodetic {
            lat: 0.8,
            lon: 0.1,
            h: 100.0,
        };
        NavState {
            position: home.displaced(&Vector3::new(north_m, 0.0, 0.0)),
            velocity: Vector3::new(north_m, 0.0, 0.0),
            q_bn: from_euler(0.0, 0.0, heading),
        }
    }

    #[test]
    fn states_are_interpolated_and_held_beyond_the_ends() {
        // heading crosses south, where a plain mean of angles would point north
        let track = Track::new(
            vec![1.0, 2.0, 5.0],
            vec![state(0.0, 3.1), state(10.0, -3.1), state(40.0, -3.0)],
        );
        let mid = track.at(1.25);
        assert!((mid.velocity.x - 2.5).abs() < 1e-12);
        assert!((mid.position.ned_from(&state(0.0, 0.0).position).x - 2.5).abs() < 1e-6);
        let turned = std::f64::consts::TAU - 6.2;
        assert!((to_euler(&mid.q_bn).2 - (3.1 + 0.25 * turned)).abs() < 1e-9);
        assert_eq!(
            (track.at(0.0), track.at(9.0)),
            (state(0.0, 3.1), state(40.0, -3.0))
        );
        let covered =
            |most: f64| [0.9, 1.0, 1.5, 2.0, 3.0, 5.0, 5.1].map(|t| track.covers(t, most));
        assert_eq!(covered(1.5), [false, true, true, true, false, true, false]);
        assert_eq!(covered(3.0), [false, true, true, true, true, true, false]);
        assert_eq!(track.span(), Some((1.0, 5.0)));
    }

    #[test]
    fn longitudes_go_the_short_way_round() {
        let at = |lon: f64| NavState {
            position: Geodetic {
                lon: lon.to_radians(),
                ..state(0.0, 0.0).position
            },
            ..state(0.0, 0.0)
        };
        for (from, to) in [(179.5, -179.5), (359.5, 0.5), (-179.5, 179.5)] {
            let track = Track::new(vec![0.0, 2.0], vec![at(from), at(to)]);
            let middle = at((from + to) / 2.0 + 180.0).position;
            assert!(
                track.at(1.0).position.ned_from(&middle).norm() < 1e-6,
                "{from}"
            );
        }
    }

    #[test]
    fn velocity_comes_from_positions() {
        let mut track = Track::new(
            vec![0.0, 1.0, 3.0],
            vec![state(0.0, 0.0), state(5.0, 0.0), state(21.0, 0.0)],
        );
        track.differentiate(&[[false; 3], [false, true, true], [false; 3]]);
        for (t, want) in [(0.0, 5.0), (1.0, 7.0), (3.0, 8.0)] {
            assert!((track.at(t).velocity.x - want).abs() < 1e-4, "{t}");
        }
    }
}
