//! Every mistake of the table, made with a drive that is right: the mistake itself is reported,
//! first and alone, with the right remedy.

use super::*;
use host_core::inertial::units::G0;
use nalgebra::Rotation3;

mod sensors;

/// What `replay csv` says of a header with these units and this order.
fn says() -> Says {
    let field = |name: &str, named: usize, units: &[(&str, f64)]| Field {
        name: name.into(),
        named: Some((units[named].0.into(), units[named].1)),
        units: units.iter().map(|(n, x)| ((*n).into(), *x)).collect(),
    };
    let time = [("s", 1.0), ("ms", 1e-3)];
    Says {
        file: "header.toml".into(),
        gyro: field(
            "imu.gyro.unit",
            0,
            &[("rad/s", 1.0), ("deg/s", DEG), ("deg/h", DEG / 3600.0)],
        ),
        accel: field(
            "imu.accel.unit",
            0,
            &[("m/s^2", 1.0), ("g", G0), ("mg", 1e-3 * G0)],
        ),
        axes: ("imu.axes".into(), "'y x -z' for right-forward-up".into()),
        rate: None,
        fixes: FixFields {
            time: Field::fixed("gnss.time_offset_s"),
            time_unit: field("gnss.time.unit", 0, &time),
            position: field("gnss.latitude.unit", 1, &[("rad", 1.0), ("deg", DEG)]),
            height: field("gnss.height.unit", 0, &[("m", 1.0), ("ft", 0.3048)]),
            velocity: field(
                "gnss.velocity.unit",
                0,
                &[
                    ("m/s", 1.0),
                    ("km/h", 1.0 / 3.6),
                    ("knots", 1852.0 / 3600.0),
                ],
            ),
            order: (
                "gnss.velocity.order".into(),
                Some([(0, 1.0), (1, 1.0), (2, 1.0)]),
            ),
        },
    }
}

fn doubts_of(record: &Record) -> Vec<Warning> {
    let assumed = &class("tactical");
    let class = Class {
        assumed,
        given: true,
    };
    doubts(record, &says(), class, &contradicted)
}

fn each_fix(record: &mut Record, change: impl Fn(&mut TimedFix)) {
    record.fixes.iter_mut().for_each(change);
}

fn each_sample(record: &mut Record, change: impl FnMut(Increment) -> Increment) {
    record.samples = record.samples.each().map(change).collect();
}

fn turned_gyros(sample: Increment, signs: [f64; 3]) -> Increment {
    Increment {
        dtheta: sample.dtheta.component_mul(&Vector3::from(signs)),
        ..sample
    }
}

/// A mistake in a recording, the field that is reported, and a part of the remedy.
type KnownMistake = (&'static str, fn(&mut Record), &'static str, &'static str);

const MADE: [KnownMistake; 19] = [
    (
        "18 s",
        |r| r.move_fixes(-18.0),
        "gnss.time_offset_s",
        "18 s ahead of UTC since 2017",
    ),
    (
        "-17 s",
        |r| r.move_fixes(17.0),
        "gnss.time_offset_s",
        "17 s ahead of UTC until 2016",
    ),
    (
        "2.9 s",
        |r| r.move_fixes(-2.9),
        "gnss.time_offset_s",
        "give 2.9",
    ),
    (
        "rad as deg",
        |r| {
            each_fix(r, |f| {
                (f.lat_deg, f.lon_deg) = (f.lat_deg * DEG, f.lon_deg * DEG);
            });
        },
        "gnss.latitude.unit",
        "the unit 'rad' would fit",
    ),
    (
        "west longitudes without their sign",
        |r| each_fix(r, |f| f.lon_deg *= -1.0),
        "gnss.longitude.unit",
        "have lost their sign, west is negative: the unit '-deg' would fit",
    ),
    (
        "south latitudes without their sign",
        |r| each_fix(r, |f| f.lat_deg *= -1.0),
        "gnss.latitude.unit",
        "have lost their sign, south is negative: the unit '-deg' would fit",
    ),
    (
        "latitude and longitude in each other's column",
        |r| each_fix(r, |f| std::mem::swap(&mut f.lat_deg, &mut f.lon_deg)),
        "gnss.latitude",
        "seem to have changed places",
    ),
    (
        "km/h as m/s",
        |r| each_fix(r, |f| f.velocity = f.velocity.map(|v| 3.6 * v)),
        "gnss.velocity.unit",
        "the unit 'km/h' would fit",
    ),
    (
        "knots as m/s",
        |r| each_fix(r, |f| f.velocity = f.velocity.map(|v| v * 3600.0 / 1852.0)),
        "gnss.velocity.unit",
        "the unit 'knots' would fit",
    ),
    (
        "mm/s as m/s",
        |r| each_fix(r, |f| f.velocity = f.velocity.map(|v| v * 1000.0)),
        "gnss.velocity.unit",
        "seem to be in mm/s",
    ),
    (
        "enu as ned",
        |r| {
            each_fix(r, |f| {
                f.velocity = [f.velocity[1], f.velocity[0], -f.velocity[2]];
            });
        },
        "gnss.velocity.order",
        "the order 'enu' would fit",
    ),
    (
        "west for east",
        |r| each_fix(r, |f| f.velocity[1] *= -1.0),
        "gnss.velocity.order",
        "they seem to hold north, west,",
    ),
    (
        "deg/s as rad/s",
        |r| {
            each_sample(r, |s| Increment {
                dtheta: s.dtheta / DEG,
                ..s
            });
        },
        "imu.gyro.unit",
        "the unit 'deg/s' would fit",
    ),
    (
        "rad/s as deg/s",
        |r| {
            each_sample(r, |s| Increment {
                dtheta: s.dtheta * DEG,
                ..s
            });
        },
        "imu.gyro.unit",
        "seem to be in rad",
    ),
    (
        "g as m/s2",
        |r| each_sample(r, |s| Increment { dv: s.dv / G0, ..s }),
        "imu.accel.unit",
        "the unit 'g' would fit",
    ),
    (
        "forward-left-up as forward-right-down",
        |r| {
            each_sample(r, |s| {
                let turn = |v: Vector3<f64>| Vector3::new(v.x, -v.y, -v.z);
                Increment {
                    dtheta: turn(s.dtheta),
                    dv: turn(s.dv),
                }
            });
        },
        "imu.axes",
        "the axis that points down",
    ),
    (
        "gyros with the wrong sign",
        |r| {
            each_sample(r, |s| Increment {
                dtheta: -s.dtheta,
                ..s
            });
        },
        "imu.gyro",
        "check the signs",
    ),
    (
        "one gyro with the wrong sign",
        |r| each_sample(r, |s| turned_gyros(s, [1.0, 1.0, -1.0])),
        "imu.gyro",
        "the gyros of the axes called down",
    ),
    (
        "columns of x and z swapped",
        |r| {
            each_sample(r, |s| {
                let turn = |v: Vector3<f64>| Vector3::new(v.z, v.y, v.x);
                Increment {
                    dtheta: turn(s.dtheta),
                    dv: turn(s.dv),
                }
            });
        },
        "imu.axes",
        "the axis that points down",
    ),
];

#[test]
fn every_mistake_is_reported_by_its_name_and_no_other() {
    let right = Record::from_session(&drive("tactical", 120));
    assert_eq!(doubts_of(&right), []);
    let mut wrong = Vec::new();
    for (name, make, field, part) in MADE {
        let mut record = right.clone();
        make(&mut record);
        let found = doubts_of(&record);
        let reported: Vec<String> = found.iter().map(ToString::to_string).collect();
        println!("{name}: {reported:#?}");
        let first = found.first();
        if found.len() != 1 || first.is_none_or(|w| w.field != field || !w.remedy.contains(part)) {
            wrong.push((name, reported));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Two mistakes are reported one after the other.
#[test]
fn two_mistakes_are_both_reported() {
    let mut record = Record::from_session(&drive("tactical", 120));
    record.move_fixes(-18.0);
    each_sample(&mut record, |s| Increment { dv: s.dv / G0, ..s });
    let found = doubts_of(&record);
    let mut names = fields(&found);
    names.sort_unstable();
    let names: Vec<&str> = names.iter().map(|(field, _)| *field).collect();
    assert_eq!(names, ["gnss.time_offset_s", "imu.accel.unit"], "{found:?}");
}

/// A climb shows heights in feet, and which way is up.
#[test]
fn heights_in_feet_and_up_for_down_show_in_a_climb() {
    let mut right = Record::from_session(&drive("tactical", 120));
    each_fix(&mut right, |f| {
        let s = (f.time - 120.0).max(0.0);
        f.height_m += 0.75 * s;
        f.velocity[2] -= if s > 0.0 { 0.75 } else { 0.0 };
    });
    let reported = |change: fn(&mut TimedFix)| {
        let mut record = right.clone();
        each_fix(&mut record, change);
        doubts_of(&record)
    };
    assert_eq!(reported(|_| ()), []);
    for (change, field, part) in [
        (
            (|f| f.height_m /= 0.3048) as fn(&mut TimedFix),
            "gnss.height.unit",
            "'ft'",
        ),
        (
            |f| f.velocity[2] *= -1.0,
            "gnss.velocity.order",
            "the order 'neu' would fit",
        ),
    ] {
        let found = reported(change);
        let names = fields(&found);
        assert!(
            matches!(names[..], [(f, r)] if f == field && r.contains(part)),
            "{found:?}"
        );
    }
}

/// Hills that the noise of the heights hides one by one show together which way is up.
#[test]
fn up_for_down_shows_in_gentle_hills() {
    let reported = |turned: f64| {
        let mut record = Record::from_session(&drive("tactical", 120));
        each_fix(&mut record, |f| {
            let phase = f.time * std::f64::consts::TAU / 100.0;
            f.height_m += 5.0 * phase.sin();
            f.velocity[2] -= 5.0 * phase.cos() * std::f64::consts::TAU / 100.0;
            f.velocity[2] *= turned;
        });
        doubts_of(&record)
    };
    assert_eq!(reported(1.0), []);
    assert_eq!(reported(0.0), [], "no vertical velocity");
    let found = reported(-1.0);
    let names = fields(&found);
    assert!(
        matches!(names[..], [("gnss.velocity.order", r)] if r.contains("the order 'neu' would fit")),
        "{found:?}"
    );
}

/// A road with hills: positions, heights and velocities climb and fall, and the vehicle pitches
/// with it, by rotating every sample.
fn in_hills(record: &mut Record) {
    let (height, length) = (20.0, 90.0);
    let phase = |t: f64| (t - 120.0).max(0.0) * std::f64::consts::TAU / length;
    let climb = |t: f64| {
        let climb = height * phase(t).sin() * std::f64::consts::TAU / length;
        if t > 120.0 { climb } else { 0.0 }
    };
    each_fix(record, |f| {
        f.height_m += height * (1.0 - phase(f.time).cos());
        f.velocity[2] -= climb(f.time);
    });
    let speeds: Vec<(f64, f64)> = record
        .fixes
        .iter()
        .map(|f| (f.time, f.velocity[0].hypot(f.velocity[1])))
        .collect();
    let pitch = |t: f64| {
        let at = speeds.partition_point(|s| s.0 < t).min(speeds.len() - 1);
        climb(t) / speeds[at].1.max(8.0)
    };
    let hz = record.rate_hz as f64;
    let times: Vec<f64> = record.time.iter().copied().collect();
    let samples = record.samples.each().zip(times).map(|(s, t)| {
        let (before, after) = (pitch(t - 1.0 / hz), pitch(t));
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), -after);
        Increment {
            dtheta: turn * s.dtheta + Vector3::new(0.0, after - before, 0.0),
            dv: turn * s.dv,
        }
    });
    record.samples = samples.collect();
}

/// In hills the signs of all gyros show, and without velocities the unit of the heights.
#[test]
fn hills_show_signs_of_gyros_and_heights_in_feet() {
    let mut right = Record::from_session(&drive("tactical", 120));
    in_hills(&mut right);
    assert_eq!(doubts_of(&right), []);
    for (signs, axes) in [
        ([1.0, -1.0, 1.0], "right"),
        ([1.0, 1.0, -1.0], "down"),
        ([1.0, -1.0, -1.0], "right and down"),
    ] {
        let mut record = right.clone();
        each_sample(&mut record, |s| turned_gyros(s, signs));
        let found = doubts_of(&record);
        let part = format!("the gyros of the axes called {axes} seem");
        let names = fields(&found);
        assert!(
            matches!(names[..], [("imu.gyro", r)] if r.contains(&part)),
            "{signs:?}: {found:?}"
        );
    }
    let positions = |change: fn(&mut TimedFix)| {
        let mut record = right.clone();
        each_fix(&mut record, |f| {
            f.sigmas[3..].fill(f64::INFINITY);
            change(f);
        });
        doubts_of(&record)
    };
    assert_eq!(positions(|_| ()), []);
    for (change, field, part) in [
        (
            (|f| f.height_m /= 0.3048) as fn(&mut TimedFix),
            "gnss.height.unit",
            "'ft'",
        ),
        (|f| f.lon_deg *= -1.0, "gnss.longitude.unit", "west"),
    ] {
        let found = positions(change);
        let names = fields(&found);
        assert!(
            matches!(names[..], [(f, r)] if f == field && r.contains(part)),
            "{found:?}"
        );
    }
}

/// Without velocities the place of the fixes shows rad that are taken as degrees.
#[test]
fn positions_alone_in_rad_show_by_their_place() {
    let mut record = Record::from_session(&drive("tactical", 120));
    each_fix(&mut record, |f| {
        f.sigmas[3..].fill(f64::INFINITY);
        (f.lat_deg, f.lon_deg) = (f.lat_deg * DEG, f.lon_deg * DEG);
    });
    let found = doubts_of(&record);
    let names = fields(&found);
    assert!(
        matches!(names[..], [("gnss.latitude.unit", r)] if r.contains("'rad'")),
        "{found:?}"
    );
    assert!(found[0].problem.contains("Gulf of Guinea"), "{found:?}");
}

/// A sensor that is turned in the hand does not rest, and what flies sideways does not turn.
#[test]
fn a_sensor_in_the_hand_is_not_at_rest() {
    let rate = 100.0;
    let turned = |k: u32| {
        let angle = 0.35 * (f64::from(k) / rate);
        Increment {
            dtheta: Vector3::new(0.35 / rate, 0.0, 0.0),
            dv: Vector3::new(0.0, -angle.sin(), -angle.cos()) * (9.81 / rate),
        }
    };
    for fixes in [1, 120] {
        let fix = |k: u32| TimedFix {
            time: f64::from(k),
            lat_deg: 47.0,
            lon_deg: 8.0,
            height_m: 400.0,
            velocity: [0.0; 3],
            sigmas: [1.0, 1.0, 1.5, 0.05, 0.05, 0.05],
        };
        let record = Record {
            time: (1..=12_000).map(|k| f64::from(k) / rate).collect(),
            samples: (1..=12_000).map(turned).collect(),
            rate_hz: 100,
            fixes: (0..fixes).map(fix).collect(),
            ..Record::default()
        };
        assert_eq!(doubts_of(&record), [], "{fixes} fixes");
    }
}
