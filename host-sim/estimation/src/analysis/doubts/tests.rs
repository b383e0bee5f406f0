//! Simulated drives written as files whose header is then edited, and recorded data.

mod mistakes;

use super::*;
use crate::analysis::time_offset::contradicted;
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::session::{SessionConfig, simulate};
use host_io::recordings::InitialAttitude;
use host_io::recordings::generic;
use host_io::recordings::record::TimedFix;
use nalgebra::Vector3;
use std::fmt::Write;

/// A drive with a standstill and turns, by an IMU of this preset.
fn drive(preset: &str, standstill_s: u32) -> Session {
    let imu = Unit::preset(preset).unwrap().simulated();
    let config = SessionConfig {
        start: Geodetic {
            lat: 47.0 * DEG,
            lon: 8.0 * DEG,
            h: 400.0,
        },
        heading: 0.7,
        ..SessionConfig::new(&imu, [standstill_s.into(), 300.0], [5, 6, 7])
    };
    simulate(&config).0
}

fn class(preset: &str) -> Assumptions {
    Assumptions::of(&Unit::preset(preset).unwrap())
}

/// A recording in files: rates in deg/s and g, right-forward-up, or increments.
struct Files {
    dir: tempfile::TempDir,
    header: String,
}

impl Files {
    fn of(record: &Record, rates: bool) -> Files {
        let dir = tempfile::tempdir().unwrap();
        generic::write(record, None, dir.path()).unwrap();
        let path = dir.path().join("header.toml");
        let mut header = std::fs::read_to_string(&path).unwrap();
        if rates {
            let hz = record.rate_hz as f64;
            let [deg, g] = [hz / DEG, hz / 9.80665];
            let mut text = "t_s,dtheta_x,dtheta_y,dtheta_z,dv_x,dv_y,dv_z\n".to_owned();
            text = text.replace("dtheta", "w").replace("dv", "f");
            for (t, s) in record.time.iter().zip(&record.samples) {
                let (w, f) = (s.dtheta * deg, s.dv * g);
                let t = t - 0.5 / hz; // the middle of its interval
                writeln!(
                    text,
                    "{t},{},{},{},{},{},{}",
                    w.y, w.x, -w.z, f.y, f.x, -f.z
                )
                .unwrap();
            }
            std::fs::write(dir.path().join("imu.csv"), text).unwrap();
            let (_, rest) = header.split_once("axes = \"x y z\"\n").unwrap();
            header = format!(
                "[imu]\nfile = \"imu.csv\"\ntime = {{ column = \"t_s\", unit = \"s\" }}\n\
                 gyro = {{ columns = [\"w_x\", \"w_y\", \"w_z\"], unit = \"deg/s\" }}\n\
                 accel = {{ columns = [\"f_x\", \"f_y\", \"f_z\"], unit = \"g\" }}\n\
                 axes = \"y x -z\"\n{rest}"
            );
        }
        Files { dir, header }
    }

    /// The doubts after the header was edited.
    fn edited(
        &self,
        from: &str,
        to: &str,
        (preset, given): (&str, bool),
    ) -> Result<Vec<Warning>, Error> {
        assert!(self.header.contains(from), "{from} is not in the header");
        let path = self.dir.path().join("header.toml");
        std::fs::write(&path, self.header.replace(from, to)).unwrap();
        let record = generic::read(&path, &[])?;
        let [gyro, accel] = generic::units(&path, 1.0 / record.rate_hz as f64)?;
        let field = |name: &str, (named, units)| Field {
            name: name.into(),
            named: Some(named),
            units,
        };
        let says = Says {
            file: path,
            gyro: field("imu.gyro.unit", gyro),
            accel: field("imu.accel.unit", accel),
            axes: ("imu.axes".into(), "'y x -z' for right-forward-up".into()),
            rate: None,
            fixes: FixFields::default(),
        };
        let assumed = &class(preset);
        Ok(doubts(
            &record,
            &says,
            Class { assumed, given },
            &contradicted,
        ))
    }
}

/// Fields with a doubt, and the remedies.
fn fields(warnings: &[Warning]) -> Vec<(&str, &str)> {
    let fields = warnings
        .iter()
        .map(|w| (w.field.as_str(), w.remedy.as_str()));
    fields.collect()
}

/// The recording without its standstill, as if it began on the road.
fn on_the_road(session: &Session) -> Record {
    let mut record = Record::from_session(session);
    let from = record.time.partition_point(|t| *t <= 155.0);
    record.time = record.time.part(from..usize::MAX);
    record.samples = record.samples.part(from..usize::MAX);
    record.fixes.retain(|fix| fix.time > 156.0);
    record.initial_attitude = Some(InitialAttitude::Known(session.reference[156].q_bn));
    record
}

#[test]
fn a_right_header_raises_no_doubt_and_every_edit_is_reported() {
    for preset in ["medium", "nav", "tactical"] {
        let session = drive(preset, 120);
        let whole = Record::from_session(&session);
        let road = on_the_road(&drive(preset, 150));
        for (what, record) in [("whole", whole), ("road", road)] {
            let files = Files::of(&record, true);
            let name = format!("{preset}, {what}");
            let edit = |from: &str, to: &str| {
                let warnings = files.edited(from, to, (preset, true));
                warnings.unwrap_or_else(|error| panic!("{name}, {to}: {error}"))
            };
            assert_eq!(edit("deg/s", "deg/s"), [], "{name}");
            for (from, to, field, fits) in [
                ("deg/s", "rad/s", "imu.gyro.unit", "'deg/s'"),
                ("\"g\"", "\"m/s^2\"", "imu.accel.unit", "'g'"),
                ("\"g\"", "\"mg\"", "imu.accel.unit", "'g'"),
                ("y x -z", "x y z", "imu.axes", "third"),
                ("y x -z", "z y -x", "imu.axes", "third"),
            ] {
                // 57 times the rate of a turn is more than any gyro measures
                let Ok(warnings) = files.edited(from, to, (preset, true)) else {
                    assert_eq!((from, what), ("deg/s", what), "{name}, {to}");
                    continue;
                };
                let found = fields(&warnings);
                let hit = found.iter().any(|(f, r)| *f == field && r.contains(fits));
                assert!(hit, "{name}, {to}: {found:?}");
            }
            // rad/s called deg/s: the values are 57 times too small
            let small = Files {
                header: files.header.replace("deg/s", "deg/h"),
                dir: files.dir,
            };
            let warnings = small.edited("deg/h", "deg/h", (preset, true)).unwrap();
            let found = fields(&warnings);
            assert!(
                found[0].0 == "imu.gyro.unit" && found[0].1.contains("'deg/s'"),
                "{found:?}"
            );
        }
    }
}

/// A standstill that is said to last too long is reported, with its right end where that is long
/// enough; one that ends too early is none of our business.
#[test]
fn a_standstill_that_moves_is_reported() {
    for preset in ["medium", "tactical"] {
        let record = Record::from_session(&drive(preset, 120));
        let files = Files::of(&record, true);
        let stated = |seconds: &str| {
            let (from, to) = ("standstill_s = 120", format!("standstill_s = {seconds}"));
            files.edited(from, &to, (preset, true)).unwrap()
        };
        for right in ["100", "120"] {
            assert_eq!(stated(right), [], "{preset}, {right}");
        }
        for wrong in ["140", "300"] {
            let found = stated(wrong);
            let [warning] = &found[..] else {
                panic!("{preset}, {wrong}: {found:?}");
            };
            assert_eq!(warning.field, "start.standstill_s");
            let problem = format!("says {wrong} s, and the fixes move from 12");
            assert!(warning.problem.starts_with(&problem), "{warning}");
            let given = warning.remedy.split([' ', ',']).nth(1).unwrap();
            let given: u32 = given.parse().expect(&warning.remedy);
            assert!((115..=120).contains(&given), "{warning}");
        }
        let road = on_the_road(&drive(preset, 150));
        let mut moving = Files::of(&road, true);
        let (start, _) = moving.header.split_once("[start]").unwrap();
        moving.header = format!("{start}[start]\nstandstill_s = 100\n");
        let found = moving.edited("[start]", "[start]", (preset, true)).unwrap();
        let left_out = |warning: &Warning| warning.remedy.starts_with("leave it out");
        let hit = |w: &Warning| w.field == "start.standstill_s" && left_out(w);
        assert!(found.iter().any(hit), "{preset}: {found:?}");
    }
}

/// A heading that the drive contradicts is reported with the right one, whether the whole attitude
/// is stated or the heading alone.
#[test]
fn a_heading_that_the_courses_contradict_is_reported() {
    let mut record = on_the_road(&drive("tactical", 150));
    let Some(InitialAttitude::Known(attitude)) = record.initial_attitude else {
        unreachable!();
    };
    let right = attitude.euler_angles().2 / DEG;
    record.initial_attitude = None;
    record.rough_heading = Some([right * DEG, 10.0 * DEG]);
    let rough = Files::of(&record, true);
    record.initial_attitude = Some(InitialAttitude::Known(attitude));
    let whole = Files::of(&record, true);
    for (files, reported) in [(whole, 25.0), (rough, 45.0)] {
        let line = files.header.lines().find(|l| l.starts_with("heading_deg"));
        let line = line.unwrap();
        let off = |degrees: f64| {
            let to = format!("heading_deg = {}", right + degrees);
            files.edited(line, &to, ("tactical", true)).unwrap()
        };
        for small in [0.0, 10.0, -10.0] {
            assert_eq!(off(small), [], "{small}");
        }
        for wrong in [reported, -reported, 90.0, 180.0] {
            let found = off(wrong);
            let [warning] = &found[..] else {
                panic!("{wrong}: {found:?}");
            };
            assert_eq!(warning.field, "start.heading_deg");
            let given = warning.remedy.split([' ', ',']).nth(1).unwrap();
            let given: f64 = given.parse().expect(&warning.remedy);
            let missed = (given - right + 540.0).rem_euclid(360.0) - 180.0;
            assert!(missed.abs() < 3.0, "{right}: {warning}");
        }
    }
}

#[test]
fn radians_called_degrees_are_reported_at_rest_and_in_turns() {
    for preset in ["medium", "tactical"] {
        for record in [
            Record::from_session(&drive(preset, 120)),
            on_the_road(&drive(preset, 150)),
        ] {
            let files = Files::of(&record, false);
            let right = files.edited("rad", "rad", (preset, true)).unwrap();
            assert_eq!(right, []);
            let wrong = files.edited("\"rad\"", "\"deg\"", (preset, true)).unwrap();
            let found = fields(&wrong);
            assert!(
                found[0].0 == "imu.gyro.unit" && found[0].1.contains("'rad'"),
                "{found:?}"
            );
        }
    }
}

#[test]
fn a_forgotten_datasheet_is_reported_with_the_presets_that_fit() {
    let record = Record::from_session(&drive("tactical", 300));
    let files = Files::of(&record, true);
    let forgotten = files.edited("deg/s", "deg/s", ("nav", false)).unwrap();
    let found = fields(&forgotten);
    let tactical = |remedy: &str| remedy.contains("tactical") && !remedy.contains("nav");
    assert!(
        matches!(found[..], [("--unit", remedy)] if tactical(remedy)),
        "{found:?}"
    );
    let text = forgotten[0].to_string();
    assert!(text.contains("header.toml: warning: '--unit'") && text.contains("; remedy: "));
    // industrial MEMS: 100 deg/h and 1.5 deg/sqrt(h)
    let mut mems = Record::from_session(&drive("tactical", 120));
    let (bias, noise) = (100.0 / 3600.0 * DEG, 1.5 * DEG / 60.0);
    let dt = 1.0 / mems.rate_hz as f64;
    let mut random = 1u64;
    let mut noisy = |mut sample: Increment| {
        let mut uniform = || {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let noise = Vector3::new(uniform(), uniform(), uniform()) * (noise * (12.0 * dt).sqrt());
        sample.dtheta += Vector3::repeat(bias * dt) + noise;
        sample
    };
    mems.samples = mems.samples.each().map(&mut noisy).collect();
    let files = Files::of(&mems, true);
    let forgotten_mems = files.edited("deg/s", "deg/s", ("medium", false)).unwrap();
    let found = fields(&forgotten_mems);
    let mems = |remedy: &str| remedy.contains("mti-10") && !remedy.contains("tactical");
    assert!(
        matches!(found[..], [("--unit", remedy)] if mems(remedy)),
        "{found:?}"
    );
    // medium is assumed by default
    let record = Record::from_session(&drive("medium", 120));
    let files = Files::of(&record, true);
    assert_eq!(
        files.edited("deg/s", "deg/s", ("medium", false)).unwrap(),
        []
    );
}

#[test]
fn a_rate_that_its_time_stamps_contradict_is_reported() {
    let record = Record::from_session(&drive("tactical", 90));
    let says = |rate: f64| Says {
        file: "log".into(),
        gyro: Field::fixed("--imu"),
        accel: Field::fixed("--imu"),
        axes: ("--mounting".into(), String::new()),
        rate: Some(("--imu".into(), rate)),
        fixes: FixFields::default(),
    };
    let assumed = &class("tactical");
    let class = Class {
        assumed,
        given: true,
    };
    assert_eq!(doubts(&record, &says(100.0), class, &contradicted), []);
    let found = doubts(&record, &says(125.0), class, &contradicted);
    assert_eq!(fields(&found), [("--imu", "give 100")]);
}

/// The noise of positions of every second is as large as the distance between them. Their courses
/// must not make right gyros look wrong, and wrong gyros must still be reported.
#[test]
fn fixes_without_velocities_raise_no_doubt_and_still_show_a_wrong_unit() {
    for preset in ["medium", "tactical"] {
        for mut record in [
            Record::from_session(&drive(preset, 120)),
            on_the_road(&drive(preset, 150)),
        ] {
            for fix in &mut record.fixes {
                fix.velocity = [0.0; 3];
                fix.sigmas[3..].fill(f64::INFINITY);
            }
            let files = Files::of(&record, false);
            let right = files.edited("rad", "rad", (preset, true)).unwrap();
            assert_eq!(right, [], "{preset}");
            let wrong = files.edited("\"rad\"", "\"deg\"", (preset, true)).unwrap();
            let found = fields(&wrong);
            let hit = found
                .iter()
                .any(|(f, r)| *f == "imu.gyro.unit" && r.contains("'rad'"));
            assert!(hit, "{preset}: {found:?}");
        }
    }
}
