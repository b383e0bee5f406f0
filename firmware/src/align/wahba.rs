//! Wahba's problem: the rotation between two sets of vectors, by the singular value decomposition
//! of a 3 x 3 matrix.

use crate::nav::vector::{Q, V, cross, dot, scale};

/// Sweeps after which the columns are orthogonal to the last bit; 5 to 7 are usual.
const SWEEPS: usize = 30;
/// Least ratio of the second singular value to the first. Below it no rotation is determined.
const LEAST: f64 = 1e-12;

/// The rotation that best turns the right vectors into the left ones, of `b = sum left right'`,
/// rows first. `None` when the vectors do not determine one.
pub fn rotation(b: &[V; 3]) -> Option<Q> {
    let mut svd = Svd {
        a: transposed(b),
        v: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    let turned = |_: &usize| svd.turn::<0, 1>() | svd.turn::<0, 2>() | svd.turn::<1, 2>();
    (0..SWEEPS).take_while(turned).for_each(drop);
    svd.rotation()
}

/// The decomposition `b V = U S`.
///
/// One-sided Jacobi rotations are exact to the last digits even for the small singular values,
/// which hold the heading. The Cortex-M4F computes f64 in software: a pair of columns takes some
/// seven thousand instructions.
#[derive(Debug, Clone, Copy)]
struct Svd {
    /// Columns of b, which become those of U S.
    a: [V; 3],
    /// Columns of V.
    v: [V; 3],
}

impl Svd {
    /// Makes two columns orthogonal. False: they were orthogonal already.
    fn turn<const I: usize, const J: usize>(&mut self) -> bool {
        let Self { a, v } = self;
        let (alpha, beta, gamma) = (dot(a[I], a[I]), dot(a[J], a[J]), dot(a[I], a[J]));
        if gamma.abs() <= f64::EPSILON * libm::sqrt(alpha * beta) {
            return false;
        }
        let zeta = (beta - alpha) / (2.0 * gamma);
        let t = libm::copysign(1.0, zeta) / (zeta.abs() + libm::sqrt(1.0 + zeta * zeta));
        let c = 1.0 / libm::sqrt(1.0 + t * t);
        rotate::<I, J>(a, c, c * t);
        rotate::<I, J>(v, c, c * t);
        true
    }

    fn rotation(&self) -> Option<Q> {
        let Self { a, v } = self;
        let size = a.map(|column| libm::sqrt(dot(column, column)));
        if !size.iter().all(|s| s.is_finite()) {
            return None;
        }
        let (first, second) = largest(&size);
        if size[second] <= LEAST * size[first] {
            return None;
        }
        let u = [first, second].map(|i| scale(a[i], 1.0 / size[i]));
        let (u3, v3) = (cross(u[0], u[1]), cross(v[first], v[second]));
        let pairs = [(u[0], v[first]), (u[1], v[second]), (u3, v3)];
        let matrix = core::array::from_fn(|i| {
            core::array::from_fn(|j| pairs.iter().fold(0.0, |sum, (u, v)| sum + u[i] * v[j]))
        });
        Some(quaternion(&matrix))
    }
}

fn rotate<const I: usize, const J: usize>(columns: &mut [V; 3], c: f64, s: f64) {
    let (x, y) = (columns[I], columns[J]);
    columns[I] = core::array::from_fn(|i| c * x[i] - s * y[i]);
    columns[J] = core::array::from_fn(|i| s * x[i] + c * y[i]);
}

/// Indices of the two largest values.
fn largest(size: &V) -> (usize, usize) {
    let [x, y, z] = *size;
    if x >= y && x >= z {
        (0, if y >= z { 1 } else { 2 })
    } else if y >= z {
        (1, if x >= z { 0 } else { 2 })
    } else {
        (2, if x >= y { 0 } else { 1 })
    }
}

fn transposed([a, b, c]: &[V; 3]) -> [V; 3] {
    [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]]
}

/// Unit quaternion of a rotation matrix, rows first, by its largest component (Shepperd 1978).
fn quaternion(m: &[V; 3]) -> Q {
    let [[a, b, c], [d, e, f], [g, h, i]] = *m;
    let parts = [
        (a + e + i, [1.0 + a + e + i, h - f, c - g, d - b]),
        (a, [h - f, 1.0 + a - e - i, b + d, c + g]),
        (e, [c - g, b + d, 1.0 - a + e - i, f + h]),
        (i, [d - b, c + g, f + h, 1.0 - a - e + i]),
    ];
    let mut best = parts[0];
    for part in parts {
        if part.0 > best.0 {
            best = part;
        }
    }
    let [w, x, y, z] = best.1;
    let k = 1.0 / libm::sqrt(w * w + x * x + y * y + z * z);
    best.1.map(|value| value * k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix([w, x, y, z]: Q) -> [V; 3] {
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ]
    }

    fn product(a: &[V; 3], b: &[V; 3]) -> [V; 3] {
        a.map(|row| core::array::from_fn(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
    }

    fn unit(q: Q) -> [V; 3] {
        let size = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        matrix(q.map(|c| c / size))
    }

    /// Vectors that one rotation turns exactly give this rotation, however different the sizes are
    /// that they span, on whichever axes.
    #[test]
    fn an_exact_rotation_is_found() {
        for truth in [
            [1.0, 0.0, 0.0, 0.0],
            [0.2, -0.7, 0.5, 0.4],
            [0.0, 0.1, 0.0, -1.0],
        ] {
            for axes in [
                [1.0, 0.0, 0.0, 0.0],
                [0.9, 0.2, -0.3, 0.5],
                [0.5, 0.5, 0.5, 0.5],
            ] {
                for second in [0.7, 1e-4] {
                    for at in 0..3 {
                        let (truth, axes) = (unit(truth), unit(axes));
                        let mut sizes = [[0.0; 3]; 3];
                        (sizes[at][at], sizes[(at + 1) % 3][(at + 1) % 3]) = (2.0, second);
                        let spanned = product(&product(&axes, &sizes), &transposed(&axes));
                        let found = matrix(rotation(&product(&truth, &spanned)).expect("a plane"));
                        for (found, truth) in found.iter().flatten().zip(truth.iter().flatten()) {
                            assert!((found - truth).abs() < 2e-11, "{found} {truth}");
                        }
                    }
                }
            }
        }
    }

    /// No rotation fits better: `R' b` is symmetric. Here two columns are orthogonal from the
    /// beginning, and the third is not.
    #[test]
    fn no_other_rotation_fits_better() {
        for third in [[1.0, 1.0, 1.0], [0.3, -2.0, 0.5], [-4.0, 0.1, 0.2]] {
            for columns in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
                let all = [[1.0, 0.0, 0.0], [0.0, 1.5, 0.0], third];
                let b = transposed(&columns.map(|k| all[k]));
                let best = matrix(rotation(&b).expect("three directions"));
                let fit = product(&transposed(&best), &b);
                for i in 0..3 {
                    for j in 0..i {
                        assert!((fit[i][j] - fit[j][i]).abs() < 1e-12, "{fit:?}");
                    }
                    // nor one that is turned by half a turn about an axis
                    let others: f64 = (0..3).filter(|k| *k != i).map(|k| fit[k][k]).sum();
                    assert!(others >= 0.0, "{fit:?}");
                }
            }
        }
    }

    #[test]
    fn one_direction_is_no_attitude() {
        let one: [V; 3] = core::array::from_fn(|i| [0.2, -0.5, 0.9].map(|x| x * (i as f64 - 1.5)));
        assert_eq!(rotation(&one), None);
        assert_eq!(rotation(&[[0.0; 3]; 3]), None);
        assert_eq!(rotation(&[[f64::NAN; 3]; 3]), None);
        assert_eq!(
            rotation(&[[1.0, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0; 3]]),
            None
        );
    }
}
