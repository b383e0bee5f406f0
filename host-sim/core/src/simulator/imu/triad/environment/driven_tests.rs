//! Softening, thermal lag, vibration and self-heating against their closed forms.

use super::super::super::heat::Heat;
use super::super::super::tests::perfect;
use super::super::super::world::{Power, StartName};
use super::super::super::{BlockSpec, ImuSpec, NodesSpec};
use super::tests::{at, of, sizes};
use super::*;
use crate::simulator::imu::environment::{AccelEnvironment, GyroEnvironment};

/// Half at the centre, and from 12 % to 88 % within two widths to each side.
#[test]
fn softening_is_a_sigmoid_about_its_centre() {
    let s = Sizes {
        softening: 0.2,
        softening_centre: 12.0,
        ..sizes()
    };
    let mut e = of(&s, 3, &[0.0], History::COLD);
    let whole = e.softening;
    let mut part = |t: f64| e.step(0.0, &at(t)).component_div(&whole).x;
    assert!((part(12.0) - 0.5).abs() < 1e-12);
    for (k, want) in [(-2.0, 0.119_202_922), (2.0, 0.880_797_078)] {
        assert!((part(12.0 + 3.0 * k) - want).abs() < 1e-9);
    }
    assert!(part(-500.0).abs() < 1e-12 && (part(500.0) - 1.0).abs() < 1e-12);
    assert!(whole.x != whole.y && whole.y != whole.z);
}

/// A step of the temperature reaches the inner point by 1 - exp(-t / tau). At +-10 K the sum and
/// the difference of the biases are the quadratic and the linear size.
#[test]
fn a_thermal_lag_follows_a_step_exponentially() {
    let s = Sizes {
        lag: 0.2,
        ..sizes()
    };
    let settled = |t: f64| {
        let mut e = of(&s, 3, &[t], History::COLD);
        (e.step(0.0, &at(t)), e.lag)
    };
    let ((warm, lag), (cold, _)) = (settled(10.0), settled(-10.0));
    assert!(((warm - cold) / 2.0 - lag[0]).norm() < 1e-12);
    assert!(((warm + cold) / 2.0 - lag[1]).norm() < 1e-12 && lag[0] != lag[1]);
    let mut e = of(&s, 3, &[0.0], History::COLD);
    for t in 0..=1200 {
        e.step(f64::from(t), &at(10.0));
    }
    assert!((e.inner.x - 10.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-9);
}

/// A block of the time constant 900 s, two hours on, a soak of 20 min: the solution of both
/// equations in series, by hand.
#[test]
fn the_inner_point_follows_the_time_before_power_on() {
    let mut spec = perfect();
    spec.block = BlockSpec {
        self_heating_k: 20.0,
        heating_time_s: 900.0,
        ..BlockSpec::default()
    };
    spec.world.power = Power {
        start: StartName::Warm,
        soak_s: Some(1200.0),
        ..Power::default()
    };
    let heat = Heat::new(&spec, 1, 2);
    let inner = lived(&heat.trail(), 600.0).unwrap().x;
    // x = 1 - (a exp(-t/a) - b exp(-t/b)) / (a - b) after a step
    let (a, b) = (900.0, 600.0);
    let step = |t: f64| 1.0 - (a * (-t / a).exp() - b * (-t / b).exp()) / (a - b);
    let want = 20.0 * (step(8400.0) - step(1200.0));
    assert!((inner / want - 1.0).abs() < 2e-3, "{inner} {want}");
    assert!(
        inner > heat.axes().x + 2.0,
        "it is warmer than its surroundings"
    );
}

/// The trail begins cold, passes the power-off, and ends now; nodes and block alike.
#[test]
fn the_trail_ends_at_power_on() {
    let mut spec = perfect();
    spec.block.self_heating_k = 20.0;
    for (start, nodes) in [
        (StartName::Warm, None),
        (StartName::Hot, None),
        (StartName::Warm, Some(NodesSpec::typical())),
        (StartName::Hot, Some(NodesSpec::typical())),
    ] {
        spec.nodes = nodes;
        spec.world.power.start = start;
        let heat = Heat::new(&spec, 1, 2);
        let (trail, turning_points) = (heat.trail(), heat.turning_points());
        assert!(trail.windows(2).all(|w| w[0].0 <= w[1].0));
        let (last, now) = (trail[trail.len() - 1], turning_points[2]);
        assert!(last.0 == 0.0 && (last.1 - now).norm() < 1e-9, "{start}");
        assert!((trail[0].1 - turning_points[0]).norm() < 1e-9);
        let off = |(_, axes): &(f64, Vector3<f64>)| (axes - turning_points[1]).norm() < 1e-9;
        assert!(trail.iter().any(off), "{start}");
    }
    spec.world.power.start = StartName::Cold;
    assert!(Heat::new(&spec, 1, 2).trail().is_empty());
}

#[test]
fn vibration_gives_half_at_its_knee_and_all_far_above() {
    let s = Sizes {
        shaken: 0.2,
        ..sizes()
    };
    let mut e = of(&s, 3, &[0.0], History::COLD);
    let whole = e.shaken;
    let mut part = |vibration: f64| {
        let around = Surroundings {
            vibration,
            ..at(0.0)
        };
        e.step(0.0, &around).component_div(&whole).x
    };
    let [none, half, most] = [0.0, 0.2, 2e3].map(&mut part);
    assert!(none == 0.0 && (half - 0.5).abs() < 1e-12 && (most - 1.0).abs() < 1e-3);
}

#[test]
fn self_heating_follows_the_rate_late() {
    let s = Sizes {
        turned: 2.0,
        ..sizes()
    };
    let mut e = of(&s, 3, &[0.0], History::COLD);
    let around = Surroundings {
        turning: 0.1,
        ..at(0.0)
    };
    let late: Vec<f64> = (0..=600)
        .map(|t| e.step(f64::from(t), &around).x / (0.1 * e.turned.x))
        .collect();
    for (t, want) in [(0, 0.0), (300, 0.632_120_558_8), (600, 0.864_664_716_8)] {
        assert!((late[t] - want).abs() < 1e-9, "{t}: {}", late[t]);
    }
}

/// Sizes are drawn for the unit; the shapes are the type's and the same for all units.
#[test]
fn shapes_belong_to_the_type() {
    let s = Sizes {
        softening: 0.2,
        lag: 0.2,
        shaken: 0.2,
        turned: 0.2,
        ..sizes()
    };
    let [a, b] = [3, 4].map(|unit| of(&s, unit, &[0.0], History::COLD));
    assert_eq!(a.sizes, b.sizes);
    assert!(a.softening != b.softening && a.lag != b.lag);
    assert!(a.shaken != b.shaken && a.turned != b.turned);
    let defaults = (GyroEnvironment::default(), AccelEnvironment::default());
    let (gyro, accel) = &defaults;
    assert_eq!(gyro.softening_centre_k, accel.softening_centre_k);
    assert!(ImuSpec::preset("medium").unwrap().check().is_ok());
}
