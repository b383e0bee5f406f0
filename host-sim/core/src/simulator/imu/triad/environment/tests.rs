//! Each error of the environment against its closed form.

use super::super::super::tests::perfect;
use super::super::super::world::{Power, StartName};
use super::super::super::{BlockSpec, Imu, ImuSpec};
use super::*;
use crate::inertial::sins::Increment;
use crate::inertial::units::{DEG, DEG_PER_H, G0, UG};

/// Surroundings with this temperature at all axes, K.
pub(super) fn at(temperature: f64) -> Surroundings {
    Surroundings {
        axes: Vector3::repeat(temperature),
        ..Surroundings::default()
    }
}

/// The default conditions of files that do not give them.
pub(super) fn sizes() -> Sizes {
    Sizes {
        hysteresis_width: 5.0,
        warm_up_time: 1200.0,
        warm_up_spread: 0.3,
        warm_up_exponent: 0.6,
        mode_width: 22.6,
        softening_width: 3.0,
        lag_time: 1200.0,
        shaken_knee: 0.2,
        turned_time: 300.0,
        ..Sizes::default()
    }
}

pub(super) fn of(
    sizes: &Sizes,
    unit: u64,
    turning_points: &[f64],
    history: History,
) -> Environment {
    let turning_points: Vec<_> = turning_points.iter().map(|t| Vector3::repeat(*t)).collect();
    let begin = Beginning {
        unit: (unit, 11),
        turn_on: stream(7, 11),
        history,
        age_days: 0.0,
        power_ons: 0,
        turning_points: &turning_points,
        trail: &[],
    };
    Environment::new(sizes, begin).unwrap()
}

/// The loop of a play operator between -A and A has the area 4 h (A - w).
#[test]
fn hysteresis_is_a_loop_of_known_area() {
    let s = Sizes {
        hysteresis: 0.3,
        ..sizes()
    };
    let mut e = of(&s, 3, &[0.0], History::COLD);
    let (amplitude, n) = (20.0, 4000);
    let cycle: Vec<f64> = (0..=4 * n)
        .map(|k| {
            let quarter = f64::from(k) / f64::from(n);
            amplitude
                * if quarter <= 2.0 {
                    quarter - 1.0
                } else {
                    3.0 - quarter
                }
        })
        .collect();
    let mut area = 0.0;
    for _ in 0..2 {
        let biases: Vec<f64> = cycle.iter().map(|t| e.step(0.0, &at(*t)).x).collect();
        let steps = cycle.windows(2).zip(biases.windows(2));
        area = steps
            .map(|(t, b)| (t[1] - t[0]) * 0.5 * (b[0] + b[1]))
            .sum::<f64>();
    }
    let h = e.hysteresis.x;
    assert!(
        h != 0.0 && (area / (4.0 * h * 15.0) - 1.0).abs() < 1e-6,
        "{area} {h}"
    );
}

/// After a warm period the loop is on its cooling side at power-on; after a cold start it is in the
/// middle.
#[test]
fn hysteresis_remembers_the_time_before_power_on() {
    let s = Sizes {
        hysteresis: 0.3,
        ..sizes()
    };
    let first = |turning_points: &[f64]| {
        let mut e = of(&s, 3, turning_points, History::COLD);
        let now = at(turning_points[turning_points.len() - 1]);
        e.step(0.0, &now).component_div(&e.hysteresis)
    };
    assert_eq!(first(&[-12.0]), Vector3::zeros());
    assert!((first(&[0.0, 30.0, 12.0]) + Vector3::repeat(1.0)).amax() < 1e-12);
    assert!((first(&[0.0, 30.0, 28.0]) - Vector3::repeat(0.6)).amax() < 1e-12);
}

/// At tau the warm-up has fallen to 1/e; the slope of ln(-ln b) over ln t is beta; and each axis of
/// each unit has a tau of its own with the given spread.
#[test]
fn the_warm_up_is_a_stretched_exponential_with_a_time_for_each_axis() {
    let s = Sizes {
        warm_up: 0.2,
        ..sizes()
    };
    let mut logs = vec![];
    for unit in 0..500 {
        let mut e = of(&s, unit, &[0.0], History::COLD);
        let mut part = |t: f64| e.step(t, &at(0.0)).component_div(&e.warm_up.clone());
        assert!((part(0.0) - Vector3::repeat(1.0)).amax() < 1e-12);
        let [at_1, at_100] = [1.0, 100.0].map(|t| part(t).map(|x| (-x.ln()).ln()));
        let slope = (at_100 - at_1) / 100f64.ln();
        assert!((slope - Vector3::repeat(0.6)).amax() < 1e-9);
        logs.extend(at_1.iter().map(|x| -x / 0.6)); // ln tau
    }
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    let spread = (logs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!((mean - 1200f64.ln()).abs() < 0.03, "{}", mean.exp());
    assert!((spread / 0.3 - 1.0).abs() < 0.06, "{spread}");
}

#[test]
fn a_hot_start_has_little_of_the_warm_up() {
    let s = Sizes {
        warm_up: 0.2,
        ..sizes()
    };
    let cold = of(&s, 3, &[0.0], History::COLD);
    let history = History::warm(7200.0, 60.0);
    let hot = of(&s, 3, &[0.0], history);
    for i in 0..3 {
        let time = cold.warm_up_time[i];
        let want = 1.0 - (1.0 - (-7200.0 / time).exp()) * (-60.0 / time).exp();
        assert!((hot.warm_up[i] / cold.warm_up[i] - want).abs() < 1e-12 && want < 0.5);
    }
}

/// From -226 K to 226 K the path passes 20 modes. On the way back each mode has the bias that it
/// had, and the control hops later by twice the 0.1 that it holds beyond the middle.
#[test]
fn path_length_control_hops_at_every_mode_and_back_later() {
    let s = Sizes {
        mode_bias: 1.0,
        ..sizes()
    };
    let mut e = of(&s, 3, &[-226.0], History::COLD);
    let mut sweep = |temperatures: &mut dyn Iterator<Item = i32>| {
        let mut hops = vec![];
        let mut last = None;
        for t in temperatures {
            let t = f64::from(t) * 0.01;
            let bias = e.step(0.0, &at(t)).x;
            if last.is_some_and(|last| last != bias) {
                hops.push((t, bias));
            }
            last = Some(bias);
        }
        hops
    };
    let up = sweep(&mut (-22_600..=22_600));
    let mut down = sweep(&mut (-22_600..=22_600).rev());
    down.reverse();
    assert!(up.len().abs_diff(20) <= 1 && down.len().abs_diff(20) <= 1);
    for pair in up.windows(2) {
        assert!((pair[1].0 - pair[0].0 - 22.6).abs() < 0.02 && pair[0].1 != pair[1].1);
    }
    let near = |t: f64| up.iter().find(|(at, _)| (at - t - 0.2 * 22.6).abs() < 0.03);
    let delayed = down.iter().filter_map(|(t, _)| near(*t)).count();
    assert!(delayed + 2 >= down.len(), "{delayed} of {}", down.len());
    // the bias below a hop on the way down is that of the mode below on the way up
    let below: Vec<f64> = up.iter().map(|(_, bias)| *bias).collect();
    assert!(down[1..].iter().all(|(_, bias)| below.contains(bias)));
}

#[test]
fn the_deflection_makes_a_sawtooth() {
    let s = Sizes {
        mode_deflection: 1.0,
        ..sizes()
    };
    let mut e = of(&s, 3, &[0.0], History::COLD);
    let size = e.deflection.y;
    let bias: Vec<f64> = (0..20_000)
        .map(|k| e.step(0.0, &at(f64::from(k) * 0.01)).y / size)
        .collect();
    let (low, high) = bias
        .iter()
        .fold((0.0f64, 0.0f64), |(l, h), b| (l.min(*b), h.max(*b)));
    assert!(
        (high - 0.6).abs() < 1e-3 && (low + 0.5).abs() < 0.11,
        "{low} {high}"
    );
    let jumps = bias
        .windows(2)
        .filter(|b| (b[1] - b[0] + 1.0).abs() < 1e-3)
        .count();
    assert!((8..=9).contains(&jumps), "{jumps}"); // 200 K are 8.8 modes
}

fn error(spec: &ImuSpec, unit: u64, rate: Vector3<f64>, force: Vector3<f64>) -> Increment {
    let mut imu = Imu::new(spec, unit, 2);
    let dt = 1.0 / f64::from(spec.rate_hz);
    let (_, e) = imu.measure(&Increment {
        dtheta: rate * dt,
        dv: force * dt,
    });
    Increment {
        dtheta: e.dtheta / dt,
        dv: e.dv / dt,
    }
}

#[test]
fn the_scale_factor_is_proportional_to_temperature_and_input() {
    let mut spec = perfect();
    spec.block = BlockSpec::default();
    spec.gyro.environment.scale_temperature_ppmpk = 10.0;
    spec.accel.environment.scale_temperature_ppmpk = 10.0;
    let mut at = |kelvin: f64, x: f64| {
        spec.world.ambient.offset_k = kelvin;
        error(&spec, 1, Vector3::repeat(x * DEG), Vector3::repeat(x * G0))
    };
    let (one, other) = (at(10.0, 1.0), at(-30.0, 2.0));
    assert_eq!(at(0.0, 5.0), Increment::default());
    let ppm_per_k = one.dtheta / (DEG * 10.0) * 1e6;
    assert!(
        ppm_per_k.amin() > 0.0 && ppm_per_k.amax() < 40.0,
        "{ppm_per_k}"
    );
    assert!((other.dtheta + one.dtheta * 6.0).norm() < 1e-9 * one.dtheta.norm());
    assert!((other.dv + one.dv * 6.0).norm() < 1e-9 * one.dv.norm());
    assert_ne!(one.dtheta.x * G0, one.dv.x * DEG);
}

#[test]
fn g_square_sensitivity_is_even_and_quadratic() {
    let mut spec = perfect();
    spec.gyro.environment.g_square_dphpg2 = 0.5;
    let at = |force: Vector3<f64>| error(&spec, 1, Vector3::zeros(), force * G0).dtheta / DEG_PER_H;
    let x = at(Vector3::x());
    assert!(
        (at(-Vector3::x()) - x).norm() < 1e-9 && (at(Vector3::x() * 3.0) - x * 9.0).norm() < 1e-9
    );
    assert!((at(Vector3::new(1.0, 2.0, 0.0)) - x - at(Vector3::y()) * 4.0).norm() < 1e-9);
    let squares = (0..400).map(|unit| {
        let force = Vector3::z() * G0;
        error(&spec, unit, Vector3::zeros(), force)
            .dtheta
            .norm_squared()
    });
    let sigma = (squares.sum::<f64>() / 1200.0).sqrt() / DEG_PER_H;
    assert!((sigma / 0.5 - 1.0).abs() < 0.08, "{sigma}");
}

/// A random walk of the unit: its spread grows with the root of the age, and a later turn-on goes
/// on from an earlier one.
#[test]
fn ageing_is_a_random_walk_of_the_unit() {
    let mut spec = perfect();
    spec.gyro.environment.ageing_dphpsqrtyr = 0.2;
    spec.accel.environment.ageing_ugpsqrtyr = 50.0;
    let mut at = |unit, years: f64| {
        spec.world.power = Power {
            age_days: years * 365.25,
            ..Power::default()
        };
        let e = error(&spec, unit, Vector3::zeros(), Vector3::zeros());
        (e.dtheta / DEG_PER_H, e.dv / UG)
    };
    assert_eq!(at(1, 0.0).0, Vector3::zeros());
    let mut sums = [0.0; 3];
    for unit in 0..300 {
        let [(one, accel), (four, _)] = [1.0, 4.0].map(|years| at(unit, years));
        sums[0] += one.norm_squared() / 900.0;
        sums[1] += (four - one).norm_squared() / 900.0;
        sums[2] += accel.norm_squared() / 900.0;
    }
    let ratios = [
        sums[0].sqrt() / 0.2,
        (sums[1] / 3.0).sqrt() / 0.2,
        sums[2].sqrt() / 50.0,
    ];
    assert!(ratios.iter().all(|r| (r - 1.0).abs() < 0.08), "{ratios:?}");
}

/// At one power-on in ten the bias of a unit steps, and stays there.
#[test]
fn steps_stay() {
    let mut spec = perfect();
    spec.gyro.environment.step_dph = 0.2;
    spec.accel.environment.step_ug = 50.0;
    let mut at = |unit, power_ons| {
        spec.world.power.power_ons = power_ons;
        let e = error(&spec, unit, Vector3::zeros(), Vector3::zeros());
        [e.dtheta / DEG_PER_H / 0.2, e.dv / UG / 50.0]
    };
    assert_eq!(at(1, 0), [Vector3::zeros(); 2]);
    let (mut steps, mut squares) = ([0.0; 2], [0.0; 2]);
    for unit in 0..200 {
        for number in 0..10 {
            let (before, after) = (at(unit, number), at(unit, number + 1));
            for triad in 0..2 {
                let step = (after[triad] - before[triad]).norm_squared();
                steps[triad] += f64::from(u8::from(step > 1e-12));
                squares[triad] += step / 3.0;
            }
        }
    }
    for triad in 0..2 {
        let (share, size) = (steps[triad] / 2000.0, squares[triad] / steps[triad]);
        assert!((share - 0.1).abs() < 0.02, "{share}");
        assert!((size.sqrt() - 1.0).abs() < 0.1, "{size}");
    }
}

/// Switching an error on does not change the draws of others, those of the environment included.
#[test]
fn each_error_alone_is_its_part_of_all_together() {
    let mut all = ImuSpec::preset("medium").unwrap();
    let plain = all.clone();
    all.world.power = Power {
        start: StartName::Hot,
        age_days: 100.0,
        power_ons: 40,
        ..Power::default()
    };
    let warm = ImuSpec {
        world: all.world.clone(),
        ..plain
    };
    type Set = fn(&mut ImuSpec);
    let sets: [Set; 10] = [
        |s| s.gyro.environment.hysteresis_dph = 0.1,
        |s| s.gyro.environment.stretched_warm_up_dph = 0.1,
        |s| s.gyro.environment.mode_hop_dph = 0.1,
        |s| s.gyro.environment.ageing_dphpsqrtyr = 0.1,
        |s| s.gyro.environment.step_dph = 0.1,
        |s| s.gyro.environment.scale_temperature_ppmpk = 10.0,
        |s| s.gyro.environment.softening_dph = 0.1,
        |s| s.gyro.environment.thermal_lag_dph = 0.1,
        |s| s.gyro.environment.vibration_saturation_dph = 0.1,
        |s| s.gyro.environment.self_heating_dphpdps = 0.1,
    ];
    sets.iter().for_each(|set| set(&mut all));
    let last = |spec: &ImuSpec| {
        let mut imu = Imu::new(spec, 5, 6);
        let shaken = |k: i32| Increment {
            dtheta: Vector3::zeros(),
            dv: Vector3::z() * (f64::from(k % 2) * 1e-3),
        };
        (0..20_000)
            .map(|k| imu.measure(&shaken(k)).1.dtheta)
            .last()
            .unwrap()
    };
    let nothing = last(&warm);
    let parts = sets.iter().map(|set| {
        let mut spec = warm.clone();
        set(&mut spec);
        last(&spec) - nothing
    });
    let sum: Vector3<f64> = parts.sum();
    let together = last(&all) - nothing;
    assert!(together.norm() > 0.0 && (sum - together).norm() < 1e-9 * together.norm());
}
