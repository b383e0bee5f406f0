//! What the device is configured with, and the networks in its store.

use crate::sensor::Sensor;
use firmware::app::Activation;
use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::model::Nets;
use lrnn_nostd::{Net, Normalisation, Weights};

/// The device's configuration for its sensor.
pub fn configured(sensor: &Sensor, rate: u32, live: bool) -> Configuration {
    let mut configuration = Configuration {
        sensor: sensor.configured(),
        rate: rate.into(),
        ..Configuration::default()
    };
    configuration.correction.mode = Mode::Learn;
    if live {
        configuration.correction.activation = Activation::Faded;
    }
    configuration
}

/// Networks that correct by up to 1 deg/h and 100 ug, and whose output depends on every sample.
pub fn nets() -> Nets {
    let weights = Weights::from_fn(|index| ((index * 37 + 11) % 129) as f32 / 128.0 - 0.5);
    let net = |input_scale: f32, output_scale: f32| -> Net {
        Net::new(
            weights,
            Normalisation {
                input_offset: [0.0; 3],
                input_scale: [input_scale; 3],
                output_scale: [output_scale; 3],
            },
        )
    };
    Nets {
        gyro: net(2.0, 5e-6),
        accel: net(0.1, 1e-3),
        ..Nets::NONE
    }
}
