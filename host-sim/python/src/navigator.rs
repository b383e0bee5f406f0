//! `Navigator`: the strapdown navigator, alignment, and free-inertial navigation of a session.

use crate::arrays::{few, given, table, triples};
use crate::errors::refused;
use crate::long::{PIECE, interruptible};
use crate::session::{Session, no_attitude};
use host_core::inertial::align::inertial_frame;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::free_inertial::{FreeInertial, aligned_free_inertial};
use host_core::inertial::sins::{HeightLoop, Increment, NavState, Samples, Sins};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// A strapdown navigator on the WGS-84 ellipsoid, in double precision.
///
/// position: latitude, longitude, height: rad, rad, m. velocity: (3,), m/s, north-east-down.
/// q_bn: quaternion w, x, y, z from body to navigation axes.
/// samples: 1, 2 or 3 increments for coning and sculling.
#[pyclass(module = "lrnn_imu")]
pub struct Navigator {
    sins: Sins,
}

/// Names of the coning and sculling algorithms.
const SAMPLES: [Samples; 3] = [Samples::One, Samples::Two, Samples::Three];

pub fn geodetic(value: &Bound<'_, PyAny>) -> PyResult<Geodetic> {
    let [lat, lon, h] = few("position", value)?;
    if !(lat.abs() <= FRAC_PI_2 && lon.is_finite() && h.is_finite()) {
        let problem = format!("is ({lat}, {lon}, {h})");
        let remedy = "give latitude and longitude in rad, and height in m";
        return Err(refused("position", problem, remedy));
    }
    Ok(Geodetic { lat, lon, h })
}

/// A quaternion w, x, y, z.
pub fn attitude(value: &Bound<'_, PyAny>) -> PyResult<UnitQuaternion<f64>> {
    let [w, x, y, z] = few("q_bn", value)?;
    let q = Quaternion::new(w, x, y, z);
    if !(1.0 - 1e-6..1.0 + 1e-6).contains(&q.norm()) {
        let problem = format!("has norm {}", q.norm());
        return Err(refused(
            "q_bn",
            problem,
            "give a unit quaternion w, x, y, z",
        ));
    }
    Ok(UnitQuaternion::new_unchecked(q))
}

/// w, x, y, z.
pub fn quaternion(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

pub fn increments(dtheta: &[[f64; 3]], dv: &[[f64; 3]]) -> Vec<Increment> {
    let pairs = dtheta.iter().zip(dv);
    pairs.map(|(a, b)| increment(a, b)).collect()
}

fn increment(dtheta: &[f64; 3], dv: &[f64; 3]) -> Increment {
    Increment {
        dtheta: Vector3::from(*dtheta),
        dv: Vector3::from(*dv),
    }
}

pub fn positive(name: &str, value: f64) -> PyResult<f64> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(refused(
        name,
        format!("is {value}"),
        "give a number of seconds above 0",
    ))
}

pub fn samples(number: usize) -> PyResult<Samples> {
    let known = number.checked_sub(1).and_then(|k| SAMPLES.get(k));
    known
        .copied()
        .ok_or_else(|| refused("samples", format!("is {number}"), "give 1, 2 or 3"))
}

/// Errors of positions and velocities.
pub type Errors<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>);

/// Positions, velocities and attitudes.
type Solution<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

#[pymethods]
impl Navigator {
    #[new]
    #[pyo3(signature = (position, velocity, q_bn, *, samples=3))]
    fn new(
        position: &Bound<'_, PyAny>,
        velocity: &Bound<'_, PyAny>,
        q_bn: &Bound<'_, PyAny>,
        samples: usize,
    ) -> PyResult<Self> {
        let nav = NavState {
            position: geodetic(position)?,
            velocity: few::<3>("velocity", velocity)?.into(),
            q_bn: attitude(q_bn)?,
        };
        let sins = Sins::new(nav).with_samples(self::samples(samples)?);
        Ok(Self { sins })
    }

    /// Navigates over increments, (n, 3) each, rad and m/s, of dt seconds.
    ///
    /// Gives positions, (k, 3), velocities, (k, 3), and attitudes, (k, 4), after each
    /// `every` samples. The next call goes on where this one ended.
    #[pyo3(signature = (dtheta, dv, dt, *, every=1))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        dtheta: &Bound<'py, PyAny>,
        dv: &Bound<'py, PyAny>,
        dt: f64,
        every: usize,
    ) -> PyResult<Solution<'py>> {
        let dt = positive("dt", dt)?;
        if every == 0 {
            return Err(refused("every", "is 0", "give 1 or more samples"));
        }
        let (dtheta, dv) = (given::<f64>("dtheta", dtheta)?, given::<f64>("dv", dv)?);
        let dv = dv.rows_like::<3, _>(&dtheta)?;
        let dtheta = dtheta.rows::<3>()?;
        let room = dtheta.len() / every;
        let (mut p, mut v) = (Vec::with_capacity(room), Vec::with_capacity(room));
        let mut q = Vec::with_capacity(room);
        let sins = &mut self.sins;
        let mut done = 0;
        for (dtheta, dv) in dtheta.chunks(PIECE).zip(dv.chunks(PIECE)) {
            py.detach(|| {
                for (dtheta, dv) in dtheta.iter().zip(dv) {
                    sins.step(&increment(dtheta, dv), dt);
                    done += 1;
                    if done % every == 0 {
                        let nav = &sins.nav;
                        p.push([nav.position.lat, nav.position.lon, nav.position.h]);
                        v.push(nav.velocity.into());
                        q.push(quaternion(&nav.q_bn));
                    }
                }
            });
            py.check_signals()?;
        }
        Ok((table(py, p)?, table(py, v)?, table(py, q)?))
    }

    /// Damps the vertical channel by a barometric height, m, dt seconds after the last one.
    #[pyo3(signature = (height, dt=1.0, *, time_s=30.0))]
    fn damp_height(&mut self, height: f64, dt: f64, time_s: f64) -> PyResult<()> {
        let time_s = positive("time_s", time_s)?;
        self.sins
            .damp_height(&HeightLoop { time_s }, height, positive("dt", dt)?);
        Ok(())
    }

    /// Latitude, longitude, height: rad, rad, m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let Geodetic { lat, lon, h } = self.sins.nav.position;
        PyArray1::from_slice(py, &[lat, lon, h])
    }

    /// Velocity, (3,), m/s, north-east-down.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.sins.nav.velocity.as_slice())
    }

    /// Attitude: quaternion w, x, y, z from body to navigation axes.
    #[getter]
    fn q_bn<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &quaternion(&self.sins.nav.q_bn))
    }

    /// Whether it has come too near to a pole; then its solution must not be used.
    #[getter]
    fn near_pole(&self) -> bool {
        self.sins.near_pole()
    }

    fn __repr__(&self) -> String {
        let NavState {
            position, velocity, ..
        } = &self.sins.nav;
        let Geodetic { lat, lon, h } = position;
        let v = velocity.as_slice();
        format!("Navigator(position=[{lat}, {lon}, {h}], velocity={v:?})")
    }
}

/// Attitude at the end of a standstill: quaternion w, x, y, z from body to navigation axes.
///
/// dtheta, dv: (n, 3), rad and m/s, of dt seconds each. position: rad, rad, m.
#[pyfunction]
#[pyo3(signature = (dtheta, dv, dt, position, *, samples=3))]
pub fn align<'py>(
    py: Python<'py>,
    dtheta: &Bound<'py, PyAny>,
    dv: &Bound<'py, PyAny>,
    dt: f64,
    position: &Bound<'py, PyAny>,
    samples: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (dt, position, samples) = (
        positive("dt", dt)?,
        geodetic(position)?,
        self::samples(samples)?,
    );
    let (dtheta, dv) = (given::<f64>("dtheta", dtheta)?, given::<f64>("dv", dv)?);
    let all = increments(dtheta.rows()?, dv.rows_like(&dtheta)?);
    let found = py.detach(|| inertial_frame(&all, dt, samples, position));
    let found = found.ok_or_else(|| {
        let remedy = "give at least 90 s at rest with live gyros and accelerometers";
        refused("dtheta, dv", "give no attitude", remedy)
    })?;
    Ok(PyArray1::from_slice(py, &quaternion(&found)))
}

/// Self-alignment on the standstill, then navigation without fixes to the end.
///
/// dtheta, dv: corrected samples, (n, 3); by default those of the session.
/// Gives the errors of position, m, and velocity, m/s, north-east-down, (k, 3) each, one a
/// second from the end of the standstill on.
#[pyfunction]
#[pyo3(signature = (session, dtheta=None, dv=None))]
pub fn free_inertial<'py>(
    py: Python<'py>,
    session: &Session,
    dtheta: Option<&Bound<'py, PyAny>>,
    dv: Option<&Bound<'py, PyAny>>,
) -> PyResult<Errors<'py>> {
    let (own, of) = (session.session.clone(), &session.session);
    let all = match (dtheta, dv) {
        (None, None) => of.increments(),
        (Some(dtheta), Some(dv)) => {
            let (dtheta, dv) = (given::<f64>("dtheta", dtheta)?, given::<f64>("dv", dv)?);
            let all = increments(dtheta.rows()?, dv.rows_like(&dtheta)?);
            let wanted = of.epochs() * of.steps_per_epoch();
            if all.len() < wanted {
                let problem = format!("has {} rows, and the session {wanted}", all.len());
                return Err(refused(
                    "dtheta",
                    problem,
                    "give the samples of the whole session",
                ));
            }
            all
        }
        _ => {
            return Err(refused(
                "dtheta, dv",
                "only one is given",
                "give both or none",
            ));
        }
    };
    let found = interruptible(py, move || aligned_free_inertial(&own, &all))?;
    errors(py, &found.ok_or_else(no_attitude)?)
}

/// Errors of a run without fixes, as arrays.
pub fn errors<'py>(py: Python<'py>, found: &FreeInertial) -> PyResult<Errors<'py>> {
    let (p, v) = (
        triples(found.position.iter()),
        triples(found.velocity.iter()),
    );
    Ok((table(py, p)?, table(py, v)?))
}

/// Metres north, east, down of positions, (n, 3), from an origin, (3,), or from (n, 3).
#[pyfunction]
pub fn ned<'py>(
    py: Python<'py>,
    position: &Bound<'py, PyAny>,
    origin: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let of = |[lat, lon, h]: [f64; 3]| Geodetic { lat, lon, h };
    let position = given::<f64>("position", position)?;
    let rows = position.rows::<3>()?;
    let out = match few::<3>("origin", origin) {
        Ok(one) => {
            let origin = of(one);
            rows.iter()
                .map(|p| of(*p).ned_from(&origin).into())
                .collect()
        }
        Err(_) => {
            let origin = given::<f64>("origin", origin)?;
            let pairs = rows.iter().zip(origin.rows_like::<3, _>(&position)?);
            pairs
                .map(|(p, o)| of(*p).ned_from(&of(*o)).into())
                .collect()
        }
    };
    table(py, out)
}
