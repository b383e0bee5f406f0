//! The page of a replay: the table of all its cases, and the pictures of each.

use super::drawn::{Drawn, draw};
use super::figures::Figure;
use super::html::{picture, scheme_cell, verdict};
use super::terms::terms;
use super::text::signed;
use super::verdict::{Compared, of_outcome, of_outcomes};
use super::{html, page};
use host_core::error::Error;
use host_lab::experiment::outcome::Outcome;
use maud::{Markup, html};
use rayon::prelude::*;
use std::iter;
use std::path::{Path, PathBuf};

/// Title and origin of a page.
#[derive(Debug, Clone)]
pub struct Head {
    /// One line.
    pub title: String,
    /// The command that regenerates this page.
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
    page::write_files(dir, || {
        let figures = outcomes.par_iter().map(|outcome| draw(&outcome.curves));
        let figures: Vec<Vec<Drawn>> = figures.collect::<Result<_, Error>>()?;
        let page = markup(head, outcomes, &figures).into_string();
        let mut files = vec![(page::PAGE.to_owned(), page.into_bytes())];
        for (k, figures) in figures.into_iter().enumerate() {
            files.extend(figures.into_iter().map(|f| (file(k, f.figure), f.png)));
        }
        Ok(files)
    })
}

fn file(case: usize, figure: Figure) -> String {
    format!("{}-{}", case + 1, figure.file())
}

fn markup(head: &Head, outcomes: &[Outcome], figures: &[Vec<Drawn>]) -> Markup {
    let rows = outcomes.iter().flat_map(|outcome| &outcome.rows);
    let Compared {
        headline, device, ..
    } = of_outcomes(outcomes);
    let first: Vec<String> = iter::once(headline).chain(device).collect();
    let body = html! {
        (verdict(&first))
        (terms(rows.map(|row| row.scheme.as_str())))
        @for (k, (outcome, figures)) in outcomes.iter().zip(figures).enumerate() {
            (case(k, outcome, figures))
        }
        h2 { "How to reproduce" }
        pre { (head.command) }
    };
    html::frame(&head.title, &body)
}

fn case(k: usize, outcome: &Outcome, figures: &[Drawn]) -> Markup {
    html! {
        h2 { (outcome.recording) ": " (outcome.case) }
        (verdict(&of_outcome(outcome)))
        aside { ul { @for note in &outcome.notes { li { (note) } } } }
        p { (outcome.start) }
        (table(outcome))
        p.legend {
            "Errors are positive north and east. The seconds are those since the start of "
            "free-inertial navigation."
        }
        @for drawn in figures {
            section {
                h3 { (drawn.figure.heading()) }
                (picture(drawn, None, &file(k, drawn.figure)))
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
                        th { "horizontal" br; "error, m" }
                        th { "north" br; "error, m" } th { "east" br; "error, m" }
                        th { "north velocity" br; "error, m/s" }
                        th { "east velocity" br; "error, m/s" }
                    }
                }
                @for block in outcome.rows.chunk_by(|a, b| a.t_s == b.t_s) {
                    tbody {
                        @for (line, row) in block.iter().enumerate() {
                            tr {
                                @if line == 0 { th rowspan=(block.len()) { (row.t_s) } }
                                (scheme_cell(&row.scheme))
                                td.main { (format!("{:.2}", row.horizontal_m)) }
                                td { (signed(row.d_north_m, 2)) } td { (signed(row.d_east_m, 2)) }
                                td { (signed(row.d_vn_mps, 3)) } td { (signed(row.d_ve_mps, 3)) }
                            }
                        }
                    }
                }
            }
        }
    }
}
