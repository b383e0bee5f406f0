//! Streams of frames with a clock of their own, over lines that hold them up.

use super::{Hole, HoleWatch};
use std::vec::Vec;

/// A stream, and the line between sensor and application.
#[derive(Clone, Copy)]
struct Stream {
    /// Configured frame rate, Hz.
    rate: f64,
    /// Drift of the sensor's clock, as a ratio; > 0: it is slower.
    drift: f64,
    /// Largest random delay, periods.
    jitter: f64,
    /// Bytes of a frame, and bytes that a burst of DMA waits for.
    bytes: [u32; 2],
    /// A frame path that is busy for so long once in ten seconds, s.
    stall: f64,
}

const HG4930: Stream = Stream {
    rate: 100.0,
    drift: 3e-5,
    jitter: 0.2,
    bytes: [44, 64],
    stall: 0.0,
};

/// Random numbers from 0 to 1, the same in each run.
fn random(n: u64) -> f64 {
    let mixed = (n ^ 0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

impl Stream {
    /// Runs for some seconds. `lost`: whether the frame with this number is missing. Gives what was
    /// found, and after how many seconds.
    fn run(&self, seconds: f64, lost: impl Fn(u64) -> bool) -> Vec<(f64, Hole)> {
        let mut watch = HoleWatch::new(true);
        let period = (1.0 + self.drift) / self.rate;
        let [bytes, burst] = self.bytes.map(f64::from);
        let (mut found, mut came, mut seen) = (Vec::new(), 0.0, 0.0);
        for n in 0..(seconds / period) as u64 {
            if lost(n) {
                continue;
            }
            came += bytes;
            // the end of the frame is detected with the burst that contains it, whose last byte
            // belongs to a later frame if the frame does not end with the burst
            let behind = (burst - came % burst) % burst;
            let held = if burst > bytes {
                (behind / bytes).ceil()
            } else {
                0.0
            };
            let sent = (n as f64 + held + self.jitter * random(n)) * period;
            let stalls = (sent / 10.0).floor() * 10.0 + 5.0;
            let stalled = (stalls..stalls + self.stall).contains(&sent);
            let sent = if stalled { stalls + self.stall } else { sent };
            seen = f64::max(seen, sent);
            let now = (seen * 1e6) as u64 + 1_000_000;
            if let Some(hole) = watch.frame(now, self.rate as f32) {
                found.push((seen, hole));
            }
        }
        found
    }
}

fn frames(hole: &Hole) -> u32 {
    match hole {
        Hole::Of(n) => *n,
        Hole::Unknown => 0,
    }
}

/// An hour of jitter, bursts, clocks that differ, and a busy frame path: nothing is missing.
#[test]
fn delays_are_no_holes() {
    let streams = [
        HG4930,
        Stream {
            drift: 0.015,
            ..HG4930
        },
        Stream {
            drift: -0.019,
            jitter: 0.1,
            ..HG4930
        },
        Stream {
            stall: 0.3,
            ..HG4930
        },
        Stream {
            stall: 0.9,
            drift: 0.01,
            ..HG4930
        },
        Stream {
            rate: 200.0,
            bytes: [20, 64],
            ..HG4930
        },
        Stream {
            rate: 600.0,
            bytes: [44, 64],
            ..HG4930
        },
        // a USB adapter that delivers once in 16 ms
        Stream {
            rate: 2000.0,
            bytes: [44, 1408],
            ..HG4930
        },
        Stream {
            rate: 2000.0,
            jitter: 3.0,
            bytes: [44, 1],
            ..HG4930
        },
        Stream {
            rate: 5.0,
            ..HG4930
        },
    ];
    for (n, stream) in streams.into_iter().enumerate() {
        let found = stream.run(3600.0, |_| false);
        assert!(found.is_empty(), "{n}: {:?}", &found[..found.len().min(3)]);
    }
}

/// Six frames in a row every ten seconds: all holes are found within 1.5 s, with their number.
#[test]
fn holes_are_found_and_counted() {
    let streams = [
        HG4930,
        Stream {
            drift: 0.01,
            ..HG4930
        },
        Stream {
            drift: -0.015,
            ..HG4930
        },
        Stream {
            rate: 200.0,
            ..HG4930
        },
        Stream {
            bytes: [44, 1],
            ..HG4930
        },
        Stream {
            stall: 0.3,
            ..HG4930
        },
    ];
    for stream in streams {
        for size in [1, 2, 6, 40] {
            let each = (10.0 * stream.rate) as u64;
            let lost = |n: u64| (each..61 * each).contains(&n) && n % each < size;
            let found = stream.run(620.0, lost);
            for k in 1..=60 {
                // a frame from before the hole that DMA has held up may divide it in two
                let from = 10.0 * f64::from(k) * (1.0 + stream.drift);
                let near = found.iter().filter(|(s, _)| (from..from + 1.5).contains(s));
                let sum: u32 = near.map(|(_, hole)| frames(hole)).sum();
                assert_eq!(sum, size as u32, "at {from} s: {found:?}");
            }
            let sum: u32 = found.iter().map(|(_, hole)| frames(hole)).sum();
            assert_eq!(sum, 60 * size as u32, "none but these");
        }
    }
}

/// Single frames that get lost at random, one in a hundred: their number is right in the sum.
#[test]
fn single_frames_add_up() {
    let lost = |n: u64| n > 1000 && random(7 * n) < 0.01;
    let found = HG4930.run(1000.0, lost);
    let truly = (0..100_000).filter(|n| lost(*n)).count() as f64;
    let sum: u32 = found.iter().map(|(_, hole)| frames(hole)).sum();
    assert!(
        (f64::from(sum) / truly - 1.0).abs() < 0.05,
        "{sum} of {truly}"
    );
}

/// Half a period more is no whole number of frames; a watch that is off finds nothing; after an
/// interruption it does not compare with what was before.
#[test]
fn an_uncertain_hole_is_reported_as_uncertain() {
    let run = |shift: u64, on: bool, interrupt: bool| {
        let mut watch = HoleWatch::new(on);
        let mut found = Vec::new();
        for n in 0..2000u64 {
            let late = if n >= 1000 { shift } else { 0 };
            if n == 1000 && interrupt {
                watch.interrupt();
            }
            found.extend(watch.frame(n * 10_000 + late, 100.0));
        }
        found
    };
    assert_eq!(run(15_000, true, false), [Hole::Unknown]);
    assert_eq!(run(29_000, true, false), [Hole::Of(3)]);
    assert_eq!(run(5_000, true, false), []);
    assert_eq!(run(29_000, false, false), []);
    assert_eq!(run(29_000, true, true), []);
}
