//! The configuration over the command link: it is taken as a whole or not at all.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, kinds, values};
use crate::record::{
    HARDWARE, board, commit, configure, configured, read, record, sealed, unconfigured, upload,
    write,
};
use firmware::app::{Config, Hardware, Phase};
use firmware::configuration::record::MAX_LEN;
use firmware::configuration::{Configuration, Parity, SCHEMA};
use firmware::control::{Alignment, Field, Mode, Reason};
use firmware::model::Nets;
use firmware::units::{DEGREE, G};
use firmware::wire::command::{Board, MAX_PACKET, Request, Response, decode, encode, fault};

const STIM: Kind = Kind::STIM;
const KVH: Kind = Kind::KVH;

#[test]
fn an_unconfigured_device_passes_bytes_and_reports_it() {
    let mut device = unconfigured();
    let mut frames = STIM.stream(0, 40);
    device.feed(&frames[..20].concat());
    for mode in [Mode::Frozen, Mode::Shadow, Mode::Learn] {
        device.ask(&Request::SetMode(mode), |answer| {
            assert_eq!(answer, Response::Refused(Reason::NotConfigured));
        });
    }
    device.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(
        device.app.faults() & fault::NOT_CONFIGURED,
        fault::NOT_CONFIGURED
    );
    assert!(read(&mut device).is_empty());
    board(&mut device, |board| {
        let expected = Board {
            name: "a board",
            uart_clocks: [84_000_000, 42_000_000, 42_000_000],
            bauds: [923_077, 913_043, 115_068],
            pin_sets: 2,
            stores: false,
            schema: SCHEMA,
            configured: false,
            stored: false,
        };
        assert_eq!(*board, expected);
    });
    device.feed(&frames.split_off(20).concat());
    assert_eq!(device.lines.navigation.bytes(), STIM.stream(0, 40).concat());
    // what the desktop and the tests make by themselves counts as configured
    let device = Device::new(STIM.config());
    assert_eq!(device.app.faults() & fault::NOT_CONFIGURED, 0);
}

/// Every format, one after another, on one device; the stream has no hole, wherever in a frame the
/// change comes.
#[test]
fn every_sensor_one_after_another() {
    let mut device = unconfigured();
    for (n, kind) in kinds().into_iter().enumerate() {
        let stream = kind.stream(0, 40).concat();
        let cut = stream.len() / 2 + 3 * n;
        device.lines.navigation.sent.clear();
        device.feed(&stream[..5]);
        device.order(&Request::SetMode(Mode::Bypass));
        let record = record(&configured(kind));
        assert_eq!(configure(&mut device, &record), Ok(()), "{kind:?}");
        assert_eq!(read(&mut device), record);
        assert_eq!(device.app.faults() & fault::NOT_CONFIGURED, 0);
        assert!(board(&mut device, |board| board.configured && !board.stored));
        device.feed(&stream[5..cut]);
        device.order(&Request::SetMode(Mode::Frozen));
        device.feed(&stream[cut..]);
        device.wait_ms(200);
        assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen), "{kind:?}");
        assert!(device.counters().frames >= 38, "{kind:?}");
    }
}

/// The same format again, in the middle of a frame: no byte is lost and none comes twice.
#[test]
fn a_frame_that_arrives_meanwhile_is_not_lost() {
    for kind in kinds() {
        let mut device = unconfigured();
        let stream = kind.stream(0, 60).concat();
        let mut of = configured(kind);
        assert_eq!(configure(&mut device, &record(&of)), Ok(()));
        for cut in [1, 7, 17] {
            of.rate += 1.0;
            let at = stream.len() / 60 * (cut + 10) + cut;
            device.lines.navigation.sent.clear();
            device.feed(&stream[..at]);
            device.wait_ms(25);
            assert_eq!(configure(&mut device, &record(&of)), Ok(()), "{kind:?}");
            device.feed(&stream[at..]);
            assert!(device.lines.navigation.bytes() == stream, "{kind:?} {cut}");
            assert_eq!(device.counters().bad_checksums, 0);
        }
    }
}

/// A refused configuration leaves the old one in use: its record, its scale, its weights.
#[test]
fn every_refusal_keeps_the_old_one() {
    let mut device = unconfigured();
    let old = record(&configured(KVH));
    assert_eq!(configure(&mut device, &old), Ok(()));
    let good = record(&configured(STIM));
    let change = |change: fn(&mut Configuration)| {
        let mut configuration = configured(STIM);
        change(&mut configuration);
        record(&configuration)
    };
    let cases: Vec<(Vec<u8>, Reason)> = vec![
        (vec![], Reason::Record),
        (vec![0; 600], Reason::Record),
        (b"LRNC".to_vec(), Reason::Record),
        (good[..good.len() - 1].to_vec(), Reason::Record),
        ([&good[..], &[0]].concat(), Reason::Record),
        (sealed([&good[..], &[0]].concat()), Reason::Record),
        (
            sealed({
                let mut newer = good.clone();
                newer[4] += 1;
                newer
            }),
            Reason::Schema(SCHEMA),
        ),
        (change(|c| c.rate = 0.0), Reason::Field(Field::Rate)),
        (change(|c| c.rate = f64::NAN), Reason::Field(Field::Rate)),
        (
            change(|c| c.mounting = [1.0; 4]),
            Reason::Field(Field::Mounting),
        ),
        (
            change(|c| c.gyro.white_noise = f32::INFINITY),
            Reason::Field(Field::Gyro),
        ),
        (
            change(|c| c.receiver.lever_arm[2] = 1e3),
            Reason::Field(Field::LeverArm),
        ),
        (
            change(|c| c.lines.sensor_baud = 10_000_000),
            Reason::Baud(5_250_000),
        ),
        (
            change(|c| c.lines.receiver_baud = 4_000_000),
            Reason::Baud(3_818_182),
        ),
        (change(|c| c.lines.pins = 2), Reason::Pins(2)),
    ];
    for (bytes, reason) in cases {
        assert_eq!(configure(&mut device, &bytes), Err(reason));
        assert_eq!(read(&mut device), old, "{reason:?}");
        device.feed(&KVH.stream(0, 2).concat());
        assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
        assert_eq!(device.app.to_open(), None);
    }
    // one bit anywhere
    for at in 0..good.len() {
        let mut damaged = good.clone();
        damaged[at] ^= 1 << (at % 8);
        assert_eq!(
            configure(&mut device, &damaged),
            Err(Reason::Record),
            "{at}"
        );
    }
    assert_eq!(read(&mut device), old);
    assert_eq!(configure(&mut device, &good), Ok(()));
    assert_eq!(read(&mut device), good);
}

#[test]
fn pieces_in_any_order_and_twice() {
    let mut device = unconfigured();
    let record = record(&configured(STIM));
    let gap = Request::WriteConfiguration {
        offset: 1,
        bytes: &record[1..9],
    };
    device.ask(&gap, |answer| {
        assert_eq!(answer, Response::Refused(Reason::Range));
    });
    write(&mut device, 0, &record[..100]);
    write(&mut device, 0, &record[..100]);
    write(&mut device, 90, &record[90..120]);
    assert_eq!(commit(&mut device, record.len()), Err(Reason::Record));
    assert_eq!(commit(&mut device, 120), Err(Reason::Record));
    write(&mut device, 100, &record[100..]);
    assert_eq!(commit(&mut device, 120), Err(Reason::Record));
    assert_eq!(commit(&mut device, record.len()), Ok(()));
    device.feed(&STIM.stream(0, 10).concat());
    let frames = device.counters().frames;
    // the answer was lost: asked again, also in another mode, nothing restarts
    assert_eq!(commit(&mut device, record.len()), Ok(()));
    device.order(&Request::SetMode(Mode::Frozen));
    assert_eq!(commit(&mut device, record.len()), Ok(()));
    assert_eq!((device.counters().frames, frames), (10, 10));
    let long = Request::ReadConfiguration {
        offset: 0,
        length: 129,
    };
    let far = Request::ReadConfiguration {
        offset: MAX_LEN as u32,
        length: 1,
    };
    for request in [long, far] {
        device.ask(&request, |answer| {
            assert_eq!(answer, Response::Refused(Reason::Range));
        });
    }
    device.order(&Request::SetMode(Mode::Bypass));
    device.feed(&STIM.stream(10, 300).concat()); // faded out
    // a weight image is no record
    let image = vec![0x4C; 600];
    assert_eq!(configure(&mut device, &image), Err(Reason::Record));
}

/// A correction must not jump: a configuration comes in bypass, and not while the navigation
/// computer aligns itself or a correction fades out.
#[test]
fn not_while_it_corrects_or_aligns() {
    let mut device = unconfigured();
    let mut of = configured(KVH);
    (of.correction.limit.gyro, of.correction.slew.gyro) = (0.05, 1e-4);
    assert_eq!(configure(&mut device, &record(&of)), Ok(()));
    of.rate += 1.0;
    let other = record(&of);
    device.order(&Request::SetMode(Mode::Shadow));
    assert_eq!(configure(&mut device, &other), Err(Reason::Mode));
    device.order(&Request::SetMode(Mode::Bypass));
    device.order(&Request::Alignment(Alignment::Started));
    assert_eq!(configure(&mut device, &other), Err(Reason::Alignment));
    device.order(&Request::Alignment(Alignment::Finished));
    assert_eq!(configure(&mut device, &other), Ok(()));
    // the alignment is remembered: a mode that corrects from the start only fades in
    of.correction.mode = Mode::Frozen;
    of.correction.slew.gyro = 1e-6;
    assert_eq!(configure(&mut device, &record(&of)), Ok(()));
    let rate = |device: &Device| {
        let sent = device.lines.navigation.sent.last().expect("a frame");
        -values(KVH.format, sent)[0] * KVH.rate()
    };
    let mut n = 0;
    let mut run = |device: &mut Device, frames: u32| {
        for _ in 0..frames {
            device.feed(&KVH.frame(n, Fields::default()));
            n += 1;
        }
    };
    let mut frozen = Device::new(Config {
        nets: nets([1e-3, 0.0, 0.0], [0.0; 3]),
        mode: Mode::Bypass,
        ..Config::of(&of)
    });
    run(&mut frozen, 10);
    frozen.order(&Request::Alignment(Alignment::Finished));
    frozen.order(&Request::SetMode(Mode::Frozen));
    run(&mut frozen, 1000);
    assert!((1e-7..1e-4).contains(&rate(&frozen)), "{}", rate(&frozen));
    frozen.order(&Request::SetMode(Mode::Bypass));
    assert_eq!(configure(&mut frozen, &other), Err(Reason::Mode));
}

/// Weights belong to the sensor that they were learnt for.
#[test]
fn weights_of_another_sensor_are_not_used() {
    let learnt = nets([1e-5, 0.0, 0.0], [0.0; 3]);
    let mut first = configured(STIM);
    first.identity.serial = "N1".try_into().expect("short");
    let config = Config {
        nets: learnt,
        ..Config::of(&first)
    };
    let mut device = Device::new(config);
    assert_eq!(read(&mut device), record(&first));
    let mut again = first.clone();
    again.rate = 500.0;
    assert_eq!(configure(&mut device, &record(&again)), Ok(()));
    assert_eq!(*device.app.nets(), learnt, "the same sensor");
    assert_eq!(device.app.faults() & fault::WEIGHTS, 0);
    for serial in ["N2", ""] {
        let mut other = again.clone();
        other.identity.serial = serial.try_into().expect("short");
        let mut device = Device::new(Config {
            nets: learnt,
            ..Config::of(&first)
        });
        assert_eq!(configure(&mut device, &record(&other)), Ok(()));
        assert_eq!(*device.app.nets(), Nets::NONE);
        assert_ne!(device.app.faults() & fault::WEIGHTS, 0);
        // said until there are weights for this sensor
        assert_eq!(configure(&mut device, &record(&other)), Ok(()));
        assert_ne!(device.app.faults() & fault::WEIGHTS, 0);
        let request = Request::SetMode(Mode::Frozen);
        device.order(&request);
        device.feed(&STIM.stream(0, 500).concat());
        assert_eq!(device.lines.navigation.sent, STIM.stream(0, 500));
    }
    // weights that were there before any configuration count as this sensor's
    let mut device = Device::new(Config {
        nets: learnt,
        ..Config::unconfigured(HARDWARE)
    });
    assert_eq!(configure(&mut device, &record(&first)), Ok(()));
    assert_eq!(*device.app.nets(), learnt);
}

#[test]
fn lines_are_reopened_when_they_change() {
    let mut device = unconfigured();
    let mut of = configured(STIM);
    assert_eq!(configure(&mut device, &record(&of)), Ok(()));
    assert_eq!(device.app.to_open(), None, "as without a configuration");
    of.lines.sensor_baud = 1_843_200;
    of.lines.parity = Parity::Odd;
    of.lines.pins = 1;
    assert_eq!(configure(&mut device, &record(&of)), Ok(()));
    assert_eq!(device.app.to_open(), Some(of.lines));
    assert_eq!(device.app.to_open(), None, "once");
    board(&mut device, |board| {
        assert_eq!(board.bauds, [1_826_087, 1_826_087, 115_068]);
    });
    // a board without parity
    let hardware = Hardware {
        parity: false,
        ..HARDWARE
    };
    let mut device = Device::new(Config::unconfigured(hardware));
    let refused = Err(Reason::Field(Field::Parity));
    assert_eq!(configure(&mut device, &record(&of)), refused);
    of.lines.parity = Parity::None;
    of.lines.two_stop_bits = true;
    assert_eq!(configure(&mut device, &record(&of)), refused);
    of.lines.two_stop_bits = false;
    assert_eq!(configure(&mut device, &record(&of)), Ok(()));
}

/// A client that has the answer may send on the lines at once: they are open as configured.
#[test]
fn the_answer_comes_when_the_lines_are_open() {
    let mut device = unconfigured();
    let mut of = configured(STIM);
    of.lines.sensor_baud = 1_843_200;
    let record = record(&of);
    upload(&mut device, &record);
    device.lines.command.sent.clear();
    let length = record.len() as u32;
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(9, &Request::CommitConfiguration { length }, &mut buffer).expect("short");
    device.lines.command.input.extend(&*packet);
    let mut opened = false;
    for _ in 0..3 {
        let busy = device.app.poll(&mut device.lines, &device.time);
        assert!(opened || device.lines.command.sent.is_empty());
        opened |= device.app.to_open() == Some(of.lines);
        assert!(
            busy || !device.lines.command.sent.is_empty(),
            "no sleep before"
        );
    }
    assert!(opened);
    let [answer] = &mut *device.lines.command.sent else {
        panic!("{:?}", device.lines.command.sent);
    };
    assert_eq!(decode::<Response>(answer), Ok((9, Response::Done)));
}

/// A configuration that is the default in everything gives the default application, but for the
/// limits, which follow from the unit's biases: 0.34 deg/h and 410 ug, three times.
#[test]
fn the_default_configuration_is_the_default() {
    let of = Config::of(&Configuration::default());
    let default = Config {
        configuration: of.configuration.clone(),
        limit: of.limit,
        slew: of.slew,
        ..Config::default()
    };
    assert_eq!(format!("{of:?}"), format!("{default:?}"));
    let [gyro, accel] = [f64::from(of.limit.gyro), f64::from(of.limit.accel)];
    assert!(
        (gyro / (3.0 * 0.3362 * DEGREE / 3600.0) - 1.0).abs() < 1e-2,
        "{gyro}"
    );
    assert!((accel / (3.0 * 408e-6 * G) - 1.0).abs() < 1e-2, "{accel}");
    assert!((of.slew.gyro / of.limit.gyro - 1e-3).abs() < 1e-9);
}
