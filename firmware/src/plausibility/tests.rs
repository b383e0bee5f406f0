//! Whether the right mistakes are found and nothing else.

mod drives;

use super::*;
use crate::plausibility::rest::RestCheck;
use drives::*;
use std::vec::Vec;

#[test]
fn a_parked_vehicle_is_judged_and_raises_nothing() {
    for sheet in SHEETS {
        for latitude in [0.0, 0.8, 80.0 * DEG, -0.6] {
            for (what, motion) in [
                ("level", (|_| Motion::default()) as Moves),
                ("engine", engine),
                ("grade", grade),
            ] {
                for sigmas in [1.0, 3.0] {
                    let drive = Drive {
                        latitude,
                        sigmas,
                        motion,
                        ..Drive::parked(sheet)
                    };
                    assert_eq!(
                        drive.is_silent(what),
                        3 * SEEDS as usize,
                        "{what}, {}",
                        sheet.name
                    );
                }
            }
        }
    }
}

#[test]
fn a_moving_vehicle_raises_nothing() {
    use VehicleKind::{Air, Land, Ship};
    let in_traffic: fn(f64) -> (f32, f32) = |t| match t % 60.0 {
        t if t < 20.0 => (9.0, 0.1),
        _ => (0.02, 0.1),
    };
    let cases: [(&str, VehicleKind, Moves, Receiver, bool); 14] = [
        ("motorway", Land, motorway, None, false),
        ("motorway", Land, motorway, Some(moves), false),
        ("traffic", Land, traffic, None, false),
        ("traffic", Land, traffic, Some(in_traffic), true),
        ("ferry", Ship, ferry, Some(stands), true),
        ("ferry", Ship, ferry, None, false),
        ("anchor", Ship, anchor, Some(stands), true),
        ("bank", Air, bank, None, false),
        ("bank", Air, bank, Some(moves), false),
        ("railway curve", Land, curve, Some(moves), false),
        ("a car on a ferry", Land, ferry, Some(stands), true),
        ("turned in the hand", Land, in_the_hand, Some(stands), false),
        ("turned in the hand", Air, in_the_hand, Some(stands), false),
        ("from side to side", Land, side_to_side, Some(stands), false),
    ];
    for sheet in SHEETS {
        for (what, vehicle, motion, receiver, is_judged) in cases {
            for sigmas in [1.0, 3.0] {
                let drive = Drive {
                    vehicle,
                    motion,
                    receiver,
                    sigmas,
                    seconds: 360,
                    ..Drive::parked(sheet)
                };
                assert_eq!(
                    drive.is_silent(what) > 0,
                    is_judged,
                    "{what}, {}",
                    sheet.name
                );
            }
        }
    }
}

fn times([rate, force]: [[f32; 3]; 2], gyro: f32, accel: f32) -> [[f32; 3]; 2] {
    [rate.map(|w| w * gyro), force.map(|f| f * accel)]
}

#[test]
fn every_wrong_unit_raises_its_fault() {
    use fault::{EARTH_RATE, GRAVITY};
    let mistakes: [(&str, u32, Mistake); 8] = [
        ("deg for rad", EARTH_RATE, |m| times(m, 57.3, 1.0)),
        ("m/s2 for g", GRAVITY, |m| times(m, 1.0, 9.81)),
        ("g for m/s2", GRAVITY, |m| times(m, 1.0, 1.0 / 9.81)),
        ("mg for m/s2", GRAVITY, |m| times(m, 1.0, 101.97)),
        ("feet for metres", GRAVITY, |m| times(m, 1.0, 3.281)),
        ("metres for feet", GRAVITY, |m| times(m, 1.0, 0.3048)),
        ("5 g configured as 10 g", GRAVITY, |m| times(m, 1.0, 2.0)),
        ("increments at half the rate", GRAVITY, |m| {
            times(m, 0.5, 0.5)
        }),
    ];
    for sheet in SHEETS {
        for (what, fault, mistake) in mistakes {
            for motion in [engine, grade] {
                let drive = Drive {
                    mistake,
                    motion,
                    ..Drive::parked(sheet)
                };
                drive.raises(fault, what);
                Drive {
                    vehicle: VehicleKind::Air,
                    receiver: Some(stands),
                    ..drive
                }
                .raises(fault, what);
            }
        }
    }
}

#[test]
fn rates_57_times_too_small_show_where_the_bias_does_not_hide_the_earth() {
    for sheet in [LASER, NAVIGATION, TACTICAL] {
        for latitude in [0.0, 0.8, 80.0 * DEG] {
            let drive = Drive {
                latitude,
                motion: engine,
                mistake: |means| times(means, 1.0 / 57.3, 1.0),
                ..Drive::parked(sheet)
            };
            drive.raises(fault::EARTH_RATE, "rad for deg");
        }
    }
    // with a bias above the Earth's rate nobody can know
    for sheet in [STIM, MEMS, CHIP] {
        let drive = Drive {
            mistake: |means| times(means, 1.0 / 57.3, 1.0),
            ..Drive::parked(sheet)
        };
        drive.is_silent("rad for deg");
    }
}

#[test]
fn every_wrong_mounting_raises_axes_and_nothing_else() {
    let mistakes: [(&str, Turn); 4] = [
        ("z up", |[x, y, z]| [x, -y, -z]),
        ("x and z exchanged", |[x, y, z]| [z, -y, x]),
        ("y down", |[x, y, z]| [x, -z, y]),
        ("tilted by 37 degrees", |[x, y, z]| {
            [0.8 * x + 0.6 * z, y, 0.8 * z - 0.6 * x]
        }),
    ];
    for sheet in SHEETS {
        for (what, turn) in mistakes {
            for seed in 1..=SEEDS {
                let mut rest = RestCheck::new(sheet.expected(VehicleKind::Land));
                let mut random = Random(seed);
                let mut found = None;
                let [rate, force] = truth(&Motion::default(), 0.8);
                for _ in 0..60 {
                    let noise = sheet.vrw * UG;
                    let force = force.map(|f| (f + noise * random.normal()) as f32);
                    let rate = rate.map(|w| w as f32);
                    let judged = rest.block(1.0, turn(rate), turn(force));
                    found = found.or(judged.map(|j| (j.faults, j.judged)));
                }
                let name = sheet.name;
                assert_eq!(found, Some((fault::AXES, AT_REST)), "{what}, {name}");
            }
        }
    }
}

#[test]
fn the_configured_mounting_is_right() {
    let mut configuration = crate::configuration::tests::example(crate::wire::ImuFormat::Kvh);
    // the sensor's z axis points up and its x axis forward: half a turn about x
    configuration.mounting = [0.0, 1.0, 0.0, 0.0];
    let means = |force| Means {
        seconds: 60.0,
        force,
        ..Means::default()
    };
    let expected = Expected::of(&configuration);
    assert_eq!(means([0.1, 0.2, 9.79]).judge(&expected), 0);
    assert_eq!(means([0.1, 0.2, -9.79]).judge(&expected), fault::AXES);
    assert_eq!(means([9.79, 0.0, 0.0]).judge(&expected), fault::AXES);
    // no accelerometer: nothing to judge
    assert_eq!(means([0.0; 3]).judge(&expected), 0);
    configuration.mounting = crate::configuration::UNKNOWN;
    let expected = Expected::of(&configuration);
    assert_eq!(means([9.79, 0.0, 0.0]).judge(&expected), 0);
    assert_eq!(means([4.9, 0.0, 0.0]).judge(&expected), fault::GRAVITY);
}

#[test]
fn faults_go_when_the_next_rest_is_seen_right() {
    let sheet = TACTICAL;
    let mut rest = RestCheck::new(sheet.expected(VehicleKind::Land));
    let [rate, force] = truth(&Motion::default(), 0.8).map(|v| v.map(|x| x as f32));
    let mut all = Vec::new();
    for second in 0..240 {
        let wrong = if second < 120 { 9.81 } else { 1.0 };
        let judged = rest.block(1.0, rate, force.map(|f| f * wrong));
        all.extend(judged.map(|j| (j.faults, j.judged)));
    }
    let [wrong, right] = [(fault::GRAVITY, AT_REST), (0, AT_REST)];
    assert_eq!(all, [wrong, wrong, right, right]);
}
