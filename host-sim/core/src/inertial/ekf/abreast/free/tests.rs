use super::*;
use crate::inertial::ekf::{ErrorModel, InitialSigma, Noise, Parameter, Prior, Triad};
use crate::inertial::free_inertial::from_filter;
use crate::simulator::imu::ImuSpec;
use crate::simulator::session::{SessionConfig, simulate};

/// A drive with a standstill.
fn session() -> Session {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 50;
    let config = SessionConfig {
        heading: 0.7,
        ..SessionConfig::new(&imu, [30.0, 120.0], [5, 6, 7])
    };
    Session {
        gather: 5,
        reference_arm: nalgebra::Vector3::new(0.4, -0.2, 1.0),
        ..simulate(&config).0
    }
}

/// Filters with several models at an epoch, each with its own estimate.
fn filters(session: &Session, until: usize) -> [Aided; 5] {
    let prior = Prior {
        gyro_bias: 1e-6,
        accel_bias: 1e-3,
        walk_per_hour: 0.1,
        scale: [1e-4; 2],
        misalignment: [1e-4; 2],
    };
    let models = [
        ErrorModel::default(),
        ErrorModel::biases(&prior),
        ErrorModel::with_scale(&prior),
        ErrorModel::with_matrices(&prior),
        ErrorModel::with_exponentials(&prior, [150.0, 500.0, 1500.0], 0.3),
    ];
    let noise = Noise {
        gyro: 1e-6,
        accel: 1e-4,
    };
    let sigma = InitialSigma {
        tilt: 1e-3,
        heading: 1e-2,
        velocity: 0.01,
        position: 3.0,
    };
    let filter = |model: ErrorModel| {
        let mut filter =
            Aided::new(session.reference[until], &sigma, model, noise).with_samples(Samples::One);
        let sigmas: Vec<f64> = filter.model.parameters.iter().map(|p| p.sigma).collect();
        for (k, (theta, sigma)) in filter.theta.iter_mut().zip(sigmas).enumerate() {
            *theta = sigma * (k as f64).sin();
        }
        filter
    };
    models.map(filter)
}

/// Fewer filters than places: each has the same bits as alone.
#[test]
fn flights_side_by_side_have_their_own_bits() {
    let (session, until) = (session(), 40);
    let filters = filters(&session, until);
    let increments = session.increments();
    let flights = filters.each_ref().map(|filter| Flight {
        filter,
        session: &session,
        increments: &increments,
        until,
    });
    let beside = free_abreast(&flights);
    assert_eq!(beside.len(), filters.len());
    for (filter, beside) in filters.iter().zip(beside) {
        let alone = from_filter(filter, &session, &increments, until);
        assert_eq!(beside.position, alone.position);
        assert_eq!(beside.velocity, alone.velocity);
        assert_eq!(beside.track, alone.track);
    }
}

#[test]
fn filters_that_need_more_fly_alone() {
    let start = crate::inertial::sins::NavState {
        position: Default::default(),
        velocity: nalgebra::Vector3::zeros(),
        q_bn: nalgebra::UnitQuaternion::identity(),
    };
    let sigma = InitialSigma {
        tilt: 1e-3,
        heading: 1e-2,
        velocity: 0.01,
        position: 3.0,
    };
    let filter = |parameters: Vec<Parameter>, delay_s: f64, samples| {
        let model = ErrorModel {
            parameters,
            delay_s,
            ..ErrorModel::default()
        };
        let noise = Noise {
            gyro: 1e-6,
            accel: 1e-4,
        };
        Aided::new(start, &sigma, model, noise).with_samples(samples)
    };
    let of = |regressor| vec![Parameter::constant(Triad::Gyro, 0, regressor, 1.0)];
    assert!(flies(&filter(of(Regressor::Input(2)), 0.0, Samples::One)));
    assert!(!flies(&filter(of(Regressor::Cube(0)), 0.0, Samples::One)));
    assert!(!flies(&filter(of(Regressor::One), 1e-3, Samples::One)));
    assert!(!flies(&filter(of(Regressor::One), 0.0, Samples::Three)));
}
