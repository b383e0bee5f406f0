use super::*;
use crate::fix::Position;
use crate::nav::vector::from_rotvec;

const RATIOS: Sizes = Sizes {
    scale: [0.01, 0.002],
    misalignment: [0.0; 2],
    g_sensitivity: 0.0,
};

fn state(angle: f64, velocity: V) -> State {
    State {
        position: Position {
            latitude: 0.8,
            longitude: 0.1,
            height: 0.0,
        },
        velocity,
        q_bn: from_rotvec([0.0, 0.0, angle]),
    }
}

/// The variances that a motion adds: `at` gives angle and velocity at each step of 0.1 s.
fn added(ratios: &Sizes, steps: u32, at: impl Fn(f64) -> (f64, V)) -> [V32; 2] {
    let mut of = Proportional::default();
    let mut sum = [[0.0; 3]; 2];
    for k in 0..=steps {
        let (angle, velocity) = at(0.1 * f64::from(k));
        let Growth {
            by_force,
            turn,
            gain,
        } = of.moves(&state(angle, velocity), 0.1, ratios);
        let more = [turn.map(|turn| turn + by_force), gain];
        for (sum, more) in sum.iter_mut().zip(more) {
            assert!(more.iter().all(|x| *x >= 0.0));
            *sum = add(*sum, more);
        }
    }
    sum
}

/// A corner of 90 degrees in 5 s makes 1 % of it, however it is cut into steps.
#[test]
fn a_corner_counts_as_a_whole() {
    let quarter = core::f64::consts::FRAC_PI_2;
    let [[n, e, turn], gain] = added(&RATIOS, 50, |t| (quarter * t / 5.0, [10.0, 0.0, 0.0]));
    let sigma = libm::sqrtf(turn);
    assert!((0.0145..0.0158).contains(&sigma), "{sigma}");
    assert_eq!(([n, e], gain), ([0.0; 2], [0.0; 3]));
}

/// Braking from 20 m/s in 5 s: 0.2 % of it, and what the gyros' g-sensitivity turns meanwhile.
#[test]
fn braking_counts_as_a_whole() {
    let ratios = Sizes {
        g_sensitivity: 1e-4,
        ..RATIOS
    };
    let [turn, [gain, e, d]] = added(&ratios, 50, |t| (0.0, [20.0 - 4.0 * t, 0.0, 0.0]));
    assert_eq!([e, d], [0.0; 2]);
    assert!(turn[0] == turn[1] && turn[1] == turn[2]);
    let (turn, gain) = (libm::sqrtf(turn[0]), libm::sqrtf(gain));
    assert!((0.0385..0.0401).contains(&gain), "{gain}");
    assert!((0.00192..0.00201).contains(&turn), "{turn}");
}

/// As before, with accelerometers that are misaligned by 5 mrad.
#[test]
fn misaligned_accelerometers_show_braking_across_too() {
    let ratios = Sizes {
        misalignment: [0.0, 5e-3],
        ..RATIOS
    };
    let [_, gain] = added(&ratios, 50, |t| (0.0, [20.0 - 4.0 * t, 0.0, 0.0]));
    let [along, east, down] = gain.map(libm::sqrtf);
    assert!((0.0385..0.0401).contains(&along), "{along}");
    assert!(east == down && (0.096..0.1).contains(&east), "{east}");
}

/// A turn of 0.1 rad/s that goes on for 1 000 s: as a constant that is drawn again each 150 s, 2
/// (0.01 0.1)^2 150 s a second, less at the beginning.
#[test]
fn a_steady_turn_is_a_gauss_markov_error() {
    let [[.., turn], _] = added(&RATIOS, 10_000, |t| (0.1 * t, [0.0; 3]));
    let whole = 2.0 * 1e-6 * 150.0 * 1000.0;
    assert!((0.7 * whole..whole).contains(&turn), "{turn} of {whole}");
}

/// A corner, and one back a minute later, are two errors, because the fixes have corrected the
/// first.
#[test]
fn a_corner_back_counts_again() {
    let quarter = core::f64::consts::FRAC_PI_2;
    let there = |t: f64| quarter * (t / 5.0).clamp(0.0, 1.0);
    let [[.., one], _] = added(&RATIOS, 1000, |t| (there(t), [0.0; 3]));
    let [[.., both], _] = added(&RATIOS, 1000, |t| (there(t) - there(t - 60.0), [0.0; 3]));
    assert!((1.6 * one..2.1 * one).contains(&both), "{one} {both}");
}

/// A ship that rolls by 10 degrees each 10 s: in a minute it costs less than one turn by 40
/// degrees, although it turns by 240.
#[test]
fn swings_cost_little() {
    let [[.., turn], _] = added(&RATIOS, 600, |t| (0.17 * libm::sin(0.628 * t), [0.0; 3]));
    let sigma = libm::sqrtf(turn);
    assert!((0.01 * 0.17..0.01 * 0.7).contains(&sigma), "{sigma}");
}

#[test]
fn to_stand_or_go_straight_on_adds_nothing() {
    let none = added(&RATIOS, 1000, |_| (0.3, [12.0, 3.0, 0.0]));
    assert_eq!(none, [[0.0; 3]; 2]);
}

#[test]
fn what_feeds_back_is_no_motion() {
    let mut of = Proportional::default();
    of.set(&state(0.0, [0.0; 3]));
    of.set(&state(0.5, [3.0, 0.0, 0.0]));
    assert_eq!(
        of.moves(&state(0.5, [3.0, 0.0, 0.0]), 1.0, &RATIOS),
        Growth::default()
    );
}
