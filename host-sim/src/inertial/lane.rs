//! Numbers of several filters side by side (or navigators, or pieces of one session), and what the
//! navigation equations do with them. Each operation is done for every filter in the order of the
//! code for one filter, so each filter keeps its bits.
//!
//! Whatever computes with a [`Lane`] must be inlined into the function that knows the processor's
//! vectors. So there are no closures over lanes here, and arrays are written out.

use crate::inertial::rotation::from_rotvec;
use crate::inertial::series::{self, half_angle, turned_force};
use fearless_simd::{Simd, SimdBase, f64x8};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_4;

/// How many filters stand side by side.
pub const PLACES: usize = 8;

/// One number of each filter.
pub(crate) type Lane<S> = f64x8<S>;
/// A vector of three.
pub(crate) type V3<S> = [Lane<S>; 3];
/// A matrix of three by three, by rows.
pub(crate) type M3<S> = [V3<S>; 3];
/// A quaternion: vector part, then scalar part.
pub(crate) type Q<S> = [Lane<S>; 4];

/// The same number for all.
#[inline(always)]
pub(crate) fn all<S: Simd>(simd: S, x: f64) -> Lane<S> {
    Lane::splat(simd, x)
}

/// The number of each filter.
#[inline(always)]
pub(crate) fn of<S: Simd>(simd: S, x: impl Fn(usize) -> f64) -> Lane<S> {
    let mut out = [0.0; PLACES];
    for (l, out) in out.iter_mut().enumerate() {
        *out = x(l);
    }
    Lane::from_slice(simd, &out)
}

/// The vector of each filter.
#[inline(always)]
pub(crate) fn gathered<S: Simd>(simd: S, x: impl Fn(usize) -> Vector3<f64>) -> V3<S> {
    let mut out = [[0.0; PLACES]; 3];
    for l in 0..PLACES {
        let v = x(l);
        for (i, row) in out.iter_mut().enumerate() {
            row[l] = v[i];
        }
    }
    let row = |i: usize| Lane::from_slice(simd, &out[i]);
    [row(0), row(1), row(2)]
}

/// The vector of filter `l`.
#[inline(always)]
pub(crate) fn at<S: Simd>(v: &V3<S>, l: usize) -> Vector3<f64> {
    Vector3::new(v[0][l], v[1][l], v[2][l])
}

#[inline(always)]
pub(crate) fn zeros<S: Simd>(simd: S) -> V3<S> {
    [all(simd, 0.0); 3]
}

#[inline(always)]
pub(crate) fn minus<S: Simd>(a: &V3<S>) -> V3<S> {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
pub(crate) fn add<S: Simd>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<S: Simd>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scaled<S: Simd>(a: &V3<S>, by: f64) -> V3<S> {
    times(a, all(a[0].simd, by))
}

#[inline(always)]
pub(crate) fn divided<S: Simd>(a: &V3<S>, by: f64) -> V3<S> {
    scaled(a, 1.0 / by)
}

#[inline(always)]
pub(crate) fn times<S: Simd>(a: &V3<S>, by: Lane<S>) -> V3<S> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: &V3<S>, b: &V3<S>) -> V3<S> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn norm_squared<S: Simd>(a: &V3<S>) -> Lane<S> {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

/// The matrix of the cross product with `v` from the left.
#[inline(always)]
pub(crate) fn skew<S: Simd>(v: &V3<S>) -> M3<S> {
    let o = all(v[0].simd, 0.0);
    [[o, -v[2], v[1]], [v[2], o, -v[0]], [-v[1], v[0], o]]
}

#[inline(always)]
fn row_by<S: Simd>(row: &V3<S>, b: &M3<S>) -> V3<S> {
    let mut out = *row;
    for (c, out) in out.iter_mut().enumerate() {
        *out = row[0] * b[0][c] + row[1] * b[1][c] + row[2] * b[2][c];
    }
    out
}

#[inline(always)]
pub(crate) fn product<S: Simd>(a: &M3<S>, b: &M3<S>) -> M3<S> {
    [row_by(&a[0], b), row_by(&a[1], b), row_by(&a[2], b)]
}

#[inline(always)]
pub(crate) fn sum<S: Simd>(a: &M3<S>, b: &M3<S>) -> M3<S> {
    [add(&a[0], &b[0]), add(&a[1], &b[1]), add(&a[2], &b[2])]
}

#[inline(always)]
pub(crate) fn difference<S: Simd>(a: &M3<S>, b: &M3<S>) -> M3<S> {
    [sub(&a[0], &b[0]), sub(&a[1], &b[1]), sub(&a[2], &b[2])]
}

#[inline(always)]
pub(crate) fn by<S: Simd>(m: &M3<S>, x: Lane<S>) -> M3<S> {
    [times(&m[0], x), times(&m[1], x), times(&m[2], x)]
}

#[inline(always)]
pub(crate) fn column<S: Simd>(m: &M3<S>, c: usize) -> V3<S> {
    [m[0][c], m[1][c], m[2][c]]
}

#[inline(always)]
pub(crate) fn transposed<S: Simd>(a: &M3<S>) -> M3<S> {
    [column(a, 0), column(a, 1), column(a, 2)]
}

/// The matrix times a vector.
#[inline(always)]
pub(crate) fn applied<S: Simd>(m: &M3<S>, v: &V3<S>) -> V3<S> {
    let mut out = *v;
    for (out, row) in out.iter_mut().zip(m) {
        *out = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
    }
    out
}

/// Quaternion of a small rotation: [`from_rotvec`].
#[inline(always)]
pub(crate) fn rotation<S: Simd>(phi: &V3<S>) -> Q<S> {
    let n2 = norm_squared(phi);
    let simd = n2.simd;
    if simd.all_true_mask64x8(simd.simd_lt_f64x8(n2, all(simd, 3.6e-3))) {
        let (c, s) = half_angle(n2);
        return [s * phi[0], s * phi[1], s * phi[2], c];
    }
    let mut out = [[0.0; PLACES]; 4];
    for l in 0..PLACES {
        let one = from_rotvec(&at(phi, l));
        for (i, out) in out.iter_mut().enumerate() {
            out[l] = one.coords[i];
        }
    }
    let part = |i: usize| Lane::from_slice(simd, &out[i]);
    [part(0), part(1), part(2), part(3)]
}

#[inline(always)]
pub(crate) fn after<S: Simd>(a: &Q<S>, b: &Q<S>) -> Q<S> {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// A vector turned by a quaternion.
#[inline(always)]
pub(crate) fn turned<S: Simd>(q: &Q<S>, v: &V3<S>) -> V3<S> {
    let vector = [q[0], q[1], q[2]];
    let t = scaled(&cross(&vector, v), 2.0);
    let cross = cross(&vector, &t);
    add(&add(&times(&t, q[3]), &cross), v)
}

/// The sum of squares, in nalgebra's order.
#[inline(always)]
pub(crate) fn size_squared<S: Simd>(q: &Q<S>) -> Lane<S> {
    (q[0] * q[0] + q[2] * q[2]) + (q[1] * q[1] + q[3] * q[3])
}

/// The rotation matrix of a quaternion.
#[inline(always)]
pub(crate) fn matrix_of<S: Simd>([i, j, k, w]: &Q<S>) -> M3<S> {
    let (i, j, k, w) = (*i, *j, *k, *w);
    let (ww, ii, jj, kk) = (w * w, i * i, j * j, k * k);
    let (ij, wk, wj) = (i * j * 2.0, w * k * 2.0, w * j * 2.0);
    let (ik, jk, wi) = (i * k * 2.0, j * k * 2.0, w * i * 2.0);
    [
        [ww + ii - jj - kk, ij - wk, wj + ik],
        [wk + ij, ww - ii + jj - kk, jk - wi],
        [ik - wj, wi + jk, ww - ii - jj + kk],
    ]
}

/// [`crate::inertial::sins`]: specific force in the body axes of the start of the increment.
#[inline(always)]
pub(crate) fn in_start_axes<S: Simd>(phi: &V3<S>, eta: &V3<S>) -> V3<S> {
    let n2 = norm_squared(phi);
    let once = cross(phi, eta);
    let twice = cross(phi, &once);
    let (one, two) = turned_force(n2);
    add(&add(eta, &times(&once, one)), &times(&twice, two))
}

/// [`series::sin_cos`] of each.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(x: Lane<S>) -> (Lane<S>, Lane<S>) {
    let simd = x.simd;
    let a = simd.abs_f64x8(x);
    if !simd.all_true_mask64x8(simd.simd_le_f64x8(a, all(simd, series::MOST))) {
        let (mut sin, mut cos) = (x, x);
        for l in 0..PLACES {
            (sin[l], cos[l]) = series::sin_cos(x[l]);
        }
        return (sin, cos);
    }
    let small = simd.simd_le_f64x8(a, all(simd, FRAC_PI_4));
    let (y, rest) = series::below_right_angle(a);
    let y = simd.select_f64x8(small, a, y);
    let rest = simd.select_f64x8(small, all(simd, 0.0), rest);
    let (s, c) = series::near_zero(y, rest);
    let sin = simd.select_f64x8(small, s, c);
    let cos = simd.select_f64x8(small, c, -s);
    (simd.copysign_f64x8(sin, x), cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::vectors::widest;

    /// Angles below and above pi/4, of both signs, at the edges, and beyond all latitudes.
    #[test]
    fn sines_side_by_side_have_the_bits_of_each_alone() {
        let edge = [FRAC_PI_4, FRAC_PI_4.next_up(), -0.0, 1.57];
        let sets = [
            [0.3, -0.3, 0.8, -0.8, edge[0], edge[1], edge[2], edge[3]],
            [1e-9, 0.5, -1.0, 2.3, -2.3, 0.79, -0.78, 0.0],
            [1e-9, 0.5, -1.0, 2.4, f64::NAN, 0.79, -100.0, 0.0],
        ];
        for set in sets {
            let got = widest!(simd => {
                let (sin, cos) = sin_cos(of(simd, |l| set[l]));
                std::array::from_fn::<_, PLACES, _>(|l| (sin[l], cos[l]))
            });
            for (x, (sin, cos)) in set.into_iter().zip(got) {
                let want = series::sin_cos(x);
                assert_eq!(sin.to_bits(), want.0.to_bits(), "{x}");
                assert_eq!(cos.to_bits(), want.1.to_bits(), "{x}");
            }
        }
    }
}
