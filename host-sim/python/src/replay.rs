//! `replay`: learning from one part of a recording, judging on another.

use crate::arrays::{array, from_json, no_row};
use crate::errors::{raised, refused};
use crate::long::interruptible;
use crate::recording::Recording;
use crate::unit::UnitOrName;
use host_core::inertial::units::DEG;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::{Curve, Curves};
use host_lab::experiment::user_recording::{self, Wanted};
use host_report::{json, verdict};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Result of a replay: learnt from one part of a recording, judged on another.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Replay(Outcome);

/// Curves by the name of their group.
pub fn curves<'py>(py: Python<'py>, all: &Curves) -> PyResult<Bound<'py, PyDict>> {
    let group = |curves: &[Curve]| {
        let out = PyDict::new(py);
        for curve in curves {
            out.set_item(
                &curve.name,
                (array(py, curve.x.clone()), array(py, curve.y.clone())),
            )?;
        }
        Ok::<_, PyErr>(out)
    };
    let traces = PyList::empty(py);
    for trace in &all.traces {
        let one = PyDict::new(py);
        one.set_item("axis", &trace.axis)?;
        one.set_item("unit", &trace.unit)?;
        one.set_item("minutes", array(py, trace.t_min.clone()))?;
        one.set_item("truth", array(py, trace.truth.clone()))?;
        one.set_item("teacher", array(py, trace.teacher.clone()))?;
        one.set_item("network", array(py, trace.network.clone()))?;
        traces.append(one)?;
    }
    let out = PyDict::new(py);
    out.set_item("track", group(&all.track)?)?;
    out.set_item("error_over_time", group(&all.error_over_time)?)?;
    out.set_item("learning", group(&all.learning)?)?;
    out.set_item("traces", traces)?;
    Ok(out)
}

#[pymethods]
impl Replay {
    /// The results as `host-sim replay --json` writes them.
    #[getter]
    fn json(&self) -> PyResult<String> {
        let text = serde_json::to_string_pretty(&json::outcomes(std::slice::from_ref(&self.0)));
        text.map_err(|e| refused("results", e.to_string(), "look for the first bad sample"))
    }

    /// Rows of the table: t_s, scheme, errors in m and m/s.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.json()?)?.get_item(0)?.get_item("rows")
    }

    /// The part that was learnt from and the part that was judged.
    #[getter]
    fn case(&self) -> &str {
        &self.0.case
    }

    /// Names of the schemes.
    #[getter]
    fn schemes(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for row in &self.0.rows {
            if !names.contains(&row.scheme) {
                names.push(row.scheme.clone());
            }
        }
        names
    }

    /// Horizontal error of a scheme, m, so many seconds into navigation without fixes.
    fn horizontal(&self, scheme: &str, seconds: u32) -> PyResult<f64> {
        self.0.horizontal(scheme, seconds).ok_or_else(|| {
            let mut times: Vec<u32> = self.0.rows.iter().map(|row| row.t_s).collect();
            times.dedup();
            no_row(
                &format!("'{scheme}' after {seconds} s"),
                &self.schemes(),
                &times,
                "s",
            )
        })
    }

    /// Conclusions from the table, in sentences; harm included.
    #[getter]
    fn verdict(&self) -> Vec<String> {
        verdict::of_outcome(&self.0)
    }

    /// Notes for the reader, in sentences.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// Contradictions between the samples and their description, with remedies.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.iter().map(ToString::to_string).collect()
    }

    /// Curves: track, error_over_time, learning (each by name x and y), and traces.
    fn curves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        curves(py, &self.0.curves)
    }

    fn __repr__(&self) -> String {
        format!("Replay('{}', {})", self.0.recording, self.0.case)
    }
}

/// Learns from the first part of a recording and judges all schemes on the rest.
///
/// unit: by default the one that the recording names, else "medium". learn_s: seconds to
/// learn from, standstill included. attitude_sigma_deg: of a given attitude, tilt and
/// heading; default (0.1, 0.5). own_start: navigation starts from each scheme's own aided
/// state, and not from one state for all.
#[pyfunction]
#[pyo3(signature = (
    recording, unit=None, *, learn_s=None, estimate_time_offset=false,
    attitude_sigma_deg=(0.1, 0.5), own_start=false
))]
pub fn replay(
    py: Python<'_>,
    recording: &Recording,
    unit: Option<UnitOrName>,
    learn_s: Option<usize>,
    estimate_time_offset: bool,
    attitude_sigma_deg: (f64, f64),
    own_start: bool,
) -> PyResult<Replay> {
    let given = unit.map(UnitOrName::unit).transpose()?;
    let attitude_sigma = [attitude_sigma_deg.0, attitude_sigma_deg.1];
    if attitude_sigma.iter().any(|s| !(*s > 0.0 && *s <= 90.0)) {
        let problem = format!("is {attitude_sigma:?}");
        let remedy = "give tilt and heading in degrees, above 0 and at most 90";
        return Err(refused("attitude_sigma_deg", problem, remedy));
    }
    let wanted = Wanted {
        form: recording.form,
        unit: given.or_else(|| recording.unit.clone()),
        learn_s,
        estimate_time_offset,
        attitude_sigma: attitude_sigma.map(|s| s * DEG),
        part: None,
        own_start,
        corrected_by: None,
        option: |name| name.replace('-', "_"),
    };
    let (mut record, says) = (recording.record.clone(), recording.says.clone());
    let of_unit = wanted.unit.as_ref().map(|unit| unit.receiver.lever_arm_m);
    record.lever_arm_m = record.lever_arm_m.or(of_unit);
    let done = interruptible(py, move || {
        user_recording::replay(record, &says, &wanted, &mut |_| Ok(()))
    })?;
    done.map(|done| Replay(done.outcome)).map_err(raised)
}
