//! Page and picture of what can be learnt: the bound over learning time beside what the schemes reached.

use super::axes::{Axis, extent};
use super::canvas::Canvas;
use super::palette::{self, INK, Look, SOFT};
use super::sheet::{Align, Drawn, Plot, Sheet, UNITS};
use super::{html, page};
use crate::analysis::learnability::{Answer, SCHEMES, quantity};
use crate::error::Error;
use crate::inertial::units::MIN;
use crate::report::outcomes::Head;
use comfy_table::{Table, presets};
use maud::{PreEscaped, html};
use plotters::prelude::{DrawingBackend, SVGBackend};
use std::path::{Path, PathBuf};

/// Width and height, CSS pixels.
const SIZE: (f64, f64) = (960.0, 1060.0);
/// Title and quantities of each panel, gyros left, accelerometers right.
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

/// Writes `index.html` and the picture into `dir` and returns the path of the page.
///
/// # Errors
/// As [`page::write`].
pub fn write(dir: &Path, head: &Head, answer: &Answer, table: &str) -> Result<PathBuf, Error> {
    let failed = |problem: &dyn std::fmt::Display| Error::Drawing {
        picture: PICTURE,
        problem: problem.to_string(),
    };
    page::place(dir, || {
        let size = ((SIZE.0 * UNITS) as u32, (SIZE.1 * UNITS) as u32);
        let mut canvas = Canvas::new(size);
        draw(&mut canvas, answer).map_err(|e| failed(&e))?;
        let png = canvas.png().map_err(|e| failed(&e))?;
        let mut svg = String::new();
        draw(&mut SVGBackend::with_string(&mut svg, size), answer).map_err(|e| failed(&e))?;
        let content = svg.split_once(">\n").map_or("", |(_, content)| content);
        let svg = format!(
            "<svg role=\"img\" viewBox=\"0 0 {} {}\" xmlns=\"http://www.w3.org/2000/svg\">{content}",
            size.0, size.1
        );
        let page = markup(head, &svg, table);
        Ok(vec![(page::PAGE, page.into_bytes()), (PICTURE, png)])
    })
}

fn markup(head: &Head, svg: &str, table: &str) -> String {
    let body = html! {
        figure {
            (PreEscaped(svg))
            figcaption {
                "Thin: Cramer-Rao bound of each axis; thick: its root mean square over the axes; coloured: the same of the errors "
                "that the schemes left over the simulated units. "
                a href=(PICTURE) { (PICTURE) }
            }
        }
        pre { (table) }
        h2 { "How to reproduce" }
        pre { (head.command) }
    };
    html::frame(&head.title, &body).into_string()
}

fn draw<DB: DrawingBackend>(backend: &mut DB, answer: &Answer) -> Drawn<DB> {
    let mut sheet = Sheet::new(backend);
    let mut entries = vec![("bound".to_owned(), Look::solid(INK, 2.6))];
    if answer.units > 0 {
        entries.extend(
            SCHEMES
                .iter()
                .map(|(name, _)| ((*name).to_owned(), look(name))),
        );
    }
    sheet.legend((76.0, 18.0), SIZE.0 - 90.0, &entries)?;
    for (k, (title, quantities)) in PANELS.iter().enumerate() {
        let (column, row) = ((k % 2) as f64, (k / 2) as f64);
        let at = (76.0 + 480.0 * column, 62.0 + 252.0 * row);
        panel(&mut sheet, at, (title, quantities), answer)?;
    }
    sheet.finish()
}

fn look(scheme: &str) -> Look {
    let other = usize::from(scheme == "ekf24") * 2;
    palette::scheme(scheme, other)
}

fn panel<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    at: (f64, f64),
    (title, quantities): (&str, &[usize]),
    answer: &Answer,
) -> Drawn<DB> {
    let (_, unit, si) = quantity(quantities[0]);
    let times: Vec<f64> = answer.times_s.iter().map(|t| f64::from(*t) / MIN).collect();
    let bounds = quantities.iter().map(|q| column(&answer.bound, *q, si));
    let bounds: Vec<Vec<f64>> = bounds.collect();
    let reached: Vec<(&str, Vec<f64>)> = SCHEMES
        .iter()
        .zip(&answer.reached)
        .map(|((name, _), r)| (*name, over_axes(r, quantities, si)))
        .filter(|(_, y)| y.iter().all(|v| *v > 0.0))
        .collect();
    let all = bounds
        .iter()
        .chain(reached.iter().map(|(_, y)| y))
        .flatten();
    let (low, high) = extent(all.copied()).unwrap_or((1.0, 10.0));
    let (first, last) = (times[0], times[times.len() - 1].max(1.01 * times[0]));
    let plot = Plot {
        left: at.0,
        top: at.1,
        width: 384.0,
        height: 180.0,
        x: Axis::log(
            "learning time on the drive, min",
            (first / 1.05, last * 1.05),
        ),
        y: Axis::log(unit, (low / 1.2, high * 1.2)),
    };
    sheet.axes(&plot)?;
    sheet.text(title, (at.0 + 6.0, at.1 - 10.0), Align::Left, INK)?;
    for y in &bounds {
        sheet.curve(&plot, &times, y, Look::solid(SOFT, 0.8))?;
    }
    for (name, y) in &reached {
        sheet.curve(&plot, &times, y, look(name))?;
        for place in times.iter().zip(y).filter_map(|(t, y)| plot.at(*t, *y)) {
            sheet.dot(place, 2.5, look(name).colour)?;
        }
    }
    let mean = over_axes(&answer.bound, quantities, si);
    sheet.curve(&plot, &times, &mean, Look::solid(INK, 2.6))
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

/// The bounds against time, and what was reached at the end, as text.
///
/// # Errors
/// [`Error::BadResult`] for a bound that is not finite.
pub fn table(answer: &Answer) -> Result<String, Error> {
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
    Ok(match answer.units {
        0 => bounds.to_string(),
        n => format!("{bounds}\n\n{n} simulated units:\n\n{ends}"),
    })
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
