//! Motion of the vehicle in closed form.

use super::{Q, V, add, of_vector, product, times};

/// Motion of the vehicle: speed (m/s) and heading (rad) at a time (s).
#[derive(Clone, Copy)]
pub struct Road {
    pub speed: fn(f64) -> f64,
    pub heading: fn(f64) -> f64,
    /// Roll and pitch of a car on its springs, rad.
    pub sway: f64,
    /// Distance of the axle that does not steer behind the sensors, m.
    pub axle: f64,
}

impl Road {
    /// Curves of up to 0.24 rad/s and changes of speed of up to 1.2 m/s2.
    pub const TOWN: Road = Road {
        speed: |t| 12.0 + 5.0 * libm::sin(t * 0.17) + 3.0 * libm::cos(t * 0.11),
        heading: |t| 0.7 + 1.6 * libm::sin(t * 0.13) + 0.3 * libm::cos(t * 0.41) - 0.3,
        sway: 0.02,
        axle: 0.0,
    };
    /// Straight on at one speed.
    pub const STRAIGHT: Road = Road {
        speed: |_| 20.0,
        heading: |_| 0.4,
        sway: 0.0,
        axle: 0.0,
    };

    pub(super) fn velocity(&self, t: f64) -> V {
        let (v, heading) = ((self.speed)(t), (self.heading)(t));
        let side = self.axle * self.turns(t);
        let (sin, cos) = (libm::sin(heading), libm::cos(heading));
        [v * cos - side * sin, v * sin + side * cos, 0.0]
    }

    /// Rate about down, rad/s.
    pub(super) fn turns(&self, t: f64) -> f64 {
        let h = 1e-3;
        0.5 / h * ((self.heading)(t + h) - (self.heading)(t - h))
    }

    pub(super) fn acceleration(&self, t: f64) -> V {
        let h = 1e-3;
        times(
            add(self.velocity(t + h), times(self.velocity(t - h), -1.0)),
            0.5 / h,
        )
    }

    pub(super) fn attitude(&self, t: f64) -> Q {
        let roll = self.sway * libm::sin(t * 0.9);
        let pitch = 0.7 * self.sway * libm::cos(t * 0.7);
        let about = |axis: usize, angle: f64| {
            let mut v = [0.0; 3];
            v[axis] = angle;
            of_vector(v)
        };
        let level = product(about(2, (self.heading)(t)), about(1, pitch));
        product(level, about(0, roll))
    }
}
