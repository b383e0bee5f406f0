//! Bounds of learning the unit's errors over time.

use super::super::{Contents, Figure, Part, Table};
use super::data;
use crate::learnability::{figures, picture, table};
use host_core::error::Error;
use host_estimation::analysis::learnability::{Answer, Line};

const TITLE: &str = "What is learnable, and when";

pub(super) fn part(contents: &Contents) -> Result<Part, Error> {
    let answer = match &contents.learnable {
        Ok(answer) => answer,
        Err(why) => return Ok(Part::without("learnable", TITLE, why)),
    };
    table(answer, usize::MAX)?; // rejects results that are not finite
    let lines = answer.lines();
    let times = answer.times_s.iter().map(|t| format!("{} min", t / 60));
    let head = ["bound of", "unit", "before"].map(String::from);
    let row = |of: &[Line]| {
        let first = of.first()?;
        let prior = first.prior.map_or("-".to_owned(), figures);
        let start = [first.quantity.clone(), first.unit.to_owned(), prior];
        let bounds = of.iter().map(|line| figures(line.bound));
        Some(start.into_iter().chain(bounds).collect())
    };
    Ok(Part {
        sentences: vec![
            "On a simulated road drive with the errors of the datasheet: the least standard \
             deviation (Cram\u{e9}r-Rao bound) that any estimator can reach after so many minutes \
             of driving with fixes, after 5 min of standstill."
                .into(),
        ]
        .into_iter()
        .chain(halved(answer))
        .collect(),
        tables: vec![Table {
            caption: Some("Bounds".into()),
            head: head.into_iter().chain(times).collect(),
            rows: lines.chunks(answer.times_s.len()).filter_map(row).collect(),
            text: 2,
            ..Table::default()
        }],
        figures: vec![Figure {
            name: "learnability",
            title: "Bound over learning time".into(),
            caption: "Thin lines: the bound of each axis. Thick line: its root mean square over \
                      the axes."
                .into(),
            picture: picture(answer),
            narrow: None,
        }],
        data: data(&lines),
        ..Part::new("learnable", TITLE)
    })
}

/// The times at which the uncertainty of each of the six biases is halved, in a sentence.
pub(in super::super) fn halved(answer: &Answer) -> Option<String> {
    let lines = answer.lines();
    let bias = lines.iter().filter(|line| line.quantity.contains("bias"));
    let bias: Vec<&Line> = bias.collect();
    let mut known = vec![];
    let mut never = vec![];
    for of in bias.chunk_by(|a, b| a.quantity == b.quantity) {
        let first = of
            .iter()
            .find(|l| l.prior.is_some_and(|p| l.bound <= 0.5 * p));
        match (first, of.first()) {
            (Some(line), _) => known.push(format!("{} {} min", line.quantity, line.time_s / 60)),
            (None, Some(line)) => never.push(line.quantity.clone()),
            (None, None) => {}
        }
    }
    let mut text = match known.is_empty() {
        true => String::new(),
        false => format!(
            "Known at best to half of the datasheet's bias after: {}.",
            known.join(", ")
        ),
    };
    if !never.is_empty() {
        let last = answer.times_s.last()? / 60;
        text += &format!(" Not within {last} min: {}.", never.join(", "));
    }
    (!text.is_empty()).then(|| text.trim().to_owned())
}
