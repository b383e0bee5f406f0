//! The nodes against closed forms and against the equations in small steps.

use super::*;
use rand::SeedableRng;

fn spec() -> NodesSpec {
    NodesSpec {
        electronics_jpk: 40.0,
        block_jpk: 300.0,
        case_jpk: 500.0,
        electronics_block_wpk: 0.8,
        block_case_wpk: 1.5,
        case_ambient_wpk: 0.9,
        power_w: 12.0,
        load_w: 0.0,
        load_time_s: 600.0,
        rate_wpdps: 0.0,
        heater_w: 0.0,
        heater_set_k: 0.0,
        heater_band_k: 0.0,
        axis_share_ratio: 0.0,
    }
}

/// All nodes so close to one another that they are one: C dT/dt = P + H - G (T - T_a).
fn one_node() -> NodesSpec {
    NodesSpec {
        electronics_jpk: 1.0,
        case_jpk: 1.0,
        block_jpk: 998.0,
        electronics_block_wpk: 1e3,
        block_case_wpk: 1e3,
        case_ambient_wpk: 0.5,
        ..spec()
    }
}

fn nodes(spec: &NodesSpec, ambient: &Ambient, history: History) -> Nodes {
    let [mut unit, turn_on] = [3, 4].map(ChaCha8Rng::seed_from_u64);
    Nodes::new(spec, (ambient, 0.0), history, &mut unit, turn_on)
}

fn constant_air() -> Ambient {
    Ambient::default()
}

#[test]
fn in_the_end_each_conductance_carries_the_power() {
    let mut n = nodes(&spec(), &constant_air(), History::COLD);
    (0..40_000).for_each(|_| n.second(5.0, 0.0));
    let [e, b, c] = [n.state.x, n.state.y, n.state.z];
    assert!((c - (5.0 + 12.0 / 0.9)).abs() < 1e-6 && (b - c - 12.0 / 1.5).abs() < 1e-6);
    assert!((e - b - 12.0 / 0.8).abs() < 1e-6 && n.now().rate.abs() < 1e-9);
    assert!((b - 5.0 - spec().final_rise_k()).abs() < 1e-6);
    assert!((n.now().gradient - (e - c)).abs() < 1e-12);
    // rate-dependent power: 0.1 W at 20 deg/s for 0.005 W/(deg/s)
    let mut turning = nodes(
        &NodesSpec {
            rate_wpdps: 0.005,
            ..spec()
        },
        &constant_air(),
        History::COLD,
    );
    (0..40_000).for_each(|_| turning.second(5.0, 20.0 * DEG));
    assert!((turning.case() - c - 0.1 / 0.9).abs() < 1e-6);
}

/// The step of a second against the equations in steps of 10 ms.
#[test]
fn a_second_is_exact() {
    let s = spec();
    let mut n = nodes(&s, &constant_air(), History::COLD);
    let [mut e, mut b, mut c] = [0.0; 3];
    let dt = 0.01;
    for second in 1..=3000 {
        for _ in 0..100 {
            let [to_block, to_case] = [0.8 * (e - b), 1.5 * (b - c)];
            e += dt * (12.0 - to_block) / 40.0;
            b += dt * (to_block - to_case) / 300.0;
            c += dt * (to_case - 0.9 * (c + 4.0)) / 500.0;
        }
        n.second(-4.0, 0.0);
        let off = (n.state - Vector3::new(e, b, c)).amax();
        assert!(off < 2e-3, "{second} s: {off} K");
    }
    let rate = (0.8 * (e - b) - 1.5 * (b - c)) / 300.0;
    assert!((n.now().rate - rate).abs() < 1e-5);
}

/// With one node, the temperature after a soak is a closed form of two exponentials.
#[test]
fn the_soak_decides_how_warm_the_start_is() {
    let time = 1000.0 / 0.5;
    let start = |on_s, soak_s| {
        let n = nodes(&one_node(), &constant_air(), History::warm(on_s, soak_s));
        n.now().offset
    };
    for (on_s, soak_s) in [
        (7200.0, 60.0),
        (7200.0, 3600.0),
        (600.0, 1800.0),
        (4000.0, 0.0),
    ] {
        let want = 24.0 * History::warm(on_s, soak_s).left(time);
        assert!((start(on_s, soak_s) - want).abs() < 0.05, "{on_s} {soak_s}");
    }
    assert_eq!(start(7200.0, f64::INFINITY), 0.0);
}

/// A second turn-on continues from the end of the soak, with any ambient meanwhile.
#[test]
fn a_garage_before_power_on_is_lived_through() {
    let garage = Ambient {
        step: vec![super::super::world::Step {
            at_s: -1e5,
            duration_s: 1e5,
            change_k: 10.0,
        }],
        ..Ambient::default()
    };
    let mut n = nodes(&spec(), &garage, History::warm(100.0, 40_000.0));
    assert!(
        (n.state - Vector3::repeat(10.0)).amax() < 1e-3,
        "{}",
        n.state
    );
    // outside, the block cools with the slowest time constant of the three equations
    let off = NodesSpec {
        power_w: 0.0,
        ..spec()
    };
    n.spec = off.clone();
    let slowest = off.dynamics().0.complex_eigenvalues().map(|x| x.re).max();
    (0..3000).for_each(|_| n.second(0.0, 0.0));
    let before = n.state.y;
    (0..600).for_each(|_| n.second(0.0, 0.0));
    let got = (n.state.y / before).ln() / 600.0;
    assert!((got / slowest - 1.0).abs() < 1e-3, "{got} {slowest}");
}

/// Period of a two-point thermostat on one node: `tau ln((E - lo)/(E - hi)) + tau ln(hi / lo)` with
/// the end temperature E of the heater.
#[test]
fn the_thermostat_cycles_with_its_period() {
    let s = NodesSpec {
        power_w: 0.0,
        heater_w: 30.0,
        heater_set_k: 30.0,
        heater_band_k: 2.0,
        ..one_node()
    };
    let (time, end, low, high) = (2000.0, 60.0, 29.0, 31.0f64);
    let want = time * (((end - low) / (end - high)).ln() + (high / low).ln());
    let mut n = nodes(&s, &constant_air(), History::COLD);
    let mut switched = vec![];
    for t in 0..20_000 {
        let before = n.heats;
        n.second(0.0, 0.0);
        if n.heats && !before {
            switched.push(t);
        }
        assert!(t < 4000 || (28.9..31.1).contains(&n.now().offset));
    }
    let cycles = switched.len() - 1;
    let period = f64::from(switched[cycles] - switched[0]) / cycles as f64;
    assert!(
        cycles > 30 && (period / want - 1.0).abs() < 0.02,
        "{period} {want}"
    );
}

/// A telegraph signal: on half of the time, with the correlation exp(-2 t / T).
#[test]
fn the_load_is_a_telegraph_signal() {
    let s = NodesSpec {
        load_w: 2.0,
        load_time_s: 50.0,
        ..spec()
    };
    let mut n = nodes(&s, &constant_air(), History::COLD);
    let on: Vec<f64> = (0..400_000)
        .map(|_| {
            n.second(0.0, 0.0);
            f64::from(i32::from(n.loaded)) - 0.5
        })
        .collect();
    let mean = on.iter().sum::<f64>() / on.len() as f64;
    let lag = 25;
    let product: f64 = on.iter().zip(&on[lag..]).map(|(a, b)| a * b).sum();
    let correlation = product / (on.len() - lag) as f64 / 0.25;
    assert!(mean.abs() < 0.02, "{mean}");
    assert!(
        (correlation - (-1.0f64).exp()).abs() < 0.03,
        "{correlation}"
    );
}

#[test]
fn sensors_sit_between_electronics_and_case() {
    let s = NodesSpec {
        axis_share_ratio: 0.1,
        ..spec()
    };
    let mut n = nodes(&s, &constant_air(), History::COLD);
    assert_eq!(n.axes(), Vector3::zeros());
    (0..900).for_each(|_| n.second(0.0, 0.0));
    let off = n.axes().map(|x| x - n.now().offset) / n.now().gradient;
    assert_eq!(off.map(|x| x != 0.0), Vector3::repeat(true));
    assert!((off - n.share).amax() < 1e-12 && off.amax() < 0.4);
}

#[test]
fn a_capacity_far_too_small_is_refused_by_key() {
    let check = |change: fn(&mut NodesSpec)| {
        let mut imu = super::super::tests::perfect();
        let mut nodes = spec();
        change(&mut nodes);
        imu.nodes = Some(nodes);
        imu.check()
    };
    assert_eq!(check(|_| {}), Ok(()));
    assert!(
        check(|n| n.block_jpk = 1e-5)
            .unwrap_err()
            .contains("nodes.block_jpk = 0.00001")
    );
    assert!(
        check(|n| n.case_jpk = 0.0)
            .unwrap_err()
            .contains("nodes.case_jpk = 0")
    );
    assert!(
        check(|n| n.load_time_s = 0.0)
            .unwrap_err()
            .contains("nodes.load_time_s = 0")
    );
    // the fastest that is allowed is still right: in the end the power flows through the case
    let fast = NodesSpec {
        electronics_jpk: 1e-4,
        ..spec()
    };
    let mut n = nodes(&fast, &constant_air(), History::COLD);
    (0..40_000).for_each(|_| n.second(0.0, 0.0));
    assert!((n.case() - 12.0 / 0.9).abs() < 1e-6, "{}", n.case());
}
