//! An Epson IMU in a layout that only its settings give, and its conversation with a client.

use crate::device::{Device, nets};
use crate::frames::{Kind, kinds};
use firmware::app::{Config, Phase};
use firmware::control::Mode;
use firmware::wire::command::fault;

fn increments() -> Kind {
    let mut all = kinds().into_iter();
    all.find(|kind| kind.sensor.name == "epson M-G370PDF1 increments")
        .expect("it")
}

fn device(kind: Kind) -> Device {
    Device::new(Config {
        mode: Mode::Frozen,
        block: 0.02,
        nets: nets([0.0; 3], [0.0; 3]),
        ..kind.config()
    })
}

/// A client reads registers while bursts come: each answer passes whole and in order, with a start
/// mark of a burst in it too.
#[test]
fn answers_of_registers_pass_between_the_bursts() {
    let kind = increments();
    let mut device = device(kind);
    let bursts = kind.stream(0, 20);
    let answers = [[0x4C, 0x53, 0x45, 0x0D], [0x0C, 0x80, 0x03, 0x0D]];
    let mut line = Vec::new();
    for (n, burst) in bursts.iter().enumerate() {
        line.extend(burst);
        if n >= 5 {
            line.extend(answers[n % 2]);
        }
    }
    for piece in line.chunks(7) {
        device.feed(piece);
    }
    device.wait_ms(200);
    assert_eq!(device.lines.navigation.sent.concat(), line);
    assert_eq!(device.counters().frames, 20);
    assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
}

/// Configured with another layout, the device finds no burst: all bytes pass, nothing is corrected,
/// and the fault says so.
#[test]
fn bursts_of_another_layout_pass_and_are_reported() {
    let kind = increments();
    let mut config = kind.config();
    config.sensor.epson.layout = firmware::wire::epson::Layout::new(0xCC07, 0x4C00).expect("fits");
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        nets: nets([1e-3; 3], [1.0; 3]),
        ..config
    });
    let line = kind.stream(0, 600).concat();
    for piece in line.chunks(36) {
        device.feed(piece);
        device.wait_ms(2);
    }
    device.wait_ms(200);
    assert_eq!(device.lines.navigation.sent.concat(), line);
    assert_eq!(device.counters().frames, 0);
    assert!(device.app.faults() & fault::UNKNOWN_FORMAT != 0);
}

/// Without a configured format, bursts are found in the layout of the settings.
#[test]
fn the_configured_layout_is_searched_for() {
    let kind = increments();
    let mut device = Device::new(Config {
        format: None,
        ..kind.config()
    });
    kind.stream(0, 20)
        .iter()
        .for_each(|burst| device.feed(burst));
    assert!(matches!(device.app.phase(), Phase::Run(_)));
    assert!(device.counters().frames >= 16);
}
