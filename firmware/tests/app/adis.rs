//! Bursts of an ADIS, fetched by the board, through the application.

use crate::device::{Device, nets};
use crate::record::configure;
use firmware::app::{Config, Hardware, Phase};
use firmware::compensator::Limit;
use firmware::configuration::record::encode;
use firmware::configuration::{Configuration, Sensor};
use firmware::control::Mode;
use firmware::units::{DEGREE, G};
use firmware::wire::adis::{Burst, DetectedSensor, Form, Model};
use firmware::wire::command::fault;
use firmware::wire::{Error, ImuFormat, Settings, adis};
use proptest::prelude::*;

const FORMS: [Form; 3] = [Form::Narrow, Form::Wide, Form::Adis1649x];

pub fn reply(form: Form, burst: &Burst) -> Vec<u8> {
    match form {
        Form::Narrow => burst.emit16().to_vec(),
        Form::Wide => burst.emit32().to_vec(),
        Form::Adis1649x => burst.emit_1649x(burst.counter.is_multiple_of(2)).to_vec(),
    }
}

fn parse(form: Form, reply: &[u8]) -> Result<Burst, Error> {
    match form {
        Form::Narrow => Burst::parse16(reply.try_into().expect("20")),
        Form::Wide => Burst::parse32(reply.try_into().expect("32")),
        Form::Adis1649x => Burst::parse_1649x(reply.try_into().expect("40")),
    }
}

fn config(form: Form) -> Config {
    Config {
        mode: Mode::Frozen,
        block: 0.01,
        sensor: Settings {
            adis: Some(adis::Settings {
                form,
                units: Model::Adis16475(1)
                    .units(form != Form::Narrow)
                    .expect("a model"),
                framed: false,
            }),
            ..Settings::DEFAULT
        },
        limit: Limit {
            gyro: 1.0,
            accel: 1.0,
        },
        ..Config::default()
    }
}

/// Hands a reply over and returns the bytes that leave.
pub fn pass(device: &mut Device, reply: &[u8]) -> Result<Vec<u8>, Error> {
    let mut reply = reply.to_vec();
    device
        .app
        .burst(&mut reply, &mut device.lines.navigation, &device.time)?;
    device.settle();
    Ok(device.lines.navigation.sent.pop().expect("a reply"))
}

/// All values except the one that equals the identifier of a 1649x reply: no sensor sets those
/// flags together.
fn flags() -> impl Strategy<Value = u16> {
    any::<u16>().prop_filter("the identifier", |&flags| flags != 0xA5A5)
}

proptest! {
    #[test]
    fn bursts_go_through(
        which in 0..3usize,
        samples in prop::collection::vec(any::<[i32; 6]>(), 1..60),
        diagnosis in flags(),
    ) {
        let form = FORMS[which];
        let mut device = Device::new(config(form));
        for (counter, [a, b, c, d, e, f]) in (0..).zip(samples) {
            let burst = Burst {
                diagnosis,
                gyro: [a, b, c],
                accel: [d, e, f],
                temperature: 250,
                counter,
            };
            let sent = reply(form, &burst);
            prop_assert_eq!(pass(&mut device, &sent), Ok(sent));
        }
        prop_assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
    }

    /// One wrong bit: reported to the board, counted, not sent.
    #[test]
    fn damage_is_kept_back(which in 0..3usize, bit: prop::sample::Index) {
        let form = FORMS[which];
        let mut device = Device::new(config(form));
        let mut bytes = reply(form, &Burst::default());
        // in a 1649x reply the CRC covers neither BURST_ID nor the bytes behind it
        let (from, to) = if form == Form::Adis1649x { (4, 38) } else { (0, bytes.len()) };
        let bit = 8 * from + bit.index(8 * (to - from));
        bytes[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(pass(&mut device, &bytes).is_err());
        prop_assert_eq!(device.counters().bad_checksums, 1);
        prop_assert!(device.lines.navigation.sent.is_empty());
    }
}

/// The sum of corrections is right, all other fields are the sensor's, and the checksum is right.
#[test]
fn corrections_add_up() {
    for form in FORMS {
        let error = [2e-4f32, -3e-4, 0.0, 5e-3, 0.0, -1e-2];
        let [a, b, c, d, e, f] = error;
        let mut device = Device::new(Config {
            nets: nets([a, b, c], [d, e, f]),
            ..config(form)
        });
        let (mut sum, count) = ([0i64; 6], 50_000u32);
        for n in 0..count {
            let burst = Burst {
                gyro: [n as i32 % 100, 5, -7],
                accel: [1, 2, 4000],
                counter: n as u16,
                ..Burst::default()
            };
            let sent = reply(form, &burst);
            let out = pass(&mut device, &sent).expect("good");
            let after = parse(form, &out).expect("good again");
            assert_eq!((after.counter, after.temperature), (burst.counter, 0));
            let before = burst.gyro.iter().chain(&burst.accel);
            for ((s, b), a) in sum
                .iter_mut()
                .zip(before)
                .zip(after.gyro.iter().chain(&after.accel))
            {
                *s += i64::from(b - a);
            }
        }
        let narrow = if form == Form::Narrow { 1.0 } else { 65_536.0 };
        for (axis, s) in sum.into_iter().enumerate() {
            // rates: 1/160 deg/s and 0.25 mg a count of 16 bits
            let lsb = if axis < 3 {
                DEGREE / 160.0
            } else {
                0.25e-3 * G
            } / narrow;
            let exact = f64::from(count) * f64::from(error[axis]) / lsb;
            let off = (s as f64 - exact).abs();
            assert!(
                off <= 0.5 + exact.abs() * 3e-7,
                "{form:?} {axis} {s} {exact}"
            );
        }
    }
}

#[test]
fn gaps_and_silence() {
    let mut device = Device::new(config(Form::Wide));
    let burst = |counter| {
        reply(
            Form::Wide,
            &Burst {
                counter,
                ..Burst::default()
            },
        )
    };
    for counter in [0, 1, 2, 6, 7, 7] {
        pass(&mut device, &burst(counter)).expect("good");
    }
    assert_eq!(
        (device.counters().missed, device.counters().duplicates),
        (3, 1)
    );
    device.wait_ms(200);
    assert_eq!(device.app.faults(), fault::SILENT);
    pass(&mut device, &burst(8)).expect("good");
    assert_eq!(device.app.faults(), 0);
    // bytes on the sensor's line are not read as bursts
    device.feed(&[0; 100]);
    assert_eq!((device.counters().raw, device.counters().garbage), (100, 0));
    let mut other = Device::new(Config::default());
    assert_eq!(pass(&mut other, &burst(0)), Err(Error::Content));
}

/// The board's burst leaves in a frame, a second device reads it on its line and corrects it once
/// more, and what is left is the sensor's values less both corrections. Flags, time and counter
/// are as the first device sent them.
#[test]
fn a_second_device_follows_the_first() {
    for (form, model) in [
        (Form::Narrow, Model::Adis16475(1)),
        (Form::Wide, Model::Adis16505(2)),
        (Form::Adis1649x, Model::Adis16495(1)),
    ] {
        let units = model.units(form != Form::Narrow).expect("a model");
        let error = [units.gyro.lsb * 40.25, 0.0, -units.gyro.lsb * 3.5];
        let first = Config {
            nets: nets(error.map(|rate| rate as f32), [0.0; 3]),
            sensor: Settings {
                adis: Some(adis::Settings {
                    form,
                    units,
                    framed: true,
                }),
                ..Settings::DEFAULT
            },
            ..config(form)
        };
        let mut sensor = Settings::DEFAULT;
        sensor.adis_uart.model = model;
        let second = Config {
            format: Some(ImuFormat::AdisUart),
            sensor,
            ..first.clone()
        };
        let (mut first, mut second) = (Device::new(first), Device::new(second));
        let (mut sum, count) = ([0i64; 3], 4000u32);
        for n in 0..count {
            let burst = Burst {
                gyro: [n as i32 % 100, 5, -7],
                accel: [1, 2, 4000],
                counter: n as u16,
                ..Burst::default()
            };
            let frame = pass(&mut first, &reply(form, &burst)).expect("good");
            assert_eq!(frame.len(), form.bytes() + 12);
            second.feed(&frame);
            let out = second.lines.navigation.sent.pop().expect("a frame");
            assert_eq!(out.len(), frame.len());
            assert_eq!(out[..8], frame[..8], "flags and time");
            let after = parse(form, &out[8..8 + form.bytes()]).expect("a good burst");
            assert_eq!((after.accel, after.counter), (burst.accel, burst.counter));
            let pairs = sum.iter_mut().zip(burst.gyro.iter().zip(&after.gyro));
            pairs.for_each(|(sum, (before, after))| *sum += i64::from(before - after));
        }
        assert_eq!(second.counters().frames, count);
        assert_eq!(second.counters().missed, 0);
        // the first block of either device passes unchanged
        for (sum, lsb) in sum.into_iter().zip([40.25, 0.0, -3.5]) {
            let most = 2.0 * f64::from(count) * lsb;
            let blocks = 2.0 * 12.0 * f64::abs(lsb) + 1.0;
            assert!((sum as f64 - most).abs() <= blocks, "{form:?} {sum} {most}");
        }
    }
}

/// A burst damaged at the SPI is withheld, in a frame too. In state Fault every burst passes, in
/// frames.
#[test]
fn a_damaged_burst_is_not_framed() {
    let mut framed = config(Form::Narrow);
    if let Some(adis) = &mut framed.sensor.adis {
        adis.framed = true;
    }
    let mut device = Device::new(framed);
    let good = reply(Form::Narrow, &Burst::default());
    let frame = pass(&mut device, &good).expect("good");
    assert_eq!(frame[8..28], good);
    let mut bad = good.clone();
    bad[3] ^= 1;
    assert_eq!(pass(&mut device, &bad), Err(Error::Checksum));
    assert_eq!(pass(&mut device, &good[..18]), Err(Error::Length));
    assert_eq!(device.counters().bad_checksums, 2);
    assert!(device.lines.navigation.sent.is_empty());
}

/// The detected sensor is compared with the configuration. A different model or rate raises a
/// fault, and nothing is corrected. Without a configuration the bursts pass unchanged.
#[test]
fn an_adis_that_differs_from_the_configuration_is_reported_and_not_corrected() {
    let found = |model: Model| DetectedSensor {
        model,
        units: model.units(model.form() != Form::Narrow).expect("a model"),
        rate: 1000.0,
    };
    let model = Model::Adis16475(1);
    let spi = |model: Model| {
        let DetectedSensor { units, .. } = found(model);
        let form = model.form();
        let framed = false;
        Some(Sensor::Spi(adis::Settings {
            form,
            units,
            framed,
        }))
    };
    let stream = Sensor::Stream(ImuFormat::Kvh.settings(&Settings::DEFAULT));
    let cases = [
        (spi(model), 1000.0, 0),
        (spi(model), 985.0, 0),
        (None, 200.0, 0),
        (spi(model), 500.0, fault::RATE),
        (spi(Model::Adis16475(2)), 1000.0, fault::UNITS),
        (spi(Model::Adis16495(1)), 1000.0, fault::UNITS),
        (spi(Model::Adis16507(1)), 4000.0, fault::UNITS | fault::RATE),
        (Some(stream), 1000.0, fault::UNITS),
    ];
    for (sensor, rate, expected) in cases {
        for mode in [Mode::Frozen, Mode::Bypass] {
            let mut configuration = Configuration::default();
            (
                configuration.sensor,
                configuration.rate,
                configuration.correction.mode,
            ) = (sensor, rate, mode);
            configuration.correction.block = 0.1;
            let mut device = Device::new(Config {
                nets: nets([1e-3, 0.0, 0.0], [0.0; 3]),
                limit: Limit {
                    gyro: 1.0,
                    accel: 1.0,
                },
                ..Config::of(&configuration)
            });
            device.app.detected(&found(model));
            let mut changed = false;
            for counter in 0..300 {
                let burst = Burst {
                    counter,
                    ..Burst::default()
                };
                let sent = reply(Form::Narrow, &burst);
                changed |= pass(&mut device, &sent).expect("a burst") != sent;
            }
            let what = (sensor, rate, mode);
            assert_eq!(changed, expected == 0 && mode == Mode::Frozen, "{what:?}");
            let faults = device.app.faults() & (fault::UNITS | fault::RATE);
            assert_eq!(faults, expected, "{what:?}");
        }
    }
    let mut device = Device::new(Config::unconfigured(Hardware::DESKTOP));
    device.app.detected(&found(model));
    let sent = reply(Form::Narrow, &Burst::default());
    assert_eq!(pass(&mut device, &sent).expect("a burst"), sent);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    // once configured for this model, it corrects
    let mut configuration = Configuration::default();
    (configuration.sensor, configuration.correction.mode) = (spi(model), Mode::Frozen);
    let record = encode(&configuration);
    assert_eq!(configure(&mut device, &record), Ok(()));
    assert_eq!(pass(&mut device, &sent).expect("a burst"), sent);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
}

/// Bytes that an unconfigured device received on the sensor's line before the board detects an
/// ADIS, or receives there later, do not affect the ADIS.
#[test]
fn noise_on_the_line_is_nothing_to_an_adis() {
    let model = Model::Adis16475(1);
    let found = DetectedSensor {
        model,
        units: model.units(false).expect("a model"),
        rate: 1000.0,
    };
    let mut device = Device::new(Config::unconfigured(Hardware::DESKTOP));
    device.feed(&[0x55; 5000]);
    assert_ne!(device.app.faults() & fault::UNKNOWN_FORMAT, 0);
    device.app.detected(&found);
    let good = reply(Form::Narrow, &Burst::default());
    for _ in 0..100 {
        device.feed(&[0x55; 100]);
        device.lines.navigation.sent.clear();
        assert_eq!(pass(&mut device, &good).expect("a burst"), good);
        assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
        assert_eq!(device.app.faults() & fault::UNKNOWN_FORMAT, 0);
    }
    // and it has no service mode
    device.lines.navigation.input.extend(b"SERVICEMODE\r");
    device.wait_ms(50);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
    assert_eq!(device.counters().requests, 0);
    assert_eq!(device.counters().entered, [1, 1, 0]);
    // bytes there do not hide that the sensor is silent
    for _ in 0..300 {
        device.pass_us(1000);
        device.feed(&[0x55]);
    }
    assert_ne!(device.app.faults() & fault::SILENT, 0);
}
