//! Each rule of what has proved itself, and of which hypothesis is chosen, by itself.

use super::super::bets::Wealth;
use super::super::*;
use std::boxed::Box;

const H: usize = 3;
const OTHER: usize = 5;
const LONGEST: usize = HORIZONS - 1;

/// A hypothesis that has just enough of everything at each horizon.
const GOOD: Wealth = Wealth {
    capital: [PROVED; 2],
    sums: [0.0; 2],
    check: 1.0,
    mean: 0.9,
};

/// Every horizon has been tried, and [`H`] is good at each.
fn good() -> Box<Rehearsal> {
    let mut rehearsal = Box::new(Rehearsal::ZEROED);
    rehearsal.begin();
    for horizon in &mut rehearsal.horizons {
        horizon.bets.count = TRIED;
        horizon.bets.wealth[H] = GOOD;
    }
    rehearsal
}

fn change(rehearsal: &mut Rehearsal, horizon: usize, how: impl Fn(&mut Wealth)) {
    how(&mut rehearsal.horizons[horizon].bets.wealth[H]);
}

fn every(rehearsal: &mut Rehearsal, how: impl Fn(&mut Wealth)) {
    (0..HORIZONS).for_each(|horizon| change(rehearsal, horizon, &how));
}

fn chosen(rehearsal: &mut Rehearsal) -> usize {
    rehearsal.choose(|_| 0.0)
}

#[test]
fn what_is_good_everywhere_is_chosen() {
    let mut rehearsal = good();
    assert_eq!(chosen(&mut rehearsal), H);
    let proved: Vec<_> = (0..HYPOTHESES)
        .filter(|h| rehearsal.has_proved(*h))
        .collect();
    assert_eq!(proved, [H]);
}

/// One horizon is enough, where both bets together have what it takes.
#[test]
fn the_richest_horizon_proves() {
    for (capital, proves) in [
        ([299.0, 0.05], false),
        ([300.0, 0.05], true),
        ([1.0, 298.0], false),
        ([1.0, 299.0], true),
    ] {
        let mut rehearsal = good();
        every(&mut rehearsal, |of| of.capital = [1.0, 0.05]);
        change(&mut rehearsal, 2, |of| of.capital = capital);
        assert_eq!(chosen(&mut rehearsal) == H, proves, "{capital:?}");
    }
}

/// A horizon counts as tried after three coasts.
#[test]
fn three_coasts_are_a_trial() {
    for (count, longest) in [(2, 0.0), (3, PROVED)] {
        let mut rehearsal = good();
        for horizon in &mut rehearsal.horizons {
            horizon.bets.count = count;
        }
        assert_eq!(rehearsal.standing(H).longest, longest, "{count}");
    }
}

/// The longest horizon that was tried has a veto, a longer one that was not has none.
#[test]
fn the_longest_horizon_has_a_veto() {
    let lost = |of: &mut Wealth| of.capital = [0.9, 1e4];
    let mut rehearsal = good();
    change(&mut rehearsal, LONGEST, lost);
    assert_eq!(chosen(&mut rehearsal), ZERO_CORRECTION);
    for (count, choice) in [(TRIED - 1, H), (TRIED, ZERO_CORRECTION)] {
        let mut rehearsal = good();
        rehearsal.horizons[LONGEST].bets.count = count;
        change(&mut rehearsal, LONGEST, lost);
        assert_eq!(chosen(&mut rehearsal), choice, "{count}");
    }
    let mut rehearsal = good();
    change(&mut rehearsal, LONGEST - 1, lost);
    assert_eq!(chosen(&mut rehearsal), H, "only the longest");
}

/// A hypothesis found harmful at any horizon does not prove itself, whatever it has won.
#[test]
fn what_may_harm_is_not_proved() {
    for horizon in 0..HORIZONS {
        for (check, choice) in [(0.49, ZERO_CORRECTION), (0.5, H)] {
            let mut rehearsal = good();
            change(&mut rehearsal, horizon, |of| {
                (of.capital, of.check) = ([1e4; 2], check);
            });
            assert_eq!(chosen(&mut rehearsal), choice, "{horizon} {check}");
        }
    }
}

/// A proof stays while less is left than it took, and not below that, and not when it harms.
#[test]
fn a_proof_is_kept_for_a_while() {
    let left = |capital: f32, check: f32| {
        let mut rehearsal = good();
        assert_eq!(chosen(&mut rehearsal), H);
        every(&mut rehearsal, |of| of.capital = [capital; 2]);
        change(&mut rehearsal, 1, |of| of.check = check);
        chosen(&mut rehearsal)
    };
    assert_eq!(left(20.0, 0.25), H);
    assert_eq!(left(19.9, 0.25), ZERO_CORRECTION);
    assert_eq!(left(20.0, 0.24), ZERO_CORRECTION);
    let mut rehearsal = good();
    every(&mut rehearsal, |of| of.capital = [149.0; 2]);
    assert_eq!(chosen(&mut rehearsal), ZERO_CORRECTION, "never proved");
    assert!(!rehearsal.harms(H));
    for (check, harms) in [(0.4, false), (0.25, false), (0.24, true)] {
        change(&mut rehearsal, 4, |of| of.check = check);
        assert_eq!(rehearsal.harms(H), harms, "{check}");
    }
}

/// A navigator that was lost takes nothing back; after one that was aligned wrongly a proof is
/// none, and earlier capital counts ten stakes.
#[test]
fn past_capital_is_limited_after_a_wrong_alignment() {
    let mut rehearsal = good();
    every(&mut rehearsal, |of| of.capital = [1e4, 5.0]);
    assert_eq!(chosen(&mut rehearsal), H);
    rehearsal.interrupted();
    assert_eq!(chosen(&mut rehearsal), H);
    assert_eq!(rehearsal.standing(H).proof, 5002.5);
    rehearsal.doubt();
    assert!(!rehearsal.has_proved(H));
    assert_eq!(rehearsal.standing(H).proof, 7.5);
    assert_eq!(chosen(&mut rehearsal), ZERO_CORRECTION);
}

/// A proof that was not renewed for an hour is none any more; a coast renews it.
#[test]
fn a_proof_gets_stale() {
    let mut rehearsal = good();
    assert_eq!(chosen(&mut rehearsal), H);
    for _ in 0..3600 {
        rehearsal.interval(&second(), &Correction::NONE);
    }
    assert_eq!(chosen(&mut rehearsal), H, "just not yet");
    rehearsal.interval(&second(), &Correction::NONE);
    assert_eq!(chosen(&mut rehearsal), ZERO_CORRECTION);
    assert!(!rehearsal.has_proved(H));
    // a block that is due would change the capital
    rehearsal.horizons[0].bets = good().horizons[0].bets;
    let [first, ..] = &mut rehearsal.horizons[0].coasts;
    (first.runs, first.time) = (true, 4.0);
    rehearsal.interval(&second(), &Correction::NONE);
    rehearsal.fix(&[0.0; OBSERVATIONS], &[1.0; OBSERVATIONS]);
    assert_eq!(rehearsal.counts()[0], TRIED + 1);
    assert_eq!(chosen(&mut rehearsal), H);
}

pub(super) fn second() -> Transition {
    let mut second = Transition::ZEROED;
    for (i, row) in second.phi.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    second.time = 1.0;
    second
}

/// A coast counts at the first fix after its length, unless that comes late: by half of it and 2 s.
#[test]
fn late_coasts_do_not_count() {
    for (time, counts, runs) in [
        (9.6, false, true),
        (9.7, true, false),
        (17.0, true, false),
        (17.1, false, false),
    ] {
        let mut coast = Coast::NONE;
        (coast.runs, coast.time) = (true, time - 1.0);
        let seen = FixError {
            first: 6,
            off: [1.0; 2],
            sigma: 1.0,
        };
        coast.moves(&second(), &Correction::NONE);
        let scores = coast.ends(&seen, 10.0);
        assert_eq!((scores.is_some(), coast.runs), (counts, runs), "{time}");
    }
}

/// Of the proved ones that are about as good as the best, the one with the greatest evidence.
#[test]
fn scores_come_before_evidence() {
    for (mean, choice) in [(0.69, H), (GOOD.mean - ALIKE, OTHER), (0.71, OTHER)] {
        let mut rehearsal = good();
        for horizon in &mut rehearsal.horizons {
            horizon.bets.wealth[OTHER] = Wealth { mean, ..GOOD };
        }
        let evidence = |h| if h == OTHER { 50.0 } else { 1.0 };
        assert_eq!(rehearsal.choose(evidence), choice, "{mean}");
        assert_eq!(rehearsal.choose(|h| -evidence(h)), H, "{mean}");
        assert_eq!(chosen(&mut rehearsal), H, "the first of equals");
    }
}

/// A hypothesis without evidence, since it is unhealthy or takes no part, is not chosen, nor does
/// its score count; and no correction needs no proof.
#[test]
fn without_evidence_nothing_is_proved() {
    let mut rehearsal = good();
    for horizon in &mut rehearsal.horizons {
        horizon.bets.wealth[OTHER] = Wealth { mean: 0.6, ..GOOD };
        horizon.bets.wealth[ZERO_CORRECTION] = GOOD;
    }
    let unhealthy = |h| {
        if h == H { f64::NEG_INFINITY } else { 0.0 }
    };
    assert_eq!(rehearsal.choose(unhealthy), OTHER);
    assert!(!rehearsal.has_proved(H) && !rehearsal.has_proved(ZERO_CORRECTION));
}

/// A proof of which half of the logarithm is there is at 50, and 100 is only what has proved
/// itself.
#[test]
fn a_proof_is_a_number_of_100() {
    for (capital, expected) in [
        (0.0, 0),
        (0.05, 0),
        (1.0, 0),
        (libm::sqrtf(PROVED) + 0.01, 50),
        (149.0, 99),
        (PROVED, 99),
        (1e4, 99),
        (f32::INFINITY, 99),
        (f32::NAN, 0),
    ] {
        assert_eq!(of_100(capital, false), expected, "{capital}");
        assert_eq!(of_100(capital, true), 100, "{capital}");
    }
    // each further stake counts no less
    let all: Vec<u8> = (0..200).map(|k| of_100(k as f32, false)).collect();
    assert!(all.is_sorted(), "{all:?}");
}
