use super::*;
use lrnn_nostd::learn::kalman::{Biases, Correction, Kalman, Prior, Transition};
use lrnn_nostd::{Net, Normalisation, Weights};

const UNIT: [f32; OUTPUTS] = [2e-3, 1e-3, 3e-3, 0.1, 0.2, 0.05];

/// A filter of six biases.
type Biased = Kalman<Biases, ERRORS, OUTPUTS, 21>;

/// Covariance of the biases of a filter.
fn of_biases(kalman: &Biased) -> OfBiases {
    let covariance = kalman.covariance();
    core::array::from_fn(|i| core::array::from_fn(|j| covariance.parameter(i, j)))
}

/// A filter that knows the prior only.
fn empty() -> Biased {
    let prior = Prior {
        error_sigma: [1.0; ERRORS],
        parameter_sigma: UNIT,
        walk: [0.0; OUTPUTS],
        error_floor: [1e-9; ERRORS],
        parameter_floor: 1e-4,
    };
    let mut kalman = Biased::ZEROED;
    let net = Net::new(Weights::zero(), Normalisation::identity());
    kalman.init(&[net; 2], &prior);
    kalman
}

/// A filter that has made several observations of several mixtures of its biases.
fn taught() -> Biased {
    let mut kalman = empty();
    for round in 0..4 {
        let mut block: Transition<ERRORS> = Transition::ZEROED;
        block.time = 1.0;
        for i in 0..ERRORS {
            block.phi[i][i] = 1.0;
            block.q[i][i] = 1e-4;
            block.gamma[i] = core::array::from_fn(|j| {
                libm::sinf((1.7 * (i + 1) as f32) * (j + 2) as f32 + round as f32) / UNIT[j]
            });
        }
        kalman.propagate(&block, &Correction::NONE);
        for i in 0..ERRORS {
            let z = libm::cosf((i + 2 * round) as f32);
            let innovation = kalman.innovation(i, z, 0.05 + 0.1 * i as f32);
            kalman.update(i, innovation);
        }
    }
    kalman.finish_update();
    kalman
}

/// The textbook's update of a mean and a covariance by one observation of `row x`, in f64.
fn update(
    x: &mut [f64; OUTPUTS],
    p: &mut [[f64; OUTPUTS]; OUTPUTS],
    row: [f64; OUTPUTS],
    z: f64,
    variance: f64,
) {
    let ph: [f64; OUTPUTS] = core::array::from_fn(|i| (0..OUTPUTS).map(|j| p[i][j] * row[j]).sum());
    let s: f64 = (0..OUTPUTS).map(|i| row[i] * ph[i]).sum::<f64>() + variance;
    let left = z - (0..OUTPUTS).map(|i| row[i] * x[i]).sum::<f64>();
    for i in 0..OUTPUTS {
        x[i] += ph[i] / s * left;
    }
    *p = core::array::from_fn(|i| core::array::from_fn(|j| p[i][j] - ph[i] * ph[j] / s));
}

/// The prior together with the observations gives the filter's estimate.
#[test]
fn what_was_shown_leads_from_the_prior_to_the_filters_opinion() {
    let kalman = taught();
    let bias_observations =
        bias_observations(&of_biases(&kalman), kalman.model().estimate(), &UNIT).expect("positive");
    let mut x = [0.0; OUTPUTS];
    let mut p = [[0.0; OUTPUTS]; OUTPUTS];
    (0..OUTPUTS).for_each(|i| p[i][i] = f64::from(UNIT[i]).powi(2));
    for k in 0..OUTPUTS {
        let (z, variance) = (
            f64::from(bias_observations.z[k]),
            f64::from(bias_observations.variance[k]),
        );
        assert!(variance.is_finite(), "{k}");
        update(
            &mut x,
            &mut p,
            bias_observations.rows[k].map(f64::from),
            z,
            variance,
        );
    }
    let mean = kalman.model().estimate();
    for i in 0..OUTPUTS {
        let unit = f64::from(UNIT[i]);
        let off = (x[i] - f64::from(mean[i])) / unit;
        assert!(off.abs() < 1e-3, "{i}: {} {}", x[i], mean[i]);
        for j in 0..OUTPUTS {
            let of = f64::from(kalman.covariance().parameter(i, j));
            let off = (p[i][j] - of) / (unit * f64::from(UNIT[j]));
            assert!(off.abs() < 1e-3, "{i} {j}: {} {of}", p[i][j]);
        }
    }
    // it has learnt something, and not all biases alike
    let known = |i: usize| p[i][i].sqrt() / f64::from(UNIT[i]);
    assert!(
        (0..OUTPUTS).all(|i| known(i) < 0.7),
        "{:?}",
        [0, 1, 2, 3, 4, 5].map(known)
    );
}

#[test]
fn nothing_is_shown_before_the_first_fix() {
    let kalman = empty();
    let bias_observations =
        bias_observations(&of_biases(&kalman), kalman.model().estimate(), &UNIT).expect("positive");
    assert_eq!(bias_observations.variance, [f32::INFINITY; OUTPUTS]);
}
