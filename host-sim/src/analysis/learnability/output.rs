//! The printed tables and the JSON.

use super::{Answer, QUANTITIES, SCHEMES, quantity};
use crate::error::Error;
use comfy_table::{Table, presets};
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
    /// Standard deviation before learning; none for a mean error.
    pub prior: Option<f64>,
    /// Cramer-Rao bound.
    pub bound: f64,
    /// Root mean square error of each scheme that estimates it.
    pub reached: Vec<Reached>,
}

/// What a scheme reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reached {
    /// Scheme.
    pub scheme: &'static str,
    /// Root mean square over the units.
    pub rms: f64,
}

impl Answer {
    /// All numbers in datasheet units, by quantity, then time.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let line = |q: usize, t: usize| {
            let (name, unit, si) = quantity(q);
            let reached = SCHEMES
                .iter()
                .zip(&self.reached)
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

    /// The bounds against time, and what was reached at the end, as text.
    ///
    /// # Errors
    /// [`Error::BadResult`] for a bound that is not finite.
    pub fn table(&self) -> Result<String, Error> {
        let lines = self.lines();
        if let Some(bad) = lines.iter().find(|l| !l.bound.is_finite()) {
            return Err(Error::BadResult {
                item: bad.quantity.clone(),
                field: "bound",
                problem: "is not finite".into(),
            });
        }
        let times = self.times_s.iter().map(|t| format!("{} min", t / 60));
        let head = ["bound of", "unit", "before"].map(String::from);
        let mut bounds = new_table(head.into_iter().chain(times));
        let head = ["rms error at the end", "unit", "bound"].map(String::from);
        let mut ends = new_table(
            head.into_iter()
                .chain(SCHEMES.map(|(name, _)| name.to_owned())),
        );
        for of in lines.chunks(self.times_s.len()) {
            let Some(end) = of.last() else { continue };
            let start = [end.quantity.clone(), end.unit.to_owned()];
            let prior = end.prior.map_or("-".to_owned(), figures);
            let cells = of.iter().map(|l| figures(l.bound));
            bounds.add_row(start.clone().into_iter().chain([prior]).chain(cells));
            let cell = |(name, _): &(&str, _)| {
                let hit = end.reached.iter().find(|r| r.scheme == *name);
                hit.map_or("-".to_owned(), |r| figures(r.rms))
            };
            let bound = [figures(end.bound)];
            ends.add_row(
                start
                    .into_iter()
                    .chain(bound)
                    .chain(SCHEMES.iter().map(cell)),
            );
        }
        Ok(match self.units {
            0 => bounds.to_string(),
            n => format!("{bounds}\n\n{n} simulated units:\n\n{ends}"),
        })
    }
}

fn new_table(head: impl Iterator<Item = String>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header(head);
    table
}

/// Three figures.
fn figures(x: f64) -> String {
    let digits = match x.abs() {
        a if a > 0.0 => (2 - a.log10().floor() as i32).clamp(0, 9) as usize,
        _ => 0,
    };
    format!("{x:.digits$}")
}
