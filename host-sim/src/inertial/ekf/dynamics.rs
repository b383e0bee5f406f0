//! Linear error dynamics of the strapdown equations in NED (phi-angle form; Titterton & Weston
//! 2004, ch. 12; Groves 2013, ch. 14).

use super::{ErrorModel, Inputs, Known, NAV, Noise, Triad};
use crate::inertial::earth::{Local, OMEGA_IE};
use crate::inertial::rotation::{from_rotvec, skew};
use crate::inertial::sins::{Increment, NavState};
use nalgebra::{Dyn, Matrix3, OMatrix, SMatrix, U9, Vector3};

/// Increments are combined to pieces of about this length before attitude and regressors are
/// evaluated, s. It is short compared with the motion of a vehicle's attitude.
const PIECE_S: f64 = 0.05;
/// Pieces are combined to stretches of this length before the matrices are updated, s. Within a
/// stretch the rates that couple the errors (Earth and transport rate, below 1e-3 rad/s) count to
/// second order, and the specific force by its two integrals.
const STRETCH_S: f64 = 1.0;

/// Transition over the time since the last fix.
#[derive(Debug, Clone)]
pub(super) struct Interval {
    pub(super) phi: SMatrix<f64, NAV, NAV>,
    pub(super) psi: OMatrix<f64, U9, Dyn>,
    pub(super) q: SMatrix<f64, NAV, NAV>,
    pub(super) time: f64,
    /// Time since power-on, s.
    pub(super) clock: f64,
    piece: Increment,
    piece_time: f64,
    stretch: Stretch,
    pub(super) last_rate: Option<Vector3<f64>>,
}

/// Integrals over the present stretch, with `t` from its start to its end `T`.
#[derive(Debug, Clone)]
struct Stretch {
    time: f64,
    /// Specific force in NED: integral, m/s, and integral of the integral, m.
    force: [Vector3<f64>; 2],
    /// The same for each body axis in NED, s and s2. Multiplied by what a slow parameter adds along
    /// the axis, it is the effect of that parameter.
    axes: [[Vector3<f64>; 2]; 3],
    /// For each other parameter, which adds `c` to rate or force in NED: the integrals of `c` and
    /// of `(T - t) c`.
    effects: Vec<[Vector3<f64>; 2]>,
}

impl Stretch {
    fn new(n: usize) -> Self {
        Self {
            time: 0.0,
            force: [Vector3::zeros(); 2],
            axes: [[Vector3::zeros(); 2]; 3],
            effects: vec![[Vector3::zeros(); 2]; n],
        }
    }

    fn reset(&mut self) {
        self.time = 0.0;
        self.force = [Vector3::zeros(); 2];
        self.axes = [[Vector3::zeros(); 2]; 3];
        self.effects.fill([Vector3::zeros(); 2]);
    }
}

/// Continues both integrals over `tau` with the constant integrand `c`: `[int c, int int c]`.
fn integrate(sums: &mut [Vector3<f64>; 2], c: &Vector3<f64>, tau: f64) {
    sums[1] += (sums[0] + c * (0.5 * tau)) * tau;
    sums[0] += c * tau;
}

impl Interval {
    pub(super) fn new(n: usize) -> Self {
        Self {
            phi: SMatrix::identity(),
            psi: OMatrix::<f64, U9, Dyn>::zeros(n),
            q: SMatrix::zeros(),
            time: 0.0,
            clock: 0.0,
            piece: Increment::default(),
            piece_time: 0.0,
            stretch: Stretch::new(n),
            last_rate: None,
        }
    }

    pub(super) fn reset(&mut self) {
        self.phi = SMatrix::identity();
        self.psi.fill(0.0);
        self.q = SMatrix::zeros();
        self.time = 0.0;
        self.piece = Increment::default();
        self.piece_time = 0.0;
        self.stretch.reset();
    }

    /// Accumulates one corrected increment. `nav` is the state after it.
    pub(super) fn accumulate(
        &mut self,
        nav: &NavState,
        increment: &Increment,
        dt: f64,
        model: &ErrorModel,
        noise: Noise,
    ) {
        self.time += dt;
        self.clock += dt;
        self.piece.dtheta += increment.dtheta;
        self.piece.dv += increment.dv;
        self.piece_time += dt;
        if self.piece_time >= PIECE_S - 1e-9 {
            self.end_piece(nav, model);
            if self.stretch.time >= STRETCH_S - 1e-9 {
                self.end_stretch(nav, noise, model);
            }
        }
    }

    /// Updates the matrices to the end of the last increment.
    pub(super) fn finish(&mut self, nav: &NavState, model: &ErrorModel, noise: Noise) {
        if self.piece_time > 0.0 {
            self.end_piece(nav, model);
        }
        if self.stretch.time > 0.0 {
            self.end_stretch(nav, noise, model);
        }
    }

    fn end_piece(&mut self, nav: &NavState, model: &ErrorModel) {
        let tau = self.piece_time;
        let per_s = 1.0 / tau;
        let rate = self.piece.dtheta * per_s;
        let now = Inputs {
            rate,
            force: self.piece.dv * per_s,
            rate_change: (rate - self.last_rate.replace(rate).unwrap_or(rate)) * per_s,
            time: self.clock - 0.5 * tau,
            ..Inputs::default()
        };
        // the attitude in the middle of the piece
        let q_mid = nav.q_bn * from_rotvec(&(self.piece.dtheta * -0.5));
        let c = q_mid.to_rotation_matrix().into_inner();
        integrate(&mut self.stretch.force, &(c * now.force), tau);
        for (sums, axis) in self.stretch.axes.iter_mut().zip(c.column_iter()) {
            integrate(sums, &axis.into_owned(), tau);
        }
        let known = Known::default();
        for (sums, p) in self.stretch.effects.iter_mut().zip(&model.parameters) {
            if !p.regressor.is_slow() {
                let effect = c.column(p.axis) * p.value(&now, &known);
                integrate(sums, &effect, tau);
            }
        }
        self.stretch.time += tau;
        self.piece = Increment::default();
        self.piece_time = 0.0;
    }

    fn end_stretch(&mut self, nav: &NavState, noise: Noise, model: &ErrorModel) {
        let t = self.stretch.time;
        let [s1, s2] = self.stretch.force;
        let f_n = s1 * (1.0 / t);
        let f = matrix(nav, &f_n);
        let mut step = SMatrix::<f64, NAV, NAV>::identity() + f * t + f * f * (0.5 * t * t);
        // the part of the position error by tilt that the mean force does not give
        let mut tilt = step.fixed_view_mut::<3, 3>(6, 0);
        tilt += skew(&(s2 - s1 * (0.5 * t)));
        let fresh = self.time - t < 1e-9;
        self.phi = if fresh { step } else { step * self.phi };
        let q = white(&f_n, noise, t);
        self.q = if fresh {
            q
        } else {
            step * self.q * step.transpose() + q
        };
        if !fresh && !model.is_empty() {
            self.psi = step * &self.psi;
        }
        let middle = Inputs {
            time: self.clock - 0.5 * t,
            ..Inputs::default()
        };
        let known = model.known_at(middle.time);
        for ((mut column, effect), p) in self
            .psi
            .column_iter_mut()
            .zip(&self.stretch.effects)
            .zip(&model.parameters)
        {
            let [c1, c2] = if p.regressor.is_slow() {
                let value = p.value(&middle, &known);
                self.stretch.axes[p.axis].map(|c| c * value)
            } else {
                *effect
            };
            // the remaining sensor errors are -J e, so phi' = +C J_g e and dv' = -C J_a e
            let [phi, v, r] = match p.triad {
                Triad::Gyro => {
                    let v = f_n.cross(&c2);
                    [c1, v, v * (t / 3.0)]
                }
                Triad::Accel => [Vector3::zeros(), -c1, -c2],
            };
            for (row, add) in [(0, phi), (3, v), (6, r)] {
                let mut rows = column.fixed_rows_mut::<3>(row);
                rows += add;
            }
        }
        self.stretch.reset();
    }
}

/// Covariance from white noise after `t` seconds of constant specific force `f_n`: the integral of
/// `Phi G G' Phi'` along the chain from tilt to velocity to position.
fn white(f_n: &Vector3<f64>, noise: Noise, t: f64) -> SMatrix<f64, NAV, NAV> {
    let (g, a) = (noise.gyro * noise.gyro, noise.accel * noise.accel);
    let one = Matrix3::identity();
    let k = skew(f_n);
    let kk = k * k.transpose();
    let (t2, t3) = (t * t, t * t * t);
    let mut q = SMatrix::<f64, NAV, NAV>::zeros();
    let mut put = |row: usize, col: usize, block: Matrix3<f64>| {
        q.fixed_view_mut::<3, 3>(row, col).copy_from(&block);
        q.fixed_view_mut::<3, 3>(col, row)
            .copy_from(&block.transpose());
    };
    put(0, 0, one * (g * t));
    put(3, 0, k * (g * t2 / 2.0));
    put(6, 0, k * (g * t3 / 6.0));
    put(3, 3, kk * (g * t3 / 3.0) + one * (a * t));
    put(6, 3, kk * (g * t2 * t2 / 8.0) + one * (a * t2 / 2.0));
    put(6, 6, kk * (g * t2 * t3 / 20.0) + one * (a * t3 / 3.0));
    q
}

/// The 9 x 9 system matrix at `nav` with specific force `f_n` in NED.
fn matrix(nav: &NavState, f_n: &Vector3<f64>) -> SMatrix<f64, NAV, NAV> {
    let v = &nav.velocity;
    let here = Local::at(nav.position.lat, nav.position.h);
    // one over the radii of curvature, and the tangent of the latitude over the second
    let (per_m, per_n) = (here.lat_per_m, here.cos_lat * here.lon_per_m);
    let tan_per_n = here.sin_lat * here.lon_per_m;
    let tan = tan_per_n * here.n_h;
    let (omega_ie, omega_en) = (here.omega_ie(), here.omega_en(v));
    let omega_in = omega_ie + omega_en;
    // derivatives of the rates by position (metres north, east, down) and velocity
    let ie_r = Matrix3::new(
        -here.sin_lat,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        -here.cos_lat,
        0.0,
        0.0,
    ) * (OMEGA_IE * per_m);
    let en_v = Matrix3::new(0.0, per_n, 0.0, -per_m, 0.0, 0.0, 0.0, -tan_per_n, 0.0);
    let en_r = Matrix3::new(
        0.0,
        0.0,
        v.y * (per_n * per_n),
        0.0,
        0.0,
        -v.x * (per_m * per_m),
        -v.y * (per_m * here.lon_per_m * here.lon_per_m * here.n_h),
        0.0,
        -v.y * (tan_per_n * per_n),
    );
    let mut f = SMatrix::<f64, NAV, NAV>::zeros();
    let mut put = |row: usize, col: usize, block: Matrix3<f64>| {
        f.fixed_view_mut::<3, 3>(row, col).copy_from(&block);
    };
    put(0, 0, -skew(&omega_in));
    put(0, 3, en_v);
    put(0, 6, ie_r + en_r);
    put(3, 0, skew(f_n));
    put(3, 3, skew(v) * en_v - skew(&(omega_ie * 2.0 + omega_en)));
    let mut by_r = skew(v) * (ie_r * 2.0 + en_r);
    by_r[(2, 2)] += 2.0 * here.g * (per_m * per_n).sqrt(); // gravity falls with height
    put(3, 6, by_r);
    put(6, 3, Matrix3::identity());
    put(
        6,
        6,
        Matrix3::new(
            -v.z * per_m,
            0.0,
            v.x * per_m,
            v.y * (tan * per_m),
            -v.x * (tan * per_m) - v.z * per_n,
            v.y * per_n,
            0.0,
            0.0,
            0.0,
        ),
    );
    f
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::earth::Geodetic;
    use crate::inertial::rotation::from_rotvec;
    use crate::inertial::sins::Sins;
    use nalgebra::SVector;

    /// Error state between two navigators.
    fn difference(a: &NavState, b: &NavState) -> SVector<f64, 9> {
        let phi = (b.q_bn * a.q_bn.inverse()).scaled_axis();
        let dv = a.velocity - b.velocity;
        let dr = a.position.ned_from(&b.position);
        SVector::from_iterator(phi.iter().chain(dv.iter()).chain(dr.iter()).copied())
    }

    /// Compares every column of `Phi` over 20 s of a turning, climbing drive with two navigators
    /// that start a little apart.
    #[test]
    fn transition_matrix_is_the_derivative_of_the_mechanisation() {
        let start = NavState {
            position: Geodetic {
                lat: 0.7,
                lon: 0.3,
                h: 200.0,
            },
            velocity: Vector3::new(12.0, 25.0, -1.0),
            q_bn: from_rotvec(&Vector3::new(0.05, -0.03, 1.1)),
        };
        let dt = 0.01;
        let increment = |k: usize| {
            let t = k as f64 * dt;
            Increment {
                dtheta: Vector3::new(0.01, 0.02 * (0.5 * t).sin(), 0.2) * dt,
                dv: Vector3::new(1.0 + t.sin(), 2.0, -9.8) * dt,
            }
        };
        let run = |nav: NavState| {
            let mut sins = Sins::new(nav);
            (0..2000).for_each(|k| sins.step(&increment(k), dt));
            sins.nav
        };
        let mut sins = Sins::new(start);
        let mut interval = Interval::new(0);
        let noise = Noise {
            gyro: 0.0,
            accel: 0.0,
        };
        for k in 0..2000 {
            sins.step(&increment(k), dt);
            interval.accumulate(&sins.nav, &increment(k), dt, &ErrorModel::default(), noise);
        }
        interval.finish(&sins.nav, &ErrorModel::default(), noise);
        let steps = [1e-5, 1e-5, 1e-5, 1e-2, 1e-2, 1e-2, 10.0, 10.0, 10.0];
        for (i, step) in steps.into_iter().enumerate() {
            let mut e = nalgebra::DVector::zeros(9);
            e[i] = -step;
            let plus = run(super::super::displaced(&start, &e));
            e[i] = step;
            let minus = run(super::super::displaced(&start, &e));
            let got = (difference(&plus, &sins.nav) - difference(&minus, &sins.nav)) / (2.0 * step);
            let want = interval.phi.column(i);
            for j in 0..9 {
                // relative to the effect of an error of that size on this kind of state
                let scale = interval
                    .phi
                    .row(j)
                    .iter()
                    .zip(steps)
                    .map(|(a, s)| (a * s).abs())
                    .fold(0.0, f64::max)
                    / step;
                assert!(
                    (got[j] - want[j]).abs() < 2e-3 * scale,
                    "d{j}/d{i}: {} {} scale {scale}",
                    got[j],
                    want[j]
                );
            }
        }
    }
}
