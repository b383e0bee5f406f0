//! The table `[prior]`: prior, learnt from a fleet of the same type of sensor, for a unit that has
//! not driven yet. `host-sim fleet` writes it.
//!
//! The hidden layers are common to the type. The output layer differs between units: the table has
//! its mean and standard deviations over units, and the standard deviation of the bias that is new
//! at each turn-on.

use super::Unit;
use super::finding::Finding;
use super::networks::{Input, Networks};
use firmware::model::Nets;
use host_core::inertial::units::{DEG_PER_H, UG};
use lrnn_nostd::{Net, Normalisation, Weights};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prior from a fleet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prior {
    /// Number of units that it was learnt from. Required.
    #[schemars(range(min = 10, max = 1_000_000))]
    pub units: u32,
    /// Number of their drives. Required.
    #[schemars(range(min = 20, max = 100_000_000))]
    pub drives: u32,
    /// Network of the gyros; `output` in deg/h. Required.
    pub gyro: Triad,
    /// Network of the accelerometers; `output` in ug. Required.
    pub accel: Triad,
}

/// The network of one triad. Weights have no unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Triad {
    /// The three inputs, as in the table `[networks]`. Required.
    pub inputs: [Input; 3],
    /// Subtracted from each input: rad/s, m/s2, degrees C, K/s or (m/s2)^2. Required.
    pub input_offset: [f64; 3],
    /// Factor of each input after that. Required.
    pub input_scale: [f64; 3],
    /// Value of an output of 1, deg/h or ug. The next three are in units of it. Required.
    #[schemars(range(min = 1e-6, max = 1e9))]
    pub output: f64,
    /// Standard deviation over units of the output layer's three columns. Required.
    pub sigma_w: [f64; 3],
    /// Standard deviation over units of the output layer's biases. Required.
    #[schemars(range(min = 0, max = 1e6))]
    pub sigma_b: f64,
    /// Standard deviation of the bias that is new at each turn-on. Required.
    #[schemars(range(min = 0, max = 1e6))]
    pub sigma_turn_on: f64,
    /// Remaining share of the squared errors on drives of units outside the fleet, median: by this
    /// network, by a static linear law of the same inputs, by biases. Required.
    pub left: [f64; 3],
    /// Mean over units of the output layer's weights, a row for each axis. Required.
    pub mean_w: [[f64; 3]; 3],
    /// Mean over units of the output layer's biases. Required.
    pub mean_b: [f64; 3],
    /// The first hidden layer. Required.
    pub first: Layer,
    /// The second hidden layer. Required.
    pub second: Layer,
}

/// One hidden layer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// From the layer below, a row for each unit. Required.
    pub w: [[f64; 3]; 3],
    /// From the same layer, one step earlier. Required.
    pub r: [[f64; 3]; 3],
    /// Biases. Required.
    pub b: [f64; 3],
}

impl From<lrnn_nostd::Layer<f64>> for Layer {
    fn from(layer: lrnn_nostd::Layer<f64>) -> Self {
        Self {
            w: layer.w,
            r: layer.r,
            b: layer.b,
        }
    }
}

impl Prior {
    /// The inputs with which it was learnt.
    #[must_use]
    pub fn networks(&self) -> Networks {
        Networks {
            gyro_inputs: self.gyro.inputs,
            accel_inputs: self.accel.inputs,
        }
    }

    /// The networks that act from power-on of a unit that has not driven yet.
    #[must_use]
    pub fn nets(&self) -> Nets {
        Nets {
            gyro: self.gyro.net(DEG_PER_H),
            accel: self.accel.net(UG),
            ..Nets::NONE
        }
    }
}

/// A prior that was learnt with other inputs than the networks have.
pub(super) fn other_inputs(unit: &Unit) -> Option<Finding> {
    let learnt = unit.prior.as_ref()?.networks();
    let names = learnt.gyro_inputs.iter().chain(&learnt.accel_inputs);
    let names: Vec<String> = names.map(|input| input.name()).collect();
    let problem = format!("was learnt with the inputs {}", names.join(", "));
    let remedy = "give [networks] these inputs, or leave the table [prior] out";
    (learnt != unit.networks).then(|| Finding::wrong("prior", problem, remedy))
}

impl Triad {
    /// Calls `each` with every number that was learnt.
    pub fn numbers(&mut self, each: impl FnMut(&mut f64)) {
        let layers = [&mut self.first, &mut self.second];
        let hidden = layers.into_iter().flat_map(|l| {
            let w = l.w.as_flattened_mut().iter_mut();
            w.chain(l.r.as_flattened_mut()).chain(&mut l.b)
        });
        let moments = [&mut self.output, &mut self.sigma_b, &mut self.sigma_turn_on];
        let own = self.sigma_w.iter_mut().chain(&mut self.left);
        let mean = self.mean_w.as_flattened_mut().iter_mut();
        let mean = mean.chain(&mut self.mean_b);
        hidden.chain(moments).chain(own).chain(mean).for_each(each);
    }

    fn net(&self, unit: f64) -> Net {
        let exact = |l: &Layer| lrnn_nostd::Layer {
            w: l.w,
            r: l.r,
            b: l.b,
        };
        let top = lrnn_nostd::Layer {
            w: self.mean_w,
            r: [[0.0; 3]; 3],
            b: self.mean_b,
        };
        let weights = Weights {
            layers: [exact(&self.first), exact(&self.second), top],
        };
        let normalisation = Normalisation {
            input_offset: self.input_offset.map(|x| x as f32),
            input_scale: self.input_scale.map(|x| x as f32),
            output_scale: [(self.output * unit) as f32; 3],
        };
        Net::new(weights.cast(), normalisation)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn example() -> Prior {
        let layer = |x: f64| Layer {
            w: [[x, 0.0, 0.1], [0.0, x, 0.0], [0.0, -0.2, x]],
            r: [[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]],
            b: [0.0, 0.25, 0.0],
        };
        let triad = |output: f64| Triad {
            inputs: [Input::Temperature, Input::TemperatureRate, Input::Vibration],
            input_offset: [25.0, 0.0, 0.0],
            input_scale: [0.05, 60.0, 5.0],
            output,
            sigma_w: [0.5, 0.25, 0.125],
            sigma_b: 1.0,
            sigma_turn_on: 0.0625,
            left: [0.5, 0.75, 1.0],
            mean_w: [[0.5, 0.0, 0.0], [0.0; 3], [0.0; 3]],
            mean_b: [0.25, 0.0, -0.5],
            first: layer(0.5),
            second: layer(1.0),
        };
        Prior {
            units: 40,
            drives: 160,
            gyro: triad(0.3),
            accel: triad(400.0),
        }
    }

    /// A unit file with the table is read back as it was, and its networks compute what the table
    /// says.
    #[test]
    fn a_unit_file_keeps_its_prior() {
        let prior = example();
        let mut unit = Unit {
            networks: prior.networks(),
            prior: Some(prior),
            ..Unit::default()
        };
        let table = unit.sensor.stim300.get_or_insert_with(Default::default);
        table.datagram = "0xA5".into();
        let text = unit.to_text("a fleet's").unwrap();
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("unit.toml");
        std::fs::write(&file, &text).unwrap();
        let back = Unit::read(&file).unwrap();
        assert_eq!(back, unit);
        let (other, found) = crate::examine(&text.replacen("vibration", "rate-x", 1));
        assert!(other.is_none() && found.iter().any(|f| f.key == "prior"));
        let nets = back.prior.unwrap().nets();
        let want = [0.25, 0.0, -0.5].map(|b| (b * 0.3 * DEG_PER_H) as f32);
        let got = nets.gyro.initial_output();
        for (got, want) in got.iter().zip(want) {
            assert!((got - want).abs() <= 1e-6 * want.abs());
        }
        assert_eq!(nets.accel.normalisation.input_offset, [25.0, 0.0, 0.0]);
        assert_eq!(nets.accel.weights.layers[0].w[2], [0.0, -0.2, 0.5]);
    }
}
