//! Several filters side by side in vectors of the processor.

use super::{Lane, V3};
use crate::inertial::series;
use fearless_simd::{Simd, SimdBase, f64x8};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_4;

/// Number of filters side by side.
pub const PLACES: usize = 8;

impl<S: Simd> Lane for f64x8<S> {
    type Kind = S;
    const PLACES: usize = PLACES;

    #[inline(always)]
    fn kind(self) -> S {
        self.simd
    }

    #[inline(always)]
    fn of(simd: S, x: impl Fn(usize) -> f64) -> Self {
        let mut out = [0.0; PLACES];
        for (l, out) in out.iter_mut().enumerate() {
            *out = x(l);
        }
        Self::from_slice(simd, &out)
    }

    #[inline(always)]
    fn gathered(simd: S, x: impl Fn(usize) -> Vector3<f64>) -> V3<Self> {
        let mut out = [[0.0; PLACES]; 3];
        for l in 0..PLACES {
            let v = x(l);
            for (i, row) in out.iter_mut().enumerate() {
                row[l] = v[i];
            }
        }
        let row = |i: usize| Self::from_slice(simd, &out[i]);
        [row(0), row(1), row(2)]
    }

    #[inline(always)]
    fn all(simd: S, x: f64) -> Self {
        Self::splat(simd, x)
    }

    #[inline(always)]
    fn at(&self, l: usize) -> f64 {
        self[l]
    }

    #[inline(always)]
    fn put(&mut self, l: usize, x: f64) {
        self[l] = x;
    }

    #[inline(always)]
    fn root(self) -> Self {
        self.simd.sqrt_f64x8(self)
    }

    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let simd = self.simd;
        let a = simd.abs_f64x8(self);
        if !simd.all_true_mask64x8(simd.simd_le_f64x8(a, Self::splat(simd, series::MOST))) {
            let (mut sin, mut cos) = (self, self);
            for l in 0..PLACES {
                (sin[l], cos[l]) = series::sin_cos(self[l]);
            }
            return (sin, cos);
        }
        let small = simd.simd_le_f64x8(a, Self::splat(simd, FRAC_PI_4));
        let (y, rest) = series::below_right_angle(a);
        let y = simd.select_f64x8(small, a, y);
        let rest = simd.select_f64x8(small, Self::splat(simd, 0.0), rest);
        let (s, c) = series::near_zero(y, rest);
        let sin = simd.select_f64x8(small, s, c);
        let cos = simd.select_f64x8(small, c, -s);
        (simd.copysign_f64x8(sin, self), cos)
    }

    #[inline(always)]
    fn all_below(self, x: f64) -> bool {
        let simd = self.simd;
        simd.all_true_mask64x8(simd.simd_lt_f64x8(self, Self::splat(simd, x)))
    }
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
                let (sin, cos) = f64x8::of(simd, |l| set[l]).sin_cos();
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
