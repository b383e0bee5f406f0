//! Quantities computed from a recording: blocks of a second, times at rest, and rotation and mean
//! specific force in motion.

use firmware::plausibility::rest::{Judged, Rest};
use firmware::plausibility::{AT_REST, EARTH, Expected};
use host_io::recordings::InitialAttitude;
use host_io::recordings::record::{Record, TimedFix};
use nalgebra::Vector3;

/// Largest time between a block and a fix that applies to it, s.
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
/// Shortest drive whose mean force is evaluated, s.
const DRIVE_S: usize = 60;
/// Metres of a degree of latitude.
const DEGREE_M: f64 = 111_200.0;

/// The means of about a second.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Its end and its length, s.
    end: f64,
    seconds: f64,
    /// rad/s, m/s2.
    pub(super) rate: Vector3<f64>,
    pub(super) force: Vector3<f64>,
}

/// Quantities computed from a recording.
#[derive(Debug)]
pub(super) struct Observed {
    pub(super) blocks: Vec<Block>,
    /// Times at rest: the judgement, and the number of the block after the last one.
    pub(super) rests: Vec<(Judged, usize)>,
    /// Rotation about the down axis by the change of course that the fixes show, if it turns.
    pub(super) turning: Option<f64>,
    /// Latitude of the first fix, rad.
    latitude: Option<f64>,
    /// Samples a second by the time stamps.
    pub(super) rate_hz: f64,
}

impl Observed {
    pub(super) fn of(record: &Record, expected: &Expected) -> Self {
        let blocks = blocks(record);
        let mut rest = Rest::new(*expected);
        let speeds = speeds(record);
        let declared = match record.initial_attitude {
            Some(InitialAttitude::Standstill(s)) => record.first_epoch() + s as f64,
            _ => f64::MIN,
        };
        let begins = record.first_epoch();
        let mut rests = Vec::new();
        for (k, block) in blocks.iter().enumerate() {
            let start = block.end - block.seconds;
            let stands = start >= begins && block.end <= declared || record.fixes.len() == 1;
            match speed(&speeds, start, block.end) {
                _ if stands => rest.fix(0.0, 0.0),
                Some((speed, sigma)) => rest.fix(speed as f32, sigma as f32),
                None => {}
            }
            let [rate, force] = [block.rate, block.force].map(|v| v.map(|x| x as f32).into());
            let found = rest.block(block.seconds as f32, rate, force);
            rests.extend(found.map(|found| (found, k + 1)));
        }
        let span = record.time.end().zip(record.time.start());
        let steps = record.time.len().saturating_sub(1) as f64;
        Self {
            turning: turning(record),
            latitude: record.fixes.first().map(|fix| fix.lat_deg.to_radians()),
            rate_hz: span.map_or(f64::NAN, |(last, first)| steps / (last - first)),
            blocks,
            rests,
        }
    }

    /// The first time at rest with a fault, if most of them have it.
    pub(super) fn fault(&self, bit: u32) -> Option<&Judged> {
        let judged = self.rests.iter().map(|(found, _)| found);
        let judged: Vec<_> = judged.filter(|found| found.judged & bit != 0).collect();
        let wrong = judged.iter().filter(|found| found.faults & bit != 0);
        let first = *wrong.clone().next()?;
        (2 * wrong.count() > judged.len()).then_some(first)
    }

    /// White noise at rest by the differences of neighbouring blocks, rad/sqrt(s) and
    /// m/s/sqrt(s): the median axis of the quietest rest. Sway and vibration add to it.
    pub(super) fn noise(&self) -> Option<[f64; 2]> {
        let of = |value: fn(&Block) -> Vector3<f64>| {
            let rests = self.steady().map(|(found, end)| {
                let blocks = &self.blocks[end - usize::from(found.blocks)..*end];
                let pairs = blocks.windows(2);
                let scale = 0.5 / (blocks.len() - 1) as f64;
                let sum = pairs.fold(Vector3::zeros(), |sum: Vector3<f64>, pair| {
                    let step = value(&pair[1]) - value(&pair[0]);
                    sum + step.component_mul(&step) * (pair[1].seconds * scale)
                });
                let mut axes = [sum.x, sum.y, sum.z].map(f64::sqrt);
                axes.sort_by(f64::total_cmp);
                axes[1]
            });
            rests.min_by(f64::total_cmp)
        };
        Some([of(|b| b.rate)?, of(|b| b.force)?])
    }

    /// Difference of the rates at rest from the Earth's, up or across, rad/s, and the number of
    /// seconds over which they were averaged.
    pub(super) fn bias(&self) -> Option<(f64, f64)> {
        let (sin, cos) = self.latitude?.sin_cos();
        let (mut seconds, mut off) = (0.0, [0.0; 2]);
        for (Judged { means, .. }, _) in self.steady() {
            let [rate, force] = [means.rate, means.force].map(|v| Vector3::from(v).map(f64::from));
            let up = rate.dot(&force.normalize());
            let across = (rate - force.normalize() * up).norm();
            let weight = f64::from(means.seconds);
            seconds += weight;
            off[0] += weight * (up - f64::from(EARTH) * sin);
            off[1] += weight * (across - f64::from(EARTH) * cos);
        }
        let off = off.map(|off| (off / seconds).abs());
        (seconds > 0.0).then(|| (off[0].max(off[1]), seconds))
    }

    /// Times at rest without swinging.
    fn steady(&self) -> impl Iterator<Item = &(Judged, usize)> + Clone {
        self.rests
            .iter()
            .filter(|(found, _)| found.judged == AT_REST)
    }

    /// Mean force of a drive without a rest, m/s2.
    pub(super) fn drive(&self) -> Option<Vector3<f64>> {
        let long = self.rests.is_empty() && self.blocks.len() >= DRIVE_S;
        let sum: Vector3<f64> = self.blocks.iter().map(|b| b.force).sum();
        long.then(|| sum / self.blocks.len() as f64)
    }
}

fn blocks(record: &Record) -> Vec<Block> {
    let Some(first) = record.time.start() else {
        return Vec::new();
    };
    let ends: Vec<f64> = record.increments().take(2).map(|(end, _)| end).collect();
    let lead = ends.get(1).zip(ends.first()).map_or(0.0, |(b, a)| b - a);
    let mut start = if ends.first() == Some(&first) {
        first - lead
    } else {
        first
    };
    let mut sum = [Vector3::zeros(); 2];
    let mut out = Vec::new();
    for (end, increment) in record.increments() {
        sum[0] += increment.dtheta;
        sum[1] += increment.dv;
        let seconds = end - start;
        if seconds > 0.999 {
            out.push(Block {
                end,
                seconds,
                rate: sum[0] / seconds,
                force: sum[1] / seconds,
            });
            (start, sum) = (end, [Vector3::zeros(); 2]);
        }
    }
    out
}

/// Time, velocity north and east, speed and its standard deviation of each fix. A velocity that was
/// not measured is the difference of the positions.
fn speeds(record: &Record) -> Vec<(f64, [f64; 2], f64, f64)> {
    let fixes = &record.fixes;
    let of = |k: usize| {
        let fix = &fixes[k];
        if let Some([n, e, d]) = fix.measured_velocity() {
            let speed = (n * n + e * e + d * d).sqrt();
            let [.., sn, se, sd] = fix.sigmas;
            return Some((fix.time, [n, e], speed, sn.max(se).max(sd)));
        }
        let next = fixes.get(k + 1)?;
        let dt = next.time - fix.time;
        if dt > NEAR_S {
            return None;
        }
        let n = (next.lat_deg - fix.lat_deg) * DEGREE_M / dt;
        let e = (next.lon_deg - fix.lon_deg) * DEGREE_M * fix.lat_deg.to_radians().cos() / dt;
        let d = (fix.height_m - next.height_m) / dt;
        let speed = (n * n + e * e + d * d).sqrt();
        let sigma = std::f64::consts::SQRT_2 * fix.sigmas[0].max(fix.sigmas[1]) / dt;
        Some((fix.time, [n, e], speed, sigma))
    };
    (0..fixes.len()).filter_map(of).collect()
}

/// The largest speed of the fixes around a block.
fn speed(speeds: &[(f64, [f64; 2], f64, f64)], start: f64, end: f64) -> Option<(f64, f64)> {
    let first = speeds.partition_point(|s| s.0 < start).saturating_sub(1);
    let around = speeds[first..].iter().take_while(|s| s.0 <= end + NEAR_S);
    let near = around.filter(|s| s.0 >= start - NEAR_S);
    near.map(|s| (s.2, s.3)).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The factor from changes of course to rotation about the down axis. On a straight road only
/// rotations that are far too large can be detected.
///
/// The noise of the courses adds to their squares and not to the products, so that it makes the
/// factor too small. Where the noise is not small compared with the turns, there is no factor.
fn turning(record: &Record) -> Option<f64> {
    let courses = courses(record);
    let turns = angles(record, courses.iter().map(|course| course.time));
    let (mut turned, mut product, mut square, mut noise) = (0.0, 0.0, 0.0, 0.0);
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
        noise += variance;
    }
    if turned > TURNS {
        return (square > CLEAR * noise).then(|| product / square);
    }
    let [pairs, course, rotation, noise] = straight;
    let [course, rotation] = [course + noise, rotation].map(|sum: f64| (sum / pairs).sqrt());
    (rotation > STRAIGHT + course).then(|| rotation / course.max(0.1 * TURN))
}

/// A course over ground.
#[derive(Debug, Clone, Copy)]
struct Course {
    /// Time of validity, s.
    time: f64,
    /// Time between the fixes of which it is the difference, s; 0 if it was measured.
    span: f64,
    /// North and east, m/s.
    velocity: [f64; 2],
    /// Standard deviation of each, m/s.
    sigma: f64,
}

impl Course {
    fn speed(&self) -> f64 {
        let [n, e] = self.velocity;
        n.hypot(e)
    }

    /// Whether it is fast enough for a meaningful direction.
    fn is_fast(&self) -> bool {
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
fn courses(record: &Record) -> Vec<Course> {
    let mut out = Vec::new();
    let mut from: Option<&TimedFix> = None;
    for fix in &record.fixes {
        if let Some([n, e, _]) = fix.measured_velocity() {
            let [.., north, east, _] = fix.sigmas;
            out.push(Course {
                time: fix.time,
                span: 0.0,
                velocity: [n, e],
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
                sigma: std::f64::consts::SQRT_2 * fix.sigmas[0].max(fix.sigmas[1]) / span,
            });
        }
    }
    out
}

/// Rotation about the down axis up to the first increment that does not end before each of these
/// rising times, rad. `None` for times outside those of the increments.
fn angles(record: &Record, times: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
    let mut increments = record.increments().enumerate();
    let mut now: Option<(usize, f64, f64)> = None;
    let mut ended = false;
    let mut at = |t: f64| {
        while !ended && now.is_none_or(|(_, end, _)| end < t) {
            let angle = now.map_or(0.0, |(.., angle)| angle);
            match increments.next() {
                Some((k, (end, increment))) => now = Some((k, end, angle + increment.dtheta.z)),
                None => ended = true,
            }
        }
        let (k, _, angle) = now.filter(|_| !ended)?;
        (k > 0).then_some(angle)
    };
    times.map(&mut at).collect()
}
