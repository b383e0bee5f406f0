//! `Step`: the result of one step of a network.

use lrnn_nostd::Fault;
use numpy::PyArray1;
use pyo3::prelude::*;

/// The result of one step of a network.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Step(pub lrnn_nostd::Step);

#[pymethods]
impl Step {
    /// Output y_3 of the network, (3,), in network units.
    #[getter]
    fn output<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.0.output)
    }

    /// Estimated sensor error, (3,), in units of output_scale: corrected = measured - error.
    #[getter]
    fn error<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.0.error)
    }

    /// None, "non-finite input" or "overflow" (the last output is repeated), or "sensitivity
    /// overflow" (the step is good).
    #[getter]
    fn fault(&self) -> Option<&'static str> {
        self.0.fault.map(fault_name)
    }

    fn __repr__(&self) -> String {
        let lrnn_nostd::Step { output, error, .. } = self.0;
        let fault = self
            .0
            .fault
            .map_or("None".into(), |f| format!("{:?}", fault_name(f)));
        format!("Step(output={output:?}, error={error:?}, fault={fault})")
    }
}

fn fault_name(fault: Fault) -> &'static str {
    match fault {
        Fault::NonFiniteInput => "non-finite input",
        Fault::Overflow => "overflow",
        Fault::SensitivityOverflow => "sensitivity overflow",
    }
}
