//! `allan`: Allan deviation with intervals and fitted terms.

use crate::arrays::{array, given, named};
use crate::errors::{raised, refused};
use crate::long::interruptible;
use host_estimation::analysis::allan::columns::{Choice, load};
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::allan::{Analysis, Deviation, Kind, Series, analyse};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;

/// Allan deviation of one axis, with intervals of 95 % and fitted noises (IEEE 952).
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Allan(Analysis);

/// Names of the kinds of sensor.
const KINDS: [(&str, Kind); 2] = [("gyro", Kind::Gyro), ("accel", Kind::Accel)];

impl Allan {
    fn curve<'py>(
        &self,
        py: Python<'py>,
        pick: impl Fn(&Deviation) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.curve.iter().map(pick).collect())
    }
}

#[pymethods]
impl Allan {
    /// Name of the axis.
    #[getter]
    fn name(&self) -> &str {
        &self.0.column
    }

    /// Unit of the deviations: deg/h or ug.
    #[getter]
    fn unit(&self) -> &'static str {
        self.0.unit
    }

    /// Samples per second.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.0.rate_hz
    }

    /// Length, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.0.duration_s
    }

    /// How far the curve departs from the sum of the noises; 0.1 is 10 %.
    #[getter]
    fn misfit(&self) -> f64 {
        self.0.misfit
    }

    /// Number of single samples far from their neighbours; up to one in a thousand are left out.
    #[getter]
    fn outliers(&self) -> usize {
        self.0.outliers.map_or(0, |outliers| outliers.count)
    }

    /// Shortest averaging time that is fitted, s.
    #[getter]
    fn fitted_from_s(&self) -> f64 {
        self.0.fitted_from_s
    }

    /// Averaging times, (k,), s.
    #[getter]
    fn tau<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.tau_s)
    }

    /// Allan deviations, (k,).
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.deviation)
    }

    /// Lower ends of their intervals, (k,).
    #[getter]
    fn low<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.low)
    }

    /// Upper ends of their intervals, (k,).
    #[getter]
    fn high<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.high)
    }

    /// Equivalent degrees of freedom, (k,).
    #[getter]
    fn edf<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.edf)
    }

    /// Allan deviations of the sum of the fitted noises, (k,).
    #[getter]
    fn fitted<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.curve(py, |d| d.fitted)
    }

    /// Q, N, B, K, R: name, unit, value, low, high, seen (the interval excludes 0).
    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for of in &self.0.coefficients {
            let one = PyDict::new(py);
            one.set_item("name", of.name)?;
            one.set_item("unit", of.unit)?;
            one.set_item("value", of.value)?;
            one.set_item("low", of.low)?;
            one.set_item("high", of.high)?;
            one.set_item("seen", of.is_seen())?;
            out.set_item(of.symbol, one)?;
        }
        Ok(out)
    }

    fn __repr__(&self) -> String {
        let Analysis {
            column,
            duration_s,
            misfit,
            ..
        } = &self.0;
        format!("Allan('{column}', {duration_s} s, misfit={misfit:.3})")
    }
}

/// Allan deviation of one axis at rest.
///
/// increments: (n,), rad (kind "gyro") or m/s (kind "accel") per sample.
#[pyfunction]
#[pyo3(signature = (increments, rate_hz, *, kind, name="axis"))]
pub fn allan(
    py: Python<'_>,
    increments: &Bound<'_, PyAny>,
    rate_hz: f64,
    kind: &str,
    name: &str,
) -> PyResult<Allan> {
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(refused(
            "rate_hz",
            format!("is {rate_hz}"),
            "give samples per second, above 0",
        ));
    }
    let increments = given::<f64>("increments", increments)?;
    let all = increments.flat()?;
    if let Some(k) = all.iter().position(|x| !x.is_finite()) {
        return Err(refused(
            "increments",
            format!("number {k} is {}", all[k]),
            "leave it out",
        ));
    }
    if all.len() < LEAST {
        let problem = format!("are {} samples", all.len());
        return Err(refused(
            "increments",
            problem,
            format!("give at least {LEAST} at rest"),
        ));
    }
    let series = Series {
        column: name.to_owned(),
        kind: named("kind", kind, &KINDS)?,
        rate_hz,
        increments: all.to_vec(),
    };
    let found = interruptible(py, move || analyse(series))?;
    found.map(Allan).ok_or_else(|| {
        let remedy = "check that they are sensor output and not a constant";
        refused("increments", "hardly ever change", remedy)
    })
}

/// Fewest samples that have an Allan deviation, as for files.
const LEAST: usize = 100;

/// Allan deviations of the columns of a CSV file, plain or gzipped, as `host-sim allan`.
#[pyfunction]
#[pyo3(signature = (file, *, columns=Vec::new(), rate_hz=None))]
pub fn allan_file<'py>(
    py: Python<'py>,
    file: PathBuf,
    columns: Vec<String>,
    rate_hz: Option<f64>,
) -> PyResult<Bound<'py, PyList>> {
    if rate_hz.is_some_and(|rate| !(rate.is_finite() && rate > 0.0)) {
        return Err(refused(
            "rate_hz",
            "is not a number above 0",
            "give samples per second",
        ));
    }
    let found = interruptible(py, move || {
        // a line that is cut is left out; an array has its length
        let choice = Choice {
            columns,
            rate_hz,
            skip_lines: None,
        };
        let columns = load(&file, &choice, &mut Vec::new())?;
        Findings::of(file.display().to_string(), columns, None)
    })?;
    let all = found.map_err(raised)?.analyses.into_iter().map(Allan);
    let all: PyResult<Vec<Bound<'py, Allan>>> = all.map(|one| Bound::new(py, one)).collect();
    PyList::new(py, all?)
}
