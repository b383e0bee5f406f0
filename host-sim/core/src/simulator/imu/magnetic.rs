//! The magnetic field of the Earth, for the magnetic error of the gyros.

use crate::inertial::earth::Geodetic;
use nalgebra::Vector3;

/// Dipole coefficients g10, g11, h11 of IGRF-13 for 2020, in gauss.
const DIPOLE: [f64; 3] = [-0.294_048, -0.014_509, 0.046_525];

/// Field of the dipole in north-east-down, gauss. It differs from the true field by up to about a
/// third. The bias per gauss of a gyro is not known better than that.
#[must_use]
pub fn dipole_field(position: &Geodetic) -> Vector3<f64> {
    let [g10, g11, h11] = DIPOLE;
    let (sin_lat, cos_lat) = position.lat.sin_cos();
    let (sin_lon, cos_lon) = position.lon.sin_cos();
    let equatorial = g11 * cos_lon + h11 * sin_lon;
    Vector3::new(
        equatorial * sin_lat - g10 * cos_lat,
        g11 * sin_lon - h11 * cos_lon,
        -2.0 * (g10 * sin_lat + equatorial * cos_lat),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(lat: f64, lon: f64) -> Vector3<f64> {
        dipole_field(&Geodetic {
            lat: lat.to_radians(),
            lon: lon.to_radians(),
            h: 0.0,
        })
    }

    #[test]
    fn it_points_north_at_the_equator_and_down_in_the_north() {
        assert!(
            field(0.0, 0.0).x > 0.28 && field(89.9, 0.0).z > 0.55 && field(-89.9, 0.0).z < -0.55
        );
        // at the dipole's own pole (80.6 N, 72.7 W for these coefficients) there is no horizontal
        // part
        let pole = field(80.59, -72.68);
        assert!(pole.x.hypot(pole.y) < 1e-3, "{pole}");
        // Boulder, observed field of 2020: 0.208 N, 0.031 E, 0.472 D
        let boulder = field(40.0, -105.3) - Vector3::new(0.208, 0.031, 0.472);
        assert!(boulder.norm() < 0.33 * 0.52, "{boulder}");
    }
}
