//! Page, picture and table of `host-sim learnability`.
//!
//! They show the bound over learning time beside what the schemes reached.

use super::replay::Head;
use super::terminal::fitted;
use super::terms::schemes;
use super::{html, page};
use comfy_table::{Table, presets};
use host_chart::axis::{Axis, extent};
use host_chart::palette::{self, INK, Look, SOFT};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_core::error::Error;
use host_core::inertial::units::MIN;
use host_estimation::analysis::learnability::{Answer, SCHEMES, quantity};
use maud::{PreEscaped, html};
use std::path::{Path, PathBuf};

/// Title and quantities of each panel, gyros at the left, accelerometers at the right.
const PANELS: [(&str, &[usize]); 8] = [
    ("gyro bias", &[0, 1, 2]),
    ("accelerometer bias", &[3, 4, 5]),
    ("gyro mean error", &[24, 25, 26]),
    ("accelerometer mean error", &[27, 28, 29]),
    ("gyro scale factor", &[6, 10, 14]),
    ("accelerometer scale factor", &[15, 19, 23]),
    ("gyro misalignment", &[7, 8, 9, 11, 12, 13]),
    ("accelerometer misalignment", &[16, 17, 18, 20, 21, 22]),
];
const PICTURE: &str = "learnability.png";
const BOUND: Look = Look::solid(INK, 2.6);

/// Writes `index.html` and the picture into `dir` and returns the path of the page.
///
/// # Errors
/// As [`page::write`].
pub fn write(dir: &Path, head: &Head, answer: &Answer, table: &str) -> Result<PathBuf, Error> {
    page::write_files(dir, || {
        let picture = picture(answer);
        let png = picture.png(PICTURE)?;
        let svg = picture.svg(PICTURE, &head.title)?;
        let page = markup(head, &svg, table);
        Ok(vec![(page::PAGE, page.into_bytes()), (PICTURE, png)])
    })
}

fn markup(head: &Head, svg: &str, table: &str) -> String {
    let body = html! {
        p {
            "How well can each error of the sensors be known after some time of driving? The "
            "Cram\u{e9}r-Rao bound is the least standard deviation that any estimator can reach "
            "from the same measurements and the same knowledge beforehand. The schemes are "
            "estimators that learn from simulated units. With few units their errors scatter, so "
            "they can also lie below the bound."
        }
        (schemes(SCHEMES.iter().map(|(name, _)| *name)))
        figure {
            div.wide { (PreEscaped(svg)) }
            figcaption {
                "Thin lines: the bound of each axis. Thick line: its root mean square over the "
                "axes. Coloured lines: the root mean square of the errors that each scheme left, "
                "over the axes and the simulated units. "
                a href=(PICTURE) { (PICTURE) }
            }
        }
        pre { (table) }
        h2 { "How to reproduce" }
        pre { (head.command) }
    };
    html::frame(&head.title, &body).into_string()
}

pub(super) fn picture(answer: &Answer) -> Picture {
    let size = (WIDTH, 1060.0);
    let reached = SCHEMES.iter().filter(|_| answer.units > 0);
    let reached = reached.map(|(name, _)| ((*name).to_owned(), palette::scheme(name)));
    let legend = Legend {
        at: (76.0, 18.0),
        width: size.0 - 90.0,
        entries: [("bound".to_owned(), BOUND)]
            .into_iter()
            .chain(reached)
            .collect(),
    };
    let at = |k: usize| (76.0 + 480.0 * (k % 2) as f64, 62.0 + 252.0 * (k / 2) as f64);
    let panels = PANELS.iter().enumerate();
    Picture {
        size,
        legends: vec![legend],
        panels: panels
            .map(|(k, (title, of))| panel(at(k), title, of, answer))
            .collect(),
        notes: vec![],
    }
}

fn panel(at: (f64, f64), title: &str, quantities: &[usize], answer: &Answer) -> Panel {
    let (_, unit, si) = quantity(quantities[0]);
    let times: Vec<f64> = answer.times_s.iter().map(|t| f64::from(*t) / MIN).collect();
    let bounds = quantities.iter().map(|q| column(&answer.bound, *q, si));
    let bounds: Vec<Vec<f64>> = bounds.collect();
    let reached = SCHEMES.iter().zip(&answer.reached);
    let reached: Vec<(Look, Vec<f64>)> = reached
        .map(|((name, _), rows)| (palette::scheme(name), over_axes(rows, quantities, si)))
        .filter(|(_, errors)| errors.iter().all(|error| *error > 0.0))
        .collect();
    let all = bounds
        .iter()
        .chain(reached.iter().map(|(_, y)| y))
        .flatten();
    let (low, high) = extent(all.copied()).unwrap_or((1.0, 10.0));
    let (first, last) = (times[0], times[times.len() - 1].max(1.01 * times[0]));
    let mut marks = vec![];
    for bound in &bounds {
        marks.push(Mark::curve(&times, bound, Look::solid(SOFT, 0.8)));
    }
    for (look, errors) in &reached {
        let points = times.iter().copied().zip(errors.iter().copied());
        marks.push(Mark::curve(&times, errors, *look));
        marks.push(Mark::Dots(points.collect(), 2.5, look.colour));
    }
    let mean = over_axes(&answer.bound, quantities, si);
    marks.push(Mark::curve(&times, &mean, BOUND));
    Panel {
        at,
        size: (384.0, 180.0),
        title: [title.to_owned(), String::new()],
        x: Axis::log(
            "learning time on the drive, min",
            (first / 1.05, last * 1.05),
        ),
        y: Axis::log(unit, (low / 1.2, high * 1.2)),
        marks,
    }
}

fn column(rows: &[Vec<f64>], q: usize, si: f64) -> Vec<f64> {
    rows.iter().map(|row| row[q] / si).collect()
}

/// Root mean square over quantities, row by row.
fn over_axes(rows: &[Vec<f64>], quantities: &[usize], si: f64) -> Vec<f64> {
    let mean = |row: &Vec<f64>| {
        let squares: f64 = quantities.iter().map(|q| (row[*q] / si).powi(2)).sum();
        (squares / quantities.len() as f64).sqrt()
    };
    rows.iter().map(mean).collect()
}

/// The bounds against time, and what was reached at the end, as text of at most `width` columns.
///
/// # Errors
/// [`Error::BadResult`] for a bound that is not finite.
pub fn table(answer: &Answer, width: usize) -> Result<String, Error> {
    let lines = answer.lines();
    if let Some(bad) = lines.iter().find(|l| !l.bound.is_finite()) {
        return Err(Error::BadResult {
            item: bad.quantity.clone(),
            field: "bound",
            problem: "is not finite".into(),
        });
    }
    let times = answer.times_s.iter().map(|t| format!("{} min", t / 60));
    let head = ["bound of", "unit", "before"].map(String::from);
    let mut bounds = new_table(head.into_iter().chain(times));
    let head = ["rms error at the end", "unit", "bound"].map(String::from);
    let mut ends = new_table(
        head.into_iter()
            .chain(SCHEMES.map(|(name, _)| name.to_owned())),
    );
    for of in lines.chunks(answer.times_s.len()) {
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
    // the end, and the schemes beside the bound, stay longest
    let times = (3..2 + answer.times_s.len()).chain([2]);
    let bounds = fitted(bounds, width, times);
    Ok(match answer.units {
        0 => bounds,
        n => {
            let ends = fitted(ends, width, 3..2 + SCHEMES.len());
            format!("{bounds}\n\n{n} simulated units:\n\n{ends}")
        }
    })
}

fn new_table(head: impl Iterator<Item = String>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header(head);
    table
}

/// Three figures.
pub(super) fn figures(x: f64) -> String {
    let digits = match x.abs() {
        a if a > 0.0 => (2 - a.log10().floor() as i32).clamp(0, 9) as usize,
        _ => 0,
    };
    format!("{x:.digits$}")
}
