//! Receivers of every kind and their time pulse, through the application's lines.

use crate::device::Device;
use crate::frames::{Fields, Kind};
use firmware::app::Config;
use firmware::configuration::{Configuration, Receiver, ReceiverProtocol};
use firmware::fix::NOT_MEASURED;
use firmware::wire::command::{Request, Response, Sync, Times};
use firmware::wire::receiver::{ReceiverFormat, ReceiverStatus};
use firmware::wire::ubx::Pvt;

/// A receiver at 9600 bit/s: a byte takes so many microseconds.
const BYTE_US: u64 = 1042;
const KIND: Kind = Kind::KVH;

fn sentence(text: &str) -> Vec<u8> {
    let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${text}*{sum:02X}\r\n").into_bytes()
}

/// A configured device, a sensor that sends every 5 ms, and a receiver.
struct Bench {
    device: Device,
    /// The sensor also sends a byte of no frame 3 ms after each.
    chats: bool,
    frames: u32,
    /// When each came, microseconds.
    came: Vec<u64>,
    /// Bytes of the receiver that are on their way, and when they come, microseconds.
    coming: Vec<(u64, u8)>,
    /// Pulses, microseconds.
    pulses: Vec<u64>,
}

impl Bench {
    fn new(change: impl FnOnce(&mut Receiver)) -> Bench {
        let mut configuration = Configuration::default();
        change(&mut configuration.receiver);
        let config = Config {
            configuration: Some(configuration),
            ..KIND.config()
        };
        Bench {
            device: Device::new(config),
            chats: false,
            frames: 0,
            came: Vec::new(),
            coming: Vec::new(),
            pulses: Vec::new(),
        }
    }

    fn send(&mut self, at_us: u64, bytes: &[u8]) {
        let times = (1..).map(|n| at_us + n * BYTE_US);
        self.coming.extend(times.zip(bytes.iter().copied()));
    }

    /// Runs to this time in steps of a millisecond.
    fn run(&mut self, until_us: u64) {
        loop {
            let now = self.device.time.get();
            if now >= until_us {
                return;
            }
            for at in self.pulses.extract_if(.., |at| *at <= now) {
                self.device.app.pulse(at);
            }
            let come = self.coming.extract_if(.., |(at, _)| *at <= now);
            let gnss = &mut self.device.lines.gnss.input;
            gnss.extend(come.map(|(_, byte)| byte));
            if now.is_multiple_of(5000) {
                self.frames += 1;
                self.came.push(now);
                let frame = KIND.frame(self.frames, Fields::default());
                self.device.lines.sensor.input.extend(&frame);
            } else if self.chats && now % 5000 == 3000 {
                self.device.lines.sensor.input.extend([0]);
            }
            self.device.settle();
            self.device.lines.navigation.sent.clear();
            let now = now / 1000 * 1000;
            self.device.time.set(now + 1000);
        }
    }

    fn status(&mut self) -> ReceiverStatus {
        self.device
            .ask(&Request::GetReceiver, |answer| match answer {
                Response::Receiver(status) => status,
                other => panic!("{other:?}"),
            })
    }
}

fn rmc_gga(second: u64) -> Vec<u8> {
    let time = format!("12{:02}{:02}.00", second / 60, second % 60);
    [
        sentence(&format!(
            "GNRMC,{time},A,4717.11399,N,00833.91590,E,10.000,90.00,221126,,,A"
        )),
        sentence(&format!(
            "GNGGA,{time},4717.11399,N,00833.91590,E,2,12,1.0,499.6,M,48.1,M,,"
        )),
    ]
    .concat()
}

/// Through the lines: the receiver's time of the samples comes with the pulses and the fixes, stays
/// while they are missing, and is that of the simulation to the step of a millisecond.
#[test]
fn samples_have_the_receivers_time() {
    [false, true].into_iter().for_each(have_the_receivers_time);
}

fn have_the_receivers_time(chats: bool) {
    let mut bench = Bench::new(|receiver| {
        receiver.protocol = ReceiverProtocol::Nmea;
        receiver.pulse = true;
    });
    bench.chats = chats;
    let mut states = Vec::new();
    for second in 1..40 {
        if second < 30 {
            bench.pulses.push(1_000_000 * second + 123);
        }
        bench.send(1_000_000 * second + 100_000, &rmc_gga(second));
        bench.run(1_000_000 * second + 900_000);
        let times = bench.device.ask(&Request::GetTimes, |answer| match answer {
            Response::Times(times) => times,
            other => panic!("{other:?}"),
        });
        states.push(times.sync);
        if times.sync == Sync::None {
            assert_eq!(times, Times::default());
            continue;
        }
        assert!(times.board_ppb.abs() < 2000, "{times:?}");
        // second 1 is at 1.000123 s; 22 November 2026 is a Sunday
        let came = |sample: u32| bench.came[sample as usize];
        let at_us = came(times.sample) + 12 * 3600 * 1_000_000;
        let off = (times.sample_us + 123).abs_diff(at_us);
        assert!(off <= 1500, "{off} {times:?}");
        let passed_us = (came(times.sample) - came(100)) as f32;
        let interval_us = passed_us / (times.sample - 100) as f32;
        let off = times.interval_ns * 1e-3 / interval_us - 1.0;
        assert!(off.abs() < 1e-3, "{off} {times:?}");
    }
    let count = |sync| states.iter().filter(|state| **state == sync).count();
    let counts = [Sync::None, Sync::Locked, Sync::Holdover].map(count);
    assert!(
        counts[0] <= 9 && counts[1] >= 22 && counts[2] >= 7,
        "{counts:?}"
    );
}

/// The delay is configured as 0.1 s and is 0.6 s. With a pulse the age comes out as 0.6 s plus the
/// time that the bytes take, at the last sample, whatever the sensor sends besides. Without one it
/// is not known.
#[test]
fn the_pulse_makes_the_age_exact() {
    for (wired, chats) in [(true, false), (true, true), (false, false)] {
        let mut bench = Bench::new(|receiver| {
            receiver.protocol = ReceiverProtocol::Nmea;
            receiver.fix_delay = 0.1;
            receiver.pulse = wired;
        });
        bench.chats = chats;
        for second in 1..30 {
            bench.pulses.push(1_000_000 * second + 123);
            let bytes = rmc_gga(second);
            let took = bytes.len() as u64 * BYTE_US;
            bench.send(1_000_000 * second + 600_000, &bytes);
            bench.run(1_000_000 * second + 900_000);
            let fix = *bench.device.app.fix().expect("a fix");
            let arrived = 1_000_000 * second + 600_000 + BYTE_US;
            assert!(fix.arrived_us.abs_diff(arrived) <= 1000, "{fix:?}");
            // 153 ms for the rest of the sentences: 30 samples
            assert!(fix.waited.abs_diff((took / 5000) as u32) <= 1, "{fix:?}");
            match fix.age {
                Some(age) => {
                    let want = 0.6 + took as f32 * 1e-6;
                    assert!(wired && second >= 5 && (age - want).abs() < 0.005, "{age}");
                    let valid = 1_000_000 * second + 123;
                    let is_at = |came: &u64| {
                        let since = came.saturating_sub(valid) as f32 * 1e-6;
                        (age - since).abs() < 2e-4
                    };
                    assert!(bench.came.iter().any(is_at), "{age}");
                }
                None => assert!(!wired || second < 5, "{second}"),
            }
        }
        let status = bench.status();
        assert_eq!(status.format, Some(ReceiverFormat::Nmea));
        assert_eq!(status.pulses, if wired { 29 } else { 0 });
        assert_eq!(status.age_us.is_some(), wired);
        // 22 November 2026 is a Sunday
        assert_eq!(status.time_ms, Some((12 * 3600 + 29) * 1000));
        // the pulse stays away
        let mut ages = Vec::new();
        for second in 30..40 {
            bench.send(1_000_000 * second + 600_000, &rmc_gga(second));
            bench.run(1_000_000 * second + 900_000);
            ages.push(bench.device.app.fix().expect("a fix").age.is_some());
        }
        assert_eq!(ages[..4], [wired; 4]);
        assert_eq!(ages[5..], [false; 5]);
    }
}

/// Position, velocity, what is assumed of their accuracy, and the heading of two antennas, of which
/// the second is to the right of the first.
#[test]
fn sentences_become_a_fix() {
    let mut bench = Bench::new(|receiver| {
        receiver.protocol = ReceiverProtocol::Nmea;
        receiver.heading_offset = core::f32::consts::FRAC_PI_2;
    });
    for second in 1..4 {
        let heading = sentence("GNHDT,135.00,T");
        bench.send(1_000_000 * second, &[rmc_gga(second), heading].concat());
        bench.send(
            1_000_000 * second + 300_000,
            b"$GNTXT,01,01,02,ANT OK*2B\r\n",
        );
        bench.run(1_000_000 * second + 900_000);
    }
    let fix = bench.device.app.fix().expect("a fix");
    let near = |a: f64, b: f64, within| (a - b).abs() < within;
    let lat = (47.0 + 17.113_99 / 60.0_f64).to_radians();
    let lon = (8.0 + 33.915_9 / 60.0_f64).to_radians();
    assert!(near(fix.position.latitude, lat, 1e-12), "{fix:?}");
    assert!(near(fix.position.longitude, lon, 1e-12), "{fix:?}");
    assert!(near(fix.position.height, 547.7, 1e-9), "{fix:?}");
    assert!(near(fix.velocity[0], 0.0, 1e-5), "{fix:?}");
    assert!(near(fix.velocity[1], 18_520.0 / 3600.0, 1e-5), "{fix:?}");
    // 1.9 m at HDOP 1 are 1.34 m along an axis
    for (sigma, want) in fix.sigmas.iter().zip([1.3435, 1.3435, 3.8, 0.1, 0.1]) {
        assert!(near((*sigma).into(), want, 1e-3), "{fix:?}");
    }
    assert_eq!(fix.sigmas[5], NOT_MEASURED);
    let heading = fix.heading.expect("of two antennas");
    assert!(near(heading.angle.into(), 45_f64.to_radians(), 1e-6));
    let counters = bench.device.counters();
    assert_eq!((counters.fixes, counters.good_fixes), (3, 3));
}

#[test]
fn the_protocol_is_detected_or_configured() {
    let pvt = |second: u64| {
        let pvt = Pvt {
            time_of_week: second as u32 * 1000,
            fix: 3,
            flags: 1,
            horizontal_accuracy: 1000,
            ..Pvt::default()
        };
        pvt.emit().to_vec()
    };
    for (protocol, ubx, nmea) in [
        (ReceiverProtocol::Detect, true, true),
        (ReceiverProtocol::Ubx, true, false),
        (ReceiverProtocol::Nmea, false, true),
        (ReceiverProtocol::Novatel, false, false),
        (ReceiverProtocol::Sbf, false, false),
    ] {
        for (speaks, fixes) in [(ReceiverFormat::Ubx, ubx), (ReceiverFormat::Nmea, nmea)] {
            let mut bench = Bench::new(|receiver| receiver.protocol = protocol);
            for second in 1..10 {
                let bytes = match speaks {
                    ReceiverFormat::Ubx => pvt(second),
                    _ => rmc_gga(second),
                };
                bench.send(1_000_000 * second, &bytes);
                bench.run(1_000_000 * second + 900_000);
            }
            let good = bench.device.counters().good_fixes;
            let want = if fixes { 9 } else { 0 };
            assert_eq!(good, want, "{protocol:?} {speaks:?}");
            if fixes {
                assert_eq!(bench.status().format, Some(speaks));
            }
        }
    }
}

/// What u-blox receivers send each second, with NAV-SAT and NAV-SIG and with NMEA as delivered, at
/// 115 200 bit/s: a device that detects the protocol has a fix each second, as one that is
/// configured.
#[test]
fn a_usual_line_has_a_fix_each_second() {
    let long = |id: u8, len: usize| {
        let mut message = vec![0x11; len];
        message[..6].copy_from_slice(&[0xB5, 0x62, 1, id, (len - 8) as u8, ((len - 8) >> 8) as u8]);
        message
    };
    for protocol in [ReceiverProtocol::Detect, ReceiverProtocol::Ubx] {
        let mut bench = Bench::new(|receiver| receiver.protocol = protocol);
        for second in 1..=60 {
            let pvt = Pvt {
                time_of_week: second as u32 * 1000,
                fix: 3,
                flags: 1,
                horizontal_accuracy: 1000,
                speed_accuracy: 100,
                ..Pvt::default()
            };
            let bytes = [
                &pvt.emit()[..],
                &long(0x35, 408),
                &long(0x43, 664),
                &rmc_gga(second),
            ];
            let times = (1..).map(|n| 1_000_000 * second + n * 87);
            let coming = times.zip(bytes.concat());
            bench.coming.extend(coming);
            bench.run(1_000_000 * second + 900_000);
        }
        assert_eq!(bench.device.counters().good_fixes, 60, "{protocol:?}");
        assert_eq!(bench.status().format, Some(ReceiverFormat::Ubx));
    }
}
