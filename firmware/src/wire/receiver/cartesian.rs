//! Positions and velocities in Earth-centred axes: x to longitude 0, z to the north pole.

use crate::fix::Position;

/// WGS-84: equatorial radius, m, and flattening.
const A: f64 = 6_378_137.0;
const F: f64 = 1.0 / 298.257_223_563;
const B: f64 = A * (1.0 - F);
const E2: f64 = F * (2.0 - F);
const SECOND_E2: f64 = E2 / ((1.0 - F) * (1.0 - F));

/// The position of a point, m, by Bowring's formula: between 10 km below and 100 km above the
/// ellipsoid it is wrong by less than 0.1 mm. `None` outside.
#[inline(never)]
pub fn position([x, y, z]: [f64; 3]) -> Option<Position> {
    let p = libm::sqrt(x * x + y * y);
    // reduced latitude
    let (sin, cos) = direction(z * A, p * B);
    let (up, out) = (
        z + SECOND_E2 * B * sin * sin * sin,
        p - E2 * A * cos * cos * cos,
    );
    let (sin, cos) = direction(up, out);
    let height = p * cos + z * sin - A * libm::sqrt(1.0 - E2 * sin * sin);
    let position = Position {
        latitude: libm::atan2(up, out),
        longitude: libm::atan2(y, x),
        height,
    };
    position.is_plausible().then_some(position)
}

/// Sine and cosine of the angle of a vector.
fn direction(up: f64, out: f64) -> (f64, f64) {
    let length = libm::sqrt(up * up + out * out);
    (up / length, out / length)
}

/// North, east and down at a position, as rows of Earth-centred axes.
#[inline(never)]
fn axes(at: &Position) -> [[f64; 3]; 3] {
    let (sin_lat, cos_lat) = libm::sincos(at.latitude);
    let (sin_lon, cos_lon) = libm::sincos(at.longitude);
    [
        [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        [-sin_lon, cos_lon, 0.0],
        [-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat],
    ]
}

/// A velocity north, east, down.
pub fn velocity(at: &Position, [x, y, z]: [f64; 3]) -> [f64; 3] {
    axes(at).map(|[a, b, c]| a * x + b * y + c * z)
}

/// Variances north, east, down of a covariance: xx, yy, zz, xy, xz, yz.
pub fn variances(at: &Position, [xx, yy, zz, xy, xz, yz]: [f32; 6]) -> [f32; 3] {
    axes(at).map(|axis| {
        let [a, b, c] = axis.map(|of| of as f32);
        a * a * xx + b * b * yy + c * c * zz + 2.0 * (a * b * xy + a * c * xz + b * c * yz)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There and back by the definition, from pole to pole and to the limits of the height.
    #[test]
    fn positions_come_back() {
        for lat in (-90..=90).step_by(3) {
            for (lon, height) in [
                (-180.0, 0.0),
                (-77.7, -9999.0),
                (0.0, 9000.0),
                (135.5, 99e3),
            ] {
                let (lat, lon) = (f64::from(lat).to_radians(), f64::to_radians(lon));
                let n = A / (1.0 - E2 * lat.sin().powi(2)).sqrt();
                let p = (n + height) * lat.cos();
                let z = (n * (1.0 - E2) + height) * lat.sin();
                let found = position([p * lon.cos(), p * lon.sin(), z]).unwrap();
                assert!((found.latitude - lat).abs() * A < 1e-4, "{lat} {height}");
                assert!((found.height - height).abs() < 1e-4, "{lat} {height}");
                let east = (found.longitude - lon).sin() * p;
                assert!(east.abs() < 1e-4, "{lat} {lon}");
            }
        }
        for nowhere in [
            [0.0; 3],
            [f64::NAN; 3],
            [f64::INFINITY, 0.0, 0.0],
            [-2e10; 3],
            [A - 2e4, 0.0, 0.0],
        ] {
            assert_eq!(position(nowhere), None);
        }
    }

    /// The derivatives of the position are the axes of the velocity.
    #[test]
    fn velocities_are_along_the_meridian_and_the_vertical() {
        let at = position([4.02e6, -1.5e6, 4.71e6]).unwrap();
        let moved = |v: [f64; 3]| {
            let to = position([4.02e6 + v[0], -1.5e6 + v[1], 4.71e6 + v[2]]).unwrap();
            let p = f64::hypot(4.02e6, 1.5e6);
            let north = (to.latitude - at.latitude) * 6.367e6;
            let east = (to.longitude - at.longitude) * p;
            [north, east, at.height - to.height]
        };
        for v in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [3.0, -2.0, 5.0],
        ] {
            let (found, want) = (velocity(&at, v), moved(v));
            for (found, want) in found.into_iter().zip(want) {
                assert!((found - want).abs() < 0.01, "{v:?} {found} {want}");
            }
            // a covariance of one direction has the squares of its components
            let c = [
                v[0] * v[0],
                v[1] * v[1],
                v[2] * v[2],
                v[0] * v[1],
                v[0] * v[2],
                v[1] * v[2],
            ];
            let spread = variances(&at, c.map(|v| v as f32));
            for (spread, along) in spread.into_iter().zip(found) {
                assert!((f64::from(spread) - along * along).abs() < 1e-4);
            }
        }
    }
}
