//! Numbers of several filters side by side, and what the navigation equations do with them.
//! Each operation is done for every filter in the order of the code for one filter, so each filter
//! keeps its bits.

use crate::inertial::rotation::from_rotvec;
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// One number of each of `L` filters.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub(super) struct Lane<const L: usize>(pub(super) [f64; L]);

impl<const L: usize> Lane<L> {
    pub(super) const ZERO: Self = Self([0.0; L]);

    /// The same number for all.
    #[inline(always)]
    pub(super) fn all(x: f64) -> Self {
        Self([x; L])
    }

    /// The number of each filter.
    #[inline(always)]
    pub(super) fn of(x: impl FnMut(usize) -> f64) -> Self {
        Self(std::array::from_fn(x))
    }

    #[inline(always)]
    pub(super) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(f))
    }

    #[inline(always)]
    pub(super) fn every(self, f: impl Fn(f64) -> bool) -> bool {
        self.0.into_iter().all(f)
    }
}

macro_rules! operator {
    ($name:ident $method:ident) => {
        impl<const L: usize> $name for Lane<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(other.0) {
                    *a = a.$method(b);
                }
                self
            }
        }
        impl<const L: usize> $name<f64> for Lane<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: f64) -> Self {
                for a in &mut self.0 {
                    *a = a.$method(other);
                }
                self
            }
        }
        impl<const L: usize> $name<Lane<L>> for f64 {
            type Output = Lane<L>;
            #[inline(always)]
            fn $method(self, mut other: Lane<L>) -> Lane<L> {
                for b in &mut other.0 {
                    *b = self.$method(*b);
                }
                other
            }
        }
    };
}
operator!(Add add);
operator!(Sub sub);
operator!(Mul mul);
operator!(Div div);

impl<const L: usize> Neg for Lane<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl<const L: usize> AddAssign for Lane<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Lane<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// A vector of three.
pub(super) type V3<const L: usize> = [Lane<L>; 3];
/// A matrix of three by three, by rows.
pub(super) type M3<const L: usize> = [V3<L>; 3];
/// A quaternion: vector part, then scalar part.
pub(super) type Q<const L: usize> = [Lane<L>; 4];

#[inline(always)]
pub(super) fn gathered<const L: usize>(of: impl Fn(usize) -> Vector3<f64>) -> V3<L> {
    [0, 1, 2].map(|i| Lane::of(|l| of(l)[i]))
}

/// The vector of filter `l`.
#[inline(always)]
pub(super) fn at<const L: usize>(v: &V3<L>, l: usize) -> Vector3<f64> {
    Vector3::new(v[0].0[l], v[1].0[l], v[2].0[l])
}

#[inline(always)]
pub(super) fn add<const L: usize>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(super) fn sub<const L: usize>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn scaled<const L: usize>(a: &V3<L>, by: f64) -> V3<L> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(super) fn times<const L: usize>(a: &V3<L>, by: Lane<L>) -> V3<L> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(super) fn cross<const L: usize>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(super) fn norm_squared<const L: usize>(a: &V3<L>) -> Lane<L> {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

/// The matrix of the cross product with `v` from the left.
#[inline(always)]
pub(super) fn skew<const L: usize>(v: &V3<L>) -> M3<L> {
    let o = Lane::ZERO;
    [[o, -v[2], v[1]], [v[2], o, -v[0]], [-v[1], v[0], o]]
}

#[inline(always)]
pub(super) fn product<const L: usize>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    let cell = |r: usize, c: usize| a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| cell(r, c)))
}

#[inline(always)]
pub(super) fn each<const L: usize>(
    a: &M3<L>,
    b: &M3<L>,
    f: impl Fn(Lane<L>, Lane<L>) -> Lane<L>,
) -> M3<L> {
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| f(a[r][c], b[r][c])))
}

#[inline(always)]
pub(super) fn transposed<const L: usize>(a: &M3<L>) -> M3<L> {
    [0, 1, 2].map(|r| [0, 1, 2].map(|c| a[c][r]))
}

/// Quaternion of a small rotation: [`from_rotvec`].
#[inline(always)]
pub(super) fn rotation<const L: usize>(phi: &V3<L>) -> Q<L> {
    let n2 = norm_squared(phi);
    if n2.every(|n2| n2 < 3.6e-3) {
        let c = 1.0 - n2 / 8.0 * (1.0 - n2 / 48.0 * (1.0 - n2 / 120.0));
        let s = 0.5 - n2 / 48.0 * (1.0 - n2 / 80.0 * (1.0 - n2 / 168.0));
        return [s * phi[0], s * phi[1], s * phi[2], c];
    }
    let one: [UnitQuaternion<f64>; L] = std::array::from_fn(|l| from_rotvec(&at(phi, l)));
    [0, 1, 2, 3].map(|i| Lane::of(|l| one[l].coords[i]))
}

#[inline(always)]
pub(super) fn after<const L: usize>(a: &Q<L>, b: &Q<L>) -> Q<L> {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// A vector turned by a quaternion.
#[inline(always)]
pub(super) fn turned<const L: usize>(q: &Q<L>, v: &V3<L>) -> V3<L> {
    let vector = [q[0], q[1], q[2]];
    let t = scaled(&cross(&vector, v), 2.0);
    let cross = cross(&vector, &t);
    add(&add(&times(&t, q[3]), &cross), v)
}

/// The sum of squares, in nalgebra's order.
#[inline(always)]
pub(super) fn size_squared<const L: usize>(q: &Q<L>) -> Lane<L> {
    (q[0] * q[0] + q[2] * q[2]) + (q[1] * q[1] + q[3] * q[3])
}

/// The rotation matrix of a quaternion.
#[inline(always)]
pub(super) fn matrix_of<const L: usize>([i, j, k, w]: &Q<L>) -> M3<L> {
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
