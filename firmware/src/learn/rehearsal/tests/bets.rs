//! The bets by themselves, against numbers worked out from what [`super::super::bets`] says of
//! them.

use super::super::bets::{Bets, Wealth};
use super::super::*;

const H: usize = 3;
/// A horizon shorter than a block of slight gains, s.
const SHORT: f32 = 5.0;

/// Lets this time pass, and ends a coast with this score of each hypothesis.
fn coast(bets: &mut Bets, time: f32, score: f32, horizon: f32) {
    bets.passes(time);
    let scores = Scores {
        gains: [score; HYPOTHESES],
        extending: [score; HYPOTHESES],
    };
    bets.takes(&scores, horizon);
}

fn capital(bets: &Bets) -> [f64; 2] {
    bets.wealth[H].capital.map(f64::from)
}

fn near(found: f64, right: f64) {
    assert!((found / right - 1.0).abs() < 1e-5, "{found}, not {right}");
}

/// Value of a block with this mean score: on slight gains, and on large ones.
fn slight(mean: f64) -> f64 {
    1.0 + 0.95 * (mean - 0.2) / 1.2
}

fn large(mean: f64) -> f64 {
    1.0 + 0.95 * (mean - 1.5) / 3.5
}

/// A block of slight gains is a minute, and its factor is of the mean of all coasts that end in it.
/// One of large gains is as long as the horizon.
#[test]
fn a_block_is_one_factor() {
    let mut bets = Bets::NONE;
    bets.wealth[H].capital[1] = 2.0;
    coast(&mut bets, 30.0, 3.5, SHORT);
    let won = 2.0 * large(3.0); // of 3.5 counts 3
    near(capital(&bets)[0], 1.0);
    near(capital(&bets)[1], won);
    coast(&mut bets, 30.0, -0.5, SHORT);
    let won = won * large(-0.5);
    near(capital(&bets)[0], slight(0.25)); // of 3 counts 1
    near(capital(&bets)[1], won);
    // the next block knows nothing of the last one
    coast(&mut bets, 30.0, 0.8, SHORT);
    near(capital(&bets)[0], slight(0.25));
    coast(&mut bets, 30.0, -3.0, SHORT);
    let won = won * large(0.8) * large(-2.0);
    near(capital(&bets)[0], slight(0.25) * slight(-0.1)); // of -3 count -1 and -2
    near(capital(&bets)[1], won);
    assert_eq!(bets.count, 4);
}

/// A block ends with the first coast after its length, or 0.3 s before it.
#[test]
fn a_block_has_its_length() {
    for (time, horizon, ends) in [
        (4.6, SHORT, [false, false]),
        (4.8, SHORT, [false, true]),
        (59.6, SHORT, [false, true]),
        (60.0 - EARLY, SHORT, [true, true]),
        (59.75, SHORT, [true, true]),
        (119.6, 120.0, [false, false]),
        (119.75, 120.0, [true, true]),
    ] {
        let mut bets = Bets::NONE;
        coast(&mut bets, time, 4.0, horizon);
        let ended = capital(&bets).map(|capital| capital > 1.0);
        assert_eq!(ended, ends, "{time} of {horizon}");
    }
}

/// A capital stays between 0.05 and 10 000, so that neither luck counts for ever.
#[test]
fn capital_has_limits() {
    let mut bets = Bets::NONE;
    for _ in 0..100 {
        coast(&mut bets, 60.0, 4.0, SHORT);
    }
    assert_eq!(bets.wealth[H].capital, [1e4; 2]);
    for _ in 0..100 {
        coast(&mut bets, 60.0, -4.0, SHORT);
    }
    assert_eq!(bets.wealth[H].capital, [0.05; 2]);
    bets = Bets::NONE;
    coast(&mut bets, 60.0, f32::NAN, SHORT);
    let Wealth { capital, check, .. } = bets.wealth[H];
    assert_eq!((capital, check), ([0.05; 2], 0.05), "the worst");
}

/// The check stakes 0.3 at each coast, on scores cut to 1, and stays between 0.05 and 2.
#[test]
fn the_check_bets_at_each_coast() {
    let check = |bets: &Bets| f64::from(bets.wealth[H].check);
    let mut bets = Bets::NONE;
    coast(&mut bets, 1.0, 0.5, SHORT);
    near(check(&bets), 1.15);
    coast(&mut bets, 1.0, -3.0, SHORT);
    near(check(&bets), 1.15 * 0.7);
    for (score, limit) in [(1.0, 2.0), (-1.0, 0.05)] {
        (0..100).for_each(|_| coast(&mut bets, 1.0, score, SHORT));
        near(check(&bets), limit);
    }
}

/// The mean is of all scores, cut to 1, and of about the last twenty when there are more.
#[test]
fn the_mean_is_of_the_last_scores() {
    let mean = |bets: &Bets| f64::from(bets.wealth[H].mean);
    let mut bets = Bets::NONE;
    coast(&mut bets, 1.0, 0.5, SHORT);
    near(mean(&bets), 0.5);
    coast(&mut bets, 1.0, -3.0, SHORT);
    near(mean(&bets), -0.25);
    let mut bets = Bets::NONE;
    bets.count = 1000;
    coast(&mut bets, 1.0, 3.0, SHORT);
    near(mean(&bets), 0.05);
    bets.count = u16::MAX;
    coast(&mut bets, 1.0, 0.0, SHORT);
    assert_eq!(bets.count, u16::MAX, "it does not begin again");
}
