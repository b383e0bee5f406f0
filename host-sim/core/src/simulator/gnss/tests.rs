//! Each error of the receiver against a closed form.

use super::*;
use crate::inertial::earth::Geodetic;
use nalgebra::UnitQuaternion;
use rand::SeedableRng;

const HOURS: usize = 100;

fn standing() -> NavState {
    NavState {
        position: Geodetic {
            lat: 0.6,
            lon: 0.2,
            h: 100.0,
        },
        velocity: Vector3::zeros(),
        q_bn: UnitQuaternion::identity(),
    }
}

fn fixes(spec: &GnssSpec) -> Vec<Option<Fix>> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    spec.fixes(&vec![standing(); HOURS * 3600], 1.0, &mut rng)
}

/// Errors of a standing receiver; NaN where there is no fix.
fn errors(spec: &GnssSpec) -> Vec<[f64; 6]> {
    let error = |fix: Option<Fix>| {
        let fix = fix?;
        let [n, e, d] = fix.position.ned_from(&standing().position).into();
        let [vn, ve, vd] = fix.velocity.into();
        Some([n, e, d, vn, ve, vd])
    };
    let all = fixes(spec).into_iter();
    all.map(|fix| error(fix).unwrap_or([f64::NAN; 6])).collect()
}

/// Autocovariance of one value at a lag.
fn covariance(errors: &[[f64; 6]], value: usize, lag: usize) -> f64 {
    let pairs = errors.iter().zip(&errors[lag..]);
    let sum: f64 = pairs.map(|(a, b)| a[value] * b[value]).sum();
    sum / (errors.len() - lag) as f64
}

/// White noise so small that it does not count.
fn quiet() -> GnssSpec {
    GnssSpec {
        horizontal_m: 1e-3,
        vertical_m: 1e-3,
        velocity_mps: 1e-4,
        ..GnssSpec::default()
    }
}

#[test]
fn without_the_terms_every_bit_is_that_of_the_white_noise() {
    let spec = GnssSpec::default();
    let (mut rng, mut other) = (ChaCha8Rng::seed_from_u64(3), ChaCha8Rng::seed_from_u64(3));
    let got = spec.fixes(&[standing(); 50], 1.0, &mut rng);
    for fix in got {
        let noise: [f64; 6] = [1.0, 1.0, 1.5, 0.05, 0.05, 0.05].map(|sigma| {
            let z: f64 = StandardNormal.sample(&mut other);
            sigma * z
        });
        let [n, e, d, velocity @ ..] = noise;
        let position = standing().position.displaced(&Vector3::new(n, e, d));
        let sigmas = [1.0, 1.0, 1.5, 0.05, 0.05, 0.05];
        assert_eq!(fix, Some(Fix::new(position, velocity.into(), sigmas)));
    }
    assert_eq!(rng, other);
}

/// The autocovariance of a first-order Gauss-Markov process is sigma^2 exp(-lag / T).
#[test]
fn coloured_errors_fade_with_their_time_constants() {
    let spec = GnssSpec {
        coloured: Coloured {
            horizontal_m: 2.0,
            vertical_m: 3.0,
            velocity_mps: 0.1,
            time_s: 40.0,
            velocity_time_s: 4.0,
        },
        ..quiet()
    };
    let errors = errors(&spec);
    for (value, sigma, time) in [(0, 2.0_f64, 40.0_f64), (2, 3.0, 40.0), (4, 0.1, 4.0)] {
        for lag in [0, 2, 10, 40, 120] {
            let want = (-(lag as f64) / time).exp();
            let got = covariance(&errors, value, lag) / sigma.powi(2);
            // one sigma of the estimate is about sqrt(2 T / length) = 0.015 at 40 s
            assert!((got - want).abs() < 0.05, "{value} {lag}: {got} {want}");
        }
    }
    // the axes are independent, and the first error is as large as the later ones
    let cross: f64 = errors.iter().map(|e| e[0] * e[1]).sum::<f64>() / errors.len() as f64;
    assert!((cross / 4.0).abs() < 0.05, "{cross}");
    let first = |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let fix = spec.fixes(&[standing()], 1.0, &mut rng)[0].unwrap();
        fix.position.ned_from(&standing().position).x
    };
    let square = (0..4000).map(|seed| first(seed).powi(2)).sum::<f64>() / 4000.0;
    assert!((square / 4.0 - 1.0).abs() < 0.1, "{square}");
}

/// Variances of independent errors add. The reported accuracy is a factor times the square root.
#[test]
fn the_reported_accuracy_is_a_factor_of_the_true_one() {
    let spec = GnssSpec {
        horizontal_m: 3.0,
        told_factor: 0.5,
        coloured: Coloured {
            horizontal_m: 4.0,
            ..Coloured::default()
        },
        ..GnssSpec::default()
    };
    let reported = fixes(&spec)[0].unwrap().sigmas;
    assert_eq!(reported, [2.5, 2.5, 0.75, 0.025, 0.025, 0.025]);
    let errors = errors(&spec);
    for (value, sigma) in reported.into_iter().enumerate() {
        let rms = covariance(&errors, value, 0).sqrt();
        assert!((sigma / rms - 0.5).abs() < 0.02, "{value}: {rms}");
    }
}

/// A two-state Markov process with rates a (into the bad state) and b (out of it) is bad with
/// probability a / (a + b), its autocorrelation is exp(-(a + b) lag), and after a good start that
/// probability is reached as 1 - exp(-(a + b) t).
#[test]
fn gaps_come_and_go_as_a_two_state_process() {
    let spec = GnssSpec {
        gaps: Gaps {
            mean_interval_s: 60.0,
            mean_length_s: 10.0,
        },
        ..GnssSpec::default()
    };
    let (bad, rates) = (1.0 / 7.0, 1.0 / 60.0 + 1.0 / 10.0);
    let missing: Vec<[f64; 6]> = fixes(&spec)
        .iter()
        .map(|fix| [f64::from(u8::from(fix.is_none())) - bad; 6])
        .collect();
    let mean = missing.iter().map(|m| m[0]).sum::<f64>() / missing.len() as f64;
    assert!(mean.abs() < 0.01, "{mean}");
    for lag in [0, 1, 5, 20] {
        let got = covariance(&missing, 0, lag) / (bad * (1.0 - bad));
        let want = (-rates * lag as f64).exp();
        assert!((got - want).abs() < 0.05, "{lag}: {got} {want}");
    }
    for after in [0_u32, 3, 8] {
        let is_missing = |seed: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let fixes = spec.fixes(&vec![standing(); after as usize + 1], 1.0, &mut rng);
            fixes[after as usize].is_none()
        };
        let got = (0..8000).filter(|seed| is_missing(*seed)).count() as f64 / 8000.0;
        let want = bad * (1.0 - (-rates * f64::from(after)).exp());
        assert!((got - want).abs() < 0.015, "{after}: {got} {want}");
    }
    // the fixes that are left are those without gaps
    let whole = fixes(&GnssSpec::default());
    let left = fixes(&spec);
    let mut both = left.iter().zip(&whole).filter(|(left, _)| left.is_some());
    assert!(both.all(|(left, whole)| left == whole));
}

/// A burst goes on over a lag with probability exp(-lag / length), so the autocovariance of the
/// shift is its variance times the share of bad times times that.
#[test]
fn multipath_shifts_the_fix_in_bursts() {
    let spec = GnssSpec {
        multipath: Multipath {
            mean_interval_s: 20.0,
            mean_length_s: 10.0,
            horizontal_m: 8.0,
            vertical_m: 12.0,
            velocity_mps: 0.3,
            in_streets: false,
        },
        ..quiet()
    };
    let all = errors(&spec);
    for (value, sigma) in [(0, 8.0_f64), (1, 8.0), (2, 12.0), (5, 0.3)] {
        for lag in [0, 2, 10, 30] {
            let got = covariance(&all, value, lag) / sigma.powi(2);
            let want = (-(lag as f64) / 10.0).exp() / 3.0;
            assert!((got - want).abs() < 0.03, "{value} {lag}: {got} {want}");
        }
    }
    let shifted = all.iter().filter(|e| e[0].abs() > 0.01).count() as f64;
    let share = shifted / all.len() as f64;
    assert!((share - 1.0 / 3.0).abs() < 0.02, "{share}");
    // the reported accuracy does not contain it
    assert_eq!(spec.reported_sigmas(), quiet().reported_sigmas());
}
