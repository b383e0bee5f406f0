use super::*;
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use host_core::inertial::session::Session;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use nalgebra::UnitQuaternion;
use test_bench::recordings::message;

fn simulated() -> Session {
    let imu = ImuSpec::preset("medium").unwrap();
    let config = SessionConfig {
        start: Geodetic {
            lat: 0.6,
            lon: 1.9,
            h: 100.0,
        },
        ..SessionConfig::new(&imu, [100.0, 120.0], [1, 2, 3])
    };
    simulate(&config).0
}

#[test]
fn a_recording_written_and_read_is_the_same_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let (imu, gnss) = (dir.path().join("imu.txt"), dir.path().join("gnss.txt"));
    let session = simulated();
    let record = Record::from_session(&session);
    for velocity in [true, false] {
        let form = Form {
            shift_s: 0.0,
            velocity,
        };
        write(&record, form, &imu, &gnss).unwrap();
        let back = read(&imu, &gnss, record.initial_attitude).unwrap();
        assert_eq!(back.time, record.time);
        for (a, b) in back.samples.iter().zip(&record.samples) {
            assert_eq!((a.dtheta, a.dv), (b.dtheta, b.dv));
        }
        let lost = |f: &TimedFix| TimedFix {
            velocity: if velocity { f.velocity } else { [0.0; 3] },
            sigmas: match velocity {
                true => f.sigmas,
                false => [1.0, 1.0, 1.5, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED],
            },
            ..*f
        };
        let want: Vec<TimedFix> = record.fixes.iter().map(lost).collect();
        assert_eq!(back.fixes, want);
        let s = back.session().unwrap();
        assert_eq!((s.epochs(), s.standstill), (session.epochs(), 100));
        let sigma = if velocity { 0.05 } else { NOT_MEASURED };
        assert_eq!(s.fixes[3].unwrap().sigmas[3], sigma);
    }
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    let late = Form {
        shift_s: WEEK_S - 100.0,
        velocity: false,
    };
    let why = write(&record, late, &imu, &gnss).unwrap_err().to_string();
    assert!(why.starts_with("--shift: 604800.0"), "{why}");
}

/// Lines as in the demonstration data of KF-GINS: blanks at the end, Windows line ends, commas, an
/// odometer.
#[test]
fn files_of_others_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    let imu: String = (0..200)
        .map(|k| {
            format!(
                "{:.6}, 1e-6, 0,\t0, 0, 0, -0.0981 0.5 \r\n",
                456_250.01 + 0.01 * f64::from(k)
            )
        })
        .collect();
    let gnss = "456250.000    30.4447858054   114.4718661162     21.095    0.010    0.009    0.019 \n\
                456251.000    30.4447857891   114.4718661133     21.091    0.010    0.009    0.019 \n";
    let truth = "2150 456250.000 30.44 114.47 21 1 2 3 0.85 -2.03 185.7\n\
                 2150 456251.000 30.44 114.47 21 1 2 3 0.85 -2.03 185.9\n";
    for (name, text) in [("imu", imu.as_str()), ("gnss", gnss), ("truth", truth)] {
        std::fs::write(path(name), text).unwrap();
    }
    let state = read_truth(&path("truth")).unwrap().at(456_250.5);
    let (roll, pitch, yaw) = host_core::inertial::rotation::to_euler(&state.q_bn);
    let want = [0.85, -2.03, 185.8 - 360.0].map(|a| a * DEG);
    for (got, want) in [roll, pitch, yaw].iter().zip(want) {
        assert!((got - want).abs() < 1e-5, "{got} {want}");
    }
    let attitude = Some(InitialAttitude::Known(state.q_bn));
    let record = read(&path("imu"), &path("gnss"), attitude).unwrap();
    assert_eq!((record.rate_hz, record.samples.len()), (100, 200));
    assert_eq!(record.samples[3].dv.z, -0.0981);
    assert_eq!(record.fixes[1].sigmas[..3], [0.010, 0.009, 0.019]);
    assert_eq!(record.session().unwrap().epochs(), 1);
}

fn complaint(imu: &str, gnss: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let (i, g) = (dir.path().join("in.imu"), dir.path().join("in.gnss"));
    std::fs::write(&i, imu).unwrap();
    std::fs::write(&g, gnss).unwrap();
    let attitude = Some(InitialAttitude::Known(UnitQuaternion::identity()));
    let session = read(&i, &g, attitude).and_then(|r| r.session());
    message(&session.map(|s| s.epochs()).unwrap_err())
}

#[test]
fn every_fault_names_its_location() {
    let imu = |k: usize| format!("{:.2} 0 0 0 0 0 -0.0981\n", 100.0 + 0.01 * k as f64);
    let gnss = |k: usize| format!("{} 45 7 80 1 1 2\n", 100 + k);
    let (imus, fixes): (String, String) = ((0..300).map(imu).collect(), (0..4).map(gnss).collect());
    let cases = [
        (
            imus.replace("100.05 0 0", "100.05 0 z"),
            fixes.clone(),
            "in.imu:6: column 'dtheta_y_rad': 'z' is not a number",
        ),
        (
            imus.replace("100.05 0 0", "100.05 9 0"),
            fixes.clone(),
            "in.imu:6: column 'dtheta_x_rad': '9' is out of range",
        ),
        (
            imus.replace("100.05 0 0", "100.05 0"),
            fixes.clone(),
            "in.imu:6: 6 columns instead of 7",
        ),
        (
            imus.replace("100.05 0 0", "100.04 0 0"),
            fixes.clone(),
            "in.imu:6: column 't_s': time 100.04 follows",
        ),
        (
            imu(0),
            fixes.clone(),
            "in.imu: has fewer than two whole samples",
        ),
        (String::new(), fixes.clone(), "in.imu: is empty"),
        (
            imus.clone(),
            fixes.replace("102 45", "102 95"),
            "in.gnss:3: column 'lat_deg': '95' is out of range",
        ),
        (
            imus.clone(),
            fixes.replace("1 1 2", "1 0 2"),
            "in.gnss:1: column 'sigma_east_m': '0' is not a standard deviation",
        ),
        (
            imus.clone(),
            fixes.replace("10", "20"),
            "in.imu: 'time' has no whole second",
        ),
    ];
    for (i, g, start) in cases {
        let why = complaint(&i, &g);
        assert!(why.starts_with(start), "{why}");
    }
}

/// Lines that are no numbers may stand before the data. A cut first line is none of them.
#[test]
fn lines_before_the_data_are_left_out_with_a_note() {
    let dir = tempfile::tempdir().unwrap();
    let (imu, gnss) = (dir.path().join("imu"), dir.path().join("gnss"));
    let line = |k: usize| format!("{:.2} 0 0 0 0 0 -0.0981\n", 100.0 + 0.01 * k as f64);
    let samples: String = (0..300).map(line).collect();
    let fixes = "100 45 7 80 1 1 2\n101 45 7 80 1 1 2\n";
    std::fs::write(&gnss, format!("sow lat lon h sn se sd\n{fixes}")).unwrap();
    for (before, notes) in [
        ("", 0),
        ("# a comment\n", 0),
        ("Log 7 of my box\n\nsow gx gy gz ax ay az\n", 1),
        ("# a comment\nsow gx gy gz ax ay az\n99.98 0 0\n", 2),
    ] {
        std::fs::write(&imu, format!("{before}{samples}")).unwrap();
        assert_eq!(is_imu(&imu), !before.contains("gx gy gz"), "{before}");
        let record = read(&imu, &gnss, None).unwrap();
        assert_eq!(
            (record.time.len(), record.fixes.len()),
            (300, 2),
            "{before}"
        );
        let all = record.notes.join("\n");
        let of_samples = record.notes.iter().filter(|note| note.contains("imu:"));
        assert_eq!(of_samples.count(), notes, "{before}: {all}");
        assert!(
            all.contains("gnss: the lines before line 2 are left out"),
            "{all}"
        );
    }
}

/// Two forms of 13 columns are in use; the numbers show which one a file has.
#[test]
fn both_orders_of_thirteen_columns_are_read_and_told() {
    let dir = tempfile::tempdir().unwrap();
    let (imu, gnss) = (dir.path().join("imu"), dir.path().join("gnss"));
    let line = |k: usize| format!("{:.2} 0 0 0 0 0 -0.0981\n", 100.0 + 0.01 * k as f64);
    std::fs::write(&imu, (0..300).map(line).collect::<String>()).unwrap();
    // all velocities above 0, so that the signs do not show it
    for (v, other) in [("3 4 0.1", false), ("-3 4 0.1", false), ("3 4 0.1", true)] {
        let fix = |k: usize| {
            let (k, north) = (k as f64, if v.starts_with('-') { -3.0 } else { 3.0 });
            let (lat, lon) = (45.0 + north * k / 111_200.0, 7.0 + 4.0 * k / 78_630.0);
            let rest = match other {
                false => format!("{v} 1 1 2 0.05 0.06 0.07"),
                true => format!("1 1 2 {v} 0.05 0.06 0.07"),
            };
            format!("{} {lat:.8} {lon:.8} 80 {rest}\n", 100.0 + k)
        };
        std::fs::write(&gnss, (0..4).map(fix).collect::<String>()).unwrap();
        let record = read(&imu, &gnss, None).unwrap();
        let fix = record.fixes[2];
        assert_eq!(fix.velocity[1..], [4.0, 0.1], "{v}, {other}");
        assert_eq!(fix.sigmas, [1.0, 1.0, 2.0, 0.05, 0.06, 0.07]);
        let noted = record
            .notes
            .iter()
            .any(|note| note.contains("--gnss-order"));
        assert!(noted, "{:?}", record.notes);
        let wrong = match other {
            false => Order::SigmaVelocity,
            true => Order::VelocitySigma,
        };
        let forced = read_in_order(&imu, &gnss, None, Some(wrong));
        match forced {
            Ok(record) => assert_eq!(record.fixes[2].velocity, [1.0, 1.0, 2.0]),
            Err(why) => assert!(why.to_string().contains("standard deviation"), "{why}"),
        }
    }
}

#[test]
fn the_end_of_a_week_nan_and_cut_lines_are_read_over_with_a_note() {
    let dir = tempfile::tempdir().unwrap();
    let (imu, gnss) = (dir.path().join("imu"), dir.path().join("gnss"));
    let second = |k: usize| (604_798.0 + 0.01 * k as f64) % 604_800.0;
    let line = |k: usize| match k {
        250 => format!("{:.2} nan 0 0 0 0 -0.0981\n", second(k)),
        _ => format!("{:.2} 0 0 0 0 0 -0.0981\n", second(k)),
    };
    let lines: String = (1..400).map(line).collect();
    std::fs::write(&imu, format!("98.00 0 0\n{lines}{:.2} 0 0", second(400))).unwrap();
    let fixes = "604798 0 0 0 1 1 2\n604799 45 7 80 1 1 2\n0 45 7 80 1 1 2\n1 45 7 80 1 1 2\n";
    std::fs::write(&gnss, fixes).unwrap();
    let record = read(&imu, &gnss, None).unwrap();
    assert_eq!((record.time.len(), record.fixes.len()), (398, 3));
    assert_eq!(record.time.end(), Some(604_801.99));
    assert_eq!(record.fixes[2].time, 604_801.0);
    let all = record.notes.join("\n");
    for part in [
        "imu:1: the first line of data is not whole",
        "imu:401: the file ends within this line",
        "1 line of",
        "seconds of week of the samples",
        "seconds of week of the fixes",
        "1 line from 604798 to 604798 s holds no fix: latitude and longitude are 0",
    ] {
        assert!(all.contains(part), "{part}: {all}");
    }
}
