//! A course as a list of legs over which speed, turn rate and climb change smoothly. The turn rate
//! may stay constant over a leg, as in the steady turn of an aircraft. The speed may be negative: a
//! car in reverse.

use super::dual::Dual;
use super::profile::Smooth;

/// Values at the end of a leg.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct To {
    /// Duration, s, > 0.
    pub(super) time: f64,
    /// Speed at its end, m/s. If left out, the speed does not change.
    pub(super) speed: Option<f64>,
    /// Turn rate at its end, rad/s, positive to the right. If left out, it does not change.
    pub(super) turn: Option<f64>,
    /// Angle of climb at its end, rad. If left out, it does not change.
    pub(super) climb: Option<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    start: f64,
    time: f64,
    speed: [f64; 2],
    turn: [f64; 2],
    climb: [f64; 2],
    heading: f64,
}

/// The course at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Now {
    /// Speed along the path, m/s.
    pub(super) speed: Smooth,
    /// Direction of the path, rad, clockwise from north.
    pub(super) heading: Smooth,
    /// Angle of climb, rad.
    pub(super) climb: Smooth,
}

/// A course as a function of time. Speed, turn rate and climb have continuous second derivatives.
#[derive(Debug, Clone)]
pub(super) struct Course {
    legs: Vec<Leg>,
    hint: usize,
    dt: f64,
    speed: f64,
    turn: f64,
    climb: f64,
    heading: f64,
}

impl Course {
    /// Begins at a speed in m/s and a heading in rad. Durations are rounded to whole samples of
    /// `dt` s.
    pub(super) fn new(speed: f64, heading: f64, dt: f64) -> Self {
        Self {
            legs: Vec::new(),
            hint: 0,
            dt,
            speed,
            turn: 0.0,
            climb: 0.0,
            heading,
        }
    }

    /// Adds a leg.
    pub(super) fn go(&mut self, to: &To) {
        let time = (to.time / self.dt).round().max(1.0) * self.dt;
        let (speed, turn, climb) = (
            to.speed.unwrap_or(self.speed),
            to.turn.unwrap_or(self.turn),
            to.climb.unwrap_or(self.climb),
        );
        self.legs.push(Leg {
            start: self.duration(),
            time,
            speed: [self.speed, speed],
            turn: [self.turn, turn],
            climb: [self.climb, climb],
            heading: self.heading,
        });
        self.heading += 0.5 * (self.turn + turn) * time;
        (self.speed, self.turn, self.climb) = (speed, turn, climb);
    }

    /// Goes on unchanged for `time` s.
    pub(super) fn hold(&mut self, time: f64) {
        self.go(&To {
            time,
            ..To::default()
        });
    }

    /// Changes the speed to `speed` m/s in `time` s.
    pub(super) fn change(&mut self, speed: f64, time: f64) {
        self.go(&To {
            time,
            speed: Some(speed),
            ..To::default()
        });
    }

    /// Turns by `angle` rad with at most `rate` rad/s, which is reached in `ramp` s.
    pub(super) fn turn(&mut self, angle: f64, rate: f64, ramp: f64) {
        // the ramps turn by one ramp at full rate; a small turn has no time at full rate
        let rate = rate.min(angle.abs() / ramp).copysign(angle);
        let steady = angle / rate - ramp;
        let ramp_to = |turn: f64| To {
            time: ramp,
            turn: Some(turn),
            ..To::default()
        };
        self.go(&ramp_to(rate));
        if steady > self.dt {
            self.hold(steady);
        }
        self.go(&ramp_to(0.0));
    }

    /// Total duration, s.
    pub(super) fn duration(&self) -> f64 {
        self.legs.last().map_or(0.0, |leg| leg.start + leg.time)
    }

    /// Ends the course after `duration` s; the last leg continues as a steady one.
    pub(super) fn cut(&mut self, duration: f64) {
        self.legs.retain(|leg| leg.start + leg.time <= duration);
        let last = self.legs.last();
        let end = last.map_or((self.speed, 0.0, self.climb, self.heading), |leg| {
            let turned = 0.5 * (leg.turn[0] + leg.turn[1]) * leg.time;
            (
                leg.speed[1],
                leg.turn[1],
                leg.climb[1],
                leg.heading + turned,
            )
        });
        (self.speed, self.turn, self.climb, self.heading) = end;
        let left = duration - self.duration();
        if left >= self.dt {
            self.hold(left);
        }
    }

    /// Goes to the leg at `t` s. Times must ascend.
    pub(super) fn advance(&mut self, t: f64) {
        while self
            .legs
            .get(self.hint + 1)
            .is_some_and(|leg| t >= leg.start - 1e-9)
        {
            self.hint += 1;
        }
    }

    /// The course at `t` s within that leg.
    pub(super) fn at(&self, t: f64) -> Now {
        let leg = &self.legs[self.hint];
        let s = t - leg.start;
        let smooth = |[from, to]: [f64; 2]| Smooth::between(from, to, s, leg.time);
        let turn = smooth(leg.turn);
        // the integral of the quintic: 5/2 u^4 - 3 u^5 + u^6
        let u = s / leg.time;
        let more = u * u * u * u * (2.5 - 3.0 * u + u * u);
        let [from, to] = leg.turn;
        Now {
            speed: smooth(leg.speed),
            heading: Smooth {
                value: leg.heading + from * s + (to - from) * leg.time * more,
                d1: turn.value,
                d2: turn.d1,
            },
            climb: smooth(leg.climb),
        }
    }
}

impl Smooth {
    /// Value and first derivative.
    pub(super) fn dual(self) -> Dual {
        Dual::new(self.value, self.d1)
    }

    /// First and second derivative.
    pub(super) fn dual_rate(self) -> Dual {
        Dual::new(self.d1, self.d2)
    }
}
