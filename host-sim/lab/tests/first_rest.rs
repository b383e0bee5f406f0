//! The device with activation `first-rest`, on samples of an own making: the first rest after
//! power-on, without a receiver.

use firmware::configuration::{Activation, Configuration, VehicleKind};
use firmware::control::{Alignment, Mode};
use firmware::sample::{Counts, Lsb};
use host_core::inertial::sins::Increment;
use host_core::list::{IN_MEMORY, List};
use host_estimation::learning::device::{Device, Drive, Input};
use host_lab::abuse::Begin;
use host_unit::{Unit, around};
use nalgebra::Vector3;

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

/// Disturbances of the first minute, and what they may leave of an error, rad/s: nothing more than
/// the rest would.
const HAPPENS: [(Begin, f64); 9] = [
    (Begin::Stands, 1.5e-4),
    (Begin::SitsDown(1.0), 1.5e-4),
    (Begin::Swayed(0.3), f64::INFINITY),
    (Begin::Loaded(0.45), f64::INFINITY),
    (Begin::Lift(0.8), 1.5e-4),
    (Begin::Ferry([1.15, 10.0]), f64::INFINITY),
    (Begin::Turned([1.15, 15.0]), 1.5e-4),
    (Begin::Idles(0.5), 6e-4),
    (Begin::Towed(0.2), f64::INFINITY),
];

/// None of them makes the gyros worse than they are, of sensors with errors and of perfect ones,
/// and after most of them hardly an error is left.
#[test]
fn what_happens_at_power_on_does_no_harm() {
    let dt = 1.0 / HZ as f64;
    for (begin, least) in HAPPENS {
        let mut truth = vec![
            Increment {
                dtheta: Vector3::from(EARTH) * dt,
                dv: Vector3::z() * (-9.807 * dt),
            };
            50 * HZ
        ];
        begin.disturb(&mut truth, dt);
        for biases in [BIASES, NONE] {
            let mut noise = Noise(11);
            let mut of = |exact: f64, density: f64, worth: f64| {
                let noise = density * noise.next() * dt.sqrt();
                ((exact + noise) / worth).round() as i32
            };
            let each = truth.iter().map(|one| Counts {
                dtheta: core::array::from_fn(|i| of(one.dtheta[i] + biases[i] * dt, 5e-5, LSB.rad)),
                dv: core::array::from_fn(|i| of(one.dv[i], 7e-4, LSB.mps)),
            });
            let drive = drive(&configuration(), &List::collected(each, IN_MEMORY), &[]);
            let Some(end) = drive.correction.last() else {
                panic!("{begin:?}: no second")
            };
            let without = biases.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
            let left = left(end, biases);
            assert!(left <= without, "{begin:?}: {left} {end:?}");
            assert!(left <= least, "{begin:?}: {left} {end:?}");
            assert_eq!(end[1], [0.0; 3], "{begin:?}");
        }
    }
}
