//! The true drive: position, velocity and attitude as smooth functions of time. From them follow
//! the increments of a perfect IMU, which are the integrals of inertial rate and specific force by
//! three-point Gauss-Legendre quadrature over every sample period. Nothing here uses the equations
//! of a navigator. So a navigator can be tested with these increments.

mod aircraft;
mod attitude;
mod city;
mod course;
mod drive;
mod dual;
mod hand_held;
mod profile;
mod road;
mod ship;
mod standing;
mod traffic;
mod train;
mod vehicle;
mod vibration;
mod waves;

pub use aircraft::Aircraft;
pub use city::City;
pub use drive::random_drive;
pub use hand_held::HandHeld;
pub use profile::{Profile, Segment};
pub use ship::Ship;
pub use standing::Standing;
pub use traffic::Traffic;
pub use train::Train;
pub use vehicle::{Journey, Vehicle, VehicleName};
pub use vibration::Vibration;

use crate::inertial::earth::{Geodetic, Local};
use crate::inertial::sins::{Increment, NavState};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use road::Road;

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

/// A vehicle's motion as smooth functions of time. The times are visited in ascending order.
trait Motion {
    /// Duration, s.
    fn duration(&self) -> f64;

    /// Goes to the sample that starts at `t` s. `second`: a whole second, where rounding errors of
    /// what is carried from sample to sample end.
    fn begin(&mut self, t: f64, second: bool);

    /// Kinematics at `t` s within that sample. `node` is 0 at its start and 1 to 3 at the
    /// [`NODES`].
    fn at(&self, t: f64, node: usize) -> Instant;
}

/// Kinematics at one time.
struct Instant {
    q_bn: nalgebra::UnitQuaternion<f64>,
    /// Velocity over ground in NED, m/s, and its derivative, component by component, m/s2.
    v: Vector3<f64>,
    a: Vector3<f64>,
    /// Rate of the body against the navigation axes in body axes, rad/s.
    omega_nb: Vector3<f64>,
}

impl Instant {
    /// Makes it from velocity components in NED with their derivatives, and an attitude.
    fn of([north, east, down]: [dual::Dual; 3], attitude: &attitude::Turned) -> Self {
        Self {
            q_bn: attitude.q_bn,
            v: Vector3::new(north.value, east.value, down.value),
            a: Vector3::new(north.rate, east.rate, down.rate),
            omega_nb: attitude.omega,
        }
    }
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
    /// Computes the drive of a land vehicle, in about 1 us per sample.
    pub fn new(config: &DriveConfig<'_>, rng: &mut ChaCha8Rng) -> Self {
        let mut road = Road::new(config, rng);
        Self::of(&mut road, config.start, config.dt, 1)
    }

    /// Computes a motion from a start position. There are `epochs_per_s` epochs a second; a second
    /// divided by them is a whole number of samples.
    fn of(motion: &mut dyn Motion, start: Geodetic, dt: f64, epochs_per_s: u32) -> Self {
        let n = (motion.duration() / dt).round() as usize;
        let samples_per_s = (1.0 / dt).round() as usize;
        let samples_per_epoch = samples_per_s / epochs_per_s as usize;
        let mut increments = Vec::with_capacity(n);
        let mut epochs = Vec::with_capacity(n / samples_per_epoch + 2);
        let mut position = start;
        for k in 0..n {
            let t0 = k as f64 * dt;
            motion.begin(t0, k % samples_per_s == 0);
            if k % samples_per_epoch == 0 {
                epochs.push(state(&motion.at(t0, 0), position));
            }
            let nodes = [0, 1, 2].map(|i| motion.at(t0 + NODES[i] * dt, i + 1));
            let (increment, next) = integrate(&nodes, position, dt);
            increments.push(increment);
            position = next;
        }
        if n.is_multiple_of(samples_per_epoch) && n > 0 {
            let end = n as f64 * dt;
            motion.begin(end, true);
            epochs.push(state(&motion.at(end, 0), position));
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

/// Integrates rate, specific force and position over one sample period from its three nodes.
fn integrate(nodes: &[Instant; 3], position: Geodetic, dt: f64) -> (Increment, Geodetic) {
    // the Earth changes by 1e-9 within a sample period: one evaluation at its middle is enough
    let v_mid = nodes[1].v;
    let start = Local::at(position.lat, position.h);
    let mid = Local::at(
        position.lat + 0.5 * dt * v_mid.x * start.lat_per_m,
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
        lat: position.lat + moved.x * mid.lat_per_m,
        lon: position.lon + moved.y * mid.lon_per_m,
        h: position.h - moved.z,
    };
    (increment, next)
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod vehicle_tests;
#[cfg(test)]
mod walk_and_rail_tests;
