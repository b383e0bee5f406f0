//! Track and error of each scheme without fixes, with intervals.

use super::super::{Contents, Figure, Part, Table};
use super::{case, data};
use crate::drawn::caption;
use crate::figures::{self, length};
use crate::json;
use crate::replay::in_seconds;
use crate::terms;
use crate::verdict::of_outcome;
use host_core::error::Error;
use host_lab::experiment::outcome::Outcome;

const TITLE: &str = "Navigation without fixes";
/// Factor of the standard deviation of the reference fixes for an interval of 95 %. They err in two
/// directions, each by at most this standard deviation, and the length of both is below this factor
/// in 95 % of cases. One direction (1.96) is enough only for errors that are much larger than those
/// of the fixes.
const TWO_DIRECTIONS: f64 = 2.448;

pub(super) fn part(contents: &Contents) -> Result<Part, Error> {
    let outcomes = match &contents.outcomes {
        Ok(outcomes) => outcomes,
        Err(why) => return Ok(Part::without("navigation", TITLE, why)),
    };
    let mut part = Part::new("navigation", TITLE);
    part.explained.push(
        "What was learnt from one part of the recording corrects another, where each scheme \
         navigates without fixes."
            .into(),
    );
    for outcome in outcomes {
        for row in &outcome.rows {
            if !row.horizontal_m.is_finite() {
                return Err(Error::BadResult {
                    item: format!("{} s, {}", row.t_s, row.scheme),
                    field: "horizontal_m",
                    problem: "is not finite".into(),
                });
            }
        }
        let words = of_outcome(outcome).join(" ");
        part.sentences.push(format!("{}: {words}", case(outcome)));
        part.tables.push(table(outcome));
        let curves = in_seconds(outcome);
        for (figure, name) in [
            (figures::Figure::Error, "error"),
            (figures::Figure::Track, "track"),
        ] {
            part.figures.push(Figure {
                name,
                title: format!("{}: {}", figure.heading(), case(outcome)),
                caption: caption(figure, &curves),
                picture: figure.picture(&curves, "s"),
                narrow: None,
            });
        }
    }
    let mut starts: Vec<&String> = outcomes.iter().map(|of| &of.start).collect();
    starts.dedup();
    let starts = starts.into_iter().filter(|start| !start.is_empty());
    part.explained.extend(starts.cloned());
    part.explained.push(interval(outcomes));
    let names = outcomes
        .iter()
        .flat_map(|o| &o.rows)
        .map(|row| &*row.scheme);
    part.explained.extend(terms::sentences(names));
    part.data = data(&json::outcomes(outcomes));
    Ok(part)
}

/// Explanation of the intervals.
fn interval(outcomes: &[Outcome]) -> String {
    let known = outcomes
        .iter()
        .filter_map(|o| o.bench.as_deref()?.reference_sigma_m);
    match known.reduce(f64::max) {
        Some(sigma) => format!(
            "Intervals: 95 %, from the noise of the fixes that judge (at most {} along an axis). \
             They do not say how far one drive stands for others: the rehearsals and a campaign \
             do.",
            length(sigma, sigma)
        ),
        None => "No intervals: a better solution than fixes judges, and it counts as exact. How \
                 far one drive stands for others, a campaign says."
            .to_owned(),
    }
}

/// The 95 % interval of a horizontal error that was found with fixes of this standard deviation.
fn around(metres: f64, sigma: f64) -> (f64, f64) {
    let half = TWO_DIRECTIONS * sigma;
    ((metres - half).max(0.0), metres + half)
}

/// Horizontal errors, one line a scheme, one column a time.
fn table(outcome: &Outcome) -> Table {
    let sigma = outcome.bench.as_deref().and_then(|b| b.reference_sigma_m);
    let mut times: Vec<u32> = outcome.rows.iter().map(|row| row.t_s).collect();
    times.dedup();
    let mut schemes: Vec<&str> = vec![];
    for row in &outcome.rows {
        if !schemes.contains(&row.scheme.as_str()) {
            schemes.push(&row.scheme);
        }
    }
    let last = times.last().copied();
    let cell = |scheme: &str, t: u32| match outcome.horizontal(scheme, t) {
        None => "-".to_owned(),
        Some(metres) => length(metres, 0.0),
    };
    let line = |scheme: &&str| {
        let at_end = last.and_then(|t| outcome.horizontal(scheme, t));
        let between = at_end.zip(sigma).map(|(metres, sigma)| {
            let (low, high) = around(metres, sigma);
            format!("{} to {}", length(low, 0.0), length(high, 0.0))
        });
        let cells = times.iter().map(|t| cell(scheme, *t));
        let start = [(*scheme).to_owned()].into_iter();
        start
            .chain(cells)
            .chain(sigma.map(|_| between.unwrap_or("-".into())))
            .collect()
    };
    let head = ["scheme".to_owned()].into_iter();
    let head = head.chain(times.iter().map(|t| format!("{t} s")));
    Table {
        caption: Some(format!("{}: horizontal error after so long", case(outcome))),
        head: head
            .chain(sigma.map(|_| "95 % interval at the end".into()))
            .collect(),
        rows: schemes.iter().map(line).collect(),
        text: 1,
        ..Table::default()
    }
}

#[cfg(test)]
mod tests {
    use super::around;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// Errors of none to a hundred standard deviations of the fixes, measured with such fixes.
    #[test]
    fn the_interval_holds_for_small_and_large_errors() {
        const TRIED: usize = 20_000;
        let limit = 0.05 + 4.0 * (0.05 * 0.95 / TRIED as f64).sqrt();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for truth in [0.0, 0.5, 1.0, 2.0, 5.0, 100.0] {
            let missed = (0..TRIED).filter(|_| {
                let [north, east]: [f64; 2] = [0; 2].map(|_| StandardNormal.sample(&mut rng));
                let (low, high) = around((truth + north).hypot(east), 1.0);
                truth < low || truth > high
            });
            let missed = missed.count() as f64 / TRIED as f64;
            assert!(missed <= limit, "{truth}: {missed}");
        }
    }
}
