//! Cars in traffic, trains, hand-held devices and standing vehicles against closed forms.

use super::*;
use crate::inertial::rotation::to_euler;
use crate::inertial::units::DEG;
use rand::SeedableRng;
use std::f64::consts::TAU;

const DT: f64 = 0.01;
const START: Geodetic = Geodetic {
    lat: 0.82,
    lon: 0.14,
    h: 400.0,
};

fn truth(vehicle: Vehicle, seed: u64, [standstill_s, drive_s, vibration]: [f64; 3]) -> Truth {
    let journey = Journey {
        start: START,
        heading: 2.1,
        standstill_s,
        drive_s,
        segments: None,
        vibration,
        dt: DT,
        epochs_per_s: 10,
    };
    vehicle.truth(&journey, &mut ChaCha8Rng::seed_from_u64(seed))
}

fn speeds(truth: &Truth) -> Vec<f64> {
    truth
        .epochs
        .iter()
        .map(|e| e.velocity.xy().norm())
        .collect()
}

fn share(of: &[f64], within: std::ops::Range<f64>) -> f64 {
    of.iter().filter(|x| within.contains(x)).count() as f64 / of.len() as f64
}

fn rms(of: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = of.fold((0.0, 0.0), |(sum, n), x| (sum + x * x, n + 1.0));
    (sum / n).sqrt()
}

/// The time in queues is the given share, and in them the car creeps for `creep / (creep + stop)`
/// of the time; departures of 5 s at most add little.
#[test]
fn a_car_in_traffic_creeps_for_its_share_of_the_time() {
    for queue_share in [0.3, 0.7] {
        let traffic = Traffic {
            queue_share,
            departure_s: 5.0,
            ..Traffic::default()
        };
        let (mut slow, mut creeping) = (0.0, 0.0);
        for seed in 0..6 {
            let all = speeds(&truth(Vehicle::Traffic(traffic), seed, [0.0, 7200.0, 0.0]));
            slow += share(&all, 0.0..1.001) / 6.0;
            creeping += share(&all, 0.005..1.001) / 6.0;
            assert!(all.iter().all(|v| *v < 1.3 * traffic.speed_mps));
        }
        // free stretches begin and end below 1 m/s too
        assert!((slow - queue_share - 0.02).abs() < 0.04, "{slow}");
        let want = traffic.creep_s / (traffic.creep_s + traffic.stop_s);
        assert!((creeping / slow - want).abs() < 0.06, "{creeping} {slow}");
    }
    // without queues it never creeps but to start and stop
    let free = Traffic {
        queue_share: 0.0,
        ..Traffic::default()
    };
    let all = speeds(&truth(Vehicle::Traffic(free), 1, [0.0, 3600.0, 0.0]));
    assert!(share(&all, 0.0..1.0) < 0.06);
}

/// A departure up to 0.5 m/s takes up to a minute, and creeping begins at a tenth of a metre a
/// second: a detection of standstill must not take it for one.
#[test]
fn departures_are_slow_and_creeping_is_slower() {
    let vehicle = Vehicle::Traffic(Traffic {
        queue_share: 1.0,
        ..Traffic::default()
    });
    let all = speeds(&truth(vehicle, 3, [0.0, 7200.0, 0.0]));
    let (mut longest, mut run) = (0, 0);
    for pair in all.windows(2) {
        run = if pair[1] > pair[0] { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    assert!((350..=600).contains(&longest), "{longest}");
    let held = all
        .windows(20)
        .filter(|w| w[0] > 0.09 && w.iter().all(|v| *v == w[0]));
    let held: Vec<f64> = held.map(|w| w[0]).collect();
    let slowest = held.iter().copied().fold(f64::INFINITY, f64::min);
    let fastest = held.iter().copied().fold(0.0, f64::max);
    assert!((0.1..0.13).contains(&slowest) && (0.8..=1.0).contains(&fastest));
    // log-uniform: half of the creeps are slower than the geometric mean
    let half = share(&held, 0.0..0.1_f64.sqrt());
    assert!((half - 0.5).abs() < 0.12, "{half}");
}

/// The road shakes by 0.04 + 0.96 v / (v + 8 m/s) of its full amplitude; a car in a town without
/// calm stops is shaken alike at any speed.
#[test]
fn a_standing_car_is_hardly_shaken_if_its_stops_are_calm() {
    let traffic = Vehicle::Traffic(Traffic {
        queue_share: 0.0,
        ..Traffic::default()
    });
    let city = |calm_stops| {
        Vehicle::City(City {
            reverse_first: false,
            calm_stops,
            ..City::default()
        })
    };
    for (vehicle, calm) in [(traffic, true), (city(true), true), (city(false), false)] {
        let truth = truth(vehicle, 5, [300.0, 900.0, 1.0]);
        let vertical = |range: std::ops::Range<usize>| {
            rms(truth.increments[range]
                .windows(2)
                .map(|w| w[1].dv.z - w[0].dv.z))
        };
        let at_rest = vertical(100..29_900);
        let all = speeds(&truth);
        let first = (3100..all.len() - 50).find(|k| all[k - 20..k + 20].iter().all(|v| *v > 8.0));
        let k = first.unwrap();
        let driving = vertical(10 * (k - 20)..10 * (k + 20));
        let want = match calm {
            true => 0.04 / (0.04 + 0.96 * all[k] / (all[k] + 8.0)),
            false => 1.0,
        };
        let ratio = at_rest / driving;
        assert!(
            (ratio / want - 1.0).abs() < 0.3,
            "{vehicle:?}: {ratio} {want}"
        );
    }
}

/// In the steady part of a curve, with the radius from the path: the roll is that of the cant, and
/// the lateral force is the part that the cant leaves, `v^2/R cos(roll) - g sin(roll)`.
#[test]
fn a_train_in_a_curve_has_cant_and_its_deficiency() {
    for train in [
        Train::default(),
        Train {
            speed_mps: 25.0,
            radius_m: 300.0,
            cant_mm: 100.0,
            ..Train::default()
        },
        Train {
            cant_mm: 0.0,
            ..Train::default()
        },
    ] {
        let truth = truth(Vehicle::Train(train), 2, [0.0, 3600.0, 0.0]);
        let (mut steady, mut tightest) = (0, f64::INFINITY);
        for k in 10..truth.epochs.len() - 10 {
            let around: [_; 5] = std::array::from_fn(|i| &truth.epochs[k + 5 * i - 10]);
            let course = around.map(|e| e.velocity.y.atan2(e.velocity.x));
            let turned = |i: usize| (course[i + 1] - course[i] + 3.0 * TAU / 2.0) % TAU - TAU / 2.0;
            let (rate, v) = (turned(1) / 0.5, around[2].velocity.norm());
            let even = (0..4).all(|i| (turned(i) / 0.5 - rate).abs() < 1e-4);
            if !even || rate.abs() < 2e-3 || (v - train.speed_mps).abs() > 1e-6 {
                continue;
            }
            steady += 1;
            let radius = v / rate;
            tightest = tightest.min(radius.abs());
            let (roll, _, _) = to_euler(&around[2].q_bn);
            let whole_mm = 1500.0 * v * v / (9.806_65 * radius);
            let cant_mm = 1500.0 * roll.sin();
            let want = whole_mm * train.cant_mm / (train.cant_mm + 110.0);
            assert!((cant_mm - want).abs() < 0.3, "{cant_mm} {want}");
            assert!(cant_mm.abs() < train.cant_mm + 0.3);
            let force = truth.increments[10 * k].dv.y / DT;
            let want = v * v / radius * roll.cos() - 9.806_65 * roll.sin();
            // with Coriolis, 2 w v = 6 mm/s2
            assert!((force - want).abs() < 0.02, "{force} {want}");
            assert!(1500.0 * force.abs() / 9.806_65 < 114.0);
        }
        assert!(steady > 500, "{steady}");
        let least = 1500.0 * train.speed_mps.powi(2) / (9.806_65 * (train.cant_mm + 110.0));
        let least = least.max(train.radius_m);
        assert!(
            (0.99..3.0).contains(&(tightest / least)),
            "{tightest} {least}"
        );
    }
}

#[test]
fn a_train_stops_at_stations_unless_it_never_does() {
    let never = Train {
        stop_every_s: 0.0,
        ..Train::default()
    };
    let all = speeds(&truth(Vehicle::Train(never), 2, [0.0, 3600.0, 0.0]));
    assert!(all.iter().all(|v| (v - 40.0).abs() < 0.1));
    let all = speeds(&truth(
        Vehicle::Train(Train::default()),
        2,
        [100.0, 7200.0, 0.0],
    ));
    let starts = all
        .windows(2)
        .filter(|w| w[0] < 1e-6 && w[1] >= 1e-6)
        .count();
    // every 480 s of travel, 75 s to brake or start with each, 125 s to stand and 150 s to start
    assert!((8..=15).contains(&starts), "{starts}");
}

/// Amplitude of a sinusoid of `hz` in samples.
fn amplitude(samples: &[f64], hz: f64) -> f64 {
    let (mut s, mut c) = (0.0, 0.0);
    for (k, x) in samples.iter().enumerate() {
        let (sin, cos) = (TAU * hz * (k as f64 + 0.5) * DT).sin_cos();
        (s, c) = (s + x * sin, c + x * cos);
    }
    2.0 * f64::hypot(s, c) / samples.len() as f64
}

/// Frequency of the largest amplitude between two frequencies.
fn peak(samples: &[f64], [low, high]: [f64; 2]) -> f64 {
    let steps = ((high - low) / 0.01) as usize;
    let all = (0..=steps).map(|k| low + 0.01 * k as f64);
    let size = |hz: &f64| amplitude(samples, *hz);
    all.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap()
}

/// The vertical force has the frequency and the size of the steps, that to the sides half of the
/// frequency.
#[test]
fn steps_are_in_the_spectrum_of_a_walk() {
    for (step_hz, step_g) in [(1.8, 0.3), (2.2, 0.4)] {
        let walk = HandHeld {
            step_hz,
            step_g,
            swing_deg: 0.0,
            pauses: false,
            ..HandHeld::default()
        };
        let truth = truth(Vehicle::HandHeld(walk), 1, [0.0, 120.0, 0.0]);
        let force = |axis: usize| -> Vec<f64> {
            let walking = &truth.increments[1000..];
            walking.iter().map(|i| i.dv[axis] / DT).collect()
        };
        let (sideways, vertical) = (force(1), force(2));
        let (found, of_pairs) = (peak(&vertical, [0.5, 4.0]), peak(&sideways, [0.6, 4.0]));
        assert!((found - step_hz).abs() < 0.015, "{found}");
        assert!((of_pairs - 0.5 * step_hz).abs() < 0.015, "{of_pairs}");
        let pace = speeds(&truth)[100..].iter().sum::<f64>() / (truth.epochs.len() - 100) as f64;
        let size = amplitude(&vertical, step_hz) / 9.806_65;
        assert!(
            (size / (step_g * pace / 1.3) - 1.0).abs() < 0.1,
            "{size} {pace}"
        );
    }
}

/// It lies for the standstill, then it pauses while the hand still swings, with the given
/// amplitude.
#[test]
fn a_hand_swings_also_in_pauses() {
    let walk = HandHeld {
        swing_deg: 25.0,
        step_g: 0.0,
        ..HandHeld::default()
    };
    let truth = truth(Vehicle::HandHeld(walk), 4, [100.0, 7200.0, 0.0]);
    let lying = &truth.epochs[..=1000];
    assert!(lying.iter().all(|e| e.velocity.norm() < 1e-9));
    assert!(
        lying
            .iter()
            .all(|e| e.q_bn.angle_to(&truth.epochs[0].q_bn) < 1e-9)
    );
    let paused: Vec<&NavState> = truth.epochs[2000..]
        .iter()
        .filter(|e| e.velocity.norm() < 1e-6)
        .collect();
    let share = paused.len() as f64 / truth.epochs.len() as f64;
    assert!((0.1..0.3).contains(&share), "{share}");
    // the pitch is turned before the roll, so Euler angles are the swings
    let pitch = rms(truth.epochs[2000..].iter().map(|e| to_euler(&e.q_bn).1)) / DEG;
    let at_rest = rms(paused.iter().map(|e| to_euler(&e.q_bn).1)) / DEG;
    assert!((pitch - 25.0).abs() < 1.5, "{pitch}");
    assert!((at_rest - 25.0).abs() < 4.0, "{at_rest}");
}

#[test]
fn a_standing_vehicle_rocks_and_never_moves() {
    let standing = Standing {
        rock_deg: 0.05,
        sway_mps: 0.003,
    };
    let truth = truth(Vehicle::Standing(standing), 6, [300.0, 6900.0, 0.0]);
    // a sinusoid of the longest period, 40 s, has an amplitude of 0.027 m; there are twelve of them
    let off = |e: &NavState| e.position.ned_from(&START);
    let furthest = truth.epochs.iter().map(|e| off(e).norm());
    assert!(furthest.fold(0.0, f64::max) < 0.15);
    let mean = |of: &[NavState]| of.iter().map(off).sum::<Vector3<f64>>() / of.len() as f64;
    let (first, last) = (mean(&truth.epochs[..20_000]), mean(&truth.epochs[52_000..]));
    assert!((last - first).norm() < 2e-3, "{first} {last}");
    for axis in 0..3 {
        let sway = rms(truth.epochs.iter().map(|e| e.velocity[axis]));
        assert!((sway / 0.003 - 1.0).abs() < 0.05, "{sway}");
    }
    let roll = rms(truth.epochs.iter().map(|e| to_euler(&e.q_bn).0)) / DEG;
    assert!((roll / 0.05 - 1.0).abs() < 0.05, "{roll}");
}
