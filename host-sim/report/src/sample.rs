//! A report with made-up curves of the right shape and length, for tests of the drawing only.

use host_lab::experiment::results::{Curve, Curves, ErrorTrace, Report, Results, Row};

/// Uniform in -0.5..0.5, the same every time.
struct Noise(u64);
impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

const SCHEMES: [(&str, f64); 4] = [
    ("raw", 1.0),
    ("ls-bias", 0.62),
    ("ls-3x3", 1.09),
    ("rnn", 0.38),
];
const SECONDS: usize = 22 * 60;

/// East and north error after `t` seconds: growing, with a Schuler-like swing.
fn drift(t: f64, part: f64) -> (f64, f64) {
    let swing = (t / 806.0).sin();
    (
        -part * (2.2e-3 * t * t + 900.0 * swing),
        -part * (1.3e-3 * t * t - 300.0 * swing * part),
    )
}

fn position(t: f64) -> (f64, f64) {
    let turn = t / 180.0;
    (
        14.0 * t + 900.0 * turn.sin(),
        6.0 * t + 1500.0 * (0.7 * turn).cos() - 1500.0,
    )
}

fn rows() -> Vec<Row> {
    let row = |t_min: u32, scheme: &str, part: f64| {
        let (east, north) = drift(f64::from(t_min) * 60.0, part);
        let ahead = drift(f64::from(t_min) * 60.0 + 1.0, part);
        Row {
            t_s: 60 * t_min,
            scheme: scheme.into(),
            d_north_m: north,
            d_east_m: east,
            d_vn_mps: ahead.1 - north,
            d_ve_mps: ahead.0 - east,
            horizontal_m: north.hypot(east),
        }
    };
    let times = [5, 10, 15, 20, 22];
    times
        .into_iter()
        .flat_map(|t| SCHEMES.map(|(name, part)| row(t, name, part)))
        .collect()
}

fn trace(axis: &str, unit: &str, scale: f64, noise: &mut Noise) -> ErrorTrace {
    let t_min: Vec<f64> = (0..3000).map(|i| f64::from(i) / 100.0).collect();
    let truth = |t: f64| scale * (1.0 - (-t / 6.0).exp() + 0.15 * (t / 3.0).sin());
    ErrorTrace {
        axis: axis.into(),
        unit: unit.into(),
        truth: t_min
            .iter()
            .map(|&t| truth(t) + 0.05 * scale * noise.next())
            .collect(),
        teacher: t_min
            .iter()
            .map(|&t| {
                if t < 8.0 {
                    truth(t) + 0.8 * scale * noise.next()
                } else {
                    f64::NAN
                }
            })
            .collect(),
        network: t_min
            .iter()
            .map(|&t| truth(t) * 0.93 + 0.02 * scale * (t * 2.0).sin())
            .collect(),
        t_min,
    }
}

fn learning(name: &str, floor: f64, noise: &mut Noise) -> Curve {
    let passes: Vec<f64> = (0..400).map(f64::from).collect();
    let cost = passes
        .iter()
        .map(|pass| (floor + (-pass / 40.0).exp()) * (1.0 + 0.1 * noise.next()))
        .collect();
    Curve {
        name: name.into(),
        x: passes,
        y: cost,
    }
}

/// The report; see the module.
pub(super) fn report() -> Report {
    let mut noise = Noise(1);
    let seconds: Vec<f64> = (0..=SECONDS * 10).map(|i| i as f64 / 10.0).collect();
    let path = |name: &str, part: f64| {
        let at = |&t: &f64| {
            (
                position(t).0 + drift(t, part).0,
                position(t).1 + drift(t, part).1,
            )
        };
        let (x, y) = seconds.iter().map(at).unzip();
        Curve {
            name: name.into(),
            x,
            y,
        }
    };
    let error = |(name, part): (&str, f64)| Curve {
        name: name.into(),
        x: seconds.iter().map(|t| t / 60.0).collect(),
        y: seconds
            .iter()
            .map(|&t| drift(t, part).0.hypot(drift(t, part).1))
            .collect(),
    };
    let gyros = [("gyro x", 0.8), ("gyro y", -0.5), ("gyro z", 0.3)]
        .map(|(axis, scale)| (axis, "deg/h", scale));
    let accels = [("accel x", 60.0), ("accel y", 35.0), ("accel z", -90.0)]
        .map(|(axis, scale)| (axis, "\u{b5}g", scale));
    Report {
        title: "Sample of the report: made-up curves".into(),
        results: Results { schema: 3, scenario: "sample".into(), seed: 42, rows: rows(), device: None },
        set_up: [
            ("scenario", "sample, 22 min of free-inertial navigation"),
            ("IMU", "ring laser gyros, 200 Hz; bias 0.8 deg/h, random walk 0.005 deg/sqrt(h)"),
            ("alignment", "480 s at rest, heading from gyrocompassing"),
            ("network", "locally recurrent, 6-8-6, f32"),
            ("command", "host-sim run --scenario sample --seed 42 --out out"),
        ]
        .map(|(label, value)| (label.to_owned(), value.to_owned()))
        .to_vec(),
        notes: vec![
            "Alignment is the coarse one; its heading error of 2.1 arc minutes is common to all schemes.".into(),
            "The accelerometer correction was left at zero: the teacher's residual did not fall on held-back data.".into(),
        ],
        curves: Curves {
        track: std::iter::once(path("reference", 0.0)).chain(SCHEMES.map(|(n, p)| path(n, p))).collect(),
        error_over_time: SCHEMES.map(error).to_vec(),
        learning: vec![
            learning("gyros: learned from", 0.01, &mut noise),
            learning("gyros: held back", 0.016, &mut noise),
            learning("accelerometers: learned from", 0.05, &mut noise),
            learning("accelerometers: held back", 0.11, &mut noise),
        ],
        traces: gyros.into_iter().chain(accels).map(|(a, u, s)| trace(a, u, s, &mut noise)).collect(),
        },
        bench: None,
    }
}
