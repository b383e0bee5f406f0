//! Lines, tables and pictures on pages of A4, from top to bottom.

use super::canvas::Canvas;
use super::font::Font;
use crate::error::Error;
use crate::report::chart::Picture;
use crate::report::document::Table;
use crate::report::palette::{Colour, GRID, INK, REFERENCE, SOFT};
use pdf_writer::types::TextRenderingMode;
use pdf_writer::{Content, Name, Str};

/// Width and height of A4, points.
pub(super) const PAGE: (f32, f32) = (595.28, 841.89);
pub(super) const MARGIN: f32 = 48.0;
const BOTTOM: f32 = 56.0;
const WIDTH: f32 = PAGE.0 - 2.0 * MARGIN;
/// Height of a line, in sizes of the font.
const LEADING: f32 = 1.36;
/// Between the columns of a table, points.
const GUTTER: f32 = 9.0;
const CELL: f32 = 7.6;

/// One page.
pub(super) struct Sheet {
    pub content: Content,
    /// Area of a link (left, bottom, right, top) and the part that it leads to.
    pub links: Vec<([f32; 4], usize)>,
}

/// A kind of text.
#[derive(Clone, Copy)]
pub(super) struct Style {
    pub size: f32,
    pub bold: bool,
    pub colour: Colour,
}

pub(super) const BODY: Style = Style {
    size: 9.6,
    bold: false,
    colour: INK,
};
pub(super) const BOLD: Style = Style { bold: true, ..BODY };
pub(super) const SMALL: Style = Style {
    size: 8.0,
    colour: SOFT,
    ..BODY
};

/// Pages that grow.
pub(super) struct Layout {
    pub font: Font,
    pub sheets: Vec<Sheet>,
    /// Height of the next line's top, points from below.
    pub y: f32,
}

impl Layout {
    pub fn new() -> Self {
        let mut layout = Self {
            font: Font::new(),
            sheets: vec![],
            y: 0.0,
        };
        layout.turn();
        layout
    }

    /// A new page.
    fn turn(&mut self) {
        self.sheets.push(Sheet {
            content: Content::new(),
            links: vec![],
        });
        self.y = PAGE.1 - MARGIN;
    }

    /// Room for so much, on this page or the next.
    pub fn room(&mut self, height: f32) {
        if self.y - height < BOTTOM && self.y < PAGE.1 - MARGIN {
            self.turn();
        }
    }

    pub fn gap(&mut self, height: f32) {
        self.y -= height;
    }

    fn sheet(&mut self) -> Option<&mut Sheet> {
        self.sheets.last_mut()
    }

    /// A piece of text whose base line is at `y`.
    fn write(&mut self, text: &str, style: Style, (x, y): (f32, f32)) {
        let bytes = self.font.encode(text);
        let (r, g, b) = style.colour.rgb();
        let [r, g, b] = [r, g, b].map(|part| f32::from(part) / 255.0);
        let Some(sheet) = self.sheets.last_mut() else {
            return;
        };
        let content = &mut sheet.content;
        content.begin_text().set_fill_rgb(r, g, b);
        content.set_text_rendering_mode(match style.bold {
            true => TextRenderingMode::FillStroke,
            false => TextRenderingMode::Fill,
        });
        if style.bold {
            content
                .set_stroke_rgb(r, g, b)
                .set_line_width(0.035 * style.size);
        }
        content
            .set_font(Name(b"F"), style.size)
            .set_text_matrix([1.0, 0.0, 0.0, 1.0, x, y])
            .show(Str(&bytes))
            .end_text();
    }

    /// The footer of a page that is complete.
    pub fn footer(&mut self, page: usize, left: &str, right: &str) {
        let Some(sheet) = self.sheets.get_mut(page) else {
            return;
        };
        let parts = [
            (left, MARGIN),
            (right, PAGE.0 - MARGIN - self.font.width(right, 7.5)),
        ];
        for (text, x) in parts {
            let bytes = self.font.encode(text);
            let (r, g, b) = SOFT.rgb();
            let [r, g, b] = [r, g, b].map(|part| f32::from(part) / 255.0);
            sheet
                .content
                .begin_text()
                .set_text_rendering_mode(TextRenderingMode::Fill)
                .set_fill_rgb(r, g, b)
                .set_font(Name(b"F"), 7.5)
                .set_text_matrix([1.0, 0.0, 0.0, 1.0, x, 30.0])
                .show(Str(&bytes))
                .end_text();
        }
    }

    /// A paragraph. `indent` is that of all its lines; the first has `mark` before it.
    pub fn paragraph(&mut self, text: &str, style: Style, indent: f32, mark: &str) {
        let height = style.size * LEADING;
        for (k, line) in self
            .broken(text, style.size, WIDTH - indent)
            .iter()
            .enumerate()
        {
            self.room(height);
            let base = self.y - style.size;
            if k == 0 && !mark.is_empty() {
                self.write(mark, style, (MARGIN, base));
            }
            self.write(line, style, (MARGIN + indent, base));
            self.y -= height;
        }
    }

    /// A line that leads to a part.
    pub fn link(&mut self, text: &str, style: Style, part: usize) {
        self.room(style.size * LEADING);
        let width = self.font.width(text, style.size);
        let (base, low) = (self.y - style.size, self.y - style.size * LEADING);
        self.write(text, style, (MARGIN, base));
        let area = [MARGIN, low, MARGIN + width, self.y];
        if let Some(sheet) = self.sheet() {
            sheet.links.push((area, part));
        }
        self.y = low;
    }

    /// A line across the page.
    fn rule(&mut self, colour: Colour) {
        let (r, g, b) = colour.rgb();
        let [r, g, b] = [r, g, b].map(|part| f32::from(part) / 255.0);
        let y = self.y;
        if let Some(sheet) = self.sheet() {
            sheet
                .content
                .set_stroke_rgb(r, g, b)
                .set_line_width(0.6)
                .move_to(MARGIN, y)
                .line_to(PAGE.0 - MARGIN, y)
                .stroke();
        }
    }

    /// A text in lines no wider than `width`.
    fn broken(&self, text: &str, size: f32, width: f32) -> Vec<String> {
        let mut lines = vec![];
        // a number stays with its per cent
        let text = text.replace(" %", "\u{a0}%");
        for paragraph in text.lines() {
            let mut line = String::new();
            for word in paragraph.split(' ') {
                let joint = if line.is_empty() { "" } else { " " };
                if self.font.width(&format!("{line}{joint}{word}"), size) <= width {
                    line = format!("{line}{joint}{word}");
                    continue;
                }
                if !line.is_empty() {
                    lines.push(std::mem::take(&mut line));
                }
                for c in word.chars() {
                    if self.font.width(&format!("{line}{c}"), size) > width && !line.is_empty() {
                        lines.push(std::mem::take(&mut line));
                    }
                    line.push(c);
                }
            }
            lines.push(line);
        }
        lines
    }

    /// A table; its head stands again on each page.
    pub fn table(&mut self, table: &Table) {
        let widths = self.widths(table);
        let head = Style {
            size: CELL,
            ..SMALL
        };
        let body = Style { size: CELL, ..BODY };
        if let Some(caption) = &table.caption {
            self.room(4.0 * CELL * LEADING);
            self.paragraph(caption, BOLD, 0.0, "");
            self.gap(2.0);
        }
        if !table.head.is_empty() {
            self.row(table, &table.head, &widths, head, REFERENCE);
        }
        for row in &table.rows {
            let lines = self.lines(row, &widths);
            let height = lines.iter().map(Vec::len).max().unwrap_or(1) as f32 * CELL * LEADING;
            if self.y - height < BOTTOM {
                self.turn();
                if !table.head.is_empty() {
                    self.row(table, &table.head, &widths, head, REFERENCE);
                }
            }
            self.row(table, row, &widths, body, GRID);
        }
        self.gap(6.0);
    }

    fn lines(&self, row: &[String], widths: &[f32]) -> Vec<Vec<String>> {
        let cells = row.iter().zip(widths);
        cells
            .map(|(cell, width)| self.broken(cell, CELL, width + 0.01))
            .collect()
    }

    fn row(&mut self, table: &Table, row: &[String], widths: &[f32], style: Style, below: Colour) {
        let lines = self.lines(row, widths);
        let height = lines.iter().map(Vec::len).max().unwrap_or(1) as f32 * CELL * LEADING;
        self.room(height + 2.0);
        let (top, mut x) = (self.y, MARGIN);
        for (k, (cell, width)) in lines.iter().zip(widths).enumerate() {
            for (n, line) in cell.iter().enumerate() {
                let free = width - self.font.width(line, CELL);
                let left = if table.is_text(k) { 0.0 } else { free };
                let base = top - CELL - n as f32 * CELL * LEADING;
                self.write(line, style, (x + left, base));
            }
            x += width + GUTTER;
        }
        self.y = top - height - 1.0;
        self.rule(below);
        self.y -= 1.5;
    }

    /// Widths of the columns: as wide as their texts, and narrower columns first where there is
    /// not enough room for all.
    fn widths(&self, table: &Table) -> Vec<f32> {
        let columns = table.rows.iter().map(Vec::len).max().unwrap_or(0);
        let columns = columns.max(table.head.len());
        let of = |k: usize| {
            let cells = table.rows.iter().chain([&table.head]);
            let cells = cells.filter_map(|row| row.get(k));
            let each = cells.map(|cell| self.font.width(cell, CELL));
            each.fold(4.0, f32::max)
        };
        let wanted: Vec<f32> = (0..columns).map(of).collect();
        let room = WIDTH - GUTTER * columns.saturating_sub(1) as f32;
        let mut most = room;
        for _ in 0..40 {
            let taken: f32 = wanted.iter().map(|w| w.min(most)).sum();
            if taken <= room {
                break;
            }
            most *= 0.9;
        }
        wanted.iter().map(|w| w.min(most)).collect()
    }

    /// A picture over the width of the page.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn picture(&mut self, name: &'static str, picture: &Picture) -> Result<(), Error> {
        let size = picture.units();
        let scale = WIDTH / size.0 as f32;
        let height = size.1 as f32 * scale;
        self.room(height + 2.0 * SMALL.size * LEADING);
        let at = (MARGIN, self.y);
        if let Some(sheet) = self.sheets.last_mut() {
            sheet
                .content
                .set_text_rendering_mode(TextRenderingMode::Fill);
            picture.draw_on(
                name,
                Canvas {
                    content: &mut sheet.content,
                    font: &mut self.font,
                    size,
                    at,
                    scale,
                },
            )?;
        }
        self.y -= height + 3.0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_broken_within_the_width_and_loses_nothing() {
        let layout = Layout::new();
        let text = format!("{} {}", "word ".repeat(60), "x".repeat(300));
        let lines = layout.broken(&text, 9.0, 200.0);
        assert!(
            lines
                .iter()
                .all(|line| layout.font.width(line, 9.0) <= 200.0)
        );
        let joined = lines.concat().replace(' ', "");
        assert_eq!(joined, text.replace(' ', ""));
    }

    #[test]
    fn a_long_table_goes_on_on_further_pages_and_a_wide_one_fits() {
        let mut layout = Layout::new();
        let row = || vec!["a name".to_owned(), "long ".repeat(60), "1.0".to_owned()];
        let table = Table {
            head: ["a", "b", "c"].map(String::from).to_vec(),
            rows: (0..80).map(|_| row()).collect(),
            text: 2,
            ..Table::default()
        };
        let widths = layout.widths(&table);
        assert!(
            widths.iter().sum::<f32>() + 2.0 * GUTTER <= WIDTH + 0.1,
            "{widths:?}"
        );
        layout.table(&table);
        assert!(layout.sheets.len() > 2 && layout.y > BOTTOM - 20.0);
    }
}
