//! The inputs of the networks arrive, whatever the format: the temperature in the frames, and the
//! vibration.

use crate::device::Device;
use crate::frames::{Fields, Kind, kinds};
use firmware::app::Config;
use firmware::configuration::Configuration;
use firmware::control::Mode;
use firmware::inputs::{Inputs, REFERENCE_DEGC, Source, Sources};
use firmware::wire::Checked;

const INPUTS: Inputs = [[
    Source::Temperature,
    Source::TemperatureRate,
    Source::Vibration,
]; 2];

/// Sensors whose frames contain a temperature that is read.
const WITH_THERMOMETER: [&str; 18] = [
    "stim300 0xA7, rates",
    "stim300 0xF7, averages",
    "stim300 0xAF, increments and accelerations",
    "hg4930 0x02",
    "hg4930 0xCA",
    "sbgecom IMU_SHORT",
    "sbgecom IMU_SHORT, high range",
    "sbgecom IMU_DATA",
    "adis-uart ADIS16505-2, 32 bits",
    "adis-uart ADIS16505-2, increments of 32 bits",
    "adis-uart ADIS16470, 16 bits",
    "vectornav, increments",
    "vectornav, uncompensated",
    "mavlink 2",
    "mavlink 2, second IMU",
    "mavlink 1",
    "xsens, rates",
    "xsens, fixed point",
];

fn config(kind: Kind) -> Config {
    let configuration = Configuration {
        inputs: INPUTS,
        ..Configuration::default()
    };
    Config {
        mode: Mode::Frozen,
        block: 0.1,
        configuration: Some(configuration),
        ..kind.config()
    }
}

/// Accelerations that alternate by so many counts.
const SHAKEN: i32 = 1000;

fn fields(kind: Kind, n: u32) -> Fields {
    let sign = if n.is_multiple_of(2) { 1 } else { -1 };
    Fields {
        gyro: [n as i32 % 7, 3, -5],
        accel: [SHAKEN * sign, 7, 20_000],
        rest: kind.sensor.rest,
        ..Fields::default()
    }
}

fn last_block(kind: Kind, seconds: f64) -> Sources {
    let mut device = Device::new(config(kind));
    for n in 0..(seconds * kind.rate()) as u32 {
        device.feed(&kind.frame(n, fields(kind, n)));
    }
    let block = device.app.block();
    let block = block.unwrap_or_else(|| panic!("{}: no block", kind.sensor.name));
    block.sources
}

#[test]
fn the_temperature_of_every_format_that_tells_one_arrives() {
    let mut found = Vec::new();
    for kind in kinds() {
        let name = kind.sensor.name;
        let mut frame = kind.frame(0, fields(kind, 0));
        let frame = Checked::new(kind.format, &mut frame).expect("a good frame");
        let temperature = frame.read().expect("values").temperature;
        let block = last_block(kind, 0.4);
        match temperature {
            Some([x, y, z]) => {
                let mean = (x + y + z) / 3.0;
                assert!((block.temperature - mean).abs() < 1e-5, "{name}: {mean}");
                found.push(name);
            }
            None => assert_eq!(block.temperature, REFERENCE_DEGC, "{name}"),
        }
        assert_eq!(block.temperature_rate, 0.0, "{name}: less than 10 s");
        // a unit file may ask for it only where a frame may contain it
        let can = kind
            .format
            .settings(&kind.sensor.settings())
            .has_thermometer();
        assert!(can || temperature.is_none(), "{name}");
    }
    assert_eq!(found, WITH_THERMOMETER);
}

/// Degrees that the formats' documents give for the bytes of a quiet simulated sensor.
#[test]
fn the_temperature_is_in_degrees_celsius() {
    for (name, celsius) in [
        // 120, -1 and 2 counts of 1/256
        ("stim300 0xA7, rates", 121.0 / 256.0 / 3.0),
        ("hg4930 0x02", 25.0),
        ("sbgecom IMU_SHORT", 25.0),
        ("adis-uart ADIS16470, 16 bits", 25.0),
        ("mavlink 2", 21.5),
    ] {
        let kind = kinds().into_iter().find(|kind| kind.sensor.name == name);
        let kind = kind.unwrap_or_else(|| panic!("{name}"));
        let found = last_block(kind, 0.4).temperature;
        assert!((found - celsius).abs() < 1e-5, "{name}: {found}");
    }
}

#[test]
fn the_vibration_of_every_format_is_the_variance_of_its_forces() {
    for kind in kinds() {
        let name = kind.sensor.name;
        let samples = (0.1 * kind.rate()).round();
        let first = 2 * samples as u32;
        let sum: f64 = (first..first + samples as u32)
            .map(|n| f64::from(fields(kind, n).accel[0]))
            .sum();
        let mean = sum / samples;
        let force = kind.sensor.count[1] * kind.rate();
        let shaken = f64::from(SHAKEN);
        let expected = if kind.sensor.has_accel {
            (shaken * shaken - mean * mean) * force * force
        } else {
            0.0
        };
        let block = last_block(kind, 0.301);
        let off = (f64::from(block.vibration) - expected).abs();
        assert!(
            off <= 1e-2 * expected,
            "{name}: {} for {expected}",
            block.vibration
        );
    }
}

/// Frames that are missing last for the thermometer too: the rate of a ramp stays right.
#[test]
fn missing_frames_do_not_steepen_a_ramp() {
    let kind = kinds()
        .into_iter()
        .find(|kind| kind.sensor.name == "adis-uart ADIS16470, 16 bits");
    let kind = kind.expect("a sensor of this name");
    let mut device = Device::new(config(kind));
    let frames = (30.0 * kind.rate()) as u32;
    for n in (0..frames).filter(|n| n % 5000 < 3000) {
        // 0.1 degrees in a second, in steps of 0.1 degrees
        let celsius = 250 + n / kind.sensor.rate;
        let fields = Fields {
            rest: celsius,
            ..fields(kind, n)
        };
        device.feed(&kind.frame(n, fields));
    }
    let rate = device
        .app
        .block()
        .expect("a block")
        .sources
        .temperature_rate;
    assert!((rate - 0.1).abs() < 0.01, "{rate}");
}
