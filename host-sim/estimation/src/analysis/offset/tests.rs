use super::*;
use host_core::inertial::sins::Increment;
use host_io::recordings::record::{NOT_MEASURED, TimedFix};
use nalgebra::Vector3;
use test_bench::recordings::{recorded, simulated};

/// A drive whose fixes have times that are `off` seconds too early.
fn drive(off: f64, seed: u64) -> Record {
    let mut record = Record::from_session(&simulated(20.0, 400.0, seed));
    record.move_fixes(-off);
    record
}

fn found(record: &Record) -> Estimate {
    estimate(record).unwrap()
}

#[test]
fn offsets_of_a_road_drive_are_found_within_their_own_uncertainty() {
    let mut squares = 0.0;
    for (seed, off) in [
        (1, 0.0),
        (2, 2.9),
        (3, -2.9),
        (4, 0.137),
        (5, 4.6),
        (6, -0.42),
    ] {
        let got = found(&drive(off, seed));
        let error = got.offset_s - off;
        println!("{off}: {got:?}, error {error:.4}");
        assert!(got.sigma_s < 0.1 && error.abs() < 0.1, "{off}: {got:?}");
        squares += (error / got.sigma_s).powi(2);
    }
    // chi-square with 6 degrees of freedom: between its 0.1 % and 99.9 % points
    assert!((0.38..22.5).contains(&squares), "{squares}");
}

/// Leap seconds, and clocks that were set by hand, are within 40 s.
#[test]
fn offsets_of_tens_of_seconds_are_found() {
    for (seed, off) in [
        (1, 18.0),
        (2, -17.0),
        (3, 19.0),
        (4, 9.0),
        (5, -33.3),
        (6, 38.0),
    ] {
        let got = found(&drive(off, seed));
        let error = got.offset_s - off;
        assert!(got.sigma_s < 0.1 && error.abs() < 0.1, "{off}: {got:?}");
    }
}

/// A receiver in local time, in a recording that is longer than the difference.
#[test]
fn time_zones_within_a_recording_are_found() {
    for (seed, off, drive_s) in [
        (1, 3600.0, 5400.0),
        (2, -1800.0, 2700.0),
        (3, 3600.0 - 18.0, 5400.0),
    ] {
        let mut record = Record::from_session(&simulated(20.0, drive_s, seed));
        record.move_fixes(-off);
        let got = found(&record);
        let error = got.offset_s - off;
        assert!(got.sigma_s < 0.1 && error.abs() < 0.1, "{off}: {got:?}");
    }
}

/// A clock that was set by hand, or started with its own power, is found by no name.
#[test]
fn any_offset_that_leaves_enough_in_common_is_found() {
    for (seed, off) in [(8, 60.0), (2, -211.7)] {
        let got = found(&drive(off, seed));
        let error = got.offset_s - off;
        assert!(got.sigma_s < 0.1 && error.abs() < 0.1, "{off}: {got:?}");
    }
}

#[test]
fn positions_alone_tell_it_too() {
    let mut record = drive(2.9, 7);
    for fix in &mut record.fixes {
        fix.sigmas[3..].fill(NOT_MEASURED);
        fix.velocity = [f64::NAN; 3];
    }
    let got = found(&record);
    assert!(
        (got.offset_s - 2.9).abs() < 5.0 * got.sigma_s && got.sigma_s < 0.3,
        "{got:?}"
    );
}

#[test]
fn what_does_not_move_or_does_not_belong_together_tells_nothing() {
    let mut record = Record::from_session(&simulated(200.0, 10.0, 1));
    assert_eq!(estimate(&record), Err(Unknown::Stationary));
    record.fixes.clear();
    assert_eq!(estimate(&record), Err(Unknown::Stationary));
    record.samples.edit(Vec::clear);
    record.time.edit(Vec::clear);
    assert_eq!(estimate(&record), Err(Unknown::Stationary));
    let mut strange = drive(0.0, 8);
    strange.fixes = drive(0.0, 9).fixes;
    let why = estimate(&strange);
    assert!(matches!(why, Err(Unknown::Even | Unknown::Far)), "{why:?}");
    let far = estimate(&drive(350.0, 8));
    assert!(far.is_err(), "{far:?}");
}

/// The reference of the KITTI drives comes from the same box as the samples: there is no offset.
#[test]
fn recordings_of_one_box_have_no_offset() {
    use host_io::recordings::kitti::{DRIVES, session};
    for (drive, skip) in DRIVES {
        let Some(path) = recorded(&format!("kitti-2011_09_30_drive_{drive}.csv.gz")) else {
            return;
        };
        for off in [0.0, 2.9] {
            let mut record = Record::from_session(&session(&path, skip).unwrap());
            record.move_fixes(-off);
            let got = found(&record);
            println!("{drive}: {got:?}");
            assert!((got.offset_s - off).abs() < 0.05, "{drive}: {got:?}");
        }
    }
}

/// A plane drive that brakes into corners of up to 0.6 g: its motion is computed here alone.
fn brisk(period_s: f64, arm_m: f64) -> Record {
    let (dt, count) = (0.01, 40_000_u32);
    let corner = |t: f64| {
        let into = t.rem_euclid(20.0) - 10.0;
        let sign = if (t / 20.0) as i64 % 3 == 0 {
            -1.0
        } else {
            1.0
        };
        (sign, (-(into / 1.5).powi(2)).exp())
    };
    let rate = |t: f64| corner(t).0 * 0.42 * corner(t).1;
    let speed = |t: f64| 19.0 + 3.0 * (t / 7.0).sin() - 5.0 * corner(t + 1.0).1;
    let mut record = Record {
        rate_hz: 100,
        lever_arm_m: Some([arm_m, 0.0, 0.0]),
        ..Record::default()
    };
    let (mut heading, mut due) = (0.3, 0.0);
    let (mut times, mut samples) = (Vec::new(), Vec::new());
    for k in 0..count {
        let from = f64::from(k) * dt;
        let (t, middle) = (from + dt, from + 0.5 * dt);
        let (w, v) = (rate(middle), speed(middle));
        heading += w * dt;
        times.push(t);
        samples.push(Increment {
            dtheta: Vector3::new(0.0, 0.0, w * dt),
            dv: Vector3::new(speed(t) - speed(from), v * w * dt, -9.8 * dt),
        });
        if t >= due {
            due += period_s;
            let (sin, cos) = f64::sin_cos(heading);
            let (ahead, across) = (speed(t), rate(t) * arm_m);
            let noise = |k: f64| 0.02 * (1e3 * k * t).sin();
            record.fixes.push(TimedFix {
                time: t,
                velocity: [
                    ahead * cos - across * sin + noise(1.0),
                    ahead * sin + across * cos + noise(1.7),
                    0.0,
                ],
                sigmas: [1.0, 1.0, 1.0, 0.05, 0.05, 0.05],
                ..TimedFix::EMPTY
            });
        }
    }
    record.time.edit(|all| *all = times);
    record.samples.edit(|all| *all = samples);
    record
}

/// Corners tilt the specific force, and an antenna ahead of the sensor leads in them. Neither is a
/// wrong time.
#[test]
fn brisk_corners_are_no_offset() {
    for (period_s, arm_m) in [(1.0, 0.0), (0.2, 0.0), (0.7, 0.0), (1.0, 2.0), (0.2, 3.0)] {
        for off in [0.0, 0.3] {
            let mut record = brisk(period_s, arm_m);
            record.move_fixes(-off);
            let got = found(&record);
            let error = got.offset_s - off;
            println!("{period_s} s, {arm_m} m, {off}: {got:?}, error {error:.4}");
            assert!(
                error.abs() < 4.0 * got.sigma_s.hypot(0.02) && error.abs() < 0.1,
                "{period_s} s, {arm_m} m, {off}: {got:?}"
            );
        }
    }
}
