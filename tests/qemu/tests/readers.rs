//! Independent writers make recordings, and the readers of `host-sim` find in them what went in.

use std::fmt::Write;
use std::path::Path;

use host_sim::inertial::earth::Geodetic;
use host_sim::inertial::session::Session;
use host_sim::inertial::units::DEG;
use host_sim::recordings::mcap;
use host_sim::simulator::gnss::GnssSpec;
use host_sim::simulator::imu::ImuSpec;
use host_sim::simulator::session::{SessionConfig, simulate};
use nalgebra::{Matrix3, Rotation3, Vector3};
use qemu::judges::{ask_with, python};

/// ns of the first sample.
const START: i64 = 1_700_000_000_123_456_789;

/// A drive of half a minute.
fn drive() -> Session {
    let imu = ImuSpec::preset("tactical").expect("a preset");
    let config = SessionConfig {
        imu: &imu,
        gnss: &GnssSpec::default(),
        start: Geodetic {
            lat: 0.8,
            lon: 0.1,
            h: 300.0,
        },
        heading: 0.4,
        standstill_s: 5.0,
        drive_s: 25.0,
        segments: None,
        vibration: 1.0,
        unit: 1,
        turn_on: 2,
        drive: 3,
    };
    simulate(&config).0
}

/// Rates of the samples, forward-right-down, with their times, ns.
fn rates(session: &Session) -> Vec<(i64, [f64; 3], [f64; 3])> {
    let step = (session.dt * 1e9).round() as i64;
    let increments = session.increments();
    let rate = |(k, i): (usize, &host_sim::inertial::sins::Increment)| {
        let of = |v: Vector3<f64>| (v / session.dt).into();
        (START + k as i64 * step, of(i.dtheta), of(i.dv))
    };
    increments.iter().enumerate().map(rate).collect()
}

fn lines(session: &Session) -> String {
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
    let text = lines(&session);
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
            assert_eq!(record.time[k], (ns - START) as f64 * 1e-9, "{form} {k}");
            assert_eq!(record.samples[k].dtheta, Vector3::from(*gyro), "{form} {k}");
            assert_eq!(record.samples[k].dv, Vector3::from(*accel), "{form} {k}");
        }
        // the last sample is one before the last epoch, and the fourth message has no fix
        assert_eq!(record.fixes.len(), session.epochs() - 1, "{form}");
        for fix in &record.fixes {
            let state = &session.reference[fix.time.round() as usize];
            assert_ne!(fix.time.round(), 3.0);
            let place = (fix.lat_deg, fix.lon_deg, fix.height_m);
            let p = state.position;
            assert_eq!(place, (p.lat / DEG, p.lon / DEG, p.h), "{form}");
            assert_eq!(Vector3::from(fix.velocity), state.velocity, "{form}");
            // variances 1, 4, 9 and 0.01, 0.04, 0.09 of east, north, up
            assert_eq!(fix.sigmas, [2.0, 1.0, 3.0, 0.2, 0.1, 0.3], "{form}");
        }
    }
    let why = read(&write("sqlite")).expect_err("a database").to_string();
    assert!(why.contains("is a ROS 2 bag in SQLite"), "{why}");
}
