use super::*;

/// The example of docs/your-imu.md: z = [1.03 f_x + 0.2, ...], with axes that are not at right
/// angles.
fn example() -> Triad {
    let forward = Matrix3::new(1.03, 0.004, -0.002, 0.001, 0.98, 0.006, 0.0, -0.003, 1.01);
    Triad {
        matrix: forward.try_inverse().unwrap(),
        bias: Vector3::new(0.2, -0.1, 0.05),
    }
}

/// A true force, and what the sensor makes of it: `z = C^-1 f + B`.
fn measured() -> (Vector3<f64>, Vector3<f64>) {
    let f = Vector3::new(0.5, -1.2, 9.7);
    let example = example();
    (f, example.matrix.try_inverse().unwrap() * f + example.bias)
}

/// The numbers of a file, in order, without keys.
fn all_numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| !(c.is_ascii_digit() || ".-e".contains(c)));
    words.filter_map(|word| word.parse().ok()).collect()
}

fn times(m: &[f64], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| m[3 * i] * v[0] + m[3 * i + 1] * v[1] + m[3 * i + 2] * v[2])
}

fn close(found: [f64; 3], want: &Vector3<f64>) {
    for (found, want) in found.iter().zip(want.iter()) {
        assert!((found - want).abs() < 1e-12, "{found} {want}");
    }
}

fn read_text(text: &str) -> Result<ForeignCalibration, String> {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("c.calib");
    std::fs::write(&file, text).unwrap();
    read(&file).map_err(|error| error.to_string())
}

/// imu_tk, `unbiasNormalize`: T K (X - B), of the three parts of its text.
#[test]
fn imu_tk_applies_what_is_written_for_it() {
    let (f, z) = measured();
    let n = all_numbers(&tk::write(&example()));
    assert_eq!(n.len(), 21);
    let unbiased = [0, 1, 2].map(|i| z[i] - n[18 + i]);
    close(times(&n[..9], times(&n[9..18], unbiased)), &f);
    // T has ones on its diagonal, K nothing beside it
    assert!([n[0], n[4], n[8]] == [1.0; 3] && [n[10], n[11], n[12]] == [0.0; 3]);
}

/// imu_calib, `applyCalib`: SM raw - bias.
#[test]
fn imu_calib_applies_what_is_written_for_it() {
    let (f, z) = measured();
    let n = all_numbers(&sm::write(&example()));
    assert_eq!(n.len(), 12);
    let scaled = times(&n[..9], z.into());
    close([0, 1, 2].map(|i| scaled[i] - n[9 + i]), &f);
}

/// Kalibr's error terms: z - (M f + b), and z - (M C w + A f + b) of the gyros.
#[test]
fn kalibr_models_what_is_written_for_it() {
    let (f, z) = measured();
    let noise = kalibr::Noise {
        rate_hz: Some(200.0),
        gyro: [1e-4, 2e-6],
        accel: [3e-3, 4e-5],
    };
    let text = kalibr::write(Some(&example()), Some(&example()), &noise, "made here");
    let after = |word: &str| all_numbers(&text[text.find(word).unwrap() + word.len()..]);
    let modelled = times(&after("accelerometers:\n  M:")[..9], f.into());
    close([0, 1, 2].map(|i| modelled[i] + example().bias[i]), &z);
    let gyro = times(
        &after("gyroscopes:\n  M:")[..9],
        times(&after("C_gyro_i:")[..9], f.into()),
    );
    close([0, 1, 2].map(|i| gyro[i] + example().bias[i]), &z);
    assert_eq!(after("accelerometer_noise_density:")[0], 3e-3);
    assert_eq!(after("A:")[..9], [0.0; 9]);
}

#[test]
fn the_device_subtracts_map_and_bias() {
    let (f, z) = measured();
    let (map, bias) = example().device();
    assert!((z - map * z - bias - f).amax() < 1e-12);
}

#[test]
fn every_form_comes_back() {
    let same = |found: Option<Triad>, with_bias: bool| {
        let (found, want) = (found.unwrap(), example());
        assert!((found.matrix - want.matrix).amax() < 1e-14, "{found:?}");
        let bias = if with_bias {
            want.bias
        } else {
            Vector3::zeros()
        };
        assert!((found.bias - bias).amax() < 1e-14, "{found:?}");
    };
    let tk = read_text(&tk::write(&example())).unwrap();
    assert_eq!(tk.tool, "imu_tk");
    same(tk.accel, true);
    let sm = read_text(&sm::write(&example())).unwrap();
    assert_eq!(sm.tool, "imu_calib");
    same(sm.accel, true);
    let noise = kalibr::Noise {
        rate_hz: None,
        gyro: [1e-4, 2e-6],
        accel: [3e-3, 4e-5],
    };
    let text = kalibr::write(Some(&example()), Some(&example()), &noise, "made here");
    let back = read_text(&text).unwrap();
    assert_eq!((back.tool, back.noise), ("Kalibr", Some(noise)));
    same(back.accel, false);
    same(back.gyro, false);
    assert!(back.notes[0].contains("no biases"));
}

/// Texts in the layouts that the tools themselves write.
#[test]
fn the_tools_own_layouts_are_read() {
    // yaml-cpp's blocks, Python's flow lists below blocks, OpenCV's first line, imu0 after a run
    let blocks = "SM:\n  - 0.99\n  - 0\n  - 0\n  - 0\n  - 1.01\n  - 0\n  - 0\n  - 0\n  - 1\n\
                  bias:\n  - 0.1\n  - -0.2\n  - 0.3";
    let read = read_text(blocks).unwrap().accel.unwrap();
    assert_eq!(read.matrix[(1, 1)], 1.01);
    assert!((read.bias[0] - 0.1 / 0.99).abs() < 1e-15);
    let after = "\
%YAML:1.0

imu0:
  T_i_b:
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  accelerometer_noise_density: 0.006
  accelerometer_random_walk: 0.0002
  accelerometers:
    M:
    - [1.02, 0.0, 0.0]
    - [0.01, 0.99, 0.0]
    - [0.0, 0.0, 1.0]
  gyroscope_noise_density: 0.0004
  gyroscope_random_walk: 4.0e-06
  gyroscopes:
    A:
    - [0.0001, 0.0, 0.0]
    - [0.0, 0.0, 0.0]
    - [0.0, 0.0, 0.0]
    C_gyro_i:
    - [0.0, 1.0, 0.0]
    - [-1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0]
    M:
    - [0.0, -1.01, 0.0]
    - [1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0]
  model: scale-misalignment
  rostopic: /imu0
  time_offset: 0.0
  update_rate: 200.0
";
    let read = read_text(after).unwrap();
    assert!((read.accel.unwrap().matrix[(0, 0)] - 1.0 / 1.02).abs() < 1e-15);
    // M C of the gyros: the turn counts
    let gyro = read.gyro.unwrap().matrix;
    assert!((gyro[(0, 0)] - 1.0 / 1.01).abs() < 1e-15, "{gyro}");
    assert_eq!(read.noise.unwrap().gyro, [4e-4, 4e-6]);
    assert!(
        read.notes[1].contains("A, up to 1.00e-4"),
        "{:?}",
        read.notes
    );
    let tk = "1 -0.01 0.02\n0 1 0.03\n0 0 1\n\n0.99 0 0\n0 1.01 0\n0 0 1\n\n0.1\n0.2\n0.3\n\n";
    let read = read_text(tk).unwrap().accel.unwrap();
    assert_eq!(read.matrix[(0, 1)], -0.01 * 1.01);
    assert_eq!(read.bias, Vector3::new(0.1, 0.2, 0.3));
}

#[test]
fn what_is_no_calibration_is_named() {
    for (text, says) in [
        ("", "'imu_tk' has 0 numbers instead of 21"),
        ("1 2 three", "has 'three', which is not a number"),
        (
            "SM: [1, 2]\nbias: [0, 0, 0]",
            "'SM' has 2 numbers instead of 9",
        ),
        (
            "SM: [1,0,0,0,1,0,0,0,1]\nbias: 3",
            "'bias' has 0 numbers instead of 3",
        ),
        ("SM: [1,0,0,0,1,0,0,0,1", "'YAML' is damaged"),
        (
            "a: 1",
            "'gyroscope_noise_density' is not there, nor a matrix M",
        ),
        (
            "gyroscope_noise_density: 1",
            "'gyroscope_random_walk' is not there as a number",
        ),
        (
            "accelerometers: { M: [1, 2] }",
            "'accelerometers.M' has 2 numbers instead of 9",
        ),
        (
            "accelerometers: { M: [[0.004,0,0],[0,0.004,0],[0,0,0.004]] }",
            "'accelerometers.M' is 0.996 off the unit matrix",
        ),
    ] {
        let message = read_text(text).unwrap_err();
        assert!(
            message.contains(says) && message.contains("remedy"),
            "{text}: {message}"
        );
        assert!(message.contains("c.calib"), "{message}");
    }
}
