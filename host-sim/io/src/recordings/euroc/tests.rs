use super::*;
use test_bench::recordings::message;

/// An IMU with x up, y right and z forward that turns right, on a ground truth that drives
/// west. One line in four of the IMU has a true state.
fn folder(change: impl Fn(&str, String) -> String) -> (tempfile::TempDir, Result<Reading, Error>) {
    let start = 1_403_636_579_758_555_392_i64;
    let mut imu =
        "#timestamp [ns],w_RS_S_x,w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n".to_owned();
    let mut truth =
        "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v_x, v_y, v_z, b_w\n".to_owned();
    for k in 0..=800_i64 {
        let ns = start + 5_000_000 * k;
        imu += &format!("{ns},-0.1,0.2,{},9.8,0.5,0.25\n", 1e-3 * k as f64);
        if k % 4 == 0 {
            let t = 5e-3 * k as f64;
            // x, y, z of the sensor point to z, x, y of the room: 120 degrees about (1, 1, 1)
            truth += &format!("{ns},1.0,{},0.5,0.5,-0.5,-0.5,-0.5,0,2,0,7\n", 2.0 * t);
        }
    }
    let yaml = "T_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0,\n         0.0, 1.0, 0.0, 0.0,\n  \
                0.0, 0.0, 1.0, 0.0,\n         0.0, 0.0, 0.0, 1.0]\nrate_hz: 200\n";
    let dir = tempfile::tempdir().unwrap();
    let mav = dir.path().join("mav0");
    for (name, text) in [
        ("imu0/data.csv", imu),
        ("imu0/sensor.yaml", yaml.to_owned()),
        ("state_groundtruth_estimate0/data.csv", truth),
    ] {
        let path = mav.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, change(name, text)).unwrap();
    }
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| body().turn(e));
    let choice = Choice {
        origin: Geodetic {
            lat: 47.4 * DEG,
            lon: 8.5 * DEG,
            h: 450.0,
        },
        interval_s: 0.5,
        sigmas: [0.05, 0.1],
        max_gap_s: None,
        mounting: Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes)),
    };
    let read = read(dir.path(), &choice);
    (dir, read)
}

#[test]
fn a_room_becomes_a_drive_to_the_west() {
    let (_dir, read) = folder(|_, text| text);
    let r = read.unwrap().record;
    assert_eq!((r.rate_hz, r.time.len(), r.kind), (200, 801, Kind::Rate));
    assert_eq!((r.time[0], r.time[1], r.time[800]), (0.0, 0.005, 4.0));
    // forward is z, right is y, down is -x
    assert_eq!(r.samples[5].dtheta, Vector3::new(5e-3, 0.2, 0.1));
    assert_eq!(r.samples[5].dv, Vector3::new(0.25, 0.5, -9.8));
    let times: Vec<f64> = r.fixes.iter().map(|f| f.time).collect();
    assert_eq!(times, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0]);
    let f = r.fixes[4];
    assert!((Vector3::from(f.velocity) - Vector3::new(0.0, -2.0, 0.0)).norm() < 1e-12);
    assert_eq!(
        (f.height_m, f.sigmas),
        (450.5, [0.05, 0.05, 0.05, 0.1, 0.1, 0.1])
    );
    // 4 m of a parallel of 6380 km * cos(47.4 deg)
    assert!(
        (f.lon_deg - 8.5 + 4.0 / (6_390_000.0 * 0.6769) / DEG).abs() < 1e-7,
        "{f:?}"
    );
    let Some(InitialAttitude::Known(q)) = r.initial_attitude else {
        panic!("no attitude");
    };
    // level, and the nose to the west
    let (roll, pitch, heading) = host_core::inertial::rotation::to_euler(&q);
    assert!(roll.abs() < 1e-9 && pitch.abs() < 1e-9, "{roll} {pitch}");
    assert!((heading + 90.0 * DEG).abs() < 1e-9, "{heading}");
    assert!(r.truth.is_some() && r.session().is_ok());
}

/// Samples of `nan` are missing ones, and a file that ends within a line is read up to there.
#[test]
fn samples_of_nan_and_cut_lines() {
    let (_dir, read) = folder(|name, text| match name {
        "imu0/data.csv" => {
            let lines = text.lines().enumerate().map(|(k, line)| match k {
                100 => line.replacen("-0.1", "nan", 1),
                101 => line.replacen("9.8", "NaN", 1),
                300 => line.replacen("0.25", "", 1),
                _ => line.to_owned(),
            });
            let lines: Vec<String> = lines.collect();
            let mut text = lines.join("\n");
            text.truncate(text.len() - 10);
            text
        }
        _ => text,
    });
    let record = read.unwrap().record;
    assert_eq!(record.time.len(), 801 - 3 - 1);
    assert_eq!([record.time[98], record.time[99]], [0.49, 0.505]);
    let notes = record.notes.join("; ");
    assert!(
        notes.contains("data line: 3 ") && notes.contains("power cut"),
        "{notes}"
    );
}

#[test]
fn axes_of_the_sensor_are_turned() {
    let turned = "T_BS:\n  data: [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n";
    let (_dir, read) = folder(|name, text| match name {
        "imu0/sensor.yaml" => turned.into(),
        _ => text,
    });
    // x of the body is -y of the sensor, y is its x
    let sample = read.unwrap().record.samples[5];
    assert_eq!(sample.dv, Vector3::new(0.25, 9.8, 0.5));
}

#[test]
fn every_fault_names_its_location() {
    let swap = |file: &'static str, old: &'static str, new: &'static str| {
        let (_dir, read) = folder(move |name, text| match name == file {
            // the first line of data may be cut
            true if new.is_empty() || new.ends_with("g,") => {
                let (first, rest) =
                    text.split_at(text.match_indices('\n').nth(1).map_or(0, |m| m.0));
                match rest.contains(old) {
                    true => format!("{first}{}", rest.replacen(old, new, 1)),
                    false => text.replacen(old, new, 1),
                }
            }
            true => text.replacen(old, new, 1),
            false => text,
        });
        let text = read.unwrap_err().to_string();
        assert!(text.contains("; remedy: "), "{text}");
        text
    };
    let (imu, truth) = ("imu0/data.csv", "state_groundtruth_estimate0/data.csv");
    for (file, old, new, part) in [
        (
            imu,
            "9.8,",
            "9.8g,",
            "imu0/data.csv:3: column 'a_RS_S_x': '9.8g' is not a number",
        ),
        (imu, "-0.1,", "", "imu0/data.csv:3: 6 columns instead of 7"),
        (imu, "-0.1,", "-99,", "'data line message 1' has 99.0 rad/s"),
        (imu, ",w_RS_S_x", "", "'line 1' has 6 columns"),
        (
            truth,
            "1.0,0,",
            "20000,0,",
            "data.csv:2: column 'p_x': '20000' is out of range",
        ),
        (
            truth,
            "0.5,0.5,-0.5",
            "0.5,5,-0.5",
            "column 'q_w': '5' is not part of a unit quaternion",
        ),
        (
            truth,
            "1403636579778555392",
            "1403636579758555392",
            "data.csv:3: column '#timestamp'",
        ),
        (
            "imu0/sensor.yaml",
            "1.0, 0.0",
            "2.0, 0.0",
            "'T_BS' is not a rotation",
        ),
        ("imu0/sensor.yaml", "[", "", "'T_BS' has no list"),
    ] {
        let why = swap(file, old, new);
        assert!(why.contains(part), "no '{part}' in {why}");
    }
    let why = read(
        Path::new("no/such"),
        &Choice {
            origin: Geodetic::default(),
            interval_s: 1.0,
            sigmas: [1.0; 2],
            max_gap_s: None,
            mounting: Rotation3::identity(),
        },
    );
    let why = why.unwrap_err();
    assert!(message(&why).contains("no such file"), "{why}");
}
