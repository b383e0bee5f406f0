//! Charts for documents: measured points over logarithmic axes, with the expected law.
//!
//! Each is a separate SVG file with colours for a dark screen.

use host_chart::axis::{Axis, extent};
use host_chart::palette::{self, Look, REFERENCE};
use host_chart::picture::{Legend, Mark, Panel as Axes, Picture};
use host_core::error::Error;
use host_lab::experiment::results::Curve;

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// Title.
    pub title: String,
    /// Quantities and units of the abscissa and of the ordinate.
    pub axes: [String; 2],
    /// Measured points, x rising, joined by lines.
    pub measured: Vec<Curve>,
    /// The laws with which they are compared.
    pub laws: Vec<Curve>,
}

/// Width of a panel with its labels, and height of the picture.
const PANEL: f64 = 430.0;
const HEIGHT: f64 = 330.0;
/// Upper end of the axes, under a title and a legend of two rows.
const TOP: f64 = 70.0;

/// The panels side by side.
///
/// `name` is that of the file, for messages, and `title` is the text for screen readers. Values
/// that are not positive are left out.
///
/// # Errors
/// [`Error::Drawing`].
pub fn svg(panels: &[Panel], name: &'static str, title: &str) -> Result<String, Error> {
    let mut picture = Picture {
        size: (PANEL * panels.len() as f64, HEIGHT),
        ..Picture::default()
    };
    for (i, panel) in panels.iter().enumerate() {
        let from = i as f64 * PANEL;
        match axes(panel, from) {
            Some(drawn) => {
                let legend = Legend {
                    at: (drawn.at.0, 22.0),
                    width: drawn.size.0,
                    entries: looks(panel),
                };
                picture.legends.push(legend);
                picture.panels.push(drawn);
            }
            None => {
                let middle = (from + PANEL / 2.0, HEIGHT / 2.0);
                let sentence = format!("{}: nothing was measured", panel.title);
                picture.notes.push((middle, sentence));
            }
        }
    }
    picture.svg_file(name, title)
}

/// The panel with its left end at `from`; `None` without values.
fn axes(panel: &Panel, from: f64) -> Option<Axes> {
    let curves = || panel.measured.iter().chain(&panel.laws);
    let range = |pick: fn(&Curve) -> &Vec<f64>, by: f64| {
        let values = curves().flat_map(|curve| pick(curve).iter().copied());
        extent(values.filter(|value| *value > 0.0)).map(|(low, high)| (low / by, high * by))
    };
    let (x, y) = (range(|c| &c.x, 1.15)?, range(|c| &c.y, 1.5)?);
    let looks = looks(panel);
    let (measured, laws) = looks.split_at(panel.measured.len());
    let curve =
        |(curve, (_, look)): (&Curve, &(String, Look))| Mark::curve(&curve.x, &curve.y, *look);
    let mut marks: Vec<Mark> = panel.laws.iter().zip(laws).map(curve).collect();
    for (points, look) in panel.measured.iter().zip(measured) {
        marks.push(curve((points, look)));
        let dots = points.x.iter().copied().zip(points.y.iter().copied());
        marks.push(Mark::Dots(dots.collect(), 3.0, look.1.colour));
    }
    let [across, up] = &panel.axes;
    Some(Axes {
        at: (from + 76.0, TOP),
        size: (PANEL - 92.0, HEIGHT - TOP - 50.0),
        title: [panel.title.clone(), String::new()],
        x: Axis::log(across, x),
        y: Axis::log(up, y),
        marks,
    })
}

/// Names and looks: first what was measured, then the laws, dashed and faint.
fn looks(panel: &Panel) -> Vec<(String, Look)> {
    const DASHES: [(f64, f64); 3] = [(6.0, 4.0), (2.0, 3.0), (10.0, 3.0)];
    let measured = panel.measured.iter().enumerate();
    let measured = measured.map(|(i, c)| (c.name.clone(), palette::numbered(i)));
    let laws = panel.laws.iter().zip(DASHES.into_iter().cycle());
    let faint = |dash| Look::dashed(REFERENCE, 1.5, dash);
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
        // three dots a panel: 0 is not on a logarithmic axis
        assert_eq!(text.matches("<circle").count(), 6);
        assert!(text.len() < 60_000, "{} bytes", text.len());
    }

    #[test]
    fn a_panel_without_values_says_so() {
        let text = svg(&[Panel::default()], "x.svg", "").unwrap();
        assert!(text.contains("nothing was measured"));
    }
}
