//! When a promoted correction comes into force, as observed by a navigation computer that aligns
//! itself on the device's samples and then navigates free inertial for 22 min. A correction that
//! changes after the alignment spoils the solution; the device avoids it.

use crate::device::{Device, nets};
use crate::frames::{Fields, Kind, values};
use firmware::align::{Align, Sensors};
use firmware::app::{Activation, App, Config};
use firmware::compensator::Block;
use firmware::control::{Alignment, Mode};
use firmware::fix::{Fix, Position};
use firmware::learn::{Learner, Report, Winner};
use firmware::model::Nets;
use firmware::nav::{self, Navigator, Noise, State};
use firmware::sample::{Counts, Lsb, StreamScale};
use firmware::units::FOOT;
use firmware::wire::command::{Request, Response};
use firmware::wire::ubx::Pvt;
use lrnn_nostd::State as NetState;

pub const KIND: Kind = Kind::RAWIMUSX;
pub const RATE: u32 = 100;
const LATITUDE: f64 = 0.8;
const HEIGHT: f64 = 200.0;
/// The sensor's error, m/s2: 100 ug north.
pub const BIAS: f32 = 9.806_65e-4;
/// Seconds: the computer aligns itself from [`ALIGN`] to [`FREE`], and is free inertial until
/// [`END`].
const ALIGN: u32 = 60;
const FREE: u32 = 360;
const END: u32 = FREE + 1320;
pub const PLACE: Position = Position {
    latitude: LATITUDE,
    longitude: 0.1,
    height: HEIGHT,
};

/// A learner that knows the sensor's error from one block to another.
#[derive(Debug)]
pub struct Knows {
    pub blocks: u32,
    pub from: u32,
    pub to: u32,
    pub still_s: u32,
}

impl Learner for Knows {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {
        self.blocks += 1;
    }
    fn gap(&mut self) {}
    fn fix(&mut self, _: u32, _: &Fix) {}
    fn winner(&mut self) -> Option<Winner> {
        (self.from..self.to).contains(&self.blocks).then(|| Winner {
            nets: nets([0.0; 3], [BIAS, 0.0, 0.0]),
            states: [NetState::new(); 2],
            estimate: [[0.0; 3], [BIAS, 0.0, 0.0]],
        })
    }
    fn learnt(&mut self) -> (Nets, [NetState; 2]) {
        (Nets::NONE, [NetState::new(); 2])
    }
    fn report(&self) -> Report {
        let stands = (self.from..self.to).contains(&self.blocks);
        Report {
            winner: u8::from(stands),
            still_s: self.blocks.saturating_sub(self.still_s),
            ..Report::default()
        }
    }
}

/// An action in one second of the drive.
pub enum Act {
    Mode(Mode),
    Alignment(Alignment),
    /// Networks in use from then on, by command.
    Nets,
    /// From then on a receiver sends fixes with this speed north, mm/s; `None`: none.
    Fixes(Option<i32>),
}

/// Samples of a body at rest, level and facing north, with the sensor's error. The remainder of the
/// rounding is carried to the next sample.
pub struct AtRest {
    due: [f64; 6],
    /// Counts of a sample.
    pub rate: [f64; 6],
}

impl AtRest {
    pub fn new(lsb: &Lsb) -> AtRest {
        let earth = 7.292_115e-5;
        // normal gravity by Somigliana and the free-air gradient, as in the navigator
        let s2 = LATITUDE.sin().powi(2);
        let g = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * s2)
            / (1.0 - 0.006_694_379_990_14 * s2).sqrt();
        let g = g
            * (1.0
                - 2.0 / 6_378_137.0
                    * (1.0 + 1.0 / 298.257_223_563 + 0.003_449_786_506_84
                        - 2.0 * s2 / 298.257_223_563)
                    * HEIGHT
                + 3.0 * (HEIGHT / 6_378_137.0).powi(2));
        let per = |lsb: f64| 1.0 / (f64::from(RATE) * lsb);
        AtRest {
            due: [0.0; 6],
            rate: [
                earth * LATITUDE.cos() * per(lsb.rad),
                0.0,
                -earth * LATITUDE.sin() * per(lsb.rad),
                f64::from(BIAS) * per(lsb.mps),
                0.0,
                -g * per(lsb.mps),
            ],
        }
    }

    pub fn sample(&mut self) -> [i32; 6] {
        let mut sample = [0; 6];
        for ((sample, due), rate) in sample.iter_mut().zip(&mut self.due).zip(&self.rate) {
            *due += rate;
            *sample = due.round() as i32;
            *due -= f64::from(*sample);
        }
        sample
    }
}

/// Value of the frames' counts.
pub fn lsb() -> Lsb {
    Lsb {
        rad: 2f64.powi(-33),
        mps: 2f64.powi(-27) * FOOT,
    }
}

/// Result of a drive.
pub struct DriveResult {
    /// Horizontal error after 22 min, m.
    pub error_m: f64,
    /// Correction in force at the end of each second, m/s2.
    pub force: Vec<f32>,
}

/// A good fix with this speed north, mm/s, whose velocity is known to 0.05 m/s.
pub fn fix(second: u32, speed: i32) -> Vec<u8> {
    let pvt = Pvt {
        time_of_week: second * 1000,
        fix: 3,
        flags: 1,
        horizontal_accuracy: 1400,
        vertical_accuracy: 1500,
        velocity: [speed, 0, 0],
        speed_accuracy: 87,
        ..Pvt::default()
    };
    pvt.emit().to_vec()
}

pub fn drive(config: Config, knows: Knows, script: &[(u32, Act)]) -> DriveResult {
    let lsb = lsb();
    let mut device = Device::new(Config::default());
    device.app = App::with_learner(config, Some(Box::leak(Box::new(knows))));
    let sensors = Sensors {
        noise: [1e-6, 1e-4],
        bias: [1e-7, 1e-3],
        walk: 0.0,
    };
    let period = 1.0 / f64::from(RATE);
    let mut words_at_rest = AtRest::new(&lsb);
    let mut computer = Align::new(sensors, lsb, period);
    let mut navigator = None;
    let mut force = Vec::new();
    let mut speed = None;
    for second in 0..END {
        for (_, act) in script.iter().filter(|(at, _)| *at == second) {
            match act {
                Act::Mode(mode) => device.order(&Request::SetMode(*mode)),
                Act::Alignment(alignment) => device.order(&Request::Alignment(*alignment)),
                Act::Nets => {
                    device.order(&Request::SetMode(Mode::Frozen));
                }
                Act::Fixes(of) => speed = *of,
            }
        }
        if second == ALIGN {
            computer.restart(true);
        }
        if second == FREE {
            let aligned = computer.finish(LATITUDE, HEIGHT).expect("aligned");
            let state = State {
                position: PLACE,
                velocity: [0.0; 3],
                q_bn: aligned.q_bn,
            };
            let noise = Noise {
                gyro: 0.0,
                accel: 0.0,
            };
            let config = nav::Config::new(lsb, period, noise);
            navigator = Some(Navigator::new(config, state).expect("a good state"));
        }
        if let Some(speed) = speed {
            device.lines.gnss.input.extend(fix(second, speed));
            device.wait_ms(1);
        }
        for n in 0..RATE {
            let [a, b, c, d, e, f] = words_at_rest.sample();
            let fields = Fields {
                gyro: [a, b, c],
                accel: [d, e, f],
                ..Fields::default()
            };
            device.feed(&KIND.frame(second * RATE + n, fields));
            let sent = device.lines.navigation.sent.pop().expect("a frame");
            let [a, b, c, d, e, f] = values(KIND.format, &sent).map(|x| x as i32);
            let counts = Counts {
                dtheta: [a, b, c],
                dv: [d, e, f],
            };
            match &mut navigator {
                Some(navigator) => navigator.sample(&counts),
                None => computer.sample(&counts),
            }
        }
        let in_force = device.ask(&Request::GetEstimate, |answer| match answer {
            Response::Estimate(estimate) => estimate.in_force[1][0],
            other => panic!("{other:?}"),
        });
        force.push(in_force);
    }
    let mut navigator = navigator.expect("coasted");
    navigator.take_transition();
    let [north, east, _] = navigator.state().position.ned_from(&PLACE);
    DriveResult {
        error_m: north.hypot(east),
        force,
    }
}

pub fn config(activation: Activation) -> Config {
    Config {
        activation,
        block: 1.0,
        nets: nets([0.0; 3], [BIAS, 0.0, 0.0]),
        ..KIND.config()
    }
}

pub fn knows(from: u32) -> Knows {
    Knows {
        blocks: 0,
        from,
        to: u32::MAX,
        still_s: u32::MAX,
    }
}

pub const BEGINS: (u32, Act) = (ALIGN, Act::Alignment(Alignment::Started));
pub const ENDS: (u32, Act) = (FREE, Act::Alignment(Alignment::Finished));
pub const LEARN: (u32, Act) = (0, Act::Mode(Mode::Learn));

/// Fastest change of the correction from one second to the next, m/s2.
pub fn fastest(force: &[f32]) -> f32 {
    force
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f32::max)
}

/// The closed form: 2 a / ws^2 sin^2(ws t / 2) with the Schuler rate.
fn schuler(seconds: f64) -> f64 {
    let w = (9.81_f64 / 6.371e6).sqrt();
    2.0 * f64::from(BIAS) / (w * w) * (0.5 * w * seconds).sin().powi(2)
}

#[test]
fn the_trap() {
    // the alignment is not reported, and after it the correction is switched on by command
    let seen = drive(
        config(Activation::Commanded),
        knows(u32::MAX),
        &[(FREE, Act::Nets)],
    );
    println!("switched on after the alignment: {:.1} m", seen.error_m);
    assert!(
        (seen.error_m / schuler(1320.0) - 1.0).abs() < 0.05,
        "{}",
        seen.error_m
    );
    assert!((seen.error_m - 680.0).abs() < 30.0);
}

#[test]
fn on_before_the_alignment_it_does_good_and_after_it_waits() {
    let before = drive(
        config(Activation::Commanded),
        knows(20),
        &[LEARN, BEGINS, ENDS],
    );
    assert!(before.force[..ALIGN as usize].iter().all(|f| *f == 0.0));
    assert!(before.force[ALIGN as usize..].iter().all(|f| *f == BIAS));
    let after = drive(
        config(Activation::Commanded),
        knows(500),
        &[LEARN, BEGINS, ENDS],
    );
    assert!(after.force.iter().all(|f| *f == 0.0));
    println!(
        "on before {:.2} m, known after {:.2} m",
        before.error_m, after.error_m
    );
    // a constant tilt of 20" lets the Earth's rate turn the level a little: 22 m
    assert!(before.error_m < 1.0 && after.error_m < 30.0);
}

/// For an aided computer: in every case the correction moves no faster than the limit that its
/// filter relies on.
#[test]
fn faded_follows_no_faster_than_the_limit() {
    let config = config(Activation::Faded);
    let slew = config.slew.accel;
    let script = [(0, Act::Fixes(Some(0))), LEARN, BEGINS, ENDS];
    let seen = drive(config, knows(500), &script);
    let fastest = fastest(&seen.force);
    assert!(
        fastest > 0.99 * slew && fastest < 1.01 * slew,
        "{fastest} {slew}"
    );
    assert_eq!(*seen.force.last().expect("seconds"), BIAS);
    assert!(seen.force[..500].iter().all(|f| *f == 0.0));
    // a computer without aiding gets the same error, only more slowly: so this is not the default
    println!("faded in, unaided: {:.1} m", seen.error_m);
    assert!(seen.error_m > 300.0 && seen.error_m < 680.0);
}

#[test]
fn toggled_it_fades_out_and_waits_for_the_next_alignment() {
    let config = config(Activation::Commanded);
    let slew = config.slew.accel;
    let script = [
        LEARN,
        BEGINS,
        ENDS,
        (400, Act::Mode(Mode::Shadow)),
        (420, Act::Mode(Mode::Learn)),
        (700, Act::Alignment(Alignment::Started)),
        (800, Act::Alignment(Alignment::Finished)),
        (810, Act::Mode(Mode::Bypass)),
    ];
    let seen = drive(config, knows(20), &script);
    assert!(seen.force[60..400].iter().all(|f| *f == BIAS));
    let after = fastest(&seen.force[61..700]).max(fastest(&seen.force[700..]));
    assert!(after > 0.99 * slew && after < 1.01 * slew, "{after} {slew}");
    assert!(
        seen.force[520..700].iter().all(|f| *f == 0.0),
        "off until the next one"
    );
    assert!(
        seen.force[700..810].iter().all(|f| *f == BIAS),
        "and then at once"
    );
    assert!(seen.force[950..].iter().all(|f| *f == 0.0));
}

#[test]
fn given_up_it_fades_out_but_never_during_an_alignment() {
    let config = config(Activation::Commanded);
    let slew = config.slew.accel;
    let lost = |to: u32| Knows { to, ..knows(20) };
    let seen = drive(config.clone(), lost(500), &[LEARN, BEGINS, ENDS]);
    assert!(seen.force[60..499].iter().all(|f| *f == BIAS));
    let fastest = fastest(&seen.force[61..]);
    assert!(
        fastest > 0.99 * slew && fastest < 1.01 * slew,
        "{fastest} {slew}"
    );
    assert!(seen.force[620..].iter().all(|f| *f == 0.0));
    let seen = drive(config, lost(200), &[LEARN, BEGINS, ENDS]);
    assert!(seen.force[60..360].iter().all(|f| *f == BIAS));
    assert!(seen.force[480..].iter().all(|f| *f == 0.0));
}

/// While no fixes come, the computer navigates without them and cannot follow: what is in force
/// stays. It goes on when they come again, and goes when it is given up.
#[test]
fn faded_holds_while_no_fixes_come() {
    let config = config(Activation::Faded);
    let fixes = |at, of| (at, Act::Fixes(of));
    let script = [
        fixes(0, Some(0)),
        LEARN,
        BEGINS,
        ENDS,
        fixes(540, None),
        fixes(640, Some(0)),
    ];
    let knows = Knows {
        to: 900,
        ..knows(500)
    };
    let force = drive(config, knows, &script).force;
    assert!(
        force[544] > 0.05 * BIAS && force[544] < 0.5 * BIAS,
        "{}",
        force[544]
    );
    assert!(force[547..640].iter().all(|f| *f == force[547]));
    assert!(force[660] > force[640]);
    assert!(force[930] < force[899], "it fades out");
}

/// Mode shadow learns and changes no sample; bypass and frozen ignore the learner.
#[test]
fn other_modes_are_not_touched() {
    for mode in [Mode::Shadow, Mode::Bypass, Mode::Frozen] {
        let config = Config {
            nets: Nets::NONE,
            ..config(Activation::Faded)
        };
        let script = [(0, Act::Mode(mode)), BEGINS, ENDS];
        let seen = drive(config, knows(20), &script);
        assert!(seen.force.iter().all(|f| *f == 0.0), "{mode:?}");
    }
}
