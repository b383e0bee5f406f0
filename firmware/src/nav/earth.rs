//! WGS-84: radii of curvature, normal gravity, Earth rate (the reference is
//! `host_sim::inertial::earth`).

use super::vector::V;
use crate::fix::Position;
use core::f64::consts::{PI, TAU};

/// Earth rotation rate, rad/s (WGS-84).
pub const OMEGA_IE: f64 = 7.292_115e-5;
/// Semi-major axis, m (WGS-84).
const A: f64 = 6_378_137.0;
/// Flattening (WGS-84).
const F: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
const E2: f64 = F * (2.0 - F);
/// Normal gravity at the equator, m/s2 (Somigliana).
const GAMMA_E: f64 = 9.780_325_335_9;
/// Somigliana's constant.
const K: f64 = 0.001_931_852_652_41;
/// omega^2 a^2 b / GM.
const M_RATIO: f64 = 0.003_449_786_506_84;
/// The free-air terms of Groves (2013), eq. 2.139: by a metre, by a metre and the square of the
/// latitude's sine, by a metre squared.
const LINEAR: f64 = -2.0 / A * (1.0 + F + M_RATIO);
const BY_S2: f64 = 4.0 / A * F;
const SQUARE: f64 = 3.0 / (A * A);

impl Position {
    /// North, east, down from `origin` to `self` in m, the short way round the Earth. First order:
    /// for errors and tracks of some tens of km.
    #[must_use]
    pub fn ned_from(&self, origin: &Self) -> V {
        let here = Local::at(origin.latitude, origin.height);
        [
            (self.latitude - origin.latitude) * here.m_h,
            wrapped(self.longitude - origin.longitude) * here.n_h * here.cos,
            origin.height - self.height,
        ]
    }

    /// The position `ned` metres away; inverse of [`Self::ned_from`].
    #[must_use]
    pub fn displaced(&self, ned: V) -> Self {
        let here = Local::at(self.latitude, self.height);
        Self {
            latitude: self.latitude + ned[0] / here.m_h,
            longitude: wrapped(self.longitude + ned[1] / (here.n_h * here.cos)),
            height: self.height - ned[2],
        }
    }
}

/// An angle in rad brought to -pi .. pi. An angle in this range keeps its bits.
pub fn wrapped(angle: f64) -> f64 {
    if angle.abs() <= PI {
        angle
    } else {
        angle - TAU * libm::round(angle * (1.0 / TAU))
    }
}

/// The Earth's quantities at one position.
#[derive(Debug, Clone, Copy)]
pub struct Local {
    /// Sine of the latitude.
    pub sin: f64,
    /// Cosine of the latitude.
    pub cos: f64,
    /// Meridian radius of curvature plus height, m.
    pub m_h: f64,
    /// Prime-vertical radius of curvature plus height, m.
    pub n_h: f64,
    /// Normal gravity at that height, m/s2, along +down.
    pub g: f64,
}

/// Derivatives: of the radii and of gravity by the latitude, of gravity by the height.
#[derive(Debug, Clone, Copy)]
pub struct Slopes {
    /// Slope of the meridian radius, m/rad.
    pub m: f32,
    /// Slope of the prime-vertical radius, m/rad.
    pub n: f32,
    /// Slope of gravity, m/s2 a rad.
    pub g: f32,
    /// Slope of gravity, m/s2 a metre up.
    pub g_up: f32,
}

impl Local {
    /// Latitude in rad, height in m.
    #[must_use]
    pub fn at(latitude: f64, h: f64) -> Self {
        let (sin, cos) = libm::sincos(latitude);
        let s2 = sin * sin;
        // 1/w = 1/sqrt(1 - e2 s2)
        let inv_w = 1.0 / libm::sqrt(1.0 - E2 * s2);
        // Somigliana, and the second-order free-air term
        let free_air = 1.0 + h * ((LINEAR + BY_S2 * s2) + SQUARE * h);
        Self {
            sin,
            cos,
            m_h: (A * (1.0 - E2)) * (inv_w * inv_w * inv_w) + h,
            n_h: A * inv_w + h,
            g: (GAMMA_E + GAMMA_E * K * s2) * inv_w * free_air,
        }
    }

    /// Slopes of radii and gravity from here, where the height is `h` m.
    #[must_use]
    pub fn slopes(&self, h: f32) -> Slopes {
        const E: f32 = E2 as f32;
        let (sin, cos) = (self.sin as f32, self.cos as f32);
        let s2 = sin * sin;
        let sc = sin * cos;
        // w^2 = 1 - e2 s2; M is proportional to w^-3 and N to w^-1
        let by_w = E * sc / (1.0 - E * s2);
        let g = self.g as f32;
        let free_air = 1.0 + h * ((LINEAR as f32 + BY_S2 as f32 * s2) + SQUARE as f32 * h);
        let surface = g / free_air;
        let by_k = 2.0 * K as f32 * sc / (1.0 + K as f32 * s2);
        Slopes {
            m: 3.0 * by_w * (self.m_h as f32 - h),
            n: by_w * (self.n_h as f32 - h),
            g: g * (by_w + by_k) + surface * h * (2.0 * BY_S2 as f32 * sc),
            g_up: surface * (LINEAR as f32 + BY_S2 as f32 * s2 + 2.0 * SQUARE as f32 * h),
        }
    }

    /// Earth rate in NED, rad/s.
    #[must_use]
    pub fn omega_ie(&self) -> V {
        [OMEGA_IE * self.cos, 0.0, -OMEGA_IE * self.sin]
    }
}
