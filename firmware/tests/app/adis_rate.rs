//! The rate to which a board sets an ADIS.

use crate::adis::{pass, reply};
use crate::device::Device;
use crate::record::configure;
use firmware::app::Config;
use firmware::configuration::record::encode;
use firmware::configuration::{Configuration, Parity, Sensor};
use firmware::control::{Field, Mode, Reason};
use firmware::wire::adis::{self, Burst, DetectedSensor, Form, Model};
use firmware::wire::command::fault;

fn at_spi(model: Model, framed: bool) -> Option<Sensor> {
    let form = model.form();
    Some(Sensor::Spi(adis::Settings {
        form,
        units: model.units(form != Form::Narrow).expect("a model"),
        framed,
    }))
}

/// As a board does: detects the sensor and sets it to the configured rate. Returns that rate.
fn find(device: &mut Device, model: Model) -> f64 {
    let found = DetectedSensor {
        model,
        units: model.units(model.form() != Form::Narrow).expect("a model"),
        rate: 0.0,
    };
    let found = found.at(device.app.burst_rate());
    device.app.detected(&found);
    found.rate
}

/// A rate that both the sensor and the navigation line support is set. Otherwise the sensor keeps
/// its usual rate, and the device reports that it differs from the configuration.
#[test]
fn the_configured_rate_is_set() {
    let (wide, paged) = (Model::Adis16507(1), Model::Adis16495(1));
    let fast = 1_843_200;
    for (model, framed, baud, rate, set, faults) in [
        (wide, false, 921_600, 2000.0, 2000.0, 0),
        (wide, true, 921_600, 2000.0, 2000.0, 0),
        (wide, true, 879_999, 2000.0, 1000.0, fault::RATE),
        (wide, false, 921_600, 500.0, 500.0, 0),
        (wide, false, 921_600, 1500.0, 1000.0, fault::RATE),
        (paged, false, fast, 4250.0, 4250.0, 0),
        (paged, false, 921_600, 4250.0, 1062.5, fault::RATE),
        (paged, false, 921_600, 2125.0, 2125.0, 0),
        (paged, true, 921_600, 2125.0, 1062.5, fault::RATE),
    ] {
        let mut configuration = Configuration::default();
        (configuration.sensor, configuration.rate) = (at_spi(model, framed), rate);
        configuration.lines.sensor_baud = baud;
        let mut device = Device::new(Config::of(&configuration));
        let what = (model, framed, baud, rate);
        assert_eq!(find(&mut device, model), set, "{what:?}");
        let sent = reply(model.form(), &Burst::default());
        pass(&mut device, &sent).expect("a burst");
        let seen = device.app.faults() & (fault::UNITS | fault::RATE);
        assert_eq!(seen, faults, "{what:?}");
        assert!(!device.app.must_detect_again(), "{what:?}");
    }
    // a parity bit more is too much
    let mut configuration = Configuration::default();
    (configuration.sensor, configuration.rate) = (at_spi(wide, true), 2000.0);
    (configuration.lines.sensor_baud, configuration.lines.parity) = (880_000, Parity::Even);
    let device = Device::new(Config::of(&configuration));
    assert_eq!(device.app.burst_rate(), None);
}

/// A configuration with another rate makes the board set the sensor again, once. A rate that the
/// sensor or the line does not support is refused with the field's name.
#[test]
fn another_rate_sets_the_sensor_again() {
    let model = Model::Adis16507(1);
    let mut configuration = Configuration {
        sensor: at_spi(model, false),
        ..Configuration::default()
    };
    configuration.correction.mode = Mode::Bypass;
    let mut device = Device::new(Config::of(&configuration));
    assert_eq!(find(&mut device, model), 1000.0);
    for (rate, baud, refused, again) in [
        (2000.0, 921_600, None, true),
        (1990.0, 921_600, None, false),
        (1500.0, 921_600, Some(Field::Rate), false),
        (2000.0, 460_800, Some(Field::SensorBaud), false),
        (1000.0, 460_800, None, true),
    ] {
        (configuration.rate, configuration.lines.sensor_baud) = (rate, baud);
        let answer = configure(&mut device, &encode(&configuration));
        assert_eq!(answer.err(), refused.map(Reason::Field), "{rate} {baud}");
        assert_eq!(device.app.must_detect_again(), again, "{rate} {baud}");
        assert!(!device.app.must_detect_again(), "once");
        if again {
            assert_eq!(find(&mut device, model), rate);
        }
        assert_eq!(device.app.faults() & fault::RATE, 0, "{rate} {baud}");
    }
}

/// Sends bursts `hz` times a second, of which the last bytes are damaged if so said. Gives after
/// how many milliseconds the board was told to set the sensor up again, and how many bytes have
/// left.
fn bursts(
    device: &mut Device,
    model: Model,
    hz: u32,
    damaged: bool,
    ms: u32,
) -> (Option<u32>, usize) {
    let (mut again, mut left) = (None, 0);
    for number in 0..ms * hz / 1000 {
        let burst = Burst {
            counter: number as u16,
            gyro: [number as i32 % 13, 5, 7],
            ..Burst::default()
        };
        let mut sent = reply(model.form(), &burst);
        if damaged {
            sent.iter_mut().rev().take(12).for_each(|byte| *byte = 0);
        }
        left += pass(device, &sent).map_or(0, |bytes| bytes.len());
        device.pass_us(u64::from(1_000_000 / hz));
        device.settle();
        if device.app.must_detect_again() {
            assert_eq!(again.replace(number * 1000 / hz), None, "once");
        }
    }
    (again, left)
}

/// An ADIS that restarts by itself has lost what the board had set: its bursts have another form,
/// so that the checksum is wrong, or another rate. The board is told to set it up again, once, and
/// then all is as before.
#[test]
fn a_sensor_that_lost_its_settings_is_set_up_again() {
    let model = Model::Adis16507(1);
    let configuration = Configuration {
        sensor: at_spi(model, false),
        ..Configuration::default()
    };
    for (hz, damaged) in [(1000, true), (2000, false)] {
        let mut device = Device::new(Config::of(&configuration));
        assert_eq!(find(&mut device, model), 1000.0);
        let (again, passed) = bursts(&mut device, model, 1000, false, 10_000);
        assert_eq!((again, passed > 0), (None, true));
        let (again, _) = bursts(&mut device, model, hz, damaged, 30_000);
        assert!(again.is_some_and(|ms| ms <= 11_000), "{hz} Hz: {again:?}");
        find(&mut device, model);
        let (again, left) = bursts(&mut device, model, 1000, false, 50_000);
        assert_eq!((again, left * 2), (None, passed * 10), "{hz} Hz");
        let odd = fault::UNKNOWN_FORMAT | fault::RATE;
        assert_eq!(device.app.faults() & odd, 0, "{hz} Hz");
    }
}
