//! The routines compared with their plain definitions, bit for bit.

use super::*;
use crate::learn::kalman::Rows;
use crate::learn::kalman::deferred::{Deferred, MAX_DEFERRED};
use crate::real::all_finite;

const N: usize = 23; // five fours and three more
const SIZE: usize = N * (N + 1) / 2;

/// Plain repeatable numbers between -1 and 1.
fn numbers<const M: usize>(seed: u32) -> [f32; M] {
    let mut state = seed;
    core::array::from_fn(|_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    })
}

/// The value of row `i`, column `j` of the symmetric matrix.
fn at(matrix: &[f32], i: usize, j: usize) -> f32 {
    matrix[place(N, i, j).expect("a row of the matrix")]
}

/// Every value has an index of its own, and those of the rows before a strip come before it.
#[test]
fn each_value_has_its_place() {
    for n in 0..=29 {
        let mut taken = [false; packed(29)];
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let at = place(n, i, j).expect("a row of the matrix");
            assert_eq!(place(n, j, i), Some(at));
            assert!(!core::mem::replace(&mut taken[at], true), "{n}: {i}, {j}");
            assert!((packed(i / 4 * 4)..packed(n.min(i / 4 * 4 + 4))).contains(&at));
        }
        assert_eq!(taken.iter().filter(|taken| **taken).count(), packed(n));
        assert_eq!([place(n, n, 0), place(n, 0, n)], [None; 2]);
    }
}

/// Equal, bit for bit, to the sum over the columns in their order, for every range of nonzero
/// values.
#[test]
fn times_is_the_dense_product() {
    let matrix: [f32; SIZE] = numbers(1);
    let vectors = [2, 3, 4].map(numbers::<N>);
    let side_by_side: [[f32; 3]; N] = core::array::from_fn(|j| vectors.map(|v| v[j]));
    for start in 0..N {
        for end in start..=N {
            let values = &side_by_side[start..end];
            let mut wide = [[f32::NAN; 3]; N];
            let used = Rows { start, values }.widen(&mut wide);
            let mut products = [[0.0; 3]; N];
            times(&matrix, &wide, used, &mut products);
            for (i, &values) in products.iter().enumerate() {
                let dense = vectors.map(|vector| {
                    let columns = (start..end).map(|j| at(&matrix, i, j) * vector[j]);
                    columns.fold(0.0, |sum, product| sum + product)
                });
                assert_eq!(values, dense, "{start}..{end}, row {i}");
            }
        }
    }
}

/// Equal, bit for bit, to one change after the other, for any number of deferred changes. The
/// diagonal is known before they are applied.
#[test]
fn deferred_changes_are_applied_in_order() {
    let columns = [3, 4, 5].map(numbers::<N>);
    let weights = [0.7, 1.3, 0.2];
    for count in 0..=MAX_DEFERRED {
        let mut matrix: [f32; SIZE] = numbers(1);
        let mut one_by_one = matrix;
        let mut deferred = Deferred::ZEROED;
        for (column, &weight) in columns.iter().zip(&weights).take(count) {
            assert!(!deferred.is_closed());
            assert!(deferred.hold(column, weight));
            for i in 0..N {
                let factor = -(weight * column[i]);
                for j in 0..=i {
                    one_by_one[place(N, i, j).expect("a row")] += factor * column[j];
                }
            }
        }
        assert_eq!(deferred.is_closed(), count == MAX_DEFERRED);
        for i in 0..N {
            let soon = deferred.of_diagonal(i, at(&matrix, i, i));
            assert_eq!(soon, at(&one_by_one, i, i), "{count} deferred, {i}");
        }
        deferred.apply(&mut matrix);
        assert_eq!(matrix, one_by_one, "{count} deferred");
        assert_eq!(deferred, Deferred::ZEROED);
    }
    let mut deferred = Deferred::ZEROED;
    columns.iter().for_each(|c| _ = deferred.hold(c, 1.0));
    assert!(!deferred.hold(&columns[0], 1.0));
}

/// Every row is changed once, whatever the size.
#[test]
fn changes_cover_small_matrices() {
    fn check<const N: usize, const SIZE: usize>() {
        let mut matrix = [1.0; SIZE];
        let mut deferred: Deferred<N, f32> = Deferred::ZEROED;
        assert!(deferred.hold(&[1.0; N], 0.25));
        deferred.apply(&mut matrix);
        assert_eq!(matrix, [0.75; SIZE]);
    }
    check::<0, 0>();
    check::<1, 1>();
    check::<2, 3>();
    check::<5, 15>();
    check::<6, 21>();
}

#[test]
fn whatever_is_not_finite_is_found() {
    for length in 0..20 {
        let mut values = [1.0f32; 20];
        assert!(all_finite(&values[..length]));
        for i in 0..length {
            for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                values[i] = wrong;
                assert!(!all_finite(&values[..length]), "{wrong} at {i} of {length}");
            }
            values[i] = 1.0;
        }
    }
}
