//! One simulated drive with the defects of real recordings: without attitude, without standstill,
//! with a gap of a minute, with fixes that are 2.9 s off, with z up, with the antenna 2 m away.
//! Each starts, reports what it did, and agrees with the replay of the intact recording.

use super::{complaint, host_sim};
use crate::writers::{Fix, ORIGIN, Sample, fixes, samples};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::rotation::to_euler;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use nalgebra::Vector3;
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// 20 s at rest and 10 minutes on a road, medium gyros.
fn drive() -> Session {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 100;
    let config = SessionConfig {
        imu: &imu,
        gnss: &GnssSpec::default(),
        start: ORIGIN,
        heading: 1.0,
        standstill_s: 20.0,
        drive_s: 600.0,
        segments: None,
        vibration: 1.0,
        unit: 1,
        turn_on: 1,
        drive: 1,
    };
    simulate(&config).0
}

/// A recording in memory, before it is written to files.
#[derive(Clone)]
struct Recording {
    samples: Vec<Sample>,
    fixes: Vec<Fix>,
    axes: &'static str,
    gnss: &'static str,
    start: String,
}

impl Recording {
    fn of(session: &Session) -> Self {
        let angles = to_euler(&session.reference[0].q_bn);
        let [roll, pitch, heading] = [angles.0, angles.1, angles.2].map(|angle| angle / DEG);
        Self {
            samples: samples(session),
            fixes: fixes(session),
            axes: "axes = 'x y z'",
            gnss: "",
            start: format!(
                "[start]\nroll_deg = {roll}\npitch_deg = {pitch}\nheading_deg = {heading}\n"
            ),
        }
    }

    fn write(&self, dir: &Path) {
        let mut imu = "t,gx,gy,gz,ax,ay,az\n".to_owned();
        for (us, g, a) in &self.samples {
            write!(imu, "{}", *us as f64 / 1e6).unwrap();
            for x in g.iter().chain(a) {
                write!(imu, ",{x:?}").unwrap();
            }
            imu.push('\n');
        }
        let mut gnss = "t,lat,lon,h,vn,ve,vd\n".to_owned();
        for (us, [lat, lon, h], [n, e, d]) in &self.fixes {
            let t = *us as f64 / 1e6;
            writeln!(gnss, "{t},{lat:?},{lon:?},{h:?},{n:?},{e:?},{d:?}").unwrap();
        }
        let Self {
            axes,
            gnss: more,
            start,
            ..
        } = self;
        let header = format!(
            "unit = 'medium'\n\
             [imu]\nfile = 'imu.csv'\ntime = {{ column = 't', unit = 's' }}\n\
             gyro = {{ columns = ['gx', 'gy', 'gz'], unit = 'rad/s' }}\n\
             accel = {{ columns = ['ax', 'ay', 'az'], unit = 'm/s^2' }}\n{axes}\n\
             [gnss]\nfile = 'gnss.csv'\ntime = {{ column = 't', unit = 's' }}\n\
             latitude = {{ column = 'lat', unit = 'deg' }}\n\
             longitude = {{ column = 'lon', unit = 'deg' }}\n\
             height = {{ column = 'h', unit = 'm' }}\n\
             velocity = {{ columns = ['vn', 've', 'vd'], unit = 'm/s', order = 'ned' }}\n\
             {more}\n{start}"
        );
        for (name, text) in [
            ("imu.csv", imu),
            ("gnss.csv", gnss),
            ("header.toml", header),
        ] {
            std::fs::write(dir.join(name), text).unwrap();
        }
    }
}

/// Result of a replay: errors of raw, ekf6 and device after 240 s, m, and the notes.
struct ReplayResult {
    errors: [f64; 3],
    notes: String,
}

fn replay(recording: &Recording, options: &str) -> ReplayResult {
    let dir = tempfile::tempdir().unwrap();
    recording.write(dir.path());
    let args = format!("replay csv --header header.toml --json r.json --out page{options}");
    let out = host_sim(dir.path(), &args).success();
    let stderr = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    let bytes = std::fs::read(dir.path().join("r.json")).unwrap();
    let outcomes: Value = serde_json::from_slice(&bytes).unwrap();
    let rows = outcomes[0]["rows"].as_array().unwrap();
    let errors = ["raw", "ekf6", "device"].map(|scheme| {
        let of = |row: &&Value| row["scheme"] == scheme && row["t_s"] == 240;
        let row = rows.iter().find(of).unwrap();
        row["horizontal_m"].as_f64().unwrap()
    });
    ReplayResult {
        errors,
        notes: format!("{}\n{stderr}", outcomes[0]["notes"]),
    }
}

/// Asserts that the errors are those of the intact recording, within a factor and some metres.
/// Another start changes the errors at random, so only a factor of five shows that they are too
/// small.
fn agrees(name: &str, said: &ReplayResult, whole: &ReplayResult, (factor, metres): (f64, f64)) {
    println!(
        "{name}: {:.2?} m, whole {:.2?} m; {}",
        said.errors, whole.errors, said.notes
    );
    let least = if metres < 1.0 { factor } else { 5.0 };
    let unproved = |said: &ReplayResult| said.errors[2] == said.errors[0];
    for (k, (got, want)) in said.errors.iter().zip(whole.errors).enumerate() {
        if k == 2 && (unproved(said) || unproved(whole)) {
            continue; // the device has proved nothing in one of them, and changes nothing there
        }
        let far = *got > factor * want + metres || want > least * got + metres;
        assert!(
            !far,
            "{name}: {:?} m instead of {:?} m",
            said.errors, whole.errors
        );
    }
}

fn says(name: &str, said: &ReplayResult, parts: &[&str]) {
    for part in parts {
        assert!(
            said.notes.contains(part),
            "{name}: no '{part}' in {}",
            said.notes
        );
    }
}

#[test]
fn without_attitude_and_without_standstill() {
    let session = drive();
    let recording = Recording::of(&session);
    let whole = replay(&recording, "");
    says("whole", &whole, &["The attitude at the start was given"]);
    let without_start = Recording {
        start: String::new(),
        ..recording.clone()
    };
    let said = replay(&without_start, "");
    let found = [
        "Aligned in motion from 0 s on",
        "deg of heading, residual",
        "heading by",
    ];
    says("no attitude", &said, &found);
    agrees("no attitude", &said, &whole, (2.0, 10.0));
    let mut moving = without_start;
    moving.samples.retain(|(us, ..)| *us > 60_000_000);
    moving.fixes.retain(|(us, ..)| *us > 60_000_000);
    let said = replay(&moving, "");
    says("no standstill", &said, &found);
    agrees("no standstill", &said, &whole, (2.0, 10.0));
}

/// After the gap the heading is found again, to some 0.8 deg, and takes minutes of fixes to
/// improve. So the intact recording has the larger errors of the two only by chance.
#[test]
fn with_a_gap_of_a_minute() {
    let session = drive();
    let recording = Recording::of(&session);
    let whole = replay(&recording, " --learn-s 370");
    let mut gap = recording;
    let within = |us: &i64| (60_000_000..120_000_000).contains(us);
    gap.samples.retain(|(us, ..)| !within(us));
    gap.fixes.retain(|(us, ..)| !within(us));
    let said = replay(&gap, " --learn-s 370");
    let parts = [
        "Samples are missing from 58 to 119 s",
        "Its parts: 0-58 s, 119-619 s",
        "The attitude at the start was given",
        "Aligned in motion from 119 s on",
    ];
    says("gap", &said, &parts);
    agrees("gap", &said, &whole, (2.0, 10.0));
}

#[test]
fn with_fixes_that_are_2_9_s_off() {
    let session = drive();
    let recording = Recording::of(&session);
    let whole = replay(&recording, "");
    let mut late = recording;
    for (us, ..) in &mut late.fixes {
        *us += 2_900_000;
    }
    let said = replay(&late, " --time-offset -2.9");
    agrees("2.9 s off, given", &said, &whole, (1.0, 1e-3));
    let said = replay(&late, " --estimate-time-offset");
    let estimated = "The time offset of the fixes is estimated: -2.9";
    says(
        "2.9 s off",
        &said,
        &[
            estimated,
            "s are added to their times, standard deviation 0.0",
        ],
    );
    agrees("2.9 s off", &said, &whole, (1.5, 5.0));
    let said = replay(&late, "");
    says(
        "2.9 s off, not given",
        &said,
        &["samples and fixes match best at -2.9"],
    );
}

#[test]
fn with_z_up() {
    let session = drive();
    let recording = Recording::of(&session);
    let whole = replay(&recording, "");
    let up = |samples: &mut Vec<Sample>| {
        for (_, g, a) in samples {
            for v in [g, a] {
                *v = [v[0], -v[1], -v[2]];
            }
        }
    };
    let mut flu = recording.clone();
    up(&mut flu.samples);
    flu.axes = "axes = 'x -y -z'";
    agrees("z up by axes", &replay(&flu, ""), &whole, (1.0, 1e-3));
    flu.axes = "mounting = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]";
    agrees("z up by a matrix", &replay(&flu, ""), &whole, (1.0, 1e-3));
    // wrong axes: a warning says so
    flu.axes = "axes = 'x y z'";
    let dir = tempfile::tempdir().unwrap();
    flu.write(dir.path());
    let text = complaint(dir.path(), "replay csv --header header.toml");
    for part in [
        "warning: 'imu.axes' makes the specific force point along the axis called down",
        "host-sim: csv: samples and fixes contradict each other",
        "check axes, mounting, units",
    ] {
        assert!(text.contains(part), "no '{part}' in {text}");
    }
}

#[test]
fn with_the_antenna_two_metres_away() {
    let session = drive();
    let recording = Recording::of(&session);
    let whole = replay(&recording, "");
    let arm = Vector3::new(-2.0, 0.0, 0.0);
    let mut away = recording;
    for (us, [lat, lon, h], velocity) in &mut away.fixes {
        let second = (*us / 1_000_000) as usize;
        let truth = &session.reference[second];
        let at = Geodetic {
            lat: *lat * DEG,
            lon: *lon * DEG,
            h: *h,
        };
        let moved = at.displaced(&(truth.q_bn * arm));
        (*lat, *lon, *h) = (moved.lat / DEG, moved.lon / DEG, moved.h);
        // the mean angular rate of 60 ms around the second
        let first = (second * 100)
            .saturating_sub(3)
            .min(session.counts.len() - 6);
        let near = &session.increments()[first..][..6];
        let rate = near.iter().map(|w| w.dtheta).sum::<Vector3<f64>>() / 0.06;
        let turning = truth.q_bn * rate.cross(&arm);
        for (v, more) in velocity.iter_mut().zip(turning.iter()) {
            *v += more;
        }
    }
    away.gnss = "lever_arm_m = [-2, 0, 0]";
    let said = replay(&away, "");
    agrees("lever arm in the header", &said, &whole, (1.5, 5.0));
    away.gnss = "";
    let option = replay(&away, " --lever-arm=-2,0,0");
    assert_eq!(option.errors, said.errors);
}
