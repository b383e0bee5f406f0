//! Operations on the small blocks of a covariance. They do not depend on the number of parameters
//! as a type, and are not inlined, so that all filters share them: less flash, and a call is
//! nothing beside its work.

use super::covariance::{GROUP, Workspace};
use super::row::{Rows, axpy, axpy_rows, dot};
use crate::real::{Real, all_finite};

/// The columns of group `g` of C = P_xt J', for rows of `n` values.
#[inline(never)]
pub(super) fn cross_products<const X: usize, const E: usize, T: Real>(
    xt: &[T],
    n: usize,
    rows: &Rows<'_, T>,
    g: usize,
    c: &mut [[T; E]; X],
) {
    let put = |c: &mut [T; E], products: [T; GROUP]| {
        if let Some(c) = c.as_chunks_mut().0.get_mut(g) {
            *c = products;
        }
    };
    let n = n.max(1);
    for (c, xt) in c.chunks_mut(3).zip(xt.chunks(3 * n)) {
        if let Some((first, rest)) = xt.split_at_checked(n)
            && let Some((second, third)) = rest.split_at_checked(n)
            && c.len() == 3
        {
            let products = rows.times_each([first, second, third]);
            c.iter_mut().zip(products).for_each(|(c, p)| put(c, p));
        } else {
            for (c, xt) in c.iter_mut().zip(xt.chunks(n)) {
                put(c, rows.times(xt));
            }
        }
    }
}

/// P_xx <- Phi P_xx Phi' + Phi C Gamma' + (.)' + Gamma S Gamma' + Q, computed as U + U'.
#[inline(never)]
pub(super) fn propagate_errors<const X: usize, const E: usize, T: Real>(
    xx: &mut [[T; X]; X],
    phi: &[[T; X]; X],
    gamma: &[[T; E]; X],
    Workspace { c, s }: &Workspace<X, E, T>,
    q: &[[T; X]; X],
) {
    let half = T::from_f64(0.5);
    let mut u = [[T::ZERO; X]; X];
    for i in 0..X {
        // left = Phi_i P_xx / 2,  right = Phi_i C + Gamma_i S / 2
        let (mut left, mut right) = ([T::ZERO; X], [T::ZERO; E]);
        for l in 0..X {
            axpy(&mut left, half * phi[i][l], &xx[l]);
            axpy(&mut right, phi[i][l], &c[l]);
        }
        for l in 0..E {
            axpy(&mut right, half * gamma[i][l], &s[l]);
        }
        for k in 0..X {
            u[i][k] = dot(&left, &phi[k]) + dot(&right, &gamma[k]);
        }
    }
    for i in 0..X {
        for k in 0..X {
            xx[i][k] = u[i][k] + u[k][i] + q[i][k];
        }
    }
}

/// P_xx <- by S by' + rest. Both halves get the same value, so that rounding cannot make P_xx
/// unsymmetric.
#[inline(never)]
pub(super) fn align_errors<const X: usize, const E: usize, T: Real>(
    xx: &mut [[T; X]; X],
    by: &[[T; E]; X],
    rest: &[[T; X]; X],
    s: &[[T; E]; E],
) {
    for i in 0..X {
        let mut left = [T::ZERO; E];
        for k in 0..E {
            axpy(&mut left, by[i][k], &s[k]);
        }
        for j in i..X {
            let value = dot(&left, &by[j]) + rest[i][j];
            xx[i][j] = value;
            xx[j][i] = value;
        }
    }
}

/// P_xx <- P_xx + `factors` `cx`'; row and column `i` become `left` times `cx`.
#[inline(never)]
pub(super) fn update_errors<const X: usize, T: Real>(
    xx: &mut [[T; X]; X],
    i: usize,
    cx: &[T; X],
    factors: [T; X],
    left: T,
) {
    axpy_rows(xx.as_flattened_mut(), &factors, cx);
    for j in 0..X {
        let value = left * cx[j];
        if let Some(entry) = xx.get_mut(i).and_then(|row| row.get_mut(j)) {
            *entry = value;
        }
        if let Some(entry) = xx[j].get_mut(i) {
            *entry = value;
        }
    }
}

/// Whether every value is finite.
#[inline(never)]
pub(super) fn finite<T: Real>(values: &[T]) -> bool {
    all_finite(values)
}

/// The larger of the two; `least` if `value` is NaN.
#[inline]
pub(super) fn at_least<T: Real>(value: T, least: T) -> T {
    if value >= least { value } else { least }
}
