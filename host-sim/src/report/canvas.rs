//! An anti-aliased bitmap as a drawing back end of plotters, and its PNG.
//!
//! Plotters' own bitmap fills wide lines as polygons without anti-aliasing, which shows badly on noisy curves. Here a
//! pixel's coverage is taken from its distance to the line, c = clamp(w/2 + 1/2 - d, 0, 1), joined over a whole path by the
//! largest, so joints are round and never drawn twice.

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
};
use std::convert::Infallible;
use std::ops::Range;

/// Drawing units a bitmap pixel: finer than a pixel, so that integer coordinates do not show as steps.
pub(super) const UNITS_PER_PIXEL: i32 = 2;

/// RGB picture, white at first.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    /// Red, green, blue; rows from the top.
    rgb: Vec<u8>,
    /// Coverage of the shape being drawn, 0..=255; all zero between shapes.
    mask: Vec<u8>,
    /// Part of `mask` that may be other than zero.
    columns: Range<usize>,
    rows: Range<usize>,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl Canvas {
    /// A white picture for a drawing of `size` units.
    pub fn new(size: (u32, u32)) -> Self {
        let pixels = |units: u32| units as usize / UNITS_PER_PIXEL as usize;
        let (width, height) = (pixels(size.0), pixels(size.1));
        let (rgb, mask) = (vec![255; 3 * width * height], vec![0; width * height]);
        Self {
            width,
            height,
            rgb,
            mask,
            columns: 0..0,
            rows: 0..0,
        }
    }

    /// The picture as a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::Fast);
        encoder.write_header()?.write_image_data(&self.rgb)?;
        Ok(file)
    }

    /// Whole pixels from `low` to `high`, kept within `limit`.
    fn span(low: f32, high: f32, limit: usize) -> Range<usize> {
        let clamp = |value: f32| value.clamp(0.0, limit as f32) as usize;
        clamp(low.floor())..clamp(high.ceil() + 1.0)
    }

    /// Marks a part of the mask as used and returns it.
    fn touch(&mut self, x: (f32, f32), y: (f32, f32)) -> (Range<usize>, Range<usize>) {
        let (columns, rows) = (
            Self::span(x.0, x.1, self.width),
            Self::span(y.0, y.1, self.height),
        );
        if !columns.is_empty() && !rows.is_empty() {
            self.columns = join(&self.columns, &columns);
            self.rows = join(&self.rows, &rows);
        }
        (columns, rows)
    }

    /// Adds the line from `a` to `b` of half width `half` to the mask, all in pixels.
    fn cover_line(&mut self, a: (f32, f32), b: (f32, f32), half: f32) {
        let reach = half + 1.0;
        let (columns, rows) = self.touch(
            (a.0.min(b.0) - reach, a.0.max(b.0) + reach),
            (a.1.min(b.1) - reach, a.1.max(b.1) + reach),
        );
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length2 = (dx * dx + dy * dy).max(f32::MIN_POSITIVE);
        for row in rows {
            let y = row as f32 + 0.5 - a.1;
            for column in columns.clone() {
                let x = column as f32 + 0.5 - a.0;
                let along = ((x * dx + y * dy) / length2).clamp(0.0, 1.0);
                let (ex, ey) = (x - along * dx, y - along * dy);
                let distance2 = ex * ex + ey * ey;
                if distance2 < reach * reach {
                    let coverage = (half + 0.5 - distance2.sqrt()).clamp(0.0, 1.0);
                    let cell = &mut self.mask[row * self.width + column];
                    *cell = (*cell).max((255.0 * coverage) as u8);
                }
            }
        }
    }

    /// Blends `colour` in through the mask and clears the mask.
    fn blend(&mut self, colour: BackendColor) {
        let paint = <[u8; 3]>::from(colour.rgb).map(f64::from);
        let columns = std::mem::take(&mut self.columns);
        for row in std::mem::take(&mut self.rows) {
            for column in columns.clone() {
                let at = row * self.width + column;
                let coverage = f64::from(std::mem::take(&mut self.mask[at])) / 255.0 * colour.alpha;
                if coverage > 0.0 {
                    for (part, paint) in self.rgb[3 * at..3 * at + 3].iter_mut().zip(paint) {
                        *part = (f64::from(*part) + coverage * (paint - f64::from(*part))).round()
                            as u8;
                    }
                }
            }
        }
    }
}

fn join(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    if a.is_empty() {
        b.clone()
    } else {
        a.start.min(b.start)..a.end.max(b.end)
    }
}

fn pixels(units: i32) -> f32 {
    units as f32 / UNITS_PER_PIXEL as f32
}

impl DrawingBackend for Canvas {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (
            (self.width * UNITS_PER_PIXEL as usize) as u32,
            (self.height * UNITS_PER_PIXEL as usize) as u32,
        )
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, point: BackendCoord, colour: BackendColor) -> Drawn {
        self.draw_rect(point, (point.0 + 1, point.1 + 1), &colour, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let half = style.stroke_width() as f32 / (2 * UNITS_PER_PIXEL) as f32;
        let mut previous = None;
        for (x, y) in path {
            let here = (pixels(x), pixels(y));
            self.cover_line(previous.unwrap_or(here), here, half);
            previous = Some(here);
        }
        self.blend(style.color());
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if !fill {
            return self.draw_path([a, (b.0, a.1), b, (a.0, b.1), a], style);
        }
        // Whole pixels are enough: filled rectangles are backgrounds here.
        let (columns, rows) = self.touch(
            (pixels(a.0), pixels(b.0) - 1.0),
            (pixels(a.1), pixels(b.1) - 1.0),
        );
        for row in rows {
            self.mask[row * self.width..][columns.clone()].fill(255);
        }
        self.blend(style.color());
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        if fill {
            let centre = (pixels(centre.0), pixels(centre.1));
            self.cover_line(centre, centre, radius as f32 / UNITS_PER_PIXEL as f32);
            self.blend(style.color());
            return Ok(());
        }
        let corner = |i: i32| {
            let (sin, cos) = (f64::from(i) / 32.0 * std::f64::consts::TAU).sin_cos();
            let radius = f64::from(radius);
            (
                centre.0 + (radius * cos).round() as i32,
                centre.1 + (radius * sin).round() as i32,
            )
        };
        self.draw_path((0..=32).map(corner), style)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let font_error = |error: S::FontError| DrawingErrorKind::FontError(Box::new(error));
        let ((left, _), (right, _)) = style.layout_box(text).map_err(font_error)?;
        let dx = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Right => left - right,
            HPos::Center => (left - right) / 2,
        };
        // Where the SVG back end puts the base line, in its own words 0.76em, 0.5ex and -0.5ex below the anchor; the glyphs
        // come with theirs at half the font size.
        let em = style.size() / 1.24;
        let base = match style.anchor().v_pos {
            VPos::Top => 0.76 * em,
            VPos::Center => 0.27 * em,
            VPos::Bottom => -0.27 * em,
        };
        let dy = (base - style.size() / 2.0).round() as i32;
        let turn = style.transform();
        // Glyphs come in drawing units; each adds its part of the pixel it falls in.
        let share = 255.0 / (UNITS_PER_PIXEL * UNITS_PER_PIXEL) as f32;
        style
            .draw(text, (0, 0), |x, y, part| {
                let (x, y) = turn.transform(x + dx - left, y + dy);
                let (x, y) = (
                    (at.0 + x).div_euclid(UNITS_PER_PIXEL),
                    (at.1 + y).div_euclid(UNITS_PER_PIXEL),
                );
                let here = (x as f32, y as f32);
                if (0..self.width as i32).contains(&x) && (0..self.height as i32).contains(&y) {
                    self.touch((here.0, here.0), (here.1, here.1));
                    let cell = &mut self.mask[y as usize * self.width + x as usize];
                    *cell = cell.saturating_add((share * part.alpha as f32).round() as u8);
                }
                Ok(())
            })
            .map_err(font_error)??;
        self.blend(style.color());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Pen(u32);
    impl BackendStyle for Pen {
        fn color(&self) -> BackendColor {
            BackendColor {
                alpha: 1.0,
                rgb: (0, 0, 0),
            }
        }
        fn stroke_width(&self) -> u32 {
            self.0
        }
    }

    /// How much black is on the picture, in pixels.
    fn black(canvas: &Canvas) -> f64 {
        canvas
            .rgb
            .iter()
            .step_by(3)
            .map(|&part| f64::from(255 - part) / 255.0)
            .sum()
    }

    #[test]
    fn a_line_covers_its_length_times_its_width_at_any_angle() {
        for (x, y) in [(300, 0), (0, 300), (180, 240), (240, -180)] {
            let mut canvas = Canvas::new((800, 800));
            canvas
                .draw_line((300, 300), (300 + x, 300 + y), &Pen(8))
                .unwrap();
            let expected = 150.0 * 4.0 + std::f64::consts::PI * 4.0; // 150 px long, 4 px wide, round ends of 2 px
            assert!(
                (black(&canvas) / expected - 1.0).abs() < 0.02,
                "{x},{y}: {} of {expected}",
                black(&canvas)
            );
        }
    }

    #[test]
    fn a_joint_is_not_drawn_twice_and_the_mask_is_left_clean() {
        let half = |colour: f64| BackendColor {
            alpha: colour,
            rgb: (0, 0, 0),
        };
        let mut canvas = Canvas::new((100, 100));
        canvas
            .draw_path(
                [(10, 50), (50, 50), (50, 50), (90, 50), (10, 50)],
                &half(0.5),
            )
            .unwrap();
        assert!(canvas.rgb.iter().all(|&part| part >= 127));
        assert!(canvas.mask.iter().all(|&cell| cell == 0));
    }

    #[test]
    fn circles_and_rectangles_have_their_area() {
        let mut canvas = Canvas::new((200, 200));
        canvas.draw_circle((100, 100), 40, &Pen(1), true).unwrap();
        assert!((black(&canvas) / (std::f64::consts::PI * 400.0) - 1.0).abs() < 0.02);
        let mut canvas = Canvas::new((200, 200));
        canvas
            .draw_rect((20, 40), (60, 100), &Pen(1), true)
            .unwrap();
        assert!((black(&canvas) - 20.0 * 30.0).abs() < 1e-9);
    }

    #[test]
    fn text_stands_around_its_anchor() {
        use plotters::style::{IntoFont, TextStyle};
        use plotters_backend::text_anchor::Pos;
        super::super::sheet::register_fonts();
        let mut canvas = Canvas::new((400, 400));
        let style = TextStyle::from(("sans-serif", 60.0).into_font())
            .pos(Pos::new(HPos::Center, VPos::Center));
        canvas.draw_text("xxxx", &style, (200, 200)).unwrap();
        let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
        for (at, pixel) in canvas.rgb.chunks_exact(3).enumerate() {
            let weight = f64::from(255 - pixel[0]);
            (x, y, total) = (
                x + weight * (at % 200) as f64,
                y + weight * (at / 200) as f64,
                total + weight,
            );
        }
        assert!(
            total > 0.0 && (x / total - 100.0).abs() < 2.0 && (y / total - 100.0).abs() < 2.0,
            "{x} {y} {total}"
        );
    }

    #[test]
    fn shapes_beyond_the_edge_are_cut_off() {
        let mut canvas = Canvas::new((100, 100));
        canvas.draw_line((-1000, 50), (1000, 50), &Pen(4)).unwrap();
        canvas
            .draw_circle((5000, -5000), 10, &Pen(4), true)
            .unwrap();
        canvas
            .draw_rect((90, 90), (500, 500), &Pen(1), true)
            .unwrap();
        assert!(
            (black(&canvas) - (50.0 * 2.0 + 25.0)).abs() < 1.0,
            "{}",
            black(&canvas)
        );
    }

    #[test]
    fn the_png_reads_back_to_the_same_pixels() {
        let mut canvas = Canvas::new((64, 48));
        canvas.draw_line((3, 5), (60, 40), &Pen(5)).unwrap();
        let file = canvas.png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (32, 24));
        assert_eq!(pixels, canvas.rgb);
    }
}
