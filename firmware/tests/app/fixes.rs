//! The learner from fixes inside the application: alignment by itself or by command, gaps,
//! silences, and that no result depends on when the parts of its work are done. The vehicle stands
//! all the time; whole drives are in `tests/qemu`.

use crate::activation::{AtRest, KIND, PLACE, RATE, lsb};
use crate::device::Device;
use crate::frames::Fields;
use crate::record::configure;
use firmware::app::{App, Config};
use firmware::configuration::record::encode;
use firmware::configuration::{Configuration, Sensor, UNKNOWN, Wheels};
use firmware::control::{Alignment, HeadingSource, Mode, Reason};
use firmware::fix::Heading;
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use firmware::model::Nets;
use firmware::units::DEGREE;
use firmware::wheels::WheelSpeed;
use firmware::wire::command::{Antenna, Health, Request, Response};
use firmware::wire::ubx::Pvt;

fn device(config: Config) -> Device {
    let memory = Box::leak(Box::new(FixMemory::ZEROED));
    let configured = config.configuration.as_ref();
    let settings = configured.map_or(Settings::MEDIUM, Settings::of);
    let learner = CombinedLearner {
        references: Box::leak(Box::new(WindowLearner::new())),
        fixes: FixLearner::new(memory, settings),
    };
    let mut device = Device::new(Config::default());
    device.app = App::with_learner(config, Some(Box::leak(Box::new(learner))));
    device
}

pub fn config() -> Config {
    Config {
        mode: Mode::Learn,
        ..KIND.config()
    }
}

fn fix(second: u32) -> Pvt {
    let degrees = |radians: f64| (radians / DEGREE * 1e7).round() as i32;
    // some noise of a receiver, the same in each run
    let noise = |k: u32, size: i32| {
        (second.wrapping_mul(2_654_435_761).rotate_left(k) % 1000) as i32 * size / 500 - size
    };
    Pvt {
        time_of_week: second * 1000,
        fix: 3,
        flags: 1,
        latitude: degrees(PLACE.latitude) + noise(3, 10),
        longitude: degrees(PLACE.longitude) + noise(9, 10),
        height: 200_000 + noise(15, 1000),
        horizontal_accuracy: 1400,
        vertical_accuracy: 1500,
        velocity: [noise(5, 50), noise(11, 50), noise(17, 50)],
        speed_accuracy: 90,
        ..Pvt::default()
    }
}

/// A device whose vehicle stands.
pub struct Bench {
    pub device: Device,
    samples: AtRest,
    number: u32,
    /// Receiver's time at the start, ms of the week.
    pub week_ms: u32,
    /// Bytes that have left since the last look.
    pub left: Vec<u8>,
}

impl Bench {
    pub fn new(config: Config) -> Bench {
        Bench {
            device: device(config),
            samples: AtRest::new(&lsb()),
            number: 0,
            week_ms: 0,
            left: Vec::new(),
        }
    }

    /// The next frame.
    fn frame(&mut self) -> Vec<u8> {
        let [a, b, c, d, e, f] = self.samples.sample();
        let fields = Fields {
            gyro: [a, b, c],
            accel: [d, e, f],
            ..Fields::default()
        };
        self.number += 1;
        KIND.frame(self.number - 1, fields)
    }

    /// Runs for some seconds, with a fix 100 ms after each begins. `passes`: passes of the
    /// application after each frame; `None`: as many as there is work for.
    pub fn run(&mut self, seconds: u32, passes: Option<u32>) {
        for _ in 0..seconds {
            for n in 0..RATE {
                let frame = self.frame();
                match passes {
                    None => self.device.feed(&frame),
                    Some(passes) => {
                        self.device.lines.sensor.input.extend(&frame);
                        for _ in 0..passes {
                            self.device
                                .app
                                .poll(&mut self.device.lines, &self.device.time);
                        }
                    }
                }
                if n == RATE / 10 {
                    let mut fix = fix(self.number / RATE);
                    fix.time_of_week = (self.week_ms + fix.time_of_week) % 604_800_000;
                    self.device.lines.gnss.input.extend(fix.emit());
                    // it takes more than one pass; it must arrive after the same sample in any case
                    for _ in 0..2 {
                        self.device
                            .app
                            .poll(&mut self.device.lines, &self.device.time);
                    }
                }
                self.device.pass_us(10_000);
            }
            let sent = self.device.lines.navigation.sent.drain(..);
            self.left.extend(sent.flatten());
        }
    }

    pub fn health(&mut self) -> Health {
        self.device.ask(&Request::GetHealth, |answer| match answer {
            Response::Health(health) => health,
            other => panic!("{other:?}"),
        })
    }

    /// The north gyro errs by 2 deg/h from now on: six standard deviations.
    pub fn errs_north(&mut self) {
        self.samples.rate[0] += 1e-5 / (f64::from(RATE) * lsb().rad);
    }

    pub fn weights(&mut self) -> Nets {
        self.device.app.learnt().expect("it was begun")
    }
}

#[test]
fn it_aligns_itself_and_uses_the_fixes_after_that() {
    let mut bench = Bench::new(config());
    bench.run(95, None);
    assert!(!bench.health().navigates);
    bench.run(65, None);
    let health = bench.health();
    assert!(health.navigates, "{health:?}");
    assert!((50..=60).contains(&health.used_fixes), "{health:?}");
    assert!(health.refused_fixes < 3, "{health:?}");
    // at rest the 100 ug are in the tilt: no fix contradicts the zero correction
    assert_eq!(
        (health.winner, health.promotions, health.rollbacks),
        (0, 0, 0)
    );
}

#[test]
fn a_command_aligns_sooner() {
    let mut bench = Bench::new(config());
    bench.run(5, None);
    bench.device.order(&Request::Alignment(Alignment::Started));
    bench.run(40, None);
    assert!(!bench.health().navigates);
    bench.device.order(&Request::Alignment(Alignment::Finished));
    bench.run(5, None);
    assert!(bench.health().navigates);
}

/// A heading is taken while the learner aligns itself, and the report shows how it was used.
#[test]
fn a_heading_is_taken_over_the_command_link() {
    let ask = |bench: &mut Bench, angle: f32, sigma: f32| {
        let request = Request::Heading(Heading { angle, sigma });
        bench.device.ask(&request, |answer| match answer {
            Response::Done => None,
            Response::Refused(reason) => Some(reason),
            other => panic!("{other:?}"),
        })
    };
    let mut bench = Bench::new(Config {
        mode: Mode::Bypass,
        ..config()
    });
    let refused = ask(&mut bench, 0.3, 0.05);
    assert_eq!(refused, Some(Reason::NotAvailable), "it does not learn");
    let unknown = Configuration {
        mounting: UNKNOWN,
        ..Configuration::default()
    };
    let mut bench = Bench::new(Config {
        configuration: Some(unknown),
        ..config()
    });
    bench.run(3, None);
    let refused = ask(&mut bench, 0.3, 0.05);
    assert_eq!(refused, Some(Reason::NotAvailable), "whose, nobody knows");
    let mut bench = Bench::new(config());
    bench.run(3, None);
    assert_eq!(ask(&mut bench, f32::NAN, 0.05), Some(Reason::Range));
    assert_eq!(ask(&mut bench, 0.3, 1.5), Some(Reason::Range));
    assert_eq!(ask(&mut bench, 0.3, 0.05), None);
    bench.run(10, None);
    // a sensor that finds north waits for it; the heading shows meanwhile
    let health = bench.health();
    assert_eq!(
        (health.navigates, health.way),
        (false, HeadingSource::Heading)
    );
    let sigma = health.heading_sigma.expect("it is known");
    assert!((45..=55).contains(&sigma), "{health:?}");
    bench.run(100, None);
    let health = bench.health();
    assert_eq!(
        (health.navigates, health.way),
        (true, HeadingSource::Gyrocompass)
    );
    assert!(health.heading_sigma.is_some_and(|sigma| sigma < 45));
    assert_eq!(ask(&mut bench, 0.3, 0.05), Some(Reason::Alignment));
}

/// Speeds of wheels are taken where the configuration has wheels. While they turn, nothing is
/// aligned at rest, whatever the sensors feel.
#[test]
fn wheels_that_turn_are_no_standstill() {
    let ask = |bench: &mut Bench, speed: f32| {
        let request = Request::WheelSpeed(WheelSpeed { speed, age_ms: 20 });
        bench.device.ask(&request, |answer| match answer {
            Response::Done => None,
            Response::Refused(reason) => Some(reason),
            other => panic!("{other:?}"),
        })
    };
    let mut bench = Bench::new(config());
    bench.run(3, None);
    assert_eq!(ask(&mut bench, 0.0), Some(Reason::NotConfigured));
    let wheels = Some(Wheels {
        lever_arm: [0.0; 3],
        ahead: 0.0,
        scale: 0.02,
        noise: 0.05,
        delay: 0.05,
    });
    let configured = || Config {
        configuration: Some(Configuration {
            wheels,
            ..Configuration::default()
        }),
        ..config()
    };
    let mut bench = Bench::new(Config {
        mode: Mode::Bypass,
        ..configured()
    });
    assert_eq!(ask(&mut bench, 0.0), Some(Reason::NotAvailable));
    for speed in [0.0, 0.2] {
        let mut bench = Bench::new(configured());
        for _ in 0..130 {
            bench.run(1, None);
            assert_eq!(ask(&mut bench, speed), None);
        }
        assert_eq!(bench.health().navigates, speed == 0.0, "{speed}");
        assert_eq!(ask(&mut bench, f32::NAN), Some(Reason::Range));
        assert_eq!(ask(&mut bench, 201.0), Some(Reason::Range));
    }
}

/// With one pass after each frame, instead of as many as there is work for, fixes and blocks find
/// unfinished work and finish it. The result is the same.
#[test]
fn when_its_parts_are_done_does_not_matter() {
    same_whenever(&config());
}

/// Nor with lever arm and delay to be estimated, which is part of that work.
#[test]
fn when_its_parts_are_done_does_not_matter_with_an_uncertain_antenna() {
    same_whenever(&uncertain());
}

/// Lever arm and delay of the receiver are not well known.
fn uncertain() -> Config {
    let mut configuration = Configuration::default();
    configuration.receiver.lever_arm = [1.0, 2.0, -3.0];
    configuration.receiver.lever_arm_sigma = 3.0;
    configuration.receiver.fix_delay_sigma = 0.3;
    Config {
        configuration: Some(configuration),
        ..config()
    }
}

fn same_whenever(config: &Config) {
    let run = |passes: Option<u32>| {
        let mut bench = Bench::new(config.clone());
        bench.run(115, passes);
        bench.errs_north();
        bench.run(1500, passes);
        (bench.weights(), bench.health())
    };
    let at_once = run(None);
    assert!(at_once.1.winner > 0 && at_once.1.promotions > 0);
    assert_ne!(at_once.0, Nets::NONE);
    // a second has 100 frames; a fix about 40 parts
    for passes in [1, 2] {
        let (weights, health) = run(Some(passes));
        assert!(weights == at_once.0, "{passes}");
        assert_eq!(health, at_once.1, "{passes}");
    }
}

/// At rest neither lever arm nor delay is observable: the estimates stay as configured.
#[test]
fn the_estimates_of_the_antenna_are_reported() {
    let mut bench = Bench::new(uncertain());
    let antenna = |bench: &mut Bench| {
        bench
            .device
            .ask(&Request::GetAntenna, |answer| match answer {
                Response::Antenna(antenna) => antenna,
                other => panic!("{other:?}"),
            })
    };
    let configured = Antenna {
        lever_arm: [1.0, 2.0, -3.0],
        lever_arm_sigma: [3.0; 3],
        fix_delay: 0.1,
        fix_delay_sigma: 0.3,
    };
    assert_eq!(antenna(&mut bench), configured);
    bench.run(160, None);
    assert!(bench.health().used_fixes > 30);
    let after = antenna(&mut bench);
    let near = |a: f32, b: f32, off: f32| (a - b).abs() < off;
    for i in 0..3 {
        assert!(
            near(after.lever_arm[i], configured.lever_arm[i], 0.5),
            "{after:?}"
        );
        assert!(near(after.lever_arm_sigma[i], 3.0, 0.1), "{after:?}");
    }
    assert!(near(after.fix_delay, 0.1, 0.05) && near(after.fix_delay_sigma, 0.3, 0.02));
}

#[test]
fn holes_are_bridged_as_long_as_the_attitude_is_known_and_silences_are_not() {
    let after = |disturb: &dyn Fn(&mut Bench)| {
        let mut bench = Bench::new(config());
        bench.run(120, None);
        assert!(bench.health().navigates);
        disturb(&mut bench);
        bench.run(10, None);
        bench.health()
    };
    let short = after(&|bench| (0..4).for_each(|_| drop(bench.frame())));
    assert!(short.navigates && short.missed == 4, "{short:?}");
    assert!(short.refused_fixes < 3, "{short:?}");
    // at rest, for a second
    let longer = after(&|bench| (0..100).for_each(|_| drop(bench.frame())));
    assert!(longer.navigates && longer.missed == 100, "{longer:?}");
    assert!(longer.refused_fixes < 3, "{longer:?}");
    let silent = after(&|bench| bench.device.wait_ms(200));
    assert!(!silent.navigates, "{silent:?}");
}

/// Fixes that are wild, empty or without accuracies are counted, and no weight becomes infinite or
/// NaN.
#[test]
fn bad_fixes_do_no_harm() {
    let mut bench = Bench::new(config());
    bench.run(120, None);
    let before = bench.health();
    for k in 0..40_u32 {
        let mut bad = fix(120 + k);
        match k % 4 {
            0 => bad.latitude = 900_000_000,
            1 => bad.velocity = [i32::MAX, i32::MIN, 0],
            2 => bad.horizontal_accuracy = 0,
            _ => (bad.horizontal_accuracy, bad.height) = (u32::MAX, i32::MIN),
        }
        for n in 0..RATE {
            let frame = bench.frame();
            if n == 10 {
                bench.device.lines.gnss.input.extend(bad.emit());
            }
            bench.device.feed(&frame);
            bench.device.pass_us(10_000);
        }
        bench.device.lines.navigation.sent.clear();
    }
    let health = bench.health();
    assert!(
        health.refused_fixes > before.refused_fixes + 10,
        "{health:?}"
    );
    let nets = bench.weights();
    for net in [nets.gyro, nets.accel] {
        assert!(net.weights.to_array().iter().all(|w| w.is_finite()));
    }
    bench.run(150, None);
    assert!(bench.health().navigates, "it comes back");
}

/// In bypass and frozen the learner does not begin; in shadow it learns as in learn.
#[test]
fn it_is_begun_in_shadow_and_learn_only() {
    for (mode, learns) in [
        (Mode::Bypass, false),
        (Mode::Frozen, false),
        (Mode::Shadow, true),
        (Mode::Learn, true),
    ] {
        let mut bench = Bench::new(Config { mode, ..config() });
        bench.run(115, None);
        assert_eq!(bench.health().navigates, learns, "{mode:?}");
        assert_eq!(bench.device.app.learnt().is_some(), learns, "{mode:?}");
    }
}

/// The learner takes its numbers from the configuration. With the medium laser gyro's it learns the
/// same bits as with its built-in numbers, with another one different bits. A later configuration
/// restarts the learning.
#[test]
fn it_learns_by_the_configuration() {
    let run = |configuration: Option<Configuration>, later: bool| {
        let config = Config {
            configuration: configuration.clone().filter(|_| !later),
            ..config()
        };
        let mut bench = Bench::new(config);
        if let (Some(mut configuration), true) = (configuration, later) {
            bench.run(20, None);
            bench.device.order(&Request::SetMode(Mode::Bypass));
            configuration.sensor =
                Some(Sensor::Stream(KIND.format.settings(&KIND.config().sensor)));
            configuration.rate = KIND.rate();
            configuration.correction.mode = Mode::Learn;
            let record = encode(&configuration);
            assert_eq!(configure(&mut bench.device, &record), Ok(()));
            assert_eq!(bench.health().mode, Mode::Learn);
            bench.samples = AtRest::new(&lsb());
            bench.number = 0;
        }
        bench.run(115, None);
        bench.errs_north();
        bench.run(1500, None);
        (bench.weights(), bench.health().winner)
    };
    let unconfigured = run(None, false);
    assert!(unconfigured.1 > 0);
    let medium = Configuration::default();
    assert!(run(Some(medium.clone()), false) == unconfigured);
    let mut coarse = medium.clone();
    coarse.gyro.white_noise *= 3.0;
    let coarse = run(Some(coarse), false);
    assert!(coarse.0 != unconfigured.0);
    assert!(run(Some(medium), true) == unconfigured);
}
