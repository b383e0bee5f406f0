use super::super::{Correction, ErrorModel, Prior, Transition, UnitOutput};
use super::*;
use crate::{Full, Identity, Net, Normalisation, Rational, Weights};
use std::vec::Vec;

const PARAMETERS: usize = 30;
const ALL: usize = OUTPUTS + PARAMETERS;
const NOTHING: [f64; OUTPUTS] = [0.0; OUTPUTS];

type Filter = Kalman<UnitOutput, OUTPUTS, PARAMETERS, 465, Rational, f64>;

fn nets() -> [Net<Rational, Identity, Full, f64>; 2] {
    let mut weights = Weights::zero();
    for (i, layer) in weights.layers.iter_mut().enumerate() {
        for (j, w) in layer.w.as_flattened_mut().iter_mut().enumerate() {
            *w = 0.3 * ((i * 9 + j) as f64).sin();
        }
    }
    [Net::new(weights, Normalisation::identity()); 2]
}

/// A filter in the middle of a drive: everything is correlated with everything.
fn driven() -> Filter {
    let prior = Prior {
        error_sigma: [0.3; OUTPUTS],
        parameter_sigma: core::array::from_fn(|i| 0.5 + 0.1 * (i as f64).cos()),
        walk: [1e-3; OUTPUTS],
        error_floor: [0.0; OUTPUTS],
        parameter_floor: 0.0,
    };
    let mut filter = Filter::new(ErrorModel::new(nets()), prior);
    let mix = |i: usize, j: usize| 0.4 * ((3 * i + 5 * j) as f64).sin() + f64::from(i == j);
    for step in 0..4 {
        filter.step([[0.7, -0.2, 0.1 * f64::from(step)], [0.3, 0.5, -0.4]]);
        let block = Transition {
            phi: core::array::from_fn(|i| core::array::from_fn(|j| mix(i, j))),
            gamma: core::array::from_fn(|i| core::array::from_fn(|j| mix(i + 1, j))),
            time: 1.0,
            ..Transition::ZEROED
        };
        filter.propagate(&block, &Correction::NONE);
        let innovation = filter.innovation(step as usize, 0.4, 0.2);
        filter.update(step as usize, innovation);
    }
    filter
}

/// Means (errors, outputs) and the covariance of errors and parameters.
struct Dense {
    x: Vec<f64>,
    e: Vec<f64>,
    p: Vec<Vec<f64>>,
    j: Vec<Vec<f64>>,
}

fn dense(filter: &mut Filter) -> Dense {
    filter.finish_update();
    let of = filter.covariance();
    let entry = |i: usize, j: usize| match (i < OUTPUTS, j < OUTPUTS) {
        (true, true) => of.errors()[i][j],
        (true, false) => of.cross()[i][j - OUTPUTS],
        (false, true) => of.cross()[j][i - OUTPUTS],
        (false, false) => of.parameter(i - OUTPUTS, j - OUTPUTS),
    };
    let p = (0..ALL)
        .map(|i| (0..ALL).map(|j| entry(i, j)).collect())
        .collect();
    let mut rows = std::vec![std::vec![0.0; PARAMETERS]; OUTPUTS];
    for (triad, of) in filter.model().jacobian().iter().enumerate() {
        for (n, values) in of.values.iter().enumerate() {
            for (k, value) in values.iter().enumerate() {
                rows[3 * triad + k][of.start + n] = *value;
            }
        }
    }
    Dense {
        x: filter.error_state().to_vec(),
        e: filter.model().estimate().to_vec(),
        p,
        j: rows,
    }
}

/// The update is the textbook's, `K = P H' / s` with `H = [by, -J_k]`, over the whole state.
#[test]
fn an_observed_output_is_the_textbook_update() {
    let slanting: [f64; OUTPUTS] = core::array::from_fn(|i| 0.3 * (2.0 + i as f64).sin());
    for (k, by) in (0..OUTPUTS).flat_map(|k| [(k, [0.0; OUTPUTS]), (k, slanting)]) {
        let mut filter = driven();
        let before = dense(&mut filter);
        let (z, variance) = (0.25, 0.05);
        let h: Vec<f64> = (0..ALL)
            .map(|i| {
                if i < OUTPUTS {
                    by[i]
                } else {
                    -before.j[k][i - OUTPUTS]
                }
            })
            .collect();
        let c: Vec<f64> = (before.p.iter())
            .map(|row| row.iter().zip(&h).map(|(p, h)| p * h).sum())
            .collect();
        let s: f64 = c.iter().zip(&h).map(|(c, h)| c * h).sum::<f64>() + variance;
        let seen: f64 = by.iter().zip(&before.x).map(|(by, x)| by * x).sum();
        let v = z - before.e[k] - seen;

        let innovation = filter.innovation_of_output(k, &by, z, variance);
        assert!((innovation.value - v).abs() < 1e-12);
        assert!((innovation.variance - s).abs() < 1e-12 * s, "{s}");
        let (of_x, of_e) = filter.update_output(k, &by, z, variance);
        let after = dense(&mut filter);
        for i in 0..ALL {
            for j in 0..ALL {
                let expected = before.p[i][j] - c[i] * c[j] / s;
                assert!((after.p[i][j] - expected).abs() < 1e-12, "{k}: P {i} {j}");
            }
        }
        for i in 0..OUTPUTS {
            let gain = c[i] / s;
            assert!((after.x[i] - before.x[i] - gain * v).abs() < 1e-12);
            assert!((of_x[i] - gain).abs() < 1e-12);
            let theta: f64 = (0..PARAMETERS)
                .map(|n| before.j[i][n] * c[OUTPUTS + n] / s)
                .sum();
            assert!((after.e[i] - before.e[i] + theta * v).abs() < 1e-12);
            assert!((of_e[i] - theta).abs() < 1e-12);
        }
        if by == [0.0; OUTPUTS] {
            assert!(after.e[k] > before.e[k], "towards what was observed");
        }
    }
}

/// An exact observation leaves no doubt of this output, and no output beyond is touched.
#[test]
fn an_output_that_is_known_stays_as_it_is() {
    let mut filter = driven();
    filter.update_output(1, &NOTHING, 0.6, 1e-9);
    assert!((filter.model().estimate()[1] - 0.6).abs() < 1e-8);
    let again = filter.innovation_of_output(1, &NOTHING, 0.6, 0.0);
    assert!(again.variance < 1.1e-9, "{}", again.variance);
    let none = filter.innovation_of_output(OUTPUTS, &NOTHING, 1.0, 0.5);
    assert_eq!((none.value, none.variance), (1.0, 0.5));
    let before = filter.clone();
    filter.update_output(OUTPUTS, &NOTHING, 1.0, 0.5);
    assert_eq!(filter, before);
}
