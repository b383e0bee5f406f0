use super::record::{MAX_LEN, decode, encode};
use super::*;
use crate::control::{Field, Reason};
use crate::inputs::{OWN, Source};
use crate::wire::ImuFormat;

/// A configuration with a value other than the default in every field that has room for one.
pub(crate) fn example(format: ImuFormat) -> Configuration {
    let triad = Triad {
        bias_turn_on: 1e-5,
        bias_in_run: 1e-6,
        white_noise: 4e-5,
        scale: 5e-4,
        misalignment: 1e-3,
        g_sensitivity: 1e-6,
        range: 7.0,
    };
    Configuration {
        identity: Identity {
            name: String::try_from("a name of thirty-two characters!").unwrap(),
            serial: String::try_from("N25581346021341234567890").unwrap(),
        },
        lines: SerialLines {
            sensor_baud: 1_843_200,
            parity: Parity::Odd,
            two_stop_bits: true,
            receiver_baud: 115_200,
            cut_through: format.can_be_cut(),
            pins: 1,
        },
        sensor: Some(Sensor::Stream(format.settings(&Settings::DEFAULT))),
        rate: 500.0,
        mounting: [0.5, 0.5, 0.5, 0.5],
        gyro: triad,
        accel: triad,
        receiver: Receiver {
            protocol: ReceiverProtocol::Detect,
            lever_arm: [1.0, -0.5, -1.5],
            lever_arm_sigma: 0.2,
            fix_delay: 0.1,
            fix_delay_sigma: 0.03,
            pulse: true,
            heading_offset: -1.5,
        },
        vehicle: Vehicle {
            kind: VehicleKind::Air,
            speed: 80.0,
        },
        correction: Correction {
            mode: Mode::Learn,
            activation: Activation::Faded,
            limit: Limit {
                gyro: 1e-4,
                accel: 0.05,
            },
            slew: Limit {
                gyro: 1e-7,
                accel: 5e-5,
            },
            block: 1.0,
            align: 120.0,
            silence_us: 100_000,
            mark: true,
            check_rate: true,
        },
        inputs: [
            [
                Source::Temperature,
                Source::TemperatureRate,
                Source::Vibration,
            ],
            [Source::ForceX, Source::RateMagnitude, Source::ForceZ],
        ],
        wheels: Some(Wheels {
            lever_arm: [-1.5, 0.1, 0.5],
            ahead: 2.7,
            scale: 0.02,
            noise: 0.05,
            delay: 0.02,
        }),
    }
}

#[test]
fn a_record_of_every_format_reads_back_and_fits() {
    for format in ImuFormat::ALL {
        let configuration = example(format);
        let record = encode(&configuration);
        assert!(record.len() > 100 && record.len() <= MAX_LEN, "{format:?}");
        assert_eq!(decode(&record), Ok(configuration), "{format:?}");
    }
}

#[test]
fn every_damaged_byte_is_noticed_and_nothing_panics() {
    let record = encode(&example(ImuFormat::Stim300));
    for at in 0..record.len() {
        for bit in 0..8 {
            let mut bytes = record.clone();
            bytes[at] ^= 1 << bit;
            assert!(decode(&bytes).is_err(), "byte {at}, bit {bit}");
        }
        assert_eq!(decode(&record[..at]), Err(Reason::Record), "cut at {at}");
    }
}

#[test]
fn another_schema_and_values_out_of_range_are_named() {
    let seal = |bytes: &mut Vec<u8>| {
        let end = bytes.len() - 4;
        let sum = crate::wire::checksum::crc32_zlib(&bytes[..end]);
        bytes[end..].copy_from_slice(&sum.to_le_bytes());
    };
    let mut newer: Vec<u8> = encode(&example(ImuFormat::Kvh)).to_vec();
    newer[4] = SCHEMA as u8 + 1;
    seal(&mut newer);
    assert_eq!(decode(&newer), Err(Reason::Schema(SCHEMA)));
    let mut configuration = example(ImuFormat::Kvh);
    configuration.gyro.white_noise = 0.0;
    assert_eq!(
        decode(&encode(&configuration)),
        Err(Reason::Field(Field::Gyro))
    );
    let refused = |change: fn(&mut Receiver), field| {
        let mut configuration = example(ImuFormat::Kvh);
        change(&mut configuration.receiver);
        assert_eq!(decode(&encode(&configuration)), Err(Reason::Field(field)));
    };
    refused(|r| r.lever_arm[1] = f32::NAN, Field::LeverArm);
    refused(|r| r.lever_arm_sigma = 101.0, Field::LeverArmSigma);
    refused(|r| r.lever_arm_sigma = -0.1, Field::LeverArmSigma);
    refused(|r| r.fix_delay_sigma = 1.1, Field::FixDelaySigma);
    refused(|r| r.fix_delay_sigma = f32::NAN, Field::FixDelaySigma);
    refused(|r| r.heading_offset = 3.2, Field::HeadingOffset);
    let wheels: [fn(&mut Wheels); 5] = [
        |w| w.lever_arm[2] = f32::NAN,
        |w| w.ahead = -1.0,
        |w| w.scale = 0.6,
        |w| w.noise = 0.0,
        |w| w.delay = 1.1,
    ];
    for change in wheels {
        let mut configuration = example(ImuFormat::Kvh);
        configuration.wheels.as_mut().map(change);
        let refused = Err(Reason::Field(Field::Wheels));
        assert_eq!(decode(&encode(&configuration)), refused);
    }
}

/// Cut-through is refused where the format cannot, or is not configured.
#[test]
fn cut_through_needs_a_format_that_can() {
    for format in ImuFormat::ALL {
        let mut configuration = example(format);
        configuration.lines.cut_through = true;
        let refused = Err(Reason::Field(Field::CutThrough));
        if format.can_be_cut() {
            assert_eq!(decode(&encode(&configuration)), Ok(configuration.clone()));
        } else {
            assert_eq!(decode(&encode(&configuration)), refused);
        }
        configuration.sensor = None;
        assert_eq!(decode(&encode(&configuration)), refused);
    }
}

/// `example` of a STIM300 as the firmware of schema 1 has written it.
const SCHEMA_1: &[u8] = include_bytes!("schema_1.bin");

#[test]
fn a_record_of_schema_1_is_read_with_the_new_values_at_their_defaults() {
    let mut configuration = example(ImuFormat::Stim300);
    configuration.receiver = Receiver {
        protocol: ReceiverProtocol::Ubx,
        lever_arm_sigma: 0.0,
        fix_delay_sigma: 0.0,
        pulse: false,
        heading_offset: 0.0,
        ..configuration.receiver
    };
    configuration.inputs = OWN;
    configuration.lines.cut_through = false;
    configuration.wheels = None;
    assert_eq!(decode(SCHEMA_1), Ok(configuration.clone()));
    // of this schema it becomes a record that reads back
    assert_eq!(decode(&encode(&configuration)), Ok(configuration));
    for at in 0..SCHEMA_1.len() {
        assert_eq!(decode(&SCHEMA_1[..at]), Err(Reason::Record), "cut at {at}");
    }
}

/// The same record written by the firmware of schema 2.
const SCHEMA_2: &[u8] = include_bytes!("schema_2.bin");

/// The same record written by the firmware of schema 3.
const SCHEMA_3: &[u8] = include_bytes!("schema_3.bin");

/// The values of an older record stay: its activation is not the new default. Its networks get
/// their own triads.
#[test]
fn records_of_schemas_2_and_3_are_read_as_they_were_written() {
    let mut configuration = example(ImuFormat::Stim300);
    configuration.inputs = OWN;
    configuration.lines.cut_through = false;
    configuration.wheels = None;
    let now = encode(&configuration);
    for (number, older) in [(2, SCHEMA_2), (3, SCHEMA_3)] {
        assert_eq!(decode(older), Ok(configuration.clone()), "{number}");
        assert_eq!((older[4], now[4]), (number, SCHEMA as u8));
        // the inputs are one byte each, cut-through and no wheels are one
        assert_eq!(older.len() + 6 + 2, now.len());
    }
    // schema 5 ends before the last of these, schema 4 before the last two
    let mut older: Vec<u8> = now.to_vec();
    for schema in [5, 4] {
        older.remove(older.len() - 5);
        older[4] = schema;
        let body = u16::from_le_bytes([older[6], older[7]]) - 1;
        older[6..8].copy_from_slice(&body.to_le_bytes());
        let end = older.len() - 4;
        let sum = crate::wire::checksum::crc32_zlib(&older[..end]);
        older[end..].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(decode(&older), Ok(configuration.clone()), "{schema}");
    }
    let mut later = configuration;
    later.correction.activation = Activation::default();
    assert_eq!(later.correction.activation, Activation::NextPowerOn);
    assert_eq!(decode(&encode(&later)), Ok(later));
}

#[test]
fn body_axes_turn_into_sensor_axes() {
    // 90 degrees about z: the sensor's x points right, its y backward
    let half = core::f32::consts::FRAC_1_SQRT_2;
    let mut configuration = example(ImuFormat::Kvh);
    configuration.mounting = [half, 0.0, 0.0, half];
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(near(
        configuration.in_sensor_axes([0.0, 1.0, 0.0]),
        [1.0, 0.0, 0.0]
    ));
    assert!(near(
        configuration.in_sensor_axes([-1.0, 0.0, 0.0]),
        [0.0, 1.0, 0.0]
    ));
    assert!(near(
        configuration.in_sensor_axes([0.0, 0.0, 1.0]),
        [0.0, 0.0, 1.0]
    ));
}

/// A correction that never gets to zero, or never moves, would keep every other configuration out.
#[test]
fn what_would_lock_the_device_is_refused() {
    let refused = |change: fn(&mut Configuration), field| {
        let mut configuration = example(ImuFormat::Stim300);
        change(&mut configuration);
        assert_eq!(configuration.check(), Err(field));
        assert_eq!(decode(&encode(&configuration)), Err(Reason::Field(field)));
    };
    refused(
        |configuration| configuration.correction.slew.gyro = 0.0,
        Field::Slew,
    );
    refused(
        |configuration| configuration.correction.slew.accel = 0.0,
        Field::Slew,
    );
    refused(
        |configuration| configuration.correction.slew.accel = 1e-30,
        Field::Slew,
    );
    refused(
        |configuration| configuration.correction.slew.gyro = 1e-9,
        Field::Slew,
    );
    refused(
        |configuration| configuration.correction.silence_us = 3999,
        Field::Silence,
    );
    let mut configuration = example(ImuFormat::Stim300);
    configuration.correction.silence_us = 4000; // at 500 Hz
    // what is never corrected need not fade
    (
        configuration.correction.limit.gyro,
        configuration.correction.slew.gyro,
    ) = (0.0, 0.0);
    assert_eq!(configuration.check(), Ok(()));
}

#[test]
fn a_mounting_that_nobody_knows_has_no_directions_and_is_kept() {
    let mut configuration = example(ImuFormat::Kvh);
    configuration.mounting = UNKNOWN;
    assert_eq!(configuration.direction([1.0, 0.0, 0.0]), [0.0; 3]);
    let arm = configuration.receiver.lever_arm;
    assert_eq!(configuration.in_sensor_axes(arm), arm);
    assert_eq!(
        decode(&encode(&configuration)),
        Ok(configuration.clone().in_body_axes())
    );
    configuration.mounting = [0.5, 0.0, 0.0, 0.0];
    assert_eq!(configuration.check(), Err(Field::Mounting));
}
