//! The page of a replay: the table of all its cases, and the pictures of each.

use super::captions::{caption, heading};
use super::figures::Figure;
use super::html::{scheme_cell, signed};
use super::terms::terms;
use super::{html, page};
use crate::error::Error;
use crate::experiment::outcome::Outcome;
use crate::experiment::results::{Report, Results};
use maud::{Markup, PreEscaped, html};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Title and origin of a page.
#[derive(Debug, Clone)]
pub struct Head {
    /// One line.
    pub title: String,
    /// The command that makes this page again.
    pub command: String,
}

/// Writes `index.html` and the PNGs into `dir` and returns the path of the page.
///
/// # Errors
/// As [`page::write`].
pub fn write(dir: &Path, head: &Head, outcomes: &[Outcome]) -> Result<PathBuf, Error> {
    for row in outcomes.iter().flat_map(|o| &o.rows) {
        if !row.horizontal_m.is_finite() {
            return Err(Error::BadResult {
                item: format!("{} s, {}", row.t_s, row.scheme),
                field: "horizontal_m",
                problem: "is not finite".into(),
            });
        }
    }
    page::place(dir, || {
        let jobs: Vec<(usize, Figure)> = (0..outcomes.len())
            .flat_map(|k| Figure::ALL.map(|f| (k, f)))
            .collect();
        let draw = |(k, figure): &(usize, Figure)| {
            let report = as_report(&outcomes[*k]);
            Ok((figure.svg(&report, heading(*figure))?, figure.png(&report)?))
        };
        let drawn: Vec<(String, Vec<u8>)> =
            jobs.par_iter().map(draw).collect::<Result<_, Error>>()?;
        let page = markup(head, outcomes, &drawn).into_string();
        let mut files = vec![(page::PAGE.to_owned(), page.into_bytes())];
        let pngs = jobs
            .iter()
            .zip(drawn)
            .map(|((k, f), (_, png))| (file(*k, *f), png));
        files.extend(pngs);
        Ok(files)
    })
}

fn file(case: usize, figure: Figure) -> String {
    format!("{}-{}", case + 1, figure.file())
}

fn as_report(outcome: &Outcome) -> Report {
    let c = outcome.curves.clone();
    Report {
        title: String::new(),
        results: Results {
            scenario: String::new(),
            seed: 0,
            rows: Vec::new(),
        },
        set_up: Vec::new(),
        notes: Vec::new(),
        track: c.track,
        error_over_time: c.error_over_time,
        learning: c.learning,
        traces: c.traces,
    }
}

fn markup(head: &Head, outcomes: &[Outcome], drawn: &[(String, Vec<u8>)]) -> Markup {
    let rows = outcomes.iter().flat_map(|outcome| &outcome.rows);
    let body = html! {
        (terms(rows.map(|row| row.scheme.as_str())))
        @for (k, (outcome, svgs)) in outcomes.iter().zip(drawn.chunks(Figure::ALL.len())).enumerate() {
            (case(k, outcome, svgs))
        }
        h2 { "How to reproduce" }
        pre { (head.command) }
    };
    html::frame(&head.title, &body)
}

fn case(k: usize, outcome: &Outcome, svgs: &[(String, Vec<u8>)]) -> Markup {
    let report = as_report(outcome);
    html! {
        h2 { (outcome.recording) ": " (outcome.case) }
        aside { ul { @for note in &outcome.notes { li { (note) } } } }
        (table(outcome))
        p.legend { "Errors are positive north and east; the seconds are those since the start of free-inertial navigation." }
        @for (figure, (svg, _)) in Figure::ALL.into_iter().zip(svgs) {
            section {
                h3 { (heading(figure)) }
                figure {
                    (PreEscaped(svg))
                    figcaption {
                        (html::unbroken(&caption(figure, &report))) " "
                        a href=(file(k, figure)) { (file(k, figure)) }
                    }
                }
            }
        }
    }
}

fn table(outcome: &Outcome) -> Markup {
    html! {
        div.wide {
            table.results {
                thead {
                    tr {
                        th { "free inertial" br; "for, s" } th.text { "scheme" }
                        th { "north" br; "error, m" } th { "east" br; "error, m" }
                        th { "north velocity" br; "error, m/s" } th { "east velocity" br; "error, m/s" }
                        th { "horizontal" br; "error, m" }
                    }
                }
                @for block in outcome.rows.chunk_by(|a, b| a.t_s == b.t_s) {
                    tbody {
                        @for (line, row) in block.iter().enumerate() {
                            tr {
                                @if line == 0 { th rowspan=(block.len()) { (row.t_s) } }
                                (scheme_cell(&row.scheme))
                                td { (signed(row.d_north_m, 2)) } td { (signed(row.d_east_m, 2)) }
                                td { (signed(row.d_vn_mps, 3)) } td { (signed(row.d_ve_mps, 3)) }
                                td.main { (format!("{:.2}", row.horizontal_m)) }
                            }
                        }
                    }
                }
            }
        }
    }
}
