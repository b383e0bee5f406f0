//! Strapdown mechanisation in north-east-down on the WGS-84 ellipsoid (Savage 1998; Groves 2013,
//! ch. 5), f64.
//!
//! It works up to [`MAX_LATITUDE`]. Nearer to a pole it raises a flag ([`Sins::near_pole`]). Each
//! increment is one step. Coning and sculling use the increment before, or the two before
//! ([`Samples`]).

mod gather;
mod samples;

pub use gather::gather;
pub use samples::{Increment, Samples};

use crate::inertial::earth::{Geodetic, Local};
use crate::inertial::rotation::from_rotvec;
use nalgebra::{UnitQuaternion, Vector3};
use samples::in_start_axes;

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

/// Barometric damping of the vertical channel, which is unstable by itself. It is a second-order
/// loop with both poles at `1/time_s`.
#[derive(Debug, Clone, Copy)]
pub struct HeightLoop {
    /// Time constant in s.
    pub time_s: f64,
}

/// The navigator: its state, and what it keeps of the last increments.
#[derive(Debug, Clone)]
pub struct Sins {
    /// Present solution. Small corrections are allowed between increments. For another place make a
    /// new navigator.
    pub nav: NavState,
    pub(in crate::inertial) samples: Samples,
    pub(in crate::inertial) past: [Increment; 2],
    // half the change of velocity over the last increment
    pub(in crate::inertial) half_change: Vector3<f64>,
    // the Earth at the middle of the next increment
    pub(in crate::inertial) earth: Local,
    pub(in crate::inertial) polar: bool,
}

/// Latitude beyond which [`Sins::near_pole`] is raised: 89.99 deg, 1.1 km from a pole, in rad.
pub const MAX_LATITUDE: f64 = 1.570_621_793_869_697;

impl Sins {
    /// Starts from a known state.
    #[must_use]
    pub fn new(nav: NavState) -> Self {
        Self {
            nav,
            samples: Samples::default(),
            past: [Increment::default(); 2],
            half_change: Vector3::zeros(),
            earth: Local::at(nav.position.lat, nav.position.h),
            polar: outside(nav.position.lat),
        }
    }

    /// Selects another coning and sculling algorithm.
    #[must_use]
    pub fn with_samples(self, samples: Samples) -> Self {
        Self { samples, ..self }
    }

    /// A navigator of the same kind at another state.
    #[must_use]
    pub fn at(&self, nav: NavState) -> Self {
        Self::new(nav).with_samples(self.samples)
    }

    /// Advances by one increment of `dt` seconds.
    pub fn step(&mut self, increment: &Increment, dt: f64) {
        let NavState {
            position,
            velocity,
            q_bn,
        } = self.nav;
        // Earth and velocity at the middle of the increment. The Earth is computed one increment
        // ahead, for a place that is wrong by acceleration times dt^2, some micrometres to
        // millimetres. So the value is ready when needed, and its computation overlaps with the
        // rest of the step.
        let mid = self.earth;
        self.earth = Local::at(
            position.lat + 1.5 * dt * velocity.x * mid.lat_per_m,
            position.h - 1.5 * dt * velocity.z,
        );
        let v_mid = velocity + self.half_change;
        let omega_ie = mid.omega_ie();
        let omega_en = mid.omega_en(&v_mid);
        let zeta = (omega_ie + omega_en) * dt;

        let (phi, eta) = self.samples.combine(&self.past, increment);
        let dv_sf = in_start_axes(&phi, &eta);

        let dv_n = q_bn * dv_sf;
        let dv_n = dv_n - zeta.cross(&dv_n) * 0.5;
        let gravity_coriolis = mid.gravity() - (omega_ie * 2.0 + omega_en).cross(&v_mid);
        let change = dv_n + gravity_coriolis * dt;
        let v_new = velocity + change;
        let v_mean = velocity + change * 0.5;

        self.nav.position = Geodetic {
            lat: position.lat + v_mean.x * dt * mid.lat_per_m,
            lon: position.lon + v_mean.y * dt * mid.lon_per_m,
            h: position.h - v_mean.z * dt,
        };
        self.nav.velocity = v_new;
        let mut q = from_rotvec(&-zeta) * q_bn * from_rotvec(&phi);
        q.renormalize_fast();
        self.nav.q_bn = q;
        self.half_change = change * 0.5;
        self.polar |= outside(self.nav.position.lat);
        self.past = [*increment, self.past[0]];
    }

    /// True once the track has come closer to a pole than [`MAX_LATITUDE`]. North and east lose
    /// their meaning there. From then on the solution must not be used. It never panics but may
    /// become infinite or NaN.
    #[must_use]
    pub fn near_pole(&self) -> bool {
        self.polar
    }

    /// Corrects the height loop by a barometric height `baro_h` in m, `dt` seconds after the last
    /// correction.
    pub fn damp_height(&mut self, loop_: &HeightLoop, baro_h: f64, dt: f64) {
        let error = self.nav.position.h - baro_h;
        self.nav.position.h -= 2.0 / loop_.time_s * error * dt;
        self.nav.velocity.z += error * dt / (loop_.time_s * loop_.time_s);
    }
}

pub(in crate::inertial) fn outside(lat: f64) -> bool {
    lat.is_nan() || lat.abs() > MAX_LATITUDE
}
