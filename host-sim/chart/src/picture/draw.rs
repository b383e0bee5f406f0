//! Drawing of charts by plotters, on any of its back ends.

use super::{Legend, Mark, Panel, Picture};
use crate::axis::Axis;
use crate::palette::{Colour, GRID, INK, Look, PAPER, REFERENCE, SOFT, Sign};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};

/// Number of drawing units in a CSS pixel.
pub(super) const UNITS: f64 = 4.0;
/// Size of the text, CSS pixels.
const TEXT: f64 = 12.0;
/// Plotters writes the font size of an SVG as its own divided by this.
const FONT_SCALE: f64 = 1.24;
/// Space for the labels left of the axes, if they are numbers, and below, CSS pixels.
const LEFT: f64 = 62.0;
const BELOW: f64 = 42.0;
/// Distance between labels at the ends of curves, CSS pixels.
pub(super) const APART: f64 = 16.0;

/// The back end of plotters, which determines the workarounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum BackEnd {
    /// The SVG: no workarounds.
    Svg,
    /// The bitmap: it places text too high, and it draws a wide curve as one polygon, which has
    /// holes and spikes where a noisy curve crosses itself.
    Bitmap,
}

/// A drawing area.
struct Sheet<'a, DB: DrawingBackend> {
    root: &'a Root<DB>,
    back_end: BackEnd,
}

type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;
type Root<DB> = DrawingArea<DB, Shift>;
type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<Axis, Axis>>;

impl Picture {
    pub(super) fn draw<DB: DrawingBackend>(&self, root: &Root<DB>, back_end: BackEnd) -> Drawn<DB> {
        register();
        let sheet = Sheet { root, back_end };
        root.fill(&rgb(PAPER))?;
        for legend in &self.legends {
            legend.draw(&sheet)?;
        }
        for panel in &self.panels {
            panel.draw(&sheet)?;
        }
        for (at, sentence) in &self.notes {
            sheet.text(sentence, &text(SOFT, HPos::Center), pixel(*at))?;
        }
        root.present()
    }
}

impl<DB: DrawingBackend> Sheet<'_, DB> {
    /// Distance by which text must be moved down to be centred, drawing units.
    fn lower(&self) -> i32 {
        match self.back_end {
            BackEnd::Svg => 0,
            BackEnd::Bitmap => units(1.75),
        }
    }

    /// Draws a line of text, vertically centred at `at`.
    fn text(&self, words: &str, style: &TextStyle, at: (i32, i32)) -> Drawn<DB> {
        let at = (at.0, at.1 + self.lower());
        self.root.draw_text(words, style, at)
    }

    /// Draws a sign centred at a position.
    fn sign(&self, at: (i32, i32), sign: Sign, colour: Colour) -> Drawn<DB> {
        let filled = |colour| rgb(colour).filled();
        match sign {
            Sign::Disc => self.root.draw(&Circle::new(at, units(4.5), filled(colour))),
            Sign::Ring => {
                let hole = Circle::new(at, units(4.5), filled(PAPER));
                self.root.draw(&hole)?;
                let line = stroke(Look::solid(colour, 1.6));
                self.root.draw(&Circle::new(at, units(4.5), line))
            }
            Sign::Triangle => {
                let mark = TriangleMarker::new(at, units(6.5), filled(colour));
                self.root.draw(&mark)
            }
        }
    }
}

impl Legend {
    fn draw<DB: DrawingBackend>(&self, sheet: &Sheet<DB>) -> Drawn<DB> {
        let (mut x, mut y) = self.at;
        for (name, look) in &self.entries {
            let style = text(INK, HPos::Left);
            let length = 34.0 + f64::from(sheet.root.estimate_text_size(name, &style)?.0) / UNITS;
            if x > self.at.0 && x + length > self.at.0 + self.width {
                (x, y) = (self.at.0, y + 18.0);
            }
            let sample = vec![pixel((x, y)), pixel((x + 28.0, y))];
            match look.dash {
                None => sheet.root.draw(&PathElement::new(sample, stroke(*look)))?,
                Some((on, off)) => sheet.root.draw(&DashedPathElement::new(
                    sample,
                    units(on),
                    units(off),
                    stroke(*look),
                ))?,
            }
            if let Some(sign) = look.sign {
                sheet.sign(pixel((x + 14.0, y)), sign, look.colour)?;
            }
            sheet.text(name, &style, pixel((x + 34.0, y)))?;
            x += length + 22.0;
        }
        Ok(())
    }
}

impl Panel {
    fn draw<DB: DrawingBackend>(&self, sheet: &Sheet<DB>) -> Drawn<DB> {
        let ((left, top), (width, height)) = (self.at, self.size);
        let labels = self.y.room().unwrap_or(LEFT);
        let area = sheet.root.clone().shrink(
            pixel((left - labels, top)),
            (units(width + labels), units(height + BELOW)),
        );
        let mut chart = ChartBuilder::on(&area)
            .y_label_area_size(units(labels))
            .x_label_area_size(units(BELOW))
            .build_cartesian_2d(self.x.clone(), self.y.clone())?;
        chart
            .configure_mesh()
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .label_style(text(SOFT, HPos::Center))
            .axis_desc_style(text(INK, HPos::Center))
            .y_label_offset(sheet.lower())
            .set_all_tick_mark_size(units(3.0))
            .axis_style(stroke(Look::solid(REFERENCE, 1.0)))
            .light_line_style(stroke(Look::solid(GRID, 0.4)))
            .bold_line_style(stroke(Look::solid(GRID, 1.0)))
            .draw()?;
        let above = top - 12.0;
        let [title, corner] = &self.title;
        sheet.text(title, &text(INK, HPos::Left), pixel((left, above)))?;
        let right = pixel((left + width, above));
        sheet.text(corner, &text(SOFT, HPos::Right), right)?;
        for mark in &self.marks {
            self.mark(sheet, &mut chart, mark)?;
        }
        Ok(())
    }

    /// Whether a point lies between the axes.
    fn holds(&self, (x, y): (f64, f64)) -> bool {
        self.x.holds(x) && self.y.holds(y)
    }

    fn mark<DB: DrawingBackend>(
        &self,
        sheet: &Sheet<DB>,
        chart: &mut Chart<DB>,
        mark: &Mark,
    ) -> Drawn<DB> {
        match mark {
            Mark::Line(points, look) => self.line(sheet, chart, points, *look),
            Mark::Dots(points, radius, colour) => {
                let shown = points.iter().filter(|at| self.holds(**at));
                let dot = |at: &_| Circle::new(*at, units(*radius), rgb(*colour).filled());
                chart.draw_series(shown.map(dot)).map(drop)
            }
            Mark::Signs(points, look) => {
                let Some(sign) = look.sign else {
                    return Ok(());
                };
                let mut shown = points.iter().filter(|at| self.holds(**at));
                shown.try_for_each(|at| sheet.sign(chart.backend_coord(at), sign, look.colour))
            }
            Mark::Text(at, below, words) => {
                if !self.holds(*at) {
                    return Ok(());
                }
                let (x, y) = chart.backend_coord(at);
                sheet
                    .root
                    .draw(&Circle::new((x, y), units(4.0), rgb(INK).filled()))?;
                sheet.text(words, &text(INK, HPos::Center), (x, y + units(*below)))
            }
            Mark::Ends(ends) => self.ends(sheet, chart, ends),
        }
    }

    fn line<DB: DrawingBackend>(
        &self,
        sheet: &Sheet<DB>,
        chart: &mut Chart<DB>,
        points: &[(f64, f64)],
        look: Look,
    ) -> Drawn<DB> {
        for piece in points.split(|at| !self.holds(*at)) {
            if piece.len() < 2 {
                continue;
            }
            let piece = piece.to_vec();
            let style = stroke(look);
            match look.dash {
                None if sheet.back_end == BackEnd::Bitmap => segments(chart, &piece, look)?,
                None => chart
                    .draw_series([PathElement::new(piece, style)])
                    .map(drop)?,
                Some((on, off)) => chart
                    .draw_series([DashedPathElement::new(piece, units(on), units(off), style)])
                    .map(drop)?,
            }
        }
        Ok(())
    }

    fn ends<DB: DrawingBackend>(
        &self,
        sheet: &Sheet<DB>,
        chart: &Chart<DB>,
        ends: &[((f64, f64), String, Colour)],
    ) -> Drawn<DB> {
        let shown = ends.iter().filter(|(at, ..)| self.holds(*at));
        let mut placed: Vec<_> = shown
            .map(|(at, words, colour)| (chart.backend_coord(at), words, *colour))
            .collect();
        placed.sort_by_key(|((_, y), ..)| -y); // from below upwards
        let mut lowest = units(self.at.1 + self.size.1 - 6.0);
        let mut heights: Vec<i32> = vec![];
        for ((_, y), ..) in &placed {
            heights.push((*y).min(lowest));
            lowest = heights[heights.len() - 1] - units(APART);
        }
        // Labels beyond the upper end are moved back down.
        let mut highest = units(self.at.1);
        for height in heights.iter_mut().rev() {
            *height = (*height).max(highest);
            highest = *height + units(APART);
        }
        for (((x, y), words, colour), beside) in placed.into_iter().zip(heights) {
            let dot = Circle::new((x, y), units(3.5), rgb(colour).filled());
            sheet.root.draw(&dot)?;
            let pointer = vec![(x, y), (x + units(10.0), beside)];
            sheet
                .root
                .draw(&PathElement::new(pointer, stroke(Look::solid(colour, 1.0))))?;
            let at = (x + units(14.0), beside);
            sheet.text(words, &text(INK, HPos::Left), at)?;
        }
        Ok(())
    }
}

/// Draws a curve as single strokes with round joints.
fn segments<DB: DrawingBackend>(
    chart: &mut Chart<DB>,
    points: &[(f64, f64)],
    look: Look,
) -> Drawn<DB> {
    let strokes = points.windows(2);
    chart.draw_series(strokes.map(|ends| PathElement::new(ends.to_vec(), stroke(look))))?;
    let radius = units(look.width) / 2;
    let joints = points.iter();
    let joint = |at: &(f64, f64)| Circle::new(*at, radius, rgb(look.colour).filled());
    chart.draw_series(joints.map(joint)).map(drop)
}

/// Registers the embedded font with plotters, which otherwise has none.
fn register() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let font = include_bytes!("../../../assets/DejaVuSans-subset.ttf");
        // It fails only for a file that is no font, and the tests draw with it.
        let _ = register_font("sans-serif", FontStyle::Normal, font);
    });
}

/// A length in drawing units.
pub(super) fn units(length: f64) -> i32 {
    (length * UNITS).round() as i32
}

fn pixel((x, y): (f64, f64)) -> (i32, i32) {
    (units(x), units(y))
}

fn rgb(colour: Colour) -> RGBColor {
    let (r, g, b) = colour.rgb();
    RGBColor(r, g, b)
}

fn stroke(look: Look) -> ShapeStyle {
    rgb(look.colour).stroke_width(units(look.width) as u32)
}

fn text(colour: Colour, across: HPos) -> TextStyle<'static> {
    let style = TextStyle::from(("sans-serif", TEXT * UNITS * FONT_SCALE));
    TextStyle {
        color: rgb(colour).to_backend_color(),
        ..style
    }
    .pos(Pos::new(across, VPos::Center))
}
