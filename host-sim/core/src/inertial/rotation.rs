//! Attitude conversions. Body axes are forward-right-down and navigation axes north-east-down.
//! `q_bn` turns a vector in body axes into navigation axes.

use crate::inertial::series::half_angle;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Quaternion of a rotation vector in rad; exact for any size.
#[must_use]
pub fn from_rotvec(phi: &Vector3<f64>) -> UnitQuaternion<f64> {
    let n2 = phi.norm_squared();
    // sin(n/2)/n and cos(n/2). The series is exact to f64 below 0.06 rad, where most steps lie.
    let (c, s) = if n2 < 3.6e-3 {
        half_angle(n2)
    } else {
        let n = n2.sqrt();
        ((0.5 * n).cos(), (0.5 * n).sin() / n)
    };
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(
        c,
        s * phi.x,
        s * phi.y,
        s * phi.z,
    ))
}

/// Attitude from roll, pitch and heading (clockwise from north), rad.
#[must_use]
pub fn from_euler(roll: f64, pitch: f64, heading: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll, pitch, heading)
}

/// Like [`from_euler`], from sine and cosine of half of each angle.
#[must_use]
pub fn from_half_angles(
    (sr, cr): (f64, f64),
    (sp, cp): (f64, f64),
    (sh, ch): (f64, f64),
) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(
        cr * cp * ch + sr * sp * sh,
        sr * cp * ch - cr * sp * sh,
        cr * sp * ch + sr * cp * sh,
        cr * cp * sh - sr * sp * ch,
    ))
}

/// Sine and cosine of an angle from those of its half.
#[must_use]
pub fn doubled((s, c): (f64, f64)) -> (f64, f64) {
    (2.0 * s * c, 1.0 - 2.0 * s * s)
}

/// Roll, pitch and heading in rad; heading in (-pi, pi].
#[must_use]
pub fn to_euler(q_bn: &UnitQuaternion<f64>) -> (f64, f64, f64) {
    q_bn.euler_angles()
}

/// The matrix of the cross product `a x`.
#[must_use]
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_rotation_vectors_agree_with_nalgebra() {
        for n in [0.0, 1e-9, 1e-3, 0.05, 0.0599, 0.0601, 0.5, 3.0] {
            let phi = Vector3::new(0.6, -0.48, 0.64) * n;
            let want = UnitQuaternion::from_scaled_axis(phi);
            assert!(
                (from_rotvec(&phi).coords - want.coords).norm() < 2e-15,
                "{n}"
            );
        }
    }

    #[test]
    fn half_angles_give_the_same_attitude_and_the_whole_ones() {
        for (roll, pitch, heading) in [(0.0, 0.0, 0.0), (0.1, -0.3, 2.9), (-3.0, 1.5, -40.0)] {
            let halves = [roll, pitch, heading].map(|a: f64| (0.5 * a).sin_cos());
            let q = from_half_angles(halves[0], halves[1], halves[2]);
            let want = from_euler(roll, pitch, heading);
            assert!((q.coords - want.coords).norm() < 1e-15);
            for (half, whole) in halves.into_iter().zip([roll, pitch, heading]) {
                let ((s, c), want) = (doubled(half), whole.sin_cos());
                assert!((s - want.0).abs() < 1e-15 && (c - want.1).abs() < 1e-15);
            }
        }
    }
}
