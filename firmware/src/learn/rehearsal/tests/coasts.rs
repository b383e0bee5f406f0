//! Coasts: when they start, pass and end, and what their scores are.

use super::rules::second;
use super::*;

const H: usize = 3;

/// All coasts of the first horizon, of 5 s, run since `time` s.
fn under_way(time: f32) -> Box<Rehearsal> {
    let mut rehearsal = Box::new(Rehearsal::ZEROED);
    rehearsal.begin();
    for coast in &mut rehearsal.horizons[0].coasts {
        (coast.runs, coast.time) = (true, time);
    }
    rehearsal
}

fn pass(rehearsal: &mut Rehearsal, fix: bool) {
    rehearsal.interval(&second(), &Correction::NONE);
    if fix {
        rehearsal.fix(&[0.0; OBSERVATIONS], &[1.0; OBSERVATIONS]);
    }
}

/// Whether the coasts of the first horizon run, and their time.
fn times(rehearsal: &Rehearsal) -> [(bool, f32); COASTS] {
    let coasts = &rehearsal.horizons[0].coasts;
    coasts.each_ref().map(|coast| (coast.runs, coast.time))
}

/// One of the two coasts may start when the other does not run, or since 0.4 of the horizon.
#[test]
fn coasts_start_apart() {
    for (runs, time, starts) in [
        ([false, false], [0.0, 0.0], Some(0)),
        ([true, false], [3.9, 9.0], None),
        ([true, false], [4.0, 9.0], Some(1)),
        ([false, true], [9.0, 3.9], None),
        ([false, true], [9.0, 4.0], Some(0)),
        ([true, true], [9.0, 9.0], None),
    ] {
        let mut horizon = Horizon::NONE;
        for (k, coast) in horizon.coasts.iter_mut().enumerate() {
            (coast.runs, coast.time) = (runs[k], time[k]);
        }
        if let Some(coast) = horizon.free(10.0) {
            coast.time = -1.0;
        }
        let started = (horizon.coasts.iter()).position(|coast| coast.time < 0.0);
        assert_eq!(started, starts, "{runs:?} {time:?}");
    }
}

/// A coast starts at what each hypothesis believes of vehicle and sensors.
#[test]
fn a_coast_starts_from_what_is_believed() {
    let mut memory = Box::new(Memory::ZEROED);
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, Receiver::GOOD, BIASED, 5);
    drive.seconds(20);
    let mut coast = Coast::NONE;
    coast.time = 9.0;
    let bank = drive.learner.bank();
    coast.start(bank);
    assert_eq!((coast.time, coast.runs), (0.0, true));
    let mut believed = [0.0_f32; 2];
    for (h, shadow) in coast.shadows.iter().enumerate() {
        for (off, error) in shadow.off.iter().zip(bank.error_state_of(h)) {
            assert_eq!(*off, -error, "{h}");
            believed[0] += off.abs();
        }
        assert_eq!(shadow.correction, bank.correction_of(h), "{h}");
        believed[1] += shadow.correction.estimate.map(f32::abs).iter().sum::<f32>();
    }
    assert!(believed.iter().all(|sum| *sum > 0.0), "{believed:?}");
}

/// A shadow moves by what it subtracts more than the navigator.
#[test]
fn what_moves_a_shadow_is_the_difference_of_corrections() {
    let mut coast = Coast::NONE;
    let of = |all: f32| Correction {
        estimate: [all; 6],
        maps: [[[0.1 * all; 3]; 3]; 2],
    };
    coast.shadows[H].correction = of(3.0);
    let mut block = second();
    block.gamma[6][0] = 10.0;
    block.proportional[7][17] = 10.0;
    coast.moves(&block, &of(1.0));
    assert_eq!(coast.shadows[H].off[6], 20.0);
    assert!((coast.shadows[H].off[7] - 2.0).abs() < 1e-6);
    assert_eq!(coast.time, 1.0);
}

/// The scores are half the logarithm of the ratio of the squares, no error less than the fix's, and
/// none beyond 3.
#[test]
fn a_score_is_the_logarithm_of_the_gain() {
    let scores = |without: [f32; 2], with: [f32; 2], off: [f32; 2]| {
        let mut coast = Coast::NONE;
        for (h, shadow) in coast.shadows.iter_mut().enumerate() {
            let at = if h == ZERO_CORRECTION { without } else { with };
            shadow.off[6..8].copy_from_slice(&at);
        }
        let seen = FixError {
            first: 6,
            off,
            sigma: 5.0,
        };
        coast.scores(&seen).gains[H]
    };
    let near = |found: f32, right: f64| {
        assert!((f64::from(found) - right).abs() < 1e-5, "{found}, {right}");
    };
    // (30^2 + 40^2 + 5^2) / 5^2 and back
    near(scores([30.0, 40.0], [0.0; 2], [0.0; 2]), 2.307_560_25);
    near(scores([0.0; 2], [30.0, 40.0], [0.0; 2]), -2.307_560_25);
    // estimate minus fix is what the navigator is off, and the shadow is off by `off` more
    near(scores([30.0, 40.0], [-1.0, 2.0], [1.0, -2.0]), 2.288_385_36);
    near(scores([3e5, 4e5], [0.0; 2], [0.0; 2]), 3.0);
    near(scores([0.0; 2], [3e5, 4e5], [0.0; 2]), -3.0);
}

/// Of hypotheses that extend the biases the second score is against the likelier kind of biases,
/// of all others against nothing.
#[test]
fn larger_hypotheses_are_compared_with_the_biases() {
    let mut memory = Box::new(Memory::ZEROED);
    let settings = Settings::MEDIUM;
    let mut drive = Drive::new(&mut memory, settings, Road::TOWN, Receiver::GOOD, BIASED, 5);
    drive.seconds(20);
    let mut coast = Coast::NONE;
    coast.start(drive.learner.bank());
    let biases = drive.learner.bank().biases();
    let errors = [100.0, 10.0, 50.0, 10.0, 20.0, 5.0, 80.0, 40.0];
    for (h, shadow) in coast.shadows.iter_mut().enumerate() {
        shadow.off = [0.0; NAV];
        shadow.off[6] = if h == biases { 8.0 } else { errors[h] };
    }
    let scores = coast.scores(&FixError {
        first: 6,
        off: [0.0; 2],
        sigma: 0.0,
    });
    for h in 0..HYPOTHESES {
        let own: f32 = coast.shadows[h].off[6];
        let beside = if [4, 5, 7].contains(&h) { 8.0 } else { 100.0 };
        let near = |is: f32, from: f32| (is - libm::logf(from / own)).abs() < 1e-5;
        assert!(near(scores.gains[h], 100.0), "{h}: {scores:?}");
        assert!(near(scores.extending[h], beside), "{h}: {scores:?}");
    }
}

/// The worse one of the position's two components counts; without a position, that of the velocity.
#[test]
fn a_fix_shows_position_or_velocity() {
    const NONE: f32 = f32::INFINITY;
    for (variance, shows) in [
        ([4.0, 9.0, 1.0, 1.0, 1.0, 1.0], Some((6, [1.0, 2.0], 3.0))),
        ([9.0, 4.0, 1.0, 1.0, 1.0, 1.0], Some((6, [1.0, 2.0], 3.0))),
        ([4.0, NONE, 1.0, 4.0, 9.0, 1.0], Some((3, [4.0, 5.0], 3.0))),
        ([NONE, 4.0, 1.0, 9.0, 4.0, 1.0], Some((3, [4.0, 5.0], 3.0))),
        ([NONE, 4.0, 1.0, NONE, 4.0, 1.0], None),
        ([NONE, 4.0, 1.0, 9.0, NONE, 1.0], None),
    ] {
        let seen = FixError::of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &variance);
        let seen = seen.map(|seen| (seen.first, seen.off, seen.sigma));
        assert_eq!(seen, shows, "{variance:?}");
    }
}

/// A fix ends the coasts that are due, once, and no later interval knows of it.
#[test]
fn a_fix_ends_coasts_once() {
    let mut rehearsal = under_way(3.0);
    pass(&mut rehearsal, true);
    assert_eq!(times(&rehearsal), [(true, 4.0); 2]);
    pass(&mut rehearsal, false);
    assert_eq!(times(&rehearsal), [(true, 5.0); 2], "no fix is left");
    assert_eq!(rehearsal.counts()[0], 0);
    rehearsal.fix(&[0.0; OBSERVATIONS], &[1.0; OBSERVATIONS]);
    assert_eq!(times(&rehearsal), [(false, 5.0); 2], "no time has passed");
    assert_eq!(rehearsal.counts()[0], 2);
    rehearsal.fix(&[0.0; OBSERVATIONS], &[1.0; OBSERVATIONS]);
    assert_eq!(rehearsal.counts()[0], 2);
}

/// A coast that does not run passes no interval.
#[test]
fn a_coast_that_does_not_run_passes_nothing() {
    let mut rehearsal = under_way(0.0);
    let [first, _] = &mut rehearsal.horizons[0].coasts;
    first.runs = false;
    pass(&mut rehearsal, false);
    assert_eq!(times(&rehearsal), [(false, 0.0), (true, 1.0)]);
}

/// When the navigator is lost, no coast goes on and no earlier fix counts.
#[test]
fn an_interruption_ends_coasts_without_a_result() {
    let mut rehearsal = under_way(4.0);
    rehearsal.interval(&second(), &Correction::NONE);
    rehearsal.interrupted();
    rehearsal.fix(&[0.0; OBSERVATIONS], &[1.0; OBSERVATIONS]);
    pass(&mut rehearsal, true);
    assert_eq!(rehearsal.counts()[0], 0);
    assert_eq!(times(&rehearsal), [(false, 5.0); 2]);
}

/// A correction of the navigator after an interval moves the shadows apart from it by as much,
/// once, and after the interval's own motion.
#[test]
fn shadows_do_not_follow_what_corrects_the_navigator() {
    let mut twice = second();
    for (i, row) in twice.phi.iter_mut().enumerate() {
        row[i] = 2.0;
    }
    let mut rehearsal = under_way(0.0);
    let off = |rehearsal: &Rehearsal| {
        let [coast, _] = &rehearsal.horizons[0].coasts;
        coast.shadows[H].off
    };
    rehearsal.feed_back(&[1.0; NAV]);
    assert_eq!(off(&rehearsal), [1.0; NAV]);
    rehearsal.interval(&twice, &Correction::NONE);
    rehearsal.feed_back(&[3.0; NAV]);
    assert_eq!(off(&rehearsal), [5.0; NAV]);
    pass(&mut rehearsal, false);
    assert_eq!(off(&rehearsal), [5.0; NAV], "once");
}
