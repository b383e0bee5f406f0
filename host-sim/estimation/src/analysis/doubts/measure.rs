//! How much the parts of a recording contradict each other.

use super::evidence::Evidence;
use super::rests::{Rests, speeds};
use super::{AXES, DEGREE_M};
use firmware::plausibility::Expected;
use firmware::units::G;
use firmware::wire::command::fault;
use host_core::inertial::units::DEG_PER_H;
use host_io::recordings::record::TimedFix;
use nalgebra::Vector3;

/// Smallest reported difference between gravity and the force of a drive without a rest, a share.
const DRIVE_SHARE: f64 = 0.3;
/// A specific force of less than this share of gravity is of no unit: gravity has been taken off.
const MISSING: f64 = 0.08;
/// The direction of the force of a drive counts if the mean is so much of the mean size.
const ONE_WAY: f64 = 0.95;
/// Smallest reported ratio of rotation and change of course, as a factor either way; and the one
/// where they turn together as on a road, by so much correlation. A ship yaws in waves.
const TURNING: [f64; 2] = [2.5, 1.7];
pub(super) const AS_ONE: f64 = 0.95;
/// Smallest reported difference of positions and velocities, as a share of the speed.
const APART: f64 = 0.3;
/// Time between positions that are compared with velocities, s: horizontal, and vertical.
const CHORD_S: [f64; 2] = [10.0, 30.0];
/// Least change that is compared, m/s, and in standard deviations.
const LEAST_MPS: [f64; 2] = [1.0, 0.25];
const SIGMAS: f64 = 5.0;
/// Heights that follow the vertical velocities by less than this share do not follow them, where
/// these are not small, m/s.
const FOLLOWS: f64 = 0.5;
const CLIMBS_MPS: f64 = 0.1;
/// Least number of pairs of positions.
const PAIRS: usize = 10;
/// Longest time between two fixes whose velocities are averaged, s.
const NEAR_S: f64 = 2.5;

/// The quantities compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Positions of the fixes with the start.
    Position,
    /// Positions with velocities, horizontally.
    Moves,
    /// Heights with vertical velocities.
    Climbs,
    /// The offset of the clocks.
    Time,
    /// Rotation with the changes of course.
    Turns,
    /// Changes of the specific force with those of the velocity.
    Ahead,
    /// The specific force, as the gyros turn it, with gravity and the changes of velocity.
    Signs,
    /// Size of the specific force with gravity.
    Gravity,
    /// Its direction with that of down.
    Down,
    /// The rate at rest with that of the Earth.
    Earth,
}

/// A comparison.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measure {
    pub(super) kind: Kind,
    /// The difference; from 1 on it is a contradiction.
    pub(super) size: f64,
    /// Logarithm of the sum of squared residuals of a fit. Of two changes without a contradiction,
    /// the one with the smaller value is better.
    pub(super) left: f64,
    /// The contradiction, as the rest of a sentence that begins with the field.
    pub(super) problem: String,
    /// The result of the comparison, as a sentence without a full stop.
    pub(super) state: String,
}

impl Measure {
    pub(super) fn contradicts(&self) -> bool {
        self.size >= 1.0
    }
}

/// All comparisons that a recording allows.
pub(super) fn all(evidence: &Evidence, expected: &Expected) -> Vec<Measure> {
    let rests = Rests::of(evidence, expected);
    let moves = apart(evidence, false);
    let agrees = moves.as_ref().is_some_and(|m| !m.contradicts());
    let turns = turns(evidence);
    let earth = turns.is_none().then(|| earth(&rests)).flatten();
    let gravity = gravity(evidence, &rests);
    let down = down(evidence, &rests);
    let place = place(evidence, agrees);
    let climbs = apart(evidence, true).or_else(|| super::slope::measure(evidence));
    let ahead = super::ahead::measure(evidence);
    let signs = super::signs::measure(evidence);
    [
        place, moves, climbs, gravity, down, turns, ahead, signs, earth,
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Positions in rad that are taken as degrees lie within 1.6 and 3.2 degrees of 0, at sea.
/// `agrees`: they agree with the velocities, so that a ship is there.
fn place(evidence: &Evidence, agrees: bool) -> Option<Measure> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let mut placed = evidence.fixes.iter().filter(|fix| fix.has_position());
    let first = *placed.clone().next()?;
    let near = placed.all(|fix| fix.lat_deg.abs() <= FRAC_PI_2 && fix.lon_deg.abs() <= PI);
    let at = format!("{:.3}, {:.3} deg", first.lat_deg, first.lon_deg);
    Some(Measure {
        kind: Kind::Position,
        left: 0.0,
        size: if near && !agrees { 2.0 } else { 0.0 },
        problem: format!("puts all fixes near {at}, into the Gulf of Guinea"),
        state: format!("the first fix is at {at}"),
    })
}

/// Positions or heights against velocities.
fn apart(evidence: &Evidence, vertical: bool) -> Option<Measure> {
    let axis = usize::from(vertical);
    let way = vertical.then(|| way(evidence)).flatten();
    if way.as_ref().is_some_and(Measure::contradicts) {
        return way;
    }
    let pairs: Vec<[f64; 3]> = chords(&evidence.fixes, CHORD_S[axis])
        .filter_map(|(moved, said, sigma)| {
            let part = |v: Vector3<f64>| match vertical {
                true => Vector3::new(0.0, 0.0, v.z),
                false => Vector3::new(v.x, v.y, 0.0),
            };
            let (moved, said) = (part(moved), part(said));
            let speed = moved.norm().max(said.norm());
            let least = LEAST_MPS[axis].max(SIGMAS * sigma[axis]);
            (speed > least).then(|| [(moved - said).norm() / speed, moved.norm(), said.norm()])
        })
        .collect();
    if pairs.len() < PAIRS {
        return way;
    }
    let median = |k: usize| {
        let mut all: Vec<f64> = pairs.iter().map(|pair| pair[k]).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let (apart, moved, said) = (median(0), median(1), median(2));
    let what = if vertical { "heights" } else { "positions" };
    let same = (moved / said).ln().abs() < 0.2;
    let problem = match same {
        true => format!("makes the {what} move another way than the velocities, as fast"),
        false => format!(
            "makes the {what} move by {moved:.3} m/s where the velocities say {said:.3} m/s"
        ),
    };
    Some(Measure {
        kind: if vertical { Kind::Climbs } else { Kind::Moves },
        left: 0.0,
        size: apart / APART,
        problem,
        state: format!(
            "{what} and velocities agree within {:.0} %",
            (100.0 * apart).ceil()
        ),
    })
}

/// Whether heights rise where the vertical velocities say so, or fall, or do not follow them. Small
/// slopes show it together, where each alone is less than the noise of the heights: by the slope of
/// the one over the other, which is 1. Its standard deviation is that of its residuals, or that of
/// the heights; only every fourth is independent, because neighbouring chords share three quarters.
fn way(evidence: &Evidence) -> Option<Measure> {
    let pairs: Vec<[f64; 3]> = chords(&evidence.fixes, CHORD_S[1])
        .filter(|(.., sigma)| sigma[1].is_finite())
        .map(|(moved, said, sigma)| [moved.z, said.z, sigma[1]])
        .collect();
    let sum = |of: &dyn Fn(&[f64; 3]) -> f64| pairs.iter().map(of).sum::<f64>();
    let count = pairs.len() as f64;
    let square = sum(&|[_, said, _]| said * said);
    let slope = sum(&|[moved, said, _]| moved * said) / square;
    let rest = sum(&|[moved, said, _]| (moved - slope * said).powi(2)) / count;
    let stated = sum(&|[.., sigma]| sigma * sigma) / count;
    let sigma = 2.0 * (rest / square).sqrt();
    let known = pairs.len() >= 4 * PAIRS && slope.abs() > SIGMAS * sigma;
    let most = slope.abs() + SIGMAS * sigma.max(2.0 * (stated / square).sqrt());
    let said = (square / count).sqrt();
    let stays = pairs.len() >= 4 * PAIRS && most < FOLLOWS && said > CLIMBS_MPS;
    let first = evidence.fixes.iter().find(|fix| fix.has(2..3))?.height_m;
    let mut heights = evidence.fixes.iter().filter(|fix| fix.has(2..3));
    (known || stays).then(|| Measure {
        kind: Kind::Climbs,
        left: 0.0,
        size: if slope < 0.0 || stays { 2.0 } else { 0.0 },
        problem: match stays {
            false => "makes the heights move another way than the vertical velocities".into(),
            true if heights.all(|fix| fix.height_m == first) => format!(
                "is {first} m at all fixes, where the vertical velocities say {said:.3} m/s"
            ),
            true => format!(
                "makes the heights move by {:.4} of the vertical velocities, which say {said:.3} \
                 m/s",
                slope.abs()
            ),
        },
        state: "heights and vertical velocities rise together".into(),
    })
}

/// Pairs of positions at least `chord` s apart: the velocity between them, the mean of those that
/// the fixes have measured, and its standard deviations, horizontal and vertical, m/s.
fn chords(
    fixes: &[TimedFix],
    chord: f64,
) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>, [f64; 2])> {
    let mut begins = f64::MIN;
    (0..fixes.len()).filter_map(move |from| {
        let a = &fixes[from];
        if a.time - begins < 0.25 * chord {
            return None;
        }
        let length = fixes[from..]
            .iter()
            .position(|b| b.time - a.time >= chord)?;
        let part = &fixes[from..=from + length];
        let b = part.last()?;
        let whole = part.iter().all(|fix| fix.has(0..5));
        let near = part.windows(2).all(|w| w[1].time - w[0].time <= NEAR_S);
        if !whole || !near {
            return None;
        }
        begins = a.time;
        let dt = b.time - a.time;
        let steps = part.windows(2).map(|w| {
            let sum = Vector3::from(w[0].velocity) + Vector3::from(w[1].velocity);
            sum * (0.5 * (w[1].time - w[0].time))
        });
        let said = steps.sum::<Vector3<f64>>() / dt;
        let moved = Vector3::new(
            (b.lat_deg - a.lat_deg) * DEGREE_M,
            (b.lon_deg - a.lon_deg) * DEGREE_M * a.lat_deg.to_radians().cos(),
            a.height_m - b.height_m,
        ) / dt;
        let sigma = |k: usize| std::f64::consts::SQRT_2 * a.sigmas[k].max(b.sigmas[k]) / dt;
        let vertical = if a.has(5..6) { sigma(2) } else { f64::INFINITY };
        Some((moved, said, [sigma(0).max(sigma(1)), vertical]))
    })
}

fn turns(evidence: &Evidence) -> Option<Measure> {
    let (factor, together) = super::turning::factor(evidence)?;
    let least = TURNING[usize::from(together > AS_ONE)];
    let back = factor < 0.0;
    Some(Measure {
        kind: Kind::Turns,
        left: 0.0,
        size: if back {
            2.0
        } else {
            (factor.ln() / least.ln()).abs()
        },
        problem: match back {
            true => "turns the other way than the course of the fixes".into(),
            false => format!("gives {factor:.3} of the rotation that the course of the fixes has"),
        },
        state: format!("the gyros turn by {factor:.2} of the course of the fixes"),
    })
}

fn gravity(evidence: &Evidence, rests: &Rests) -> Option<Measure> {
    let at_rest = rests.means(fault::GRAVITY);
    let (size, when, wrong) = match at_rest {
        Some((means, wrong)) => (norm(means.force), "at rest", wrong),
        None => {
            let (_, size) = drive(evidence)?;
            (
                size,
                "in the middle of the drive",
                (size / G - 1.0).abs() > DRIVE_SHARE,
            )
        }
    };
    let off = (size / G).ln().abs();
    let missing = if size < MISSING * G {
        ", where gravity is missing"
    } else {
        " instead of gravity"
    };
    Some(Measure {
        kind: Kind::Gravity,
        left: 0.0,
        size: if wrong { 1.0 + off } else { off.min(0.99) },
        problem: format!("gives a specific force of {size:.3} m/s2 {when}{missing}"),
        state: format!("the specific force is {size:.3} m/s2 {when}"),
    })
}

fn down(evidence: &Evidence, rests: &Rests) -> Option<Measure> {
    let (force, wrong) = match rests.means(fault::AXES) {
        Some((means, wrong)) => (Vector3::from(means.force).map(f64::from), wrong),
        None => {
            let (force, size) = drive(evidence)?;
            if force.norm() < ONE_WAY * size {
                return None;
            }
            (force, -force.z < 0.866 * force.norm())
        }
    };
    let axis = force.iamax();
    let name = AXES[axis];
    let way = if force[axis] < 0.0 {
        "against"
    } else {
        "along"
    };
    let tilt = (-force.z / force.norm()).clamp(-1.0, 1.0).acos();
    Some(Measure {
        kind: Kind::Down,
        left: 0.0,
        size: if wrong { 1.0 + tilt } else { tilt.min(0.99) },
        problem: format!("makes the specific force point {way} the axis called {name}, not up"),
        state: "the specific force points up".into(),
    })
}

fn earth(rests: &Rests) -> Option<Measure> {
    let (means, wrong) = rests.means(fault::EARTH_RATE)?;
    let size = norm(means.rate) / DEG_PER_H;
    let off = (size / 15.041).ln().abs();
    Some(Measure {
        kind: Kind::Earth,
        left: 0.0,
        size: if wrong { 1.0 + off } else { 0.0 },
        problem: format!("gives {size:.3} deg/h at rest, where the Earth turns by 15.041 deg/h"),
        state: format!("the rate at rest is {size:.3} deg/h"),
    })
}

/// Mean force of a drive without a rest, and the median of its size, m/s2.
fn drive(evidence: &Evidence) -> Option<(Vector3<f64>, f64)> {
    /// Shortest drive whose force is evaluated, s.
    const DRIVE_S: usize = 60;
    let blocks = &evidence.blocks;
    let stands = speeds(&evidence.fixes).iter().all(|s| s.2 < 1.0);
    if blocks.len() < DRIVE_S || stands && evidence.fixes.len() < 2 {
        return None;
    }
    let sum: Vector3<f64> = blocks.iter().map(|b| b.force).sum();
    let mut sizes: Vec<f64> = blocks.iter().map(|b| b.force.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    Some((sum / blocks.len() as f64, sizes[sizes.len() / 2]))
}

fn norm(v: [f32; 3]) -> f64 {
    Vector3::from(v).map(f64::from).norm()
}
