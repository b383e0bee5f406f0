//! WGS-84: radii of curvature, normal gravity, Earth rate and transport rate in north-east-down.

use crate::inertial::lane::{Lane, V3};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Earth rotation rate, rad/s (WGS-84).
pub const OMEGA_IE: f64 = 7.292_115e-5;
/// Semi-major axis, m (WGS-84).
pub const A: f64 = 6_378_137.0;
/// Flattening (WGS-84).
pub const F: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
pub const E2: f64 = F * (2.0 - F);
/// Normal gravity at the equator, m/s2 (Somigliana).
const GAMMA_E: f64 = 9.780_325_335_9;
/// Somigliana's constant.
const K: f64 = 0.001_931_852_652_41;
/// omega^2 a^2 b / GM.
const M_RATIO: f64 = 0.003_449_786_506_84;

/// Geodetic position.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Geodetic {
    /// Latitude, rad, positive north.
    pub lat: f64,
    /// Longitude, rad, positive east.
    pub lon: f64,
    /// Ellipsoidal height, m.
    pub h: f64,
}

impl Geodetic {
    /// North, east, down from `origin` to `self` in metres, to first order: for errors and for
    /// tracks of some tens of kilometres. If the two lie on both sides of the 180 deg meridian, the
    /// shorter way is used.
    #[must_use]
    pub fn ned_from(&self, origin: &Self) -> Vector3<f64> {
        self.ned_by(origin, &Local::at(origin.lat, origin.h))
    }

    /// As [`Self::ned_from`], with the Earth's properties at `origin` given.
    pub(in crate::inertial) fn ned_by(&self, origin: &Self, local: &Local) -> Vector3<f64> {
        Vector3::new(
            (self.lat - origin.lat) * local.m_h,
            wrapped(self.lon - origin.lon) * local.n_h * local.cos_lat,
            origin.h - self.h,
        )
    }

    /// The position `ned` metres away. This is the inverse of [`Self::ned_from`].
    #[must_use]
    pub fn displaced(&self, ned: &Vector3<f64>) -> Self {
        let local = Local::at(self.lat, self.h);
        Self {
            lat: self.lat + ned.x * local.lat_per_m,
            lon: self.lon + ned.y * local.lon_per_m,
            h: self.h - ned.z,
        }
    }
}

/// An angle in rad, wrapped to -pi .. pi. An angle within this range keeps its bits.
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    if angle.abs() <= PI {
        angle
    } else {
        angle - TAU * (angle / TAU).round()
    }
}

/// The properties of the Earth at one latitude and height that the navigation equations need.
#[derive(Debug, Clone, Copy)]
pub struct Local<L = f64> {
    /// Sine of the latitude.
    pub sin_lat: L,
    /// Cosine of the latitude.
    pub cos_lat: L,
    /// Meridian radius of curvature plus height, m.
    pub m_h: L,
    /// Prime-vertical radius of curvature plus height, m.
    pub n_h: L,
    /// Change of latitude per metre to the north, rad/m.
    pub lat_per_m: L,
    /// Change of longitude per metre to the east, rad/m.
    pub lon_per_m: L,
    /// Normal gravity at that height, m/s2, along +down.
    pub g: L,
}

impl<L: Lane> Local<L> {
    /// Latitude in rad, height in m.
    #[must_use]
    #[inline(always)]
    pub fn at(lat: L, h: L) -> Self {
        let one = L::all(lat.kind(), 1.0);
        let (sin_lat, cos_lat) = lat.sin_cos();
        let s2 = sin_lat * sin_lat;
        let w2 = one - s2 * E2;
        let per_w = one / w2.root();
        let n = per_w * A;
        let surface = (s2 * K + 1.0) * GAMMA_E * per_w;
        // second-order free-air term, Groves (2013) eq. 2.139
        let slope = (one * (1.0 + F + M_RATIO) - s2 * (2.0 * F)) * (2.0 / A);
        let g = surface * (one - slope * h + h * (3.0 / (A * A)) * h);
        let m_h = n * (1.0 - E2) * (per_w * per_w) + h;
        let n_h = n + h;
        Self {
            sin_lat,
            cos_lat,
            m_h,
            n_h,
            lat_per_m: one / m_h,
            lon_per_m: one / (n_h * cos_lat),
            g,
        }
    }

    /// Earth rate in NED, rad/s.
    #[inline(always)]
    pub(in crate::inertial) fn earth_rate(&self) -> V3<L> {
        let zero = L::all(self.g.kind(), 0.0);
        [self.cos_lat * OMEGA_IE, zero, self.sin_lat * -OMEGA_IE]
    }

    /// Transport rate in NED, rad/s, for a velocity in m/s.
    #[inline(always)]
    pub(in crate::inertial) fn transport_rate(&self, v: &V3<L>) -> V3<L> {
        let lon_rate = v[1] * self.lon_per_m;
        [
            lon_rate * self.cos_lat,
            -v[0] * self.lat_per_m,
            -lon_rate * self.sin_lat,
        ]
    }
}

impl Local {
    /// Earth rate in NED, rad/s.
    #[must_use]
    pub fn omega_ie(&self) -> Vector3<f64> {
        self.earth_rate().into()
    }

    /// Transport rate in NED, rad/s, for a velocity in m/s.
    #[must_use]
    pub fn omega_en(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.transport_rate(&[v.x, v.y, v.z]).into()
    }

    /// Gravity vector in NED, m/s2.
    #[must_use]
    pub fn gravity(&self) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.g)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_gravity_at_equator_pole_and_height() {
        assert!((Local::at(0.0, 0.0).g - 9.780_325_335_9).abs() < 1e-10);
        assert!((Local::at(std::f64::consts::FRAC_PI_2, 0.0).g - 9.832_184_937_9).abs() < 1e-9);
        // free-air gradient 0.3086 mGal/m
        let drop = Local::at(0.8, 0.0).g - Local::at(0.8, 1000.0).g;
        assert!((drop - 3.086e-3).abs() < 3e-6, "{drop}");
    }

    #[test]
    fn radii_of_curvature() {
        let equator = Local::at(0.0, 0.0);
        assert!((equator.n_h - A).abs() < 1e-6 && (equator.m_h - 6_335_439.327).abs() < 1e-2);
    }

    #[test]
    fn displacement_goes_there_and_back() {
        let home = Geodetic {
            lat: 0.6,
            lon: -1.2,
            h: 30.0,
        };
        let d = Vector3::new(1200.0, -340.0, 8.0);
        assert!((home.displaced(&d).ned_from(&home) - d).norm() < 1e-6);
    }
    /// A fix may give -180 .. 180 deg or 0 .. 360 deg, and the longitude of a navigator continues
    /// across the date line.
    #[test]
    fn the_date_line_is_crossed_the_short_way() {
        let d = Vector3::new(50.0, 2000.0, -3.0);
        for (start, turns) in [(PI - 1e-4, -1.0), (-PI + 1e-4, 1.0), (PI, -1.0), (0.3, 2.0)] {
            let home = Geodetic {
                lat: -0.3,
                lon: start,
                h: 10.0,
            };
            for d in [d, -d] {
                let mut there = home.displaced(&d);
                there.lon += turns * TAU;
                let error = there.ned_from(&home) - d;
                assert!(error.norm() < 1e-6, "{start} {turns}: {error}");
            }
        }
        let east = Geodetic {
            lat: 0.0,
            lon: PI,
            h: 0.0,
        };
        assert!(east.ned_from(&Geodetic { lon: -PI, ..east }).y.abs() < 1e-6);
    }
}
