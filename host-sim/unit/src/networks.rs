//! The table `[networks]`: inputs of the networks.

use super::Unit;
use super::finding::Finding;
use super::sensor::FormatName;
use firmware::configuration::Configuration;
use firmware::inputs::{Inputs, Source};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Inputs of the networks, three for each. A network can only model an error whose cause is among
/// its inputs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Networks {
    /// The inputs of the gyro network, three of rate-x, rate-y, rate-z, force-x, force-y, force-z,
    /// temperature, temperature-rate, vibration, rate-magnitude. Default: the gyros' own rates.
    pub gyro_inputs: [Input; 3],
    /// The inputs of the accelerometer network likewise. Default: the accelerometers' own forces.
    pub accel_inputs: [Input; 3],
}

/// An input of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Input {
    /// Rate about x of the sensor
    RateX,
    /// Rate about y
    RateY,
    /// Rate about z
    RateZ,
    /// Specific force along x of the sensor
    ForceX,
    /// Specific force along y
    ForceY,
    /// Specific force along z
    ForceZ,
    /// Temperature from the sensor's frames
    Temperature,
    /// Rate of change of the temperature
    TemperatureRate,
    /// Mean square of the specific force about its mean in a block
    Vibration,
    /// Magnitude of the rate
    RateMagnitude,
}

impl Default for Networks {
    fn default() -> Self {
        Self {
            gyro_inputs: [Input::RateX, Input::RateY, Input::RateZ],
            accel_inputs: [Input::ForceX, Input::ForceY, Input::ForceZ],
        }
    }
}

impl From<Input> for Source {
    fn from(input: Input) -> Self {
        match input {
            Input::RateX => Self::RateX,
            Input::RateY => Self::RateY,
            Input::RateZ => Self::RateZ,
            Input::ForceX => Self::ForceX,
            Input::ForceY => Self::ForceY,
            Input::ForceZ => Self::ForceZ,
            Input::Temperature => Self::Temperature,
            Input::TemperatureRate => Self::TemperatureRate,
            Input::Vibration => Self::Vibration,
            Input::RateMagnitude => Self::RateMagnitude,
        }
    }
}

impl From<Source> for Input {
    fn from(source: Source) -> Self {
        match source {
            Source::RateX => Self::RateX,
            Source::RateY => Self::RateY,
            Source::RateZ => Self::RateZ,
            Source::ForceX => Self::ForceX,
            Source::ForceY => Self::ForceY,
            Source::ForceZ => Self::ForceZ,
            Source::Temperature => Self::Temperature,
            Source::TemperatureRate => Self::TemperatureRate,
            Source::Vibration => Self::Vibration,
            Source::RateMagnitude => Self::RateMagnitude,
        }
    }
}

impl Input {
    /// Name in files.
    #[must_use]
    pub fn name(self) -> String {
        let value = toml::Value::try_from(self).ok();
        value
            .and_then(|v| v.as_str().map(str::to_owned))
            .unwrap_or_default()
    }
}

impl std::str::FromStr for Input {
    type Err = host_core::error::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut all = Source::ALL.into_iter().map(Self::from);
        let known: Vec<String> = all.clone().map(Self::name).collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        all.find(|input| input.name() == text)
            .ok_or_else(|| host_core::error::Error::unknown("input", text, &known))
    }
}

impl Networks {
    /// The inputs in the device's configuration.
    #[must_use]
    pub fn inputs(&self) -> Inputs {
        [self.gyro_inputs, self.accel_inputs].map(|three| three.map(Source::from))
    }

    /// The table of a device's inputs.
    #[must_use]
    pub(super) fn of([gyro, accel]: &Inputs) -> Self {
        Self {
            gyro_inputs: gyro.map(Input::from),
            accel_inputs: accel.map(Input::from),
        }
    }
}

/// Findings for inputs that the frames of the sensor do not contain.
pub(super) fn not_given(unit: &Unit, configuration: &Configuration) -> Vec<Finding> {
    if configuration.has_thermometer() != Some(false) {
        return Vec::new();
    }
    let format = unit.sensor.format;
    let remedy = match format {
        FormatName::Stim300 => {
            "set the sensor to a datagram with temperatures, and sensor.stim300.datagram to it, \
             such as '0xA5'"
        }
        _ => "use another input, such as vibration or rate-magnitude",
    };
    let keys = ["networks.gyro_inputs", "networks.accel_inputs"];
    let inputs = keys.into_iter().zip(configuration.inputs);
    let needy = inputs.filter(|(_, three)| three.iter().any(|one| one.needs_thermometer()));
    let finding = |(key, _)| {
        let problem = format!(
            "names a temperature, but as configured the frames of {} hold none that is read",
            format.name()
        );
        Finding::wrong(key, problem, remedy)
    };
    needy.map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::examine;
    use crate::tests::SHORT;
    use firmware::inputs::OWN;

    /// The short file with these lines before its accelerometers, and all findings in it.
    fn file(networks: &str) -> (String, Vec<String>) {
        let text = SHORT.replace("[accel]", &format!("[networks]\n{networks}\n[accel]"));
        let found = examine(&text).1.into_iter();
        let lines = found.map(|finding| finding.error("u.toml".as_ref()).to_string());
        (text.clone(), lines.collect())
    }

    #[test]
    fn mistakes_are_named_with_line_and_remedy() {
        for (line, says) in [
            (
                "gyro_inputs = ['temperature', 'vibration', 'rate-x']",
                "u.toml:9: 'networks.gyro_inputs' names a temperature, but as configured the \
                 frames of stim300 hold none that is read; remedy: set the sensor to a datagram \
                 with temperatures, and sensor.stim300.datagram to it, such as '0xA5'",
            ),
            (
                "gyro_inputs = ['rate-x', 'rate-y', 'temprature']",
                "u.toml:9: 'networks.gyro_inputs' is 'temprature'; remedy: use one of rate-x, \
                 rate-y, rate-z, force-x, force-y, force-z, temperature, temperature-rate, \
                 vibration, rate-magnitude (perhaps 'temperature')",
            ),
            (
                "accel_inputs = ['force-x']",
                "u.toml:9: 'networks.accel_inputs' has 1 values; remedy: give 3 values",
            ),
        ] {
            assert_eq!(file(line).1, [says]);
        }
    }

    #[test]
    fn names_are_those_of_the_file() {
        let text = "temperature-rate";
        assert_eq!(text.parse::<Input>().unwrap(), Input::TemperatureRate);
        assert_eq!(Input::TemperatureRate.name(), text);
        let error = "temprature".parse::<Input>().unwrap_err().to_string();
        assert!(error.contains("did you mean 'temperature'"), "{error}");
    }

    #[test]
    fn the_inputs_reach_the_device_and_come_back() {
        let unit: Unit = toml::from_str(SHORT).unwrap();
        assert_eq!(unit.configuration().unwrap().inputs, OWN);
        let lines = "gyro_inputs = ['temperature', 'temperature-rate', 'vibration']\n\
                     accel_inputs = ['rate-magnitude', 'rate-z', 'force-z']";
        let text = file(lines).0;
        // a datagram with temperatures; and a format that is detected, which may have one
        for sensor in [
            "'stim300'\nstim300 = { datagram = '0xA5' }",
            "'detect'\nrate_hz = 1000",
        ] {
            let text = text.replace("'stim300'", sensor);
            let unit = examine(&text).0.unwrap();
            let configuration = unit.configuration().unwrap();
            let gyro = [
                Source::Temperature,
                Source::TemperatureRate,
                Source::Vibration,
            ];
            let accel = [Source::RateMagnitude, Source::RateZ, Source::ForceZ];
            assert_eq!(configuration.inputs, [gyro, accel]);
            assert_eq!(Unit::of(&configuration).unwrap().networks, unit.networks);
        }
        for source in Source::ALL {
            assert_eq!(Source::from(Input::from(source)), source);
        }
    }
}
