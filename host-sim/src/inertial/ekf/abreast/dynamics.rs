//! Error dynamics of several filters side by side over an epoch of one second:
//! [`super::super::dynamics`] for one stretch an interval and one piece a step.

use super::super::{NAV, Triad};
use super::covariance::Column;
use super::lane::{Lane, M3, V3, add, cross, each, product, scaled, skew, sub, times, transposed};
use super::navigate::{Earth, Navigators};
use crate::inertial::earth::OMEGA_IE;

/// An integral and the integral of the integral.
pub(super) type Sums<const L: usize> = [V3<L>; 2];
/// Nothing integrated.
pub(super) const fn nothing<const L: usize>() -> Sums<L> {
    [[Lane::ZERO; 3]; 2]
}

/// Continues both integrals over `tau` with the constant integrand `c`.
#[inline(always)]
pub(super) fn integrate<const L: usize>(sums: &mut Sums<L>, c: &V3<L>, tau: f64) {
    let [first, second] = *sums;
    let mean = add(&first, &scaled(c, 0.5 * tau));
    sums[1] = add(&second, &scaled(&mean, tau));
    sums[0] = add(&first, &scaled(c, tau));
}

/// Transition and noise of the nine navigation errors, by columns.
pub(super) struct Transition<const L: usize> {
    pub(super) phi: [Column<L>; NAV],
    pub(super) q: [Column<L>; NAV],
    /// Mean specific force, NED, m/s2.
    f_n: V3<L>,
}

impl<const L: usize> Transition<L> {
    /// Over `t` seconds that end at `nav`, with the integrals of the specific force.
    #[inline(always)]
    pub(super) fn over(
        nav: &Navigators<L>,
        [s1, s2]: &Sums<L>,
        noise: &[Lane<L>; 2],
        t: f64,
    ) -> Self {
        let f_n = s1.map(|x| x / t);
        let f = matrix(nav, &f_n);
        let half = 0.5 * t * t;
        let mut phi = [[Lane::ZERO; NAV]; NAV];
        for (c, column) in phi.iter_mut().enumerate() {
            let mut square = [Lane::ZERO; NAV];
            for (k, by) in f.iter().enumerate() {
                for (s, x) in square.iter_mut().zip(by) {
                    *s += *x * f[c][k];
                }
            }
            for (r, cell) in column.iter_mut().enumerate() {
                let one = if r == c { 1.0 } else { 0.0 };
                *cell = (one + f[c][r] * t) + square[r] * half;
            }
        }
        let tilt = skew(&sub(s2, &scaled(s1, 0.5 * t)));
        for (c, column) in phi.iter_mut().take(3).enumerate() {
            for (r, row) in tilt.iter().enumerate() {
                column[6 + r] += row[c];
            }
        }
        let q = white(&f_n, noise, t);
        Self { phi, q, f_n }
    }

    /// The effect of a parameter of a triad, by its integrals.
    #[inline(always)]
    pub(super) fn effect(&self, triad: Triad, [c1, c2]: &Sums<L>, t: f64) -> Column<L> {
        let [phi, v, r] = match triad {
            Triad::Gyro => {
                let v = cross(&self.f_n, c2);
                [*c1, v, scaled(&v, t / 3.0)]
            }
            Triad::Accel => [[Lane::ZERO; 3], c1.map(|x| -x), c2.map(|x| -x)],
        };
        std::array::from_fn(|i| [phi, v, r][i / 3][i % 3])
    }
}

/// Writes a block of three by three.
#[inline(always)]
fn put<const L: usize>(to: &mut [Column<L>; NAV], row: usize, column: usize, block: &M3<L>) {
    for (r, cells) in block.iter().enumerate() {
        for (c, cell) in cells.iter().enumerate() {
            to[column + c][row + r] = *cell;
        }
    }
}

/// A multiple of the unit matrix.
#[inline(always)]
fn diagonal<const L: usize>(by: Lane<L>) -> M3<L> {
    let o = Lane::ZERO;
    [[by, o, o], [o, by, o], [o, o, by]]
}

#[inline(always)]
fn by<const L: usize>(m: &M3<L>, x: Lane<L>) -> M3<L> {
    m.map(|row| times(&row, x))
}

#[inline(always)]
fn white<const L: usize>(f_n: &V3<L>, noise: &[Lane<L>; 2], t: f64) -> [Column<L>; NAV] {
    let [g, a] = noise.map(|sigma| sigma * sigma);
    let k = skew(f_n);
    let kk = product(&k, &transposed(&k));
    let (t2, t3) = (t * t, t * t * t);
    let mut q = [[Lane::ZERO; NAV]; NAV];
    let mut both = |row: usize, column: usize, block: &M3<L>| {
        put(&mut q, row, column, block);
        put(&mut q, column, row, &transposed(block));
    };
    let plus = |a: &M3<L>, b: &M3<L>| each(a, b, |a, b| a + b);
    both(0, 0, &diagonal(g * t));
    both(3, 0, &by(&k, g * t2 / 2.0));
    both(6, 0, &by(&k, g * t3 / 6.0));
    both(3, 3, &plus(&by(&kk, g * t3 / 3.0), &diagonal(a * t)));
    both(
        6,
        3,
        &plus(&by(&kk, g * t2 * t2 / 8.0), &diagonal(a * t2 / 2.0)),
    );
    both(
        6,
        6,
        &plus(&by(&kk, g * t2 * t3 / 20.0), &diagonal(a * t3 / 3.0)),
    );
    q
}

/// The system matrix by columns.
#[inline(always)]
fn matrix<const L: usize>(nav: &Navigators<L>, f_n: &V3<L>) -> [Column<L>; NAV] {
    let o = Lane::ZERO;
    let v = &nav.velocity;
    let here = Earth::at(nav.place[0], nav.place[2]);
    let (m, n) = (here.m_h, here.n_h);
    let tan = here.sin_lat / here.cos_lat;
    let (omega_ie, omega_en) = (here.omega_ie(), here.omega_en(v));
    let omega_in = add(&omega_ie, &omega_en);
    let ie_r = by(
        &[[-here.sin_lat, o, o], [o; 3], [-here.cos_lat, o, o]],
        OMEGA_IE / m,
    );
    let en_v = [[o, 1.0 / n, o], [-1.0 / m, o, o], [o, -tan / n, o]];
    let en_r = [
        [o, o, v[1] / (n * n)],
        [o, o, -v[0] / (m * m)],
        [
            -v[1] / (n * m * here.cos_lat * here.cos_lat),
            o,
            -v[1] * tan / (n * n),
        ],
    ];
    let mut f = [[o; NAV]; NAV];
    put(&mut f, 0, 0, &skew(&omega_in).map(|row| row.map(|x| -x)));
    put(&mut f, 0, 3, &en_v);
    put(&mut f, 0, 6, &each(&ie_r, &en_r, |a, b| a + b));
    put(&mut f, 3, 0, &skew(f_n));
    let coriolis = skew(&add(&scaled(&omega_ie, 2.0), &omega_en));
    let by_v = each(&product(&skew(v), &en_v), &coriolis, |a, b| a - b);
    put(&mut f, 3, 3, &by_v);
    let twice = each(&ie_r, &en_r, |a, b| a * 2.0 + b);
    let mut by_r = product(&skew(v), &twice);
    by_r[2][2] += 2.0 * here.g / (m * n).map(f64::sqrt);
    put(&mut f, 3, 6, &by_r);
    put(&mut f, 6, 3, &diagonal(Lane::all(1.0)));
    let last = [
        [-v[2] / m, o, v[0] / m],
        [v[1] * tan / m, -v[0] * tan / m - v[2] / n, v[1] / n],
        [o; 3],
    ];
    put(&mut f, 6, 6, &last);
    f
}
