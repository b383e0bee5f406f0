//! The device's learner from fixes, against the same hypotheses in f64 and against dense matrices.

mod dense;
mod f64_learner;

use dense::DenseReference;
use f64_learner::F64Learner;
use firmware::learn::bank::{ALL, Gates, HYPOTHESES, MAP, ZERO_CORRECTION};
use firmware::learn::prior::{All, Layers, NAV, weights};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::ErrorModel;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use host_core::simulator::imu::{ErrorModelName, ImuSpec};
use host_core::simulator::session::{SessionConfig, simulate};
use host_estimation::learning::aiding::fix_at;
use host_estimation::learning::fix_learner::{datasheet, learn};
use host_estimation::learning::teacher::{Assumptions, aligned};
use lrnn_nostd::learn::kalman::{
    AllWeights, Correction, ErrorModel as Networks, Kalman, NoParameters, OutputWeights, Prior,
    Transition,
};
use lrnn_nostd::{Rational, Real, Weights};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A short session: 150 s at rest, 250 s of driving.
fn session(model: ErrorModelName, seed: u64) -> (Session, Assumptions) {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 50;
    let spec = imu.error_model(model);
    let config = SessionConfig {
        start: Geodetic {
            lat: 28.2 * DEG,
            lon: 112.9 * DEG,
            h: 60.0,
        },
        ..SessionConfig::new(&spec, [150.0, 250.0], [seed, seed, seed])
    };
    (simulate(&config).0, Assumptions::of_simulated(&imu))
}

/// The learner in f64 does not add up what the sensors feel, which a map is learnt from.
const WITHOUT_MAP: u8 = ALL & !(1 << MAP);

/// A plausible block and fix from random numbers.
fn block(rng: &mut ChaCha8Rng) -> Transition<NAV, f64> {
    let mut small = |size: f64| rng.random_range(-size..size);
    let mut block = Transition {
        phi: [[0.0; 9]; 9],
        gamma: [[0.0; 6]; 9],
        time: 1.0,
        ..Transition::ZEROED
    };
    for i in 0..3 {
        for j in 0..3 {
            block.gamma[i][j] = small(1.0);
            block.gamma[3 + i][3 + j] = small(1.0);
            block.gamma[6 + i][3 + j] = small(0.5);
            block.phi[3 + i][j] = small(10.0);
        }
        block.phi[6 + i][3 + i] = 1.0;
        block.q[i][i] = 1e-12;
        block.q[3 + i][3 + i] = 1e-6;
    }
    for i in 0..9 {
        block.phi[i][i] = 1.0;
    }
    block
}

/// The walk of each of 132 parameters: the first three of a triad's 66 are its biases.
fn walks(of_biases: &[f64; 6]) -> Vec<f64> {
    let at = |i: usize| (i % 66 < 3).then(|| of_biases[i / 66 * 3 + i % 66]);
    (0..132).map(|i| at(i).unwrap_or(0.0)).collect()
}

/// The filter of all weights, in `T`, beside the dense reference over random blocks. Gives the
/// largest difference of an estimate in units of the output scale, and of a standard deviation
/// relative to itself.
fn difference<T: Real>(fixes: usize) -> (f64, f64) {
    let (_, assumptions) = session(ErrorModelName::Linear, 1);
    let sheet = datasheet(&assumptions);
    let error_sigma = [1e-3, 1e-3, 1e-2, 0.1, 0.1, 0.1, 1.0, 1.0, 1.0];
    let wide: Prior<NAV, 132, f64> = sheet.cast::<f64>().prior::<AllWeights, 132>(
        Layers::Time(&weights(1.0, 1.0)[1]),
        0.3,
        error_sigma,
        [0.0; 9],
    );
    let to = |x: f64| T::from_f64(x);
    let prior: Prior<NAV, 132, T> = Prior {
        error_sigma: error_sigma.map(to),
        parameter_sigma: wide.parameter_sigma.map(to),
        walk: wide.walk.map(to),
        error_floor: [T::ZERO; 9],
        parameter_floor: T::ZERO,
    };
    let mut packed: All<T> = Kalman::new(Networks::new(sheet.cast::<T>().nets(1.0)), prior);
    let mut dense = DenseReference::new(
        sheet.cast().nets(1.0),
        &error_sigma,
        &wide.parameter_sigma,
        &walks(&wide.walk),
    );
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let scales = [assumptions.prior.gyro_bias, assumptions.prior.accel_bias];
    let (mut worst, mut spread): (f64, f64) = (0.0, 0.0);
    for _ in 0..fixes {
        let inputs: [[f64; 3]; 2] =
            [0.2, 2.0].map(|size| [0.0; 3].map(|_| rng.random_range(-size..size)));
        packed.step(inputs.map(|triad| triad.map(to)));
        dense.step(inputs);
        for i in 0..6 {
            let gap = packed.model().estimate()[i].to_f64() - dense.estimate[i];
            worst = worst.max(gap.abs() / scales[i / 3]);
        }
        let b = block(&mut rng);
        let narrow = Transition {
            phi: b.phi.map(|r| r.map(to)),
            gamma: b.gamma.map(|r| r.map(to)),
            q: b.q.map(|r| r.map(to)),
            time: to(b.time),
            ..Transition::ZEROED
        };
        packed.propagate(&narrow, &Correction::NONE);
        dense.propagate(&b, &[0.0; 6]);
        let z: [f64; 6] = [1.0, 1.0, 1.0, 0.05, 0.05, 0.05].map(|s| rng.random_range(-s..s));
        let variance = [1.0, 1.0, 1.0, 2.5e-3, 2.5e-3, 2.5e-3];
        for k in 0..6 {
            let i = if k < 3 { 6 + k } else { k };
            packed.update(i, packed.innovation(i, to(z[k]), to(variance[k])));
        }
        packed.finish_update();
        dense.fix(&z, &variance);
        for (i, variance) in packed.covariance().variances().enumerate() {
            let want = dense.p[(NAV + i, NAV + i)];
            if want > 0.0 {
                spread = spread.max((variance.to_f64() / want - 1.0).abs());
            }
        }
    }
    assert!(packed.is_healthy());
    (worst, spread)
}

#[test]
fn packed_and_dense_agree_in_f64() {
    let (worst, spread) = difference::<f64>(300);
    assert!(worst < 1e-9, "{worst:e}");
    assert!(spread < 1e-8, "{spread:e}");
}

#[test]
fn f32_stays_near_the_dense_f64_reference() {
    let (worst, spread) = difference::<f32>(300);
    assert!(worst < 0.01, "{worst:e}");
    assert!(spread < 0.02, "{spread:e}");
}

#[test]
fn the_biases_hypothesis_is_the_classical_filter() {
    let (session, mut assumptions) = session(ErrorModelName::Linear, 2);
    assumptions.prior.walk_per_hour = f64::from(datasheet(&assumptions).walk_per_hour[0]);
    let increments = session.increments();
    let until = 350;
    let aligned = aligned(&session, &increments).unwrap();
    let model = ErrorModel::biases(&assumptions.prior);
    let classical = aligned.aided(model, &assumptions, &session, &increments, until);
    let learner = F64Learner::taught(&session, &increments, &assumptions, until).unwrap();
    let biases = learner.bank.estimate_of(1);
    let mut learnt = 0.0;
    for i in 0..6 {
        let scale = [assumptions.prior.gyro_bias, assumptions.prior.accel_bias][i / 3];
        let gap = (biases[i] - classical.theta[i]).abs() / scale;
        assert!(gap < 0.01, "{i}: {} {}", biases[i], classical.theta[i]);
        learnt += classical.theta[i].abs() / scale;
    }
    assert!(learnt > 0.3, "{learnt}");
}

/// The device's f32 with its own alignment, navigator and block timing, against f64.
#[test]
fn the_device_stays_near_the_f64_learner() {
    let (session, assumptions) = session(ErrorModelName::Linear, 5);
    let (increments, until) = (session.increments(), 400);
    let want = F64Learner::taught(&session, &increments, &assumptions, until).unwrap();
    // the leading hypothesis is in force, without a proof
    let gates = Gates {
        enabled: WITHOUT_MAP & !(1 << ZERO_CORRECTION),
        ..Gates::default()
    };
    let got = learn(&session, &assumptions, gates, None, until).unwrap();
    assert_eq!(got.running, want.bank.leading());
    let apart = got.nav.position.ned_from(&want.nav().position).norm();
    let speed = (got.nav.velocity - want.nav().velocity).norm();
    let turn = got.nav.q_bn.angle_to(&want.nav().q_bn);
    println!("{apart:.3} m, {speed:.5} m/s, {turn:.2e} rad");
    assert!(
        apart < 0.3 && speed < 0.01 && turn < 5e-4,
        "{apart} {speed} {turn}"
    );
    let gates = Gates {
        enabled: WITHOUT_MAP,
        ..Gates::default()
    };
    let got_all = learn(&session, &assumptions, gates, None, until).unwrap();
    for index in (1..HYPOTHESES).filter(|index| *index != MAP) {
        let ratio = got_all.evidence[index] / want.bank.evidence(index);
        assert!((ratio - 1.0).abs() < 0.15, "{index}: {ratio}");
    }
    for i in 0..6 {
        let scale = [assumptions.prior.gyro_bias, assumptions.prior.accel_bias][i / 3];
        let gap = (f64::from(got.estimate[i / 3][i % 3]) - want.bank.estimate()[i]) / scale;
        assert!(gap.abs() < 0.25, "{i}: {gap}");
    }
}

#[test]
fn an_outlier_moves_nothing_and_a_lasting_jump_is_believed() {
    let (session, assumptions) = session(ErrorModelName::Noise, 3);
    let increments = session.increments();
    let n = session.steps_per_epoch();
    let mut learner = F64Learner::taught(&session, &increments, &assumptions, 300).unwrap();
    let epoch = |k: usize| &increments[k * n..(k + 1) * n];
    let fix = |k: usize, off: f64| {
        let mut fix = fix_at(&session, k + 1).unwrap();
        fix.velocity.x += off;
        fix
    };
    let bad = fix(300, f64::NAN);
    assert_eq!(learner.learn(epoch(300), session.step_s(), &bad), 1 << 3);
    let bad = fix(301, 50.0);
    assert_eq!(learner.learn(epoch(301), session.step_s(), &bad), 1 << 3);
    let good = fix(302, 0.0);
    assert_eq!(learner.learn(epoch(302), session.step_s(), &good), 0);
    let refused = (303..320)
        .take_while(|&k| {
            let jump = fix(k, 50.0);
            learner.learn(epoch(k), session.step_s(), &jump) != 0
        })
        .count();
    assert_eq!(refused, 10);
    assert!((0..HYPOTHESES).all(|i| learner.bank.is_healthy(i)));
}

/// Six sums of sensor errors instead of a navigation, with a reference for the sums every 10 s.
/// Only the output weights learn: with all weights at once, an extended filter without process
/// noise stays 11 % off such a curve.
#[test]
fn window_references_teach_without_navigation() {
    let (_, assumptions) = session(ErrorModelName::Linear, 1);
    let sheet = datasheet(&assumptions);
    let [_, sigma] = weights::<f32>(1.0, 0.3);
    let bias = [sheet.gyro_bias, sheet.accel_bias].map(|b| [b; 3]);
    let prior: Prior<6, 24> = Prior {
        error_sigma: [0.0; 6],
        parameter_sigma: Networks::<OutputWeights, 24>::sigmas(
            bias,
            &Correction::NONE.maps,
            &[sigma; 2],
        ),
        walk: [0.0; 6],
        error_floor: [0.0; 6],
        parameter_floor: 0.0,
    };
    let mut filter: Kalman<OutputWeights, 6, 24, 300> =
        Kalman::new(Networks::new(sheet.nets(1.0)), prior);
    let unit = |i: usize, j: usize| f32::from(u8::from(i == j));
    let second: Transition<6> = Transition {
        phi: std::array::from_fn(|i| std::array::from_fn(|j| unit(i, j))),
        gamma: std::array::from_fn(|i| std::array::from_fn(|j| unit(i, j))),
        time: 1.0,
        ..Transition::ZEROED
    };
    // a warm-up that a bias alone does not follow
    let truth = |k: usize, i: usize| {
        let scale = [sheet.gyro_bias, sheet.accel_bias][i / 3];
        scale * (0.5 + 0.4 * (-(k as f32) / 400.0).exp())
    };
    let mut sums = [0.0; 6];
    for k in 0..1200 {
        filter.step([[0.0; 3], [0.0, 0.0, -9.8]]);
        filter.propagate(&second, &Correction::NONE);
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum += truth(k, i);
        }
        if k % 10 == 9 {
            for (i, sum) in sums.iter().enumerate() {
                let sigma = 0.1 * truth(0, i);
                let innovation = filter.innovation(i, -sum, sigma * sigma);
                filter.score(innovation, f32::MAX);
                filter.update(i, innovation);
            }
            filter.finish_update();
            filter.reset_errors(&[0.0; 6]);
            sums = [0.0; 6];
        }
    }
    for i in 0..6 {
        let (got, want) = (filter.model().estimate()[i], truth(1199, i));
        assert!((got / want - 1.0).abs() < 0.02, "{i}: {got} {want}");
    }
    assert!(filter.is_healthy());
}

#[test]
fn the_zero_correction_learns_nothing() {
    let (_, assumptions) = session(ErrorModelName::Linear, 1);
    let sheet = datasheet(&assumptions);
    let prior =
        sheet.prior::<NoParameters, 0>(Layers::Time(&Weights::zero()), 0.0, [1.0; 9], [0.0; 9]);
    let mut filter: Kalman<NoParameters, 9, 0, 0, Rational> =
        Kalman::new(Networks::new(sheet.nets(1.0)), prior);
    filter.step([[1.0; 3]; 2]);
    filter.update(4, filter.innovation(4, 0.5, 1.0));
    assert_eq!(*filter.model().estimate(), [0.0; 6]);
    assert_eq!(filter.error_state()[4], 0.25);
}
