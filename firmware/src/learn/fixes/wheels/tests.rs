use super::*;
use crate::fix::{NOT_MEASURED, OBSERVATIONS};
use crate::learn::fixes::Memory;
use crate::learn::fixes::drive::{self, Drive, Odometer, Receiver, Road};
use crate::learn::{Learner, Settings};

const NONE: Receiver = Receiver {
    sigmas: [NOT_MEASURED; OBSERVATIONS],
    ..Receiver::GOOD
};
const PERFECT: [[f64; 3]; 2] = [[0.0; 3]; 2];
const MEMS: [[f64; 3]; 2] = [[6e-3, -9e-3, 4e-3], [0.1, -0.06, 0.08]];
const MOUNTED: Mounted = Mounted {
    lever_arm: [0.0; 3],
    axes: Some([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    ahead: 0.0,
    scale: 0.03,
    noise: 0.03,
    delay: 0.0,
};
const GRIPS: Odometer = Odometer {
    scale: 1.02,
    slip: |_| 1.0,
    ahead: 0.0,
    delay: 0.05,
};
/// A town with stops.
const TOWN: Road = Road {
    speed: |t| (12.0 + 8.0 * libm::sin(t * 0.07) + 5.0 * libm::cos(t * 0.11)).max(0.0),
    heading: |t| 0.7 + 1.6 * libm::sin(t * 0.05) + 0.3 * libm::cos(t * 0.21),
    sway: 0.0,
    axle: 0.0,
};

fn mems(mounted: Mounted) -> Settings {
    Settings {
        wheels: Some(mounted),
        ..drive::mems()
    }
}

/// Some minutes with fixes and then some without.
fn tunnel(drive: &mut Drive, wheels: Option<Odometer>, [with, without]: [u32; 2]) {
    drive.wheels = wheels;
    drive.seconds(with);
    drive.receiver = NONE;
    drive.seconds(without);
}

/// Root mean square of the errors of position and velocity at the end of a tunnel, m and m/s, and
/// of the gyros' errors in standard deviations.
fn after(road: Road, mounted: Mounted, wheels: Option<Odometer>) -> [f64; 3] {
    let mut squares = [0.0; 3];
    for seed in 0..6 {
        let mut memory = Box::new(Memory::ZEROED);
        let settings = mems(mounted);
        let mut drive = Drive::new(&mut memory, settings, road, Receiver::GOOD, MEMS, seed);
        tunnel(&mut drive, wheels, [240, 300]);
        let [position, velocity] = drive.error();
        let (bank, [gyros, _]) = (drive.learner.bank(), MEMS);
        let (estimate, sigma) = (bank.estimate_of(1), bank.bias_sigma());
        let mut gyro = 0.0;
        for (i, bias) in gyros.into_iter().enumerate() {
            gyro += ((f64::from(estimate[i]) - bias) / f64::from(sigma[i])).powi(2) / 3.0;
        }
        for (sum, off) in squares
            .iter_mut()
            .zip([position.powi(2), velocity.powi(2), gyro])
        {
            *sum += off / 6.0;
        }
    }
    squares.map(f64::sqrt)
}

/// What the navigator's errors add to the velocity along an axis, by the definition of the errors.
#[test]
fn the_row_is_the_derivative() {
    let (velocity, axis) = ([12.0, -7.0, 1.0], [0.6, 0.64, -0.48]);
    let by = row(axis, velocity);
    for k in 0..NAV {
        let step = 1e-2;
        let mut x = [0.0; NAV];
        x[k] = step;
        let [a, b, c, d, e, f, ..] = x;
        // C_est = (I - phi x) C: the axis as the navigator has it
        let tilted = add(axis, scale(cross([a, b, c], axis), -1.0));
        let change = dot(tilted, add(velocity, [d, e, f])) - dot(axis, velocity);
        assert!(
            (change / step - by[k]).abs() < 2e-3,
            "{k}: {change} {}",
            by[k]
        );
    }
}

/// In a tunnel wheels hold the velocity, and what is learnt stays within what is claimed.
#[test]
fn wheels_hold_the_velocity_in_a_tunnel() {
    let [bare, fast, _] = after(TOWN, MOUNTED, None);
    let [position, velocity, gyros] = after(TOWN, MOUNTED, Some(GRIPS));
    assert!(velocity < 0.3 && velocity < 0.2 * fast, "{velocity} {fast}");
    assert!(
        position < 40.0 && position < 0.2 * bare,
        "{position} {bare}"
    );
    assert!(gyros < 1.5, "{gyros}");
}

/// The sensors far ahead of the rear axle, and the speed of front wheels that steer.
#[test]
fn the_axle_may_be_elsewhere() {
    let road = Road {
        heading: |t| 0.7 + 1.6 * libm::sin(t * 0.25),
        axle: 2.0,
        ..TOWN
    };
    let mounted = Mounted {
        lever_arm: [-2.0, 0.0, 0.0],
        ahead: 2.7,
        ..MOUNTED
    };
    let wheels = Odometer {
        ahead: 2.7,
        ..GRIPS
    };
    let [position, velocity, _] = after(road, mounted, Some(wheels));
    let [wrong, ..] = after(road, MOUNTED, Some(GRIPS));
    assert!(velocity < 0.3 && position < 40.0, "{velocity} {position}");
    assert!(wrong > 2.0 * position, "{wrong}");
}

/// Wheels that spin by a half, lock for two seconds or count backward are refused, and what they
/// slip unnoticed does not become an error of the sensors.
#[test]
fn slip_is_refused() {
    let [good, ..] = after(TOWN, MOUNTED, Some(GRIPS));
    type Slip = fn(f64) -> f64;
    let slips: [(Slip, f64); 4] = [
        (|t| if t % 20.0 < 5.0 { 1.5 } else { 1.0 }, 30.0),
        (|t| if t % 20.0 < 2.0 { 0.0 } else { 1.0 }, 30.0),
        (|t| if t % 100.0 < 50.0 { -1.0 } else { 1.0 }, 30.0),
        // too little to be an outlier: the way is wrong by as much, the sensors' errors are not
        (|t| if t > 240.0 { 1.02 } else { 1.0 }, 400.0),
    ];
    for (slip, more) in slips {
        let [position, velocity, gyros] = after(TOWN, MOUNTED, Some(Odometer { slip, ..GRIPS }));
        std::eprintln!("{position} {velocity} {gyros}");
        assert!(position < good + more, "{velocity} {position}");
        assert!(gyros < 1.6, "{gyros}");
    }
}

/// A wrong scale is found from fixes; wheels of which nothing is known teach nothing.
#[test]
fn the_scale_is_found_from_fixes() {
    for scale in [0.97, 1.0, 1.04] {
        let mut memory = Box::new(Memory::ZEROED);
        let settings = mems(MOUNTED);
        let mut drive = Drive::new(&mut memory, settings, TOWN, Receiver::GOOD, MEMS, 3);
        tunnel(&mut drive, Some(Odometer { scale, ..GRIPS }), [240, 0]);
        let [of, ..] = drive.learner.motion.wheels.constants;
        let off = f64::from(of.value) - (1.0 / scale - 1.0);
        assert!(
            off.abs() < 3.0 * f64::from(of.variance.sqrt()),
            "{scale}: {off}"
        );
        assert!(of.variance.sqrt() < 0.01);
    }
    let new = Wheels::default();
    assert!(!new.are_known());
}

/// Sensors without errors stay uncorrected, whatever the wheels do.
#[test]
fn perfect_sensors_stay_uncorrected() {
    let slip = |t| if t % 20.0 < 5.0 { 1.1 } else { 1.0 };
    for seed in 0..4 {
        let mut memory = Box::new(Memory::ZEROED);
        let settings = mems(MOUNTED);
        let mut drive = Drive::new(&mut memory, settings, TOWN, Receiver::GOOD, PERFECT, seed);
        tunnel(&mut drive, Some(Odometer { slip, ..GRIPS }), [240, 600]);
        assert_eq!(drive.learner.report().winner, 0, "{seed}");
    }
}
