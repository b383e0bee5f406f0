//! Strapdown mechanisation in north-east-down on the WGS-84 ellipsoid (Savage 1998; Groves 2013,
//! ch. 5), f64.
//!
//! It works up to [`MAX_LATITUDE`]. Nearer to a pole it raises a flag ([`Sins::near_pole`]). Each
//! increment is one step. Coning and sculling use the increment before, or the two before
//! ([`Samples`]).

mod gather;
mod samples;
mod strapdown;

pub use gather::gather;
pub use samples::{Increment, Samples};
pub(in crate::inertial) use strapdown::{States, Strapdown};

use crate::inertial::earth::{Geodetic, Local};
use nalgebra::{UnitQuaternion, Vector3};

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

/// The navigator: its state, and the last increments.
#[derive(Debug, Clone)]
pub struct Sins {
    /// Present solution. Small corrections are allowed between increments. For another position
    /// make a new navigator.
    pub nav: NavState,
    pub(in crate::inertial) samples: Samples,
    pub(in crate::inertial) previous: [Increment; 2],
    // half the change of velocity over the last increment
    half_change: Vector3<f64>,
    // the Earth at the middle of the next increment
    earth: Local,
    polar: bool,
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
            previous: [Increment::default(); 2],
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
        let previous = self.previous.map(|previous| previous.parts());
        let (phi, eta) = self.samples.combine(&previous, &increment.parts());
        let here: &Self = self;
        let mut one = Strapdown::<f64>::of((), |_| here);
        one.step(&phi, &eta, dt);
        one.give(0, self, [*increment, self.previous[0]]);
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
        let mut one = States::<f64>::of((), |_| &self.nav);
        one.damp_height(loop_, baro_h, dt);
        self.nav = one.state(0);
    }
}

fn outside(lat: f64) -> bool {
    lat.is_nan() || lat.abs() > MAX_LATITUDE
}
