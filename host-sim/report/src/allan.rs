//! An Allan analysis for readers: the printed table, and a page with the pictures.
//!
//! A picture shows the measured deviations with their intervals as points, the
//! fitted sum of noises as lines, both scales logarithmic.

mod verdict;

pub(crate) use verdict::against;
pub use verdict::verdict;

use super::front::{Front, SIZES};
use super::html;
use super::page::PAGE;
use super::terminal::fitted;
use super::text::prose;
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};
use host_chart::axis::Axis;
use host_chart::palette::{self, INK, Look};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_core::error::Error;
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::allan::{Analysis, Kind};
use host_io::output::write_atomic;
use maud::{Markup, PreEscaped, html};
use std::path::{Path, PathBuf};

/// Line style of the datasheet.
const DATASHEET: Look = Look::dashed(INK, 1.6, (8.0, 4.0));

fn configured_of(findings: &Findings, kind: Kind, coefficient: usize) -> Option<f64> {
    findings
        .configured
        .and_then(|both| both[usize::from(kind == Kind::Accel)][coefficient])
}

/// Rows of the table: column, noise, value, 95 % interval, unit, configured value.
pub(super) fn rows(findings: &Findings) -> Vec<[String; 6]> {
    let mut rows = vec![];
    for analysis in &findings.analyses {
        for (i, c) in analysis.coefficients.iter().enumerate() {
            let (value, interval) = if c.is_seen() {
                (
                    figures(c.value),
                    format!("{} to {}", figures(c.low), figures(c.high)),
                )
            } else {
                ("not seen".to_owned(), format!("below {}", figures(c.high)))
            };
            rows.push([
                if i == 0 {
                    analysis.column.clone()
                } else {
                    String::new()
                },
                format!("{} {}", c.symbol, c.name),
                value,
                interval,
                c.unit.to_owned(),
                configured_of(findings, analysis.kind, i).map_or_else(|| "-".to_owned(), figures),
            ]);
        }
    }
    rows
}

fn header(findings: &Findings) -> Vec<&'static str> {
    let mut header = vec!["column", "noise", "value", "95 % interval", "unit"];
    if findings.configured.is_some() {
        header.push("configured");
    }
    header
}

/// The table as text, without a final line break.
#[must_use]
pub fn table(findings: &Findings, width: usize) -> String {
    let header = header(findings);
    let mut table = Table::new();
    table
        .load_preset(presets::UTF8_FULL_CONDENSED)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(header.clone());
    for row in rows(findings) {
        table.add_row(
            row.into_iter()
                .take(header.len())
                .enumerate()
                .map(|(i, text)| match i {
                    2 | 5 => Cell::new(text).set_alignment(CellAlignment::Right),
                    _ => Cell::new(text),
                }),
        );
    }
    let mut text = fitted(table, width, [5, 3]);
    for analysis in &findings.analyses {
        if let Some(least) = analysis
            .curve
            .iter()
            .min_by(|a, b| a.deviation.total_cmp(&b.deviation))
        {
            text += &format!(
                "\n{}: {:.0} s at {} Hz; least deviation {} {} at {} s; misfit {:.0} %",
                analysis.column,
                analysis.duration_s,
                analysis.rate_hz,
                figures(least.deviation),
                analysis.unit,
                figures(least.tau_s),
                100.0 * analysis.misfit
            );
        }
    }
    text
}

/// Writes `index.html`, and a PNG and an SVG for each kind of sensor, into `dir`.
///
/// Returns the path of the page.
///
/// # Errors
/// [`Error::Drawing`], [`Error::Unwritable`].
pub fn write(findings: &Findings, dir: &Path) -> Result<PathBuf, Error> {
    let (mut svgs, mut front) = (vec![], None);
    for (kind, name, file) in [
        (Kind::Gyro, "gyros", "allan-gyro.png"),
        (Kind::Accel, "accelerometers", "allan-accel.png"),
    ] {
        let of_kind = findings.analyses.iter().filter(|a| a.kind == kind);
        let analyses: Vec<&Analysis> = of_kind.collect();
        if analyses.is_empty() {
            continue;
        }
        let (picture, title) = (
            picture(&analyses, findings.configured.as_ref()),
            format!("Allan deviation of the {name}"),
        );
        if svgs.is_empty() {
            front = Some(first(&analyses, findings));
        }
        let path = dir.join(file);
        write_atomic(&path, &picture.png(file)?)?;
        let standalone = picture.svg_file(file, &title)?;
        write_atomic(&path.with_extension("svg"), standalone.as_bytes())?;
        svgs.push((file, picture.svg(file, &title)?));
    }
    let page = dir.join(PAGE);
    let front = front.unwrap_or_default();
    write_atomic(&page, markup(findings, &front, &svgs)?.as_bytes())?;
    Ok(page)
}

/// The first screen.
fn first(analyses: &[&Analysis], findings: &Findings) -> Front {
    let name = analyses.first().map_or("", |a| match a.kind {
        Kind::Gyro => "gyros",
        Kind::Accel => "accelerometers",
    });
    Front {
        title: format!("Allan deviation of the {name}. {}", caption(findings)),
        pictures: SIZES.map(|size| sized(analyses, findings.configured.as_ref(), size)),
        figures: verdict::three(findings),
    }
}

/// What the lines of the pictures are.
pub(super) fn caption(findings: &Findings) -> String {
    let dashes = match findings.configured {
        Some(_) => " Dashes: the datasheet.",
        None => "",
    };
    format!(
        "Points: overlapping Allan deviation with its 95 % interval. Line: the sum of the fitted \
         noises.{dashes}"
    )
}

fn markup(findings: &Findings, front: &Front, svgs: &[(&str, String)]) -> Result<String, Error> {
    let header = header(findings);
    let body = html! {
        (front.markup(&verdict(findings))?)
        @if !findings.notes.is_empty() {
            (html::fold("Notes", &html! {
                ul.said { @for note in &findings.notes { li { (prose(note)) } } }
            }))
        }
        h2 { "Noise coefficients" }
        div.wide {
            table {
                thead { tr { @for name in &header { th.text { (name) } } } }
                tbody {
                    @for row in rows(findings) {
                        tr { @for cell in row.iter().take(header.len()) { td.text { (cell) } } }
                    }
                }
            }
        }
        @for (file, svg) in svgs {
            figure {
                div.wide { (PreEscaped(svg)) }
                figcaption { (caption(findings)) " " a href=(file) { (file) } }
            }
        }
        (html::fold("What the numbers mean", &meaning()))
    };
    let title = format!("Allan deviation of {}", findings.source);
    Ok(html::frame(&title, &body).into_string())
}

fn meaning() -> Markup {
    html! {
        p {
            "The Allan deviation is the typical change between two neighbouring means, each "
            "taken over the averaging time \u{3c4}. Each kind of sensor noise gives it another "
            "slope, so the noises can be distinguished."
        }
        p {
            "The coefficients are those of IEEE 647 and 952: variance = 3 Q" sup { "2" }
            "/\u{3c4}" sup { "2" } " + N" sup { "2" } "/\u{3c4} + B" sup { "2" }
            " 2 ln 2/\u{3c0} + K" sup { "2" } " \u{3c4}/3 + R" sup { "2" } " \u{3c4}" sup { "2" } "/2. "
            i { "Not seen" } " means that the interval of a coefficient reaches down to zero."
        }
    }
}

/// Q, N, B, K and R of gyros and accelerometers by the datasheet.
type Coefficients = [[Option<f64>; 5]; 2];

/// The deviation by a datasheet at an averaging time, in the unit of the curves. A noise that the
/// datasheet does not state counts as none.
fn sheet_deviation(kind: Kind, datasheet: &Coefficients, tau_s: f64) -> f64 {
    let units = kind.coefficient_units();
    let of = |i: usize| datasheet[usize::from(kind == Kind::Accel)][i].unwrap_or(0.0) * units[i].1;
    let [q, n, b, k, r] = [of(0), of(1), of(2), of(3), of(4)].map(|x| x * x);
    let flicker = 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI;
    let variance = 3.0 * q / tau_s.powi(2)
        + n / tau_s
        + b * flicker
        + k * tau_s / 3.0
        + r * tau_s.powi(2) / 2.0;
    variance.sqrt() / kind.unit().1
}

/// The line of the datasheet at the averaging times of a curve.
fn datasheet_line(analyses: &[&Analysis], datasheet: &Coefficients) -> Vec<(f64, f64)> {
    let Some(first) = analyses.first() else {
        return vec![];
    };
    let deviation = |tau| (tau, sheet_deviation(first.kind, datasheet, tau));
    let line = first.curve.iter().map(|p| deviation(p.tau_s));
    line.filter(|(_, y)| *y > 0.0).collect()
}

/// The picture of one kind of sensor. `analyses` is not empty. The line of the datasheet is drawn
/// if there is one.
pub(super) fn picture(analyses: &[&Analysis], datasheet: Option<&Coefficients>) -> Picture {
    sized(analyses, datasheet, (WIDTH, 560.0))
}

fn sized(analyses: &[&Analysis], datasheet: Option<&Coefficients>, size: (f64, f64)) -> Picture {
    let points = || analyses.iter().flat_map(|analysis| &analysis.curve);
    let times = || points().map(|p| p.tau_s);
    let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
    let most = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let datasheet = datasheet.map_or(vec![], |sheet| datasheet_line(analyses, sheet));
    let (left, top) = (66.0, if size.0 < WIDTH { 66.0 } else { 44.0 });
    let legend = Legend {
        at: (left, 16.0),
        width: size.0 - left,
        entries: analyses
            .iter()
            .enumerate()
            .map(|(i, analysis)| (analysis.column.clone(), palette::numbered(i)))
            .chain(
                datasheet
                    .first()
                    .map(|_| ("datasheet".to_owned(), DATASHEET)),
            )
            .collect(),
    };
    let unit = analyses.first().map_or("", |analysis| analysis.unit);
    let panel = Panel {
        at: (left, top),
        size: (size.0 - left - 24.0, size.1 - top - 52.0),
        title: Default::default(),
        x: Axis::log(
            "averaging time \u{3c4}, s",
            (least(&mut times()) / 1.3, most(&mut times()) * 1.3),
        ),
        y: Axis::log(
            format!("Allan deviation, {unit}"),
            (
                least(&mut points().map(|p| p.low).chain(datasheet.iter().map(|p| p.1))) / 1.5,
                most(
                    &mut points()
                        .map(|p| p.high)
                        .chain(datasheet.iter().map(|p| p.1)),
                ) * 1.5,
            ),
        ),
        marks: analyses
            .iter()
            .enumerate()
            .flat_map(|(i, a)| marks(a, palette::numbered(i)))
            .chain([Mark::Line(datasheet.clone(), DATASHEET)])
            .collect(),
    };
    Picture {
        size,
        legends: vec![legend],
        panels: vec![panel],
        notes: vec![],
    }
}

fn marks(analysis: &Analysis, look: Look) -> Vec<Mark> {
    let points = || analysis.curve.iter();
    let fitted = points().filter(|p| p.fitted > 0.0);
    let fitted = fitted.map(|p| (p.tau_s, p.fitted)).collect();
    let interval = Look::solid(look.colour, 1.0);
    let mut marks = vec![Mark::Line(fitted, look)];
    marks.extend(points().map(|p| Mark::Line(vec![(p.tau_s, p.low), (p.tau_s, p.high)], interval)));
    let dots = points().map(|p| (p.tau_s, p.deviation)).collect();
    marks.push(Mark::Dots(dots, 3.0, look.colour));
    marks
}

/// A number to four figures.
pub(super) fn figures(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = if size == 0.0 {
        0
    } else {
        (3 - size.log10().floor() as i32).max(0) as usize
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::simulator::imu::ImuSpec;
    use host_estimation::analysis::allan::at_rest;

    /// Findings of a minute of a simulated IMU.
    fn findings() -> Findings {
        let spec = ImuSpec::preset("tactical").unwrap();
        let columns = at_rest(&spec, 60, 1).unwrap();
        let mut findings = Findings::of("a < b".into(), columns, Some(&spec)).unwrap();
        findings.notes = vec!["note".into()];
        findings
    }

    #[test]
    fn numbers_have_four_figures() {
        let texts = [0.0, 0.00512345, 1.0, 98765.4, 123.456, 4.2e-9, 7.0e7].map(figures);
        assert_eq!(
            texts,
            [
                "0", "0.005123", "1.000", "98765", "123.5", "4.200e-9", "7.000e7"
            ]
        );
    }

    #[test]
    fn the_table_has_a_line_a_noise_and_fits() {
        let mut findings = findings();
        let text = table(&findings, usize::MAX);
        println!("{text}");
        assert_eq!(text.matches("N random walk").count(), 6);
        assert!(text.contains("configured") && text.contains("0.1250"));
        assert!(text.lines().all(|line| line.chars().count() <= 110));
        findings.configured = None;
        assert!(!table(&findings, usize::MAX).contains("configured"));
    }

    #[test]
    fn the_page_stands_alone_with_its_pictures() {
        let dir = tempfile::tempdir().unwrap();
        let mut findings = findings();
        let page = write(&findings, &dir.path().join("new")).unwrap();
        let text = std::fs::read_to_string(&page).unwrap();
        assert!(text.contains("a &lt; b") && text.matches("<svg").count() == 4);
        for name in ["allan-gyro", "allan-accel"] {
            let png = std::fs::read(page.with_file_name(format!("{name}.png"))).unwrap();
            let info = png::Decoder::new(std::io::Cursor::new(png))
                .read_info()
                .unwrap();
            assert_eq!((info.info().width, info.info().height), (1920, 1120));
            let svg = std::fs::read_to_string(page.with_file_name(format!("{name}.svg"))).unwrap();
            assert!(svg.contains("Allan deviation") && svg.matches("<circle").count() > 60);
        }
        findings.analyses.truncate(1);
        write(&findings, &dir.path().join("gyro")).unwrap();
        assert!(!dir.path().join("gyro/allan-accel.png").exists());
    }
}
