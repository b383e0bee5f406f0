//! Options that several commands have, and how a bad value is refused.

use crate::error::Error;
use crate::experiment::scenario::Scenario;
use crate::unit::Unit;
use clap::Args as ClapArgs;

/// `--scenario`.
#[derive(Debug, ClapArgs)]
pub(super) struct ScenarioOption {
    /// Built-in scenario (medium, nav, tactical, fog, mems) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    pub(super) scenario: String,
    #[command(flatten)]
    pub(super) unit: UnitOption,
}

impl ScenarioOption {
    pub(super) fn load(&self) -> Result<Scenario, Error> {
        let mut scenario = Scenario::load(&self.scenario)?;
        if let Some(name) = &self.unit.unit {
            scenario.set_unit(name, Unit::load(name)?);
        }
        Ok(scenario)
    }

    /// As it would be typed.
    pub(super) fn typed(&self) -> String {
        let unit = self.unit.unit.as_ref();
        let unit = unit.map_or(String::new(), |name| format!(" --unit {name}"));
        format!("--scenario {}{unit}", self.scenario)
    }
}

/// `--scenario` and `--seed`: what determines a simulation completely.
#[derive(Debug, ClapArgs)]
pub(super) struct Simulation {
    #[command(flatten)]
    pub(super) scenario: ScenarioOption,
    /// Seed of everything random: sensor errors of the unit and of each turn-on, roads, noise
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
}

/// `--unit`, and the word that it had before.
#[derive(Debug, ClapArgs)]
pub(super) struct UnitOption {
    /// Unit: a preset's name (`host-sim unit list`) or a unit file
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub(super) unit: Option<String>,
    /// Refused
    #[arg(long, hide = true, value_parser = renamed("give --unit NAME or --unit FILE.toml"))]
    preset: Option<String>,
}

impl UnitOption {
    /// The unit that was given.
    pub(super) fn load(&self) -> Result<Option<Unit>, Error> {
        self.unit.as_deref().map(Unit::load).transpose()
    }

    /// The unit that was given, or the preset `usual`.
    pub(super) fn load_or(&self, usual: &str) -> Result<Unit, Error> {
        Unit::load(self.unit.as_deref().unwrap_or(usual))
    }
}

/// Refuses an option that is no more, and says what took its place.
pub(super) fn renamed(
    instead: impl Into<String>,
) -> impl Fn(&str) -> Result<String, String> + Clone + Send + Sync + 'static {
    let instead = instead.into();
    move |_| Err(format!("this option is no more; {instead}"))
}

/// A bad value of an option.
pub(super) fn refused(
    option: impl Into<String>,
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> Error {
    Error::Option {
        option: option.into(),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// `value` if it is from `low` to `high`.
pub(super) fn within(option: &str, value: f64, [low, high]: [f64; 2]) -> Result<f64, Error> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    let remedy = format!("give a number from {low} to {high}");
    Err(refused(option, format!("is {value}"), remedy))
}

/// `value` if it is a number above zero.
pub(super) fn positive(option: &str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(refused(
        option,
        format!("is {value}"),
        "give a number above 0",
    ))
}

/// The arguments of this command, as they were typed.
pub(super) fn arguments() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    arguments.join(" ")
}

/// As many threads as `--jobs` tells, by default one for each core.
pub(super) fn pool(jobs: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs.map_or(0, |jobs| jobs.max(1)))
        .build()
        .map_err(|e| refused("--jobs", e.to_string(), "give fewer"))
}

/// Which part of the runs: I/N, or /N where the environment of a cluster tells I.
pub(super) fn shard(text: Option<&str>) -> Result<(u32, u32), Error> {
    let Some(text) = text else {
        return Ok((0, 1));
    };
    let wrong = || {
        refused(
            "--shard",
            format!("'{text}'"),
            "give I/N with I from 0 to N-1, or /N under SLURM or Kubernetes",
        )
    };
    let (i, n) = text.split_once('/').ok_or_else(wrong)?;
    let from_environment = || {
        ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"]
            .iter()
            .find_map(|v| std::env::var(v).ok())
    };
    let i = if i.is_empty() {
        from_environment().ok_or_else(wrong)?
    } else {
        i.to_string()
    };
    match (i.parse(), n.parse()) {
        (Ok(i), Ok(n)) if i < n => Ok((i, n)),
        _ => Err(wrong()),
    }
}
