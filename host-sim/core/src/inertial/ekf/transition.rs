//! Linear error dynamics of the strapdown equations in NED (phi-angle form; Titterton & Weston
//! 2004, ch. 12; Groves 2013, ch. 14) over one stretch, of one filter or of several side by side.

use super::{NAV, Triad};
use crate::inertial::earth::{Local, OMEGA_IE};
use crate::inertial::lane::{
    Lane, M3, V3, add, by, cross, difference, divided, minus, product, scaled, skew, sub, sum,
    transposed, zeros,
};
use crate::inertial::sins::States;

/// Nine rows of a column.
pub(super) type Column<L> = [L; NAV];

/// An integral and the integral of the integral.
pub(super) type Sums<L> = [V3<L>; 2];
/// Both integrals zero.
#[inline(always)]
pub(super) fn nothing<L: Lane>(kind: L::Kind) -> Sums<L> {
    [zeros(kind); 2]
}

/// Continues both integrals over `tau` with the constant integrand `c`.
#[inline(always)]
pub(super) fn integrate<L: Lane>(sums: &mut Sums<L>, c: &V3<L>, tau: f64) {
    let [first, second] = *sums;
    let mean = add(&first, &scaled(c, 0.5 * tau));
    sums[1] = add(&second, &scaled(&mean, tau));
    sums[0] = add(&first, &scaled(c, tau));
}

/// Transition and noise of the nine navigation errors, by columns.
pub(super) struct Transition<L: Lane> {
    pub(super) phi: [Column<L>; NAV],
    pub(super) q: [Column<L>; NAV],
    /// Mean specific force, NED, m/s2.
    f_n: V3<L>,
}

impl<L: Lane> Transition<L> {
    /// Over `t` seconds that end at `nav`, with the integrals of the specific force.
    #[inline(always)]
    pub(super) fn over(nav: &States<L>, [s1, s2]: &Sums<L>, noise: &[L; 2], t: f64) -> Self {
        let f_n = divided(s1, t);
        let o = L::all(f_n[0].kind(), 0.0);
        let f = matrix(nav, &f_n);
        let half = 0.5 * t * t;
        let mut phi = [[o; NAV]; NAV];
        for (c, column) in phi.iter_mut().enumerate() {
            let mut square = [o; NAV];
            for (k, by) in f.iter().enumerate() {
                for (s, x) in square.iter_mut().zip(by) {
                    *s += *x * f[c][k];
                }
            }
            for (r, cell) in column.iter_mut().enumerate() {
                let one = if r == c { 1.0 } else { 0.0 };
                *cell = (f[c][r] * t + one) + square[r] * half;
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
            Triad::Accel => [zeros(self.f_n[0].kind()), minus(c1), minus(c2)],
        };
        [phi[0], phi[1], phi[2], v[0], v[1], v[2], r[0], r[1], r[2]]
    }
}

/// Writes a block of three by three.
#[inline(always)]
fn put<L: Lane>(to: &mut [Column<L>; NAV], row: usize, column: usize, block: &M3<L>) {
    for (r, cells) in block.iter().enumerate() {
        for (c, cell) in cells.iter().enumerate() {
            to[column + c][row + r] = *cell;
        }
    }
}

/// A multiple of the unit matrix.
#[inline(always)]
fn diagonal<L: Lane>(by: L) -> M3<L> {
    let o = L::all(by.kind(), 0.0);
    [[by, o, o], [o, by, o], [o, o, by]]
}

/// Covariance from white noise after `t` seconds of constant specific force `f_n`: the integral of
/// `Phi G G' Phi'` along the chain from tilt to velocity to position.
#[inline(always)]
fn white<L: Lane>(f_n: &V3<L>, noise: &[L; 2], t: f64) -> [Column<L>; NAV] {
    let (g, a) = (noise[0] * noise[0], noise[1] * noise[1]);
    let k = skew(f_n);
    let kk = product(&k, &transposed(&k));
    let (t2, t3) = (t * t, t * t * t);
    let mut q = [[L::all(g.kind(), 0.0); NAV]; NAV];
    both(&mut q, 0, 0, &diagonal(g * t));
    both(&mut q, 3, 0, &by(&k, g * t2 / 2.0));
    both(&mut q, 6, 0, &by(&k, g * t3 / 6.0));
    let velocity = sum(&by(&kk, g * t3 / 3.0), &diagonal(a * t));
    both(&mut q, 3, 3, &velocity);
    let mixed = sum(&by(&kk, g * t2 * t2 / 8.0), &diagonal(a * t2 / 2.0));
    both(&mut q, 6, 3, &mixed);
    let position = sum(&by(&kk, g * t2 * t3 / 20.0), &diagonal(a * t3 / 3.0));
    both(&mut q, 6, 6, &position);
    q
}

/// Writes a block, and its transpose where the matrix mirrors it.
#[inline(always)]
fn both<L: Lane>(to: &mut [Column<L>; NAV], row: usize, column: usize, block: &M3<L>) {
    put(to, row, column, block);
    put(to, column, row, &transposed(block));
}

/// The system matrix by columns, at `nav` with specific force `f_n` in NED.
#[inline(always)]
fn matrix<L: Lane>(nav: &States<L>, f_n: &V3<L>) -> [Column<L>; NAV] {
    let v = &nav.velocity;
    let o = L::all(v[0].kind(), 0.0);
    let here = Local::at(nav.position[0], nav.position[2]);
    // one over the radii of curvature, and the tangent of the latitude over the second
    let (per_m, per_n) = (here.lat_per_m, here.cos_lat * here.lon_per_m);
    let tan_per_n = here.sin_lat * here.lon_per_m;
    let tan = tan_per_n * here.n_h;
    let (omega_ie, omega_en) = (here.earth_rate(), here.transport_rate(v));
    let omega_in = add(&omega_ie, &omega_en);
    let ie_r = by(
        &[[-here.sin_lat, o, o], [o; 3], [-here.cos_lat, o, o]],
        per_m * OMEGA_IE,
    );
    let en_v = [[o, per_n, o], [-per_m, o, o], [o, -tan_per_n, o]];
    let en_r = [
        [o, o, v[1] * (per_n * per_n)],
        [o, o, -v[0] * (per_m * per_m)],
        [
            -v[1] * (per_m * here.lon_per_m * here.lon_per_m * here.n_h),
            o,
            -v[1] * (tan_per_n * per_n),
        ],
    ];
    let mut f = [[o; NAV]; NAV];
    let turning = skew(&omega_in);
    let turning = [minus(&turning[0]), minus(&turning[1]), minus(&turning[2])];
    put(&mut f, 0, 0, &turning);
    put(&mut f, 0, 3, &en_v);
    put(&mut f, 0, 6, &sum(&ie_r, &en_r));
    put(&mut f, 3, 0, &skew(f_n));
    let coriolis = skew(&add(&scaled(&omega_ie, 2.0), &omega_en));
    let by_v = difference(&product(&skew(v), &en_v), &coriolis);
    put(&mut f, 3, 3, &by_v);
    let twice = sum(&by(&ie_r, L::all(o.kind(), 2.0)), &en_r);
    let mut by_r = product(&skew(v), &twice);
    by_r[2][2] += here.g * 2.0 * (per_m * per_n).root(); // gravity falls with height
    put(&mut f, 3, 6, &by_r);
    put(&mut f, 6, 3, &diagonal(L::all(o.kind(), 1.0)));
    let last = [
        [-v[2] * per_m, o, v[0] * per_m],
        [
            v[1] * (tan * per_m),
            -v[0] * (tan * per_m) - v[2] * per_n,
            v[1] * per_n,
        ],
        [o; 3],
    ];
    put(&mut f, 6, 6, &last);
    f
}
