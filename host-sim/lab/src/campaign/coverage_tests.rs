//! How often an interval misses the true value, and so decides where there is no difference.

use super::statistics::{FEWEST, interval};
use super::{Row, ratios, summarise};
use crate::experiment::run::TIMES_MIN;
use host_core::simulator::imu::ErrorModelName;
use host_core::simulator::imu::world::StartName;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Bernoulli, Distribution, StandardNormal, StudentT};

/// A value with a median of 0.
type Sampler = fn(&mut ChaCha8Rng) -> f64;

/// Distributions like those of logarithms of errors and of their ratios, and worse ones.
const SHAPES: [(&str, Sampler); 6] = [
    ("normal", normal),
    ("log-normal", |rng| normal(rng).exp() - 1.0),
    ("Student's t, 3 degrees of freedom", |rng| {
        StudentT::new(3.0).unwrap().sample(rng)
    }),
    ("two clusters", |rng| {
        f64::from(chance(0.5, rng)) * 2.0 - 1.0 + 0.1 * normal(rng)
    }),
    ("half of them equal", |rng| {
        f64::from(chance(0.5, rng)) * normal(rng)
    }),
    // 5/8 of the first cluster lie below its own centre by 0.31864 standard deviations
    ("a fifth far off", |rng| {
        2.5 * f64::from(chance(0.2, rng)) + 0.1 * (normal(rng) - 0.318_64)
    }),
];
const RUNS: [u32; 12] = [2, 3, 5, 6, 7, 8, 9, 12, 17, 20, 50, 100];
/// Campaigns of each shape and number of runs. Each has [`TIMES_MIN`] independent results.
const CAMPAIGNS: usize = 400;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn chance(p: f64, rng: &mut ChaCha8Rng) -> u8 {
    Bernoulli::new(p).unwrap().sample(rng).into()
}

/// A campaign whose ratios vary by this shape around 1, and whose errors around 100 m: the number
/// of ratios that are decided, and of intervals of the errors that do not contain 100 m.
fn missed(shape: Sampler, runs: u32, rng: &mut ChaCha8Rng) -> [usize; 2] {
    let mut rows = vec![];
    for run in 0..runs {
        let mut errors = || TIMES_MIN.map(|_| 100.0 * shape(rng).exp());
        for (scheme, horizontal_m) in [("a", errors()), ("uncorrected", [100.0; TIMES_MIN.len()])] {
            let row = Row::north(ErrorModelName::All, run, scheme, 0.0);
            rows.push(Row {
                horizontal_m,
                ..row
            });
        }
    }
    let beside = |ends: Option<(f64, f64)>, truth: f64| {
        ends.is_some_and(|(low, high)| low > truth * (1.0 + 1e-9) || high < truth * (1.0 - 1e-9))
    };
    let ratios = ratios(&rows, StartName::Cold);
    let all = ratios.iter();
    let all = all.filter(|r| r.scheme == "a" && r.error_model.is_some());
    let cells = summarise(&rows, StartName::Cold);
    let cells = cells.iter().filter(|cell| cell.scheme == "a");
    [
        all.filter(|r| beside(r.interval(), 1.0)).count(),
        cells
            .filter(|cell| beside(cell.lo95_m.zip(cell.hi95_m), 100.0))
            .count(),
    ]
}

/// The share of false decisions is at most 5 %, plus four standard deviations of the share of this
/// number of campaigns.
#[test]
fn at_most_one_in_twenty_is_decided_where_there_is_no_difference() {
    let tried = (CAMPAIGNS * TIMES_MIN.len()) as f64;
    let limit = 0.05 + 4.0 * (0.05 * 0.95 / tried).sqrt();
    let mut wrong = vec![];
    for (seed, (name, shape)) in SHAPES.iter().enumerate() {
        for runs in RUNS {
            let mut rng = ChaCha8Rng::seed_from_u64(1000 * seed as u64 + u64::from(runs));
            let mut sums = [0; 2];
            for _ in 0..CAMPAIGNS {
                let of = missed(*shape, runs, &mut rng);
                sums = [sums[0] + of[0], sums[1] + of[1]];
            }
            let [decided, missed] = sums.map(|sum| sum as f64 / tried);
            println!("{name}, {runs} runs: {decided:.3} decided, {missed:.3} of medians missed");
            if decided.max(missed) > limit {
                wrong.push(format!("{name}, {runs} runs: {decided:.3}, {missed:.3}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The median lies below the value of a rank if fewer values than that are below the median, each
/// with a probability of a half. Here these probabilities are counted with integers.
#[test]
fn the_interval_is_the_narrowest_that_the_sign_test_allows() {
    let mut row = vec![1_u128]; // of Pascal's triangle
    for n in 1..=120_usize {
        let next = row.windows(2).map(|of| of[0] + of[1]);
        row = [1].into_iter().chain(next).chain([1]).collect();
        // number of cases with at most `k` values below the median, in twentieths of both tails
        let outside = |k: usize| 40 * row[..=k].iter().sum::<u128>();
        let all = 1_u128 << n;
        let values: Vec<f64> = (0..n).map(|k| k as f64).collect();
        match interval(&values) {
            None => assert!(n < FEWEST && outside(0) > all, "{n}"),
            Some((low, high)) => {
                assert!(n >= FEWEST && low + high == (n - 1) as f64, "{n}");
                assert!(outside(low as usize) <= all, "{n}: too narrow");
                assert!(outside(low as usize + 1) > all, "{n}: too wide");
            }
        }
    }
    assert_eq!(interval(&[]), None);
}
