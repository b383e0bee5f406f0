//! Scale factors of the gyros from turns by a known angle about the vertical.
//!
//! Between two rests in the same attitude the sensor was turned about the vertical, so the angle is
//! a multiple n a of the known one, a. The gyros give `(1 + M_ii) n a + b t` along the axis that is
//! vertical, with the bias b of the two rests and the time t between them. The Earth's rotation is
//! in b.

use super::super::standing::{Log, Stretch, rests};
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use serde::Serialize;

/// Largest change of attitude between the rests, and angle between axis and vertical, deg.
const SAME_DEG: f64 = 3.0;
/// Cosine of the angle between axis and vertical is at least this.
const ALONG: f64 = 0.98;
/// A turn departs from the multiple of the angle by no more than this share of the angle.
const OFF: f64 = 0.2;

/// One turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Turn {
    /// The axis that was vertical, 0 to 2.
    pub axis: usize,
    /// Start and end, s.
    pub between_s: [f64; 2],
    /// True angle, rad, with the sign that the gyro has.
    pub angle: f64,
    /// Error of the scale factor.
    pub scale: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// The turns of all logs by a multiple of `angle`, each known with the standard deviation `sigma`,
/// rad.
#[must_use]
pub fn turns(logs: &[Log], least_s: f64, angle: f64, sigma: f64) -> Vec<Turn> {
    let mut all = vec![];
    for log in logs {
        let found = rests(log, least_s);
        for pair in found.stretches.windows(2) {
            let whole = |gap: &f64| !(pair[0].to_s..=pair[1].from_s).contains(gap);
            if found.gaps.iter().all(whole) {
                all.extend(turn(log, &pair[0], &pair[1], angle, sigma));
            }
        }
    }
    all
}

fn turn(log: &Log, before: &Stretch, after: &Stretch, angle: f64, sigma: f64) -> Option<Turn> {
    if before.force.angle(&after.force) > SAME_DEG * DEG {
        return None;
    }
    let up = (before.force + after.force).normalize();
    let axis = up.iamax();
    if up[axis].abs() < ALONG {
        return None;
    }
    let between = before.samples.end..after.samples.start;
    let seconds = between.len() as f64 / log.rate_hz;
    let bias = 0.5 * (before.rate + after.rate);
    let samples = log.samples.part(between);
    let turned: Vector3<f64> =
        samples.each().map(|s| s.dtheta).sum::<Vector3<f64>>() - bias * seconds;
    let times = (turned[axis] / angle).round();
    let truth = times * angle;
    // the axis is tilted by less than `ALONG` allows, and turns as much less
    let along = truth * up[axis].abs();
    if times == 0.0 || (turned[axis] - along).abs() > OFF * angle {
        return None;
    }
    let drift = 0.5 * (before.rate - after.rate)[axis].abs() + before.sigma[0][axis];
    Some(Turn {
        axis,
        between_s: [before.to_s, after.from_s],
        angle: truth,
        scale: turned[axis] / along - 1.0,
        sigma: (sigma.hypot(drift * seconds) / truth).abs(),
    })
}

/// Scale error of each axis and its standard deviation, `None` without a turn about it.
#[must_use]
pub fn scales(turns: &[Turn]) -> [Option<[f64; 2]>; 3] {
    std::array::from_fn(|axis| {
        let of_axis = || turns.iter().filter(move |turn| turn.axis == axis);
        let weight: f64 = of_axis().map(|t| t.sigma.powi(-2)).sum();
        let mean = of_axis().map(|t| t.scale * t.sigma.powi(-2)).sum::<f64>() / weight;
        let squares: f64 = of_axis()
            .map(|t| ((t.scale - mean) / t.sigma).powi(2))
            .sum();
        let degrees = of_axis().count().saturating_sub(1);
        let enlarged = match degrees {
            0 => 1.0,
            n => (squares / n as f64).sqrt().max(1.0),
        };
        (weight > 0.0).then(|| [mean, enlarged / weight.sqrt()])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::sins::Increment;
    use host_core::inertial::units::DEG_PER_H;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const RATE: f64 = 50.0;

    /// A gyro of +1 % about z and -2 % about x, turned about the axis that is up by these angles,
    /// deg, with a rest of 20 s before and after each.
    fn log(up: usize, angles: &[f64], seed: u64) -> Log {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let wrong = 0.2 * DEG * normal();
        let mut samples: Vec<Increment> = vec![];
        let scale = Vector3::new(0.98, 1.0, 1.01);
        let mut add = |rate: f64, seconds: f64| {
            for _ in 0..(seconds * RATE) as usize {
                let noise = Vector3::from_fn(|_, _| 0.01 * DEG * normal());
                let rate = Vector3::ith(up, rate).component_mul(&scale);
                let force = Vector3::ith(up, 9.8) + Vector3::from_fn(|_, _| 0.005 * normal());
                let bias = Vector3::repeat(200.0 * DEG_PER_H);
                samples.push(Increment {
                    dtheta: (rate + bias + noise) / RATE,
                    dv: force / RATE,
                });
            }
        };
        add(0.0, 20.0);
        for angle in angles {
            // the turn ends some tenths of a degree off
            add((angle * DEG + wrong) / 12.0, 12.0);
            add(0.0, 20.0);
        }
        Log {
            name: "turns.csv".into(),
            rate_hz: RATE,
            samples: samples.into(),
            begins: vec![(0, 0.0)],
            site: None,
            temperature: None,
            notes: vec![],
        }
    }

    #[test]
    fn scales_are_within_three_of_their_standard_deviations() {
        let mut held = 0;
        for seed in 0..100 {
            let logs = [
                log(2, &[360.0, -360.0, 720.0], seed),
                log(0, &[360.0], 200 + seed),
            ];
            let found = turns(&logs, 5.0, 360.0 * DEG, 0.2 * DEG);
            assert_eq!(found.len(), 4, "{found:?}");
            let [x, y, z] = scales(&found);
            assert_eq!(y, None);
            let within = |of: Option<[f64; 2]>, truth: f64| {
                let [scale, sigma] = of.unwrap();
                assert!(sigma < 1e-3, "{sigma}");
                (scale - truth).abs() < 3.0 * sigma
            };
            held += usize::from(within(x, -0.02) && within(z, 0.01));
        }
        println!("{held} of 100 hold");
        assert!(held >= 95, "{held}");
    }

    #[test]
    fn a_turn_by_another_angle_or_about_another_axis_does_not_count() {
        let found = |log: Log| turns(&[log], 5.0, 360.0 * DEG, DEG);
        assert!(found(log(2, &[180.0], 1)).is_empty());
        assert!(found(log(2, &[20.0], 1)).is_empty());
        let mut tilted = log(2, &[360.0], 1);
        tilted.samples.edit(|all| {
            for sample in all.iter_mut() {
                sample.dv = Vector3::new(6.9, 0.0, 6.9) / RATE;
            }
        });
        assert!(found(tilted).is_empty());
        let mut gap = log(2, &[360.0], 1);
        gap.begins.push((1200, 24.02));
        assert!(found(gap).is_empty());
    }
}
