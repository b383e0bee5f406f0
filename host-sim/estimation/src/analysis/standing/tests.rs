use super::*;
use crate::analysis::allan::at_rest;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG_PER_H, UG};
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_unit::Unit;

const SITE: Geodetic = Geodetic {
    lat: std::f64::consts::FRAC_PI_4,
    lon: 0.0,
    h: 0.0,
};

/// A unit at rest at 45 degrees.
fn log(spec: &ImuSpec, seconds: u32, seed: u64) -> Log {
    let columns = at_rest(spec, seconds, seed).unwrap();
    let mut log = Log::of_columns(format!("log-{seed}.csv"), columns, vec![]).unwrap();
    log.site = Some(SITE);
    log
}

fn spec(preset: &str, rate_hz: u32) -> ImuSpec {
    let mut spec = Unit::preset(preset).unwrap().simulated();
    spec.rate_hz = rate_hz;
    spec.error_model(ErrorModelName::Linear)
}

/// Adds to the samples from a time to another.
fn add(log: &mut Log, from_s: f64, to_s: f64, f: impl Fn(usize) -> Increment) {
    let rate = log.rate_hz;
    log.samples.edit(|all| {
        for (k, sample) in all.iter_mut().enumerate() {
            let t = k as f64 / rate;
            if t >= from_s && t < to_s {
                let more = f(k);
                sample.dtheta += more.dtheta;
                sample.dv += more.dv;
            }
        }
    });
}

fn tilt(rate: f64) -> impl Fn(usize) -> Increment {
    move |k| Increment {
        dtheta: Vector3::x() * (0.02 / rate) * (k as f64 / rate).sin(),
        dv: Vector3::y() * (0.3 / rate) * (k as f64 / rate).sin(),
    }
}

/// The rate of a log is that of its samples, also where stamps of 1 ms show steps of 2 and 3 ms,
/// and where a part is missing.
#[test]
fn the_rate_of_a_log_is_that_of_its_samples() {
    use host_io::recordings::record::{Kind, Record};
    for (rate, decimals) in [(400.0, 3), (800.0, 3), (100.0, 2)] {
        let kept = (1..40_000).filter(|k| !(20_000..25_000).contains(k));
        let stamp = |k| format!("{:.decimals$}", f64::from(k) / rate);
        let time: Vec<f64> = kept.map(|k| stamp(k).parse().unwrap()).collect();
        let sample = Increment {
            dtheta: Vector3::z() * 0.5,
            dv: Vector3::z() * -9.8,
        };
        let record = Record {
            samples: time.iter().map(|_| sample).collect(),
            time: time.into(),
            kind: Kind::Rate,
            ..Record::default()
        };
        let log = Log::of_record(&record);
        assert!((log.rate_hz / rate - 1.0).abs() < 1e-9, "{}", log.rate_hz);
        let begins: Vec<usize> = log.begins.iter().map(|(k, _)| *k).collect();
        assert_eq!(begins, [0, 19_999], "{rate}");
        let force = log.samples.start().unwrap().dv.z * rate;
        assert!((force / -9.8 - 1.0).abs() < 1e-4, "{force}");
    }
}

#[test]
fn all_of_a_quiet_log_is_at_rest_whatever_the_sensor() {
    for preset in host_unit::presets::names() {
        let found = rests(&log(&spec(preset, 50), 300, 3), LEAST_S);
        assert!(found.moves.is_empty(), "{preset}: {:?}", found.moves);
        assert_eq!(found.stretches.len(), 1, "{preset}");
        assert!(
            (found.stretches[0].seconds() - 300.0).abs() < 0.1,
            "{preset}"
        );
    }
}

#[test]
fn a_move_is_found_where_it_is_and_left_out() {
    for preset in ["mems", "stim300", "medium", "icm-42688"] {
        let mut log = log(&spec(preset, 50), 400, 4);
        add(&mut log, 150.0, 170.0, tilt(50.0));
        let found = rests(&log, LEAST_S);
        let [first, second] = &found.stretches[..] else {
            panic!("{preset}: {found:?}");
        };
        assert!((145.0..151.0).contains(&first.to_s), "{preset}: {first:?}");
        assert!(
            (169.0..175.0).contains(&second.from_s),
            "{preset}: {second:?}"
        );
        let shown = shown(&[log]).unwrap();
        let noted = shown
            .notes
            .iter()
            .any(|n| n.contains("it moves") && n.contains("only its rests"));
        assert!(noted, "{preset}: {:?}", shown.notes);
    }
}

#[test]
fn a_slow_tilt_is_a_move() {
    let mut log = log(&spec("mems", 50), 600, 4);
    // 0.02 deg/s for two minutes
    add(&mut log, 200.0, 320.0, |k| {
        let angle = 0.02 * DEG * (k as f64 / 50.0 - 200.0);
        Increment {
            dtheta: Vector3::x() * (0.02 * DEG / 50.0),
            dv: Vector3::y() * (G0 * angle.sin() / 50.0),
        }
    });
    let found = rests(&log, LEAST_S);
    let within = |s: &&Stretch| s.from_s < 290.0 && s.to_s > 230.0;
    assert!(!found.stretches.iter().any(|s| within(&s)), "{found:?}");
}

#[test]
fn a_steady_turn_is_no_rest() {
    let mut log = log(&spec("mems", 50), 400, 4);
    add(&mut log, 150.0, 250.0, |_| Increment {
        dtheta: Vector3::z() * (10.0 * DEG / 50.0),
        dv: Vector3::zeros(),
    });
    let found = rests(&log, LEAST_S);
    assert_eq!(found.stretches.len(), 2, "{found:?}");
    assert!(
        found.moves.iter().any(|m| (m.rate_dps - 10.0).abs() < 0.1),
        "{found:?}"
    );
}

#[test]
fn a_log_that_moves_throughout_is_refused_with_the_place() {
    let mut log = log(&spec("stim300", 50), 400, 4);
    add(&mut log, 0.0, 400.0, |k| {
        let t = k as f64 / 50.0;
        Increment {
            dtheta: Vector3::z() * (0.05 * (0.3 * t).sin() / 50.0),
            dv: Vector3::x() * ((0.7 * t).sin() / 50.0),
        }
    });
    let error = shown(&[log]).unwrap_err().to_string();
    for part in [
        "log-4.csv: is not at rest",
        "first at 0.0 s",
        "60 s at rest are needed",
    ] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_gap_ends_a_rest() {
    let mut log = log(&spec("stim300", 50), 200, 4);
    log.begins.push((2500, 80.0));
    let found = rests(&log, 40.0);
    assert_eq!(found.gaps, [80.0]);
    assert_eq!(found.stretches.len(), 2, "{found:?}");
    assert!(found.stretches[0].to_s < 51.0 && found.stretches[1].from_s > 79.0);
}

/// The numbers of simulated units hold the truth of each, and are not far above it.
#[test]
fn the_numbers_hold_the_simulated_units_own_errors() {
    let preset = Unit::preset("stim300").unwrap();
    let (mut held, mut all) = ([0; 2], 0);
    for unit in 0..10 {
        let mut spec = spec("stim300", 20);
        spec.gyro.bias_turn_on_dph = 8.0;
        let logs: Vec<Log> = (0..4).map(|n| log(&spec, 900, 10 * unit + n)).collect();
        let shown = shown(&logs).unwrap();
        let sheet = sheet(&shown, "stim300", &preset);
        let of = |key: &str| sheet.numbers.iter().find(|n| n.key == key).unwrap();
        all += 1;
        let turn_on = of("gyro.bias_turn_on_dph");
        held[0] += usize::from((8.0..40.0).contains(&turn_on.value));
        let white = of("gyro.angle_random_walk_dpsqrth");
        held[1] += usize::from((0.15..0.17).contains(&white.value));
        assert!(white.source.starts_with("measured: 0.1"), "{white:?}");
        assert!(shown.gyro_scatter.unwrap().degrees == 9);
    }
    // the noise's upper end is that of the largest of three axes
    println!("{held:?} of {all}");
    assert!(held[0] >= 9 && held[1] >= 9, "{held:?}");
}

#[test]
fn the_nearest_preset_is_that_of_the_simulation() {
    for name in ["stim300", "icm-42688", "hg9900"] {
        let shown = shown(&[log(&spec(name, 100), 600, 2)]).unwrap();
        let near = Unit::preset(nearest(&shown)).unwrap();
        let own = Unit::preset(name).unwrap();
        let ratio = near.gyro.angle_random_walk_dpsqrth / own.gyro.angle_random_walk_dpsqrth;
        assert!((0.5..2.0).contains(&ratio), "{name}: {}", nearest(&shown));
    }
}

/// Temperature in steps over logs and a slope within one: both come out.
#[test]
fn a_temperature_law_comes_out_of_a_log() {
    let mut log = log(&spec("stim300", 20), 3600, 5);
    let slope = 2.0 * DEG_PER_H;
    let celsius = |t: f64| 20.0 + 15.0 * t / 3600.0;
    log.temperature = Some(Temperature::Seconds(
        0.0,
        (0..3600).map(|k| celsius(f64::from(k))).collect(),
    ));
    add(&mut log, 0.0, 3600.0, |k| Increment {
        dtheta: Vector3::y() * (slope * 15.0 * (k as f64 / 20.0) / 3600.0 / 20.0),
        dv: Vector3::z() * (-200.0 * UG * 15.0 * (k as f64 / 20.0) / 3600.0 / 20.0),
    });
    let shown = shown(&[log]).unwrap();
    let law = shown.gyro_law.unwrap();
    assert!(
        law.within && (law.range_degc[1] - 34.9).abs() < 0.3,
        "{law:?}"
    );
    let off = (law.per_k - Vector3::y() * slope) / DEG_PER_H;
    println!(
        "{:?} off by {off:?}, sigma {:?}",
        law.per_k / DEG_PER_H,
        law.sigma / DEG_PER_H
    );
    for i in 0..3 {
        assert!(
            off[i].abs() < 4.0 * law.sigma[i] / DEG_PER_H && off[i].abs() < 0.3,
            "{off:?}"
        );
    }
    let accel = shown.accel_law.unwrap().per_k.x / UG;
    assert!((accel - 200.0).abs() < 20.0, "{accel}");
}
