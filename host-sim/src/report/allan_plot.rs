//! The picture: measured deviations with their intervals as points, the fitted sum of noises as lines, both scales logarithmic.
//!
//! Drawn by plotters' own charts: the axes of the report have no logarithmic abscissa.

use crate::analysis::allan::fit::{Analysis, Deviation};
use crate::error::Error;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

/// Size of the picture, CSS pixels.
const SIZE: (u32, u32) = (960, 560);
/// Pixels of the bitmap to a CSS pixel, and drawn pixels to a pixel of the bitmap: plotters' bitmap does not smooth edges by itself.
const SCALE: u32 = 2;
const SMOOTH: u32 = 2;
/// Colours that differ for everybody (Okabe and Ito).
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(110, 110, 110),
];

/// The picture as an `<svg>` element. `analyses` are of one kind and not empty; `name` is for messages.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn svg(analyses: &[&Analysis], name: &'static str) -> Result<String, Error> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
    draw(&area, analyses, 1).map_err(|problem| failed(name, &problem))?;
    drop(area);
    Ok(text)
}

/// The picture as a PNG file.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn png(analyses: &[&Analysis], name: &'static str) -> Result<Vec<u8>, Error> {
    let (width, height) = (SIZE.0 * SCALE, SIZE.1 * SCALE);
    let (wide, high) = (width * SMOOTH, height * SMOOTH);
    let mut fine = vec![0; 3 * (wide * high) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut fine, (wide, high)).into_drawing_area();
        draw(&area, analyses, SCALE * SMOOTH).map_err(|problem| failed(name, &problem))?;
    }
    let rgb = smaller(&fine, wide as usize);
    let mut file = vec![];
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(&rgb));
    written.map_err(|problem| failed(name, &problem))?;
    Ok(file)
}

fn failed(picture: &'static str, problem: &dyn std::fmt::Display) -> Error {
    Error::Drawing {
        picture,
        problem: problem.to_string(),
    }
}

/// Mean of each `SMOOTH` by `SMOOTH` pixels of a picture `wide` pixels wide.
fn smaller(fine: &[u8], wide: usize) -> Vec<u8> {
    let n = SMOOTH as usize;
    let rows = fine.chunks_exact(3 * wide * n);
    let mut rgb = Vec::with_capacity(fine.len() / (n * n));
    for row in rows {
        for x in (0..wide).step_by(n) {
            for part in 0..3 {
                let pixels =
                    (0..n * n).map(|i| usize::from(row[3 * (i / n * wide + x + i % n) + part]));
                rgb.push((pixels.sum::<usize>() / (n * n)) as u8);
            }
        }
    }
    rgb
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    analyses: &[&Analysis],
    scale: u32,
) -> Drawn<DB> {
    register();
    area.fill(&WHITE)?;
    let pixels = |css: u32| css * scale;
    let points = || analyses.iter().flat_map(|analysis| &analysis.curve);
    let least = |value: fn(&Deviation) -> f64| points().map(value).fold(f64::INFINITY, f64::min);
    let most = |value: fn(&Deviation) -> f64| points().map(value).fold(0.0, f64::max);
    let times = least(|p| p.tau_s) / 1.3..most(|p| p.tau_s) * 1.3;
    let deviations = least(|p| p.low) / 1.5..most(|p| p.high) * 1.5;
    let unit = analyses.first().map_or("", |analysis| analysis.unit);
    let mut chart = ChartBuilder::on(area)
        .margin(pixels(14))
        .x_label_area_size(pixels(44))
        .y_label_area_size(pixels(72))
        .build_cartesian_2d(times.log_scale(), deviations.log_scale())?;
    let font = ("sans-serif", pixels(13));
    chart
        .configure_mesh()
        .x_desc("averaging time \u{3c4}, s")
        .y_desc(format!("Allan deviation, {unit}"))
        .x_label_formatter(&|value| number(*value))
        .y_label_formatter(&|value| number(*value))
        .label_style(font)
        .axis_desc_style(font)
        .bold_line_style(RGBColor(216, 220, 226).stroke_width(scale))
        .light_line_style(RGBColor(240, 242, 245).stroke_width(scale))
        .draw()?;
    for (analysis, colour) in analyses.iter().zip(COLOURS.into_iter().cycle()) {
        let Elements { line, bars, dots } = elements(analysis, colour, scale);
        chart.draw_series(std::iter::once(line))?;
        chart.draw_series(bars)?;
        chart
            .draw_series(dots)?
            .label(&analysis.column)
            .legend(move |(x, y)| {
                Circle::new((x + pixels(8) as i32, y), pixels(3), colour.filled())
            });
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .margin(pixels(10))
        .legend_area_size(pixels(20))
        .label_font(font)
        .background_style(WHITE.mix(0.85))
        .draw()?;
    area.present()
}

/// What is drawn of one column.
struct Elements {
    line: PathElement<(f64, f64)>,
    bars: Vec<PathElement<(f64, f64)>>,
    dots: Vec<Circle<(f64, f64), u32>>,
}

fn elements(analysis: &Analysis, colour: RGBColor, scale: u32) -> Elements {
    let points = || analysis.curve.iter();
    let fitted = points().filter(|p| p.fitted > 0.0);
    let fitted: Vec<_> = fitted.map(|p| (p.tau_s, p.fitted)).collect();
    let bar = |low, high| PathElement::new(vec![low, high], colour.stroke_width(scale));
    Elements {
        line: PathElement::new(fitted, colour.mix(0.6).stroke_width(2 * scale)),
        bars: points()
            .map(|p| bar((p.tau_s, p.low), (p.tau_s, p.high)))
            .collect(),
        dots: points()
            .map(|p| Circle::new((p.tau_s, p.deviation), 3 * scale, colour.filled()))
            .collect(),
    }
}

/// A tick's text: plain from 0.001 to 9999, else a power of ten.
fn number(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        format!("{}", (value * 1e6).round() / 1e6)
    } else {
        format!("{value:.0e}")
    }
}

/// Makes the embedded font known to plotters, which would otherwise have none at all.
fn register() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let font = include_bytes!("../../assets/DejaVuSans-subset.ttf");
        // it fails only for a file that is no font; the tests draw with it
        let _ = register_font("sans-serif", FontStyle::Normal, font);
    });
}
