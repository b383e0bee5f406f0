//! The device with activation `first-rest`, on samples of an own making: the first rest after
//! power-on, without a receiver.

use firmware::configuration::{Activation, Configuration, VehicleKind};
use firmware::control::{Alignment, Mode};
use firmware::sample::{Counts, Lsb};
use host_core::list::{IN_MEMORY, List};
use host_estimation::learning::device::{Device, Drive, Input};
use host_unit::{Unit, around};

const HZ: usize = 100;
const LSB: Lsb = Lsb {
    rad: 1e-8,
    mps: 1e-6,
};
const NONE: [f64; 3] = [0.0; 3];
const BIASES: [f64; 3] = [6e-3, -9e-3, 4e-3];
/// The Earth's rotation in the axes of a vehicle that points east, at a latitude of 46 deg.
const EARTH: [f64; 3] = [0.0, -5.065e-5, -5.245e-5];

/// White noise by the sum of twelve even numbers.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
}

/// Whether the vehicle moves in this second.
type Moves = fn(usize) -> bool;

/// Samples of a vehicle that turns and shakes while it moves.
fn samples(gyro: [f64; 3], moves: Moves, seconds: usize) -> List<Counts> {
    let mut noise = Noise(7);
    let each = (0..seconds * HZ).map(|k| {
        let t = k as f64 / HZ as f64;
        let motion = if moves(k / HZ) { 1.0 } else { 0.0 };
        let swing = motion * (0.8 * t).sin();
        let mut of = |mean: f64, density: f64, worth: f64| {
            ((mean / HZ as f64 + density * noise.next() / (HZ as f64).sqrt()) / worth).round()
                as i32
        };
        let shaken = 1.0 + 9.0 * motion;
        Counts {
            dtheta: core::array::from_fn(|i| {
                of(gyro[i] + EARTH[i] + 0.3 * swing, shaken * 5e-5, LSB.rad)
            }),
            dv: [swing, 0.7 * swing, -9.807].map(|f| of(f, shaken * 7e-4, LSB.mps)),
        }
    });
    List::collected(each, IN_MEMORY)
}

/// Consumer MEMS: 0.5 deg/s.
fn configuration() -> Configuration {
    let mut unit = Unit::preset("icm-42688").expect("a preset");
    unit.sensor.rate_hz = Some(HZ as f64);
    unit.correction.mode = around::Mode::Learn;
    unit.correction.activation = around::Activation::FirstRest;
    unit.configuration()
        .expect("a unit file that a device takes")
}

fn drive(
    configuration: &Configuration,
    samples: &List<Counts>,
    alignment: &[(usize, Alignment)],
) -> Drive {
    Device::new(configuration).drive(&Input {
        samples,
        lsb: LSB,
        dt: 1.0 / HZ as f64,
        celsius: &[],
        missing: &[],
        fixes: &[],
        wheels: &[],
        alignment,
    })
}

/// Largest error of the gyros' correction, rad/s.
fn left(correction: &[[f32; 3]; 2], biases: [f64; 3]) -> f64 {
    let [gyro, _] = correction;
    let off = gyro
        .iter()
        .zip(biases)
        .map(|(a, b)| (f64::from(*a) - b).abs());
    off.fold(0.0, f64::max)
}

/// It stands for 40 s and drives off: the gyros are corrected but for the Earth's rotation, a few
/// seconds after power-on and from then on by the same, and nothing else is.
#[test]
fn the_first_rest_corrects_the_gyros() {
    let moves: Moves = |second| (40..90).contains(&second);
    let drive = drive(&configuration(), &samples(BIASES, moves, 130), &[]);
    let of = &drive.correction;
    assert_eq!(of[1], [[0.0; 3]; 2]);
    for (second, of) in of.iter().enumerate().skip(9) {
        // the icm-42688's noise over six seconds, and the Earth
        assert!(left(of, BIASES) < 1.5e-4, "{second}: {of:?}");
        assert_eq!(of[1], [0.0; 3]);
    }
    assert!(left(&of[39], BIASES) < 8e-5, "{:?}", of[39]);
    // nothing jumps in the drive, and a later rest changes nothing
    assert!(of[43..].iter().all(|later| *later == of[43]));
}

/// Sensors without errors stay as they are, and so does all that no rest at the beginning shows.
#[test]
fn what_is_no_first_rest_changes_nothing() {
    let parked: Moves = |_| false;
    let same = |drive: &Drive, why: &str| assert!(!drive.changed, "{why}");
    let own = configuration();
    same(
        &drive(&own, &samples(NONE, parked, 120), &[]),
        "perfect sensors",
    );
    let late: Moves = |second| second < 40;
    same(&drive(&own, &samples(BIASES, late, 80), &[]), "a late rest");
    let aligns = [(10, Alignment::Started)];
    same(
        &drive(&own, &samples(BIASES, parked, 60), &aligns),
        "the computer aligns itself",
    );
    let mut ship = configuration();
    ship.vehicle.kind = VehicleKind::Ship;
    same(&drive(&ship, &samples(BIASES, parked, 60), &[]), "a ship");
    let mut usual = configuration();
    usual.correction.activation = Activation::NextPowerOn;
    same(
        &drive(&usual, &samples(BIASES, parked, 60), &[]),
        "the usual activation",
    );
    let mut shadow = configuration();
    shadow.correction.mode = Mode::Shadow;
    same(
        &drive(&shadow, &samples(BIASES, parked, 60), &[]),
        "mode shadow",
    );
}

/// An alignment of the navigation computer that begins later leaves in force what was found.
#[test]
fn an_alignment_keeps_what_was_found() {
    let aligns = [
        (20 * HZ, Alignment::Started),
        (35 * HZ, Alignment::Finished),
    ];
    let drive = drive(&configuration(), &samples(BIASES, |_| false, 60), &aligns);
    let of = &drive.correction;
    assert!(left(&of[19], BIASES) < 1e-4, "{:?}", of[19]);
    assert!(of[21..].iter().all(|later| *later == of[21]));
}

/// What may happen to a vehicle that is switched on, in its first minute: the true rate (rad/s) and
/// specific force (m/s2) beside gravity and the Earth's rotation, at a time (s).
type Happens = fn(f64) -> [[f64; 3]; 2];

const STANDS: [[f64; 3]; 2] = [NONE; 2];

/// Disturbances, and what they may leave of an error, rad/s: nothing more than the rest would.
const HAPPENS: [(&str, Happens, f64); 8] = [
    ("stands", |_| STANDS, 1.5e-4),
    // tilted by a degree within a second, and back
    (
        "someone sits down and rises",
        |t| {
            let turns = |from: f64| {
                if (from..from + 1.0).contains(&t) {
                    0.0175
                } else {
                    0.0
                }
            };
            let tilt = if (11.0..21.0).contains(&t) {
                0.0175 * 9.807
            } else {
                0.0
            };
            [[0.0, turns(10.0) - turns(20.0), 0.0], [tilt, 0.0, 0.0]]
        },
        1.5e-4,
    ),
    (
        "it is loaded",
        |t| {
            let knock = if (t % 3.0) < 0.2 {
                0.05 * (60.0 * t).sin()
            } else {
                0.0
            };
            [[knock, 0.4 * knock, 0.0], [4.0 * knock, 0.0, 9.0 * knock]]
        },
        f64::INFINITY,
    ),
    (
        "a lift",
        |t| {
            let pushes = |from: f64| {
                if (from..from + 2.0).contains(&t) {
                    0.8
                } else {
                    0.0
                }
            };
            [NONE, [0.0, 0.0, pushes(20.0) - pushes(8.0)]]
        },
        1.5e-4,
    ),
    (
        "a ferry in swell",
        |t| {
            let roll = 0.02 * (0.7 * t).cos();
            [
                [0.7 * roll, 0.0, 0.0],
                [0.0, 9.8 * 0.02 * (0.7 * t).sin(), 0.0],
            ]
        },
        f64::INFINITY,
    ),
    (
        "turned, then set down",
        |t| [[0.0, 0.0, if t < 15.0 { 0.02 } else { 0.0 }], NONE],
        1.5e-4,
    ),
    (
        "the engine idles",
        |t| {
            let shakes = (150.0 * t).sin();
            [
                [8e-3 * shakes; 3],
                [0.5 * shakes, 0.3 * shakes, 0.4 * shakes],
            ]
        },
        6e-4,
    ),
    (
        "towed from the first sample on",
        |t| {
            let road = 0.02 * (40.0 * t).sin() * (7.0 * t).cos();
            [
                [road, 0.7 * road, 0.01 * (0.5 * t).sin()],
                [9.0 * road, 0.3, 20.0 * road],
            ]
        },
        f64::INFINITY,
    ),
];

/// None of them makes the gyros worse than they are, of sensors with errors and of perfect ones,
/// and after most of them hardly an error is left.
#[test]
fn what_happens_at_power_on_does_no_harm() {
    for (what, happens, least) in HAPPENS {
        for biases in [BIASES, NONE] {
            let mut noise = Noise(11);
            let each = (0..50 * HZ).map(|k| {
                let [turn, push] = happens(k as f64 / HZ as f64);
                let mut of = |mean: f64, density: f64, worth: f64| {
                    let noise = density * noise.next() / (HZ as f64).sqrt();
                    ((mean / HZ as f64 + noise) / worth).round() as i32
                };
                let gravity = [0.0, 0.0, -9.807];
                Counts {
                    dtheta: core::array::from_fn(|i| {
                        of(biases[i] + EARTH[i] + turn[i], 5e-5, LSB.rad)
                    }),
                    dv: core::array::from_fn(|i| of(gravity[i] + push[i], 7e-4, LSB.mps)),
                }
            });
            let drive = drive(&configuration(), &List::collected(each, IN_MEMORY), &[]);
            let Some(end) = drive.correction.last() else {
                panic!("{what}: no second")
            };
            let without = biases.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
            let left = left(end, biases);
            assert!(left <= without.max(0.0), "{what}: {left} {end:?}");
            assert!(left <= least, "{what}: {left} {end:?}");
            assert_eq!(end[1], [0.0; 3], "{what}");
        }
    }
}
