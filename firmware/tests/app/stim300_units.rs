//! Units that only the sensor itself reports (STIM300): read at its start, discarded where they may
//! have changed, requested again, and never assumed.

use crate::device::{Device, nets};
use crate::frames::{Kind, values};
use firmware::app::{Config, Phase, phase::Cause};
use firmware::control::{Alignment, Mode};
use firmware::model::Nets;
use firmware::wire::ImuFormat;
use firmware::wire::command::{Request, fault};
use firmware::wire::stim300::config::Config as Stim300;

const STIM: Kind = Kind::STIM;
/// 2e-5 rad/s over 1 ms in counts: increments of 2^-21 deg, rates and averages of 2^-14 deg/s.
const AS_INCREMENT: f64 = 2.403;
const AS_RATE: f64 = 18.774;

fn config(ask: bool) -> Config {
    let mut config = Config {
        mode: Mode::Frozen,
        nets: nets([2e-5, 0.0, 0.0], [0.0; 3]),
        block: 0.01,
        ..STIM.config()
    };
    config.sensor.stim300.ask = ask;
    config
}

/// A device and the number of its next frame.
struct Bench {
    device: Device,
    n: u32,
}

impl Bench {
    fn new(config: Config) -> Bench {
        Bench {
            device: Device::new(config),
            n: 0,
        }
    }

    /// Sends frames, and returns the mean of what was subtracted from the gyro x of the last half.
    fn run(&mut self, frames: u32) -> f64 {
        let mut sum = 0.0;
        for k in 0..frames {
            let frame = STIM.stream(self.n, self.n + 1).remove(0);
            self.n += 1;
            self.device.lines.navigation.sent.clear();
            self.device.feed(&frame);
            self.device.pass_us(1000);
            let sent = self.device.lines.navigation.bytes();
            assert_eq!(sent.len(), frame.len());
            if k >= frames / 2 {
                sum += values(STIM.format, &frame)[0] - values(STIM.format, &sent)[0];
            }
        }
        sum / f64::from(frames - frames / 2)
    }

    fn request(&mut self, text: &str) {
        self.device.lines.navigation.input.extend(text.as_bytes());
        self.device.settle();
    }

    /// Text of the service mode.
    fn text(&mut self) {
        self.device.feed(&b"STIM300 SERVICE MODE\r\n>".repeat(3));
    }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 0.02
}

fn config_datagram(gyro: u8, accel: u8) -> [u8; 26] {
    Stim300::DEFAULT.with_unit_codes(gyro, accel).emit()
}

/// A special datagram of 20 bytes.
fn datagram(id: u8) -> Vec<u8> {
    let mut bytes = vec![id; 16];
    let sum = firmware::wire::checksum::crc32_mpeg2_padded(&bytes);
    bytes.extend(sum.to_be_bytes());
    bytes
}

/// A device without a configured format reads the sensor's datagrams at its start, corrects by
/// them, and answers from them.
#[test]
fn datagrams_at_the_start_of_the_sensor_are_used() {
    for crlf in [false, true] {
        let mut bench = Bench::new(Config {
            format: None,
            ..config(true)
        });
        let averages = Stim300::DEFAULT
            .with_unit_codes(2, 2)
            .with_crlf(crlf)
            .emit();
        let ids = if crlf { [0xB3, 0xB7] } else { [0xB1, 0xB5] };
        let end: &[u8] = if crlf { b"\r\n" } else { b"" };
        for datagram in [datagram(ids[0]), datagram(ids[1]), averages.to_vec()] {
            bench.device.feed(&[&datagram[..], end].concat());
        }
        assert_eq!(bench.device.app.phase(), Phase::Detect);
        let mean = bench.run(1000);
        assert!(near(mean, AS_RATE), "{mean}");
        // it need not be asked
        assert!(bench.device.lines.sensor.sent.is_empty());
        bench.device.lines.navigation.sent.clear();
        bench.request("C\rN\r");
        bench.device.wait_ms(60);
        let answer = [&averages, end, &datagram(ids[0]), end].concat();
        let mut left = bench.device.lines.navigation.sent.clone();
        left.sort_by_key(|answer| std::cmp::Reverse(answer.first().copied()));
        assert_eq!(left.concat(), answer);
    }
}

/// What the sensor has not sent is not answered, whatever is configured.
#[test]
fn nothing_is_answered_that_the_sensor_did_not_send() {
    let mut bench = Bench::new(config(false));
    bench.run(50);
    bench.device.lines.navigation.sent.clear();
    for request in ["C\r", "N\r", "I\r", "T\r", "E\r"] {
        bench.request(request);
        bench.device.wait_ms(60);
        assert!(bench.device.lines.navigation.sent.is_empty(), "{request}");
    }
    assert_eq!(bench.device.counters().requests, 5);
}

/// A sensor whose receiver is not wired never sends its configuration: the device assumes that it
/// is as configured.
#[test]
fn at_the_first_start_the_configuration_is_believed() {
    for ask in [false, true] {
        let mut bench = Bench::new(config(ask));
        let mean = bench.run(1000);
        assert!(near(mean, AS_INCREMENT), "{mean}");
        assert_eq!(bench.device.app.faults(), 0);
    }
}

/// In service mode the units may change. Afterwards nothing is corrected until the sensor has sent
/// them. The device asks for them repeatedly.
#[test]
fn after_service_mode_the_units_are_unknown() {
    for command in ["SERVICEMODE\r", "UTILITYMODE\r"] {
        let mut bench = Bench::new(config(true));
        bench.run(50);
        bench.device.feed(&config_datagram(1, 1)); // the answer to the device's question
        let mean = bench.run(500);
        assert!(near(mean, AS_INCREMENT), "{mean}");
        assert_eq!(bench.device.lines.sensor.bytes(), b"C\r");
        bench.device.lines.sensor.sent.clear();
        bench.request(command);
        bench.text();
        bench.device.wait_ms(50);
        let mean = bench.run(2500);
        assert!(mean == 0.0, "{mean}");
        assert_eq!(bench.device.app.phase(), Phase::Run(Mode::Frozen));
        assert_eq!(bench.device.app.faults(), fault::UNITS);
        // asked at once and after each second, and never while text comes
        let asked = [command, "C\rC\rC\r"].concat();
        assert_eq!(bench.device.lines.sensor.bytes(), asked.as_bytes());
        bench.device.lines.navigation.sent.clear();
        bench.request("C\r");
        bench.device.wait_ms(60);
        assert!(
            bench.device.lines.navigation.sent.is_empty(),
            "an old answer"
        );
        bench.device.feed(&config_datagram(0, 0));
        let mean = bench.run(1000);
        assert!(near(mean, AS_RATE), "{mean}");
        assert_eq!(bench.device.app.faults(), 0);
        // integrated angles now: they cannot be corrected at all
        bench.request(command);
        bench.text();
        bench.run(50);
        let frame = STIM.stream(0, 4).concat();
        bench
            .device
            .feed(&[&config_datagram(3, 3)[..], &frame].concat());
        assert_eq!(bench.device.app.phase(), Phase::Fault(Cause::Units));
        // service mode leads out of this state, too
        bench.request(command);
        assert_eq!(bench.device.app.phase(), Phase::Detect);
        bench.text();
        bench.run(50);
        bench.device.feed(&config_datagram(1, 1));
        let mean = bench.run(1000);
        assert!(near(mean, AS_INCREMENT), "{mean}");
    }
}

/// In bypass the units are not needed, and the sensor is not asked.
#[test]
fn in_bypass_nothing_is_asked() {
    let mut bench = Bench::new(Config {
        mode: Mode::Bypass,
        ..config(true)
    });
    bench.run(50);
    bench.request("SERVICEMODE\r");
    bench.text();
    bench.run(2000);
    assert_eq!(bench.device.lines.sensor.bytes(), b"SERVICEMODE\r");
    assert_eq!(bench.device.app.faults(), 0);
}

/// Measurements that are on their way are corrected as before: the correction must not jump. So are
/// all measurements of a sensor that does not obey. Where it does, its text ends the correction.
#[test]
fn frames_on_their_way_are_corrected() {
    let mut bench = Bench::new(config(false));
    bench.run(50);
    bench.device.order(&Request::Alignment(Alignment::Finished));
    bench.request("SERVICEMODE\r");
    let mean = bench.run(5000);
    assert!(near(mean, AS_INCREMENT), "{mean}");
    assert_eq!(bench.device.app.faults(), 0);
    bench.device.lines.navigation.sent.clear();
    bench.text();
    assert_eq!(bench.device.app.phase(), Phase::Detect);
    let text = b"STIM300 SERVICE MODE\r\n>".repeat(3);
    assert_eq!(bench.device.lines.navigation.bytes(), text);
    assert!(bench.run(500) == 0.0);
    assert_eq!(bench.device.app.faults(), fault::UNITS);
    // back in force no faster than the slew limit: a thousandth of 10 deg/h a second
    bench.device.feed(&config_datagram(1, 1));
    let mean = bench.run(1000);
    assert!(mean > 0.0 && mean < 0.01 * AS_INCREMENT, "{mean}");
}

/// Measurements that are on their way do not end the service mode.
#[test]
fn frames_on_their_way_do_not_bring_run_back() {
    for (frames, cut) in [(3, 0), (10, 0), (40, 11), (100, 27)] {
        let mut bench = Bench::new(Config {
            nets: Nets::NONE,
            ..config(false)
        });
        bench.run(50);
        bench.request("SERVICEMODE\r");
        assert_eq!(bench.device.app.phase(), Phase::Detect);
        let rest = STIM.stream(50, 50 + frames).concat();
        bench.device.feed(&rest[cut..]);
        bench.device.wait_ms(30);
        assert_eq!(bench.device.app.phase(), Phase::Detect, "{frames}");
        bench.text();
        assert_eq!(bench.device.app.phase(), Phase::Detect);
        bench.run(20);
        assert_eq!(bench.device.app.phase(), Phase::Run(Mode::Frozen));
    }
    // a sensor that does not obey, or that left the mode before it sent any text
    let mut bench = Bench::new(Config {
        nets: Nets::NONE,
        ..config(false)
    });
    bench.run(50);
    bench.request("SERVICEMODE\r");
    bench.run(400);
    assert_eq!(bench.device.app.phase(), Phase::Detect);
    bench.run(200);
    assert_eq!(bench.device.app.phase(), Phase::Run(Mode::Frozen));
    assert_eq!(bench.device.app.faults(), fault::UNITS);
}

/// `R`: the sensor restarts and sends its configuration by itself.
#[test]
fn a_reset_makes_the_units_unknown() {
    let mut bench = Bench::new(config(false));
    bench.device.feed(&config_datagram(1, 1));
    assert!(near(bench.run(1000), AS_INCREMENT));
    bench.request("R\r");
    assert!(bench.run(100) == 0.0);
    assert_eq!(bench.device.app.faults(), fault::UNITS);
    bench
        .device
        .feed(&[&datagram(0xB1)[..], &datagram(0xB5), &config_datagram(2, 2)].concat());
    let mean = bench.run(1000);
    assert!(near(mean, AS_RATE), "{mean}");
    assert_eq!(bench.device.counters().restarts, 1);
    assert_eq!(bench.device.app.faults(), 0);
    assert_eq!(STIM.format, ImuFormat::Stim300);
}
