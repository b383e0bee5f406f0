//! The four pictures of the report; one function each, for SVG and bitmap alike.

use super::axes::{Axis, extent, grouped, snapped, widened};
use super::canvas::{Canvas, UNITS_PER_PIXEL};
use super::palette::{self, Colour, INK, Look};
use super::panels;
use super::sheet::{Align, Drawn, MOST_POINTS, Plot, Sheet, UNITS};
use crate::error::Error;
use crate::experiment::results::{Curve, Report};
use plotters::prelude::{DrawingBackend, SVGBackend};

/// A picture of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// Plan view of the reference and of every scheme.
    Track,
    /// Horizontal error over time.
    Error,
    /// Cost over passes.
    Learning,
    /// Network against true sensor error, six panels.
    Errors,
}

impl Figure {
    /// All, in the order of the page.
    pub const ALL: [Self; 4] = [Self::Error, Self::Track, Self::Errors, Self::Learning];

    /// Name of the PNG.
    #[must_use]
    pub fn file(self) -> &'static str {
        match self {
            Self::Track => "track.png",
            Self::Error => "error.png",
            Self::Learning => "learning.png",
            Self::Errors => "errors.png",
        }
    }

    /// Width and height, CSS pixels.
    fn size(self) -> (f64, f64) {
        match self {
            Self::Track => (960.0, 620.0),
            Self::Error => (960.0, 460.0),
            Self::Learning => (960.0, 400.0),
            Self::Errors => (960.0, 560.0),
        }
    }

    fn units(self, per_pixel: f64) -> (u32, u32) {
        let (width, height) = self.size();
        ((width * per_pixel) as u32, (height * per_pixel) as u32)
    }

    fn draw<DB: DrawingBackend>(self, backend: &mut DB, report: &Report) -> Drawn<DB> {
        let mut sheet = Sheet::new(backend);
        match self {
            Self::Track => track(&mut sheet, self.size(), &report.track)?,
            Self::Error => error_over_time(&mut sheet, self.size(), &report.error_over_time)?,
            Self::Learning => learning(&mut sheet, self.size(), &report.learning)?,
            Self::Errors => panels::sensor_errors(&mut sheet, self.size(), &report.traces)?,
        }
        sheet.finish()
    }

    fn failed(self, problem: &dyn std::fmt::Display) -> Error {
        Error::Drawing {
            picture: self.file(),
            problem: problem.to_string(),
        }
    }

    /// The picture as an `<svg>` element that scales with the page; `title` is what a screen reader says.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn svg(self, report: &Report, title: &str) -> Result<String, Error> {
        let mut text = String::new();
        self.draw(
            &mut SVGBackend::with_string(&mut text, self.units(UNITS)),
            report,
        )
        .map_err(|e| self.failed(&e))?;
        let (width, height) = self.units(UNITS);
        let content = text.split_once(">\n").map_or("", |(_, content)| content);
        let title = maud::html! { title { (title) } }.into_string();
        Ok(format!(
            "<svg role=\"img\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\">{title}\n{content}"
        ))
    }

    /// The picture as a PNG file of two pixels a CSS pixel.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn png(self, report: &Report) -> Result<Vec<u8>, Error> {
        debug_assert_eq!(UNITS as i32 / UNITS_PER_PIXEL, 2);
        let mut canvas = Canvas::new(self.units(UNITS));
        self.draw(&mut canvas, report)
            .map_err(|e| self.failed(&e))?;
        canvas.png().map_err(|e| self.failed(&e))
    }
}

fn schemes(curves: &[Curve]) -> Vec<(String, Look)> {
    curves
        .iter()
        .enumerate()
        .map(|(i, curve)| (curve.name.clone(), palette::scheme(&curve.name, i)))
        .collect()
}

/// Metres or kilometres: factor and unit for a length of about `span` metres.
fn length_unit(span: f64) -> (f64, &'static str) {
    if span >= 5000.0 {
        (1e-3, "km")
    } else {
        (1.0, "m")
    }
}

/// A length in metres as text of about three figures, in the unit that suits lengths up to `span` metres.
pub(super) fn length(metres: f64, span: f64) -> String {
    let (factor, unit) = length_unit(span);
    let value = metres * factor;
    let digits = match value.abs() {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{}\u{a0}{unit}", grouped(value, digits))
}

fn track<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    size: (f64, f64),
    curves: &[Curve],
) -> Drawn<DB> {
    let all = |part: fn(&Curve) -> &Vec<f64>| {
        extent(
            curves
                .iter()
                .flat_map(move |curve| part(curve).iter().copied()),
        )
    };
    let (Some(east), Some(north)) = (all(|curve| &curve.x), all(|curve| &curve.y)) else {
        return sheet.nothing("this run has no track", size);
    };
    let (east, north) = (widened(east, 0.04), widened(north, 0.04));
    let (left, top, width, height) = (76.0, 44.0, size.0 - 100.0, size.1 - 96.0);
    // The same scale both ways, or directions would lie.
    let scale = ((east.1 - east.0) / width).max((north.1 - north.0) / height);
    let (factor, unit) = length_unit(scale * width);
    let around = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = ((low + high) / 2.0, scale * pixels / 2.0);
        (factor * (middle - half), factor * (middle + half))
    };
    let x = Axis::linear(format!("east, {unit}"), around(east, width), 10);
    let y = Axis::linear(format!("north, {unit}"), around(north, height), 7);
    let plot = Plot {
        left,
        top,
        width,
        height,
        x,
        y,
    };
    sheet.axes(&plot)?;
    sheet.legend((left, 20.0), width, &schemes(curves))?;
    for (i, curve) in curves.iter().enumerate() {
        let stride = curve.x.len().div_ceil(MOST_POINTS).max(1);
        let points = (0..curve.x.len()).filter(|i| i % stride == 0 || i + 1 == curve.x.len());
        let points = points.map(|i| (factor * curve.x[i], factor * curve.y[i]));
        let look = palette::scheme(&curve.name, i);
        let last = points.clone().next_back().and_then(|(x, y)| plot.at(x, y));
        sheet.path(&plot, points, look)?;
        if let Some(end) = last {
            sheet.dot(end, 4.0, look.colour)?;
        }
    }
    let start = curves
        .first()
        .and_then(|curve| Some((*curve.x.first()?, *curve.y.first()?)));
    if let Some(at) = start.and_then(|(x, y)| plot.at(factor * x, factor * y)) {
        sheet.dot(at, 4.0, INK)?;
        // On the side the track does not lead to.
        let north_of_start = start.is_some_and(|(_, y)| north.0 + north.1 > 2.0 * y);
        let away = if north_of_start { 16.0 } else { -16.0 };
        sheet.text("start", (at.0, at.1 + away), Align::Middle, INK)?;
    }
    Ok(())
}

fn error_over_time<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    size: (f64, f64),
    curves: &[Curve],
) -> Drawn<DB> {
    let time = extent(curves.iter().flat_map(|curve| curve.x.iter().copied()));
    let error = extent(curves.iter().flat_map(|curve| curve.y.iter().copied()));
    let (Some(time), Some((_, worst))) = (time, error) else {
        return sheet.nothing("this run has no error curves", size);
    };
    let (factor, unit) = length_unit(worst);
    let x = Axis::linear(
        "time of free-inertial navigation, min",
        snapped(widened(time, 0.0), 11),
        11,
    );
    let y = Axis::linear(
        format!("horizontal position error, {unit}"),
        (0.0, widened((0.0, worst * factor), 0.04).1),
        6,
    );
    let plot = Plot {
        left: 76.0,
        top: 44.0,
        width: size.0 - 216.0,
        height: size.1 - 96.0,
        x,
        y,
    };
    sheet.axes(&plot)?;
    sheet.legend((plot.left, 20.0), size.0 - 90.0, &schemes(curves))?;
    let mut ends = vec![];
    for (i, curve) in curves.iter().enumerate() {
        let look = palette::scheme(&curve.name, i);
        let scaled: Vec<f64> = curve.y.iter().map(|error| factor * error).collect();
        sheet.curve(&plot, &curve.x, &scaled, look)?;
        if let (Some(&t), Some(&error)) = (curve.x.last(), curve.y.last()) {
            ends.extend(plot.at(t, factor * error).map(|at| {
                (
                    at,
                    format!("{} {}", curve.name, length(error, worst)),
                    look.colour,
                )
            }));
        }
    }
    label_ends(sheet, &plot, ends)
}

/// Writes each curve's last value beside its end, moved apart where ends are close together.
fn label_ends<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    plot: &Plot,
    mut ends: Vec<((f64, f64), String, Colour)>,
) -> Drawn<DB> {
    const APART: f64 = 16.0;
    ends.sort_by(|a, b| b.0.1.total_cmp(&a.0.1)); // from below upwards
    let mut lowest = plot.bottom() - 6.0;
    let mut places: Vec<f64> = vec![];
    for (at, _, _) in &ends {
        let y = at.1.min(lowest);
        places.push(y);
        lowest = y - APART;
    }
    for ((at, text, colour), y) in ends.into_iter().zip(places) {
        sheet.dot(at, 3.5, colour)?;
        sheet.stroke(&[at, (at.0 + 10.0, y)], Look::solid(colour, 1.0))?;
        sheet.text(&text, (at.0 + 14.0, y), Align::Left, INK)?;
    }
    Ok(())
}

fn learning<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    size: (f64, f64),
    curves: &[Curve],
) -> Drawn<DB> {
    let positive = |curve: &Curve| {
        curve
            .y
            .iter()
            .copied()
            .filter(|cost| *cost > 0.0)
            .collect::<Vec<_>>()
    };
    let passes = extent(curves.iter().flat_map(|curve| curve.x.iter().copied()));
    let (Some(passes), Some(cost)) = (passes, extent(curves.iter().flat_map(positive))) else {
        return sheet.nothing("nothing was learned in this run", size);
    };
    let looks = learning_looks(curves);
    let (left, width) = (76.0, size.0 - 100.0);
    let top = sheet.legend((left, 20.0), width, &looks)?.1 + 24.0;
    let (low, high) = widened((cost.0.ln(), cost.1.ln()), 0.05);
    let x = Axis::linear(
        "passes over the data",
        snapped(widened(passes, 0.0), 10),
        10,
    );
    let y = Axis::log("cost, log scale", (low.exp(), high.exp()));
    let plot = Plot {
        left,
        top,
        width,
        height: size.1 - top - 52.0,
        x,
        y,
    };
    sheet.axes(&plot)?;
    for (curve, (_, look)) in curves.iter().zip(&looks) {
        sheet.curve(&plot, &curve.x, &curve.y, *look)?;
    }
    Ok(())
}

/// A colour a network, in the order they first appear.
fn learning_looks(curves: &[Curve]) -> Vec<(String, Look)> {
    let mut networks: Vec<&str> = vec![];
    let mut looks = vec![];
    for curve in curves {
        let network = curve.name.split(':').next().unwrap_or_default();
        if !networks.contains(&network) {
            networks.push(network);
        }
        let index = networks
            .iter()
            .position(|known| *known == network)
            .unwrap_or_default();
        looks.push((curve.name.clone(), palette::learning(&curve.name, index)));
    }
    looks
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    #[test]
    fn every_picture_draws_as_svg_and_png() {
        let report = sample::report();
        for figure in Figure::ALL {
            let svg = figure.svg(&report, "a < b").unwrap();
            assert!(svg.contains("<title>a &lt; b</title>") && svg.trim_end().ends_with("</svg>"));
            assert!(svg.contains("<polyline") && svg.contains("</text>"));
            assert!(
                svg.len() < 400_000,
                "{}: {} bytes",
                figure.file(),
                svg.len()
            );
            let png = figure.png(&report).unwrap();
            assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
        }
    }

    #[test]
    fn runs_without_data_say_so_and_odd_data_does_not_break_a_picture() {
        let mut report = sample::report();
        report.learning.clear();
        report.traces.clear();
        report.track = vec![Curve {
            name: "reference".into(),
            x: vec![0.0; 9],
            y: vec![0.0; 9],
        }];
        report.error_over_time = vec![Curve {
            name: "raw".into(),
            x: vec![0.0, 1.0, 2.0],
            y: vec![0.0, f64::NAN, 0.0],
        }];
        assert!(
            Figure::Learning
                .svg(&report, "")
                .unwrap()
                .contains("nothing was learned")
        );
        assert!(
            Figure::Errors
                .svg(&report, "")
                .unwrap()
                .contains("no sensor-error traces")
        );
        for figure in Figure::ALL {
            figure.png(&report).unwrap();
        }
    }

    #[test]
    fn lengths_share_the_unit_of_the_greatest() {
        let text = |metres, span| length(metres, span).replace('\u{a0}', " ");
        let alone = [4.21, 42.1, 421.0, 4210.0, 42_100.0].map(|metres| text(metres, metres));
        assert_eq!(alone, ["4.21 m", "42.1 m", "421 m", "4210 m", "42.1 km"]);
        assert_eq!(
            (text(421.0, 9000.0).as_str(), text(-3.0, 5.0).as_str()),
            ("0.42 km", "\u{2212}3.00 m")
        );
    }
}
