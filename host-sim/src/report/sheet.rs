//! A drawing sheet measured in CSS pixels over any back end of plotters: text, strokes, axes, curves, legends.

use super::axes::{Axis, dashed, thinned};
use super::palette::{Colour, GRID, INK, Look, REFERENCE, SOFT};
use plotters::style::{FontStyle, FontTransform, IntoFont, ShapeStyle, TextStyle, register_font};
use plotters_backend::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{BackendColor, DrawingBackend, DrawingErrorKind};

/// Drawing units a CSS pixel: back ends take integers, and quarters of a pixel do not show.
pub(super) const UNITS: f64 = 4.0;
/// Most points of one curve.
pub(super) const MOST_POINTS: usize = 1500;
/// Size of ordinary text, CSS pixels.
const TEXT: f64 = 12.0;
/// Plotters writes the SVG font size as its own divided by this.
const FONT_SCALE: f64 = 1.24;

pub(super) type Drawn<DB> = Result<(), DrawingErrorKind<<DB as DrawingBackend>::ErrorType>>;

/// Makes the embedded font known to plotters, which would otherwise have none at all.
pub(super) fn register_fonts() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let font = include_bytes!("../../assets/DejaVuSans-subset.ttf");
        // It fails only for a file that is no font; the tests draw with it.
        let _ = register_font("sans-serif", FontStyle::Normal, font);
    });
}

/// A rectangle with its two axes.
#[derive(Debug, Clone)]
pub(super) struct Plot {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub x: Axis,
    pub y: Axis,
}

impl Plot {
    /// Place on the sheet; `None` if off the axes or not a number.
    pub fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let (across, up) = (self.x.place(x)?, self.y.place(y)?);
        Some((
            self.left + across * self.width,
            self.top + (1.0 - up) * self.height,
        ))
    }

    /// Right edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Lower edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }
}

/// Where a text stands relative to its anchor.
#[derive(Debug, Clone, Copy)]
pub(super) enum Align {
    Left,
    Middle,
    Right,
}

/// See the module.
pub(super) struct Sheet<'a, DB> {
    backend: &'a mut DB,
}

impl<'a, DB: DrawingBackend> Sheet<'a, DB> {
    pub fn new(backend: &'a mut DB) -> Self {
        register_fonts();
        Self { backend }
    }

    /// Finishes the picture.
    pub fn finish(self) -> Drawn<DB> {
        self.backend.present()
    }

    /// A line of text, its middle at the height of `at`.
    pub fn text(&mut self, text: &str, at: (f64, f64), align: Align, colour: Colour) -> Drawn<DB> {
        self.backend
            .draw_text(text, &style(colour, align), units(at))
    }

    /// The same, read from below upwards.
    fn text_upwards(&mut self, text: &str, at: (f64, f64), colour: Colour) -> Drawn<DB> {
        let style = style(colour, Align::Middle).transform(FontTransform::Rotate270);
        self.backend.draw_text(text, &style, units(at))
    }

    fn text_width(&self, text: &str) -> Result<f64, DrawingErrorKind<DB::ErrorType>> {
        Ok(f64::from(
            self.backend
                .estimate_text_size(text, &style(INK, Align::Left))?
                .0,
        ) / UNITS)
    }

    /// A filled dot.
    pub fn dot(&mut self, at: (f64, f64), radius: f64, colour: Colour) -> Drawn<DB> {
        self.backend.draw_circle(
            units(at),
            (radius * UNITS) as u32,
            &shape(colour, 0.0),
            true,
        )
    }

    /// An open path.
    pub fn stroke(&mut self, path: &[(f64, f64)], look: Look) -> Drawn<DB> {
        for stroke in dashed(path, look.dash) {
            if stroke.len() > 1 {
                self.backend.draw_path(
                    stroke.into_iter().map(units),
                    &shape(look.colour, look.width),
                )?;
            }
        }
        Ok(())
    }

    /// Grid, frame, tick labels and axis titles.
    pub fn axes(&mut self, plot: &Plot) -> Drawn<DB> {
        let (left, right, top, bottom) = (plot.left, plot.right(), plot.top, plot.bottom());
        for (value, text) in &plot.x.ticks {
            let x = left + plot.x.place(*value).unwrap_or_default() * plot.width;
            self.stroke(&[(x, top), (x, bottom)], Look::solid(GRID, 1.0))?;
            self.text(text, (x, bottom + 13.0), Align::Middle, SOFT)?;
        }
        for (value, text) in &plot.y.ticks {
            let y = bottom - plot.y.place(*value).unwrap_or_default() * plot.height;
            self.stroke(&[(left, y), (right, y)], Look::solid(GRID, 1.0))?;
            self.text(text, (left - 7.0, y), Align::Right, SOFT)?;
        }
        self.stroke(
            &[(left, top), (left, bottom), (right, bottom)],
            Look::solid(REFERENCE, 1.0),
        )?;
        self.text(
            &plot.x.label,
            (left + plot.width / 2.0, bottom + 34.0),
            Align::Middle,
            INK,
        )?;
        self.text_upwards(&plot.y.label, (left - 56.0, top + plot.height / 2.0), INK)
    }

    /// A curve over a rising abscissa, thinned; NaN and what is off the axes interrupt it.
    pub fn curve(&mut self, plot: &Plot, x: &[f64], y: &[f64], look: Look) -> Drawn<DB> {
        self.path(
            plot,
            thinned(y, MOST_POINTS).into_iter().map(|i| (x[i], y[i])),
            look,
        )
    }

    /// A path through `points`; NaN and what is off the axes interrupt it.
    pub fn path(
        &mut self,
        plot: &Plot,
        points: impl Iterator<Item = (f64, f64)>,
        look: Look,
    ) -> Drawn<DB> {
        let mut piece = vec![];
        for (x, y) in points {
            match plot.at(x, y) {
                Some(at) => piece.push(at),
                None => self.stroke(&std::mem::take(&mut piece), look)?,
            }
        }
        self.stroke(&piece, look)
    }

    /// Names with a sample of their line in a row from `at` on, in a new row beyond `width`; returns where a next one would be.
    pub fn legend(
        &mut self,
        at: (f64, f64),
        width: f64,
        entries: &[(String, Look)],
    ) -> Result<(f64, f64), DrawingErrorKind<DB::ErrorType>> {
        let (mut x, mut y) = at;
        for (name, look) in entries {
            let length = 34.0 + self.text_width(name)?;
            if x > at.0 && x + length > at.0 + width {
                (x, y) = (at.0, y + 18.0);
            }
            self.stroke(&[(x, y), (x + 28.0, y)], *look)?;
            self.text(name, (x + 34.0, y), Align::Left, INK)?;
            x += length + 22.0;
        }
        Ok((x, y))
    }

    /// A sentence in place of a picture without data.
    pub fn nothing(&mut self, sentence: &str, size: (f64, f64)) -> Drawn<DB> {
        self.text(sentence, (size.0 / 2.0, size.1 / 2.0), Align::Middle, SOFT)
    }
}

fn units(at: (f64, f64)) -> (i32, i32) {
    ((at.0 * UNITS).round() as i32, (at.1 * UNITS).round() as i32)
}

fn shape(colour: Colour, width: f64) -> ShapeStyle {
    let (r, g, b) = colour.rgb();
    let stroke_width = (width * UNITS).round() as u32;
    ShapeStyle {
        color: plotters::style::RGBColor(r, g, b).into(),
        filled: true,
        stroke_width,
    }
}

fn style(colour: Colour, align: Align) -> TextStyle<'static> {
    let horizontal = match align {
        Align::Left => HPos::Left,
        Align::Middle => HPos::Center,
        Align::Right => HPos::Right,
    };
    TextStyle {
        font: ("sans-serif", TEXT * UNITS * FONT_SCALE).into_font(),
        color: BackendColor {
            alpha: 1.0,
            rgb: colour.rgb(),
        },
        pos: Pos::new(horizontal, VPos::Center),
    }
}
