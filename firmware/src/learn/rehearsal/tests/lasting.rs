//! How often a hypothesis that is exactly as wrong as no correction proves itself, and how fast a
//! good one does.
//!
//! The errors at the end of a coast are random processes of this file, equal in distribution for
//! the shadow without correction and for each hypothesis, and the same at all horizons. They last:
//! a process is correlated over a time constant. Parts north and east of a course are one process
//! times the course's direction. So whoever is lucky stays lucky for a while, at all horizons and
//! in both parts at once. All of the rule runs: both coasts of each horizon, blocks, harm check and
//! veto.

use super::super::bets::MOST;
use super::super::*;
use core::f32::consts::TAU;
use std::boxed::Box;

/// A drive, s.
const DRIVE_S: usize = 7200;
/// Number of drives.
const DRIVES: usize = 48;

/// Deviates that are independent of any code of the firmware: SplitMix64 (Steele et al. 2014) and
/// Box and Muller's method.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 40) as f32 + 0.5) / (1_u32 << 24) as f32
    }

    fn normal(&mut self) -> [f32; 2] {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sin, cos) = (TAU * self.uniform()).sin_cos();
        [radius * cos, radius * sin]
    }
}

/// Direction of the errors.
#[derive(Debug, Clone, Copy)]
enum Course {
    /// North and east are independent.
    Open,
    /// Along a straight road; the direction is another one in each drive, in steps of 45 degrees.
    Straight,
    /// Along a road that turns once in ten minutes.
    Turning,
}

/// Errors of one size that last.
#[derive(Debug, Clone, Copy)]
struct Lasting {
    course: Course,
    /// Time constant, s; 0: each second is independent.
    tau: f32,
    /// Twice integrated, as a filter's errors are, instead of once.
    smooth: bool,
}

impl Lasting {
    /// Horizontal errors of each hypothesis, second by second.
    fn drive(self, number: usize) -> impl FnMut(usize) -> [[f32; 2]; HYPOTHESES] {
        let mut random = Random(number as u64 ^ u64::from(self.tau.to_bits()) << 20);
        let stages = if self.smooth { 2.0 } else { 1.0 };
        let keeps = if self.tau > 0.0 {
            (-stages / self.tau).exp()
        } else {
            0.0
        };
        let new = (1.0 - keeps * keeps).sqrt();
        // both begin in their steady state, the second stage nearly
        let mut states = [[[0.0; 2]; 2]; HYPOTHESES];
        for [first, second] in &mut states {
            *first = random.normal();
            *second = *first;
        }
        move |second| {
            let angle = match self.course {
                Course::Open => None,
                Course::Straight => Some(TAU * number as f32 / 8.0),
                Course::Turning => Some(TAU * second as f32 / 600.0),
            };
            states.each_mut().map(|[first, last]| {
                let noise = random.normal();
                for ((first, last), noise) in first.iter_mut().zip(&mut *last).zip(noise) {
                    *first = keeps * *first + new * noise;
                    if self.smooth && keeps > 0.0 {
                        *last = keeps * *last + (1.0 - keeps) * *first;
                    } else {
                        *last = *first;
                    }
                }
                match angle {
                    None => *last,
                    Some(angle) => [last[0] * angle.cos(), last[0] * angle.sin()],
                }
            })
        }
    }
}

/// Time at which each hypothesis first proves itself within a drive, s.
fn proofs(mut errors: impl FnMut(usize) -> [[f32; 2]; HYPOTHESES]) -> [Option<usize>; HYPOTHESES] {
    let mut rehearsal = Box::new(Rehearsal::ZEROED);
    rehearsal.begin();
    let mut found = [None; HYPOTHESES];
    for second in 1..=DRIVE_S {
        let errors = errors(second);
        let mut news = false;
        rehearsal.since_s += 1.0;
        for (horizon, length) in rehearsal.horizons.iter_mut().zip(HORIZONS_S) {
            horizon.bets.passes(1.0);
            for coast in &mut horizon.coasts {
                coast.time += 1.0;
                if !coast.runs || coast.time < length {
                    continue;
                }
                coast.runs = false;
                for (shadow, [north, east]) in coast.shadows.iter_mut().zip(errors) {
                    (shadow.off[6], shadow.off[7]) = (north, east);
                }
                let seen = FixError {
                    first: 6,
                    off: [0.0; 2],
                    sigma: 0.01,
                };
                let scores = coast.scores(&seen);
                horizon.bets.takes(&scores, length);
                news = true;
            }
            if let Some(coast) = horizon.free(length) {
                (coast.time, coast.runs) = (0.0, true);
            }
        }
        if news {
            rehearsal.since_s = 0.0;
            rehearsal.choose(|_| 0.0);
            for (hypothesis, found) in found.iter_mut().enumerate() {
                if rehearsal.has_proved(hypothesis) {
                    found.get_or_insert(second);
                }
            }
        }
    }
    found
}

/// Percent of the hypotheses, and of the drives with any of the seven, that proved something.
fn false_proofs(errors: Lasting) -> [f64; 2] {
    let (mut each, mut any) = (0, 0);
    for number in 0..DRIVES {
        let proved = proofs(errors.drive(number)).iter().flatten().count();
        each += proved;
        any += usize::from(proved > 0);
    }
    let percent = |count, of| 100.0 * count as f64 / of as f64;
    [
        percent(each, DRIVES * (HYPOTHESES - 1)),
        percent(any, DRIVES),
    ]
}

/// At most two of a hundred worthless hypotheses ever prove themselves in a drive of two hours,
/// however long the errors last up to 100 s, in whichever direction the road goes.
#[test]
fn chance_proves_nothing() {
    for course in [Course::Open, Course::Straight, Course::Turning] {
        for smooth in [false, true] {
            for tau in [0.0, 10.0, 30.0, 100.0] {
                let errors = Lasting {
                    course,
                    tau,
                    smooth,
                };
                let [each, any] = false_proofs(errors);
                println!("{errors:?}: {each:.1} %, any of seven {any:.1} %");
                assert!(each <= 2.0, "{errors:?}: {each} %");
            }
        }
    }
}

/// Seconds until a hypothesis proves itself whose every error is smaller by a factor, `scores` the
/// logarithms of the factors in turn.
fn wins(scores: &[f32]) -> Option<usize> {
    let [_, first, ..] = proofs(|second| {
        let without = scores[second % scores.len()].exp();
        core::array::from_fn(|h| if h == 1 { [1.0, 0.0] } else { [without, 0.0] })
    });
    first
}

/// Large gains take two or three minutes, slight ones up to an hour. What is too slight, as often
/// lost as won, or not finite never proves itself.
#[test]
fn gains_prove_by_their_size() {
    let minutes = |scores: &[f32]| wins(scores).map(|seconds| seconds.div_ceil(60));
    let found = [&[3.0][..], &[2.5], &[2.0], &[1.0], &[0.5], &[0.35]].map(minutes);
    println!("{found:?}");
    assert_eq!(
        found,
        [Some(2), Some(3), Some(4), Some(13), Some(28), Some(52)]
    );
    assert_eq!(minutes(&[0.15]), None);
    assert_eq!(
        minutes(&[MOST, -MOST, -MOST, MOST, MOST, -MOST, -MOST]),
        None
    );
    assert_eq!(minutes(&[f32::NAN]), None);
}
