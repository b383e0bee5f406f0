//! `docs/START.md`: prose of `assets/start.md` around generated tables.

use super::class::{CLASSES, Goal, JOURNEY_S};
use super::summary::{Share, Spread, Summary};
use crate::campaign::results::table;

const TEMPLATE: &str = include_str!("../../../../assets/start.md");

/// The whole file. `command` regenerates it.
#[must_use]
pub fn markdown(command: &str, summaries: &[Summary]) -> String {
    let seeds = summaries.iter().map(|s| s.started.n).max().unwrap_or(0);
    let of = |goal: Goal| summaries.iter().filter(move |s| s.goal == goal);
    TEMPLATE
        .replace("{command}", command)
        .replace("{version}", &crate::version())
        .replace("{seeds}", &seeds.to_string())
        .replace("{journey}", &format!("{:.0}", JOURNEY_S / 60.0))
        .replace("{classes}", &classes(summaries))
        .replace("{starts}", &rows(of(Goal::Start)))
        .replace("{traps}", &rows(of(Goal::Trap)))
        .replace("{rests}", &rests(summaries))
}

/// Heads of the columns of a table of results.
pub const HEADS: [&str; 11] = [
    "class",
    "started",
    "95 %",
    "silently wrong",
    "refused / lost",
    "how",
    "start, s",
    "heading error at the start, deg",
    "60 s later",
    "300 s later",
    "normalised square",
];

/// A row of a table of results.
#[must_use]
pub fn row(summary: &Summary) -> [String; 11] {
    let Share { k, n, lo95, hi95 } = summary.started;
    let [at, soon, late] = [0, 1, 2].map(|i| {
        let claimed = summary.claimed_deg[i].map(|claimed| figures(claimed.median, 2));
        let claimed = claimed.map_or_else(String::new, |sigma| format!(" ({sigma})"));
        text(summary.heading_deg[i], 2) + &claimed
    });
    let ways = summary.ways.iter().map(|(way, k)| format!("{k} {way}"));
    let square = summary.normalised_square.iter().flatten();
    let square: Vec<String> = square.map(|s| figures(*s, 2)).collect();
    [
        summary.class.to_owned(),
        format!("{k} of {n}"),
        format!("{lo95:.2} .. {hi95:.2}"),
        wrong(summary),
        format!("{} / {}", summary.refused_alignments, summary.lost),
        ways.collect::<Vec<_>>().join(", "),
        text(summary.start_s, 0),
        at,
        soon,
        late,
        square.join(" / "),
    ]
}

/// Number of trials that were wrong without a warning, and their share of the time.
fn wrong(summary: &Summary) -> String {
    match summary.silently_wrong {
        0 => "0".to_owned(),
        k => format!("{k}, {:.1} % of the time", 100.0 * summary.wrong_share),
    }
}

fn text(spread: Option<Spread>, digits: usize) -> String {
    spread.map_or_else(String::new, |Spread { median, p95 }| {
        format!("{} / {}", figures(median, digits), figures(p95, digits))
    })
}

/// A number with `digits` digits behind the point, and fewer where it is large.
fn figures(x: f64, digits: usize) -> String {
    let digits = match x.abs() {
        x if x >= 100.0 => 0,
        x if x >= 10.0 => digits.min(1),
        _ => digits,
    };
    format!("{x:.digits$}")
}

fn rows<'a>(summaries: impl Iterator<Item = &'a Summary>) -> String {
    let rows: Vec<Vec<String>> = summaries.map(|s| row(s).to_vec()).collect();
    table(&HEADS.map(String::from), &rows)
}

/// The rests that the detector found without a receiver.
fn rests(summaries: &[Summary]) -> String {
    let share =
        |of: Option<f64>, digits: usize| of.map_or_else(String::new, |x| format!("{x:.digits$}"));
    let rows = summaries.iter().map(|summary| {
        let [alone, rolling] = &summary.rests;
        let of = alone.unwrap_or_default();
        let minutes = |seconds: u32| format!("{:.0}", f64::from(seconds) / 60.0);
        vec![
            summary.class.to_owned(),
            minutes(of.standing_s),
            share(of.found(), 2),
            share(rolling.and_then(|of| of.found()), 2),
            minutes(of.moving_s),
            share(of.false_per_minute(), 2),
            share(rolling.and_then(|of| of.false_per_minute()), 2),
        ]
    });
    let head = [
        "class",
        "standing, min",
        "found",
        "with wheels",
        "above 1 m/s, min",
        "taken for a rest, s a minute",
        "with wheels",
    ];
    table(&head.map(String::from), &rows.collect::<Vec<_>>())
}

fn classes(summaries: &[Summary]) -> String {
    let of = |summary: &Summary| CLASSES.iter().find(|class| class.name == summary.class);
    let rows = summaries.iter().filter_map(|summary| {
        let class = of(summary)?;
        Some(vec![
            summary.class.to_owned(),
            summary.unit.clone(),
            format!("{}", class.latitude_deg),
            summary.about.to_owned(),
        ])
    });
    let head = ["class", "unit", "latitude, deg", "what happens"];
    table(&head.map(String::from), &rows.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_in_the_text_is_filled() {
        let empty: Vec<Summary> = CLASSES
            .iter()
            .map(|class| Summary::of(class, class.unit, &[]))
            .collect();
        let text = markdown("the command", &empty);
        assert!(!text.contains(['{', '}']), "{text}");
        assert!(text.contains("the command"));
        for class in CLASSES {
            let places = text.matches(&format!("\n| {} |", class.name)).count();
            assert_eq!(places, 3, "{}", class.name);
        }
    }

    #[test]
    fn large_numbers_have_fewer_digits() {
        assert_eq!(figures(0.126, 2), "0.13");
        assert_eq!(figures(12.34, 2), "12.3");
        assert_eq!(figures(123.4, 2), "123");
        assert_eq!(figures(12.34, 0), "12");
    }
}
