//! The error terms of a simulated IMU, in the units of datasheets: the table `[simulation]` of a
//! unit file. The terms of the two triads are in `datasheet`.
//!
//! An error whose key is not in the file is off: a missing number is zero. In names `p` stands for
//! `per`.

use super::datasheet::{AccelSpec, GyroSpec};
use super::nodes::NodesSpec;
use super::term::{At, Datasheet, Group, Range, check};
use super::thermometer::ThermometerSpec;
use super::world::World;
use crate::inertial::ekf::{Parameter, Triad};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Temperature of the sensor block; see [`super::thermal`]. Without this table in the file, the
/// block stays at its calibration temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BlockSpec {
    /// Difference of the ambient temperature at power-on from the calibration temperature: standard
    /// deviation over turn-ons, K.
    pub ambient_offset_k: f64,
    /// Rate of change of the ambient temperature: standard deviation over turn-ons, K/h.
    pub ambient_ramp_kph: f64,
    /// Final temperature of the block above the ambient by its own power, K; a plain value.
    pub self_heating_k: f64,
    /// Time constant of that rise, s, > 0; a plain value.
    pub heating_time_s: f64,
    /// Thickness of the block between the heated and the free face, mm; a plain value.
    pub thickness_mm: f64,
}

impl Default for BlockSpec {
    fn default() -> Self {
        Self {
            ambient_offset_k: 0.0,
            ambient_ramp_kph: 0.0,
            self_heating_k: 0.0,
            heating_time_s: 900.0,
            thickness_mm: 40.0,
        }
    }
}

/// An IMU as its datasheet describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImuSpec {
    /// Samples per second; a whole number.
    pub rate_hz: u32,
    /// Gyro triad.
    pub gyro: GyroSpec,
    /// Accelerometer triad.
    pub accel: AccelSpec,
    /// Temperature of the block.
    #[serde(default)]
    pub block: BlockSpec,
    /// Three nodes of temperature instead of the block's single one. Off without this table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nodes: Option<NodesSpec>,
    /// Thermometers. They act on no sample.
    #[serde(default, skip_serializing_if = "is_default")]
    pub thermometer: ThermometerSpec,
    /// Ambient and power-on, set by the scenario.
    #[serde(skip)]
    pub world: World,
}

fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

/// Names and unit files of the presets that have all error terms.
pub const PRESETS: [(&str, &str); 5] = [
    (
        "medium",
        include_str!("../../../../assets/units/medium.toml"),
    ),
    ("nav", include_str!("../../../../assets/units/nav.toml")),
    (
        "tactical",
        include_str!("../../../../assets/units/tactical.toml"),
    ),
    ("fog", include_str!("../../../../assets/units/fog.toml")),
    ("mems", include_str!("../../../../assets/units/mems.toml")),
];

impl ImuSpec {
    /// A preset by its name, if there is one.
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        let (_, text) = PRESETS.iter().find(|(n, _)| *n == name)?;
        let mut unit: toml::Table = toml::from_str(text).ok()?;
        unit.remove("simulation")?.try_into().ok()
    }

    /// Parameters of a filter that models the errors of an axis: exactly those errors that are
    /// present, with their statistics.
    #[must_use]
    pub fn parameters(&self, triad: Triad, axis: usize) -> Vec<Parameter> {
        let at = At { triad, axis };
        match triad {
            Triad::Gyro => self.gyro.parameters(at),
            Triad::Accel => self.accel.parameters(at),
        }
    }

    /// Standard deviation of the bias that a filter must expect if it does not model the causes:
    /// gyros in deg/h, accelerometers in ug.
    #[must_use]
    pub fn expected_bias(&self) -> [f64; 2] {
        let (gyro, accel) = (&self.gyro, &self.accel);
        [
            gyro.expected_bias().hypot(gyro.environment.expected_bias()),
            accel
                .expected_bias()
                .hypot(accel.environment.expected_bias()),
        ]
    }

    /// The same IMU, each number multiplied by the factor of its group.
    #[must_use]
    pub fn scaled(&self, factor: impl Fn(Group) -> f64) -> Self {
        let mut spec = self.clone();
        spec.gyro.scale(&factor);
        spec.gyro.environment.scale(&factor);
        spec.accel.scale(&factor);
        spec.accel.environment.scale(&factor);
        spec
    }

    /// The same IMU without its errors by the environment, which no filter has parameters for.
    #[must_use]
    pub fn without_environment(&self) -> Self {
        let mut spec = self.clone();
        let off = |group| if group == Group::Condition { 1.0 } else { 0.0 };
        spec.gyro.environment.scale(off);
        spec.accel.environment.scale(off);
        spec
    }

    /// This IMU with each error in turn so large that a filter fails that does not model it. Each
    /// comes with the key of the error.
    #[must_use]
    pub fn each_cause_large(&self) -> Vec<(String, Self)> {
        let gyro = GyroSpec::TERMS.iter().filter_map(|term| {
            let mut spec = self.clone();
            *term.of(&mut spec.gyro) = term.large()?;
            Some((format!("gyro.{}", term.key), spec))
        });
        let accel = AccelSpec::TERMS.iter().filter_map(|term| {
            let mut spec = self.clone();
            *term.of(&mut spec.accel) = term.large()?;
            Some((format!("accel.{}", term.key), spec))
        });
        gyro.chain(accel).collect()
    }

    /// Checks the ranges of all numbers.
    ///
    /// # Errors
    /// The first number that is out of its range, with the range.
    pub fn check(&self) -> Result<(), String> {
        if !(10..=4000).contains(&self.rate_hz) {
            return Err(format!("rate_hz = {}: must be 10 to 4000", self.rate_hz));
        }
        self.gyro.check()?;
        check_table("gyro.dither", &self.gyro.dither)?;
        self.gyro.environment.check()?;
        self.accel.check()?;
        self.accel.environment.check()?;
        check_table("block", &self.block)?;
        if let Some(nodes) = &self.nodes {
            check_table("nodes", nodes)?;
            nodes.check()?;
        }
        check_table("thermometer", &self.thermometer)?;
        let dither = &self.gyro.dither;
        if dither.lock_in_dph > 0.0 && dither.amplitude_noise_arcsec < 0.5 * dither.fringe_arcsec {
            return Err(format!(
                "gyro.dither.amplitude_noise_arcsec = {}: must be at least half of fringe_arcsec = {}, or the gyro stays \
                 locked at some rates and no random walk describes it",
                dither.amplitude_noise_arcsec, dither.fringe_arcsec
            ));
        }
        Ok(())
    }
}

/// Checks the numbers of a table without terms: times and divisors must be positive.
fn check_table(path: &str, table: &impl Serialize) -> Result<(), String> {
    const DIVISORS: [&str; 3] = ["frequency_hz", "amplitude_arcsec", "fringe_arcsec"];
    let table = toml::Table::try_from(table).map_err(|e| e.to_string())?;
    for (key, value) in table {
        let divides = ["_time_s", "_jpk", "_wpk"]
            .iter()
            .any(|end| key.ends_with(end));
        let range = match divides || DIVISORS.contains(&key.as_str()) {
            true => Range::Positive,
            false => Range::NotNegative,
        };
        let may_be_negative = key.ends_with("_degc");
        if let toml::Value::Float(x) = value
            && !(may_be_negative && x.is_finite())
        {
            check(&format!("{path}.{key}"), x, range)?;
        }
    }
    Ok(())
}
