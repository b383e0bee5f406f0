//! Self-alignment at standstill in the inertial frame: levelling and gyrocompassing in one.
//!
//! The gyros relate the body axes to the inertial frame `b0`. In that frame the velocity increments
//! of the accelerometers trace the cone that gravity describes as the Earth turns. The same cone is
//! known in `n0`, the navigation frame frozen at the start. Each second gives one pair of vectors.
//! Least squares give the rotation between the two sets (Wahba's problem, solved by SVD).

use crate::inertial::earth::{Geodetic, Local, OMEGA_IE};
use crate::inertial::rotation::from_rotvec;
use crate::inertial::sins::{Increment, Samples};
use nalgebra::{DMatrix, Matrix3, UnitQuaternion, Vector3};

/// Time over which the direction of gravity is observed as one vector, s. It is long compared with
/// sway and short compared with the rotation of the Earth.
const PIECE_S: f64 = 1.0;
/// Shortest standstill that gives a heading, s.
pub const MIN_S: f64 = 30.0;

/// A short piece of the standstill.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// True velocity increment of the piece (the integral of minus gravity) in the frozen
    /// navigation frame, m/s.
    pub u: Vector3<f64>,
    /// Rotation from the body axes to that frame.
    pub c: Matrix3<f64>,
    /// Mean rate in body axes, rad/s.
    pub rate: Vector3<f64>,
    /// Mean specific force in body axes, m/s2.
    pub force: Vector3<f64>,
    /// Its length, s.
    pub time: f64,
    /// Time of its middle, counted from the first increment, s.
    pub middle: f64,
}

/// An alignment, and the data from which its uncertainty is computed.
#[derive(Debug, Clone)]
pub struct Alignment {
    /// Attitude, body to NED, at the end of the increments.
    pub q_bn: UnitQuaternion<f64>,
    /// The pieces of the standstill.
    pub pieces: Vec<Piece>,
    /// Rotation from the frozen navigation frame to the navigation frame at the end.
    pub q_nn0: UnitQuaternion<f64>,
}

/// Attitude (body to NED) at the end of `increments` of `dt` seconds each, measured at rest at
/// `position`. `None` if the data are too short or do not determine a rotation, for example if all
/// are zero.
#[must_use]
pub fn inertial_frame(
    increments: &[Increment],
    dt: f64,
    samples: Samples,
    position: Geodetic,
) -> Option<UnitQuaternion<f64>> {
    Some(alignment(increments, dt, samples, position)?.q_bn)
}

/// Like [`inertial_frame`], with the data from which the uncertainty is computed.
#[must_use]
pub fn alignment(
    increments: &[Increment],
    dt: f64,
    samples: Samples,
    position: Geodetic,
) -> Option<Alignment> {
    if (increments.len() as f64) * dt < MIN_S {
        return None;
    }
    let here = Local::at(position.lat, position.h);
    let mut q_b0b = UnitQuaternion::identity();
    let mut previous = [Increment::default().parts(); 2];
    let mut b = Matrix3::zeros();
    let length = (PIECE_S / dt).round().max(1.0) as usize;
    let time = length as f64 * dt;
    let mut pieces = Vec::with_capacity(increments.len() / length);
    for (k, part) in increments.chunks(length).enumerate() {
        let mut v_b0 = Vector3::zeros();
        let mut sum = Increment::default();
        for increment in part {
            let last = increment.parts();
            let (phi, eta) = samples.combine(&previous, &last);
            let (phi, eta) = (Vector3::from(phi), Vector3::from(eta));
            v_b0 += q_b0b * (eta + phi.cross(&eta) * 0.5);
            q_b0b *= from_rotvec(&phi);
            q_b0b.renormalize_fast();
            previous = [last, previous[0]];
            sum.dtheta += increment.dtheta;
            sum.dv += increment.dv;
        }
        if part.len() == length {
            let start = k as f64 * time;
            let u = reaction_velocity(&here, start + time) - reaction_velocity(&here, start);
            b += u * v_b0.transpose();
            pieces.push(Piece {
                u,
                c: q_b0b.to_rotation_matrix().into_inner(),
                rate: sum.dtheta / time,
                force: sum.dv / time,
                time,
                middle: start + 0.5 * time,
            });
        }
    }
    let q_n0b0 = wahba(&b)?;
    let c_n0b0 = q_n0b0.to_rotation_matrix().into_inner();
    pieces.iter_mut().for_each(|p| p.c = c_n0b0 * p.c);
    let q_nn0 = earth_turn(&here, increments.len() as f64 * dt).inverse();
    Some(Alignment {
        q_bn: q_nn0 * q_n0b0 * q_b0b,
        pieces,
        q_nn0,
    })
}

/// Rotation from `n` at time `t` to `n0`: the navigation frame turns with the Earth about its axis.
fn earth_turn(here: &Local, t: f64) -> UnitQuaternion<f64> {
    from_rotvec(&(here.omega_ie() * t))
}

/// Integral of minus gravity in the frozen frame `n0` from 0 to `t`, in closed form.
fn reaction_velocity(here: &Local, t: f64) -> Vector3<f64> {
    let axis = here.omega_ie() / OMEGA_IE;
    let g = -here.gravity();
    let along = axis * axis.dot(&g);
    let across = g - along;
    let (s, c) = (OMEGA_IE * t).sin_cos();
    along * t + across * (s / OMEGA_IE) + axis.cross(&g) * ((1.0 - c) / OMEGA_IE)
}

/// The rotation that best maps the right vectors of `b = sum left right'` to the left vectors.
fn wahba(b: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    // The matrix is dynamic on purpose. The special case of nalgebra for 3x3 matrices uses b'b and
    // loses half the digits, and the heading depends on the small singular values.
    let svd =
        DMatrix::from_column_slice(3, 3, b.as_slice()).try_svd(true, true, f64::EPSILON, 1000)?;
    let (u, v_t) = (
        svd.u?.fixed_view::<3, 3>(0, 0).into_owned(),
        svd.v_t?.fixed_view::<3, 3>(0, 0).into_owned(),
    );
    if !svd.singular_values.iter().all(|s| s.is_finite())
        || svd.singular_values[1] <= 1e-12 * svd.singular_values[0]
    {
        return None;
    }
    let d = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, u.determinant() * v_t.determinant()));
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(u * d * v_t);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::rotation::{from_euler, to_euler};
    use crate::inertial::units::{DEG, DEG_PER_H, G0, UG};

    const HOME: Geodetic = Geodetic {
        lat: 0.6,
        lon: 1.9,
        h: 300.0,
    };

    /// Perfect increments at rest with constant errors added.
    fn at_rest(
        q_bn: &UnitQuaternion<f64>,
        gyro: Vector3<f64>,
        accel: Vector3<f64>,
        seconds: usize,
    ) -> Vec<Increment> {
        let here = Local::at(HOME.lat, HOME.h);
        let dt = 0.01;
        let increment = Increment {
            dtheta: (q_bn.inverse_transform_vector(&here.omega_ie()) + gyro) * dt,
            dv: (q_bn.inverse_transform_vector(&-here.gravity()) + accel) * dt,
        };
        vec![increment; seconds * 100]
    }

    #[test]
    fn perfect_data_give_the_attitude() {
        let q = from_euler(3.0 * DEG, -2.0 * DEG, 130.0 * DEG);
        let got = inertial_frame(
            &at_rest(&q, Vector3::zeros(), Vector3::zeros(), 300),
            0.01,
            Samples::default(),
            HOME,
        )
        .unwrap();
        assert!(got.angle_to(&q) < 1e-9, "{:e}", got.angle_to(&q));
    }

    #[test]
    fn errors_are_those_of_the_textbook() {
        // expected: tilt = accelerometer bias / g; heading = east gyro bias / (earth rate * cos
        // latitude)
        let q = from_euler(0.0, 0.0, 0.0);
        let got = inertial_frame(
            &at_rest(
                &q,
                Vector3::zeros(),
                Vector3::new(100.0, 0.0, 0.0) * UG,
                300,
            ),
            0.01,
            Samples::default(),
            HOME,
        )
        .unwrap();
        let (_, pitch, _) = to_euler(&got);
        let want = 100.0 * UG / Local::at(HOME.lat, HOME.h).g;
        assert!((pitch / want - 1.0).abs() < 0.01, "{pitch} {want} {G0}");
        let got = inertial_frame(
            &at_rest(
                &q,
                Vector3::new(0.0, 0.01, 0.0) * DEG_PER_H,
                Vector3::zeros(),
                300,
            ),
            0.01,
            Samples::default(),
            HOME,
        )
        .unwrap();
        let (_, _, heading) = to_euler(&got);
        let want = 0.01 * DEG_PER_H / (OMEGA_IE * HOME.lat.cos());
        assert!(
            (heading.abs() / want - 1.0).abs() < 0.02,
            "{heading} {want}"
        );
    }

    #[test]
    fn too_short_or_dead_data_give_nothing() {
        let q = from_euler(0.0, 0.0, 1.0);
        assert!(
            inertial_frame(
                &at_rest(&q, Vector3::zeros(), Vector3::zeros(), 10),
                0.01,
                Samples::default(),
                HOME
            )
            .is_none()
        );
        assert!(
            inertial_frame(
                &vec![Increment::default(); 60_000],
                0.01,
                Samples::default(),
                HOME
            )
            .is_none()
        );
    }
}
