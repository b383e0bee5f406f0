//! The specific force along and across against the changes of speed and course that the fixes show.

use super::evidence::Evidence;
use super::measure::{Kind, Measure};
use super::turning::courses;
use host_core::inertial::units::G0;
use nalgebra::Vector3;

/// Times between two velocities that are compared, s.
const APART_S: [f64; 2] = [0.9, 2.5];
/// Smallest speed by the fixes at which they have a course, m/s.
const COURSE_MPS: f64 = 3.0;
/// Least number of pairs, and least standard deviation of an acceleration that is compared, m/s2.
const PAIRS: usize = 40;
const LEAST: f64 = 0.3;
/// Least correlation of the best axes, and by how much that of those given is smaller where they
/// contradict the fixes.
const TOGETHER: f64 = 0.6;
const BETTER: f64 = 0.6;

/// Which axis accelerates as the fixes do; `None` where they change their velocities too little, or
/// where none does. Fixes without velocities have those between them.
pub(super) fn measure(evidence: &Evidence) -> Option<Measure> {
    let pairs = pairs(evidence);
    if pairs.len() < PAIRS {
        return None;
    }
    // by axis of the sensor, forward and right, and direction of the fixes, likewise
    let fits = |axis: usize, of: usize| correlation(&pairs, 2 + axis, of);
    // an aircraft banks, so that nothing pushes it to the side
    let follows = |of: &usize| (0..2).any(|axis| fits(axis, *of).abs() > TOGETHER);
    let moves = |of: &usize| spread(&pairs, *of) > LEAST;
    let used: Vec<usize> = (0..2).filter(|of| moves(of) && follows(of)).collect();
    if used.is_empty() {
        return None;
    }
    let score = |swap: bool, signs: [f64; 2]| {
        let all = used
            .iter()
            .map(|of| signs[*of] * fits(of ^ usize::from(swap), *of));
        all.sum::<f64>() / used.len() as f64
    };
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let ways = [false, true]
        .into_iter()
        .flat_map(|swap| signs.map(|signs| (swap, signs)));
    let scored = ways.map(|(swap, signs)| (score(swap, signs), swap, signs));
    let (best, swap, signs) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if best < TOGETHER {
        return None; // no axes follow the fixes
    }
    let better = best - score(false, [1.0, 1.0]);
    let axis = |of: usize| {
        let sign = if signs[of] < 0.0 { "against" } else { "along" };
        let name = ["forward", "right"][of ^ usize::from(swap)];
        format!("{sign} the axis called {name}")
    };
    let wrong = used.iter().find(|of| swap || signs[**of] < 0.0).copied();
    let what = match wrong.unwrap_or_default() {
        0 => "speed up",
        _ => "turn right",
    };
    Some(Measure {
        kind: Kind::Ahead,
        left: 0.0,
        size: better / BETTER,
        problem: format!(
            "makes the vehicle push {} where the fixes {what}",
            axis(wrong.unwrap_or_default())
        ),
        state: "the specific force changes as the velocities do".into(),
    })
}

/// Acceleration along, with the part of gravity that a climb turns there, and to the right by two
/// fixes, and the mean specific force between them, forward and right.
fn pairs(evidence: &Evidence) -> Vec<[f64; 4]> {
    let mut out = Vec::new();
    let mut begin = None;
    for (time, span, [n1, e1, d1]) in velocities(evidence) {
        let (from, [n0, e0, d0]) = *begin.get_or_insert((time, [n1, e1, d1]));
        let dt = time - from;
        if dt < APART_S[0] {
            continue;
        }
        begin = Some((time, [n1, e1, d1]));
        let speeds: [f64; 2] = [n0.hypot(e0), n1.hypot(e1)];
        let pushed = evidence.pushed(from).zip(evidence.pushed(time));
        let Some((before, after)) = pushed.filter(|_| dt <= APART_S[1].max(1.5 * span)) else {
            continue;
        };
        if speeds[0].min(speeds[1]) < COURSE_MPS {
            continue;
        }
        let turn = (n0 * e1 - e0 * n1).atan2(n0 * n1 + e0 * e1);
        let force: Vector3<f64> = (after - before) / dt;
        let across = 0.5 * (speeds[0] + speeds[1]) * turn / dt;
        let climb = -(d0 + d1) / (speeds[0] + speeds[1]);
        let along = (speeds[1] - speeds[0]) / dt + G0 * climb;
        out.push([along, across, force.x, force.y]);
    }
    out
}

/// Times, the time over which each is a mean, and velocities north, east and down; down is 0 where
/// it is not measured.
pub(super) fn velocities(evidence: &Evidence) -> Vec<(f64, f64, [f64; 3])> {
    let measured = evidence.fixes.iter().filter_map(|fix| {
        let [n, e, d] = fix.measured_velocity()?;
        Some((fix.time, 0.0, [n, e, if fix.has(5..6) { d } else { 0.0 }]))
    });
    let measured: Vec<_> = measured.collect();
    if !measured.is_empty() {
        return measured;
    }
    let between = courses(&evidence.fixes).into_iter().map(|course| {
        let [n, e] = course.velocity;
        (course.time, course.span, [n, e, 0.0])
    });
    between.collect()
}

fn mean(pairs: &[[f64; 4]], of: impl Fn(&[f64; 4]) -> f64) -> f64 {
    pairs.iter().map(of).sum::<f64>() / pairs.len() as f64
}

fn spread(pairs: &[[f64; 4]], at: usize) -> f64 {
    let middle = mean(pairs, |p| p[at]);
    mean(pairs, |p| (p[at] - middle).powi(2)).sqrt()
}

fn correlation(pairs: &[[f64; 4]], a: usize, b: usize) -> f64 {
    let middle = [a, b].map(|at| mean(pairs, |p| p[at]));
    let both = mean(pairs, |p| (p[a] - middle[0]) * (p[b] - middle[1]));
    both / (spread(pairs, a) * spread(pairs, b)).max(f64::MIN_POSITIVE)
}
