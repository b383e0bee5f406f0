//! What may happen to a vehicle that has just been switched on.

use host_core::inertial::sins::Increment;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// What happens to a vehicle that has just been switched on, before it stands. All sizes and
/// frequencies are assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Begin {
    /// Nothing: it stands from the first sample on.
    Stands,
    /// Somebody sits down after 10 s and rises 10 s later, which tilts it by this angle, deg.
    SitsDown(f64),
    /// People sway it about its forward axis by this angle, deg, once a second, 3 s in every 8 s.
    Swayed(f64),
    /// It is loaded: each 3 s something knocks at it, with this force downwards, m/s2.
    Loaded(f64),
    /// It is in a lift, which starts after 8 s and stops after 20 s, with this force, m/s2.
    Lift(f64),
    /// It is on a ferry that rolls in swell, by this angle, deg, and period, s, from its mean on.
    Ferry([f64; 2]),
    /// It is turned evenly at this rate, deg/s, until this time, s: a turntable, or a hand.
    Turned([f64; 2]),
    /// Its engine idles and shakes it at 24 Hz, with this force, m/s2.
    Idles(f64),
    /// It is towed along a road that shakes it, with this force downwards, m/s2, 1 sigma.
    Towed(f64),
    /// It creeps at this speed, m/s, in a bend of this radius, m.
    Creeps([f64; 2]),
}

impl Begin {
    /// Its rate, rad/s, and acceleration, m/s2, against the Earth, body axes, at `t` s.
    fn at(self, t: f64) -> [Vector3<f64>; 2] {
        let none = Vector3::zeros();
        let within = |from: f64, s: f64| f64::from((from..from + s).contains(&t));
        match self {
            Self::Stands => [none; 2],
            Self::SitsDown(deg) => {
                let turns = within(10.0, 1.0) - within(20.0, 1.0);
                [Vector3::y() * (deg.to_radians() * turns), none]
            }
            Self::Swayed(deg) => {
                let rate = deg.to_radians() * TAU * (TAU * t).cos();
                [
                    Vector3::x() * (rate * within(8.0 * (t / 8.0).floor(), 3.0)),
                    none,
                ]
            }
            Self::Loaded(force) => {
                let knock = within(3.0 * (t / 3.0).floor(), 0.2) * force * (60.0 * t).sin();
                let [rate, push] = [Vector3::new(1.0, 0.4, 0.0), Vector3::new(4.0, 0.0, 9.0)];
                [rate * (knock / 9.0), push * (knock / 9.0)]
            }
            Self::Lift(force) => {
                let pushes = within(20.0, 2.0) - within(8.0, 2.0);
                [none, Vector3::z() * (force * pushes)]
            }
            Self::Ferry([deg, period]) => {
                let omega = TAU / period;
                let rate = deg.to_radians() * omega * (omega * t).cos();
                [Vector3::x() * rate, none]
            }
            Self::Turned([deg_s, until]) => [
                Vector3::z() * (deg_s.to_radians() * within(0.0, until)),
                none,
            ],
            Self::Idles(force) => {
                let shakes = force * (150.0 * t).sin();
                let push = Vector3::new(1.0, 0.6, 0.8);
                [Vector3::repeat(0.016 * shakes), push * shakes]
            }
            Self::Towed(force) => {
                let road = 2.0 * force * (40.0 * t).sin() * (7.0 * t).cos();
                let bends = 0.01 * (0.5 * t).sin();
                let [rate, push] = [Vector3::new(0.05, 0.035, 0.0), Vector3::new(0.45, 0.0, 1.0)];
                [rate * road + Vector3::z() * bends, push * road]
            }
            Self::Creeps([speed, radius]) => {
                let rate = speed / radius;
                [Vector3::z() * rate, Vector3::y() * (rate * speed)]
            }
        }
    }

    /// Disturbs the increments of a standing vehicle, `dt` s each, from power-on on. After the last
    /// one it stands as it would have without.
    pub fn disturb(self, standing: &mut [Increment], dt: f64) {
        // from its own axes to those of the vehicle as it stands, at the end of a sample
        let mut turned = UnitQuaternion::identity();
        for (k, one) in standing.iter_mut().enumerate().rev() {
            let [rate, acceleration] = self.at((k as f64 + 0.5) * dt);
            let back = UnitQuaternion::from_scaled_axis(rate * (-0.5 * dt));
            let middle = turned * back;
            one.dtheta = middle.inverse_transform_vector(&one.dtheta) + rate * dt;
            one.dv = middle.inverse_transform_vector(&one.dv) + acceleration * dt;
            turned = middle * back;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.01;
    const EARTH: f64 = 5e-5;

    fn with(begin: Begin) -> Vec<Increment> {
        let stands = Increment {
            dtheta: Vector3::x() * (EARTH * DT),
            dv: Vector3::z() * (-9.8 * DT),
        };
        let mut all = vec![stands; 6000];
        begin.disturb(&mut all, DT);
        all
    }

    /// Gravity and the Earth's rotation turn with the vehicle, which ends as it stands.
    #[test]
    fn it_turns_against_gravity_and_the_earth() {
        let turned = with(Begin::Turned([6.0, 30.0]));
        let sum: Vector3<f64> = turned.iter().map(|one| one.dtheta).sum();
        assert!((sum.z.to_degrees() - 180.0).abs() < 1e-6, "{sum}");
        assert!((turned[0].dtheta.x + EARTH * DT).abs() < 1e-8);
        assert!((turned[5999].dtheta.x - EARTH * DT).abs() < 1e-12);
        assert!(turned.iter().all(|one| (one.dv.z + 9.8 * DT).abs() < 1e-12));
        let sits = with(Begin::SitsDown(1.0));
        let tilts = |k: usize| (sits[k].dv.x / (9.8 * DT)).asin().to_degrees();
        assert!((tilts(1500) - 1.0).abs() < 1e-6, "{}", tilts(1500));
        assert!(
            [0, 999, 2101, 5999]
                .map(tilts)
                .iter()
                .all(|deg| deg.abs() < 1e-6)
        );
    }

    /// Each but that without anything changes the samples, and no force is left that would move the
    /// vehicle away.
    #[test]
    fn each_changes_the_samples() {
        for begin in [
            Begin::Swayed(0.3),
            Begin::Loaded(0.45),
            Begin::Lift(0.8),
            Begin::Ferry([1.0, 10.0]),
            Begin::Idles(0.5),
            Begin::Towed(0.2),
        ] {
            let all = with(begin);
            assert_ne!(all, with(Begin::Stands), "{begin:?}");
            let mean = all.iter().map(|one| one.dv / DT).sum::<Vector3<f64>>() / 6000.0;
            assert!(
                (mean - Vector3::z() * -9.8).norm() < 0.01,
                "{begin:?}: {mean}"
            );
        }
        let creeps = with(Begin::Creeps([0.3, 100.0]));
        assert!((creeps[0].dtheta.z / DT - 3e-3).abs() < 1e-9);
    }
}
