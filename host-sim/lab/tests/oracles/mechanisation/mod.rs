//! The mechanisation compared with closed forms: Schuler oscillation, classical coning and
//! sculling, spinning bodies, fast and polar tracks.

mod coning;
mod schuler;
mod stress;

use host_core::inertial::earth::{Geodetic, Local};
use host_core::inertial::rotation::from_rotvec;
use host_core::inertial::sins::{HeightLoop, Increment, NavState, Samples, Sins};
use nalgebra::SVector;
use nalgebra::{UnitQuaternion, Vector3};

/// A quantity and its rate as functions of time in s.
type OfTime<T> = dyn Fn(f64) -> (T, Vector3<f64>);

/// Attitude and body rate relative to the ground, velocity and its derivative in NED, as analytic
/// functions of time in s.
struct Motion {
    attitude: Box<OfTime<UnitQuaternion<f64>>>,
    velocity: Box<OfTime<Vector3<f64>>>,
}

/// Runge-Kutta steps of the truth per sample.
const SUBSTEPS: usize = 4;

impl Motion {
    fn state(&self, t: f64, position: Geodetic) -> NavState {
        NavState {
            position,
            velocity: (self.velocity)(t).0,
            q_bn: (self.attitude)(t).0,
        }
    }

    /// Rates of latitude, longitude and height, and the inputs of a perfect IMU.
    fn rates(&self, t: f64, lat: f64, h: f64) -> SVector<f64, 9> {
        let (q_bn, omega_nb) = (self.attitude)(t);
        let (v, a) = (self.velocity)(t);
        let here = Local::at(lat, h);
        let (ie, en) = (here.omega_ie(), here.omega_en(&v));
        let f = a + (ie * 2.0 + en).cross(&v) - here.gravity();
        let mut rates = SVector::<f64, 9>::zeros();
        rates[0] = v.x / here.m_h;
        rates[1] = v.y / (here.n_h * here.cos_lat);
        rates[2] = -v.z;
        rates
            .fixed_rows_mut::<3>(3)
            .copy_from(&(omega_nb + q_bn.inverse_transform_vector(&(ie + en))));
        rates
            .fixed_rows_mut::<3>(6)
            .copy_from(&q_bn.inverse_transform_vector(&f));
        rates
    }

    /// The perfect increment from `t` to `t + dt`, and the position at its end.
    fn increment(&self, t: f64, dt: f64, start: Geodetic) -> (Increment, Geodetic) {
        let mut x = SVector::<f64, 9>::zeros();
        x[0] = start.lat;
        x[1] = start.lon;
        x[2] = start.h;
        let s = dt / SUBSTEPS as f64;
        for i in 0..SUBSTEPS {
            let at = t + i as f64 * s;
            let k1 = self.rates(at, x[0], x[2]);
            let m = x + k1 * (0.5 * s);
            let k2 = self.rates(at + 0.5 * s, m[0], m[2]);
            let m = x + k2 * (0.5 * s);
            let k3 = self.rates(at + 0.5 * s, m[0], m[2]);
            let m = x + k3 * s;
            let k4 = self.rates(at + s, m[0], m[2]);
            x += (k1 + (k2 + k3) * 2.0 + k4) * (s / 6.0);
        }
        let increment = Increment {
            dtheta: x.fixed_rows::<3>(3).into(),
            dv: x.fixed_rows::<3>(6).into(),
        };
        let position = Geodetic {
            lat: x[0],
            lon: x[1],
            h: x[2],
        };
        (increment, position)
    }

    /// Feeds a navigator with perfect increments of `dt` seconds for `seconds`. Gives its solution
    /// and the truth.
    fn run(
        &self,
        samples: Samples,
        start: Geodetic,
        dt: f64,
        seconds: f64,
    ) -> (NavState, NavState) {
        let mut position = start;
        let mut sins = Sins::new(self.state(0.0, start)).with_samples(samples);
        let n = (seconds / dt).round() as usize;
        for k in 0..n {
            let (increment, next) = self.increment(k as f64 * dt, dt, position);
            sins.step(&increment, dt);
            position = next;
        }
        (sins.nav, self.state(n as f64 * dt, position))
    }
}

/// Attitude error of `nav` as a rotation vector in the true body axes, rad.
fn attitude_error(nav: &NavState, truth: &NavState) -> Vector3<f64> {
    (truth.q_bn.inverse() * nav.q_bn).scaled_axis()
}
