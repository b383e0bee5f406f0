//! A drive as a list of segments, and the smooth speed, heading and grade that follow from it.

use serde::{Deserialize, Serialize};

/// One piece of a drive. Speed and grade change smoothly (quintic, continuous second derivative)
/// from the values of the segment before to those given here. The heading turns by `turn_deg` over
/// the segment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Duration, s, > 0.
    pub duration_s: f64,
    /// Speed at the end, m/s, >= 0. If left out, the speed does not change.
    pub speed_mps: Option<f64>,
    /// Heading change over the segment, deg, positive to the right.
    #[serde(default)]
    pub turn_deg: f64,
    /// Grade at the end, per cent, positive uphill. If left out, the grade does not change.
    pub grade_percent: Option<f64>,
}

impl Segment {
    /// A standstill or a stretch at constant speed.
    #[must_use]
    pub fn hold(duration_s: f64) -> Self {
        Self {
            duration_s,
            speed_mps: None,
            turn_deg: 0.0,
            grade_percent: None,
        }
    }
}

/// A quantity that changes from one value to another over a segment, with derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub struct Smooth {
    /// Value.
    pub value: f64,
    /// First derivative, 1/s.
    pub d1: f64,
    /// Second derivative, 1/s2.
    pub d2: f64,
}

impl Smooth {
    pub(super) fn between(from: f64, to: f64, t: f64, duration: f64) -> Self {
        let u = t / duration;
        let (u2, d) = (u * u, to - from);
        Self {
            value: from + d * u2 * u * (10.0 - 15.0 * u + 6.0 * u2),
            d1: d * u2 * (30.0 - 60.0 * u + 30.0 * u2) / duration,
            d2: d * u * (60.0 - 180.0 * u + 120.0 * u2) / (duration * duration),
        }
    }
}

/// Speed along the path in m/s, heading in rad, grade angle in rad.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Speed, m/s.
    pub speed: Smooth,
    /// Heading clockwise from north, rad.
    pub heading: Smooth,
    /// Grade angle, rad, positive uphill.
    pub grade: Smooth,
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    start: f64,
    duration: f64,
    speed: [f64; 2],
    heading: [f64; 2],
    grade: [f64; 2],
}

/// The course of a whole drive as a function of time.
#[derive(Debug, Clone)]
pub struct Profile {
    legs: Vec<Leg>,
}

impl Profile {
    /// `heading` is that at the start, rad. The drive starts at rest on level ground. Durations are
    /// rounded to whole sample periods of `dt` s, so that every segment ends with a sample. There
    /// must be at least one segment.
    #[must_use]
    pub fn new(segments: &[Segment], heading: f64, dt: f64) -> Self {
        let (mut start, mut speed, mut heading, mut grade) = (0.0, 0.0, heading, 0.0_f64);
        let legs = segments
            .iter()
            .map(|s| {
                let duration = (s.duration_s / dt).round().max(1.0) * dt;
                let speed_end = s.speed_mps.unwrap_or(speed);
                let heading_end = heading + s.turn_deg.to_radians();
                let grade_end = s.grade_percent.map_or(grade, |p| (p / 100.0).atan());
                let leg = Leg {
                    start,
                    duration,
                    speed: [speed, speed_end],
                    heading: [heading, heading_end],
                    grade: [grade, grade_end],
                };
                (start, speed, heading, grade) =
                    (start + duration, speed_end, heading_end, grade_end);
                leg
            })
            .collect();
        Self { legs }
    }

    /// Total duration, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.legs.last().map_or(0.0, |l| l.start + l.duration)
    }

    /// The leg at time `t` (s), searched from a hint that the caller keeps. Times must ascend.
    pub(super) fn advance(&self, hint: &mut usize, t: f64) {
        while *hint + 1 < self.legs.len() && t >= self.legs[*hint + 1].start - 1e-9 {
            *hint += 1;
        }
    }

    /// Course at `t` within leg `leg`.
    pub(super) fn at(&self, leg: usize, t: f64) -> Course {
        let l = &self.legs[leg];
        let s = t - l.start;
        Course {
            speed: Smooth::between(l.speed[0], l.speed[1], s, l.duration),
            heading: Smooth::between(l.heading[0], l.heading[1], s, l.duration),
            grade: Smooth::between(l.grade[0], l.grade[1], s, l.duration),
        }
    }
}
