//! Requests to the sensor, and answers that the device gives on the sensor's behalf.

use crate::device::{Device, nets};
use crate::frames::{Kind, values};
use firmware::app::{Config, Phase};
use firmware::control::Mode;
use firmware::wire::checksum::crc32_mpeg2_padded;
use firmware::wire::stim300::config::Config as Stim300;
use firmware::wire::{ImuFormat, Settings};

const STIM: Kind = Kind::STIM;

/// A STIM300 that is asked for its configuration.
fn asking() -> Settings {
    let mut sensor = STIM.config().sensor;
    sensor.stim300.ask = true;
    sensor
}

fn device(config: Config) -> Device {
    let mut device = Device::new(config);
    device.feed(&STIM.stream(0, 20).concat());
    device.lines.navigation.sent.clear();
    device
}

/// A special datagram of 20 bytes.
fn datagram(id: u8) -> Vec<u8> {
    datagram_of(id, 20)
}

/// A special datagram of this length.
fn datagram_of(id: u8, len: usize) -> Vec<u8> {
    let mut bytes = vec![id; len - 4];
    let sum = crc32_mpeg2_padded(&bytes);
    bytes.extend(sum.to_be_bytes());
    bytes
}

fn request(device: &mut Device, bytes: &[u8]) {
    device.lines.navigation.input.extend(bytes);
    device.settle();
}

#[test]
fn commands_go_to_the_sensor_and_its_answers_come_back() {
    let mut device = device(STIM.config());
    request(&mut device, b"C\rN\r\x00xyz\r");
    assert_eq!(device.lines.sensor.bytes(), b"C\rN\r\x00xyz\r");
    assert_eq!(device.counters().requests, 3);
    let answer = Stim300::DEFAULT.with_sample_rate_code(4).emit();
    device.feed(&answer);
    assert_eq!(device.lines.navigation.bytes(), answer);
    device.wait_ms(80);
    // N was the last request and no answer to it is stored: none is made up
    assert_eq!(device.lines.navigation.bytes(), answer);
    assert_eq!(device.counters().answered, 0);
    // the sensor's own answer is what is stored from now on
    request(&mut device, b"C\r");
    device.wait_ms(49);
    assert_eq!(device.counters().answered, 0);
    device.wait_ms(2);
    assert_eq!(device.lines.navigation.bytes(), [answer, answer].concat());
    assert_eq!(device.counters().answered, 1);
}

/// A client that starts with the wrong format waits for the answer to `C`
/// (vortexntnu/stim300-driver). The device gives it from what the sensor sent at its start, and
/// never from its own configuration, which may be wrong.
#[test]
fn a_silent_sensor_is_answered_for() {
    for crlf in [false, true] {
        let stim300 = Stim300::DEFAULT.with_unit_codes(2, 2).with_crlf(crlf);
        let mut device = Device::new(STIM.config());
        request(&mut device, b"C\r");
        device.wait_ms(60);
        assert_eq!(device.counters().answered, 0);
        device.feed(&stim300.emit());
        device.feed(&STIM.stream(0, 20).concat());
        device.lines.navigation.sent.clear();
        request(&mut device, b"C\r");
        device.wait_ms(60);
        let end: &[u8] = if crlf { b"\r\n" } else { b"" };
        assert_eq!(
            device.lines.navigation.bytes(),
            [&stim300.emit()[..], end].concat()
        );
        // between two frames, not into one
        let frame = &STIM.stream(20, 22);
        device.lines.navigation.sent.clear();
        device.feed(&frame[0][..11]);
        request(&mut device, b"C\r");
        device.feed(&frame[0][11..]);
        device.wait_ms(60);
        assert_eq!(device.lines.navigation.sent[0], frame[0]);
        let mut config = STIM.config();
        config.sensor.stim300.answer_us = None;
        let mut never = self::device(config);
        request(&mut never, b"C\r");
        never.wait_ms(500);
        assert!(never.lines.navigation.sent.is_empty());
    }
}

/// Part and serial number are answered from the datagrams that the sensor sent after its power-on.
#[test]
fn stored_datagrams_answer() {
    let mut device = Device::new(STIM.config());
    device.feed(&[datagram(0xB1), datagram(0xB5), STIM.stream(0, 10).concat()].concat());
    device.lines.navigation.sent.clear();
    for (command, id) in [(b"N\r", 0xB1), (b"I\r", 0xB5)] {
        request(&mut device, command);
        device.wait_ms(60);
        assert_eq!(device.lines.navigation.sent.pop(), Some(datagram(id)));
    }
}

/// The first correction uses the sensor's configuration, which is asked for once.
#[test]
fn the_configuration_is_asked_for() {
    let mut device = device(Config {
        sensor: asking(),
        mode: Mode::Frozen,
        nets: nets([2e-5, 0.0, 0.0], [0.0; 3]),
        block: 0.01,
        ..STIM.config()
    });
    device.wait_ms(5);
    assert_eq!(device.lines.sensor.bytes(), b"C\r");
    let first = |device: &Device| {
        values(
            ImuFormat::Stim300,
            device.lines.navigation.sent.last().expect("a frame"),
        )[0]
    };
    let plain = |n: u32| values(ImuFormat::Stim300, &STIM.stream(n, n + 1)[0])[0];
    (20..40).for_each(|n| device.feed(&STIM.stream(n, n + 1)[0]));
    // 2e-5 rad/s for 1 ms is 2.4 counts of 2^-21 deg
    assert!((first(&device) - plain(39) + 2.4).abs() < 1.0);
    // the sensor sends rates: the same error is 18.8 counts of 2^-14 deg/s
    device.feed(&Stim300::DEFAULT.with_unit_codes(0, 0).emit());
    (40..80).for_each(|n| device.feed(&STIM.stream(n, n + 1)[0]));
    assert!(
        (first(&device) - plain(79) + 18.8).abs() < 1.0,
        "{}",
        first(&device) - plain(79)
    );
    assert_eq!(device.lines.sensor.bytes(), b"C\r");
}

/// Another datagram than the one asked for does not count as the answer.
#[test]
fn another_answer_is_no_answer() {
    let config_datagram = Stim300::DEFAULT.with_sample_rate_code(2).emit();
    let mut device = Device::new(STIM.config());
    device.feed(&[&config_datagram[..], &STIM.stream(0, 20).concat()].concat());
    request(&mut device, b"C\rE\r");
    device.feed(&datagram_of(0xBE, 21));
    device.wait_ms(60);
    assert_eq!(device.counters().answered, 1);
    assert_eq!(
        device.lines.navigation.sent.pop(),
        Some(config_datagram.to_vec())
    );
}

/// A sensor that has sent its configuration by itself is not asked.
#[test]
fn the_configuration_is_not_asked_for_twice() {
    let mut device = Device::new(Config {
        sensor: asking(),
        mode: Mode::Frozen,
        ..STIM.config()
    });
    device.wait_ms(50);
    device.feed(&Stim300::DEFAULT.emit());
    device.feed(&STIM.stream(0, 20).concat());
    device.wait_ms(50);
    assert!(device.lines.sensor.sent.is_empty());
}

/// Service mode requested in the middle of a frame: the beginning of the frame is not lost.
#[test]
fn service_mode_cuts_no_frame() {
    let mut device = device(STIM.config());
    let frame = &STIM.stream(20, 21)[0];
    device.feed(&frame[..11]);
    device.lines.navigation.input.extend(b"SERVICEMODE\r");
    device.wait_ms(25);
    assert_eq!(device.app.phase(), Phase::Detect);
    device.feed(&frame[11..]);
    assert_eq!(device.lines.navigation.bytes(), *frame);
}

/// In service mode the sensor sends text: all bytes pass, and frames are found again afterwards.
#[test]
fn service_mode_passes_text() {
    let mut device = device(STIM.config());
    request(&mut device, b"SERVICEMODE\r");
    assert_eq!(device.app.phase(), Phase::Detect);
    let text = b"STIM300 service mode\r\n>".repeat(50);
    device.feed(&text);
    request(&mut device, b"x\r");
    assert_eq!(device.lines.navigation.bytes(), text);
    assert_eq!(device.lines.sensor.bytes(), b"SERVICEMODE\rx\r");
    device.feed(&STIM.stream(0, 20).concat());
    assert_eq!(device.app.phase(), Phase::Run(Mode::Bypass));
}

/// Other formats' commands pass unread.
#[test]
fn other_formats_commands_pass() {
    let kind = Kind::KVH;
    let mut device = Device::new(kind.config());
    device.feed(&kind.stream(0, 5).concat());
    request(&mut device, b"=CONFIG,1\r\nC\r");
    assert_eq!(device.lines.sensor.bytes(), b"=CONFIG,1\r\nC\r");
    device.wait_ms(100);
    assert_eq!(
        (device.counters().requests, device.counters().answered),
        (0, 0)
    );
    // no room towards the sensor: dropped whole and counted
    device.lines.sensor.room = 3;
    request(&mut device, b"=DR,100\n");
    assert_eq!(device.counters().dropped, 1);
}

/// Identifiers of the other family, for a client that knows only that one.
#[test]
fn family_is_translated() {
    use firmware::wire::stim300::{Contents, Extra};
    let kind = Kind::STIM_F7;
    let mut config = kind.config();
    config.sensor.stim300.family = Some(Extra::Aux);
    let mut device = Device::new(config);
    device.feed(&kind.stream(0, 5).concat());
    assert_eq!(device.lines.navigation.sent, Kind::STIM_AF.stream(0, 5));
    assert_eq!(Contents::from_id(0xAF).map(|c| c.extra), Some(Extra::Aux));
}
