//! Strapdown mechanisation in north-east-down on the WGS-84 ellipsoid (Savage 1998; Groves 2013, ch. 5), f64.
//!
//! Each word is one step. Coning and sculling use two samples, this word's increments and the last one's:
//! `phi = dtheta_k + 1/12 dtheta_{k-1} x dtheta_k` and
//! `dv_sf = dv_k + 1/2 dtheta_k x dv_k + 1/12 (dtheta_{k-1} x dv_k + dv_{k-1} x dtheta_k)`.

use crate::earth::{Geodetic, Local};
use crate::rotation::from_rotvec;
use nalgebra::{UnitQuaternion, Vector3};

/// Increments of one word: integrals over `dt` of the inertial rate and of the specific force, both in body axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increment {
    /// Delta-theta, rad.
    pub dtheta: Vector3<f64>,
    /// Delta-v, m/s.
    pub dv: Vector3<f64>,
}

/// Position, velocity, attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavState {
    /// Geodetic position.
    pub position: Geodetic,
    /// Velocity over ground in NED, m/s.
    pub velocity: Vector3<f64>,
    /// Body to navigation axes.
    pub q_bn: UnitQuaternion<f64>,
}

/// Barometric damping of the vertical channel, which is unstable by itself: second-order loop, both poles at `1/time_s`.
#[derive(Debug, Clone, Copy)]
pub struct HeightLoop {
    /// Time constant in s.
    pub time_s: f64,
}

/// The navigator: its state, and what it remembers of the word before.
#[derive(Debug, Clone)]
pub struct Sins {
    /// Present solution.
    pub nav: NavState,
    last: Increment,
    acceleration: Vector3<f64>,
}

impl Sins {
    /// Starts from a known state.
    #[must_use]
    pub fn new(nav: NavState) -> Self {
        Self {
            nav,
            last: Increment::default(),
            acceleration: Vector3::zeros(),
        }
    }

    /// Advances by one word of `dt` seconds.
    pub fn step(&mut self, word: &Increment, dt: f64) {
        let NavState {
            position,
            velocity,
            q_bn,
        } = self.nav;
        // navigation-frame quantities at the middle of the step, extrapolated with the last acceleration
        let v_mid = velocity + self.acceleration * (0.5 * dt);
        let here = Local::at(position.lat, position.h);
        let lat_mid = position.lat + 0.5 * dt * v_mid.x / here.m_h;
        let h_mid = position.h - 0.5 * dt * v_mid.z;
        let mid = Local::at(lat_mid, h_mid);
        let omega_ie = mid.omega_ie();
        let omega_en = mid.omega_en(&v_mid);
        let zeta = (omega_ie + omega_en) * dt;

        let (dtheta, dv) = (&word.dtheta, &word.dv);
        let coning = self.last.dtheta.cross(dtheta) / 12.0;
        let sculling = (self.last.dtheta.cross(dv) + self.last.dv.cross(dtheta)) / 12.0;
        let dv_sf = dv + dtheta.cross(dv) * 0.5 + sculling;

        let dv_n = q_bn * dv_sf;
        let dv_n = dv_n - zeta.cross(&dv_n) * 0.5;
        let gravity_coriolis = mid.gravity() - (omega_ie * 2.0 + omega_en).cross(&v_mid);
        let change = dv_n + gravity_coriolis * dt;
        let v_new = velocity + change;
        let v_mean = (velocity + v_new) * 0.5;

        self.nav.position = Geodetic {
            lat: position.lat + v_mean.x * dt / mid.m_h,
            lon: position.lon + v_mean.y * dt / (mid.n_h * mid.cos_lat),
            h: position.h - v_mean.z * dt,
        };
        self.nav.velocity = v_new;
        let mut q = from_rotvec(&-zeta) * q_bn * from_rotvec(&(dtheta + coning));
        q.renormalize_fast();
        self.nav.q_bn = q;
        self.acceleration = change / dt;
        self.last = *word;
    }

    /// One correction of the height loop by a barometric height `baro_h` in m, `dt` seconds after the last one.
    pub fn damp_height(&mut self, loop_: &HeightLoop, baro_h: f64, dt: f64) {
        let error = self.nav.position.h - baro_h;
        self.nav.position.h -= 2.0 / loop_.time_s * error * dt;
        self.nav.velocity.z += error * dt / (loop_.time_s * loop_.time_s);
    }
}
