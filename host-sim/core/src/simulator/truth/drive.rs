//! A random but plausible drive of a land vehicle: town streets with stops and right-angle turns,
//! country roads with bends and grades.

use super::Segment;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Draws segments for `duration_s` seconds that start and end at rest. Their durations sum to
/// exactly `duration_s` (rounded to 0.1 s).
pub fn random_drive(duration_s: f64, rng: &mut ChaCha8Rng) -> Vec<Segment> {
    let mut segments = Vec::new();
    let mut t = 0.0;
    let mut speed: f64 = 0.0;
    while t < duration_s {
        let before = segments.len();
        if rng.random_bool(0.6) {
            town(&mut segments, &mut speed, rng);
        } else {
            country(&mut segments, &mut speed, rng);
        }
        t += segments[before..].iter().map(|s| s.duration_s).sum::<f64>();
    }
    trim(&mut segments, duration_s);
    segments
}

/// Seconds to change the speed by `dv` at `accel`, m/s2. The peak of the quintic is 1.875 times its
/// mean.
fn ramp(dv: f64, accel: f64) -> f64 {
    tenth((1.875 * dv.abs() / accel).max(1.0))
}

fn tenth(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}

fn go(segments: &mut Vec<Segment>, speed: &mut f64, to: f64, accel: f64) {
    segments.push(Segment {
        duration_s: ramp(to - *speed, accel),
        speed_mps: Some(to),
        turn_deg: 0.0,
        grade_percent: None,
    });
    *speed = to;
}

/// A few blocks with turns at crossings, then a stop.
fn town(segments: &mut Vec<Segment>, speed: &mut f64, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..4) {
        go(
            segments,
            speed,
            rng.random_range(8.0..15.0),
            rng.random_range(1.2..2.5),
        );
        segments.push(Segment {
            grade_percent: Some(rng.random_range(-3.0..3.0)),
            ..Segment::hold(tenth(rng.random_range(5.0..25.0)))
        });
        go(
            segments,
            speed,
            rng.random_range(4.0..7.0),
            rng.random_range(1.5..3.0),
        );
        let right = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        segments.push(Segment {
            turn_deg: right * rng.random_range(75.0..105.0),
            ..Segment::hold(tenth(rng.random_range(5.0..8.0)))
        });
    }
    go(segments, speed, 0.0, rng.random_range(1.0..2.5));
    segments.push(Segment {
        grade_percent: Some(0.0),
        ..Segment::hold(tenth(rng.random_range(4.0..30.0)))
    });
}

/// A stretch of open road with bends and grades.
fn country(segments: &mut Vec<Segment>, speed: &mut f64, rng: &mut ChaCha8Rng) {
    go(
        segments,
        speed,
        rng.random_range(16.0..25.0),
        rng.random_range(0.8..1.6),
    );
    for _ in 0..rng.random_range(2..6) {
        segments.push(Segment {
            duration_s: tenth(rng.random_range(8.0..25.0)),
            speed_mps: Some((*speed + rng.random_range(-2.0..2.0)).clamp(14.0, 27.0)),
            turn_deg: rng.random_range(-60.0..60.0),
            grade_percent: Some(rng.random_range(-5.0..5.0)),
        });
        *speed = segments.last().and_then(|s| s.speed_mps).unwrap_or(*speed);
    }
    segments.push(Segment {
        grade_percent: Some(0.0),
        ..Segment::hold(8.0)
    });
}

/// Shortens the list to `duration_s`, with braking and a standstill at the end.
fn trim(segments: &mut Vec<Segment>, duration_s: f64) {
    const BRAKE_S: f64 = 25.0;
    const REST_S: f64 = 5.0;
    let mut left = duration_s - BRAKE_S - REST_S;
    segments.retain_mut(|s| {
        if left < 3.0 {
            return false;
        }
        // a segment that would be shortened keeps its speed and heading change only if it fits as a
        // whole
        if s.duration_s > left {
            *s = Segment::hold(left);
        }
        left -= s.duration_s;
        true
    });
    segments.push(Segment {
        duration_s: BRAKE_S + left.max(0.0),
        speed_mps: Some(0.0),
        turn_deg: 0.0,
        grade_percent: Some(0.0),
    });
    segments.push(Segment::hold(REST_S));
}
