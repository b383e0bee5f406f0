//! The strapdown step of several filters side by side: [`Sins::step`] for increments that are
//! compensated already.

use super::lane::{
    Lane, Q, V3, add, after, cross, gathered, norm_squared, rotation, scaled, size_squared, sub,
    times, turned,
};
use crate::inertial::earth::{A, E2, F, Geodetic, Local, OMEGA_IE};
use crate::inertial::earth::{GAMMA_E, K, M_RATIO};
use crate::inertial::sins::{Increment, NavState, Sins, outside};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Navigators side by side.
#[derive(Debug, Clone)]
pub(super) struct Navigators<const L: usize> {
    /// Latitude and longitude, rad, and height, m.
    pub(super) place: V3<L>,
    pub(super) velocity: V3<L>,
    pub(super) q_bn: Q<L>,
    half_change: V3<L>,
    earth: Earth<L>,
    polar: [bool; L],
}

/// [`Local`] at the places of all.
#[derive(Debug, Clone, Copy)]
pub(super) struct Earth<const L: usize> {
    pub(super) sin_lat: Lane<L>,
    pub(super) cos_lat: Lane<L>,
    pub(super) m_h: Lane<L>,
    pub(super) n_h: Lane<L>,
    pub(super) g: Lane<L>,
}

impl<const L: usize> Earth<L> {
    #[inline(always)]
    pub(super) fn at(lat: Lane<L>, h: Lane<L>) -> Self {
        let both = lat.0.map(f64::sin_cos);
        let sin_lat = Lane::of(|l| both[l].0);
        let cos_lat = Lane::of(|l| both[l].1);
        let s2 = sin_lat * sin_lat;
        let w2 = 1.0 - E2 * s2;
        let w = w2.map(f64::sqrt);
        let surface = GAMMA_E * (1.0 + K * s2) / w;
        let g = surface
            * (1.0 - 2.0 / A * (1.0 + F + M_RATIO - 2.0 * F * s2) * h + 3.0 * h * h / (A * A));
        Self {
            sin_lat,
            cos_lat,
            m_h: A * (1.0 - E2) / (w2 * w) + h,
            n_h: A / w + h,
            g,
        }
    }

    #[inline(always)]
    pub(super) fn omega_ie(&self) -> V3<L> {
        let (north, down) = (OMEGA_IE * self.cos_lat, -OMEGA_IE * self.sin_lat);
        [north, Lane::ZERO, down]
    }

    #[inline(always)]
    pub(super) fn omega_en(&self, v: &V3<L>) -> V3<L> {
        let east = v[1] / self.n_h;
        [east, -v[0] / self.m_h, -east * self.sin_lat / self.cos_lat]
    }
}

impl<const L: usize> Navigators<L> {
    /// `of(l)` is the navigator number `l`.
    pub(super) fn of<'a>(of: impl Fn(usize) -> &'a Sins) -> Self {
        let nav = |l: usize| &of(l).nav;
        let earth = |pick: fn(&Local) -> f64| Lane::of(|l| pick(&of(l).earth));
        Self {
            place: gathered(|l| {
                let at = nav(l).position;
                Vector3::new(at.lat, at.lon, at.h)
            }),
            velocity: gathered(|l| nav(l).velocity),
            q_bn: [0, 1, 2, 3].map(|i| Lane::of(|l| nav(l).q_bn.coords[i])),
            half_change: gathered(|l| of(l).half_change),
            earth: Earth {
                sin_lat: earth(|e| e.sin_lat),
                cos_lat: earth(|e| e.cos_lat),
                m_h: earth(|e| e.m_h),
                n_h: earth(|e| e.n_h),
                g: earth(|e| e.g),
            },
            polar: std::array::from_fn(|l| of(l).polar),
        }
    }

    /// The state of navigator `l`.
    pub(super) fn state(&self, l: usize) -> NavState {
        let [lat, lon, h] = self.place.map(|x| x.0[l]);
        let [i, j, k, w] = self.q_bn.map(|x| x.0[l]);
        NavState {
            position: Geodetic { lat, lon, h },
            velocity: super::lane::at(&self.velocity, l),
            q_bn: UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k)),
        }
    }

    /// Writes navigator `l` back. `past`: its last increments.
    pub(super) fn give(&self, l: usize, to: &mut Sins, past: [Increment; 2]) {
        to.nav = self.state(l);
        to.past = past;
        to.half_change = super::lane::at(&self.half_change, l);
        to.earth = Local {
            sin_lat: self.earth.sin_lat.0[l],
            cos_lat: self.earth.cos_lat.0[l],
            m_h: self.earth.m_h.0[l],
            n_h: self.earth.n_h.0[l],
            g: self.earth.g.0[l],
        };
        to.polar = self.polar[l];
    }

    /// Advances all by one increment each of `dt` seconds.
    #[inline(always)]
    pub(super) fn step(&mut self, dtheta: &V3<L>, dv: &V3<L>, dt: f64) {
        let [lat, lon, h] = self.place;
        let velocity = self.velocity;
        let mid = self.earth;
        self.earth = Earth::at(
            lat + 1.5 * dt * velocity[0] / mid.m_h,
            h - 1.5 * dt * velocity[2],
        );
        let v_mid = add(&velocity, &self.half_change);
        let omega_ie = mid.omega_ie();
        let omega_en = mid.omega_en(&v_mid);
        let zeta = scaled(&add(&omega_ie, &omega_en), dt);
        let dv_n = turned(&self.q_bn, &in_start_axes(dtheta, dv));
        let dv_n = sub(&dv_n, &scaled(&cross(&zeta, &dv_n), 0.5));
        let whole = add(&scaled(&omega_ie, 2.0), &omega_en);
        let gravity = [Lane::ZERO, Lane::ZERO, mid.g];
        let gravity_coriolis = sub(&gravity, &cross(&whole, &v_mid));
        let change = add(&dv_n, &scaled(&gravity_coriolis, dt));
        let v_mean = add(&velocity, &scaled(&change, 0.5));
        self.place = [
            lat + v_mean[0] * dt / mid.m_h,
            lon + v_mean[1] * dt / (mid.n_h * mid.cos_lat),
            h - v_mean[2] * dt,
        ];
        self.velocity = add(&velocity, &change);
        let q = after(&rotation(&zeta.map(|x| -x)), &self.q_bn);
        let q = after(&q, &rotation(dtheta));
        let by = 0.5 * (3.0 - size_squared(&q));
        self.q_bn = q.map(|x| x * by);
        self.half_change = scaled(&change, 0.5);
        for (polar, lat) in self.polar.iter_mut().zip(self.place[0].0) {
            *polar |= outside(lat);
        }
    }

    /// Takes the errors `e` (attitude, velocity, position) off, as [`super::super::displaced`].
    #[inline(always)]
    pub(super) fn displace(&mut self, e: &[Lane<L>]) {
        let q = after(&rotation(&[e[0], e[1], e[2]]), &self.q_bn);
        let norm = size_squared(&q).map(f64::sqrt);
        self.q_bn = q.map(|x| x / norm);
        let [lat, lon, h] = self.place;
        let here = Earth::at(lat, h);
        self.place = [
            lat + -e[6] / here.m_h,
            lon + -e[7] / (here.n_h * here.cos_lat),
            h - -e[8],
        ];
        self.velocity = sub(&self.velocity, &[e[3], e[4], e[5]]);
    }
}

/// [`crate::inertial::sins`]: specific force in the body axes of the start of the increment.
#[inline(always)]
fn in_start_axes<const L: usize>(phi: &V3<L>, eta: &V3<L>) -> V3<L> {
    let n2 = norm_squared(phi);
    let once = cross(phi, eta);
    let twice = cross(phi, &once);
    let first = add(eta, &times(&once, 0.5 - n2 / 24.0));
    add(&first, &times(&twice, 1.0 / 6.0 - n2 / 120.0))
}
