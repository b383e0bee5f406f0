//! The fixed-point step against the same equations in f64, with the Earth computed for each piece.

use super::*;
use crate::nav::fixed::TIME;
use crate::nav::vector as f64s;
use crate::nav::vector::{Q, scale};

fn state(latitude: f64, longitude: f64, velocity: V) -> State {
    State {
        position: Position {
            latitude,
            longitude,
            height: 200.0,
        },
        velocity,
        q_bn: [1.0, 0.0, 0.0, 0.0],
    }
}

fn turned64(q: Q, phi: V, zeta: V) -> Q {
    let q = f64s::product(f64s::from_rotvec(scale(zeta, -1.0)), q);
    f64s::renormalised(f64s::product(q, f64s::from_rotvec(phi)))
}

/// A step in f64.
fn step64(state: &State, phi: V, dv: V, tau: f64) -> State {
    use f64s::{add, cross};
    let State {
        position,
        velocity,
        q_bn,
    } = *state;
    let radius = Local::at(position.latitude, position.height).m_h;
    let here = Local::at(
        position.latitude + velocity[0] * (0.5 * tau) / radius,
        position.height - velocity[2] * (0.5 * tau),
    );
    let force = f64s::rotated(q_bn, dv);
    let mut v_mid = add(velocity, scale(force, 0.5));
    v_mid[2] += 0.5 * here.g * tau;
    let omega_en = [
        v_mid[1] / here.n_h,
        -v_mid[0] / here.m_h,
        -v_mid[1] / here.n_h * here.sin / here.cos,
    ];
    let omega_in = add(here.omega_ie(), omega_en);
    let zeta = scale(omega_in, tau);
    let coriolis = cross(v_mid, add(here.omega_ie(), omega_in));
    let mut change = add(force, scale(cross(force, zeta), 0.5));
    change = add(change, scale(coriolis, tau));
    change[2] += here.g * tau;
    let mean = add(velocity, scale(change, 0.5));
    State {
        position: Position {
            latitude: position.latitude + mean[0] * tau / here.m_h,
            longitude: wrapped(position.longitude + mean[1] * tau / (here.n_h * here.cos)),
            height: position.height - mean[2] * tau,
        },
        velocity: add(velocity, change),
        q_bn: turned64(q_bn, phi, zeta),
    }
}

fn apart(a: &State, b: &State) -> [f64; 3] {
    let length = |v: V| f64s::dot(v, v).sqrt();
    let [w, x, y, z] = a.q_bn;
    let [_, x, y, z] = f64s::product([w, -x, -y, -z], b.q_bn);
    [
        length(a.position.ned_from(&b.position)),
        length(f64s::add(a.velocity, scale(b.velocity, -1.0))),
        2.0 * length([x, y, z]),
    ]
}

/// 22 min with turns of 40 deg/s and accelerations of some m/s2, at both speeds of a car and of an
/// aircraft, in both hemispheres, close to a pole, and over the date line.
#[test]
fn twenty_two_minutes_are_those_of_f64() {
    let tau = 0.05;
    for (latitude, longitude, velocity) in [
        (0.0, PI - 1e-6, [2.0, 25.0, 0.0]),
        (0.8, 1e-6 - PI, [-20.0, -15.0, 0.0]),
        (-0.8, 0.3, [15.0, -20.0, 0.0]),
        (1.396, PI - 1e-4, [12.0, 20.0, 0.0]),
        (-1.396, 1.0, [12.0, -20.0, 0.0]),
        (0.8, 0.3, [210.0, 210.0, 0.0]),
        (1.35, 0.3, [210.0, 210.0, 0.0]),
        (-1.396, 0.3, [0.0, -300.0, 0.0]),
        (1.53, 0.3, [-150.0, 250.0, 0.0]),
    ] {
        let mut reference = state(latitude, longitude, velocity);
        let mut device = Solution::new(&reference);
        let mut worst = [0.0_f64; 3];
        for k in 0..26_400 {
            let t = f64::from(k) * tau;
            let turn = [
                0.1 * (0.5 * t).sin(),
                0.08 * (0.7 * t).cos(),
                0.7 * (0.2 * t).sin(),
            ];
            // what keeps the velocity, and some accelerations
            let here = Local::at(reference.position.latitude, reference.position.height);
            let [vn, ve, _] = reference.velocity;
            let omega_en = [
                ve / here.n_h,
                -vn / here.m_h,
                -ve / here.n_h * here.sin / here.cos,
            ];
            let twice = f64s::add(scale(here.omega_ie(), 2.0), omega_en);
            let wanted = [
                1.5 * (0.3 * t).cos(),
                2.0 * (0.4 * t).cos(),
                (0.6 * t).cos(),
            ];
            let mut force = f64s::add(wanted, f64s::cross(twice, reference.velocity));
            // height is held near 200 m
            let above = (reference.position.height - 200.0).clamp(-50.0, 50.0);
            force[2] += 0.02 * above - here.g;
            force[2] -= 0.2 * reference.velocity[2];
            let [w, x, y, z] = reference.q_bn;
            let dv = scale(f64s::rotated([w, -x, -y, -z], force), tau);
            let piece = Piece {
                phi: scale(turn, tau).map(|x| from_f64(x, ANGLE)),
                velocity: dv.map(|x| from_f64(x, VELOCITY)),
                time: from_f64(tau, TIME),
            };
            reference = step64(&reference, piece.phi(), piece.velocity(), piece.time());
            assert!(device.step(&piece).is_some(), "{k}: {:?}", device.state());
            for (worst, off) in worst.iter_mut().zip(apart(&device.state(), &reference)) {
                *worst = worst.max(off);
            }
        }
        println!(
            "{latitude} {longitude} {velocity:?}: {worst:?} {:?}",
            reference.position
        );
        let fast = f64s::dot(velocity, velocity) > 1e4;
        assert!(
            worst[0] < if fast { 2e-3 } else { 5e-4 },
            "{latitude} {velocity:?}: {worst:?}"
        );
        assert!(
            worst[1] < 1e-5 && worst[2] < 1e-9,
            "{latitude} {velocity:?}: {worst:?}"
        );
    }
}

/// Whatever a piece holds, a debug build finds no product out of its range, and the solution is in
/// range or says that it is not.
#[test]
fn extremes_are_refused_or_in_range() {
    let ends = |bits: u32, bound: i64| [0, 1, -1, bound, -bound, bound + 1, i64::MAX, 1 << bits];
    let angles = ends(ANGLE, MAX_PIECE[0]);
    let velocities = ends(VELOCITY, MAX_PIECE[1]);
    let times = [0.0, 1e-5, 0.05, 0.5, LONGEST_S].map(|t| from_f64(t, TIME));
    let mut seed = 1_u64;
    let mut any = |of: &[i64]| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        of[(seed >> 33) as usize % of.len()]
    };
    let (mut taken, mut refused) = (0, 0);
    for _ in 0..200_000 {
        let pick = any(&[0, 1, 2, 3]);
        let latitude = [0.0, 0.8, -1.4, MAX_LATITUDE][pick as usize];
        let v = [0.0, 300.0, MAX_VELOCITY, -MAX_VELOCITY];
        let mut speed = || v[any(&[0, 1, 2, 3]) as usize];
        let velocity = [speed(), speed(), speed()];
        let mut at = Solution::new(&state(latitude, PI - 1e-6, velocity));
        let piece = Piece {
            phi: core::array::from_fn(|_| any(&angles)),
            velocity: core::array::from_fn(|_| any(&velocities)),
            time: any(&times),
        };
        let before = at.state();
        if at.step(&piece).is_some() {
            taken += 1;
            let after = at.state();
            assert!(at.now.in_range());
            let norm: f64 = after.q_bn.iter().map(|x| x * x).sum();
            assert!((norm - 1.0).abs() < 1e-3, "{norm}");
        } else {
            refused += 1;
            assert_eq!(at.state(), before);
        }
    }
    assert!(taken > 1_000 && refused > 1_000, "{taken} {refused}");
}

#[test]
fn long_rotations_are_exact() {
    for n in [1e-9, 0.01, 0.0597, 0.0598, 0.3, 1.0, 1.38] {
        let phi = scale([0.6, -0.64, 0.48], n);
        let got = from_rotvec(phi.map(|x| from_f64(x, ANGLE))).map(|x| to_f64(x, ANGLE));
        for (got, wanted) in got.into_iter().zip(f64s::from_rotvec(phi)) {
            assert!((got - wanted).abs() < 3e-16, "{n}: {got} {wanted}");
        }
    }
}
