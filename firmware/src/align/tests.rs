use super::*;
use core::f64::consts::PI;

const LSB: Lsb = Lsb {
    rad: 1e-9,
    mps: 1e-7,
};
const SAMPLE_S: f64 = 0.01;
/// The class of the paper's sensor: 0.01 deg/h, 100 ug.
const SENSORS: Sensors = Sensors {
    noise: [1e-6, 1e-4],
    bias: [5e-8, 1e-3],
    walk: 0.0,
};
const LATITUDE: f64 = 0.6;
const HEIGHT: f64 = 300.0;

/// Samples of a body at rest with an attitude and constant errors; what rounding leaves is carried.
struct AtRest {
    rate: [V; 2],
    due: [V; 2],
}

impl AtRest {
    fn new(q_bn: Q, gyro: V, accel: V) -> Self {
        let here = Local::at(LATITUDE, HEIGHT);
        let [w, x, y, z] = q_bn;
        let back = [w, -x, -y, -z];
        Self {
            rate: [
                add(rotated(back, here.omega_ie()), gyro),
                add(rotated(back, [0.0, 0.0, -here.g]), accel),
            ],
            due: [[0.0; 3]; 2],
        }
    }

    fn sample(&mut self) -> Counts {
        let mut whole = |k: usize, lsb: f64| -> [i32; 3] {
            core::array::from_fn(|i| {
                self.due[k][i] += self.rate[k][i] * SAMPLE_S / lsb;
                let count = self.due[k][i].round();
                self.due[k][i] -= count;
                count as i32
            })
        };
        Counts {
            dtheta: whole(0, LSB.rad),
            dv: whole(1, LSB.mps),
        }
    }
}

fn euler(roll: f64, pitch: f64, yaw: f64) -> Q {
    product(
        product(from_rotvec([0.0, 0.0, yaw]), from_rotvec([0.0, pitch, 0.0])),
        from_rotvec([roll, 0.0, 0.0]),
    )
}

/// Error angles about north, east, down: `C_est = (I - phi x) C_true`.
fn error(got: Q, truth: Q) -> V {
    let [w, x, y, z] = truth;
    let [w, x, y, z] = product(got, [w, -x, -y, -z]);
    [x, y, z].map(|part| -2.0 * part * w.signum())
}

fn aligned(q: Q, gyro: V, accel: V, seconds: usize) -> Option<Aligned> {
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    let mut samples = AtRest::new(q, gyro, accel);
    for _ in 0..seconds * 100 {
        align.sample(&samples.sample());
    }
    align.finish(LATITUDE, HEIGHT)
}

#[test]
fn perfect_data_give_the_attitude() {
    for q in [
        euler(0.05, -0.03, 2.3),
        euler(-0.1, 0.2, -1.0),
        euler(3.0, 0.1, 0.4), // upside down
        euler(0.0, 1.5, 0.0),
    ] {
        let got = aligned(q, [0.0; 3], [0.0; 3], 300).unwrap();
        let off = error(got.q_bn, q);
        // a count of 1e-9 rad at the end of 300 s is 5e-8 of the Earth's turn
        assert!(off.iter().all(|x| x.abs() < 2e-7), "{off:?}");
        assert!((got.time_s - 300.0).abs() < 1e-6);
    }
}

/// Tilt = accelerometer bias / g; heading = east gyro bias / (Earth rate cos latitude); all of it
/// as `by` predicts.
#[test]
fn errors_are_those_of_the_textbook() {
    let here = Local::at(LATITUDE, HEIGHT);
    let size = SENSORS.bias.map(f64::from);
    for q in [euler(0.0, 0.0, 0.0), euler(0.2, -0.1, 2.0)] {
        for k in 0..6 {
            let (mut gyro, mut accel) = ([0.0; 3], [0.0; 3]);
            if k < 3 {
                gyro[k] = 10.0 * size[0];
            } else {
                accel[k - 3] = size[1];
            }
            let got = aligned(q, gyro, accel, 300).unwrap();
            let off = error(got.q_bn, q);
            let level = (size[1] / here.g).max(1_500.0 * size[0]);
            for (i, scale) in [level, level, 10.0 * level].into_iter().enumerate() {
                let e = if k < 3 { 10.0 * size[0] } else { size[1] };
                let predicted = f64::from(got.by[i][k]) * e;
                assert!(
                    (off[i] - predicted).abs() < 0.03 * scale,
                    "{k} {i}: {off:?} {predicted}"
                );
            }
        }
    }
    let east = aligned(euler(0.0, 0.0, 0.0), [0.0, size[0], 0.0], [0.0; 3], 300).unwrap();
    let want = size[0] / (OMEGA_IE * here.cos);
    let off = error(east.q_bn, euler(0.0, 0.0, 0.0));
    assert!((off[2] / want - 1.0).abs() < 0.02, "{off:?} {want}");
    let p = east.covariance(SENSORS.bias);
    let sigma = f64::from(libm::sqrtf(p[2][2] - east.rest[2][2]));
    assert!((0.98..1.02).contains(&(sigma / want)), "{sigma} {want}");
    let sigma = f64::from(libm::sqrtf(p[1][1]));
    assert!((sigma * here.g / size[1] - 1.0).abs() < 0.05);
}

#[test]
fn too_short_or_dead_data_give_nothing() {
    let q = euler(0.0, 0.0, 1.0);
    assert!(aligned(q, [0.0; 3], [0.0; 3], 20).is_none());
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    align.restart(true); // the detector would not have it
    for _ in 0..60_000 {
        align.sample(&Counts::default());
    }
    assert!(align.gathered() > 599.0 && align.finish(LATITUDE, HEIGHT).is_none());
    assert!(
        Align::new(SENSORS, LSB, SAMPLE_S)
            .finish(0.0, 0.0)
            .is_none()
    );
}

/// The vehicle drives off: the second of the start is not used, and the attitude goes on with the
/// vehicle.
#[test]
fn the_start_of_a_drive_ends_it_and_the_gyros_carry_it_on() {
    let q = euler(0.01, -0.02, 0.7);
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    let mut samples = AtRest::new(q, [0.0; 3], [0.0; 3]);
    for _ in 0..20_000 {
        align.sample(&samples.sample());
    }
    assert_eq!(align.still(), 200);
    samples.rate[1][0] += 0.5; // m/s2
    let back = scale(Local::at(LATITUDE, HEIGHT).omega_ie(), -SAMPLE_S);
    let mut want = q;
    for k in 0..3_000 {
        let mut sample = samples.sample();
        if k > 500 {
            sample.dtheta[2] += 1_000_000; // 0.1 rad/s
        }
        align.sample(&sample);
        let turn = sample.dtheta.map(|count| f64::from(count) * LSB.rad);
        want = product(product(from_rotvec(back), want), from_rotvec(turn));
    }
    assert_eq!(align.still(), 0);
    let got = align.finish(LATITUDE, HEIGHT).unwrap();
    assert!((got.time_s - 200.0).abs() < 1.5, "{}", got.time_s);
    let off = error(got.q_bn, want);
    assert!(off.iter().all(|x| x.abs() < 3e-6), "{off:?}");
}

#[test]
fn a_vehicle_under_way_is_not_aligned() {
    let q = euler(0.0, 0.0, 0.7);
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    let mut samples = AtRest::new(q, [0.0; 3], [0.0; 3]);
    let force = samples.rate[1];
    for k in 0..60_000 {
        let t = f64::from(k) * SAMPLE_S;
        samples.rate[1] = add(force, [0.3 * (0.1 * t).sin(), 0.2 * (0.2 * t).cos(), 0.0]);
        align.sample(&samples.sample());
    }
    assert!(align.gathered() < 5.0, "{}", align.gathered());
    assert!(align.finish(LATITUDE, HEIGHT).is_none());
    // evenly and straight: only a receiver can show it
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    samples.rate[1] = force;
    for k in 0..6_000 {
        align.sample(&samples.sample());
        if k % 100 == 50 {
            align.moves();
        }
    }
    assert!(align.finish(LATITUDE, HEIGHT).is_none());
}

/// By command it gathers although the vehicle sways, and no more after the end.
#[test]
fn a_command_is_believed_rather_than_the_detector() {
    let q = euler(0.0, 0.0, 0.7);
    let mut samples = AtRest::new(q, [0.0; 3], [0.0; 3]);
    let force = samples.rate[1];
    for commanded in [false, true] {
        let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
        align.restart(commanded);
        for k in 0..12_000 {
            let t = f64::from(k) * SAMPLE_S;
            samples.rate[1] = add(force, [0.3 * (2.0 * t + 1.0).sin(), 0.0, 0.0]);
            align.sample(&samples.sample());
        }
        samples.rate[1] = force;
        align.finish_command();
        let before = align.gathered();
        for _ in 0..1_000 {
            align.sample(&samples.sample());
        }
        let after = align.gathered() - before;
        let got = align.finish(LATITUDE, HEIGHT);
        assert_eq!(got.is_some(), commanded);
        if let Some(got) = got {
            assert!(after == 0.0 && (got.time_s - 120.0).abs() < 1.5);
            // sway of 0.15 m/s over 120 s
            let off = error(got.q_bn, q);
            assert!(off[0].abs() < 1e-3 && off[1].abs() < 1e-3, "{off:?}");
        }
    }
}

#[test]
fn a_hole_begins_anew() {
    let mut align = Align::new(SENSORS, LSB, SAMPLE_S);
    let mut samples = AtRest::new(euler(0.0, 0.0, PI / 3.0), [0.0; 3], [0.0; 3]);
    for _ in 0..5_000 {
        align.sample(&samples.sample());
    }
    assert!(align.gathered() > 48.0);
    align.gap();
    assert!(align.gathered() == 0.0 && align.still() == 0);
}
