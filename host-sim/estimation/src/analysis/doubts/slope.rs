//! Heights without vertical velocities against the slope of the road: what is left of the force
//! along the forward axis when the vehicle does not speed up is gravity.

use super::evidence::Evidence;
use super::measure::{Kind, Measure};
use super::turning::{Course, courses};
use host_core::inertial::units::G0;

/// Time over which a slope is taken, s, and the least speed, m/s.
const CHORD_S: f64 = 20.0;
const LEAST_MPS: f64 = 3.0;
/// Least number of slopes, and their least standard deviation.
const SLOPES: usize = 12;
const HILLS: f64 = 0.005;
/// Least correlation of the two slopes, and the smallest reported ratio of them, either way.
const TOGETHER: f64 = 0.8;
const STEEPER: f64 = 2.0;

/// `None` where the fixes have velocities, or no heights, or the road is even.
pub(super) fn measure(evidence: &Evidence) -> Option<Measure> {
    let fixes = &evidence.fixes;
    if fixes
        .iter()
        .any(|fix| fix.measured_velocity().is_some() || !fix.has(0..3))
    {
        return None;
    }
    let all = courses(fixes);
    let slopes: Vec<[f64; 2]> = (0..all.len())
        .step_by(2)
        .filter_map(|k| slopes(evidence, &all[k..]))
        .collect();
    let count = slopes.len() as f64;
    let mean = [0, 1].map(|of| slopes.iter().map(|s| s[of]).sum::<f64>() / count);
    let product = |a: usize, b: usize| {
        let sum = slopes.iter().map(|s| (s[a] - mean[a]) * (s[b] - mean[b]));
        sum.sum::<f64>() / count
    };
    let (road, heights) = (product(0, 0).sqrt(), product(1, 1).sqrt());
    let together = product(0, 1) / (road * heights);
    if slopes.len() < SLOPES || road < HILLS || together.is_nan() || together.abs() < TOGETHER {
        return None;
    }
    let ratio = product(0, 1) / (road * road);
    Some(Measure {
        kind: Kind::Climbs,
        left: 0.0,
        size: match ratio > 0.0 {
            true => ratio.ln().abs() / STEEPER.ln(),
            false => 2.0,
        },
        problem: match ratio > 0.0 {
            true => format!("makes the road {ratio:.2} times as steep as the forward axis"),
            false => "makes the road fall where the forward axis rises".into(),
        },
        state: "the heights rise as the forward axis does".into(),
    })
}

/// The slope by the sensors and that by the heights, from the first of these courses on.
fn slopes(evidence: &Evidence, courses: &[Course]) -> Option<[f64; 2]> {
    let first = courses.first()?;
    let end = courses
        .iter()
        .position(|c| c.time - first.time >= CHORD_S)?;
    let part = &courses[..=end];
    let last = part.last()?;
    let whole = part
        .windows(2)
        .all(|w| w[1].time - w[0].time < 1.5 * w[1].span);
    if !whole || part.iter().any(|c| c.speed() < LEAST_MPS) {
        return None;
    }
    let seconds = last.time - first.time;
    let path = part
        .windows(2)
        .map(|w| 0.5 * (w[0].speed() + w[1].speed()) * (w[1].time - w[0].time));
    let pushed = evidence.pushed(last.time)? - evidence.pushed(first.time)?;
    let gained = last.speed() - first.speed();
    Some([
        (pushed.x - gained) / (G0 * seconds),
        (last.height - first.height) / path.sum::<f64>(),
    ])
}
