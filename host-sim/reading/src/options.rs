//! Options of several commands, and the errors of bad values.

use clap::Args as ClapArgs;
use host_core::error::Error;
use host_unit::Unit;

/// `--unit`.
#[derive(Debug, ClapArgs)]
pub struct UnitOption {
    /// Unit: a preset's name (`host-sim unit list`) or a unit file
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub unit: Option<String>,
}

impl UnitOption {
    /// The unit that was given.
    ///
    /// # Errors
    /// There is no such unit, or its file is wrong.
    pub fn load(&self) -> Result<Option<Unit>, Error> {
        self.unit.as_deref().map(Unit::load).transpose()
    }

    /// The unit that was given, or the preset `usual`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_or(&self, usual: &str) -> Result<Unit, Error> {
        Unit::load(self.unit.as_deref().unwrap_or(usual))
    }
}

/// A bad value of an option.
pub fn refused(
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
///
/// # Errors
/// It is not.
pub fn within(option: &str, value: f64, [low, high]: [f64; 2]) -> Result<f64, Error> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    let remedy = format!("give a number from {low} to {high}");
    Err(refused(option, format!("is {value}"), remedy))
}

/// `value` if it is a number above zero.
///
/// # Errors
/// It is not.
pub fn positive(option: &str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(refused(
        option,
        format!("is {value}"),
        "give a number above 0",
    ))
}
