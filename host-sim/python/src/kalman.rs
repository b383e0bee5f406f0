//! `Kalman`: the classical filter, a navigator aided by fixes that estimates the sensors' errors.

use crate::arrays::{array, few, given, named};
use crate::errors::refused;
use crate::long::{PIECE, interruptible};
use crate::navigator::{
    Errors, attitude, errors, geodetic, increments, positive, quaternion, samples,
};
use crate::session::{Session, no_attitude};
use crate::unit::UnitOrName;
use host_core::inertial::ekf::{Aided, ErrorModel, InitialSigma, NAV, Prior};
use host_core::inertial::free_inertial::from_filter;
use host_core::inertial::gnss::Fix;
use host_core::inertial::sins::NavState;
use host_estimation::learning::teacher::{Assumptions, aid, aligned};
use numpy::{PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

/// The classical filter: a navigator aided by fixes, which estimates errors of the sensors.
///
/// position, velocity, q_bn: as of Navigator. unit: what is assumed of the sensors. errors:
/// "none", "biases" (6), "scale" (12: with scale factors) or "matrices" (24: with
/// misalignments, too). sigma: of tilt and heading, rad, velocity, m/s, and position, m.
/// walk_per_hour: of the biases, as a share of their prior; default: what the unit says.
#[pyclass(module = "lrnn_imu")]
pub struct Kalman {
    filter: Aided,
    names: Vec<String>,
    /// Epoch of the session that it has reached: whole seconds since power-on.
    #[pyo3(get)]
    epoch: usize,
}

/// Makes a model of errors.
type Model = fn(&Prior) -> ErrorModel;
/// Names of the models.
const MODELS: [(&str, Model); 4] = [
    ("none", |_| ErrorModel::default()),
    ("biases", ErrorModel::biases),
    ("scale", ErrorModel::with_scale),
    ("matrices", ErrorModel::with_matrices),
];

/// Assumptions on a unit, with this random walk of its biases.
fn assumed(unit: &host_unit::Unit, walk: Option<f64>) -> PyResult<Assumptions> {
    let assumptions = Assumptions::of(unit);
    let walk = walk.unwrap_or(assumptions.datasheet_walk());
    if !(walk.is_finite() && walk >= 0.0) {
        let remedy = "give 0 or more, 1 for the size of the prior";
        return Err(refused("walk_per_hour", format!("is {walk}"), remedy));
    }
    Ok(assumptions.walking(walk))
}

/// Names of the parameters of a model, in its order.
fn names(model: &ErrorModel) -> Vec<String> {
    let axes = ["x", "y", "z"];
    let of = |(k, p): (usize, &host_core::inertial::ekf::Parameter)| {
        let triad = ["gyro", "accel"][p.triad.index()];
        let axis = axes[p.axis];
        match p.regressor {
            host_core::inertial::ekf::Regressor::One => format!("{triad} bias {axis}"),
            host_core::inertial::ekf::Regressor::Input(j) if j == p.axis => {
                format!("{triad} scale {axis}")
            }
            host_core::inertial::ekf::Regressor::Input(j) => {
                format!("{triad} misalignment {axis}{}", axes[j])
            }
            _ => format!("{triad} {axis}, parameter {k}"),
        }
    };
    model.parameters.iter().enumerate().map(of).collect()
}

#[pymethods]
impl Kalman {
    #[new]
    #[pyo3(signature = (
        position, velocity, q_bn, unit, *, errors="matrices", sigma, walk_per_hour=None, samples=3
    ))]
    fn new(
        position: &Bound<'_, PyAny>,
        velocity: &Bound<'_, PyAny>,
        q_bn: &Bound<'_, PyAny>,
        unit: UnitOrName,
        errors: &str,
        sigma: &Bound<'_, PyAny>,
        walk_per_hour: Option<f64>,
        samples: usize,
    ) -> PyResult<Self> {
        let nav = NavState {
            position: geodetic(position)?,
            velocity: few::<3>("velocity", velocity)?.into(),
            q_bn: attitude(q_bn)?,
        };
        let sigmas = few::<4>("sigma", sigma)?;
        if !sigmas.iter().all(|s| s.is_finite() && *s > 0.0) {
            let remedy = "give tilt and heading in rad, velocity in m/s, position in m, above 0";
            return Err(refused("sigma", format!("is {sigmas:?}"), remedy));
        }
        let [tilt, heading, velocity, position] = sigmas;
        let sigma = InitialSigma {
            tilt,
            heading,
            velocity,
            position,
        };
        let assumed = assumed(&unit.unit()?, walk_per_hour)?;
        let model = named("errors", errors, &MODELS)?(&assumed.prior);
        Ok(Self {
            names: names(&model),
            filter: Aided::new(nav, &sigma, model, assumed.noise)
                .with_samples(self::samples(samples)?),
            epoch: 0,
        })
    }

    /// A filter that has aligned itself on the standstill of a session, with the correlations
    /// between attitude and biases that this gives. `epoch` says where it stands then.
    #[staticmethod]
    #[pyo3(signature = (session, *, errors="matrices", unit=None, walk_per_hour=None))]
    fn aligned(
        py: Python<'_>,
        session: &Session,
        errors: &str,
        unit: Option<UnitOrName>,
        walk_per_hour: Option<f64>,
    ) -> PyResult<Self> {
        let unit = unit.map_or(Ok(session.unit.clone()), UnitOrName::unit)?;
        let assumed = assumed(&unit, walk_per_hour)?;
        let model = named("errors", errors, &MODELS)?(&assumed.prior);
        let own = session.session.clone();
        let start = interruptible(py, move || aligned(&own, &own.increments()))?;
        let start = start.ok_or_else(no_attitude)?;
        Ok(Self {
            names: names(&model),
            filter: start.filter(model, &assumed),
            epoch: start.first,
        })
    }

    /// Navigates over increments, (n, 3) each, rad and m/s, of dt seconds, less the errors that
    /// are estimated.
    fn run(
        &mut self,
        py: Python<'_>,
        dtheta: &Bound<'_, PyAny>,
        dv: &Bound<'_, PyAny>,
        dt: f64,
    ) -> PyResult<()> {
        let dt = positive("dt", dt)?;
        let (dtheta, dv) = (given::<f64>("dtheta", dtheta)?, given::<f64>("dv", dv)?);
        let all = increments(dtheta.rows::<3>()?, dv.rows_like::<3, _>(&dtheta)?);
        for piece in all.chunks(PIECE) {
            let filter = &mut self.filter;
            py.detach(|| piece.iter().for_each(|one| filter.step(one, dt)));
            py.check_signals()?;
        }
        Ok(())
    }

    /// Takes a fix that is valid now, at the IMU. position: rad, rad, m; velocity: (3,), m/s,
    /// north-east-down. sigma: (6,), of position, m, and velocity, m/s; inf: not measured.
    ///
    /// Gives the logarithm of the probability density of the fix, given all before it.
    fn fix(
        &mut self,
        position: &Bound<'_, PyAny>,
        velocity: &Bound<'_, PyAny>,
        sigma: &Bound<'_, PyAny>,
    ) -> PyResult<f64> {
        let sigmas = few::<6>("sigma", sigma)?;
        if !sigmas.iter().all(|s| *s > 0.0) {
            let remedy = "give m and m/s above 0, and inf for what is not measured";
            return Err(refused("sigma", format!("is {sigmas:?}"), remedy));
        }
        let velocity = few::<3>("velocity", velocity)?;
        if !velocity.iter().all(|v| v.is_finite()) {
            let remedy = "give 0, and inf as its sigma, where it is not measured";
            return Err(refused("velocity", format!("is {velocity:?}"), remedy));
        }
        let fix = Fix::new(geodetic(position)?, velocity.into(), sigmas);
        Ok(self.filter.take(Some(&fix)))
    }

    /// Goes on through the samples and fixes of a session up to an epoch; default: its end. While
    /// the vehicle is known to stand its velocity counts as measured. Gives the logarithm of the
    /// probability density of all these fixes, each before it was learnt from.
    #[pyo3(signature = (session, until=None))]
    fn aid(&mut self, py: Python<'_>, session: &Session, until: Option<usize>) -> PyResult<f64> {
        let until = until.unwrap_or(session.session.epochs());
        if !(self.epoch..=session.session.epochs()).contains(&until) {
            let (from, to) = (self.epoch, session.session.epochs());
            let remedy = format!("give {from} to {to}");
            return Err(refused("until", format!("is {until}"), remedy));
        }
        let (own, from, mut filter) = (session.session.clone(), self.epoch, self.filter.clone());
        let (filter, score) = interruptible(py, move || {
            let all = own.increments();
            let score = (from..until).map(|k| aid(&mut filter, &own, &all, k)).sum();
            (filter, score)
        })?;
        (self.filter, self.epoch) = (filter, until);
        Ok(score)
    }

    /// Navigates without fixes from here to the end of a session, less the errors as they are
    /// estimated now. This filter stays as it is.
    ///
    /// Gives the errors of position, m, and velocity, m/s, north-east-down, (k, 3) each, one a
    /// second from here on.
    fn free_inertial<'py>(&self, py: Python<'py>, session: &Session) -> PyResult<Errors<'py>> {
        let (own, from, filter) = (session.session.clone(), self.epoch, self.filter.clone());
        if from == 0 || from >= own.epochs() {
            let problem = format!("is {from}, of {} of the session", own.epochs());
            let remedy = "take it into the session first: Kalman.aligned, aid";
            return Err(refused("epoch", problem, remedy));
        }
        let found = interruptible(py, move || {
            from_filter(&filter, &own, &own.increments(), from)
        })?;
        self::errors(py, &found)
    }

    /// Names of the estimated errors.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Estimated errors of the sensors, (n,): biases in rad/s and m/s2, scale factors as
    /// fractions, misalignments in rad.
    #[getter]
    fn estimate<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.filter.theta.iter().copied().collect())
    }

    /// Their standard deviations, (n,).
    #[getter]
    fn sigma<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let of = |k: usize| self.filter.p[(NAV + k, NAV + k)].max(0.0).sqrt();
        array(py, (0..self.names.len()).map(of).collect())
    }

    /// Covariance of attitude, rad, velocity, m/s, position, m (north-east-down each), and the
    /// estimated errors, (9 + n, 9 + n).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let p = &self.filter.p;
        // row by row; nalgebra's order is column by column
        let all: Vec<f64> = p.transpose().iter().copied().collect();
        PyArray::from_vec(py, all).reshape([p.nrows(), p.ncols()])
    }

    /// Latitude, longitude, height: rad, rad, m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let at = self.filter.sins.nav.position;
        array(py, vec![at.lat, at.lon, at.h])
    }

    /// Velocity, (3,), m/s, north-east-down.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, self.filter.sins.nav.velocity.as_slice().to_vec())
    }

    /// Attitude: quaternion w, x, y, z from body to navigation axes.
    #[getter]
    fn q_bn<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        array(py, quaternion(&self.filter.sins.nav.q_bn).to_vec())
    }

    fn __repr__(&self) -> String {
        format!("Kalman({} errors, epoch {})", self.names.len(), self.epoch)
    }
}
