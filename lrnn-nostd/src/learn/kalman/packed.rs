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

/// Where the value in row `i` and column `j` of a matrix of `n` rows is; `None` beyond them.
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

/// The first row of the first strip that begins at `offset` or later; `n` when there is none.
pub(super) fn first_row(n: usize, offset: usize) -> usize {
    let strip = (0..=n / 4).find(|&m| packed(4 * m) >= offset);
    strip.map_or(n, |m| 4 * m)
}

/// `out` = matrix times a vector that is 0 outside the fours `used`. The value in row i at column
/// j < i also counts for row j.
///
/// Each value of `out` adds up in the order of the columns, as it would row by row.
#[inline(never)]
pub(super) fn times<T: Real>(matrix: &[T], vector: &[T], used: Range<usize>, out: &mut [T]) {
    out.fill(T::ZERO);
    let (v, v_rest) = vector.as_chunks::<4>();
    let (out, out_rest) = out.as_chunks_mut::<4>();
    let mut rest = matrix;
    for (m, of_strip) in v.iter().enumerate() {
        let Some((tiles, corner)) = rest.split_at_checked(16 * m) else {
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
        if used.contains(&m) {
            let (left, right) = tiles.split_at_checked(used.start).unwrap_or((tiles, &[]));
            let (above_left, above) = (above.split_at_mut_checked(left.len())).unwrap_or_default();
            by_columns(left, of_strip, above_left);
            let factors = v.get(used.start..).unwrap_or_default();
            *own = by_both(right, of_strip, factors, above);
            by_corner(corner, of_strip, own);
        } else if m >= used.end {
            let tiles = tiles.get(used.clone()).unwrap_or_default();
            *own = by_rows(tiles, v.get(used.clone()).unwrap_or_default());
        }
    }
    let rows = v_rest.len();
    let (tiles, mut corner) = rest
        .split_at_checked(4 * rows * v.len())
        .unwrap_or_default();
    for (i, &factor) in v_rest.iter().enumerate() {
        let of_row = tiles.as_chunks::<4>().0.iter().skip(i).step_by(rows);
        let mut sum = T::ZERO;
        for ((values, v), out) in of_row.zip(v).zip(out.iter_mut()) {
            for k in 0..4 {
                sum += values[k] * v[k];
                out[k] += values[k] * factor;
            }
        }
        let Some((values, next)) = corner.split_at_checked(i + 1) else {
            return;
        };
        corner = next;
        if let Some((above, [own, ..])) = out_rest.split_at_mut_checked(i) {
            *own = values
                .iter()
                .zip(v_rest)
                .fold(sum, |sum, (&p, &v)| sum + p * v);
            axpy(above, factor, values);
        }
    }
}

/// The rows of tiles times fours of a vector.
#[inline(always)]
fn by_rows<T: Real>(tiles: &[[T; 16]], v: &[[T; 4]]) -> [T; 4] {
    let mut sums = [T::ZERO; 4];
    for (tile, v) in tiles.iter().zip(v) {
        for k in 0..4 {
            for r in 0..4 {
                sums[r] += tile[4 * r + k] * v[k];
            }
        }
    }
    sums
}

/// Adds the columns of tiles, times four factors.
#[inline(always)]
fn by_columns<T: Real>(tiles: &[[T; 16]], factors: &[T; 4], out: &mut [[T; 4]]) {
    for (tile, out) in tiles.iter().zip(out) {
        let mut sums = *out;
        for r in 0..4 {
            for k in 0..4 {
                sums[k] += tile[4 * r + k] * factors[r];
            }
        }
        *out = sums;
    }
}

/// Both in one pass.
#[inline(always)]
fn by_both<T: Real>(
    tiles: &[[T; 16]],
    factors: &[T; 4],
    v: &[[T; 4]],
    out: &mut [[T; 4]],
) -> [T; 4] {
    let mut own = [T::ZERO; 4];
    for ((tile, v), out) in tiles.iter().zip(v).zip(out) {
        let mut sums = *out;
        for r in 0..4 {
            for k in 0..4 {
                let value = tile[4 * r + k];
                own[r] += value * v[k];
                sums[k] += value * factors[r];
            }
        }
        *out = sums;
    }
    own
}

/// The values from a strip's own columns up to the diagonal.
#[inline(always)]
fn by_corner<T: Real>(corner: &[T; CORNER], v: &[T; 4], own: &mut [T; 4]) {
    let [a, b, c, d] = v;
    let [aa, ba, bb, ca, cb, cc, da, db, dc, dd] = corner;
    let [e, f, g, h] = own;
    *e = *e + *aa * *a + *ba * *b + *ca * *c + *da * *d;
    *f = *f + *ba * *a + *bb * *b + *cb * *c + *db * *d;
    *g = *g + *ca * *a + *cb * *b + *cc * *c + *dc * *d;
    *h = *h + *da * *a + *db * *b + *dc * *c + *dd * *d;
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

/// Three columns c of N values, and what each of their squares counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Squares<'a, T> {
    /// c.
    pub columns: [&'a [T]; 3],
    /// w.
    pub weights: [T; 3],
}

impl<T: Real> Squares<'_, T> {
    /// P += w c c' for each column in turn, in the rows from `from` on, of which `part` is what is
    /// stored. Both begin and end with a strip.
    #[inline(never)]
    pub fn add_to(&self, mut part: &mut [T], from: usize) {
        let [(a, a_rest), (b, b_rest), (c, c_rest)] =
            self.columns.map(|column| column.as_chunks::<4>());
        let [wa, wb, wc] = self.weights;
        let mut m = from / 4;
        while let (Some((a, [of_a, ..])), Some((b, [of_b, ..])), Some((c, [of_c, ..]))) = (
            a.split_at_checked(m),
            b.split_at_checked(m),
            c.split_at_checked(m),
        ) && let Some(tiles) = part.split_off_mut(..16 * m)
            && let Some(corner) = part.split_off_mut(..CORNER)
        {
            let (fa, fb, fc) = (
                of_a.map(|x| wa * x),
                of_b.map(|x| wb * x),
                of_c.map(|x| wc * x),
            );
            let tiles = tiles.as_chunks_mut::<16>().0;
            // read before anything is written: the compiler cannot know that they do not overlap
            for (((tile, &a), &b), &c) in tiles.iter_mut().zip(a).zip(b).zip(c) {
                for r in 0..4 {
                    for k in 0..4 {
                        let p = &mut tile[4 * r + k];
                        *p = *p + fa[r] * a[k] + fb[r] * b[k] + fc[r] * c[k];
                    }
                }
            }
            for r in 0..4 {
                for k in 0..=r {
                    if let Some(p) = corner.get_mut(packed(r) + k) {
                        *p = *p + fa[r] * of_a[k] + fb[r] * of_b[k] + fc[r] * of_c[k];
                    }
                }
            }
            m += 1;
        }
        // What is left are the rows of the last strip.
        let rows = a_rest.len();
        let Some(tiles) = part.split_off_mut(..4 * rows * m) else {
            return;
        };
        let changes = [(wa, a, a_rest), (wb, b, b_rest), (wc, c, c_rest)];
        for i in 0..rows {
            let values = part.split_off_mut(..i + 1).unwrap_or_default();
            for (weight, column, rest) in changes {
                let factor = weight * rest.get(i).copied().unwrap_or(T::ZERO);
                let of_row = tiles.as_chunks_mut::<4>().0.iter_mut().skip(i);
                for (values, column) in of_row.step_by(rows).zip(column) {
                    axpy(values, factor, column);
                }
                axpy(values, factor, rest);
            }
        }
    }
}

#[cfg(test)]
mod tests;
