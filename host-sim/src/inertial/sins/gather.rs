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
///
/// Pieces of `count` increments do not depend on one another, so several are combined side by side.
#[must_use]
pub fn gather(
    increments: impl IntoIterator<Item = Increment>,
    count: usize,
    samples: Samples,
) -> Vec<Increment> {
    let mut out = Vec::new();
    // two increments before the block, and the pieces of the block
    let mut block = vec![Increment::default(); 2];
    let full = 2 + BESIDE * count;
    for increment in increments {
        block.push(increment);
        if block.len() == full {
            combine(&block, count, samples, &mut out);
            block.copy_within(full - 2.., 0);
            block.truncate(2);
        }
    }
    one_by_one(&block, count, samples, &mut out);
    out
}

/// Adds the pieces of a block, one after the other.
fn one_by_one(block: &[Increment], count: usize, samples: Samples, out: &mut Vec<Increment>) {
    let mut past = [block[1], block[0]];
    for piece in block[2..].chunks_exact(count) {
        let (mut q, mut v) = (UnitQuaternion::identity(), Vector3::zeros());
        for increment in piece {
            let (phi, eta) = samples.combine(&past, increment);
            v += q * in_start_axes(&phi, &eta);
            q *= from_rotvec(&phi);
            past = [*increment, past[0]];
        }
        let phi = rotvec(&q);
        out.push(Increment {
            dtheta: phi,
            dv: from_start_axes(&phi, &v),
        });
    }
}

#[cfg(not(feature = "tools"))]
use one_by_one as combine;
#[cfg(feature = "tools")]
use {crate::inertial::lane::PLACES as BESIDE, beside::combine};
/// Pieces of a block.
#[cfg(not(feature = "tools"))]
const BESIDE: usize = 8;

/// Pieces side by side, each with the bits that it has alone.
#[cfg(feature = "tools")]
mod beside {
    use super::{Increment, Samples, one_by_one};
    use crate::inertial::lane::{
        Lane, PLACES, Q, V3, add, after, all, at, cross, gathered, in_start_axes, norm_squared,
        rotation, scaled, sub, times, turned, zeros,
    };
    use crate::inertial::vectors::widest;
    use fearless_simd::{Simd, SimdBase};
    use nalgebra::{Quaternion, UnitQuaternion};

    /// Adds the [`PLACES`] pieces of a block.
    pub(super) fn combine(
        block: &[Increment],
        count: usize,
        samples: Samples,
        out: &mut Vec<Increment>,
    ) {
        if samples != Samples::Three {
            return one_by_one(block, count, samples, out);
        }
        widest!(simd => run(simd, block, count, out));
    }

    #[inline(always)]
    fn run<S: Simd>(simd: S, block: &[Increment], count: usize, out: &mut Vec<Increment>) {
        let increment = |i: usize| {
            [
                gathered(simd, |l| block[l * count + i].dtheta),
                gathered(simd, |l| block[l * count + i].dv),
            ]
        };
        let (zero, one) = (all(simd, 0.0), all(simd, 1.0));
        let (mut q, mut v) = ([zero, zero, zero, one], zeros(simd));
        let (mut a, mut b) = (increment(0), increment(1));
        for i in 2..2 + count {
            let c = increment(i);
            let earlier = [earlier(&a[0], &b[0]), earlier(&a[1], &b[1])];
            let (coning, sculling) = products(&earlier, &c);
            let (coning_ab, sculling_ab) = products(&a, &b);
            let phi = add(&c[0], &sub(&coning, &scaled(&coning_ab, 1.0 / 40.0)));
            let eta = add(&c[1], &sub(&sculling, &scaled(&sculling_ab, 1.0 / 40.0)));
            v = add(&v, &turned(&q, &in_start_axes(&phi, &eta)));
            q = after(&q, &rotation(&phi));
            (a, b) = (b, c);
        }
        let phi = rotvec(&q);
        let dv = from_start_axes(&phi, &v);
        for l in 0..PLACES {
            out.push(Increment {
                dtheta: at(&phi, l),
                dv: at(&dv, l),
            });
        }
    }

    /// `17/120 b - 1/60 a`.
    #[inline(always)]
    fn earlier<S: Simd>(a: &V3<S>, b: &V3<S>) -> V3<S> {
        sub(&scaled(b, 17.0 / 120.0), &scaled(a, 1.0 / 60.0))
    }

    /// For coning and for sculling.
    #[inline(always)]
    fn products<S: Simd>(x: &[V3<S>; 2], y: &[V3<S>; 2]) -> (V3<S>, V3<S>) {
        let sculling = add(&cross(&x[0], &y[1]), &cross(&x[1], &y[0]));
        (cross(&x[0], &y[0]), sculling)
    }

    #[inline(always)]
    fn rotvec<S: Simd>(q: &Q<S>) -> V3<S> {
        let v = [q[0], q[1], q[2]];
        let mut sign: Lane<S> = q[3];
        for l in 0..PLACES {
            sign[l] = sign[l].signum();
        }
        let v = times(&v, sign);
        let s2 = norm_squared(&v);
        if s2.as_slice().iter().all(|s2| *s2 <= 1e-3) {
            let series = 2.0 + s2 * (1.0 / 3.0 + s2 * (3.0 / 20.0 + s2 * (5.0 / 56.0)));
            return times(&v, series);
        }
        gathered(s2.simd, |l| {
            let one = Quaternion::new(q[3][l], q[0][l], q[1][l], q[2][l]);
            super::rotvec(&UnitQuaternion::new_unchecked(one))
        })
    }

    #[inline(always)]
    fn from_start_axes<S: Simd>(phi: &V3<S>, v: &V3<S>) -> V3<S> {
        let once = cross(phi, v);
        let twice = cross(phi, &once);
        let first = sub(v, &scaled(&once, 0.5));
        add(
            &first,
            &times(&twice, 1.0 / 12.0 + norm_squared(phi) * (1.0 / 720.0)),
        )
    }
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
    v - once * 0.5 + phi.cross(&once) * (1.0 / 12.0 + phi.norm_squared() * (1.0 / 720.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use crate::inertial::sins::{NavState, Sins};

    /// Pieces side by side have the bits that each has alone, at the end of a list and in large
    /// rotations, too.
    #[test]
    fn pieces_side_by_side_have_their_own_bits() {
        for size in [1.0, 40.0] {
            let of = |k: i32| {
                let t = f64::from(k) * 0.01;
                Increment {
                    dtheta: Vector3::new(0.2 * (60.0 * t).sin(), 0.1 * t.cos(), 0.5)
                        * (0.01 * size),
                    dv: Vector3::new(2.0 * (9.0 * t).cos(), t.sin(), -9.8) * 0.01,
                }
            };
            let all: Vec<Increment> = (0..1234).map(of).collect();
            let mut block = vec![Increment::default(); 2];
            block.extend(&all);
            let mut alone = Vec::new();
            one_by_one(&block, 5, Samples::Three, &mut alone);
            assert_eq!(alone.len(), 246);
            assert_eq!(gather(all, 5, Samples::Three), alone);
        }
    }

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
