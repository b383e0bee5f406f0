//! Doubts about the recorded data, which has none, and about headers that are wrong for it.

use crate::experiment::{fog_mems, kitti, lasergyro};
use host_core::inertial::sins::Increment;
use host_estimation::analysis::doubts::{Class, Field, FixFields, Says, Warning, doubts};
use host_estimation::analysis::time_offset::contradicted;
use host_estimation::learning::teacher::Assumptions;
use host_io::recordings::record::{Record, TimedFix};
use host_unit::Unit;
use nalgebra::Vector3;
use test_bench::recordings::recorded;

fn fields(warnings: &[Warning]) -> Vec<(&str, &str)> {
    let fields = warnings
        .iter()
        .map(|w| (w.field.as_str(), w.remedy.as_str()));
    fields.collect()
}

/// Recorded sessions with the assumptions about their sensors.
fn recordings() -> Vec<(String, Record, Assumptions)> {
    let preset = |name: &str| Assumptions::of(&Unit::preset(name).unwrap());
    let mut all = Vec::new();
    if let Some(file) = recorded("lasergyro-static.csv.gz") {
        let recording = host_io::recordings::load(&file).unwrap();
        let session = lasergyro::session(&recording, 480);
        let record = Record::from_session(&session);
        all.push((
            "laser gyro".into(),
            record,
            lasergyro::assumptions(&Unit::preset(lasergyro::UNIT).unwrap()),
        ));
    }
    if let Some(session) = test_bench::recordings::fog_mems() {
        let record = Record::from_session(&session);
        all.push(("fog-mems".into(), record, preset(fog_mems::UNIT)));
    }
    for (drive, skip) in host_io::recordings::kitti::DRIVES {
        let Some(file) = recorded(&format!("kitti-2011_09_30_drive_{drive}.csv.gz")) else {
            continue;
        };
        let session = host_io::recordings::kitti::session(&file, skip).unwrap();
        let record = Record::from_session(&session);
        all.push((drive.into(), record, preset(kitti::UNIT)));
    }
    all
}

#[test]
fn recorded_data_raises_no_doubt_and_wrong_headers_for_it_do() {
    for (name, record, assumed) in recordings() {
        let warnings = |gyro: f64, accel: f64, turn: fn(Vector3<f64>) -> Vector3<f64>| {
            let mut wrong = record.clone();
            let changed = |sample: Increment| Increment {
                dtheta: turn(sample.dtheta * gyro),
                dv: turn(sample.dv * accel),
            };
            wrong.samples = record.samples.each().map(changed).collect();
            let says = Says {
                file: name.clone().into(),
                gyro: Field::fixed("gyro"),
                accel: Field::fixed("accel"),
                axes: ("axes".into(), String::new()),
                rate: Some(("rate".into(), record.rate_hz as f64)),
                fixes: FixFields::default(),
            };
            let class = Class {
                assumed: &assumed,
                given: true,
            };
            doubts(&wrong, &says, class, &contradicted)
        };
        let same: fn(Vector3<f64>) -> Vector3<f64> = |v| v;
        assert_eq!(warnings(1.0, 1.0, same), [], "{name}");
        let has = |warnings: &[Warning], field: &str, what: &str| {
            let found = fields(warnings);
            assert!(
                found.iter().any(|f| f.0 == field),
                "{name}, {what}: {found:?}"
            );
        };
        has(&warnings(57.3, 1.0, same), "gyro", "deg for rad");
        // on a straight road nothing shows rotations that are too small
        let course = |v: [f64; 3]| v[1].atan2(v[0]);
        let velocities = record.fixes.iter().filter_map(TimedFix::measured_velocity);
        let fast: Vec<f64> = velocities
            .filter(|v| v[0].hypot(v[1]) > 5.0)
            .map(course)
            .collect();
        let turned = fast
            .windows(2)
            .map(|w| (w[1] - w[0]).sin().abs())
            .sum::<f64>();
        if fast.is_empty() || turned > 2.0 {
            has(&warnings(1.0 / 57.3, 1.0, same), "gyro", "rad for deg");
        }
        has(&warnings(1.0, 9.80665, same), "accel", "m/s2 for g");
        has(&warnings(1.0, 1.0 / 9.80665, same), "accel", "g for m/s2");
        has(
            &warnings(1.0, 1.0, |v| Vector3::new(v.x, -v.y, -v.z)),
            "axes",
            "z up",
        );
        has(
            &warnings(1.0, 1.0, |v| Vector3::new(v.z, v.y, -v.x)),
            "axes",
            "x and z",
        );
    }
}
