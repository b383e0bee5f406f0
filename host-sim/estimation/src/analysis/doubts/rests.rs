//! Times at rest, and the noise and bias of the sensors there.

use super::DEGREE_M;
use super::evidence::{Block, Evidence};
use firmware::plausibility::rest::{Judged, RestCheck};
use firmware::plausibility::{AT_REST, EARTH, Expected, Means};
use host_io::recordings::record::TimedFix;
use nalgebra::Vector3;

/// Largest time between a block and a fix that applies to it, s.
const NEAR_S: f64 = 2.5;

/// Times at rest.
#[derive(Debug)]
pub(super) struct Rests<'a> {
    blocks: &'a [Block],
    /// The judgement of each, and the number of the block after it.
    all: Vec<(Judged, usize)>,
    /// Latitude of the first fix, rad.
    latitude: Option<f64>,
}

impl<'a> Rests<'a> {
    pub(super) fn of(evidence: &'a Evidence, expected: &Expected) -> Self {
        let mut rest = RestCheck::new(*expected);
        let speeds = speeds(&evidence.fixes);
        let mut all = Vec::new();
        for (k, block) in evidence.blocks.iter().enumerate() {
            let start = block.end - block.seconds;
            let declared = evidence.declared;
            let stands = declared.is_some_and(|[from, to]| start >= from && block.end <= to);
            match speed(&speeds, start, block.end) {
                _ if stands || evidence.fixes.len() == 1 => rest.fix(0.0, 0.0),
                Some((speed, sigma)) => rest.fix(speed as f32, sigma as f32),
                None => {}
            }
            let [rate, force] = [block.rate, block.force].map(|v| v.map(|x| x as f32).into());
            if let Some(found) = rest.block(block.seconds as f32, rate, force) {
                all.push((found, k + 1));
            }
        }
        Self {
            blocks: &evidence.blocks,
            all,
            latitude: evidence.fixes.first().map(|fix| fix.lat_deg.to_radians()),
        }
    }

    /// The means of the first rest that is judged by a check, and whether most of them fail; then
    /// those of the first one that fails.
    pub(super) fn means(&self, bit: u32) -> Option<(Means, bool)> {
        let judged = self.all.iter().map(|(found, _)| found);
        let judged: Vec<_> = judged.filter(|found| found.judged & bit != 0).collect();
        let wrong = || judged.iter().filter(|found| found.faults & bit != 0);
        let fails = 2 * wrong().count() > judged.len();
        let first = if fails {
            wrong().next()
        } else {
            judged.first()
        };
        first.map(|found| (found.means, fails))
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
        self.all.iter().filter(|(found, _)| found.judged == AT_REST)
    }
}

/// Time, velocity north and east, speed and its standard deviation of each fix. A velocity that was
/// not measured is the difference of the positions.
pub(super) fn speeds(fixes: &[TimedFix]) -> Vec<(f64, [f64; 2], f64, f64)> {
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
        let d = match fix.has(2..3) && next.has(2..3) {
            true => (fix.height_m - next.height_m) / dt,
            false => 0.0,
        };
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
