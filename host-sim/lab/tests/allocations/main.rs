//! Filters that run side by side do not allocate after their start.

use allocation_counter::measure;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{
    Aided, Beside, ErrorModel, InitialSigma, Noise, Prior, alike, pass,
};
use host_core::inertial::gnss::Fix;
use host_core::inertial::sins::{Increment, NavState, Samples};
use nalgebra::{UnitQuaternion, Vector3};

const STEP_S: f64 = 0.1;

fn start() -> NavState {
    NavState {
        position: Geodetic {
            lat: 0.7,
            lon: 0.3,
            h: 200.0,
        },
        velocity: Vector3::new(12.0, 25.0, -1.0),
        q_bn: UnitQuaternion::from_euler_angles(0.05, -0.03, 1.1),
    }
}

/// A filter of three exponentials an axis whose biases walk by this share.
fn filter(walk: f64) -> Aided {
    let prior = Prior {
        gyro_bias: 1.6e-6,
        accel_bias: 4e-3,
        walk_per_hour: walk,
        scale: [1e-4; 2],
        misalignment: [1e-4; 2],
    };
    let sigma = InitialSigma {
        tilt: 1e-3,
        heading: 1e-2,
        velocity: 0.01,
        position: 3.0,
    };
    let noise = Noise {
        gyro: 1.5e-6,
        accel: 5e-4,
    };
    let model = ErrorModel::with_exponentials(&prior, [150.0, 500.0, 1500.0], 0.3);
    Aided::new(start(), &sigma, model, noise).with_samples(Samples::One)
}

fn fix(second: usize) -> Fix {
    let moved = Vector3::new(12.0, 25.0, -1.0) * second as f64;
    let sigmas = [3.0, 3.0, 5.0, 0.1, 0.1, 0.2];
    Fix::new(start().position.displaced(&moved), start().velocity, sigmas)
}

#[test]
fn filters_side_by_side_allocate_nothing() {
    let increment = Increment {
        dtheta: Vector3::new(1e-4, -2e-4, 1e-3),
        dv: Vector3::new(0.02, -0.01, -9.8 * STEP_S),
    };
    let second = [increment; 10];
    let mut filters: Vec<(Aided, f64)> = [0.0, 0.1, 0.4, 1.6].map(|w| (filter(w), 0.0)).into();
    // alone, a filter allocates vectors for each fix, so the counter works
    let alone = measure(|| {
        for (filter, score) in &mut filters {
            second.iter().for_each(|w| filter.step(w, STEP_S));
            *score += filter.take(Some(&fix(1)));
        }
    });
    assert!(alone.count_total >= 4, "{}", alone.count_total);
    assert!(filters.iter().all(|f| alike(&filters[0].0, &f.0)));
    // the allocations at the start do not depend on the duration
    let allocated = |seconds: usize| {
        let mut filters = filters.clone();
        let fixes: Vec<Option<Fix>> = (2..2 + seconds).map(|k| Some(fix(k))).collect();
        let increments = vec![increment; 10 * seconds];
        let mut beside: Vec<Beside<'_>> = filters
            .iter_mut()
            .map(|filter| Beside {
                filter,
                increments: &increments,
            })
            .collect();
        let many = measure(|| pass(&mut beside, &fixes, STEP_S));
        assert!(filters.iter().all(|f| f.1.is_finite()));
        (many.count_total, many.bytes_total)
    };
    assert_eq!(allocated(1), allocated(200));
}
