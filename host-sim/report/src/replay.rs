//! The page of a replay: the table of all its cases, and the pictures of each.

use super::drawn::{Drawn, draw};
use super::figures::Figure;
use super::front::{Each, Front, SIZES, over_time, three};
use super::html::{fold, picture, scheme_cell, sentences};
use super::terminal::{fitted, named};
use super::terms::terms;
use super::text::{prose, signed};
use super::verdict::{
    Compared, DEVICE, Device, Effect, beside, device_of_outcome, of_outcome, of_outcomes,
};
use super::{html, page};
use comfy_table::{Table, presets};
use host_chart::axis::grouped;
use host_core::error::Error;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Curves;
use maud::{Markup, html};
use rayon::prelude::*;
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
        let figures = outcomes
            .par_iter()
            .map(|outcome| draw(&in_seconds(outcome), "s"));
        let figures: Vec<Vec<Drawn>> = figures.collect::<Result<_, Error>>()?;
        let page = markup(head, outcomes, &figures)?.into_string();
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

fn markup(head: &Head, outcomes: &[Outcome], figures: &[Vec<Drawn>]) -> Result<Markup, Error> {
    let rows = outcomes.iter().flat_map(|outcome| &outcome.rows);
    let Compared { headline, .. } = of_outcomes(outcomes);
    let body = html! {
        (front(outcomes).markup(&headline)?)
        @for (k, (outcome, figures)) in outcomes.iter().zip(figures).enumerate() {
            (case(k, outcome, figures, outcomes.len() > 1))
        }
        (fold("What the names mean", &terms(rows.map(|row| row.scheme.as_str()))))
        h2 { "How to reproduce" }
        pre { (head.command) }
    };
    Ok(html::frame(&head.title, &body))
}

/// Horizontal errors on the terminal: a line for each case and scheme, a column for each time. The
/// schemes of a case stand in the order of their last errors.
#[must_use]
pub fn text(outcomes: &[Outcome], width: usize) -> String {
    let rows = outcomes.iter().flat_map(|of| &of.rows);
    let mut times: Vec<u32> = rows.map(|row| row.t_s).collect();
    times.sort_unstable();
    times.dedup();
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    let head = ["recording", "case", "scheme"]
        .map(String::from)
        .into_iter();
    table.set_header(head.chain(times.iter().map(|t| format!("{t} s, m"))));
    for of in outcomes {
        let last = of.rows.last().map_or(0, |row| row.t_s);
        let end = |scheme: &str| of.horizontal(scheme, last).unwrap_or(f64::INFINITY);
        let mut schemes: Vec<&str> = of.rows.iter().map(|row| row.scheme.as_str()).collect();
        schemes.sort_by(|a, b| end(a).total_cmp(&end(b)).then(a.cmp(b)));
        schemes.dedup();
        for scheme in schemes {
            let cell = |t: &u32| {
                let metres = of.horizontal(scheme, *t);
                metres.map_or("-".into(), |m| grouped(m, 1).replace('\u{a0}', " "))
            };
            let start = [of.recording.clone(), of.case.clone(), named(scheme)];
            table.add_row(start.into_iter().chain(times.iter().map(cell)));
        }
    }
    // of one case its name goes first, then the early times
    let first = if outcomes.len() > 1 { 0..1 } else { 0..2 };
    let times = 3..(2 + times.len()).max(3);
    fitted(table, width, first.chain(times).chain([1]))
}

/// The first screen: the course of the errors in one case, the last errors of several.
pub(super) fn front(outcomes: &[Outcome]) -> Front {
    let names = || {
        outcomes
            .iter()
            .flat_map(|of| of.rows.iter().map(|row| row.scheme.as_str()))
    };
    let device = names().find(|name| *name == DEVICE).unwrap_or("rnn");
    let highlit = [device, beside(device, names())];
    if let [only] = outcomes {
        let curves = in_seconds(only).error_over_time;
        let bench = only.bench.as_deref();
        let proof = bench.and_then(|bench| bench.course.nearest.as_ref());
        let known = device_of_outcome(only);
        return Front {
            title: "Horizontal error since the last fix".into(),
            pictures: SIZES.map(|size| over_time(&curves, highlit, "s", size)),
            figures: known.map_or(vec![], |of| three(&of, proof.map(|of| of.proof))),
        };
    }
    let mut schemes: Vec<&str> = vec![];
    for name in names() {
        if !schemes.contains(&name) {
            schemes.push(name);
        }
    }
    let last = |of: &Outcome, scheme: &str| of.horizontal(scheme, of.rows.last()?.t_s);
    let curves = schemes.into_iter().map(|scheme| {
        let ends = outcomes.iter().enumerate();
        let ends = ends.filter_map(|(k, of)| Some((k as f64 + 1.0, last(of, scheme)?)));
        (scheme, ends.collect())
    });
    let each = Each {
        of: "case",
        highlit,
        curves: curves.collect(),
    };
    Front {
        title: "Horizontal error at the end of each case".into(),
        pictures: SIZES.map(|size| each.picture(size)),
        figures: of_several(outcomes),
    }
}

/// In how many cases the device helps, harms and makes no difference.
fn of_several(outcomes: &[Outcome]) -> Vec<(String, String)> {
    let devices: Vec<Device> = outcomes.iter().filter_map(device_of_outcome).collect();
    let count = |effect| {
        let with = devices
            .iter()
            .filter(|of| of.waits.is_none() && of.effect() == effect);
        format!("{} of {}", with.count(), devices.len())
    };
    let idle = devices.iter().filter(|of| of.waits.is_some()).count();
    vec![
        (
            count(Effect::Helps),
            "cases in which the device helps".into(),
        ),
        (count(Effect::Harms), "cases in which it harms".into()),
        (
            format!("{idle} of {}", devices.len()),
            "cases in which it corrects nothing, for want of a proof".into(),
        ),
    ]
}

/// The curves of a case with times in seconds, up to the last time of its table.
pub(super) fn in_seconds(outcome: &Outcome) -> Curves {
    let mut curves = outcome.curves.clone();
    let last = outcome
        .rows
        .last()
        .map_or(f64::INFINITY, |row| f64::from(row.t_s));
    for curve in &mut curves.error_over_time {
        curve.x.iter_mut().for_each(|x| *x *= 60.0);
        let shown = curve.x.partition_point(|x| *x <= last + 1e-6);
        curve.x.truncate(shown);
        curve.y.truncate(shown);
    }
    curves
}

fn case(k: usize, outcome: &Outcome, figures: &[Drawn], several: bool) -> Markup {
    let said = of_outcome(outcome);
    // of one case the first sentence is the page's
    let said = said.get(usize::from(!several)..).unwrap_or_default();
    html! {
        h2 { (outcome.recording) ": " (outcome.case) }
        (sentences(said))
        (table(outcome))
        p.legend {
            "Errors are positive north and east. The seconds are those since the start of "
            "free-inertial navigation. " (outcome.start)
        }
        (fold("Notes", &html! {
            ul.said { @for note in &outcome.notes { li { (prose(note)) } } }
        }))
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
                                td.main { (grouped(row.horizontal_m, 2)) }
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
