//! Options that several commands have, and how a bad value is refused.

use crate::error::Error;
use crate::experiment::scenario::Scenario;
use crate::simulator::imu::{ImuSpec, PRESETS};
use clap::Args as ClapArgs;

/// `--scenario`.
#[derive(Debug, ClapArgs)]
pub(super) struct ScenarioOption {
    /// Built-in scenario (medium, nav, tactical) or a TOML file
    #[arg(long, default_value = "medium", value_name = "NAME|FILE.toml")]
    pub(super) scenario: String,
}

impl ScenarioOption {
    pub(super) fn load(&self) -> Result<Scenario, Error> {
        Scenario::load(&self.scenario)
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

/// The IMU of a `--preset`.
pub(super) fn preset(name: &str) -> Result<ImuSpec, Error> {
    let names = PRESETS.map(|(name, _)| name);
    ImuSpec::preset(name).ok_or_else(|| Error::unknown("preset", name, &names))
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
