use super::*;
use crate::experiment::correction::SCHEMES;
use crate::experiment::starting::{Started, Wishes, start};
use firmware::model::Nets;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG, G0};
use host_estimation::learning::in_motion::VehicleKnowledge;
use host_estimation::learning::window::{normalisation, start as weights_of};
use host_io::recordings::generic;
use host_io::recordings::record::{Kind, Record};
use host_unit::Unit;
use host_unit::around;
use lrnn_nostd::Net;
use nalgebra::UnitQuaternion;
use std::fmt::Write;
use std::path::Path;
use test_bench::recordings::simulated;

#[test]
fn splits_share_the_recording_out_without_overlap() {
    let f = Split::forward(99, 30);
    assert_eq!((f.learn.clone(), f.judge.clone()), (0..30, 30..99));
    let e = Split::exchanged(99, 30);
    assert_eq!((e.learn.clone(), e.judge.clone()), (69..99, 0..69));
    assert_eq!(e.case(), "learn 69-99 s, judge 0-69 s");
    assert_eq!(Split::forward(20, 30).judge, 20..20);
}

/// Mounting of the IMU of the files in the vehicle: roll, pitch, heading, deg.
const MOUNTING: [f64; 3] = [178.0, -3.0, 40.0];

/// Writes a drive as rates in deg/s and g, or increments in rad and m/s, in axes of a
/// sensor with an oblique mounting, with an additional column between them and blanks around some
/// numbers.
fn write(dir: &Path, kind: Kind, seed: u64) {
    let mut session = simulated(20.0, 280.0, seed);
    session.standstill = 0;
    let record = Record::from_session(&session);
    generic::write(&record, None, dir).unwrap();
    let [roll, pitch, heading] = MOUNTING.map(|angle| angle * DEG);
    let turn = UnitQuaternion::from_euler_angles(roll, pitch, heading);
    let (units, names) = match kind {
        Kind::Increment => ([1.0, 1.0], ["rad", "m/s"]),
        Kind::Rate => ([DEG * session.dt, G0 * session.dt], ["deg/s", "g"]),
    };
    let mut imu =
        "t_s,dtheta_x_rad,dtheta_y_rad,dtheta_z_rad,note,dv_x_mps,dv_y_mps,dv_z_mps\r\n".to_owned();
    for (t, sample) in record.time.iter().zip(&record.samples) {
        let g = turn.inverse() * sample.dtheta / units[0];
        let a = turn.inverse() * sample.dv / units[1];
        let [[gx, gy, gz], [ax, ay, az]] = [g.into(), a.into()];
        write!(imu, "{t:.3},{gx}, {gy},{gz} ,007,{ax:e},{ay},{az}\r\n").unwrap();
    }
    std::fs::write(dir.join("imu.csv"), imu).unwrap();
    let header = std::fs::read_to_string(dir.join("header.toml")).unwrap();
    let [roll, pitch, heading] = MOUNTING;
    let mounting =
        format!("mounting = {{ roll_deg = {roll}, pitch_deg = {pitch}, heading_deg = {heading} }}");
    let header = header
        .replace("axes = \"x y z\"", &mounting)
        .replace("\"rad\" }", &format!("\"{}\" }}", names[0]))
        .replace(
            "unit = \"m/s\" }\n",
            &format!("unit = \"{}\" }}\n", names[1]),
        );
    std::fs::write(dir.join("header.toml"), header).unwrap();
}

fn started(record: &Record) -> Started {
    let wishes = Wishes {
        known: VehicleKnowledge {
            vehicle: around::Kind::Land,
            forward: true,
            heading: None,
        },
        attitude_sigma: [0.05 * DEG, 0.1 * DEG],
        part: None,
    };
    let assumptions = Assumptions::of(&Unit::default());
    start(
        record.prepare().unwrap(),
        &wishes,
        &assumptions,
        Path::new("in"),
    )
    .unwrap()
}

/// Networks that a device has stored before the recording: half a bias of the datasheet on all
/// axes.
fn stored() -> Nets {
    let of = normalisation(&Assumptions::of(&Unit::default()));
    let [gyro, accel] = of.map(|normalisation| {
        let mut net = Net::new(weights_of(0, 1.0).weights, normalisation);
        net.weights.layers[2].b = [0.5; 3];
        net
    });
    Nets {
        gyro,
        accel,
        ..Nets::NONE
    }
}

/// Navigation with the corrected file gives the scheme's row of the table from the same start, to
/// 0.1 mm with increments. A correction of rates that begins at an epoch begins half a sample
/// earlier by the trapezoidal rule: 5 ms of 1 mg are 5 mm after 100 s. Only the sensors' numbers
/// have changed in the file.
#[test]
fn the_corrected_file_navigates_as_the_scheme_did() {
    let mut device = Device::of_unit(&Unit::default()).unwrap();
    device.store_nets(&stored());
    for (seed, kind, limit) in [(1, Kind::Increment, 1e-4), (2, Kind::Rate, 1e-2)] {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path(), kind, seed);
        let [header, file] = ["header.toml", "corrected.csv"].map(|name| dir.path().join(name));
        let record = generic::read(&header, &[]).unwrap();
        assert_eq!(record.kind, kind);
        let Started { session, begin, .. } = started(&record);
        let split = Split::forward(session.epochs(), 150);
        let settings = Settings {
            assumptions: Assumptions::of(&Unit::default()),
            device: device.clone(),
            start_sigma: None,
            begins: Begins::Own,
            network: NetworkSpec::short(),
            promoted_only: false,
            times_s: vec![100],
        };
        let learnt = Learnt::from(&session, &split, &settings).unwrap().unwrap();
        let solved = solutions(&session, &split, &settings, &learnt, None).unwrap();
        let original = std::fs::read_to_string(dir.path().join("imu.csv")).unwrap();
        for scheme in SCHEMES {
            let correction = learnt.correction(scheme, &session);
            let taken = correction.taken(&record, begin);
            let bytes = generic::original(&header, &[])
                .unwrap()
                .without(&taken)
                .unwrap();
            let text = String::from_utf8(bytes).unwrap();
            std::fs::write(&file, &text).unwrap();
            if scheme == "raw" {
                assert!(text == original, "a correction of zero changes nothing");
            }
            let shape = |text: &str| -> Vec<String> {
                let columns = |line: &str| {
                    let all: Vec<&str> = line.split(',').collect();
                    format!("{} {} {}", all.len(), all[0], all[4])
                };
                text.split("\r\n")
                    .filter(|l| !l.is_empty())
                    .map(columns)
                    .collect()
            };
            assert!(shape(&text) == shape(&original), "{scheme}");
            let again = generic::read(&header, std::slice::from_ref(&file)).unwrap();
            assert!(again.time == record.time);
            // the numbers read back are the corrected ones
            for ((new, old), taken) in again.samples.iter().zip(&record.samples).zip(&taken) {
                let off = (old.dtheta - taken.dtheta - new.dtheta).norm()
                    + (old.dv - taken.dv - new.dv).norm();
                assert!(
                    off < 1e-14 * (1.0 + old.dv.norm() + old.dtheta.norm()),
                    "{off}"
                );
            }
            let session = started(&again).session;
            let increments: Vec<Increment> = session.increments();
            let (from, to) = (split.learn.end, split.judge.end);
            let filter = learnt.filters.iter().find(|(name, _)| *name == scheme);
            let nav = match filter {
                Some((_, filter)) => filter.sins.nav,
                None => {
                    let plain = ErrorModel::default();
                    let filter = aided(&session, &increments, plain, &settings, from);
                    filter.unwrap().sins.nav
                }
            };
            let free = free_inertial(&session, &increments, nav, from, to);
            let (_, meant) = solved.iter().find(|(name, _)| *name == scheme).unwrap();
            assert_eq!(free.position.len(), meant.position.len());
            let off = free.position.iter().zip(&meant.position);
            let off = off.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            println!(
                "{kind:?} {scheme}: {off:e} m off {:.3?} m",
                meant.position.last()
            );
            assert!(off < limit, "{kind:?} {scheme}: {off} m");
            let moved = free.position.last().unwrap() - solved[0].1.position.last().unwrap();
            assert!(
                scheme == "raw" || moved.norm() > 0.01,
                "{scheme} corrects something"
            );
        }
    }
}

/// All rows begin at one state. It is near the truth, and does not depend on the unit file,
/// although a device that has stored corrections is among the rows.
#[test]
fn all_rows_begin_at_one_state_whatever_the_unit_file_says() {
    let mut session = simulated(20.0, 480.0, 5);
    session.standstill = 0;
    let split = Split::forward(session.epochs(), 300);
    let mut device = Device::of_unit(&Unit::default()).unwrap();
    device.store_nets(&stored());
    let begins = ["medium", "stim300", "icm-42688"].map(|name| {
        let settings = Settings {
            assumptions: Assumptions::of(&Unit::preset(name).unwrap()),
            device: device.clone(),
            start_sigma: None,
            begins: Begins::Smoothed,
            network: NetworkSpec::short(),
            promoted_only: false,
            times_s: vec![100],
        };
        let learnt = Learnt::from(&session, &split, &settings).unwrap().unwrap();
        assert!(learnt.device.changed);
        let (nav, ..) = begins::begin(&session, &split, &settings, &learnt).unwrap();
        let solved = solutions(&session, &split, &settings, &learnt, nav).unwrap();
        assert_eq!(solved.len(), 8);
        for (scheme, free) in &solved {
            let first = (free.position[0], free.velocity[0]);
            assert_eq!(
                first,
                (solved[0].1.position[0], solved[0].1.velocity[0]),
                "{scheme}"
            );
        }
        (nav.unwrap(), solved[0].1.position[150].xy().norm())
    });
    let truth = &session.reference[split.judge.start];
    for (nav, raw) in &begins {
        let tilted = nav.q_bn.inverse() * nalgebra::Vector3::z();
        let tilt = tilted.angle(&(truth.q_bn.inverse() * nalgebra::Vector3::z())) / DEG;
        let turned = nav.q_bn.angle_to(&truth.q_bn) / DEG;
        let moved = nav.position.ned_from(&truth.position).norm();
        assert!(
            tilt < 0.1 && turned < 0.3 && moved < 1.0,
            "{tilt} {turned} deg, {moved} m"
        );
        assert!((raw / begins[0].1 - 1.0).abs() < 0.03, "{begins:?}");
    }
}
