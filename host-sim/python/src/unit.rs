//! `Unit`: the unit file.

use crate::arrays::from_json;
use crate::errors::{raised, refused};
use host_core::error::Error;
use host_unit::{Finding, presets, schema};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};

/// A sensor and its surroundings: the unit file.
///
/// name: a preset, or a file (it ends in .toml or has a path separator).
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Unit {
    /// What is known of the sensor.
    pub unit: host_unit::Unit,
    /// Values that can be used but are implausible, one sentence each.
    #[pyo3(get)]
    warnings: Vec<String>,
}

/// A unit, or the name of a preset or of a file.
#[derive(FromPyObject)]
pub enum UnitOrName {
    /// Read already.
    Unit(Py<Unit>),
    /// A preset, or a file.
    Name(PathBuf),
}

impl UnitOrName {
    /// The unit.
    ///
    /// # Errors
    /// As those of [`host_unit::Unit::load`].
    pub fn unit(self) -> PyResult<host_unit::Unit> {
        match self {
            Self::Unit(unit) => Ok(unit.get().unit.clone()),
            Self::Name(name) => host_unit::Unit::load(&name.to_string_lossy()).map_err(raised),
        }
    }

    /// The name under which a scenario knows it.
    pub fn name(&self) -> String {
        match self {
            Self::Unit(unit) => unit.get().unit.name.clone(),
            Self::Name(name) => name.to_string_lossy().into_owned(),
        }
    }
}

impl From<host_unit::Unit> for Unit {
    fn from(unit: host_unit::Unit) -> Self {
        Self {
            unit,
            warnings: Vec::new(),
        }
    }
}

fn parsed(text: &str, file: &Path) -> PyResult<Unit> {
    let (unit, found) = host_unit::examine(text);
    let (doubts, wrong): (Vec<Finding>, _) = found.into_iter().partition(|f| f.doubt);
    let faults = |wrong: Vec<Finding>| wrong.into_iter().map(|f| f.error(file)).collect();
    let unit = unit.ok_or_else(|| raised(Error::Several(faults(wrong))))?;
    let warnings = doubts.into_iter().map(|f| f.error(file).to_string());
    Ok(Unit {
        unit,
        warnings: warnings.collect(),
    })
}

#[pymethods]
impl Unit {
    #[new]
    #[pyo3(signature = (name=PathBuf::from("medium")))]
    fn new(name: PathBuf) -> PyResult<Self> {
        let text = name.to_string_lossy();
        if name.extension().is_none_or(|end| end != "toml") && name.components().count() < 2 {
            return host_unit::Unit::load(&text).map(Self::from).map_err(raised);
        }
        let read = std::fs::read_to_string(&name);
        parsed(&read.map_err(|e| raised(Error::reading(&name, e)))?, &name)
    }

    /// The unit of a text in the form of a unit file. The error lists all that is wrong.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        parsed(text, Path::new("unit"))
    }

    /// Names of the presets.
    #[staticmethod]
    fn presets() -> Vec<&'static str> {
        presets::names()
    }

    /// Text of a preset, with its comments: where to start a file of one's own.
    #[staticmethod]
    fn preset_text(name: &str) -> PyResult<String> {
        let unknown = || raised(Error::unknown("unit", name, &presets::names()));
        presets::text(name).ok_or_else(unknown)
    }

    /// JSON Schema of the unit file.
    #[staticmethod]
    fn schema(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        from_json(py, &schema::text())
    }

    /// Name of the unit.
    #[getter]
    fn name(&self) -> &str {
        &self.unit.name
    }

    /// Text of a unit file.
    fn to_text(&self) -> PyResult<String> {
        self.unit.to_text("Written by lrnn_imu").map_err(raised)
    }

    /// All values, by the keys of the unit file.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.unit);
        let remedy = "report this fault of the package";
        from_json(
            py,
            &text.map_err(|e| refused("unit", e.to_string(), remedy))?,
        )
    }

    fn __repr__(&self) -> String {
        format!("Unit('{}')", self.unit.name)
    }
}
