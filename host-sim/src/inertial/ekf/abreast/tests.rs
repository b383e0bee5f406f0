use super::*;
use crate::inertial::earth::Geodetic;
use crate::inertial::ekf::{ErrorModel, InitialSigma, Noise, Prior};
use crate::inertial::rotation::from_rotvec;
use crate::inertial::sins::NavState;
use nalgebra::Vector3;

const STEP_S: f64 = 0.1;
const SECONDS: usize = 60;

fn start() -> NavState {
    NavState {
        position: Geodetic {
            lat: 0.7,
            lon: 0.3,
            h: 200.0,
        },
        velocity: Vector3::new(12.0, 25.0, -1.0),
        q_bn: from_rotvec(&Vector3::new(0.05, -0.03, 1.1)),
    }
}

/// A turning drive.
fn increments() -> Vec<Increment> {
    let of = |k: usize| {
        let t = k as f64 * STEP_S;
        Increment {
            dtheta: Vector3::new(0.01, 0.02 * (0.5 * t).sin(), 0.3 * (0.1 * t).cos()) * STEP_S,
            dv: Vector3::new((0.3 * t).sin(), 2.0 * (0.1 * t).cos(), -9.8) * STEP_S,
        }
    };
    (0..10 * SECONDS).map(of).collect()
}

/// Some are missing, and some lack values.
fn fix(k: usize) -> Option<Fix> {
    let moved = Vector3::new(1.3 * k as f64, 10.0 * (0.1 * k as f64).sin(), 1.0);
    let velocity = Vector3::new(1.3, (0.1 * k as f64).cos(), 0.1);
    let mut sigmas = [3.0, 3.0, 5.0, 0.1, 0.1, 0.2];
    if k.is_multiple_of(5) {
        sigmas[2] = f64::INFINITY;
        sigmas[4] = f64::INFINITY;
    }
    let fix = Fix::new(start().position.displaced(&moved), velocity, sigmas);
    (k % 7 != 3).then_some(fix)
}

fn filter(l: usize, model: fn(&Prior) -> ErrorModel) -> Aided {
    let times = 1.0 + l as f64;
    let prior = Prior {
        gyro_bias: 1.6e-6,
        accel_bias: 4e-3,
        walk_per_hour: 0.05 * l as f64,
        scale: [1e-4 * times; 2],
        misalignment: [1e-4; 2],
    };
    let noise = Noise {
        gyro: 1.5e-6 * times,
        accel: 5e-4 * times,
    };
    let sigma = InitialSigma {
        tilt: 1e-3,
        heading: 1e-2,
        velocity: 0.01,
        position: 3.0,
    };
    let filter = Aided::new(start(), &sigma, model(&prior), noise);
    filter.with_samples(Samples::One).powered_for(100.0)
}

const L: usize = 4;

/// [`L`] filters side by side have the bits that each has alone.
fn compare(model: fn(&Prior) -> ErrorModel) {
    let all = increments();
    let second = |k: usize| &all[10 * k..10 * (k + 1)];
    let alone = |(filter, score): &mut (Aided, f64), k: usize| {
        second(k).iter().for_each(|w| filter.step(w, STEP_S));
        *score += filter.take(fix(k).as_ref());
    };
    let mut filters: Vec<(Aided, f64)> = (0..L).map(|l| (filter(l, model), 0.0)).collect();
    filters.iter_mut().for_each(|filter| alone(filter, 0));
    assert!(filters.iter().all(|other| alike(&filters[0].0, &other.0)));
    let begun = filters.clone();
    let mut abreast = Abreast::<L>::of(|l| &begun[l]);
    abreast.pass((1..SECONDS).map(|k| (second(k), fix(k))), STEP_S);
    for (l, want) in filters.iter_mut().enumerate() {
        (1..SECONDS).for_each(|k| alone(want, k));
        let mut got = abreast.filter(l, &begun[l].0);
        assert_eq!(got.1.to_bits(), want.1.to_bits());
        assert_eq!((&got.0.p, &got.0.theta), (&want.0.p, &want.0.theta));
        assert_eq!(got.0.sins.nav, want.0.sins.nav);
        // and they go on alike
        for k in [SECONDS - 2, SECONDS - 1] {
            alone(&mut got, k);
            alone(want, k);
        }
        assert_eq!((got.1, got.0.p), (want.1, want.0.p.clone()));
    }
}

fn exponentials(prior: &Prior) -> ErrorModel {
    ErrorModel::with_exponentials(prior, [150.0, 500.0, 1500.0], 0.3)
}

#[test]
fn filters_side_by_side_have_their_own_bits() {
    compare(|_| ErrorModel::default());
    compare(ErrorModel::biases);
    compare(ErrorModel::with_scale);
    compare(ErrorModel::with_matrices);
    compare(exponentials);
}

#[test]
fn only_filters_of_one_structure_are_alike() {
    let one = filter(0, ErrorModel::biases);
    assert!(alike(&one, &filter(3, ErrorModel::biases)));
    assert!(!alike(&one, &filter(3, ErrorModel::with_scale)));
    assert!(!alike(
        &one,
        &filter(0, ErrorModel::biases).powered_for(7.0)
    ));
    let mut late = filter(0, ErrorModel::biases);
    late.model.delay_s = 1e-3;
    assert!(!alike(&late, &late));
    let three = filter(0, ErrorModel::biases).with_samples(Samples::Three);
    assert!(!alike(&three, &three));
    let mut fading = filter(0, ErrorModel::biases);
    fading.model.parameters[2].time_s = 100.0;
    assert!(!alike(&fading, &fading));
}
