//! Named groups of errors, for experiments that ask which kind of error a scheme can handle.

use super::spec::ImuSpec;
use super::term::Group;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A group of errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorModelName {
    /// White noise, quantisation and the rest of the dither. This is the floor.
    Noise,
    /// Noise, biases and their drift, scale factor, misalignment.
    Linear,
    /// Linear, and all errors that depend on temperature: warm-up, temperature, heating rate,
    /// gradient.
    Thermal,
    /// Linear, and all non-linear errors: asymmetry, non-linearity, K2, cross coupling, vibration
    /// rectification.
    Nonlinear,
    /// All errors, also magnetic field, size effect and delay.
    All,
    /// All errors, the thermal and the non-linear ones times three.
    AllX3,
    /// Linear, and thermal hysteresis.
    Hysteresis,
    /// Linear, and a bias by the difference of temperature across the block.
    Gradient,
    /// Linear, and a bias by the rate of the temperature.
    Heating,
    /// Linear, and a scale factor by the temperature.
    ScaleTemperature,
    /// Linear, and a warm-up that is no exponential, with a time of its own for each axis.
    StretchedWarmUp,
    /// Linear, and hops of the path-length control.
    ModeHop,
    /// Linear, and a bias by the temperature in a block whose thermostat cycles.
    Thermostat,
    /// Linear, and bias instability.
    Flicker,
    /// Linear, and a bias of the gyros by the squares of the specific force.
    GSquare,
    /// Linear, and a bias that has aged for a year.
    Ageing,
    /// Linear, and biases by the temperature and its square.
    Temperature,
    /// Linear, and a warm-up by one exponential.
    WarmUp,
    /// Linear, and a bias of the gyros by the specific force.
    GSensitivity,
    /// Linear, and a bias of the gyros by the magnetic field.
    Magnetic,
    /// Linear, and the remaining dither of a laser gyro, with its coning.
    Dither,
    /// Linear, and a bias of the accelerometers by vibration.
    Vibration,
    /// Linear, and accelerometers that are apart from each other.
    SizeEffect,
    /// Linear, and accelerometers with a delay.
    Timing,
    /// Linear, and a bias by the softening of an adhesive.
    Softening,
    /// Linear, and a bias by the temperature of a point away from the thermometer.
    ThermalLag,
    /// Linear, and a bias by vibration that saturates.
    VibrationSaturation,
    /// Linear, and a bias of the gyros by their recent mean rate.
    SelfHeating,
    /// Linear, and what is new at a power-on, steps and ageing as recorded units show them.
    Real,
}

impl ErrorModelName {
    /// The groups of whole kinds of errors, in ascending order.
    pub const ALL: [Self; 6] = [
        Self::Noise,
        Self::Linear,
        Self::Thermal,
        Self::Nonlinear,
        Self::All,
        Self::AllX3,
    ];

    /// The groups of a single cause beside the linear errors.
    pub const CAUSES: [Self; 22] = [
        Self::Hysteresis,
        Self::Gradient,
        Self::Heating,
        Self::ScaleTemperature,
        Self::StretchedWarmUp,
        Self::ModeHop,
        Self::Thermostat,
        Self::Flicker,
        Self::GSquare,
        Self::Ageing,
        Self::Temperature,
        Self::WarmUp,
        Self::GSensitivity,
        Self::Magnetic,
        Self::Dither,
        Self::Vibration,
        Self::SizeEffect,
        Self::Timing,
        Self::Softening,
        Self::ThermalLag,
        Self::VibrationSaturation,
        Self::SelfHeating,
    ];

    /// All groups: whole kinds of errors, single causes, real power-ons.
    pub fn every() -> impl Iterator<Item = Self> {
        let causes = Self::ALL.into_iter().chain(Self::CAUSES);
        causes.chain([Self::Real])
    }

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Linear => "linear",
            Self::Thermal => "thermal",
            Self::Nonlinear => "nonlinear",
            Self::All => "all",
            Self::AllX3 => "all-x3",
            Self::Hysteresis => "hysteresis",
            Self::Gradient => "gradient",
            Self::Heating => "heating",
            Self::ScaleTemperature => "scale-temperature",
            Self::StretchedWarmUp => "stretched-warm-up",
            Self::ModeHop => "mode-hop",
            Self::Thermostat => "thermostat",
            Self::Flicker => "flicker",
            Self::GSquare => "g-square",
            Self::Ageing => "ageing",
            Self::Temperature => "temperature",
            Self::WarmUp => "warm-up",
            Self::GSensitivity => "g-sensitivity",
            Self::Magnetic => "magnetic",
            Self::Dither => "dither",
            Self::Vibration => "vibration",
            Self::SizeEffect => "size-effect",
            Self::Timing => "timing",
            Self::Softening => "softening",
            Self::ThermalLag => "thermal-lag",
            Self::VibrationSaturation => "vibration-saturation",
            Self::SelfHeating => "self-heating",
            Self::Real => "real",
        }
    }

    /// Factor of a group of errors.
    fn factor(self, group: Group) -> f64 {
        let (linear, thermal, nonlinear, other) = match self {
            Self::Noise => (0.0, 0.0, 0.0, 0.0),
            Self::Linear => (1.0, 0.0, 0.0, 0.0),
            Self::Thermal => (1.0, 1.0, 0.0, 0.0),
            Self::Nonlinear => (1.0, 0.0, 1.0, 0.0),
            Self::All => (1.0, 1.0, 1.0, 1.0),
            Self::AllX3 => (1.0, 3.0, 3.0, 1.0),
            _ => (1.0, 0.0, 0.0, 0.0), // a single cause beside the linear errors
        };
        match group {
            Group::Noise | Group::Condition => 1.0,
            Group::Constant | Group::Wander => linear,
            Group::Thermal => thermal,
            Group::Nonlinear => nonlinear,
            Group::Other => other,
        }
    }
}

impl FromStr for ErrorModelName {
    type Err = crate::error::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let known: Vec<&str> = Self::every().map(Self::name).collect();
        let found = Self::every().find(|model| model.name() == text);
        found.ok_or_else(|| crate::error::Error::unknown("error model", text, &known))
    }
}

impl std::fmt::Display for ErrorModelName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl ImuSpec {
    /// The same IMU with only the errors of a group. With equal seeds, the errors that two groups
    /// share are equal in both.
    #[must_use]
    pub fn error_model(&self, name: ErrorModelName) -> Self {
        let mut spec = self.scaled(|group| name.factor(group));
        spec.add_cause(name, self);
        spec
    }
}

#[cfg(test)]
mod tests {
    use super::super::datasheet::{AccelSpec, GyroSpec};
    use super::super::environment::{AccelEnvironment, GyroEnvironment};
    use super::super::term::{Datasheet, Term};
    use super::*;

    /// Every number with its path.
    fn numbers(spec: &ImuSpec) -> Vec<(String, f64)> {
        fn walk(path: &str, table: &toml::Table, into: &mut Vec<(String, f64)>) {
            for (name, value) in table {
                match value {
                    toml::Value::Table(inner) => walk(&format!("{path}{name}."), inner, into),
                    value => into.extend(value.as_float().map(|x| (format!("{path}{name}"), x))),
                }
            }
        }
        let mut all = vec![];
        walk("", &toml::Table::try_from(spec).unwrap(), &mut all);
        all
    }

    /// A spec with every number equal to 2, so that a factor is visible.
    fn twos() -> ImuSpec {
        fn set(table: &mut toml::Table) {
            for (_, value) in table.iter_mut() {
                match value {
                    toml::Value::Table(inner) => set(inner),
                    toml::Value::Float(x) => *x = 2.0,
                    _ => {}
                }
            }
        }
        let mut table = toml::Table::try_from(ImuSpec::preset("medium").unwrap()).unwrap();
        set(&mut table);
        let mut spec: ImuSpec = table.try_into().unwrap();
        for term in GyroSpec::TERMS {
            *term.of(&mut spec.gyro) = 2.0;
        }
        for term in AccelSpec::TERMS {
            *term.of(&mut spec.accel) = 2.0;
        }
        for term in GyroEnvironment::TERMS {
            *term.of(&mut spec.gyro.environment) = 2.0;
        }
        for term in AccelEnvironment::TERMS {
            *term.of(&mut spec.accel.environment) = 2.0;
        }
        spec
    }

    /// Names of the numbers that become `value` in a group.
    fn at(model: ErrorModelName, value: f64) -> Vec<String> {
        let all = numbers(&twos().error_model(model));
        all.into_iter()
            .filter(|(_, x)| *x == value)
            .map(|(name, _)| name)
            .collect()
    }

    #[test]
    fn groups_switch_off_whole_kinds_and_never_noise_or_plain_numbers() {
        let kept = at(ErrorModelName::Noise, 2.0);
        // what remains of a spec without errors: noise, pulses, dither, times, the block, and the
        // conditions of other numbers
        let plain = [
            "random_walk_dpsqrth",
            "velocity_random_walk",
            "pulse",
            "dither",
            "_time_s",
            "block.",
            "nonlinearity_rate",
            "above_ratio",
        ];
        for name in &kept {
            assert!(
                plain.iter().any(|part| name.contains(part)),
                "{name} is in no group"
            );
        }
        let of = |groups: &[Group]| {
            let gyro = GyroSpec::TERMS.iter().map(Term::group);
            let accel = AccelSpec::TERMS.iter().map(Term::group);
            let gyro = gyro.chain(GyroEnvironment::TERMS.iter().map(Term::group));
            let accel = accel.chain(AccelEnvironment::TERMS.iter().map(Term::group));
            let all = gyro.chain(accel);
            all.filter(|group| groups.contains(group)).count()
        };
        let of_main = |group: Group| {
            let gyro = GyroSpec::TERMS.iter().map(Term::group);
            let all = gyro.chain(AccelSpec::TERMS.iter().map(Term::group));
            all.filter(|g| *g == group).count()
        };
        let linear = of(&[Group::Constant, Group::Wander]);
        let (thermal, nonlinear) = (of(&[Group::Thermal]), of(&[Group::Nonlinear]));
        assert!(linear >= 14 && thermal == 25 && nonlinear == 9);
        // a table whose errors are all off is left out of files, with its conditions
        let conditions = of(&[Group::Condition]) - of_main(Group::Condition);
        assert_eq!(conditions, 18);
        let with = |number: usize| kept.len() + conditions + linear + number;
        assert_eq!(at(ErrorModelName::Linear, 2.0).len(), with(0));
        assert_eq!(at(ErrorModelName::Thermal, 2.0).len(), with(thermal));
        assert_eq!(at(ErrorModelName::Nonlinear, 2.0).len(), with(nonlinear));
        assert_eq!(twos().error_model(ErrorModelName::All), twos());
        assert_eq!(kept.len(), 21);
        let tripled = at(ErrorModelName::AllX3, 6.0);
        assert_eq!(tripled.len(), 34);
        let systematic = [
            "warm_up",
            "temperature",
            "heating_",
            "gradient",
            "asymmetry",
            "nonlinearity_ppm",
            "k2",
            "cross_coupling",
            "rectification",
            "hysteresis_",
            "mode_",
            "g_square",
            "softening",
            "thermal_lag",
            "saturation",
        ];
        assert!(
            tripled
                .iter()
                .all(|name| systematic.iter().any(|part| name.contains(part))),
            "{tripled:?}"
        );
    }

    #[test]
    fn names_read_back_and_a_wrong_one_is_refused() {
        for model in ErrorModelName::every() {
            assert_eq!(model.to_string().parse::<ErrorModelName>().unwrap(), model);
            let quoted = serde_json::to_string(&model).unwrap();
            assert_eq!(quoted, format!("\"{model}\""));
        }
        let error = "al".parse::<ErrorModelName>().unwrap_err().to_string();
        assert!(
            error.contains("error model 'al', did you mean 'all'"),
            "{error}"
        );
    }
}
