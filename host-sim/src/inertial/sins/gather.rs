//! Combines several increments into one: the two-speed form of strapdown integration (Savage 1998,
//! parts 1 and 2). The fast part, body rotation with coning and velocity with sculling, is computed
//! once at the rate of the samples. Navigators then take the longer steps.

use super::samples::in_start_axes;
use super::{Increment, Samples};
use crate::inertial::rotation::from_rotvec;
use nalgebra::{UnitQuaternion, Vector3};

/// Combines every `count` increments into one. A navigator with [`Samples::One`] makes of the
/// result what it would have made of the single increments. Fewer than `count` increments at the
/// end are dropped.
#[must_use]
pub fn gather(
    increments: impl IntoIterator<Item = Increment>,
    count: usize,
    samples: Samples,
) -> Vec<Increment> {
    let mut past = [Increment::default(); 2];
    let (mut q, mut v) = (UnitQuaternion::identity(), Vector3::zeros());
    let mut out = Vec::new();
    let mut n = 0;
    for increment in increments {
        let (phi, eta) = samples.combine(&past, &increment);
        v += q * in_start_axes(&phi, &eta);
        q *= from_rotvec(&phi);
        past = [increment, past[0]];
        n += 1;
        if n == count {
            let phi = rotvec(&q);
            out.push(Increment {
                dtheta: phi,
                dv: from_start_axes(&phi, &v),
            });
            (q, v, n) = (UnitQuaternion::identity(), Vector3::zeros(), 0);
        }
    }
    out
}

/// Rotation vector of a small rotation: `2 asin(s) / s` times the vector part of length `s`, by
/// series (relative error `s^8/10`).
fn rotvec(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let v = q.imag() * q.scalar().signum();
    let s2 = v.norm_squared();
    if s2 > 1e-3 {
        return q.scaled_axis();
    }
    v * (2.0 + s2 * (1.0 / 3.0 + s2 * (3.0 / 20.0 + s2 * (5.0 / 56.0))))
}

/// Inverse of [`in_start_axes`]: the inverse left Jacobian of the rotation group, by series
/// (relative error below `n^4/15000`).
fn from_start_axes(phi: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let once = phi.cross(v);
    v - once * 0.5 + phi.cross(&once) * (1.0 / 12.0 + phi.norm_squared() / 720.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use crate::inertial::sins::{NavState, Sins};

    /// Compares steps of 50 ms with steps of 10 ms under coning, sculling and a turn at 0.5 rad/s.
    #[test]
    fn gathered_increments_end_where_the_increments_end() {
        let start = NavState {
            position: Geodetic {
                lat: 0.7,
                lon: 0.3,
                h: 200.0,
            },
            velocity: Vector3::new(12.0, 25.0, -1.0),
            q_bn: from_rotvec(&Vector3::new(0.05, -0.03, 1.1)),
        };
        let dt = 0.01;
        let increments: Vec<Increment> = (0..12_000)
            .map(|k| {
                let t = f64::from(k) * dt;
                let (s, c) = (60.0 * t).sin_cos();
                Increment {
                    dtheta: Vector3::new(0.2 * s, 0.2 * c, 0.5) * dt,
                    dv: Vector3::new(2.0 * c, t.sin(), -9.8 + 2.0 * s) * dt,
                }
            })
            .collect();
        let end = |increments: &[Increment], dt: f64, samples: Samples| {
            let mut sins = Sins::new(start).with_samples(samples);
            increments.iter().for_each(|w| sins.step(w, dt));
            sins.nav
        };
        let fine = end(&increments, dt, Samples::Three);
        let gathered = gather(increments.iter().copied(), 5, Samples::Three);
        let coarse = end(&gathered, 5.0 * dt, Samples::One);
        let off = |nav: &NavState| {
            [
                nav.q_bn.angle_to(&fine.q_bn),
                (nav.velocity - fine.velocity).norm(),
                nav.position.ned_from(&fine.position).norm(),
            ]
        };
        let [angle, velocity, position] = off(&coarse);
        assert!(
            angle < 1e-9 && velocity < 2e-5 && position < 0.05,
            "{angle:e} {velocity:e} {position:e}"
        );
        // without the fast part a third of the area of the cone is lost in every step
        let sums: Vec<Increment> = increments
            .chunks_exact(5)
            .map(|c| Increment {
                dtheta: c.iter().map(|w| w.dtheta).sum(),
                dv: c.iter().map(|w| w.dv).sum(),
            })
            .collect();
        let [angle, velocity, _] = off(&end(&sums, 5.0 * dt, Samples::One));
        assert!(angle > 1e-2 && velocity > 1e-2, "{angle:e} {velocity:e}");
    }
}
