//! A symmetric matrix of N rows, of which the lower triangle is stored, and the operations on it.
//! They are most of the cost of a fix.
//!
//! Four rows at a time are a *strip*: strip m has the rows 4 m .. 4 m + 4. A strip is stored as m
//! tiles of 4 x 4 values, row by row within each tile, and behind them the ten values from its
//! column 4 m up to the diagonal, row by row. A tile is read once for all that is done with it, and
//! every tile of a strip is found by one pointer. If N is no multiple of four, a last strip has the
//! N % 4 rows that are left, with tiles of as many rows.

use super::row::axpy;
use crate::real::Real;
use core::ops::Range;

/// Values of a full strip up to the diagonal, behind its tiles.
const CORNER: usize = 10;

/// Values in the rows before row `i`: the length of a matrix of `i` rows.
pub(super) const fn packed(i: usize) -> usize {
    i * (i + 1) / 2
}

/// Index of the value in row `i` and column `j` of a matrix of `n` rows; `None` beyond them.
#[inline(always)]
pub(super) const fn place(n: usize, i: usize, j: usize) -> Option<usize> {
    let (i, j) = if i < j { (j, i) } else { (i, j) };
    if i >= n {
        return None;
    }
    let (strip, row, tile, column) = (i / 4, i % 4, j / 4, j % 4);
    let rows = if strip == n / 4 { n % 4 } else { 4 };
    let within = if tile < strip {
        4 * (rows * tile + row)
    } else {
        4 * rows * strip + packed(row)
    };
    Some(packed(4 * strip) + within + column)
}

/// `out` += a matrix times three vectors, all side by side, which are 0 outside the fours `used`.
/// The value in row i at column j < i also counts for row j.
///
/// Each value of `out` adds up in the order of the columns, as it would row by row.
#[inline(never)]
pub(super) fn times<T: Real>(
    matrix: &[T],
    vectors: &[[T; 3]],
    used: Range<usize>,
    out: &mut [[T; 3]],
) {
    let (v, v_rest) = vectors.as_chunks::<4>();
    let (out, out_rest) = out.as_chunks_mut::<4>();
    let mut rest = matrix;
    for m in 0..v.len() {
        let (Some(of_strip), Some((tiles, corner))) = (v.get(m), rest.split_at_checked(16 * m))
        else {
            return;
        };
        let Some((corner, next)) = corner.split_first_chunk::<CORNER>() else {
            return;
        };
        rest = next;
        let Some((above, [own, ..])) = out.split_at_mut_checked(m) else {
            return;
        };
        let tiles = tiles.as_chunks::<16>().0;
        let of_rows = used.start..used.end.min(m);
        if let (Some(tiles), Some(v)) = (tiles.get(of_rows.clone()), v.get(of_rows)) {
            by_rows(tiles, v, own);
        }
        if used.contains(&m) {
            by_columns(tiles, of_strip, above);
            by_corner(corner, of_strip, own);
        }
    }
    let rows = v_rest.len();
    let (tiles, mut corner) = rest
        .split_at_checked(4 * rows * v.len())
        .unwrap_or_default();
    for (i, factors) in v_rest.iter().enumerate() {
        let of_row = tiles.as_chunks::<4>().0.iter().skip(i).step_by(rows);
        let mut sums = [T::ZERO; 3];
        for ((values, v), out) in of_row.zip(v).zip(out.iter_mut()) {
            for k in 0..4 {
                axpy(&mut sums, values[k], &v[k]);
                axpy(&mut out[k], values[k], factors);
            }
        }
        let Some((values, next)) = corner.split_at_checked(i + 1) else {
            return;
        };
        corner = next;
        if let Some((above, [own, ..])) = out_rest.split_at_mut_checked(i) {
            for (&value, v) in values.iter().zip(v_rest) {
                axpy(&mut sums, value, v);
            }
            *own = sums;
            for (out, &value) in above.iter_mut().zip(values) {
                axpy(out, value, factors);
            }
        }
    }
}

/// Adds the rows of tiles, times fours of the vectors.
#[inline(always)]
fn by_rows<T: Real>(tiles: &[[T; 16]], v: &[[[T; 3]; 4]], own: &mut [[T; 3]; 4]) {
    let mut sums = *own;
    for (tile, v) in tiles.iter().zip(v) {
        for k in 0..4 {
            for r in 0..4 {
                axpy(&mut sums[r], tile[4 * r + k], &v[k]);
            }
        }
    }
    *own = sums;
}

/// Adds the columns of tiles, times four factors.
#[inline(always)]
fn by_columns<T: Real>(tiles: &[[T; 16]], factors: &[[T; 3]; 4], out: &mut [[[T; 3]; 4]]) {
    let factors = *factors;
    for (tile, out) in tiles.iter().zip(out) {
        let mut sums = *out;
        for r in 0..4 {
            for k in 0..4 {
                axpy(&mut sums[k], tile[4 * r + k], &factors[r]);
            }
        }
        *out = sums;
    }
}

/// Adds the values from a strip's own columns up to the diagonal, times its factors.
#[inline(always)]
fn by_corner<T: Real>(corner: &[T; CORNER], v: &[[T; 3]; 4], own: &mut [[T; 3]; 4]) {
    for (r, own) in own.iter_mut().enumerate() {
        for (k, v) in v.iter().enumerate() {
            let (row, column) = if r < k { (k, r) } else { (r, k) };
            if let Some(&value) = corner.get(packed(row) + column) {
                axpy(own, value, v);
            }
        }
    }
}

/// The diagonal of a matrix of `n` rows, each value with its row.
#[inline(always)]
pub(super) fn diagonal<T>(matrix: &mut [T], n: usize, mut act: impl FnMut(usize, &mut T)) {
    let mut rest = matrix;
    for m in 0..n / 4 {
        let _tiles = rest.split_off_mut(..16 * m);
        let corner = rest.split_off_mut(..CORNER);
        let Some([aa, _, bb, _, _, cc, _, _, _, dd]) = corner else {
            return;
        };
        for (k, value) in [aa, bb, cc, dd].into_iter().enumerate() {
            act(4 * m + k, value);
        }
    }
    for i in n / 4 * 4..n {
        // those of the last strip are few
        let at = place(n, i, i).map(|at| at - packed(n / 4 * 4));
        if let Some(value) = at.and_then(|at| rest.get_mut(at)) {
            act(i, value);
        }
    }
}

/// Three columns c of N values, side by side, and what each of their squares counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squares<'a, T> {
    /// c.
    pub columns: &'a [[T; 3]],
    /// w.
    pub weights: [T; 3],
}

impl<T: Real> Squares<'_, T> {
    /// P += w c c' for each column in turn.
    #[inline(never)]
    pub fn add_to(&self, mut matrix: &mut [T]) {
        let (fours, rest) = self.columns.as_chunks::<4>();
        let mut m = 0;
        while let Some((before, [own, ..])) = fours.split_at_checked(m)
            && let Some(tiles) = matrix.split_off_mut(..16 * m)
            && let Some(corner) = matrix.split_off_mut(..CORNER)
        {
            let own = *own;
            let factors = own.map(|c| self.factors(c));
            // read before anything is written: the compiler cannot know that they do not overlap
            for (tile, &c) in tiles.as_chunks_mut::<16>().0.iter_mut().zip(before) {
                for r in 0..4 {
                    for k in 0..4 {
                        change(&mut tile[4 * r + k], &factors[r], &c[k]);
                    }
                }
            }
            for r in 0..4 {
                for k in 0..=r {
                    if let Some(p) = corner.get_mut(packed(r) + k) {
                        change(p, &factors[r], &own[k]);
                    }
                }
            }
            m += 1;
        }
        // The remaining rows are those of the last strip.
        let rows = rest.len();
        let Some(tiles) = matrix.split_off_mut(..4 * rows * m) else {
            return;
        };
        for (i, &own) in rest.iter().enumerate() {
            let values = matrix.split_off_mut(..i + 1).unwrap_or_default();
            let factors = self.factors(own);
            let of_row = tiles.as_chunks_mut::<4>().0.iter_mut().skip(i);
            for (values, c) in of_row.step_by(rows).zip(fours) {
                (values.iter_mut().zip(c)).for_each(|(p, c)| change(p, &factors, c));
            }
            (values.iter_mut().zip(rest)).for_each(|(p, c)| change(p, &factors, c));
        }
    }

    /// w c.
    #[inline(always)]
    fn factors(&self, c: [T; 3]) -> [T; 3] {
        let [a, b, c] = c;
        let [wa, wb, wc] = self.weights;
        [wa * a, wb * b, wc * c]
    }
}

/// Adds three products in turn.
#[inline(always)]
fn change<T: Real>(p: &mut T, factors: &[T; 3], c: &[T; 3]) {
    *p = *p + factors[0] * c[0] + factors[1] * c[1] + factors[2] * c[2];
}

#[cfg(test)]
mod tests;
