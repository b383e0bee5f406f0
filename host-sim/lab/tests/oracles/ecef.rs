//! The ECEF reference: a second strapdown navigator, to check the first
//! ([`host_core::inertial::sins`]). They share the WGS-84 constants and no formula.
//!
//! It uses Earth-centred Earth-fixed axes instead of north-east-down (Groves 2013, sec. 5.3), so it
//! has no transport rate, no radii of curvature and no singularity at the poles. Normal gravity is
//! computed in closed form from GM instead of Somigliana's formula. Instead of coning and sculling
//! terms, rate and specific force are reconstructed as parabolas from three increments, and a
//! Runge-Kutta step of fourth order integrates the middle one:
//!
//! ```text
//! dq/dt = 1/2 (q omega_b - omega_e q)     dv/dt = q f q* + g(r) - 2 omega_e x v     dr/dt = v
//! ```
//!
//! It lags one increment behind its input and costs several times more than
//! [`host_core::inertial::sins::Sins::step`].

use host_core::inertial::earth::{A, E2, F, Geodetic, OMEGA_IE};
use host_core::inertial::sins::{Increment, NavState};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// Gravitational constant times the Earth's mass with its atmosphere, m3/s2 (WGS-84).
const GM: f64 = 3.986_004_418e14;

/// Direction of gravity above the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GravityModel {
    /// Along the ellipsoid's normal, as in [`host_core::inertial::earth::Local`] and in the
    /// simulated truth.
    #[default]
    AlongNormal,
    /// The gradient of the normal potential: plumb lines curve, 8e-9 m/s2 per metre of height at 45
    /// deg, towards the equator.
    Potential,
}

/// Position, velocity and attitude in ECEF.
#[derive(Debug, Clone)]
pub struct EcefReference {
    /// The gravity model.
    pub gravity: GravityModel,
    r: Vector3<f64>,
    v: Vector3<f64>,
    // body to ECEF
    q: Quaternion<f64>,
}

/// Rate and specific force over one increment as parabolas in `tau` = -1/2 .. 1/2.
struct Parabola([Vector3<f64>; 3]);

impl Parabola {
    /// The parabola whose integrals over the three increments are `a`, `b`, `c`. `tau` is in sample
    /// periods from the middle of the second increment.
    fn through(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>, dt: f64) -> Self {
        let square = (a + c - b * 2.0) * 0.5;
        Self([(b - square / 12.0) / dt, (c - a) * (0.5 / dt), square / dt])
    }

    fn at(&self, tau: f64) -> Vector3<f64> {
        self.0[0] + (self.0[1] + self.0[2] * tau) * tau
    }
}

/// Time derivatives of attitude, velocity and position.
type Rates = (Quaternion<f64>, Vector3<f64>, Vector3<f64>);

impl EcefReference {
    /// Starts from a known state.
    #[must_use]
    pub fn new(nav: &NavState) -> Self {
        let q_en = ned_to_ecef(nav.position.lat, nav.position.lon);
        Self {
            gravity: GravityModel::AlongNormal,
            r: ecef(&nav.position),
            v: q_en * nav.velocity,
            q: (q_en * nav.q_bn).into_inner(),
        }
    }

    /// Present solution. At a pole, north is along the meridian of the given longitude, as
    /// everywhere.
    #[must_use]
    pub fn nav(&self) -> NavState {
        let position = geodetic(&self.r);
        let q_ne = ned_to_ecef(position.lat, position.lon).inverse();
        NavState {
            position,
            velocity: q_ne * self.v,
            q_bn: q_ne * UnitQuaternion::new_normalize(self.q),
        }
    }

    /// Advances by `increment` of `dt` seconds. `before` and `after` are its neighbours.
    pub fn step(&mut self, before: &Increment, increment: &Increment, after: &Increment, dt: f64) {
        let omega = Parabola::through(&before.dtheta, &increment.dtheta, &after.dtheta, dt);
        let force = Parabola::through(&before.dv, &increment.dv, &after.dv, dt);
        let rates = |x: &Self, tau: f64| x.rates(&omega.at(tau), &force.at(tau));
        let k1 = rates(self, -0.5);
        let k2 = rates(&self.moved(&k1, 0.5 * dt), 0.0);
        let k3 = rates(&self.moved(&k2, 0.5 * dt), 0.0);
        let k4 = rates(&self.moved(&k3, dt), 0.5);
        let mean = (
            (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) / 6.0,
            (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) / 6.0,
            (k1.2 + (k2.2 + k3.2) * 2.0 + k4.2) / 6.0,
        );
        *self = self.moved(&mean, dt);
        self.q = self.q.normalize();
    }

    /// Advances by all `increments` of `dt` seconds each. Beyond both ends they are continued by a
    /// straight line.
    pub fn run(&mut self, increments: &[Increment], dt: f64) {
        for (k, increment) in increments.iter().enumerate() {
            let after = increments.get(k + 1);
            let before = k.checked_sub(1).map(|i| &increments[i]);
            let mirror = |other: Option<&Increment>| {
                other.map_or(*increment, |x| Increment {
                    dtheta: increment.dtheta * 2.0 - x.dtheta,
                    dv: increment.dv * 2.0 - x.dv,
                })
            };
            let before_ = before.copied().unwrap_or_else(|| mirror(after));
            let after_ = after.copied().unwrap_or_else(|| mirror(before));
            self.step(&before_, increment, &after_, dt);
        }
    }

    fn moved(&self, rates: &Rates, s: f64) -> Self {
        Self {
            gravity: self.gravity,
            q: self.q + rates.0 * s,
            v: self.v + rates.1 * s,
            r: self.r + rates.2 * s,
        }
    }

    fn rates(&self, omega: &Vector3<f64>, force: &Vector3<f64>) -> Rates {
        let earth = Vector3::z() * OMEGA_IE;
        let pure = |v: &Vector3<f64>| Quaternion::from_imag(*v);
        let q_dot = (self.q * pure(omega) - pure(&earth) * self.q) * 0.5;
        let f_e = (self.q * pure(force) * self.q.conjugate()).imag();
        let v_dot = f_e + gravity(&self.r, self.gravity) - earth.cross(&self.v) * 2.0;
        (q_dot, v_dot, self.v)
    }
}

/// Turns NED at a geodetic latitude and longitude (rad) into ECEF.
#[must_use]
pub fn ned_to_ecef(lat: f64, lon: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), lon)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -lat - FRAC_PI_2)
}

/// Geodetic to ECEF, m.
#[must_use]
pub fn ecef(p: &Geodetic) -> Vector3<f64> {
    // reduced latitude gives the foot point on the ellipsoid; the height goes along the normal
    let beta = ((1.0 - F) * p.lat.sin()).atan2(p.lat.cos());
    let across = A * beta.cos() + p.h * p.lat.cos();
    Vector3::new(
        across * p.lon.cos(),
        across * p.lon.sin(),
        A * (1.0 - F) * beta.sin() + p.h * p.lat.sin(),
    )
}

/// ECEF in m to geodetic, by three rounds of Bowring's iteration: better than 1e-14 rad from -10 km
/// to satellites.
#[must_use]
pub fn geodetic(r: &Vector3<f64>) -> Geodetic {
    let b = A * (1.0 - F);
    let across = r.x.hypot(r.y);
    let (mut s, mut c) = (r.z, across * (1.0 - F));
    let mut lat = 0.0;
    for _ in 0..3 {
        let n = s.hypot(c);
        let (sin_beta, cos_beta) = (s / n, c / n);
        let up = r.z + E2 / (1.0 - E2) * b * sin_beta.powi(3);
        let out = across - E2 * A * cos_beta.powi(3);
        lat = up.atan2(out);
        (s, c) = ((1.0 - F) * up, out);
    }
    let (sin, cos) = lat.sin_cos();
    Geodetic {
        lat,
        lon: r.y.atan2(r.x),
        h: across * cos + r.z * sin - A * (1.0 - E2 * sin * sin).sqrt(),
    }
}

/// Normal gravity (with the centrifugal part) in ECEF, m/s2, at `r` in m: closed form in
/// ellipsoidal coordinates `u`, `beta` (Heiskanen and Moritz 1967, sec. 6-1; NIMA TR8350.2, eq. 4-5
/// to 4-20).
#[must_use]
pub fn gravity(r: &Vector3<f64>, model: GravityModel) -> Vector3<f64> {
    let b = A * (1.0 - F);
    let e = A * E2.sqrt();
    let across = r.x.hypot(r.y);
    let d = r.norm_squared() - e * e;
    let u2 = 0.5 * d * (1.0 + (1.0 + (2.0 * e * r.z / d).powi(2)).sqrt());
    let u = u2.sqrt();
    let v2 = u2 + e * e;
    let v = v2.sqrt();
    let (sin, cos) = (r.z * v).atan2(u * across).sin_cos();
    let w = ((u2 + e * e * sin * sin) / v2).sqrt();

    let q = |u: f64| 0.5 * ((1.0 + 3.0 * u * u / (e * e)) * (e / u).atan() - 3.0 * u / e);
    let q_prime = 3.0 * (1.0 + u2 / (e * e)) * (1.0 - u / e * (e / u).atan()) - 1.0;
    let turn = OMEGA_IE * OMEGA_IE;
    let bulge = turn * A * A / q(b);
    let g_u = (-GM / v2 - bulge * e / v2 * q_prime * (0.5 * sin * sin - 1.0 / 6.0)
        + turn * u * cos * cos)
        / w;
    let g_beta = (bulge / v * q(u) - turn * v) * sin * cos / w;

    let out = u / (w * v) * cos * g_u - sin / w * g_beta;
    let z = sin / w * g_u + u / (w * v) * cos * g_beta;
    // on the axis itself `out` is zero, whatever its direction
    let (cos_lon, sin_lon) = if across > 0.0 {
        (r.x / across, r.y / across)
    } else {
        (1.0, 0.0)
    };
    let g = Vector3::new(out * cos_lon, out * sin_lon, z);
    match model {
        GravityModel::Potential => g,
        GravityModel::AlongNormal => {
            let lat = geodetic(r).lat;
            let up = Vector3::new(lat.cos() * cos_lon, lat.cos() * sin_lon, lat.sin());
            up * up.dot(&g)
        }
    }
}

mod tests {
    use super::*;
    use host_core::inertial::earth::Local;
    use host_core::inertial::sins::{Samples, Sins};
    use host_core::simulator::truth::{DriveConfig, Truth, random_drive};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn position_goes_to_ecef_and_back() {
        for lat in [-FRAC_PI_2, -1.5, -0.6, 0.0, 0.3, 1.2, 1.57, FRAC_PI_2] {
            for h in [-10e3, 0.0, 60.0, 9e3, 500e3] {
                let p = Geodetic { lat, lon: 2.0, h };
                let back = geodetic(&ecef(&p));
                assert!((back.lat - lat).abs() < 1e-14, "{p:?} {back:?}");
                assert!((back.h - h).abs() < 1e-8, "{p:?} {back:?}");
                assert!((ecef(&back) - ecef(&p)).norm() < 1e-8);
            }
        }
        assert!((ecef(&Geodetic::default()) - Vector3::x() * A).norm() < 1e-9);
    }

    /// GM, a, f and omega give Somigliana's formula, its constants, and the free-air term that
    /// `Local` takes from tables.
    #[test]
    fn gravity_from_gm_is_that_of_somigliana() {
        for lat in [-1.4, -0.8, 0.0, 0.3, 0.9, FRAC_PI_2] {
            for (h, tolerance) in [(0.0, 1e-11), (60.0, 1e-8), (3000.0, 3e-7)] {
                let p = Geodetic { lat, lon: 0.7, h };
                let ned =
                    ned_to_ecef(lat, 0.7).inverse() * gravity(&ecef(&p), GravityModel::Potential);
                let off = ned.z - Local::at(lat, h).g;
                assert!(off.abs() < tolerance, "lat {lat} h {h}: {off:e}");
                // curved plumb line: -8.08e-9 h sin(2 lat) m/s2 northward (Heiskanen and Moritz
                // 1967, eq. 5-34)
                let north = -8.08e-9 * h * (2.0 * lat).sin();
                assert!((ned.x - north).abs() < 1e-10 + 0.02 * north.abs() && ned.y.abs() < 1e-12);
            }
        }
    }

    fn drive(seed: u64, minutes: f64, dt: f64) -> Truth {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let segments = random_drive(minutes * 60.0, &mut rng);
        let config = DriveConfig {
            segments: &segments,
            start: Geodetic {
                lat: 0.84,
                lon: 0.2,
                h: 60.0,
            },
            heading: 0.7,
            dt,
            vibration: 1.0,
        };
        Truth::new(&config, &mut rng)
    }

    /// 22 min on perfect increments. Both navigators are compared with the drive and with each
    /// other.
    #[test]
    fn navigator_and_reference_agree_on_random_drives() {
        for (seed, dt) in [(1, 0.01), (2, 0.01), (3, 0.01), (4, 0.005), (5, 0.005)] {
            let truth = drive(seed, 22.0, dt);
            let end = truth.epochs[truth.epochs.len() - 1];
            let mut reference = EcefReference::new(&truth.epochs[0]);
            reference.run(&truth.increments, dt);
            let reference = reference.nav();
            let mut two = f64::INFINITY;
            for samples in [Samples::Two, Samples::Three] {
                let mut sins = Sins::new(truth.epochs[0]).with_samples(samples);
                for increment in &truth.increments {
                    sins.step(increment, dt);
                }
                let apart = sins.nav.position.ned_from(&reference.position);
                let errors =
                    [&sins.nav, &reference].map(|x| x.position.ned_from(&end.position).norm());
                let turned = sins.nav.q_bn.angle_to(&reference.q_bn);
                let faster = (sins.nav.velocity - reference.velocity).norm();
                println!(
                    "seed {seed} dt {dt} {samples:?}: apart {apart:.4?} m, {faster:.1e} m/s, {turned:.1e} rad; from truth {errors:.4?} m"
                );
                // three samples are the navigator's default
                assert!(
                    errors[0] < 0.5 * two,
                    "seed {seed}: {} m, {two} m with two",
                    errors[0]
                );
                two = errors[0];
                assert!(apart.norm() < 0.1, "seed {seed} {samples:?}: {apart:?}");
                assert!(
                    errors[0] < 0.2 && errors[1] < 0.2,
                    "seed {seed} {samples:?}: {errors:?}"
                );
                assert!(
                    turned < 1e-6 && faster < 3e-4,
                    "seed {seed} {samples:?}: {turned:e} {faster:e}"
                );
            }
        }
    }
}
