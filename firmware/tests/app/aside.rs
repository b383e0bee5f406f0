//! The configuration of the sensor is wrong: the device reports it and steps aside, and restarts
//! when the sensor agrees again. Samples come in real time.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, values};
use crate::record::{configure, configured};
use crate::taught;
use firmware::app::{App, Config};
use firmware::configuration::record::encode;
use firmware::configuration::{Activation, Configuration};
use firmware::control::{Alignment, Mode, Reason, Window};
use firmware::learn::WindowLearner;
use firmware::link::Clock;
use firmware::wire::command::{Request, Response, fault};

/// STIM300: increments of 2^-21 deg and 2^-22 m/s at 1000 Hz.
const KIND: Kind = Kind::STIM;
/// Correction by the networks, m/s2.
const BIAS: f32 = 0.005;

/// A vehicle at rest, a sensor, and the device.
struct Bench {
    device: Device,
    number: u32,
    kind: Kind,
    /// True sample rate, Hz.
    hz: u32,
    /// Counts a second of gyro and accelerometer.
    rates: [[f64; 3]; 2],
}

impl Bench {
    fn new(kind: Kind, hz: u32, change: impl Fn(&mut Configuration)) -> Bench {
        let mut configuration = configured(kind);
        configuration.correction.block = 1.0;
        configuration.correction.silence_us = 100_000;
        change(&mut configuration);
        let config = Config {
            nets: nets([0.0; 3], [BIAS, 0.0, 0.0]),
            ..Config::of(&configuration)
        };
        let learner: &'static mut WindowLearner = Box::leak(Box::default());
        let mut device = Device::new(Config::default());
        device.app = App::with_learner(config, Some(learner));
        Bench {
            device,
            number: 0,
            kind,
            hz,
            // negligible, but a sensor whose values never change counts as stuck
            rates: [[10.5, 0.0, 0.0], [0.0; 3]],
        }
    }

    /// At rest on the level at 45 degrees of latitude facing north, in units of the STIM300.
    fn at_rest(&mut self) {
        let (degree, metre) = (f64::from(1 << 21), f64::from(1 << 22));
        let earth = 15.041 / 3600.0 * std::f64::consts::FRAC_1_SQRT_2;
        self.rates[0] = [earth * degree, 1.0, -earth * degree];
        self.rates[1] = [0.0, 0.0, -9.806 * metre];
    }

    /// Sends so many seconds of samples. Gives how often each fault was there, by frame, and what
    /// the x accelerometer's sum was changed by in each second, counts.
    fn run(&mut self, seconds: u32) -> Vec<f64> {
        let mut out = Vec::new();
        for _ in 0..seconds {
            let mut sent = 0.0;
            let mut due = self.device.time.now_us();
            for _ in 0..self.hz {
                let n = f64::from(self.number);
                let hz = f64::from(self.hz);
                let count =
                    |rate: f64| ((rate * (n + 1.0) / hz).round() - (rate * n / hz).round()) as i32;
                let fields = Fields {
                    gyro: self.rates[0].map(count),
                    accel: self.rates[1].map(count),
                    ..Fields::default()
                };
                sent += f64::from(fields.accel[0]);
                let frame = self.kind.frame(self.number, fields);
                self.number += 1;
                self.device.feed(&frame);
                // the passes themselves take time too
                due += u64::from(1_000_000 / self.hz);
                let left = due.saturating_sub(self.device.time.now_us());
                self.device.pass_us(left);
            }
            self.device.settle();
            let left = core::mem::take(&mut self.device.lines.navigation.sent);
            let left: f64 = left
                .iter()
                .filter(|message| message.len() > 10)
                .map(|frame| values(self.kind.format, frame)[3])
                .sum();
            out.push(sent - left);
        }
        out
    }

    fn faults(&self) -> u32 {
        self.device.app.faults()
    }
}

fn frozen(configuration: &mut Configuration) {
    configuration.correction.mode = Mode::Frozen;
}

/// The correction in counts a second.
fn counts() -> f64 {
    f64::from(BIAS) * f64::from(1 << 22)
}

#[test]
fn a_sensor_as_configured_is_corrected_and_raises_nothing() {
    let mut bench = Bench::new(KIND, 1000, frozen);
    bench.at_rest();
    let removed = bench.run(70);
    assert_eq!(bench.faults(), 0);
    for removed in removed {
        assert!((removed / counts() - 1.0).abs() < 1e-3, "{removed}");
    }
}

#[test]
fn a_kvh_at_5_khz_configured_for_1_khz_is_not_corrected() {
    let mut bench = Bench::new(Kind::KVH, 5000, frozen);
    assert_eq!(bench.kind.rate(), 1000.0);
    let removed = bench.run(8);
    assert_eq!(bench.faults(), fault::RATE);
    assert!(removed[0] != 0.0, "corrected at first");
    assert_eq!(removed[5..], [0.0; 3]);
    // without the comparison the error would go unnoticed
    let mut bench = Bench::new(Kind::KVH, 5000, |configuration| {
        frozen(configuration);
        configuration.correction.check_rate = false;
    });
    let removed = bench.run(8);
    assert_eq!(bench.faults(), 0);
    assert!(removed[7] != 0.0);
}

#[test]
fn the_rate_is_compared_in_bypass_too_and_silence_is_no_rate() {
    let mut bench = Bench::new(Kind::KVH, 2000, |_| ());
    bench.run(6);
    assert_eq!(bench.faults(), fault::RATE);
    bench.device.wait_ms(30_000);
    assert_eq!(bench.faults(), fault::RATE | fault::SILENT);
    bench.hz = 1000;
    bench.run(40);
    assert_eq!(bench.faults(), 0);
    bench.device.wait_ms(30_000);
    assert_eq!(bench.faults(), fault::SILENT);
}

#[test]
fn a_wrong_unit_stops_the_correction_until_it_is_seen_right() {
    let mut bench = Bench::new(KIND, 1000, frozen);
    bench.at_rest();
    bench.rates[1][2] *= 2.0; // a range of 5 g, configured as 10 g
    let removed = bench.run(70);
    assert_eq!(bench.faults(), fault::GRAVITY);
    assert!(removed[50] != 0.0);
    assert_eq!(removed[61..], [0.0; 9]);
    bench.at_rest();
    let removed = bench.run(130);
    assert_eq!(bench.faults(), 0);
    assert!((removed[129] / counts() - 1.0).abs() < 1e-3);
    // the earth rate and the axes likewise
    bench.rates[0] = bench.rates[0].map(|rate| rate * 57.3);
    bench.run(125);
    assert_eq!(bench.faults(), fault::EARTH_RATE);
    bench.at_rest();
    bench.rates[1][2] *= -1.0;
    bench.run(125);
    assert_eq!(bench.faults(), fault::AXES);
}

#[test]
fn after_an_alignment_a_correction_goes_and_comes_by_the_slew_limit() {
    let mut bench = Bench::new(Kind::KVH, 1000, frozen);
    bench.run(2);
    bench.device.order(&Request::Alignment(Alignment::Started));
    bench.run(1);
    bench.device.order(&Request::Alignment(Alignment::Finished));
    let slew = f64::from(Configuration::default().correction.slew.accel);
    let full = bench.run(3)[2];
    bench.hz = 5000;
    let gone = bench.run(20);
    assert_eq!(bench.faults(), fault::RATE);
    // a block is a fifth of a second, and a correction five times too large at 5000 Hz
    let most = full / f64::from(BIAS) * slew * 25.0;
    for (second, pair) in gone.windows(2).enumerate().skip(5) {
        let step = pair[0] - pair[1];
        assert!((-1e-6..=most * 1.2).contains(&step), "{second}: {pair:?}");
    }
    assert!(gone[19] < gone[5]);
    bench.hz = 1000;
    bench.run(40);
    assert_eq!(bench.faults(), 0);
    let back = bench.run(20);
    let most = full / f64::from(BIAS) * slew * 1.2;
    for pair in back.windows(2) {
        assert!((0.0..=most).contains(&(pair[1] - pair[0])), "{pair:?}");
    }
    assert!(back[19] > back[0]);
}

#[test]
fn aside_nothing_is_learnt_and_the_learner_restarts_afterwards() {
    let learn = |configuration: &mut Configuration| {
        configuration.correction.mode = Mode::Learn;
        configuration.correction.activation = Activation::Faded;
    };
    let window = Window {
        first: 1,
        last: 2,
        angle: [0.0; 3],
        velocity: [0.0; 3],
        angle_sigma: 1.0,
        velocity_sigma: 1.0,
    };
    let read = Request::ReadLearnt {
        offset: 0,
        length: 10,
    };
    let refused = |answer: Response| match answer {
        Response::Refused(reason) => Some(reason),
        _ => None,
    };
    let mut bench = Bench::new(KIND, 1000, learn);
    bench.at_rest();
    bench.rates[1][2] *= 9.81;
    bench.run(12);
    assert!(bench.device.app.learning().window.is_some());
    bench.run(52);
    assert_eq!(bench.faults(), fault::GRAVITY);
    let asked = bench.device.ask(&read, refused);
    assert_eq!(asked, Some(Reason::NotAvailable));
    let asked = bench.device.ask(&Request::Reference(window), refused);
    assert_eq!(asked, Some(Reason::NotAvailable));
    bench.run(20);
    let aside = bench.device.app.learning().window;
    bench.at_rest();
    bench.run(120);
    assert_eq!(bench.faults(), 0);
    assert_eq!(bench.device.ask(&read, refused), None);
    bench.run(12);
    assert!(bench.device.app.learning().window > aside);
}

#[test]
fn another_configuration_ends_it() {
    let mut bench = Bench::new(Kind::KVH, 5000, frozen);
    bench.run(8);
    assert_eq!(bench.faults(), fault::RATE);
    bench.device.order(&Request::SetMode(Mode::Bypass));
    let mut right = configured(Kind::KVH);
    right.rate = 5000.0;
    configure(&mut bench.device, &encode(&right)).expect("a good configuration");
    assert_eq!(bench.faults() & fault::RATE, 0);
    bench.run(35);
    assert_eq!(bench.faults() & fault::RATE, 0);
}

/// While configuration and samples disagree, nothing that was learnt comes into force, not even by
/// an alignment.
#[test]
fn aside_no_alignment_brings_a_correction() {
    let kind = Kind::RAWIMUSX;
    let mut unit = configured(kind);
    unit.correction.mode = Mode::Learn;
    unit.correction.activation = Activation::Commanded;
    unit.correction.silence_us = 100_000;
    (unit.correction.limit.accel, unit.correction.slew.accel) = (1.0, 0.01);
    for wrong in [false, true] {
        let config = Config::of(&unit);
        let mut bench = taught::Bench::of(kind, |learner| App::with_learner(config, Some(learner)));
        let slower = if wrong { 2.0 } else { 1.0 };
        let run = |bench: &mut taught::Bench| {
            (0..(8.0 * kind.rate()) as u32).for_each(|_| bench.step(slower));
        };
        run(&mut bench);
        bench.says.winner.set(Some(0.04));
        run(&mut bench); // a block, and the next one brings the learner's answer to it
        bench.device.order(&Request::Alignment(Alignment::Started));
        run(&mut bench);
        bench.device.order(&Request::Alignment(Alignment::Finished));
        run(&mut bench);
        let seen = bench.take();
        assert_eq!(bench.device.app.faults() & fault::RATE != 0, wrong);
        assert_eq!(seen.iter().any(|correction| *correction != 0.0), !wrong);
    }
}
