//! A back end of plotters that draws into a page of the PDF, as lines, areas and text.

use super::font::Font;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Name, Str};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
};
use std::convert::Infallible;

/// Plotters' sizes of text, divided by this, are those of the SVG.
const FONT_SCALE: f64 = 1.24;
/// Height of the middle of a line of text above its base, in sizes of the font.
const MIDDLE: f32 = 0.27;

/// A part of a page.
pub(super) struct Canvas<'a> {
    pub content: &'a mut Content,
    pub font: &'a mut Font,
    /// Width and height in drawing units.
    pub size: (u32, u32),
    /// Upper left corner on the page, points.
    pub at: (f32, f32),
    /// Points a drawing unit.
    pub scale: f32,
}

type Done = Result<(), DrawingErrorKind<Infallible>>;

impl Canvas<'_> {
    fn place(&self, (x, y): BackendCoord) -> (f32, f32) {
        (
            self.at.0 + x as f32 * self.scale,
            self.at.1 - y as f32 * self.scale,
        )
    }

    fn stroke_style(&mut self, style: &impl BackendStyle) {
        let (r, g, b) = rgb(style.color());
        self.content
            .set_stroke_rgb(r, g, b)
            .set_line_width(style.stroke_width() as f32 * self.scale)
            .set_line_cap(LineCapStyle::ButtCap)
            .set_line_join(LineJoinStyle::RoundJoin);
    }

    fn fill_style(&mut self, style: &impl BackendStyle) {
        let (r, g, b) = rgb(style.color());
        self.content.set_fill_rgb(r, g, b);
    }

    fn outline(&mut self, path: impl IntoIterator<Item = BackendCoord>) {
        for (k, at) in path.into_iter().enumerate() {
            let (x, y) = self.place(at);
            match k {
                0 => self.content.move_to(x, y),
                _ => self.content.line_to(x, y),
            };
        }
    }
}

fn rgb(colour: BackendColor) -> (f32, f32, f32) {
    let part = |x: u8| f32::from(x) / 255.0;
    let (r, g, b) = colour.rgb;
    (part(r), part(g), part(b))
}

fn seen(style: &impl BackendStyle) -> bool {
    style.color().alpha > 0.0
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Done {
        Ok(())
    }

    fn present(&mut self) -> Done {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Done {
        self.draw_rect(at, (at.0 + 1, at.1 + 1), &colour, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, a: BackendCoord, b: BackendCoord, style: &S) -> Done {
        self.draw_path([a, b], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Done {
        let corners = [a, (b.0, a.1), b, (a.0, b.1)];
        match fill {
            true => self.fill_polygon(corners, style),
            false => self.draw_path(corners.into_iter().chain([a]), style),
        }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done {
        if seen(style) {
            self.stroke_style(style);
            self.outline(path);
            self.content.stroke();
        }
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done {
        if seen(style) {
            self.fill_style(style);
            self.outline(path);
            self.content.close_path().fill_nonzero();
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Done {
        if !seen(style) {
            return Ok(());
        }
        let ((x, y), r) = (self.place(centre), radius as f32 * self.scale);
        let k = 0.552_285 * r; // a quarter of a circle as a Bezier curve
        match fill {
            true => self.fill_style(style),
            false => self.stroke_style(style),
        }
        self.content
            .move_to(x + r, y)
            .cubic_to(x + r, y + k, x + k, y + r, x, y + r)
            .cubic_to(x - k, y + r, x - r, y + k, x - r, y)
            .cubic_to(x - r, y - k, x - k, y - r, x, y - r)
            .cubic_to(x + k, y - r, x + r, y - k, x + r, y);
        match fill {
            true => self.content.fill_nonzero(),
            false => self.content.stroke(),
        };
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Done {
        let size = (style.size() / FONT_SCALE) as f32 * self.scale;
        let width = self.font.width(text, size);
        let along = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => -0.5 * width,
            HPos::Right => -width,
        };
        let across = match style.anchor().v_pos {
            VPos::Top => -0.76 * size,
            VPos::Center => -MIDDLE * size,
            VPos::Bottom => MIDDLE * size,
        };
        // the direction of writing on the page, where y points up
        let (c, s) = match style.transform() {
            FontTransform::None => (1.0, 0.0),
            FontTransform::Rotate90 => (0.0, -1.0),
            FontTransform::Rotate180 => (-1.0, 0.0),
            FontTransform::Rotate270 => (0.0, 1.0),
        };
        let (x, y) = self.place(at);
        let (x, y) = (x + c * along - s * across, y + s * along + c * across);
        let (r, g, b) = rgb(style.color());
        let bytes = self.font.encode(text);
        self.content
            .begin_text()
            .set_fill_rgb(r, g, b)
            .set_font(Name(b"F"), size)
            .set_text_matrix([c, s, -s, c, x, y])
            .show(Str(&bytes))
            .end_text();
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let size = (style.size() / FONT_SCALE) as f32;
        Ok((
            self.font.width(text, size).ceil() as u32,
            size.ceil() as u32,
        ))
    }
}
