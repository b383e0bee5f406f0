//! The Earth's quantities along the way: exact ones where the vehicle has been a short time ago,
//! and how they change from there.
//!
//! [`Local::at`] and the slopes take 11 000 instructions in f64. So they are recomputed only when
//! the vehicle has moved by [`NORTH`] or [`UP`], which at 300 m/s is once a second. Between, with
//! `d` the way north as an angle and `h` the way up,
//!
//! ```text
//! x(d, h)  = x + x_d d + x_h h                    1/(M + h), 1/(N + h), gravity, Earth rate
//! sec(d)   = sec (1 + tan d + (tan^2 + 1/2) d^2)
//! ```
//!
//! What that leaves out, at the ends of the way: 3e-11 of a radius by latitude and 3e-10 by height,
//! 9e-14 rad/s of the Earth rate, 1e-10 m/s2 of gravity by latitude and 7e-9 by height, and
//! `(d tan)^3` of the secant, which is 2e-11 at 80 deg and 1e-9 beyond 87 deg, where the way is
//! bounded by [`BY_COSINE`] instead.

use super::earth::{Local, OMEGA_IE};
use super::fixed::{ANGLE, CURVATURE, LENGTH, RATE, SECANT, from_f32, from_f64, mul, to_f64};
use super::solution::LATITUDE;

/// Longest way north, rad: 320 m.
const NORTH: f64 = 5e-5;
/// Longest way up, m.
const UP: i64 = 100 << LENGTH;
/// Longest way north by the cosine of the latitude.
const BY_COSINE: f64 = 1.0 / 1024.0;

/// The Earth's quantities at one position, fixed point.
#[derive(Debug, Clone, Copy)]
pub struct EarthQuantities {
    /// Earth rate, north and down, rad/s.
    pub earth_rate: [i64; 2],
    /// `1/(M + h)` and `1/(N + h)`, 1/m.
    pub curvature: [i64; 2],
    /// Secant of the latitude.
    pub secant: i64,
    /// Tangent of the latitude.
    pub tangent: i64,
    /// Gravity, m/s2.
    pub gravity: i64,
}

/// The quantities in f32, for the error dynamics; good to 1e-3 within a position's surroundings.
#[derive(Debug, Clone, Copy)]
pub struct Coarse {
    pub sin: f32,
    pub cos: f32,
    pub inv_cos: f32,
    pub inv_m: f32,
    pub inv_n: f32,
    pub g: f32,
}

/// The Earth's quantities at a position, and their derivatives for its surroundings.
#[derive(Debug, Clone)]
pub struct LocalEarth {
    latitude: i64,
    height: i64,
    // half the width of the surroundings, rad
    north: i64,
    at: EarthQuantities,
    // change with a rad north and a metre up
    curvature_by: [[i64; 2]; 2],
    gravity_by: [i64; 2],
    sin: i64,
    cos: i64,
    secant_by: [i64; 2],
    coarse: Coarse,
}

/// Bits of what a metre changes in a curvature and in gravity, and of the secant's derivatives.
const BY_METRE: [u32; 2] = [CURVATURE + 17, RATE + 19];
const BY_ANGLE: [u32; 2] = [35, 23];

impl LocalEarth {
    /// The surroundings of a latitude (rad) and height (m).
    pub fn new(latitude: i64, height: i64) -> Self {
        let latitude = latitude.clamp(-LATITUDE, LATITUDE);
        let (phi, h) = (to_f64(latitude, ANGLE), to_f64(height, LENGTH));
        let here = Local::at(phi, h);
        let (inv_m, inv_n) = (1.0 / here.m_h, 1.0 / here.n_h);
        let secant = 1.0 / here.cos;
        let slopes = here.slopes(h as f32);
        let (sin, cos) = (here.sin as f32, here.cos as f32);
        let (m, n) = (inv_m as f32, inv_n as f32);
        let inv_cos = secant as f32;
        let tan = sin * inv_cos;
        let rate = |x: f64| from_f64(x, RATE);
        let of = |x: f32, bits: u32| from_f32(x, bits);
        Self {
            latitude,
            height,
            north: from_f64(NORTH.min(here.cos * BY_COSINE), ANGLE),
            at: EarthQuantities {
                earth_rate: [rate(OMEGA_IE * here.cos), rate(-OMEGA_IE * here.sin)],
                curvature: [inv_m, inv_n].map(|x| from_f64(x, CURVATURE)),
                secant: from_f64(secant, SECANT),
                tangent: 0,
                gravity: rate(here.g),
            },
            curvature_by: [
                [of(-slopes.m * m * m, CURVATURE), of(-m * m, BY_METRE[0])],
                [of(-slopes.n * n * n, CURVATURE), of(-n * n, BY_METRE[0])],
            ],
            gravity_by: [of(slopes.g, RATE), of(slopes.g_up, BY_METRE[1])],
            sin: from_f64(here.sin, ANGLE),
            cos: from_f64(here.cos, ANGLE),
            secant_by: [
                of(inv_cos * tan, BY_ANGLE[0]),
                of(inv_cos * (tan * tan + 0.5), BY_ANGLE[1]),
            ],
            coarse: Coarse {
                sin,
                cos,
                inv_cos,
                inv_m: m,
                inv_n: n,
                g: here.g as f32,
            },
        }
    }

    /// Quantities for the error dynamics.
    pub fn coarse(&self) -> &Coarse {
        &self.coarse
    }

    /// `1/(M + h)`, 1/m.
    pub fn meridian(&self) -> i64 {
        self.at.curvature[0]
    }

    /// Recomputes the surroundings where a latitude and height are outside. True: it did.
    #[inline]
    pub fn follow(&mut self, latitude: i64, height: i64) -> bool {
        let (d, h) = (latitude - self.latitude, height - self.height);
        let outside = d.abs() > self.north || h.abs() > UP;
        if outside {
            self.renew(latitude, height);
        }
        outside
    }

    #[inline(never)]
    fn renew(&mut self, latitude: i64, height: i64) {
        *self = Self::new(latitude, height);
    }

    /// The quantities at a latitude and height within the surroundings.
    #[inline(always)]
    pub fn here(&self, latitude: i64, height: i64) -> EarthQuantities {
        // beyond the bound of the latitude the quantities stay as they are there
        let d = (latitude - self.latitude).max(-self.north).min(self.north); // `clamp` could panic
        let h = (height - self.height).clamp(-UP, UP);
        let EarthQuantities {
            earth_rate: [north, down],
            curvature: [m, n],
            secant,
            gravity,
            ..
        } = self.at;
        let [[m_d, m_h], [n_d, n_h]] = self.curvature_by;
        let [g_d, g_h] = self.gravity_by;
        let [secant_d, secant_dd] = self.secant_by;
        let secant = secant + mul::<47>(secant_d + mul::<48>(secant_dd, d), d);
        let sin = self.sin + mul::<ANGLE>(self.cos, d);
        EarthQuantities {
            earth_rate: [north + mul::<ANGLE>(down, d), down - mul::<ANGLE>(north, d)],
            curvature: [
                m + mul::<ANGLE>(m_d, d) + mul::<59>(m_h, h),
                n + mul::<ANGLE>(n_d, d) + mul::<59>(n_h, h),
            ],
            secant,
            tangent: mul::<ANGLE>(sin, secant),
            gravity: gravity + mul::<ANGLE>(g_d, d) + mul::<61>(g_h, h),
        }
    }
}

#[cfg(test)]
mod tests;
