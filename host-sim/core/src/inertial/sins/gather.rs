//! Combines several increments into one: the two-speed form of strapdown integration (Savage 1998,
//! parts 1 and 2). The fast part, body rotation with coning and velocity with sculling, is computed
//! once at the rate of the samples. Navigators then take the longer steps.

use super::{Increment, Samples};
use crate::inertial::lane::{
    Lane, Q, V3, add, after, at, cross, in_start_axes, norm_squared, rotation, scaled, sub, times,
    turned, zeros,
};
use nalgebra::{Quaternion, UnitQuaternion};
use {crate::inertial::vectors::widest, fearless_simd::f64x8};

/// Combines every `count` increments into one. A navigator with [`Samples::One`] has the same
/// result with it as with the single increments. Fewer than `count` increments at the end are
/// dropped.
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

/// Adds the pieces of a block in order.
fn one_by_one(block: &[Increment], count: usize, samples: Samples, out: &mut Vec<Increment>) {
    for piece in 0..(block.len() - 2) / count {
        pieces::<f64>((), &block[piece * count..], count, samples, out);
    }
}

/// Adds the [`BESIDE`] pieces of a block, each with the same bits as alone.
fn combine(block: &[Increment], count: usize, samples: Samples, out: &mut Vec<Increment>) {
    widest!(simd => pieces::<f64x8<_>>(simd, block, count, samples, out));
}

/// Number of pieces of a block.
const BESIDE: usize = 8;

/// Adds as many pieces of a block as a lane has places.
#[inline(always)]
fn pieces<L: Lane>(
    kind: L::Kind,
    block: &[Increment],
    count: usize,
    samples: Samples,
    out: &mut Vec<Increment>,
) {
    let increment = |i: usize| {
        [
            L::gathered(kind, |l| block[l * count + i].dtheta),
            L::gathered(kind, |l| block[l * count + i].dv),
        ]
    };
    let (zero, one) = (L::all(kind, 0.0), L::all(kind, 1.0));
    let (mut q, mut v) = ([zero, zero, zero, one], zeros(kind));
    let mut previous = [increment(1), increment(0)];
    for i in 2..2 + count {
        let last = increment(i);
        let (phi, eta) = samples.combine(&previous, &last);
        v = add(&v, &turned(&q, &in_start_axes(&phi, &eta)));
        q = after(&q, &rotation(&phi));
        previous = [last, previous[0]];
    }
    let phi = rotvec(&q);
    let dv = from_start_axes(&phi, &v);
    for l in 0..L::PLACES {
        out.push(Increment {
            dtheta: at(&phi, l),
            dv: at(&dv, l),
        });
    }
}

/// Rotation vector of a small rotation: `2 asin(s) / s` times the vector part of length `s`, by
/// series (relative error `s^8/10`).
#[inline(always)]
fn rotvec<L: Lane>(q: &Q<L>) -> V3<L> {
    let v = [q[0], q[1], q[2]];
    let mut sign = q[3];
    for l in 0..L::PLACES {
        sign.put(l, sign.at(l).signum());
    }
    let v = times(&v, sign);
    let s2 = norm_squared(&v);
    if s2.all_below(LARGEST.next_up()) {
        let series = s2 * (s2 * (s2 * (5.0 / 56.0) + 3.0 / 20.0) + 1.0 / 3.0) + 2.0;
        return times(&v, series);
    }
    L::gathered(s2.kind(), |l| {
        let v = at(&v, l);
        if s2.at(l) <= LARGEST {
            let s2 = s2.at(l);
            return v * (2.0 + s2 * (1.0 / 3.0 + s2 * (3.0 / 20.0 + s2 * (5.0 / 56.0))));
        }
        let one = Quaternion::new(q[3].at(l), q[0].at(l), q[1].at(l), q[2].at(l));
        UnitQuaternion::new_unchecked(one).scaled_axis()
    })
}

/// Squared sine of half the largest rotation that the series serves.
const LARGEST: f64 = 1e-3;

/// Inverse of [`in_start_axes`]: the inverse left Jacobian of the rotation group, by series
/// (relative error below `n^4/15000`).
#[inline(always)]
fn from_start_axes<L: Lane>(phi: &V3<L>, v: &V3<L>) -> V3<L> {
    let once = cross(phi, v);
    let twice = cross(phi, &once);
    let first = sub(v, &scaled(&once, 0.5));
    let by = norm_squared(phi) * (1.0 / 720.0) + 1.0 / 12.0;
    add(&first, &times(&twice, by))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use crate::inertial::rotation::from_rotvec;
    use crate::inertial::sins::{NavState, Sins};
    use nalgebra::Vector3;

    /// Pieces side by side have the same bits as each alone, at the end of a list and in large
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
