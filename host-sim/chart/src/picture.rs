//! Charts: pictures as plain data, drawn by plotters as SVG or as PNG.
//!
//! All lengths are CSS pixels. Plotters takes whole numbers only, so a drawing has
//! `draw::UNITS` units a pixel, which keeps lines smooth. The PNG is drawn at that size and
//! reduced, which smooths its edges.

mod data;
mod draw;

use crate::axis::{Axis, thinned};
use crate::palette::{self, Colour, Look};
use draw::{BackEnd, units};
use host_core::error::Error;
use plotters::prelude::{BitMapBackend, IntoDrawingArea, SVGBackend};
use std::fmt::Write;

/// Drawing units a pixel of the PNG, so that it has two pixels a CSS pixel.
const SMOOTH: usize = 2;
/// Width of the pictures of a page.
pub const WIDTH: f64 = 960.0;
/// Largest number of points of one curve.
pub const MOST_POINTS: usize = 1500;

/// A picture: legends, panels and notes on a sheet.
#[derive(Debug, Clone, Default)]
pub struct Picture {
    /// Width and height.
    pub size: (f64, f64),
    /// Legends beside or above the panels.
    pub legends: Vec<Legend>,
    /// Pairs of axes with their curves.
    pub panels: Vec<Panel>,
    /// Sentences instead of panels without data, each with the position of its centre.
    pub notes: Vec<((f64, f64), String)>,
}

/// Names with a sample of their line, in rows.
#[derive(Debug, Clone)]
pub struct Legend {
    /// Left end and height of the first row.
    pub at: (f64, f64),
    /// Largest width of a row.
    pub width: f64,
    /// Name and line of each entry.
    pub entries: Vec<(String, Look)>,
}

/// A pair of axes with its curves.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Left and upper end of the axes.
    pub at: (f64, f64),
    /// Width and height of the axes, without labels.
    pub size: (f64, f64),
    /// Text above the axes at the left, and at the right.
    pub title: [String; 2],
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Marks in the order of drawing.
    pub marks: Vec<Mark>,
}

/// Something drawn between axes. Values beyond the axes and NaN are left out.
#[derive(Debug, Clone)]
pub enum Mark {
    /// A curve.
    Line(Vec<(f64, f64)>, Look),
    /// Filled circles with their radius.
    Dots(Vec<(f64, f64)>, f64, Colour),
    /// The signs of a look.
    Signs(Vec<(f64, f64)>, Look),
    /// A dot, and a text at this distance below it.
    Text((f64, f64), f64, String),
    /// The last points of curves, each with a text at its right, moved apart where they are close.
    Ends(Vec<((f64, f64), String, Colour)>),
}

impl Mark {
    /// A curve over a rising abscissa, thinned.
    pub fn curve(x: &[f64], y: &[f64], look: Look) -> Self {
        let indices = thinned(y, MOST_POINTS).into_iter();
        Self::Line(indices.map(|i| (x[i], y[i])).collect(), look)
    }
}

impl Picture {
    /// A picture with nothing but a sentence.
    pub fn without_data(size: (f64, f64), sentence: &str) -> Self {
        Self {
            size,
            notes: vec![((size.0 / 2.0, size.1 / 2.0), sentence.to_owned())],
            ..Self::default()
        }
    }

    /// Whether all its axes have scales, so that a reader can zoom and read values.
    pub fn has_scales(&self) -> bool {
        let axes = self.panels.iter().flat_map(|panel| [&panel.x, &panel.y]);
        axes.into_iter().all(|axis| axis.room().is_none())
    }

    /// An `<svg>` element that scales with its page. `name` is for messages, `title` is what a
    /// screen reader says.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn svg(&self, name: &'static str, title: &str) -> Result<String, Error> {
        self.svg_element(name, title, "", "")
    }

    /// The same as a separate file, with its size, and with colours for a dark screen.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn svg_file(&self, name: &'static str, title: &str) -> Result<String, Error> {
        let mut dark = String::new();
        for colour in palette::all() {
            let (light, instead) = (colour.light, colour.dark);
            let _ = write!(
                dark,
                "[stroke=\"{light}\"]{{stroke:{instead}}}[fill=\"{light}\"]{{fill:{instead}}}"
            );
        }
        let style = format!("<style>@media (prefers-color-scheme:dark){{{dark}}}</style>");
        let (width, height) = self.size;
        let size = format!(" width=\"{width}\" height=\"{height}\"");
        self.svg_element(name, title, &size, &style)
    }

    fn svg_element(
        &self,
        name: &'static str,
        title: &str,
        attributes: &str,
        style: &str,
    ) -> Result<String, Error> {
        let mut text = String::new();
        let (width, height) = (units(self.size.0), units(self.size.1));
        let size = (width as u32, height as u32);
        self.draw(
            &SVGBackend::with_string(&mut text, size).into_drawing_area(),
            BackEnd::Svg,
        )
        .map_err(|problem| failed(name, &problem))?;
        let content = text.split_once(">\n").map_or("", |(_, content)| content);
        let title = maud::html! { title { (title) } }.into_string();
        Ok(format!(
            "<svg role=\"img\"{attributes} viewBox=\"0 0 {width} {height}\" \
             xmlns=\"http://www.w3.org/2000/svg\">{title}{style}\n{content}"
        ))
    }

    /// A PNG file of two pixels a CSS pixel. `name` is for messages.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn png(&self, name: &'static str) -> Result<Vec<u8>, Error> {
        let [width, height] = [self.size.0, self.size.1].map(|length| units(length) as usize);
        let mut fine = vec![0; 3 * width * height];
        let back_end = BitMapBackend::with_buffer(&mut fine, (width as u32, height as u32));
        self.draw(&back_end.into_drawing_area(), BackEnd::Bitmap)
            .map_err(|problem| failed(name, &problem))?;
        let rgb = smaller(&fine, width);
        let mut file = vec![];
        let [width, height] = [width, height].map(|length| (length / SMOOTH) as u32);
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::Fast);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&rgb))
            .map_err(|problem| failed(name, &problem))?;
        Ok(file)
    }
}

fn failed(picture: &'static str, problem: &dyn std::fmt::Display) -> Error {
    Error::Drawing {
        picture,
        problem: problem.to_string(),
    }
}

/// Mean of each `SMOOTH` by `SMOOTH` pixels of a picture `width` pixels wide.
fn smaller(fine: &[u8], width: usize) -> Vec<u8> {
    let mut rgb = Vec::with_capacity(fine.len() / (SMOOTH * SMOOTH));
    for rows in fine.chunks_exact(3 * width * SMOOTH) {
        for x in (0..width).step_by(SMOOTH) {
            for part in 0..3 {
                let pixel = |i: usize| rows[3 * (i / SMOOTH * width + x + i % SMOOTH) + part];
                let sum: usize = (0..SMOOTH * SMOOTH).map(|i| usize::from(pixel(i))).sum();
                rgb.push((sum / (SMOOTH * SMOOTH)) as u8);
            }
        }
    }
    rgb
}

#[cfg(test)]
mod tests {
    use super::draw::APART;
    use super::*;
    use crate::axis::Axis;
    use crate::palette::RNN;

    fn picture(marks: Vec<Mark>) -> Picture {
        let panel = Panel {
            at: (70.0, 30.0),
            size: (200.0, 100.0),
            title: ["title".into(), "unit".into()],
            x: Axis::linear("x", (0.0, 10.0), 5),
            y: Axis::linear("y", (0.0, 1.0), 2),
            marks,
        };
        Picture {
            size: (300.0, 200.0),
            panels: vec![panel],
            ..Picture::default()
        }
    }

    /// Pixels of a PNG, three bytes each, and its width and height.
    fn pixels(png: Vec<u8>) -> (Vec<u8>, (u32, u32)) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (pixels, (info.width, info.height))
    }

    #[test]
    fn what_is_nan_or_beyond_the_axes_interrupts_a_curve() {
        let look = Look::solid(RNN, 2.0);
        let at = |i: i32| (f64::from(i), if i == 5 { f64::NAN } else { 0.5 });
        let whole = Mark::Line((0..=4).map(at).collect(), look);
        let broken = Mark::Line((-3..=14).map(at).collect(), look);
        let count = |mark| {
            let svg = picture(vec![mark]).svg("", "").unwrap();
            svg.matches(&format!("stroke=\"{}\"", RNN.light)).count()
        };
        assert_eq!((count(whole), count(broken)), (1, 2));
    }

    #[test]
    fn a_curve_covers_its_length_times_its_width_in_the_png() {
        let line = |dash| {
            let look = Look {
                dash,
                ..Look::solid(RNN, 4.0)
            };
            let png = picture(vec![Mark::Line(vec![(1.0, 0.25), (9.0, 0.75)], look)]).png("");
            let (pixels, size) = pixels(png.unwrap());
            assert_eq!(size, (600, 400));
            let (r, g, b) = RNN.rgb();
            pixels.chunks_exact(3).filter(|p| **p == [r, g, b]).count() as f64
        };
        // 160 by 50 CSS pixels, two pixels each; the edges are lighter
        let full = 2.0 * 160_f64.hypot(50.0) * 8.0;
        assert!((0.85..1.0).contains(&(line(None) / full)));
        assert!((0.5..0.65).contains(&(line(Some((9.0, 6.0))) / full)));
    }

    #[test]
    fn labels_of_ends_that_are_close_are_moved_apart() {
        let end = |y| ((10.0, y), format!("end {y}"), RNN);
        let ends = Mark::Ends(vec![end(0.5), end(0.51), end(0.49), end(0.99), end(1.0)]);
        let svg = picture(vec![ends]).svg("", "").unwrap();
        let height = |words: &str| -> i32 {
            let before = svg.split(&format!("\n{words}\n")).next().unwrap();
            let y = before.rsplit(" y=\"").next().unwrap();
            y.split('"').next().unwrap().parse().unwrap()
        };
        let [low, middle, high] = ["end 0.49", "end 0.5", "end 0.51"].map(height);
        let [below, top] = ["end 0.99", "end 1"].map(height);
        assert!(top >= units(30.0) && below - top >= units(APART));
        assert!(low - middle >= units(APART) && middle - high >= units(APART));
    }

    #[test]
    fn edges_are_smoothed_by_the_mean_of_four_pixels() {
        let (black, white) = ([0; 3], [255; 3]);
        let fine = [black, white, white, white, white, white, black, black].concat();
        assert_eq!(smaller(&fine, 4), [[191; 3], [127; 3]].concat());
    }
}
