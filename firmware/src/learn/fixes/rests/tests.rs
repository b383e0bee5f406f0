use super::*;
use crate::learn::fixes::Memory;
use crate::learn::fixes::drive::{Drive, Receiver, Road, mems};
use crate::learn::{Learner, Settings};

const PARKED: Road = Road {
    speed: |_| 0.0,
    heading: |_| 0.4,
    sway: 0.0,
    axle: 0.0,
};
/// Drives for a minute, stands for a minute, again and again.
const STOPS: Road = Road {
    speed: |t| {
        if t % 120.0 < 60.0 {
            6.0 * (1.0 - libm::cos(t * core::f64::consts::TAU / 60.0))
        } else {
            0.0
        }
    },
    heading: |t| {
        if t % 120.0 < 60.0 {
            0.2 * (1.0 - libm::cos(t * core::f64::consts::TAU / 60.0))
        } else {
            0.0
        }
    },
    sway: 0.0,
    axle: 0.0,
};
const PERFECT: [[f64; 3]; 2] = [[0.0; 3]; 2];
const MEMS: [[f64; 3]; 2] = [[6e-3, -9e-3, 4e-3], [0.1, -0.06, 0.08]];
const LASER: [[f64; 3]; 2] = [[2e-6, -1.5e-6, 1e-6], [3e-3, -4e-3, 2e-3]];
const EARTH: f64 = 7.292e-5;

fn memory() -> Box<Memory> {
    Box::new(Memory::ZEROED)
}

/// Errors of the gyros' biases by the six biases, rad/s, and the standard deviations claimed.
fn of_gyros(drive: &Drive, biases: [[f64; 3]; 2]) -> [(f64, f64); 3] {
    let bank = drive.learner.bank();
    let (estimate, sigma) = (bank.estimate_of(1), bank.bias_sigma());
    core::array::from_fn(|i| (f64::from(estimate[i]) - biases[0][i], f64::from(sigma[i])))
}

/// What a rest teaches at several times is together what the whole of it shows.
#[test]
fn news_do_not_count_twice() {
    let mut rests = Rests::default();
    let (mut sum, mut information, mut times) = (0.0, 0.0, 0);
    let variance = |seconds: f32| 1e-8 / seconds + 2e-10;
    let mean = |seconds: f32| [1e-3 + 1e-4 / seconds; 3];
    for k in 4..200 {
        let seconds = 0.5 * k as f32;
        if let Some(news) = rests.rest(shown(mean(seconds), variance(seconds), seconds), 1.0) {
            sum += news.errors[0] / news.variance;
            information += 1.0 / news.variance;
            times += 1;
            assert!((information * variance(seconds) - 1.0).abs() < 1e-4);
            assert!((sum / information / mean(seconds)[0] - 1.0).abs() < 1e-4);
        }
    }
    assert!((8..20).contains(&times), "{times}");
    // another rest begins at nothing
    assert!(
        rests
            .rest(shown(mean(2.0), variance(2.0), 2.0), 1.0)
            .is_some()
    );
    assert!(rests.rest(None, 1.0).is_none());
    assert!(
        rests
            .rest(shown(mean(9.0), variance(9.0), 9.0), 1.0)
            .is_some()
    );
    assert!(rests.rest(shown([0.0; 3], f32::NAN, 9.5), 1.0).is_none());
    assert!(rests.rest(shown([0.0; 3], 0.0, 9.5), 1.0).is_none());
}

fn shown(mean: V32, noise: f32, seconds: f32) -> Option<RestMean> {
    Some(RestMean {
        mean,
        noise,
        unknown: 0.0,
        seconds,
        stood_s: seconds,
    })
}

/// A parked vehicle without a receiver: the gyros' errors are found as well as is claimed, and
/// without an attitude no better than the Earth's rotation is known.
#[test]
fn a_parked_vehicle_learns_its_gyros() {
    for (settings, biases, seconds) in [(mems(), MEMS, 30), (Settings::MEDIUM, LASER, 300)] {
        for navigates in [true, false] {
            let mut squares = 0.0;
            for seed in 0..8 {
                let mut memory = memory();
                let mut drive =
                    Drive::new(&mut memory, settings, PARKED, Receiver::NONE, biases, seed);
                if !navigates {
                    drive.begin_unaligned();
                }
                drive.seconds(seconds);
                for (error, sigma) in of_gyros(&drive, biases) {
                    squares += error * error / (sigma * sigma) / 24.0;
                    if settings == mems() {
                        let [least, most] = if navigates {
                            [1.2e-5, 5e-5] // noise and walk
                        } else {
                            [0.95 * EARTH, 1.3 * EARTH]
                        };
                        assert!((least..most).contains(&sigma), "{navigates} {sigma}");
                    }
                }
            }
            assert!((0.01..2.5).contains(&squares), "{navigates}: {squares}");
        }
    }
}

/// Sensors without errors stay uncorrected, at rest as well, whatever the Earth does.
#[test]
fn the_earth_is_no_error() {
    for settings in [mems(), Settings::MEDIUM] {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, settings, PARKED, Receiver::NONE, PERFECT, 3);
        drive.begin_unaligned();
        drive.seconds(200);
        assert_eq!(drive.learner.bank().leading(), 0);
        assert_eq!(drive.learner.report().winner, 0);
    }
}

/// Without fixes, standstills keep the navigator's velocity, and what it learns of the sensors.
#[test]
fn without_fixes_stops_show_the_velocity() {
    let after = |road: Road, seconds: u32| {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, mems(), road, Receiver::GOOD, MEMS, 5);
        drive.seconds(120);
        drive.receiver = Receiver::NONE;
        drive.seconds(seconds);
        let [_, velocity] = drive.error();
        velocity
    };
    let standing = after(STOPS, 4 * 120 - 2);
    assert!(standing < 0.1, "{standing}");
    // a quiet cruise is no standstill, whatever the sensors feel
    let under_way = after(Road::STRAIGHT, 60);
    assert!(under_way < 5.0, "{under_way}");
}

/// However long no fix comes, so that the navigator no longer knows its velocity: a quiet cruise is
/// no standstill, also after one that was.
#[test]
fn a_long_cruise_without_fixes_is_no_standstill() {
    const CRUISE: Road = Road {
        speed: |t| 20.0 * ((t - 80.0) / 20.0).clamp(0.0, 1.0),
        ..Road::STRAIGHT
    };
    for seconds in [120, 180, 240, 300] {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, mems(), CRUISE, Receiver::GOOD, MEMS, 5);
        drive.seconds(130);
        drive.receiver = Receiver::NONE;
        drive.seconds(seconds);
        let [_, velocity] = drive.error();
        let sigma = f64::from(drive.learner.bank().error_doubt(3));
        assert!(velocity < 5.0 * sigma, "{seconds}: {velocity} of {sigma}");
    }
}

/// Gyros that are known stay so on a table, or a ship, that turns evenly without fixes; and what it
/// seems to show is not stored.
#[test]
fn an_even_turn_without_fixes_is_no_rest() {
    const TURNS: Road = Road {
        speed: |t| 12.0 * (1.0 - ((t - 590.0) / 10.0).clamp(0.0, 1.0)),
        heading: |t| {
            1.6 * libm::sin(t.min(600.0) * 0.13) + (0.3 * (t - 600.0).max(0.0)).to_radians()
        },
        sway: 0.0,
        axle: 0.0,
    };
    let mut memory = memory();
    let mut drive = Drive::new(&mut memory, mems(), TURNS, Receiver::GOOD, MEMS, 3);
    drive.seconds(600);
    assert!(drive.learner.remember() > 0);
    drive.receiver = Receiver::NONE;
    drive.seconds(300);
    for (error, sigma) in of_gyros(&drive, MEMS) {
        assert!(error.abs() < 4.0 * sigma, "{error} of {sigma}");
    }
    assert_eq!(drive.learner.remember(), 0);
}

/// A ship does not rest.
#[test]
fn a_ship_does_not_rest() {
    let mut memory = memory();
    let settings = Settings {
        vehicle: VehicleKind::Ship,
        ..mems()
    };
    let mut drive = Drive::new(&mut memory, settings, PARKED, Receiver::NONE, MEMS, 1);
    drive.begin_unaligned();
    drive.seconds(60);
    assert!(drive.learner.report().still_s > 50);
    assert_eq!(*drive.learner.bank().estimate_of(1), [0.0; 6]);
}

/// A turntable turns evenly, and its rate passes for an error of the gyros. When the vehicle
/// drives, the fixes put that right.
#[test]
fn fixes_put_a_turntable_right() {
    for (road, rate) in [(TABLE_SLOW, 0.1), (TABLE, 0.5), (TABLE_FAST, 2.0)] {
        let mut memory = memory();
        let mut drive = Drive::new(&mut memory, mems(), road, Receiver::GOOD, MEMS, 2);
        drive.begin_unaligned();
        drive.seconds(60);
        let [_, _, (table, _)] = of_gyros(&drive, MEMS);
        assert!((table.to_degrees() / rate - 1.0).abs() < 0.1, "{table}");
        drive.seconds(540);
        for (error, sigma) in of_gyros(&drive, MEMS) {
            assert!(
                error.abs() < 1e-4 && sigma < 1e-4,
                "{rate}: {error} {sigma}"
            );
        }
        let refused = drive.learner.report().refused;
        assert!(refused < 60, "{rate}: {refused}");
    }
}

const TABLE_SLOW: Road = Road {
    speed: town,
    heading: |t| turns(t, 0.1),
    sway: 0.0,
    axle: 0.0,
};
const TABLE: Road = Road {
    heading: |t| turns(t, 0.5),
    ..TABLE_SLOW
};
const TABLE_FAST: Road = Road {
    heading: |t| turns(t, 2.0),
    ..TABLE_SLOW
};
fn town(t: f64) -> f64 {
    let s = (t - 70.0).max(0.0);
    (0.5 * s).min(1.0) * (12.0 + 5.0 * libm::sin(s * 0.17))
}
fn turns(t: f64, dps: f64) -> f64 {
    let s = (t - 70.0).max(0.0);
    (dps * t.min(60.0)).to_radians() + 1.6 * (1.0 - libm::cos(s * 0.13))
}

/// Drives for a minute and turns by a radian, stands for a minute, again and again.
const TURNS: Road = Road {
    speed: |t| {
        let t = t % 120.0;
        if t < 60.0 {
            6.0 * (1.0 - libm::cos(t * core::f64::consts::TAU / 60.0))
        } else {
            0.0
        }
    },
    heading: |t| {
        let share = (t % 120.0 / 60.0).min(1.0);
        libm::floor(t / 120.0) + 0.5 * (1.0 - libm::cos(share * core::f64::consts::PI))
    },
    sway: 1.4e-4,
    axle: 0.0,
};

/// Standard deviations of the gyros' errors that rests of `seconds` at these headings allow: what
/// is unknown beside them is the heading of all of them together, of which `sigma` is known.
/// Cramer-Rao bound for level sensors at the latitude of [`Drive`].
fn bound(headings: &[f64], noise: f64, seconds: f64, sigma: f64) -> [f64; 3] {
    let sway = f64::from(SWAY) / seconds;
    let variance = noise * noise / seconds + 2.0 * sway * sway;
    let north = EARTH * libm::cos(0.8);
    // information of [errors x, y, z, heading]
    let mut all = [[0.0; 4]; 4];
    all[3][3] = 1.0 / (sigma * sigma);
    for h in headings {
        let by_heading = [-north * libm::sin(*h), -north * libm::cos(*h), 0.0];
        for (axis, by) in by_heading.into_iter().enumerate() {
            let mut row = [0.0; 4];
            (row[axis], row[3]) = (1.0, by);
            for (i, line) in all.iter_mut().enumerate() {
                for (j, entry) in line.iter_mut().enumerate() {
                    *entry += row[i] * row[j] / variance;
                }
            }
        }
    }
    // the heading eliminated, then a 3 x 3 of which z stands alone
    let reduced = |i: usize, j: usize| all[i][j] - all[i][3] * all[3][j] / all[3][3];
    let det = reduced(0, 0) * reduced(1, 1) - reduced(0, 1) * reduced(1, 0);
    [
        (reduced(1, 1) / det).sqrt(),
        (reduced(0, 0) / det).sqrt(),
        (1.0 / reduced(2, 2)).sqrt(),
    ]
}

/// A laser gyro without a receiver, several rests at several headings: as good as they allow.
#[test]
fn rests_at_several_headings_reach_their_bound() {
    let (rests, mut squares, mut normal) = (8, [0.0; 3], 0.0);
    const SEEDS: u64 = 12;
    for seed in 0..SEEDS {
        let mut memory = memory();
        let mut drive = Drive::new(
            &mut memory,
            Settings::MEDIUM,
            TURNS,
            Receiver::NONE,
            LASER,
            seed,
        );
        drive.seconds(rests * 120);
        for (square, (error, sigma)) in squares.iter_mut().zip(of_gyros(&drive, LASER)) {
            *square += error * error / SEEDS as f64;
            normal += error * error / (sigma * sigma) / (3.0 * SEEDS as f64);
        }
    }
    let headings: Vec<f64> = (1..=rests).map(f64::from).collect();
    let noise = f64::from(Settings::MEDIUM.noise.gyro);
    let bound = bound(&headings, noise, 57.0, 1e-3);
    for (square, bound) in squares.into_iter().zip(bound) {
        assert!(square.sqrt() < 1.2 * bound, "{square} {bound}");
    }
    assert!(normal < 1.5, "{normal}");
}
