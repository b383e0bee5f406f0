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

/// A turning drive, as IMU number `l` measures it.
fn increments(l: usize) -> Vec<Increment> {
    let error = Vector3::new(1e-6, -2e-6, 3e-6) * l as f64;
    let of = |k: usize| {
        let t = k as f64 * STEP_S;
        let rate = Vector3::new(0.01, 0.02 * (0.5 * t).sin(), 0.3 * (0.1 * t).cos());
        let force = Vector3::new((0.3 * t).sin(), 2.0 * (0.1 * t).cos(), -9.8);
        Increment {
            dtheta: (rate + error) * STEP_S,
            dv: (force + error * 100.0) * STEP_S,
        }
    };
    (0..10 * SECONDS).map(of).collect()
}

/// Fixes, of which some are missing, and some lack values.
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

/// Number of filters: fewer than places.
const L: usize = PLACES - 1;

/// Checks that the numbers of the same filter differ by at most `apart`.
fn near(got: &(Aided, f64), want: &(Aided, f64), apart: f64) {
    let p = (&got.0.p - &want.0.p).zip_map(&want.0.p, |d, p| d.abs() / p.abs().max(1e-12));
    assert!(p.max() <= apart, "{:e}", p.max());
    let sigma = want.0.p.diagonal().map(f64::sqrt);
    let theta = &got.0.theta - &want.0.theta;
    let theta = theta.component_div(&sigma.rows(NAV, theta.len()));
    assert!(
        theta.is_empty() || theta.amax() <= apart,
        "{:e}",
        theta.amax()
    );
    assert!(
        (got.1 / want.1 - 1.0).abs() <= apart,
        "{} {}",
        got.1,
        want.1
    );
    let [a, b] = [got, want].map(|filter| filter.0.sins.nav);
    let off = a.position.ned_from(&b.position).norm() + (a.velocity - b.velocity).norm();
    let turned = (a.q_bn.coords - b.q_bn.coords).norm();
    assert!(off <= apart && turned <= apart, "{off:e} {turned:e}");
}

/// [`L`] filters side by side, each with its own samples, give the same results as each alone: the
/// same bits if `apart` is zero.
fn compare(model: fn(&Prior) -> ErrorModel, apart: f64) {
    let all: Vec<Vec<Increment>> = (0..L).map(increments).collect();
    let alone = |(filter, score): &mut (Aided, f64), l: usize, k: usize| {
        let second: &[Increment] = &all[l][10 * k..10 * (k + 1)];
        second.iter().for_each(|w| filter.step(w, STEP_S));
        *score += filter.take(fix(k).as_ref());
    };
    let mut filters: Vec<(Aided, f64)> = (0..L).map(|l| (filter(l, model), 0.0)).collect();
    for (l, filter) in filters.iter_mut().enumerate() {
        alone(filter, l, 0);
    }
    assert!(filters.iter().all(|other| alike(&filters[0].0, &other.0)));
    let mut passed = filters.clone();
    let mut beside: Vec<Beside<'_>> = passed
        .iter_mut()
        .zip(&all)
        .map(|(filter, all)| Beside {
            filter,
            increments: &all[10..],
        })
        .collect();
    let fixes: Vec<Option<Fix>> = (1..SECONDS).map(fix).collect();
    pass(&mut beside, &fixes, STEP_S);
    for (l, (want, got)) in filters.iter_mut().zip(&mut passed).enumerate() {
        (1..SECONDS).for_each(|k| alone(want, l, k));
        near(got, want, apart);
        // and they continue alike
        for k in [SECONDS - 2, SECONDS - 1] {
            alone(got, l, k);
            alone(want, l, k);
        }
        near(got, want, apart);
    }
}

fn exponentials(prior: &Prior) -> ErrorModel {
    ErrorModel::with_exponentials(prior, [150.0, 500.0, 1500.0], 0.3)
}

#[test]
fn filters_side_by_side_have_their_own_bits() {
    compare(|_| ErrorModel::default(), 0.0);
    compare(ErrorModel::biases, 0.0);
    compare(ErrorModel::with_scale, 0.0);
    compare(ErrorModel::with_matrices, 0.0);
}

/// Sums of laws are formed axis by axis.
#[test]
fn laws_side_by_side_differ_in_the_last_digits_only() {
    compare(ErrorModel::with_ramps, 1e-8);
    compare(exponentials, 1e-8);
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
