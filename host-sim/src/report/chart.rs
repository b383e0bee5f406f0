//! Small pictures for documents: measured points over logarithmic axes beside the law they should follow, as an SVG file by itself that
//! follows a dark screen.

use super::axes::{Axis, extent};
use super::palette::{self, INK, Look, PAPER, REFERENCE};
use super::sheet::{Align, Drawn, Plot, Sheet, UNITS};
use crate::error::Error;
use crate::experiment::results::Curve;
use plotters::prelude::{DrawingBackend, SVGBackend};
use std::fmt::Write;

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// What is shown.
    pub title: String,
    /// Quantities and units of the abscissa and of the ordinate.
    pub axes: [String; 2],
    /// Points that were measured, x rising, joined by lines.
    pub measured: Vec<Curve>,
    /// What they are held against.
    pub laws: Vec<Curve>,
}

/// Width of a panel with its labels, height of the picture, CSS pixels.
const PANEL: f64 = 430.0;
const HEIGHT: f64 = 330.0;

/// The panels side by side; `name` is the file's, for messages, `title` what a screen reader says. Values that are not positive are left
/// out.
///
/// # Errors
/// [`Error::Drawing`].
pub fn svg(panels: &[Panel], name: &'static str, title: &str) -> Result<String, Error> {
    let mut text = String::new();
    let width = PANEL * panels.len() as f64;
    let [wide, high] = [width, HEIGHT].map(|length| (length * UNITS) as u32);
    draw(
        &mut SVGBackend::with_string(&mut text, (wide, high)),
        panels,
    )
    .map_err(|problem| Error::Drawing {
        picture: name,
        problem: problem.to_string(),
    })?;
    let content = text.split_once(">\n").map_or("", |(_, content)| content);
    let (title, style) = (maud::html! { title { (title) } }.into_string(), style());
    Ok(format!(
        "<svg role=\"img\" width=\"{width}\" height=\"{HEIGHT}\" viewBox=\"0 0 {wide} {high}\" xmlns=\"http://www.w3.org/2000/svg\">{title}\
         <style>{style}</style>\n<rect width=\"{wide}\" height=\"{high}\" fill=\"{}\"/>\n{content}",
        PAPER.light
    ))
}

/// The dark counterparts of the colours.
fn style() -> String {
    let mut dark = String::new();
    for colour in palette::all() {
        let (light, instead) = (colour.light, colour.dark);
        let _ = write!(
            dark,
            "[stroke=\"{light}\"]{{stroke:{instead}}}[fill=\"{light}\"]{{fill:{instead}}}"
        );
    }
    format!("@media (prefers-color-scheme:dark){{{dark}}}")
}

fn draw<DB: DrawingBackend>(backend: &mut DB, panels: &[Panel]) -> Drawn<DB> {
    let mut sheet = Sheet::new(backend);
    for (i, panel) in panels.iter().enumerate() {
        one(&mut sheet, panel, i as f64 * PANEL)?;
    }
    sheet.finish()
}

fn one<DB: DrawingBackend>(sheet: &mut Sheet<DB>, panel: &Panel, from: f64) -> Drawn<DB> {
    let curves = || panel.measured.iter().chain(&panel.laws);
    let range = |pick: fn(&Curve) -> &Vec<f64>, by: f64| {
        let values = curves().flat_map(|curve| pick(curve).iter().copied());
        extent(values.filter(|value| *value > 0.0)).map(|(low, high)| (low / by, high * by))
    };
    let (Some(x), Some(y)) = (range(|c| &c.x, 1.15), range(|c| &c.y, 1.5)) else {
        let middle = (2.0 * from + PANEL, HEIGHT);
        return sheet.nothing(&format!("{}: nothing was measured", panel.title), middle);
    };
    let looks = looks(panel);
    let left = from + 76.0;
    let width = PANEL - 92.0;
    sheet.text(&panel.title, (left, 18.0), Align::Left, INK)?;
    let top = sheet.legend((left, 40.0), width, &looks)?.1 + 18.0;
    let [across, up] = &panel.axes;
    let plot = Plot {
        left,
        top,
        width,
        height: HEIGHT - top - 50.0,
        x: Axis::log(across, x),
        y: Axis::log(up, y),
    };
    sheet.axes(&plot)?;
    for (curve, (_, look)) in panel.laws.iter().zip(&looks[panel.measured.len()..]) {
        sheet.curve(&plot, &curve.x, &curve.y, *look)?;
    }
    for (curve, (_, look)) in panel.measured.iter().zip(&looks) {
        sheet.curve(&plot, &curve.x, &curve.y, *look)?;
        for (x, y) in curve.x.iter().zip(&curve.y) {
            if let Some(at) = plot.at(*x, *y) {
                sheet.dot(at, 3.0, look.colour)?;
            }
        }
    }
    Ok(())
}

/// Names and looks: first what was measured, then the laws, dashed and faint.
fn looks(panel: &Panel) -> Vec<(String, Look)> {
    const DASHES: [&[f64]; 3] = [&[6.0, 4.0], &[2.0, 3.0], &[9.0, 3.0, 2.0, 3.0]];
    let measured = panel.measured.iter().enumerate();
    let measured = measured.map(|(i, c)| (c.name.clone(), palette::learning("", i)));
    let laws = panel.laws.iter().zip(DASHES.into_iter().cycle());
    let faint = |dash| Look {
        colour: REFERENCE,
        width: 1.5,
        dash,
    };
    measured
        .chain(laws.map(|(c, dash)| (c.name.clone(), faint(dash))))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        Panel {
            title: "cost < 1".into(),
            axes: ["n".into(), "\u{b5}s".into()],
            measured: vec![Curve {
                name: "measured".into(),
                x: vec![0.0, 6.0, 24.0, 96.0],
                y: vec![1.0, 2.0, 30.0, 450.0],
            }],
            laws: vec![Curve {
                name: "n\u{b2}".into(),
                x: vec![6.0, 96.0],
                y: vec![2.0, 512.0],
            }],
        }
    }

    #[test]
    fn a_picture_stands_alone_in_light_and_dark() {
        let text = svg(&[panel(), panel()], "x.svg", "a < b").unwrap();
        assert!(text.contains("<title>a &lt; b</title>") && text.contains("cost &lt; 1"));
        assert!(text.contains("prefers-color-scheme:dark") && text.trim_end().ends_with("</svg>"));
        // three dots a panel: no place for 0 on a logarithmic axis
        assert_eq!(text.matches("<circle").count(), 6);
        assert!(text.len() < 60_000, "{} bytes", text.len());
    }

    #[test]
    fn a_panel_without_values_says_so() {
        let text = svg(&[Panel::default()], "x.svg", "").unwrap();
        assert!(text.contains("nothing was measured"));
    }
}
