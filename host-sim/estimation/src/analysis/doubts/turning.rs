//! Rotation by the gyros against the changes of course that the fixes show.

use super::DEGREE_M;
use super::evidence::Evidence;
use host_io::recordings::record::TimedFix;

/// Largest time between two courses that are compared, s.
const NEAR_S: f64 = 2.5;
/// Smallest speed by the fixes for a meaningful course, m/s.
const COURSE_MPS: f64 = 3.0;
/// Smallest change of course that is compared, and smallest sum of them, rad.
const TURN: f64 = 0.03;
const TURNS: f64 = 0.5;
/// Time between positions whose difference is a course, s.
const CHORD_S: f64 = 4.0;
/// Smallest ratio of the squares of the turns to those of the noise of the courses.
const CLEAR: f64 = 5.0;
/// Rotation between two fixes that exceeds that on any straight road, rad.
const STRAIGHT: f64 = 0.1;
/// Smallest correlation of rotation and course whose ratio means something. What flies sideways, or
/// has another clock, turns at other times than its course.
const TOGETHER: f64 = 0.7;

/// The factor from changes of course to rotation about the down axis, and their correlation. On a
/// straight road only rotations that are far too large can be detected.
///
/// The noise of the courses adds to their squares and not to the products, so that it makes the
/// factor too small. Where the noise is not small compared with the turns, or rotation and course
/// do not turn together, there is no factor.
pub(super) fn factor(evidence: &Evidence) -> Option<(f64, f64)> {
    let courses = courses(&evidence.fixes);
    let turns: Vec<Option<f64>> = courses.iter().map(|c| evidence.turned(c.time)).collect();
    let (mut turned, mut product, mut square, mut noise) = (0.0, 0.0, 0.0, 0.0);
    let mut rotated = 0.0;
    let mut straight = [0.0; 4];
    for (pair, turns) in courses.windows(2).zip(turns.windows(2)) {
        let [a, b] = [pair[0], pair[1]];
        let [Some(before), Some(now)] = [turns[0], turns[1]] else {
            continue;
        };
        if !a.is_fast() || !b.is_fast() || b.time - a.time > NEAR_S.max(2.0 * a.span) {
            continue;
        }
        let ([n0, e0], [n1, e1]) = (a.velocity, b.velocity);
        let turn = (n0 * e1 - e0 * n1).atan2(n0 * n1 + e0 * e1);
        let variance = a.variance() + b.variance();
        if turn.abs() < TURN {
            let all = [1.0, turn * turn, (now - before).powi(2), variance];
            straight.iter_mut().zip(all).for_each(|(sum, x)| *sum += x);
            continue;
        }
        turned += turn.abs();
        product += turn * (now - before);
        square += turn * turn;
        rotated += (now - before).powi(2);
        noise += variance;
    }
    if turned > TURNS {
        let together = product.abs() / (square * rotated).sqrt();
        let is_one = square > CLEAR * noise && together > TOGETHER;
        return is_one.then(|| (product / square, together));
    }
    let [pairs, course, rotation, noise] = straight;
    let [course, rotation] = [course + noise, rotation].map(|sum: f64| (sum / pairs).sqrt());
    (rotation > STRAIGHT + course).then(|| (rotation / course.max(0.1 * TURN), 0.0))
}

/// A course over ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// Time of validity, s.
    pub(super) time: f64,
    /// Time between the fixes of which it is the difference, s; 0 if it was measured.
    pub(super) span: f64,
    /// North and east, m/s.
    pub(super) velocity: [f64; 2],
    /// The mean of the heights, m.
    pub(super) height: f64,
    /// Standard deviation of each, m/s.
    sigma: f64,
}

impl Course {
    pub(super) fn speed(&self) -> f64 {
        let [n, e] = self.velocity;
        n.hypot(e)
    }

    /// Whether it is fast enough for a meaningful direction.
    pub(super) fn is_fast(&self) -> bool {
        self.speed() > COURSE_MPS.max(3.0 * self.sigma)
    }

    /// Variance of the direction, rad2. Neighbouring differences share a fix, which adds half.
    fn variance(&self) -> f64 {
        let shared = if self.span > 0.0 { 1.5 } else { 1.0 };
        shared * (self.sigma / self.speed()).powi(2)
    }
}

/// The courses that the fixes have measured; without velocities those between positions that are
/// [`CHORD_S`] apart, since the noise of positions of every second is as large as the distance
/// between them.
pub(super) fn courses(fixes: &[TimedFix]) -> Vec<Course> {
    let mut out = Vec::new();
    let mut from: Option<&TimedFix> = None;
    for fix in fixes {
        if let Some([n, e, _]) = fix.measured_velocity() {
            let [.., north, east, _] = fix.sigmas;
            out.push(Course {
                time: fix.time,
                span: 0.0,
                velocity: [n, e],
                height: fix.height_m,
                sigma: north.max(east),
            });
            from = None;
            continue;
        }
        let Some(first) = from else {
            from = Some(fix);
            continue;
        };
        let span = fix.time - first.time;
        if span < CHORD_S {
            continue;
        }
        from = Some(fix);
        let n = (fix.lat_deg - first.lat_deg) * DEGREE_M / span;
        let e = (fix.lon_deg - first.lon_deg) * DEGREE_M * fix.lat_deg.to_radians().cos() / span;
        if span < 2.0 * CHORD_S {
            out.push(Course {
                time: first.time + 0.5 * span,
                span,
                velocity: [n, e],
                height: 0.5 * (first.height_m + fix.height_m),
                sigma: std::f64::consts::SQRT_2 * fix.sigmas[0].max(fix.sigmas[1]) / span,
            });
        }
    }
    out
}
