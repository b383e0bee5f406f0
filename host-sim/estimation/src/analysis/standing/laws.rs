//! How the biases depend on temperature, and how much of them is new at each power-on.
//!
//! The mean rate of each minute at rest is a point. If the temperature changes by some kelvins
//! within a log, the slope comes from within the logs, each with a level of its own; otherwise
//! from the levels of the logs. What the levels scatter beside the slope is new at each power-on.

use nalgebra::Vector3;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Least range of temperatures from which a slope is computed, K.
const LEAST_K: f64 = 5.0;
/// Probability that the scatter is larger than its upper end.
const TAIL: f64 = 0.05;

/// The means of a time at rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// Number of its log.
    pub(super) log: usize,
    /// degrees C, if it is known.
    pub(super) celsius: Option<f64>,
    /// Values of the axes; those that are not measured are equal in all points.
    pub(super) value: Vector3<f64>,
}

/// A linear law of the temperature.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Law {
    /// Least and largest temperature, degrees C.
    pub range_degc: [f64; 2],
    /// Slope of each axis in SI per K.
    #[serde(serialize_with = "super::axes")]
    pub per_k: Vector3<f64>,
    /// Its standard deviation.
    #[serde(serialize_with = "super::axes")]
    pub sigma: Vector3<f64>,
    /// Whether it comes from within the logs; else from the differences between them, of which
    /// those of the power-on are a part.
    pub within: bool,
}

/// The scatter of the biases from power-on to power-on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scatter {
    /// Standard deviation over the logs, all axes together, SI.
    pub sigma: f64,
    /// Upper end of its one-sided 95 % interval.
    pub high: f64,
    /// Degrees of freedom.
    pub degrees: usize,
}

/// Law and scatter of the points of `logs` logs, of which so many `axes` are measured.
pub(super) fn of(points: &[Point], logs: usize, axes: usize) -> (Option<Law>, Option<Scatter>) {
    let law = law(points, logs);
    let slope = law.as_ref().map_or(Vector3::zeros(), |law| law.per_k);
    let levels = levels(points, logs, &slope);
    let lost = 1 + usize::from(law.as_ref().is_some_and(|law| !law.within));
    let degrees = axes * levels.len().saturating_sub(lost);
    if degrees == 0 {
        return (law, None);
    }
    let mean: Vector3<f64> = levels.iter().sum::<Vector3<f64>>() / levels.len() as f64;
    let squares: f64 = levels
        .iter()
        .map(|level| (level - mean).norm_squared())
        .sum();
    let sigma = (squares / degrees as f64).sqrt();
    let scatter = Scatter {
        sigma,
        high: sigma * upper(degrees),
        degrees,
    };
    (law, Some(scatter))
}

/// Upper end of a standard deviation of so many degrees of freedom, as a factor.
pub(super) fn upper(degrees: usize) -> f64 {
    let chi = ChiSquared::new(degrees as f64);
    chi.map_or(1.0, |chi| (degrees as f64 / chi.inverse_cdf(TAIL)).sqrt())
}

/// The mean of each log, at its mean temperature less the slope's part.
fn levels(points: &[Point], logs: usize, slope: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let level = |log: usize| {
        let of_log = || points.iter().filter(move |p| p.log == log);
        let at_zero = of_log().map(|p| p.value - slope * p.celsius.unwrap_or_default());
        let count = of_log().count();
        (count > 0).then(|| at_zero.sum::<Vector3<f64>>() / count as f64)
    };
    (0..logs).filter_map(level).collect()
}

/// The slope over temperature, if there are temperatures enough.
fn law(points: &[Point], logs: usize) -> Option<Law> {
    let warm: Vec<(usize, f64, Vector3<f64>)> = points
        .iter()
        .map(|p| Some((p.log, p.celsius?, p.value)))
        .collect::<Option<_>>()?;
    let temperatures = || warm.iter().map(|(_, t, _)| *t);
    let range = ends(temperatures());
    let of_log = |log: usize| warm.iter().filter(move |(l, ..)| *l == log);
    let span = |log: usize| {
        let [least, most] = ends(of_log(log).map(|(_, t, _)| *t));
        most - least
    };
    let within = (0..logs).any(|log| span(log) >= LEAST_K);
    let mean = |of: &[(f64, Vector3<f64>)]| {
        let sum = of
            .iter()
            .fold((0.0, Vector3::zeros()), |a, b| (a.0 + b.0, a.1 + b.1));
        let n = of.len().max(1) as f64;
        (sum.0 / n, sum.1 / n)
    };
    let plain = |log: usize| of_log(log).map(|(_, t, v)| (*t, *v)).collect::<Vec<_>>();
    // groups of which each has a level of its own
    let groups: Vec<Vec<(f64, Vector3<f64>)>> = match within {
        true => (0..logs).map(plain).filter(|g| g.len() > 2).collect(),
        false => {
            let all: Vec<_> = (0..logs).map(plain).filter(|g| !g.is_empty()).collect();
            vec![all.iter().map(|group| mean(group)).collect()]
        }
    };
    let [least, most] = range;
    if most - least < LEAST_K || groups.iter().all(|g| g.len() < 3) {
        return None;
    }
    let (mut tt, mut tv) = (0.0, Vector3::zeros());
    for group in &groups {
        let (t0, v0) = mean(group);
        for (t, v) in group {
            tt += (t - t0).powi(2);
            tv += (v - v0) * (t - t0);
        }
    }
    let per_k = tv / tt;
    let residuals: Vec<Vec<Vector3<f64>>> = groups
        .iter()
        .map(|group| {
            let (t0, v0) = mean(group);
            group
                .iter()
                .map(|(t, v)| v - v0 - per_k * (t - t0))
                .collect()
        })
        .collect();
    Some(Law {
        range_degc: range,
        per_k,
        sigma: slope_sigma(&residuals, tt),
        within,
    })
}

/// Standard deviation of a slope by its residuals. Neighbouring minutes are alike, which leaves
/// fewer of them.
fn slope_sigma(groups: &[Vec<Vector3<f64>>], tt: f64) -> Vector3<f64> {
    let count: usize = groups.iter().map(Vec::len).sum();
    let squares = |f: &dyn Fn(&[Vector3<f64>]) -> Vector3<f64>| {
        groups.iter().map(|g| f(g)).sum::<Vector3<f64>>()
    };
    let own = squares(&|g| g.iter().map(|r| r.component_mul(r)).sum());
    let next = squares(&|g| g.windows(2).map(|p| p[0].component_mul(&p[1])).sum());
    let degrees = (count as f64 - groups.len() as f64 - 1.0).max(1.0);
    Vector3::from_fn(|i, _| {
        let alike = match own[i] > 0.0 {
            true => (next[i] / own[i]).clamp(0.0, 0.99),
            false => 0.0,
        };
        (own[i] / degrees / tt * (1.0 + alike) / (1.0 - alike)).sqrt()
    })
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
        [a.min(x), b.max(x)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn normal(rng: &mut ChaCha8Rng) -> Vector3<f64> {
        Vector3::from_fn(|_, _| StandardNormal.sample(rng))
    }

    /// Points of `logs` logs: slope, scatter of 0.5, noise of 0.1.
    fn points(seed: u64, logs: usize, span: f64) -> Vec<Point> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut all = vec![];
        for log in 0..logs {
            let level = normal(&mut rng) * 0.5;
            for k in 0..20 {
                let t = 10.0 * log as f64 + span * f64::from(k) / 19.0;
                all.push(Point {
                    log,
                    celsius: Some(t),
                    value: Vector3::new(0.3, -0.1, 0.0) * t + level + normal(&mut rng) * 0.1,
                });
            }
        }
        all
    }

    #[test]
    fn slopes_and_scatter_are_those_of_the_points_within_their_intervals() {
        let (mut slopes, mut scatters) = (0, 0);
        for seed in 0..100 {
            for span in [0.5, 12.0] {
                let (law, scatter) = of(&points(seed, 4, span), 4, 3);
                let (law, scatter) = (law.unwrap(), scatter.unwrap());
                assert_eq!(law.within, span > 5.0);
                let off = law.per_k - Vector3::new(0.3, -0.1, 0.0);
                slopes += (0..3)
                    .filter(|i| off[*i].abs() > 3.0 * law.sigma[*i])
                    .count();
                scatters += usize::from(scatter.high < 0.5);
                assert_eq!(scatter.degrees, if law.within { 9 } else { 6 });
            }
        }
        // 600 slopes and 200 scatters; a slope between four logs has two degrees of freedom
        println!("{slopes} slopes beyond 3 sigma, {scatters} scatters below the truth");
        assert!(slopes <= 30 && scatters <= 16, "{slopes} {scatters}");
    }

    #[test]
    fn one_log_or_one_temperature_shows_nothing() {
        let (law, scatter) = of(&points(1, 1, 0.5), 1, 3);
        assert_eq!((law, scatter), (None, None));
        let cold = |mut p: Point| {
            p.celsius = None;
            p
        };
        let (law, scatter) = of(
            &points(1, 3, 0.5).into_iter().map(cold).collect::<Vec<_>>(),
            3,
            3,
        );
        assert!(law.is_none() && scatter.unwrap().degrees == 6);
    }
}
