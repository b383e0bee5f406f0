use super::*;
use nalgebra::UnitQuaternion;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

const G: f64 = 9.8087;
/// Standard deviation of a rest's mean, and of what the bias does between the rests, m/s2.
const MEAN: f64 = 3e-4;
const WALK: f64 = 5e-4;

/// True errors, and the rests in which a sensor with them was.
struct Truth {
    map: Matrix3<f64>,
    bias: Vector3<f64>,
    positions: Vec<Position>,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A sensor of some per cent in attitudes that are `tilt` rad off the six sides, so often.
fn truth(seed: u64, rests: usize, tilt: f64, truth_g: f64) -> Truth {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let map = Matrix3::from_fn(|_, _| 0.01 * normal(rng));
    let bias = Vector3::from_fn(|_, _| 0.2 * normal(rng));
    let angle = Uniform::new(0.0, std::f64::consts::PI).unwrap();
    let positions = (0..rests).map(|k| {
        let side = Vector3::ith(k % 6 / 2, if k % 2 == 0 { truth_g } else { -truth_g });
        // beyond the six sides any attitude
        let off = match k {
            0..6 => Vector3::from_fn(|_, _| tilt * normal(rng)),
            _ => Vector3::from_fn(|_, _| angle.sample(rng)),
        };
        let f = UnitQuaternion::from_scaled_axis(off) * side;
        // f = (1 - M) (z - B)
        let z = (Matrix3::identity() - map).try_inverse().unwrap() * f + bias;
        let noise = MEAN.hypot(WALK);
        Position {
            name: format!("rest {k}"),
            force: z + Vector3::from_fn(|_, _| noise * normal(rng)),
            sigma: MEAN,
            rate: Vector3::zeros(),
        }
    });
    let positions = positions.collect();
    Truth {
        map,
        bias,
        positions,
    }
}

/// Errors in standard deviations: of what the rests show, and of all.
fn off(truth: &Truth, fit: &Fit) -> [Vec<f64>; 2] {
    let all = (0..9).map(|i| {
        let (i, j) = (i / 3, i % 3);
        (fit.map[i][j] - truth.map[(i, j)]) / fit.map_sigma[i][j]
    });
    let bias = (0..3).map(|i| (fit.bias[i] - truth.bias[i]) / fit.bias_sigma[i]);
    let all: Vec<f64> = all.chain(bias).collect();
    let pairs = [[0, 1], [0, 2], [1, 2]];
    let skew = pairs.map(|[i, j]| {
        let [value, sigma] = fit.skew([i, j]);
        (value - truth.map[(i, j)] - truth.map[(j, i)]) / sigma
    });
    let shown = [0, 4, 8, 9, 10, 11].map(|i| all[i]);
    [shown.into_iter().chain(skew).collect(), all]
}

/// The stated standard deviations hold: within 3 of them in at least 95 of 100 units, whatever
/// the rests were and whether gravity is known; and they are not much too large.
#[test]
fn estimates_are_within_three_of_their_standard_deviations() {
    let known = [G, 5e-4];
    let anywhere = [9.80625, 0.015];
    for (rests, tilt, gravity, placement) in [
        (6, 0.05, known, None),
        (9, 0.05, known, None),
        (12, 0.05, known, None),
        (24, 0.05, known, None),
        (24, 0.05, anywhere, None),
        (6, 0.003, known, Some(0.003)),
    ] {
        let (mut held, mut squares, mut count) = (0, 0.0, 0.0);
        for seed in 0..100 {
            let truth = truth(seed, rests, tilt, G + 4e-4);
            let fit = fit(&truth.positions, gravity, WALK, placement).unwrap();
            let [shown, all] = off(&truth, &fit);
            let within = |of: &[f64]| of.iter().all(|x| x.abs() < 3.0);
            held += usize::from(within(&shown) && within(&all));
            squares += shown.iter().map(|x| x * x).sum::<f64>();
            count += shown.len() as f64;
        }
        let size = (squares / count).sqrt();
        println!(
            "{rests} rests, {tilt} rad, {placement:?}: {held} of 100 hold, error {size:.2} sigma"
        );
        assert!(held >= 95, "{rests} {placement:?}: {held}");
        // twelve rests and more show all nine
        assert!(rests < 12 || (0.6..1.1).contains(&size), "{rests}: {size}");
    }
}

#[test]
fn a_fit_leaves_little_of_errors_of_per_cents() {
    let truth = truth(7, 24, 0.05, G);
    let fit = fit(&truth.positions, [G, 5e-4], WALK, None).unwrap();
    assert!(fit.left[0] > 0.05 && fit.left[1] < 1e-3, "{:?}", fit.left);
    assert!(fit.degrees > 12.0 && fit.enlarged < 1.6, "{fit:?}");
    assert!((0..3).all(|i| fit.shows_bias(i) && fit.shows_scale(i)));
    assert!(fit.shows_skew([0, 1]) && fit.shows_skew([1, 2]));
    // the common rotation is not shown: each element keeps most of its prior
    assert!(fit.map_sigma[0][1] > 0.5 * PRIOR[0], "{:?}", fit.map_sigma);
}

#[test]
fn what_six_exact_sides_cannot_show_keeps_its_prior() {
    let truth = truth(3, 6, 0.0, G);
    let fit = fit(&truth.positions, [G, 5e-4], WALK, None).unwrap();
    assert!(
        (0..3).all(|i| fit.shows_bias(i) && fit.shows_scale(i)),
        "{fit:?}"
    );
    assert!(
        ![[0, 1], [0, 2], [1, 2]]
            .iter()
            .any(|pair| fit.shows_skew(*pair))
    );
    // two sides alone show neither bias nor scale of the other axes
    let two: Vec<Position> = truth.positions[..2]
        .iter()
        .cycle()
        .take(6)
        .cloned()
        .collect();
    let fit = super::fit(&two, [G, 5e-4], WALK, None).unwrap();
    assert!(fit.shows_bias(0) && !fit.shows_bias(1) && !fit.shows_scale(2));
}

/// A scatter that the stated noise does not explain makes the standard deviations larger.
#[test]
fn rests_that_contradict_each_other_enlarge_the_standard_deviations() {
    let mut truth = truth(5, 24, 0.05, G);
    let before = fit(&truth.positions, [G, 5e-4], WALK, None).unwrap();
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    for position in &mut truth.positions {
        position.force += Vector3::from_fn(|_, _| 0.01 * normal(rng));
    }
    let after = fit(&truth.positions, [G, 5e-4], WALK, None).unwrap();
    assert!(after.enlarged > 5.0, "{}", after.enlarged);
    assert!(after.bias_sigma[0] > 3.0 * before.bias_sigma[0]);
    let [shown, _] = off(&truth, &after);
    assert!(shown.iter().all(|x| x.abs() < 4.0), "{shown:?}");
}

#[test]
fn a_placement_needs_sides() {
    let truth = truth(7, 12, 0.05, G);
    let error = fit(&truth.positions, [G, 5e-4], WALK, Some(0.01))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("--placement-deg") && error.contains("rest 6"),
        "{error}"
    );
}
