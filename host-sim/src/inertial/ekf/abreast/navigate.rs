//! The strapdown step of several filters side by side: [`Sins::step`] for increments that are
//! compensated already.

use crate::inertial::earth::{A, E2, F, Geodetic, Local, OMEGA_IE};
use crate::inertial::earth::{GAMMA_E, K, M_RATIO};
use crate::inertial::lane::{
    Lane, PLACES, Q, V3, add, after, all, at, cross, gathered, in_start_axes, minus, of, rotation,
    scaled, sin_cos, size_squared, sub, turned,
};
use crate::inertial::sins::{HeightLoop, Increment, NavState, Sins, outside};
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Navigators side by side.
pub(super) struct Navigators<S: Simd> {
    /// Latitude and longitude, rad, and height, m.
    pub(super) place: V3<S>,
    pub(super) velocity: V3<S>,
    pub(super) q_bn: Q<S>,
    half_change: V3<S>,
    earth: Earth<S>,
    polar: [bool; PLACES],
}

/// [`Local`] at the places of all.
#[derive(Clone, Copy)]
pub(super) struct Earth<S: Simd> {
    pub(super) sin_lat: Lane<S>,
    pub(super) cos_lat: Lane<S>,
    pub(super) m_h: Lane<S>,
    pub(super) n_h: Lane<S>,
    pub(super) lat_per_m: Lane<S>,
    pub(super) lon_per_m: Lane<S>,
    pub(super) g: Lane<S>,
}

impl<S: Simd> Earth<S> {
    #[inline(always)]
    pub(super) fn at(lat: Lane<S>, h: Lane<S>) -> Self {
        let (sin_lat, cos_lat) = sin_cos(lat);
        let s2 = sin_lat * sin_lat;
        let w2 = 1.0 - E2 * s2;
        let per_w = 1.0 / w2.sqrt();
        let n = A * per_w;
        let surface = GAMMA_E * (1.0 + K * s2) * per_w;
        let g = surface
            * (1.0 - 2.0 / A * (1.0 + F + M_RATIO - 2.0 * F * s2) * h + 3.0 / (A * A) * h * h);
        let m_h = n * (1.0 - E2) * (per_w * per_w) + h;
        let n_h = n + h;
        Self {
            sin_lat,
            cos_lat,
            m_h,
            n_h,
            lat_per_m: 1.0 / m_h,
            lon_per_m: 1.0 / (n_h * cos_lat),
            g,
        }
    }

    #[inline(always)]
    pub(super) fn omega_ie(&self) -> V3<S> {
        let (north, down) = (OMEGA_IE * self.cos_lat, -OMEGA_IE * self.sin_lat);
        [north, all(north.simd, 0.0), down]
    }

    #[inline(always)]
    pub(super) fn omega_en(&self, v: &V3<S>) -> V3<S> {
        let lon_rate = v[1] * self.lon_per_m;
        [
            lon_rate * self.cos_lat,
            -v[0] * self.lat_per_m,
            -lon_rate * self.sin_lat,
        ]
    }
}

impl<S: Simd> Navigators<S> {
    /// `navigator(l)` is the navigator number `l`.
    #[inline(always)]
    pub(super) fn of<'a>(simd: S, navigator: impl Fn(usize) -> &'a Sins) -> Self {
        let earth = |l: usize| &navigator(l).earth;
        let coords = |i: usize| of(simd, |l| navigator(l).nav.q_bn.coords[i]);
        let mut polar = [false; PLACES];
        for (l, polar) in polar.iter_mut().enumerate() {
            *polar = navigator(l).polar;
        }
        Self {
            place: gathered(simd, |l| {
                let at = navigator(l).nav.position;
                Vector3::new(at.lat, at.lon, at.h)
            }),
            velocity: gathered(simd, |l| navigator(l).nav.velocity),
            q_bn: [coords(0), coords(1), coords(2), coords(3)],
            half_change: gathered(simd, |l| navigator(l).half_change),
            earth: Earth {
                sin_lat: of(simd, |l| earth(l).sin_lat),
                cos_lat: of(simd, |l| earth(l).cos_lat),
                m_h: of(simd, |l| earth(l).m_h),
                n_h: of(simd, |l| earth(l).n_h),
                lat_per_m: of(simd, |l| earth(l).lat_per_m),
                lon_per_m: of(simd, |l| earth(l).lon_per_m),
                g: of(simd, |l| earth(l).g),
            },
            polar,
        }
    }

    /// The state of navigator `l`.
    pub(super) fn state(&self, l: usize) -> NavState {
        let [lat, lon, h] = at(&self.place, l).into();
        let [i, j, k, w] = self.q_bn;
        NavState {
            position: Geodetic { lat, lon, h },
            velocity: at(&self.velocity, l),
            q_bn: UnitQuaternion::new_unchecked(Quaternion::new(w[l], i[l], j[l], k[l])),
        }
    }

    /// Writes navigator `l` back. `past`: its last increments.
    pub(super) fn give(&self, l: usize, to: &mut Sins, past: [Increment; 2]) {
        to.nav = self.state(l);
        to.past = past;
        to.half_change = at(&self.half_change, l);
        to.earth = Local {
            sin_lat: self.earth.sin_lat[l],
            cos_lat: self.earth.cos_lat[l],
            m_h: self.earth.m_h[l],
            n_h: self.earth.n_h[l],
            lat_per_m: self.earth.lat_per_m[l],
            lon_per_m: self.earth.lon_per_m[l],
            g: self.earth.g[l],
        };
        to.polar = self.polar[l];
    }

    /// Advances all by one increment each of `dt` seconds.
    #[inline(always)]
    pub(super) fn step(&mut self, dtheta: &V3<S>, dv: &V3<S>, dt: f64) {
        let [lat, lon, h] = self.place;
        let velocity = self.velocity;
        let mid = self.earth;
        self.earth = Earth::at(
            lat + 1.5 * dt * velocity[0] * mid.lat_per_m,
            h - 1.5 * dt * velocity[2],
        );
        let v_mid = add(&velocity, &self.half_change);
        let omega_ie = mid.omega_ie();
        let omega_en = mid.omega_en(&v_mid);
        let zeta = scaled(&add(&omega_ie, &omega_en), dt);
        let dv_n = turned(&self.q_bn, &in_start_axes(dtheta, dv));
        let dv_n = sub(&dv_n, &scaled(&cross(&zeta, &dv_n), 0.5));
        let whole = add(&scaled(&omega_ie, 2.0), &omega_en);
        let zero = all(mid.g.simd, 0.0);
        let gravity = [zero, zero, mid.g];
        let gravity_coriolis = sub(&gravity, &cross(&whole, &v_mid));
        let change = add(&dv_n, &scaled(&gravity_coriolis, dt));
        let v_mean = add(&velocity, &scaled(&change, 0.5));
        self.place = [
            lat + v_mean[0] * dt * mid.lat_per_m,
            lon + v_mean[1] * dt * mid.lon_per_m,
            h - v_mean[2] * dt,
        ];
        self.velocity = add(&velocity, &change);
        let q = after(&rotation(&minus(&zeta)), &self.q_bn);
        let q = after(&q, &rotation(dtheta));
        let by = 0.5 * (3.0 - size_squared(&q));
        self.q_bn = [q[0] * by, q[1] * by, q[2] * by, q[3] * by];
        self.half_change = scaled(&change, 0.5);
        for (polar, lat) in self.polar.iter_mut().zip(self.place[0].as_slice()) {
            *polar |= outside(*lat);
        }
    }

    /// Takes the errors `e` (attitude, velocity, position) off, as [`super::super::displaced`].
    #[inline(always)]
    pub(super) fn displace(&mut self, e: &[Lane<S>]) {
        let q = after(&rotation(&[e[0], e[1], e[2]]), &self.q_bn);
        let by = 0.5 * (3.0 - size_squared(&q));
        self.q_bn = [q[0] * by, q[1] * by, q[2] * by, q[3] * by];
        let [lat, lon, h] = self.place;
        let here = Earth::at(lat, h);
        self.place = [
            lat + -e[6] * here.lat_per_m,
            lon + -e[7] * here.lon_per_m,
            h - -e[8],
        ];
        self.velocity = sub(&self.velocity, &[e[3], e[4], e[5]]);
    }

    /// [`Sins::damp_height`] of all. `heights`: those of the barometer, m.
    #[inline(always)]
    pub(super) fn damp_height(&mut self, loop_: &HeightLoop, heights: Lane<S>, dt: f64) {
        let error = self.place[2] - heights;
        self.place[2] -= 2.0 / loop_.time_s * error * dt;
        self.velocity[2] += error * dt / (loop_.time_s * loop_.time_s);
    }
}
