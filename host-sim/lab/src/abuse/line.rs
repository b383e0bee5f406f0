//! The sensor's line: frames with the faults of a case in their times and numbers.

use firmware::sample::{Counts, Lsb};
use host_core::inertial::session::to_si;
use host_core::inertial::sins::Increment;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Stream of random numbers of the faults.
const CHANCE: u64 = 43;

/// Faults of the line or of the timing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The frames carry neither counter nor time: HG4930.
    NoCounter,
    /// The sensor's clock is slow by this share: each sample lasts longer than configured.
    SlowSensor(f64),
    /// The board's clock is fast by this share.
    FastBoard(f64),
    /// Number of frames lost at once, and the interval of such losses, s.
    Holes([f64; 2]),
    /// This share of the frames is lost.
    Lost(f64),
    /// This share of the frames arrives twice.
    Twice(f64),
    /// This share of the frames has a damaged byte.
    Damaged(f64),
    /// This many frames arrive at once.
    Bursts(f64),
    /// Nothing arrives for a while, again and again: duration and interval, s.
    Silences([f64; 2]),
    /// The sensor is off for this long, s, at the start of the span, and restarts.
    Restart(f64),
}

/// A frame on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// When its last byte arrives, microseconds after power-on, by the board's clock.
    pub at_us: u64,
    /// Number of the sample since power-on.
    pub number: u32,
    /// The sample that the navigation computer has at that time. The correction applies from this
    /// sample on.
    pub sample: usize,
    /// Increments, counts.
    pub counts: Counts,
    /// A byte is damaged.
    pub damaged: bool,
}

/// Increments as the counts of frames. The rounding error is carried to the next sample.
pub fn counts(increments: &[Increment], lsb: &Lsb) -> Vec<Counts> {
    let mut left = [Vector3::zeros(); 2];
    let mut round = |x: &Vector3<f64>, lsb: f64, triad: usize| -> [i32; 3] {
        let exact = x / lsb + left[triad];
        let whole = exact.map(f64::round);
        left[triad] = exact - whole;
        [0, 1, 2].map(|axis| whole[axis] as i32)
    };
    let of = |one: &Increment| Counts {
        dtheta: round(&one.dtheta, lsb.rad, 0),
        dv: round(&one.dv, lsb.mps, 1),
    };
    increments.iter().map(of).collect()
}

/// The frames of a drive's samples, `dt` s each, in the order of their arrival. Each fault acts in
/// the span beside it.
pub fn frames(
    faults: &[(Fault, [f64; 2])],
    samples: &[Counts],
    (dt, lsb): (f64, &Lsb),
    seed: u64,
) -> Vec<Frame> {
    let slow = faults.iter().find_map(|(fault, _)| match fault {
        Fault::SlowSensor(by) => Some(1.0 + by),
        _ => None,
    });
    let mut all = match slow {
        Some(factor) => resampled(samples, (dt, lsb), factor),
        None => samples
            .iter()
            .enumerate()
            .map(|(k, counts)| frame(k, dt, *counts))
            .collect(),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(CHANCE);
    for (fault, span) in faults {
        apply(*fault, span.map(|s| s * 1e6), &mut all, &mut rng);
    }
    all
}

fn frame(k: usize, period: f64, counts: Counts) -> Frame {
    Frame {
        at_us: ((k + 1) as f64 * period * 1e6).round() as u64,
        number: k as u32,
        sample: k,
        counts,
        damaged: false,
    }
}

/// Samples of a sensor whose period is `factor` times `dt`: the sums of the increments,
/// interpolated linearly between samples.
fn resampled(samples: &[Counts], (dt, lsb): (f64, &Lsb), factor: f64) -> Vec<Frame> {
    let n = (samples.len() as f64 / factor) as usize;
    let at = |x: f64| {
        let whole = x as usize;
        let share = x - whole as f64;
        samples.get(whole).map(|next| {
            let next = to_si(next, lsb);
            (
                whole,
                Increment {
                    dtheta: next.dtheta * share,
                    dv: next.dv * share,
                },
            )
        })
    };
    let mut sums = Vec::with_capacity(samples.len() + 1);
    let mut sum = Increment::default();
    sums.push(sum);
    for one in samples {
        let one = to_si(one, lsb);
        sum.dtheta += one.dtheta;
        sum.dv += one.dv;
        sums.push(sum);
    }
    let reached = |x: f64| {
        at(x).map_or(sum, |(whole, part)| Increment {
            dtheta: sums[whole].dtheta + part.dtheta,
            dv: sums[whole].dv + part.dv,
        })
    };
    let increments: Vec<Increment> = (0..n)
        .map(|k| {
            let [a, b] = [k, k + 1].map(|k| reached(k as f64 * factor));
            Increment {
                dtheta: b.dtheta - a.dtheta,
                dv: b.dv - a.dv,
            }
        })
        .collect();
    let counted = counts(&increments, lsb);
    let frames = counted.into_iter().enumerate();
    let of = |(k, counts)| Frame {
        sample: (((k + 1) as f64 * factor) as usize).saturating_sub(1),
        ..frame(k, dt * factor, counts)
    };
    frames.map(of).collect()
}

fn apply(fault: Fault, [from, to]: [f64; 2], all: &mut Vec<Frame>, rng: &mut ChaCha8Rng) {
    let within = |one: &Frame| (from..to).contains(&(one.at_us as f64));
    match fault {
        Fault::NoCounter | Fault::SlowSensor(_) => {}
        Fault::FastBoard(by) => {
            for one in all.iter_mut() {
                one.at_us = (one.at_us as f64 * (1.0 + by)).round() as u64;
            }
        }
        Fault::Holes([frames, every_s]) => {
            let every = (every_s * 1e6) as u64;
            let period =
                all.get(1).map_or(0, |one| one.at_us) - all.first().map_or(0, |one| one.at_us);
            let length = (frames * period as f64) as u64;
            all.retain(|one| !within(one) || one.at_us % every >= length);
        }
        Fault::Lost(share) => {
            all.retain(|one| !(within(one) && rng.random_bool(share.clamp(0.0, 1.0))));
        }
        Fault::Twice(share) => {
            let twice = |one: Frame| {
                let again = within(&one) && rng.random_bool(share.clamp(0.0, 1.0));
                std::iter::repeat_n(one, if again { 2 } else { 1 })
            };
            *all = std::mem::take(all).into_iter().flat_map(twice).collect();
        }
        Fault::Damaged(share) => {
            for one in all.iter_mut().filter(|one| within(one)) {
                one.damaged = rng.random_bool(share.clamp(0.0, 1.0));
            }
        }
        Fault::Bursts(n) => {
            let n = (n as usize).max(1);
            for burst in all.chunks_mut(n) {
                let last = burst.last().map_or(0, |one| one.at_us);
                let late = |one: &&mut Frame| within(one);
                burst
                    .iter_mut()
                    .filter(late)
                    .for_each(|one| one.at_us = last);
            }
        }
        Fault::Silences([length_s, every_s]) => {
            let [length, every] = [length_s, every_s].map(|s| (s * 1e6) as u64);
            all.retain(|one| !within(one) || one.at_us % every >= length);
        }
        Fault::Restart(length_s) => {
            let end = from + length_s * 1e6;
            all.retain(|one| !(from..end).contains(&(one.at_us as f64)));
            let after = all.partition_point(|one| (one.at_us as f64) < end);
            for (k, one) in all[after..].iter_mut().enumerate() {
                one.number = k as u32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LSB: Lsb = Lsb {
        rad: 1e-9,
        mps: 1e-8,
    };

    fn samples(n: usize) -> Vec<Counts> {
        let one = |k: usize| Counts {
            dtheta: [k as i32, 2, -3],
            dv: [4, 5, -900_000],
        };
        (0..n).map(one).collect()
    }

    fn with(fault: Fault) -> Vec<Frame> {
        frames(&[(fault, [2.0, 8.0])], &samples(1000), (0.01, &LSB), 5)
    }

    #[test]
    fn a_line_without_faults_carries_every_sample_at_its_time() {
        let all = frames(&[], &samples(1000), (0.01, &LSB), 5);
        assert_eq!(all.len(), 1000);
        assert!(
            all.iter()
                .enumerate()
                .all(|(k, one)| one.at_us == (k as u64 + 1) * 10_000
                    && one.sample == k
                    && one.counts.dtheta[0] == k as i32)
        );
    }

    #[test]
    fn lines_lose_repeat_and_delay_what_they_say() {
        let holes = with(Fault::Holes([6.0, 1.0]));
        assert_eq!(holes.len(), 1000 - 6 * 6);
        let lost = with(Fault::Lost(0.1)).len();
        assert!((930..1000 - 30).contains(&lost), "{lost}");
        let twice = with(Fault::Twice(0.1));
        assert!((1030..1090).contains(&twice.len()), "{}", twice.len());
        let silences = with(Fault::Silences([0.5, 3.0]));
        assert_eq!(silences.len(), 1000 - 100);
        let restarted = with(Fault::Restart(1.0));
        assert_eq!(restarted.len(), 900);
        assert_eq!((restarted[198].number, restarted[199].number), (198, 0));
        let bursts = with(Fault::Bursts(5.0));
        assert!(bursts[300..305].iter().all(|one| one.at_us == 3_050_000));
        assert!(with(Fault::Damaged(0.1)).iter().any(|one| one.damaged));
        assert_eq!(with(Fault::FastBoard(0.01))[999].at_us, 10_100_000);
    }

    /// A slow sensor sends fewer samples with the same sum.
    #[test]
    fn a_slow_sensor_loses_nothing() {
        let all = frames(
            &[(Fault::SlowSensor(0.25), [0.0, 9.0])],
            &samples(1000),
            (0.01, &LSB),
            5,
        );
        assert_eq!(all.len(), 800);
        let sum = |axis: usize| {
            all.iter()
                .map(|one| i64::from(one.counts.dtheta[axis]))
                .sum::<i64>()
        };
        assert_eq!((sum(0), sum(1), sum(2)), (999 * 500, 2000, -3000));
        assert_eq!(all[799].at_us, 10_000_000);
        assert_eq!(all[799].sample, 999);
    }
}
