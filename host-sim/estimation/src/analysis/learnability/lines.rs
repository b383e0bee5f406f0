//! The answer as lines in datasheet units, for the JSON, tables and pictures.

use super::{Answer, QUANTITIES, SCHEMES, quantity};
use serde::Serialize;

/// One line of the JSON: a quantity at a learning time, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// For example `gyro bias x`.
    pub quantity: String,
    /// For example `deg/h`.
    pub unit: &'static str,
    /// Driving after the standstill, s.
    pub time_s: u32,
    /// Standard deviation before learning. A mean error has none.
    pub prior: Option<f64>,
    /// Cramer-Rao bound.
    pub bound: f64,
    /// Error of each scheme that estimates it.
    pub reached: Vec<Reached>,
}

/// The error that a scheme reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reached {
    /// Scheme.
    pub scheme: &'static str,
    /// Root mean square over the units.
    pub rms: f64,
}

impl Answer {
    /// All lines, sorted by quantity, then time.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let line = |q: usize, t: usize| {
            let (name, unit, si) = quantity(q);
            let reached = SCHEMES
                .iter()
                .zip(&self.reached)
                .filter(|_| self.units > 0)
                .filter_map(|((scheme, _), r)| {
                    let rms = r[t][q] / si;
                    rms.is_finite().then_some(Reached { scheme, rms })
                });
            Line {
                quantity: name,
                unit,
                time_s: self.times_s[t],
                prior: Some(self.prior[q] / si).filter(|p| p.is_finite()),
                bound: self.bound[t][q] / si,
                reached: reached.collect(),
            }
        };
        (0..QUANTITIES)
            .flat_map(|q| (0..self.times_s.len()).map(move |t| (q, t)))
            .map(|(q, t)| line(q, t))
            .collect()
    }
}
