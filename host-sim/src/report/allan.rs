//! An Allan analysis for readers: the printed table, and a page with the pictures.

use super::allan_plot as plot;
use crate::analysis::allan::findings::Findings;
use crate::analysis::allan::{Analysis, Kind};
use crate::error::Error;
use crate::output::write_atomic;
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};
use maud::{DOCTYPE, PreEscaped, html};
use std::path::{Path, PathBuf};

fn configured_of(findings: &Findings, kind: Kind, coefficient: usize) -> Option<f64> {
    findings
        .configured
        .and_then(|both| both[usize::from(kind == Kind::Accel)][coefficient])
}

/// Rows of the table: column, noise, value, 95 % interval, unit, configured value.
fn rows(findings: &Findings) -> Vec<[String; 6]> {
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
pub fn table(findings: &Findings) -> String {
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
    let mut text = table.to_string();
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

/// Writes `index.html` and a PNG and an SVG of each kind of sensor into `dir`; returns the path of the page.
///
/// # Errors
/// [`Error::Drawing`], [`Error::Unwritable`].
pub fn write(findings: &Findings, dir: &Path) -> Result<PathBuf, Error> {
    let mut pictures = vec![];
    for (kind, file) in [
        (Kind::Gyro, "allan-gyro.png"),
        (Kind::Accel, "allan-accel.png"),
    ] {
        let analyses: Vec<&Analysis> = findings
            .analyses
            .iter()
            .filter(|analysis| analysis.kind == kind)
            .collect();
        if !analyses.is_empty() {
            pictures.push((
                file,
                plot::svg(&analyses, file)?,
                plot::png(&analyses, file)?,
            ));
        }
    }
    for (file, svg, png) in &pictures {
        write_atomic(&dir.join(file), png)?;
        write_atomic(&dir.join(file).with_extension("svg"), svg.as_bytes())?;
    }
    let path = dir.join("index.html");
    write_atomic(&path, page(findings, &pictures).as_bytes())?;
    Ok(path)
}

fn page(findings: &Findings, pictures: &[(&str, String, Vec<u8>)]) -> String {
    let header = header(findings);
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "Allan deviation of " (findings.source) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Allan deviation of " (findings.source) }
                @if !findings.notes.is_empty() { ul { @for note in &findings.notes { li { (note) } } } }
                @for (file, svg, _) in pictures {
                    figure {
                        (PreEscaped(svg))
                        figcaption {
                            "Points: overlapping Allan deviation with 95 % intervals. Lines: the sum of the fitted noises. "
                            a href=(file) { (file) }
                        }
                    }
                }
                table {
                    thead { tr { @for name in &header { th { (name) } } } }
                    tbody { @for row in rows(findings) { tr { @for text in row.iter().take(header.len()) { td { (text) } } } } }
                }
                p { "Coefficients as in IEEE 647 and 952: variance = 3 Q" sup { "2" } "/\u{3c4}" sup { "2" } " + N" sup { "2" } "/\u{3c4} + B"
                    sup { "2" } " 2 ln 2/\u{3c0} + K" sup { "2" } " \u{3c4}/3 + R" sup { "2" } " \u{3c4}" sup { "2" } "/2." }
            }
        }
    };
    markup.into_string()
}
const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff}\
figure{margin:1rem 0}svg{width:100%;height:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
td,th{padding:.15rem .8rem;text-align:left;border-bottom:1px solid #d8dce2}";

/// A number to four figures.
fn figures(value: f64) -> String {
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
    use crate::analysis::allan::findings::tests::findings;

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
        let text = table(&findings);
        println!("{text}");
        assert_eq!(text.matches("N random walk").count(), 6);
        assert!(text.contains("configured") && text.contains("0.1250"));
        assert!(text.lines().all(|line| line.chars().count() <= 110));
        findings.configured = None;
        assert!(!table(&findings).contains("configured"));
    }

    #[test]
    fn the_page_stands_alone_with_its_pictures() {
        let dir = tempfile::tempdir().unwrap();
        let mut findings = findings();
        let page = write(&findings, &dir.path().join("new")).unwrap();
        let text = std::fs::read_to_string(&page).unwrap();
        assert!(text.contains("a &lt; b") && text.matches("<svg").count() == 2);
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
