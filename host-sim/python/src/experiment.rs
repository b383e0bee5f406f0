//! `Scenario`, `simulate` and `run_experiment`: the paper's experiment.

use crate::arrays::{from_json, no_row, to_json};
use crate::errors::{raised, refused};
use crate::long::interruptible;
use crate::replay::curves;
use crate::session::Session;
use crate::unit::{Unit, UnitOrName};
use host_lab::experiment::results::Report;
use host_lab::experiment::run::{Options, run, sessions};
use host_report::{json, verdict};
use host_unit::scenario;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};

/// A simulated scenario: a built-in one or a file.
///
/// changes: keys and values of a scenario file, as in
/// Scenario("mems", network={"rule": "guarded"}, learn={"drive_s": 900}).
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Scenario {
    /// Read and checked.
    pub scenario: scenario::Scenario,
}

/// A scenario, or the name of a built-in one or of a file.
#[derive(FromPyObject)]
pub enum ScenarioOrName {
    Scenario(Py<Scenario>),
    Name(PathBuf),
}

impl ScenarioOrName {
    fn scenario(self) -> PyResult<scenario::Scenario> {
        match self {
            Self::Scenario(scenario) => Ok(scenario.get().scenario.clone()),
            Self::Name(name) => scenario::Scenario::load(&name.to_string_lossy()).map_err(raised),
        }
    }
}

/// The scenario with another unit, if one is given.
fn with_unit(scenario: ScenarioOrName, unit: Option<UnitOrName>) -> PyResult<scenario::Scenario> {
    let mut scenario = scenario.scenario()?;
    if let Some(unit) = unit {
        let name = unit.name();
        scenario.set_unit(&name, unit.unit()?);
    }
    Ok(scenario)
}

#[pymethods]
impl Scenario {
    #[new]
    #[pyo3(signature = (name="medium", **changes))]
    fn new(name: &str, changes: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let Some(changes) = changes else {
            let scenario = scenario::Scenario::load(name).map_err(raised)?;
            return Ok(Self { scenario });
        };
        if !scenario::names().contains(&name) {
            let remedy = "change a built-in one, or write the changes into the file";
            return Err(refused(
                "name",
                format!("'{name}' cannot be changed"),
                remedy,
            ));
        }
        let bad = |e: &dyn std::fmt::Display| {
            refused(
                "changes",
                e.to_string(),
                "give keys and values of a scenario file",
            )
        };
        let text = to_json(changes.as_any())?;
        let mut table: toml::Table = serde_json::from_str(&text).map_err(|e| bad(&e))?;
        table.entry("unit").or_insert_with(|| name.into());
        table.entry("name").or_insert_with(|| name.into());
        Self::parse(&toml::to_string(&table).map_err(|e| bad(&e))?)
    }

    /// The scenario of a text in the form of a scenario file.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        let scenario = scenario::Scenario::parse(Path::new("scenario"), text);
        let scenario = scenario.map_err(raised)?;
        Ok(Self { scenario })
    }

    /// Names of the built-in scenarios.
    #[staticmethod]
    fn names() -> Vec<&'static str> {
        scenario::names()
    }

    /// Name of the scenario.
    #[getter]
    fn name(&self) -> &str {
        &self.scenario.name
    }

    /// The unit that is simulated.
    #[getter]
    fn unit(&self) -> Unit {
        self.scenario.unit().clone().into()
    }

    /// How the networks are taught.
    #[getter]
    fn network<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.scenario.network);
        from_json(py, &text.unwrap_or_default())
    }

    fn __repr__(&self) -> String {
        let scenario::Scenario {
            name, unit_name, ..
        } = &self.scenario;
        format!("Scenario(name='{name}', unit='{unit_name}')")
    }
}

/// A simulated drive, as `host-sim simulate` makes it.
///
/// vehicle: road, city, traffic, train, ship, aircraft, hand-held or standing.
/// learning: the drive to learn from instead of the one to judge on.
#[pyfunction]
#[pyo3(signature = (
    scenario=ScenarioOrName::Name("medium".into()), seed=1, *, unit=None, vehicle=None,
    learning=false
))]
pub fn simulate(
    py: Python<'_>,
    scenario: ScenarioOrName,
    seed: i128,
    unit: Option<UnitOrName>,
    vehicle: Option<&str>,
    learning: bool,
) -> PyResult<Session> {
    let seed = seed_of(seed)?;
    let mut scenario = with_unit(scenario, unit)?;
    if let Some(name) = vehicle {
        scenario.set_vehicle(name).map_err(raised)?;
    }
    let unit = scenario.unit().clone();
    let simulated = move || sessions(&scenario, seed).simulate_with_fixes(learning);
    let (session, fixes) = interruptible(py, simulated)?;
    Ok(Session {
        session,
        fixes,
        unit,
    })
}

/// The results of a run of the paper's experiment.
#[pyclass(module = "lrnn_imu", frozen)]
pub struct Experiment(Report);

#[pymethods]
impl Experiment {
    /// The results as `host-sim run --json` writes them.
    #[getter]
    fn json(&self) -> PyResult<String> {
        json::json(&self.0.results).map_err(raised)
    }

    /// Rows of the table: t_s, scheme, errors in m and m/s.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.json()?)?.get_item("rows")
    }

    /// Names of the schemes.
    #[getter]
    fn schemes(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for row in &self.0.results.rows {
            if !names.contains(&row.scheme) {
                names.push(row.scheme.clone());
            }
        }
        names
    }

    /// Horizontal error of a scheme, m, after 5, 10, 15, 20 or 22 minutes without fixes.
    fn horizontal(&self, scheme: &str, minutes: u32) -> PyResult<f64> {
        let rows = &self.0.results.rows;
        let row = rows
            .iter()
            .find(|r| r.scheme == scheme && r.t_s == 60 * minutes);
        row.map(|row| row.horizontal_m).ok_or_else(|| {
            let mut times: Vec<u32> = rows.iter().map(|row| row.t_s / 60).collect();
            times.dedup();
            no_row(
                &format!("'{scheme}' after {minutes} min"),
                &self.schemes(),
                &times,
                "min",
            )
        })
    }

    /// Conclusions from the table, in sentences; harm included.
    #[getter]
    fn verdict(&self) -> Vec<String> {
        verdict::of_results(&self.0.results)
    }

    /// Notes for the reader, in sentences.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    /// Description of the run, as pairs of a label and a value.
    #[getter]
    fn set_up(&self) -> Vec<(String, String)> {
        self.0.set_up.clone()
    }

    /// Curves: track, error_over_time, learning (each by name x and y), and traces.
    fn curves<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        curves(py, &self.0.curves)
    }

    fn __repr__(&self) -> String {
        let results = &self.0.results;
        format!(
            "Experiment(scenario='{}', seed={})",
            results.scenario, results.seed
        )
    }
}

/// The paper's experiment: learn on one drive, navigate without fixes on another.
///
/// in_sample: judge on the drive that was learnt from, as the paper did.
#[pyfunction]
#[pyo3(signature = (
    scenario=ScenarioOrName::Name("medium".into()), seed=1, *, unit=None, in_sample=false
))]
pub fn run_experiment(
    py: Python<'_>,
    scenario: ScenarioOrName,
    seed: i128,
    unit: Option<UnitOrName>,
    in_sample: bool,
) -> PyResult<Experiment> {
    let seed = seed_of(seed)?;
    let scenario = with_unit(scenario, unit)?;
    let options = Options { seed, in_sample };
    let report = interruptible(py, move || run(&scenario, &options, &|_| {}))?;
    report.map(Experiment).map_err(raised)
}

/// A seed that Python gave.
fn seed_of(seed: i128) -> PyResult<u64> {
    let remedy = "give a whole number from 0 to 2**64 - 1";
    u64::try_from(seed).map_err(|_| refused("seed", format!("is {seed}"), remedy))
}
