//! Independent writers make recordings, and the readers of `host-sim` return the values that were
//! written.

use std::fmt::Write;
use std::path::Path;

use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use host_io::recordings::record::{Kind, Record};
use host_io::recordings::{mcap, ubx, ulog};
use nalgebra::{Matrix3, Rotation3, Vector3};
use qemu::judges::{ask_with, python};

/// Time of the first sample, ns.
const START: i64 = 1_700_000_000_123_456_789;

/// A drive of 17 s.
fn drive() -> Session {
    let imu = ImuSpec::preset("tactical").expect("a preset");
    let config = SessionConfig {
        start: Geodetic {
            lat: 0.8,
            lon: 0.1,
            h: 300.0,
        },
        heading: 0.4,
        ..SessionConfig::new(&imu, [5.0, 12.0], [1, 2, 3])
    };
    simulate(&config).0
}

/// Rates of the samples, forward-right-down, with their times, ns.
fn rates(session: &Session) -> Vec<(i64, [f64; 3], [f64; 3])> {
    let step = (session.dt * 1e9).round() as i64;
    let increments = session.increments();
    let rate = |(k, i): (usize, &host_core::inertial::sins::Increment)| {
        let of = |v: Vector3<f64>| (v / session.dt).into();
        (START + k as i64 * step, of(i.dtheta), of(i.dv))
    };
    increments.iter().enumerate().map(rate).collect()
}

/// Input lines for the writer of bags.
fn of_ros(session: &Session) -> String {
    let mut out = String::new();
    for (k, (ns, [gx, gy, gz], [ax, ay, az])) in rates(session).iter().enumerate() {
        // REP 103: forward-left-up
        writeln!(
            out,
            "imu {ns} {gx:?} {:?} {:?} {ax:?} {:?} {:?}",
            -gy, -gz, -ay, -az
        )
        .expect("memory");
        let every = session.samples_per_epoch();
        if k % every == 0 {
            let state = &session.reference[k / every];
            let p = state.position;
            let [north, east, down]: [f64; 3] = state.velocity.into();
            let (lat, lon) = (p.lat / DEG, p.lon / DEG);
            let status = if k == 3 * every { -1 } else { 2 };
            writeln!(
                out,
                "fix {ns} {status} {lat:?} {lon:?} {:?} 1.0 4.0 9.0 2",
                p.h
            )
            .expect("memory");
            writeln!(out, "velocity {} {east:?} {north:?} {:?}", ns + 1000, -down).expect("memory");
        }
    }
    out
}

#[test]
fn bags_of_two_writers_hold_what_went_in() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("a folder");
    let session = drive();
    let text = of_ros(&session);
    let write = |form: &str| {
        let path = dir.path().join(form);
        let name = path.to_str().expect("a name");
        ask_with(&python, "ros2.py", &[name, form], text.as_bytes()).expect("it writes");
        path
    };
    let choice = mcap::Choice {
        velocity: Some("/gnss/velocity".into()),
        mounting: Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(
            1.0, -1.0, -1.0,
        ))),
        ..mcap::Choice::default()
    };
    let read = |path: &Path| mcap::read(path, &choice, &|_, _| ());
    for form in ["none", "lz4", "zstd", "storage", "file", "message"] {
        let reading = read(&write(form)).expect("it reads");
        assert!(reading.notes.is_empty(), "{form}: {:?}", reading.notes);
        let record = reading.record;
        let rates = rates(&session);
        assert_eq!(
            (record.time.len(), record.rate_hz),
            (rates.len(), session.samples_per_epoch()),
            "{form}"
        );
        for (k, (ns, gyro, accel)) in rates.iter().enumerate() {
            assert_eq!(record.time[k], (ns - START) as f64 / 1e9, "{form} {k}");
            assert_eq!(record.samples[k].dtheta, Vector3::from(*gyro), "{form} {k}");
            assert_eq!(record.samples[k].dv, Vector3::from(*accel), "{form} {k}");
        }
        // the last sample is one before the last epoch, and the fourth message has no fix
        assert_eq!(record.fixes.len(), session.epochs() - 1, "{form}");
        for fix in &record.fixes {
            let state = &session.reference[fix.time.round() as usize];
            assert_ne!(fix.time.round(), 3.0);
            let position = (fix.lat_deg, fix.lon_deg, fix.height_m);
            let p = state.position;
            assert_eq!(position, (p.lat / DEG, p.lon / DEG, p.h), "{form}");
            assert_eq!(Vector3::from(fix.velocity), state.velocity, "{form}");
            // variances 1, 4, 9 and 0.01, 0.04, 0.09 of east, north, up
            assert_eq!(fix.sigmas, [2.0, 1.0, 3.0, 0.2, 0.1, 0.3], "{form}");
        }
    }
    let why = read(&write("sqlite")).expect_err("a database").to_string();
    assert!(why.contains("is a ROS 2 bag in SQLite"), "{why}");
}

/// Rounded to the type `float` of PX4.
fn float(x: f64) -> f64 {
    f64::from(x as f32)
}

#[test]
fn a_log_that_pyulog_writes_holds_what_went_in() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("in.ulg");
    let session = drive();
    let step_us = (session.dt * 1e6).round() as u64;
    let increments = session.increments();
    let every = session.samples_per_epoch();
    let end = |k: usize| 3_000_000 + step_us * k as u64;
    let mut text = String::new();
    for (k, i) in increments.iter().enumerate() {
        let [gx, gy, gz]: [f64; 3] = i.dtheta.into();
        let [ax, ay, az]: [f64; 3] = i.dv.into();
        let us = end(k);
        writeln!(
            text,
            "imu {us} {gx:?} {gy:?} {gz:?} {ax:?} {ay:?} {az:?} {step_us}"
        )
        .expect("memory");
        if k % every == 0 {
            let state = &session.reference[k / every];
            let p = state.position;
            let [north, east, down]: [f64; 3] = state.velocity.into();
            let (lat, lon) = (p.lat / DEG, p.lon / DEG);
            // it arrives 110 ms after its time
            let us = us + 110_000;
            let position = format!("{lat:?} {lon:?} {:?}", p.h);
            writeln!(
                text,
                "gps {us} {position} 0.3 1.5 2.5 {north:?} {east:?} {down:?} 3"
            )
            .expect("memory");
            let q = state.q_bn;
            writeln!(
                text,
                "attitude {} {:?} {:?} {:?} {:?}",
                end(k),
                q.w,
                q.i,
                q.j,
                q.k
            )
            .expect("memory");
        }
    }
    let name = path.to_str().expect("a name");
    let found = ask_with(&python, "ulog.py", &[name], text.as_bytes()).expect("it writes");
    let [samples, fixes] = [increments.len(), session.epochs()];
    assert!(
        found.contains(&format!("vehicle_imu {samples}")),
        "{found:?}"
    );
    assert!(
        found.contains(&format!("vehicle_gps_position {fixes}")),
        "{found:?}"
    );
    let choice = ulog::Choice {
        attitude: true,
        ..ulog::Choice::default()
    };
    let record = ulog::read(&path, &choice, &|_, _| ())
        .expect("it reads")
        .record;
    assert_eq!((record.kind, record.rate_hz), (Kind::Increment, every));
    assert_eq!((record.time.len(), record.fixes.len()), (samples, fixes));
    for (k, i) in increments.iter().enumerate() {
        assert_eq!(record.samples[k].dtheta, i.dtheta.map(float), "{k}");
        assert_eq!(record.samples[k].dv, i.dv.map(float), "{k}");
    }
    for (k, fix) in record.fixes.iter().enumerate() {
        let state = &session.reference[k];
        let p = state.position;
        assert_eq!(fix.time, k as f64);
        let position = (fix.lat_deg, fix.lon_deg, fix.height_m);
        assert_eq!(position, (p.lat / DEG, p.lon / DEG, p.h));
        assert_eq!(Vector3::from(fix.velocity), state.velocity.map(float));
        let [h, v, s] = [
            float(1.5) / 2.0_f64.sqrt(),
            2.5,
            float(0.3) / 3.0_f64.sqrt(),
        ];
        assert_eq!(fix.sigmas, [h, h, v, s, s, s]);
    }
    let session = record.session().expect("a session");
    let angle = session.reference[0]
        .q_bn
        .angle_to(&drive().reference[0].q_bn);
    assert!(angle < 1e-6, "{angle}");
}

/// Input lines for the writer of UBX: counts, and fixes that arrive 40 ms after their time. `ticks`
/// is the rate of the receiver's clock.
fn of_ubx(session: &Session, kind: &str, ticks: u64) -> String {
    let mut text = String::new();
    let rates = rates(session);
    for (k, (ns, gyro, accel)) in rates.iter().enumerate() {
        let us = (ns - START) as u64 / 1000;
        // forward-left-up
        let flip = |v: &[f64; 3], count: f64| {
            let [x, y, z] = [v[0], -v[1], -v[2]].map(|x| (x / count).round() as i32);
            format!("{x} {y} {z}")
        };
        let (gyro, accel) = (flip(gyro, DEG / 4096.0), flip(accel, 1.0 / 1024.0));
        writeln!(
            text,
            "{kind} {} {gyro} {accel}",
            70_000 + us * ticks / 1_000_000
        )
        .expect("memory");
        let every = session.samples_per_epoch();
        let late = every * 4 / 100;
        if k % every == late {
            let state = &session.reference[k / every];
            let p = state.position;
            let [north, east, down]: [f64; 3] = state.velocity.into();
            let whole = |x: f64, unit: f64| (x / unit).round() as i64;
            let position = format!(
                "{} {} {}",
                whole(p.lat / DEG, 1e-7),
                whole(p.lon / DEG, 1e-7),
                whole(p.h, 1e-3)
            );
            let [north, east, down] = [north, east, down].map(|v| whole(v, 1e-3));
            let ms = 500_000_000 + us / 1_000_000 * 1000;
            writeln!(
                text,
                "pvt {ms} {position} 1414 2000 {north} {east} {down} 173"
            )
            .expect("memory");
        }
    }
    text
}

fn check_ubx(session: &Session, record: &Record, name: &str) {
    let rates = rates(session);
    assert_eq!(
        (record.time.len(), record.fixes.len()),
        (rates.len(), session.epochs()),
        "{name}"
    );
    for (k, (_, gyro, accel)) in rates.iter().enumerate() {
        let s = &record.samples[k];
        let off = [
            s.dtheta - Vector3::from(*gyro),
            s.dv - Vector3::from(*accel),
        ];
        assert!(off[0].abs().max() < 0.51 * DEG / 4096.0, "{name} {k}");
        assert!(off[1].abs().max() < 0.51 / 1024.0, "{name} {k}");
        assert!(
            (record.time[k] - k as f64 * session.dt).abs() < 1e-3,
            "{name} {k}"
        );
    }
    for (k, fix) in record.fixes.iter().enumerate() {
        let state = &session.reference[k];
        assert!(
            (fix.time - k as f64).abs() < 1e-3,
            "{name} {k}: {}",
            fix.time
        );
        let p = state.position;
        let off = [fix.lat_deg - p.lat / DEG, fix.lon_deg - p.lon / DEG];
        assert!(off.iter().all(|x| x.abs() < 0.51e-7), "{name} {k}");
        assert!((fix.height_m - p.h).abs() < 0.51e-3, "{name} {k}");
        let off = Vector3::from(fix.velocity) - state.velocity;
        assert!(off.abs().max() < 0.51e-3, "{name} {k}");
    }
}

#[test]
fn logs_that_pyubx2_writes_hold_what_went_in() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("a folder");
    let session = drive();
    let choice = ubx::Choice {
        fix_delay_s: 0.04,
        mounting: Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&Vector3::new(
            1.0, -1.0, -1.0,
        ))),
        ..ubx::Choice::default()
    };
    for (kind, ticks) in [("raw", 25_600), ("meas", 1000)] {
        let path = dir.path().join(kind);
        let name = path.to_str().expect("a name");
        let text = of_ubx(&session, kind, ticks);
        ask_with(&python, "ubx_log.py", &[name], text.as_bytes()).expect("it writes");
        let record = ubx::read(&path, &choice, &|_, _| ())
            .expect("it reads")
            .record;
        check_ubx(&session, &record, kind);
    }
}
