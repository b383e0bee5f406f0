//! Numbers of one filter, or of several side by side (or of navigators, or pieces of one session),
//! and the operations of the navigation equations on them. The equations are written once: a
//! [`Lane`] is an `f64` where a filter runs alone, and a vector where several do. Each operation is
//! done for every filter in the same order, so each filter has the same bits as alone.
//!
//! Functions that compute with vectors must be inlined into the function that knows the processor's
//! vectors. So there are no closures over lanes here, and arrays are written out.

use crate::inertial::rotation::from_rotvec;
use crate::inertial::series::{self, Number, half_angle, turned_force};
use nalgebra::Vector3;
use std::ops::{AddAssign, Div, MulAssign, Neg, Sub, SubAssign};

mod wide;

pub use wide::PLACES;

/// One number of each filter.
pub trait Lane:
    Number
    + Div<Output = Self>
    + Div<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + std::fmt::Debug
{
    /// Kind of vectors, needed to make one; `()` for a single number.
    type Kind: Copy;
    /// Number of filters.
    const PLACES: usize;

    /// The kind of this lane.
    fn kind(self) -> Self::Kind;
    /// The number of each filter.
    fn of(kind: Self::Kind, x: impl Fn(usize) -> f64) -> Self;
    /// The vector of each filter.
    fn gathered(kind: Self::Kind, x: impl Fn(usize) -> Vector3<f64>) -> V3<Self>;
    /// The same number for all.
    fn all(kind: Self::Kind, x: f64) -> Self;
    /// The number of filter `l`.
    fn at(&self, l: usize) -> f64;
    /// Replaces the number of filter `l`.
    fn put(&mut self, l: usize, x: f64);
    /// Square root of each.
    fn root(self) -> Self;
    /// [`series::sin_cos`] of each.
    fn sin_cos(self) -> (Self, Self);
    /// Whether the number of each filter is below this one.
    fn all_below(self, x: f64) -> bool;
}

impl Lane for f64 {
    type Kind = ();
    const PLACES: usize = 1;

    #[inline(always)]
    fn kind(self) {}

    #[inline(always)]
    fn of((): (), x: impl Fn(usize) -> f64) -> Self {
        x(0)
    }

    #[inline(always)]
    fn gathered((): (), x: impl Fn(usize) -> Vector3<f64>) -> V3<Self> {
        x(0).into()
    }

    #[inline(always)]
    fn all((): (), x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn at(&self, _: usize) -> f64 {
        *self
    }

    #[inline(always)]
    fn put(&mut self, _: usize, x: f64) {
        *self = x;
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        series::sin_cos(self)
    }

    #[inline(always)]
    fn all_below(self, x: f64) -> bool {
        self < x
    }
}

/// A vector of three.
pub type V3<L> = [L; 3];
/// A matrix of three by three, by rows.
pub(crate) type M3<L> = [V3<L>; 3];
/// A quaternion: vector part, then scalar part.
pub(crate) type Q<L> = [L; 4];

/// The vector of filter `l`.
#[inline(always)]
pub(crate) fn at<L: Lane>(v: &V3<L>, l: usize) -> Vector3<f64> {
    Vector3::new(v[0].at(l), v[1].at(l), v[2].at(l))
}

#[inline(always)]
pub(crate) fn zeros<L: Lane>(kind: L::Kind) -> V3<L> {
    [L::all(kind, 0.0); 3]
}

#[inline(always)]
pub(crate) fn minus<L: Lane>(a: &V3<L>) -> V3<L> {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
pub(crate) fn add<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scaled<L: Lane>(a: &V3<L>, by: f64) -> V3<L> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(crate) fn divided<L: Lane>(a: &V3<L>, by: f64) -> V3<L> {
    scaled(a, 1.0 / by)
}

#[inline(always)]
pub(crate) fn times<L: Lane>(a: &V3<L>, by: L) -> V3<L> {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(crate) fn cross<L: Lane>(a: &V3<L>, b: &V3<L>) -> V3<L> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub(crate) fn norm_squared<L: Lane>(a: &V3<L>) -> L {
    a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
}

/// The matrix of the cross product with `v` from the left.
#[inline(always)]
pub(crate) fn skew<L: Lane>(v: &V3<L>) -> M3<L> {
    let o = L::all(v[0].kind(), 0.0);
    [[o, -v[2], v[1]], [v[2], o, -v[0]], [-v[1], v[0], o]]
}

#[inline(always)]
fn row_by<L: Lane>(row: &V3<L>, b: &M3<L>) -> V3<L> {
    let mut out = *row;
    for (c, out) in out.iter_mut().enumerate() {
        *out = row[0] * b[0][c] + row[1] * b[1][c] + row[2] * b[2][c];
    }
    out
}

#[inline(always)]
pub(crate) fn product<L: Lane>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    [row_by(&a[0], b), row_by(&a[1], b), row_by(&a[2], b)]
}

#[inline(always)]
pub(crate) fn sum<L: Lane>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    [add(&a[0], &b[0]), add(&a[1], &b[1]), add(&a[2], &b[2])]
}

#[inline(always)]
pub(crate) fn difference<L: Lane>(a: &M3<L>, b: &M3<L>) -> M3<L> {
    [sub(&a[0], &b[0]), sub(&a[1], &b[1]), sub(&a[2], &b[2])]
}

#[inline(always)]
pub(crate) fn by<L: Lane>(m: &M3<L>, x: L) -> M3<L> {
    [times(&m[0], x), times(&m[1], x), times(&m[2], x)]
}

#[inline(always)]
pub(crate) fn column<L: Lane>(m: &M3<L>, c: usize) -> V3<L> {
    [m[0][c], m[1][c], m[2][c]]
}

#[inline(always)]
pub(crate) fn transposed<L: Lane>(a: &M3<L>) -> M3<L> {
    [column(a, 0), column(a, 1), column(a, 2)]
}

/// The matrix times a vector.
#[inline(always)]
pub(crate) fn applied<L: Lane>(m: &M3<L>, v: &V3<L>) -> V3<L> {
    let mut out = *v;
    for (out, row) in out.iter_mut().zip(m) {
        *out = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
    }
    out
}

/// Quaternion of a small rotation: [`from_rotvec`].
#[inline(always)]
pub(crate) fn rotation<L: Lane>(phi: &V3<L>) -> Q<L> {
    let n2 = norm_squared(phi);
    if n2.all_below(3.6e-3) {
        let (c, s) = half_angle(n2);
        return [s * phi[0], s * phi[1], s * phi[2], c];
    }
    let mut out = [n2; 4];
    for l in 0..L::PLACES {
        let one = from_rotvec(&at(phi, l));
        for (out, x) in out.iter_mut().zip(one.coords.iter()) {
            out.put(l, *x);
        }
    }
    out
}

#[inline(always)]
pub(crate) fn after<L: Lane>(a: &Q<L>, b: &Q<L>) -> Q<L> {
    [
        a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
        a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
        a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
        a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
    ]
}

/// A vector turned by a quaternion.
#[inline(always)]
pub(crate) fn turned<L: Lane>(q: &Q<L>, v: &V3<L>) -> V3<L> {
    let vector = [q[0], q[1], q[2]];
    let t = scaled(&cross(&vector, v), 2.0);
    let cross = cross(&vector, &t);
    add(&add(&times(&t, q[3]), &cross), v)
}

/// The sum of squares, in nalgebra's order.
#[inline(always)]
pub(crate) fn size_squared<L: Lane>(q: &Q<L>) -> L {
    (q[0] * q[0] + q[2] * q[2]) + (q[1] * q[1] + q[3] * q[3])
}

/// The rotation matrix of a quaternion.
#[inline(always)]
pub(crate) fn matrix_of<L: Lane>([i, j, k, w]: &Q<L>) -> M3<L> {
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

/// Specific force integrated in the body axes of the start of the increment, m/s: `(I + (1 - cos
/// n)/n^2 [phi x] + (n - sin n)/n^3 [phi x]^2) eta` with `n = |phi|` (Savage 1998, part 2), by
/// the series of [`turned_force`].
#[inline(always)]
pub(crate) fn in_start_axes<L: Lane>(phi: &V3<L>, eta: &V3<L>) -> V3<L> {
    let n2 = norm_squared(phi);
    let once = cross(phi, eta);
    let twice = cross(phi, &once);
    let (one, two) = turned_force(n2);
    add(&add(eta, &times(&once, one)), &times(&twice, two))
}
