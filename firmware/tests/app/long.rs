//! A device that has run for months behaves as in its first minute, whatever its counters, its
//! clock and the numbers of its samples.

use crate::activation::RATE;
use crate::adis::reply;
use crate::channels::named;
use crate::device::{Device, nets};
use crate::fixes;
use crate::frames::{Kind, kinds};
use crate::record::{HARDWARE, configured};
use firmware::app::{Activation, App, Config, Phase};
use firmware::configuration::{Configuration, Sensor};
use firmware::control::Mode;
use firmware::learn::WindowLearner;
use firmware::wire::adis::{self, Burst, Form, Model};
use firmware::wire::command::{Counters, Health, Request, Response};

const DAY_S: u64 = 86_400;
const TURN: u64 = 1 << 32;

/// History of a device before the run.
#[derive(Debug, Clone, Copy)]
struct History {
    /// Initial value of every counter.
    counted: u64,
    /// Clock when the sensor begins, s.
    clock_s: u64,
}

/// A device that has just begun.
const NEW: History = History {
    counted: 0,
    clock_s: 10,
};

/// State observable from outside after each step.
#[derive(Debug, PartialEq)]
struct Observed {
    left: Vec<u8>,
    faults: u32,
    unwell: u8,
    phase: Phase,
}

/// One run, and the counters at its end.
struct Run {
    device: Device,
    observed: Vec<Observed>,
    /// An ADIS at the SPI sends bursts of this form.
    form: Option<Form>,
    n: u32,
    random: u32,
}

/// Runs without any input until then.
fn idle_until(device: &mut Device, clock_s: u64) {
    for _ in 0..clock_s.saturating_sub(10) / 60 {
        device.pass_us(60_000_000);
        device.settle();
    }
    while device.time.get() < clock_s * 1_000_000 {
        device.pass_us(1_000_000);
        device.settle();
    }
}

impl Run {
    fn new(config: Config, form: Option<Form>, history: History) -> Run {
        let learner: &'static mut WindowLearner = Box::leak(Box::default());
        let mut device = Device::new(Config::default());
        device.app = App::with_learner(config, Some(learner));
        device.app.has_counted(history.counted);
        idle_until(&mut device, history.clock_s);
        Run {
            device,
            observed: Vec::new(),
            form,
            n: 0,
            random: 1,
        }
    }

    /// Advances the time and delivers these bytes.
    fn step(&mut self, us: u64, bytes: &[u8]) {
        self.device.pass_us(us);
        match self.form {
            Some(_) if !bytes.is_empty() => {
                let Device {
                    app, lines, time, ..
                } = &mut self.device;
                // faults of the burst are the board's concern
                let _ = app.burst(&mut bytes.to_vec(), &mut lines.navigation, time);
                self.device.settle();
            }
            _ => self.device.feed(bytes),
        }
        let app = &mut self.device.app;
        self.observed.push(Observed {
            left: core::mem::take(&mut self.device.lines.navigation.sent).concat(),
            faults: app.faults(),
            unwell: app.unwell(self.device.time.get()),
            phase: app.phase(),
        });
    }

    fn random(&mut self) -> u32 {
        self.random = self
            .random
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223);
        self.random >> 8
    }

    /// Frames of this sensor for `seconds`, at its rate or `apart` microseconds apart. Of `harm`
    /// frames one is damaged, and one is missing.
    fn frames(&mut self, kind: Kind, seconds: f64, apart: Option<f64>, harm: Option<u32>) {
        let apart = apart.unwrap_or(1e6 / kind.rate());
        for k in 0..(1e6 * seconds / apart) as u32 {
            self.n += 1;
            let mut frame = match self.form {
                None => kind.stream(self.n, self.n + 1).remove(0),
                Some(form) => {
                    let burst = Burst {
                        gyro: [self.n as i32 % 50 - 20, 7, 3],
                        accel: [3, -(self.n as i32 % 13), 900],
                        counter: self.n as u16,
                        ..Burst::default()
                    };
                    reply(form, &burst)
                }
            };
            if harm.is_some_and(|harm| self.n % harm == 1) {
                let bit = self.random() as usize % (8 * frame.len());
                frame[bit / 8] ^= 1 << (bit % 8);
            }
            if harm.is_some_and(|harm| self.n % harm == 2) {
                frame.clear();
            }
            let [before, now] = [k, k + 1].map(|k| (f64::from(k) * apart) as u64);
            self.step(now - before, &frame);
        }
    }

    /// Bytes of no format.
    fn noise(&mut self, seconds: u32) {
        for _ in 0..50 * seconds {
            let bytes: Vec<u8> = (0..16).flat_map(|_| self.random().to_le_bytes()).collect();
            self.step(20_000, &bytes);
        }
    }

    fn silence(&mut self, ms: u32) {
        for _ in 0..ms {
            self.step(1000, &[]);
        }
    }

    /// Every kind of input.
    fn all(&mut self, kind: Kind) {
        self.frames(kind, 1.0, None, None);
        self.frames(kind, 5.0, None, Some(4));
        self.frames(kind, 70.0, Some(25_000.0), None);
        self.silence(500);
        self.frames(kind, 0.5, None, None);
        self.noise(70);
        self.silence(1500);
        self.frames(kind, 12.0, None, None);
    }

    fn ends(mut self) -> (Vec<Observed>, Counters, Health) {
        let health = self.device.ask(&Request::GetHealth, |answer| match answer {
            Response::Health(health) => health,
            other => panic!("{other:?}"),
        });
        (self.observed, self.device.counters(), health)
    }
}

/// Counters as a device with this history shows them.
fn shown(history: History, counters: Counters) -> String {
    let words = postcard_words(&counters);
    let after = |word: u64| (history.counted + word).min(u64::from(u32::MAX));
    format!("{:?}", words.into_iter().map(after).collect::<Vec<_>>())
}

/// The counters in their order.
fn postcard_words(counters: &Counters) -> Vec<u64> {
    let text = format!("{counters:?}");
    let words = text.split(|c: char| !c.is_ascii_digit());
    words.filter_map(|word| word.parse().ok()).collect()
}

/// Runs the same twice, once as a new device, and compares.
fn compare(what: &str, history: History, run: impl Fn(History) -> Run) {
    let (new, fresh, of_new) = run(NEW).ends();
    let (old, counters, of_old) = run(history).ends();
    assert_eq!(new.len(), old.len());
    for (k, (new, old)) in new.iter().zip(&old).enumerate() {
        assert_eq!(new, old, "{what}, {history:?}, step {k}");
    }
    let words = format!("{:?}", postcard_words(&counters));
    assert_eq!(words, shown(history, fresh), "{what}, {history:?}");
    let frames = u64::from(of_new.frames) + history.counted;
    assert_eq!(u64::from(of_old.frames), frames.min(u64::from(u32::MAX)));
    assert_eq!(
        (of_old.winner, of_old.navigates),
        (of_new.winner, of_new.navigates)
    );
}

/// Histories with which everything overflows within the run: the counters early or late, the lower
/// half of the clock, and a hundred days.
fn histories(rate: f64) -> [History; 4] {
    let days = |days: u64| days * DAY_S;
    [
        History {
            counted: TURN - 2000,
            clock_s: TURN / 1_000_000 - 4,
        },
        History {
            counted: TURN - 20,
            clock_s: 3 * TURN / 1_000_000 - 80,
        },
        History {
            counted: (days(100) as f64 * rate) as u64,
            clock_s: days(100),
        },
        History {
            counted: 5 * TURN - 1000,
            clock_s: 10,
        },
    ]
}

fn corrects(config: Config) -> Config {
    Config {
        mode: Mode::Frozen,
        nets: nets([1e-4, -2e-4, 0.0], [3e-3, 0.0, -1e-2]),
        ..config
    }
}

/// Only the reported counters depend on how long a device has run, whatever its sensor sends.
#[test]
fn months_change_nothing_but_the_numbers_shown() {
    for (k, kind) in kinds().into_iter().enumerate() {
        let mut unit = configured(kind);
        unit.correction.silence_us = 100_000;
        for history in [k, k + 1].map(|k| histories(kind.rate())[k % 4]) {
            compare(kind.sensor.name, history, |history| {
                let mut run = Run::new(corrects(Config::of(&unit)), None, history);
                run.all(kind);
                run
            });
        }
    }
}

/// Likewise for a device without a configuration, in which all is raw and nothing has a format.
#[test]
fn months_change_nothing_without_a_configuration() {
    for history in histories(1000.0) {
        compare("no configuration", history, |history| {
            let mut run = Run::new(Config::unconfigured(HARDWARE), None, history);
            run.noise(70);
            run.all(Kind::KVH);
            run.frames(Kind::STIM, 5.0, None, None);
            run
        });
    }
}

/// Likewise with an ADIS at the SPI, and noise on the line that it does not use.
#[test]
fn months_change_nothing_at_the_spi() {
    for (model, history) in [
        Model::Adis16475(1),
        Model::Adis16505(2),
        Model::Adis16495(1),
    ]
    .into_iter()
    .zip(histories(1000.0))
    {
        let form = model.form();
        let settings = adis::Settings {
            form,
            units: model.units(form != Form::Narrow).expect("a model"),
            framed: false,
        };
        let unit = Configuration {
            sensor: Some(Sensor::Spi(settings)),
            rate: 1000.0,
            ..Configuration::default()
        };
        compare("SPI", history, |history| {
            let mut run = Run::new(corrects(Config::of(&unit)), Some(form), history);
            run.all(Kind::STIM);
            run
        });
    }
}

/// Two kinds of frames on one line: which one leads follows from what comes.
#[test]
fn months_do_not_change_which_kind_leads() {
    let [short, data] = ["sbgecom IMU_SHORT", "sbgecom IMU_DATA"].map(named);
    for history in histories(1000.0) {
        compare("two kinds", history, |history| {
            let mut run = Run::new(corrects(short.config()), None, history);
            // the one that comes first leads, until the faster one comes
            for n in 0..4000u32 {
                if n % 5 == 0 {
                    run.step(0, &data.stream(n / 5, n / 5 + 1).concat());
                }
                if n > 50 {
                    run.step(1000, &short.stream(n, n + 1).concat());
                }
            }
            run
        });
    }
}

/// The results of the learner from fixes in a drive at rest do not depend on how long the device
/// has run: the numbers of its samples and the lower half of its clock wrap while it aligns itself,
/// while it navigates, and while a learnt correction is in force; so does the receiver's week.
#[test]
fn months_do_not_change_what_is_learnt() {
    let learns = |end_s: Option<u64>| {
        let mut bench = fixes::Bench::new(Config {
            activation: Activation::Faded,
            ..fixes::config()
        });
        let clock_s = match end_s {
            None => NEW.clock_s,
            Some(end_s) => {
                let counted = TURN - end_s * u64::from(RATE);
                bench.device.app.has_counted(counted);
                bench.week_ms = 604_800_000 - 1000 * end_s as u32;
                TURN / 1_000_000 - end_s
            }
        };
        idle_until(&mut bench.device, clock_s);
        bench.run(115, None);
        bench.errs_north();
        bench.run(2400, None);
        let health = bench.health();
        assert!(health.navigates && health.winner > 0, "{health:?}");
        let estimate = (bench.device).ask(&Request::GetEstimate, |answer| match answer {
            Response::Estimate(estimate) => estimate.in_force,
            other => panic!("{other:?}"),
        });
        assert_ne!(estimate, [[0.0; 3]; 2], "it acts");
        let known = (
            (health.winner, health.promotions, health.way),
            (health.used_fixes, health.refused_fixes),
            (health.heading_sigma, estimate),
        );
        (bench.left.clone(), bench.weights(), known)
    };
    let new = learns(None);
    for end_s in [20, 130, 2300] {
        let old = learns(Some(end_s));
        let differs = new.0.iter().zip(&old.0).position(|(new, old)| new != old);
        assert_eq!((new.0.len(), differs), (old.0.len(), None), "{end_s}");
        assert!(new.1 == old.1, "{end_s}: other weights");
        assert_eq!(new.2, old.2, "{end_s}");
    }
}
