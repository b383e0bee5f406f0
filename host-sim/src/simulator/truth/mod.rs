//! The true drive: position, velocity and attitude as smooth functions of time. From them follow
//! the increments of a perfect IMU, which are the integrals of inertial rate and specific force by
//! three-point Gauss-Legendre quadrature over every sample period. Nothing here uses the equations
//! of a navigator. So a navigator can be tested with these increments.

mod drive;
mod profile;
mod vibration;

pub use drive::random_drive;
pub use profile::{Profile, Segment};
pub use vibration::Vibration;

use crate::inertial::earth::{Geodetic, Local};
use crate::inertial::rotation::{doubled, from_half_angles};
use crate::inertial::sins::{Increment, NavState};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

/// Nose-up pitch per forward acceleration, rad per m/s2 (assumed: 0.25 deg per m/s2).
const SQUAT: f64 = 4.4e-3;
/// Roll to the outside per lateral acceleration, rad per m/s2 (assumed: 0.35 deg per m/s2).
const BODY_ROLL: f64 = 6.1e-3;
/// Share of the road vibration that remains at standstill, from engine and people (assumed).
const IDLE: f64 = 0.04;
/// Speed at which the vibration has half its full amplitude, m/s (assumed).
const ROAD_SPEED: f64 = 8.0;
/// Nodes of the three-point Gauss-Legendre rule on [0, 1], and weights.
const NODES: [f64; 3] = [0.112_701_665_379_258_3, 0.5, 0.887_298_334_620_741_7];
const WEIGHTS: [f64; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];

/// A whole true drive.
#[derive(Debug, Clone)]
pub struct Truth {
    /// Sample period, s.
    pub dt: f64,
    /// Samples per epoch.
    pub samples_per_epoch: usize,
    /// Perfect increments, one per sample.
    pub increments: Vec<Increment>,
    /// True state at the start of each epoch, every `samples_per_epoch` samples, and at the end:
    /// one more than there are whole epochs.
    pub epochs: Vec<NavState>,
}

/// Kinematics at one time.
struct Instant {
    q_bn: nalgebra::UnitQuaternion<f64>,
    v: Vector3<f64>,
    a: Vector3<f64>,
    omega_nb: Vector3<f64>,
}

/// The layout of a drive.
pub struct DriveConfig<'a> {
    /// Segments, at least one.
    pub segments: &'a [Segment],
    /// Start position.
    pub start: Geodetic,
    /// Heading at the start, rad.
    pub heading: f64,
    /// Sample period, s. One second is a whole number of samples.
    pub dt: f64,
    /// Scale of the vibration: 1 is a passenger car on an ordinary road, 0 none.
    pub vibration: f64,
}

impl Truth {
    /// Computes the drive, in about 1 us per sample.
    pub fn new(config: &DriveConfig<'_>, rng: &mut ChaCha8Rng) -> Self {
        let dt = config.dt;
        let profile = Profile::new(config.segments, config.heading, dt);
        let mut vibration = Vibration::new(rng, config.vibration);
        let n = (profile.duration() / dt).round() as usize;
        let samples_per_epoch = (1.0 / dt).round() as usize;
        let rotors = NODES.map(|x| vibration.rotor(x * dt));
        let rotor_0 = vibration.rotor(0.0);
        let rotor_sample = vibration.rotor(dt);
        let mut increments = Vec::with_capacity(n);
        let mut epochs = Vec::with_capacity(n / samples_per_epoch + 2);
        let mut position = config.start;
        let mut leg = 0;
        for k in 0..n {
            let t0 = k as f64 * dt;
            profile.advance(&mut leg, t0);
            if k % samples_per_epoch == 0 {
                vibration.rebase(t0);
            } else {
                vibration.turn(&rotor_sample);
            }
            let at = |t: f64, rotor: &[(f64, f64)]| instant(&profile, leg, t, &vibration.at(rotor));
            if k % samples_per_epoch == 0 {
                epochs.push(state(&at(t0, &rotor_0), position));
            }
            let nodes = [0, 1, 2].map(|i| at(t0 + NODES[i] * dt, &rotors[i]));
            let (increment, next) = integrate(&nodes, position, dt);
            increments.push(increment);
            position = next;
        }
        if n.is_multiple_of(samples_per_epoch) && n > 0 {
            vibration.rebase(n as f64 * dt);
            epochs.push(state(
                &instant(&profile, leg, n as f64 * dt, &vibration.at(&rotor_0)),
                position,
            ));
        }
        Self {
            dt,
            samples_per_epoch,
            increments,
            epochs,
        }
    }
}

fn state(now: &Instant, position: Geodetic) -> NavState {
    NavState {
        position,
        velocity: now.v,
        q_bn: now.q_bn,
    }
}

/// Velocity, acceleration, attitude and rate at time `t` on leg `leg`.
fn instant(profile: &Profile, leg: usize, t: f64, shake: &vibration::Shake) -> Instant {
    let c = profile.at(leg, t);
    let (s, psi, gamma) = (c.speed, c.heading, c.grade);
    // vibration grows with speed
    let road = s.value / (s.value + ROAD_SPEED);
    let road_d1 = ROAD_SPEED / ((s.value + ROAD_SPEED) * (s.value + ROAD_SPEED)) * s.d1;
    let amp = IDLE + (1.0 - IDLE) * road;
    let amp_d1 = (1.0 - IDLE) * road_d1;
    let angle = [0, 1, 2].map(|i| amp * shake.angle[i]);
    let rate = [0, 1, 2].map(|i| amp * shake.rate[i] + amp_d1 * shake.angle[i]);

    let (sp, cp) = psi.value.sin_cos();
    let (sg, cg) = gamma.value.sin_cos();
    let along = Vector3::new(cg * cp, cg * sp, -sg);
    let along_d1 = Vector3::new(
        -sg * cp * gamma.d1 - cg * sp * psi.d1,
        -sg * sp * gamma.d1 + cg * cp * psi.d1,
        -cg * gamma.d1,
    );
    let heave = Vector3::new(0.0, 0.0, amp * shake.heave[0]);
    let heave_d1 = Vector3::new(0.0, 0.0, amp * shake.heave[1] + amp_d1 * shake.heave[0]);
    let v = along * s.value + heave;
    let a = along * s.d1 + along_d1 * s.value + heave_d1;

    let roll = -BODY_ROLL * s.value * psi.d1 + angle[0];
    let roll_d1 = -BODY_ROLL * (s.d1 * psi.d1 + s.value * psi.d2) + rate[0];
    let pitch = gamma.value + SQUAT * s.d1 + angle[1];
    let pitch_d1 = gamma.d1 + SQUAT * s.d2 + rate[1];
    let heading = psi.value + angle[2];
    let heading_d1 = psi.d1 + rate[2];
    let [half_roll, half_pitch, half_heading] = [roll, pitch, heading].map(|a| (0.5 * a).sin_cos());
    let [(sr, cr), (st, ct)] = [half_roll, half_pitch].map(doubled);
    let omega_nb = Vector3::new(
        roll_d1 - heading_d1 * st,
        pitch_d1 * cr + heading_d1 * sr * ct,
        -pitch_d1 * sr + heading_d1 * cr * ct,
    );
    Instant {
        q_bn: from_half_angles(half_roll, half_pitch, half_heading),
        v,
        a,
        omega_nb,
    }
}

/// Integrates rate, specific force and position over one sample period from its three nodes.
fn integrate(nodes: &[Instant; 3], position: Geodetic, dt: f64) -> (Increment, Geodetic) {
    // the Earth changes by 1e-9 within a sample period: one evaluation at its middle is enough
    let v_mid = nodes[1].v;
    let start = Local::at(position.lat, position.h);
    let mid = Local::at(
        position.lat + 0.5 * dt * v_mid.x / start.m_h,
        position.h - 0.5 * dt * v_mid.z,
    );
    let omega_ie = mid.omega_ie();
    let mut increment = Increment::default();
    let mut moved = Vector3::zeros();
    for (node, weight) in nodes.iter().zip(WEIGHTS) {
        let omega_en = mid.omega_en(&node.v);
        let f_n = node.a + (omega_ie * 2.0 + omega_en).cross(&node.v) - mid.gravity();
        let w = weight * dt;
        increment.dtheta +=
            (node.omega_nb + node.q_bn.inverse_transform_vector(&(omega_ie + omega_en))) * w;
        increment.dv += node.q_bn.inverse_transform_vector(&f_n) * w;
        moved += node.v * w;
    }
    let next = Geodetic {
        lat: position.lat + moved.x / mid.m_h,
        lon: position.lon + moved.y / (mid.n_h * mid.cos_lat),
        h: position.h - moved.z,
    };
    (increment, next)
}

#[cfg(test)]
mod tests;
