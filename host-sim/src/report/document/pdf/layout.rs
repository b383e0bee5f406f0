//! Lines, tables and pictures on pages of A4, from top to bottom.

use super::canvas::Canvas;
use super::font::Font;
use super::tags::{self, Tags};
use crate::error::Error;
use crate::report::chart::Picture;
use crate::report::document::Table;
use crate::report::palette::{Colour, GRID, INK, REFERENCE, SOFT};
use pdf_writer::types::{StructRole, TextRenderingMode};
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
    /// Area of a link (left, bottom, right, top), the part that it leads to, and its element.
    pub links: Vec<([f32; 4], usize, usize)>,
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
    pub tags: Tags,
    pub sheets: Vec<Sheet>,
    /// Height of the next line's top, points from below.
    pub y: f32,
}

impl Layout {
    pub fn new() -> Self {
        let mut layout = Self {
            font: Font::new(),
            tags: Tags::new(),
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
    fn write(&mut self, text: &str, style: Style, at: (f32, f32)) {
        let page = self.sheets.len().saturating_sub(1);
        if let Some(sheet) = self.sheets.last_mut() {
            self.tags.begin(page, &mut sheet.content);
        }
        self.show(text, style, at);
    }

    /// The same of what is no content of the document.
    fn decorate(&mut self, text: &str, style: Style, at: (f32, f32)) {
        if let Some(sheet) = self.sheets.last_mut() {
            tags::artifact(&mut sheet.content);
        }
        self.show(text, style, at);
    }

    /// Shows a piece of text, and ends the mark before it.
    fn show(&mut self, text: &str, style: Style, (x, y): (f32, f32)) {
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
            .end_text()
            .end_marked_content();
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
            tags::artifact(&mut sheet.content);
            sheet
                .content
                .begin_text()
                .set_text_rendering_mode(TextRenderingMode::Fill)
                .set_fill_rgb(r, g, b)
                .set_font(Name(b"F"), 7.5)
                .set_text_matrix([1.0, 0.0, 0.0, 1.0, x, 30.0])
                .show(Str(&bytes))
                .end_text()
                .end_marked_content();
        }
    }

    /// A paragraph that is an element of this role.
    pub fn element(&mut self, role: StructRole, text: &str, style: Style) {
        self.tags.open(role, None);
        self.paragraph(text, style, 0.0, "");
        self.tags.close();
    }

    /// An item of a list, or a command.
    pub fn item(&mut self, role: StructRole, text: &str, style: Style, mark: &str) {
        self.tags.open(role, None);
        if matches!(role, StructRole::LI) {
            self.tags.open(StructRole::LBody, None);
        }
        self.paragraph(text, style, 11.0, mark);
        if matches!(role, StructRole::LI) {
            self.tags.close();
        }
        self.tags.close();
    }

    /// A paragraph. `indent` is that of all its lines; the first has `mark` before it.
    fn paragraph(&mut self, text: &str, style: Style, indent: f32, mark: &str) {
        let height = style.size * LEADING;
        for (k, line) in self
            .broken(text, style.size, WIDTH - indent)
            .iter()
            .enumerate()
        {
            self.room(height);
            let base = self.y - style.size;
            if k == 0 && !mark.is_empty() {
                self.decorate(mark, style, (MARGIN, base));
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
        self.tags.open(StructRole::P, None);
        let element = self.tags.open(StructRole::Link, Some(text));
        self.write(text, style, (MARGIN, base));
        self.tags.close();
        self.tags.close();
        let area = [MARGIN, low, MARGIN + width, self.y];
        if let Some(sheet) = self.sheet() {
            sheet.links.push((area, part, element));
        }
        self.y = low;
    }

    /// A line across the page.
    fn rule(&mut self, colour: Colour) {
        let (r, g, b) = colour.rgb();
        let [r, g, b] = [r, g, b].map(|part| f32::from(part) / 255.0);
        let y = self.y;
        if let Some(sheet) = self.sheet() {
            tags::artifact(&mut sheet.content);
            sheet
                .content
                .set_stroke_rgb(r, g, b)
                .set_line_width(0.6)
                .move_to(MARGIN, y)
                .line_to(PAGE.0 - MARGIN, y)
                .stroke()
                .end_marked_content();
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
        self.tags.open(StructRole::Table, None);
        if let Some(caption) = &table.caption {
            self.room(4.0 * CELL * LEADING);
            self.element(StructRole::Caption, caption, BOLD);
            self.gap(2.0);
        }
        if !table.head.is_empty() {
            self.row(
                table,
                &table.head,
                &widths,
                (head, REFERENCE),
                Some(StructRole::TH),
            );
        }
        for row in &table.rows {
            let lines = self.lines(row, &widths);
            let height = lines.iter().map(Vec::len).max().unwrap_or(1) as f32 * CELL * LEADING;
            if self.y - height < BOTTOM {
                self.turn();
                if !table.head.is_empty() {
                    self.row(table, &table.head, &widths, (head, REFERENCE), None);
                }
            }
            self.row(table, row, &widths, (body, GRID), Some(StructRole::TD));
        }
        self.tags.close();
        self.gap(6.0);
    }

    fn lines(&self, row: &[String], widths: &[f32]) -> Vec<Vec<String>> {
        let cells = row.iter().zip(widths);
        cells
            .map(|(cell, width)| self.broken(cell, CELL, width + 0.01))
            .collect()
    }

    /// A row. `cell`: what its cells are; `None` for a head that stands there again.
    fn row(
        &mut self,
        table: &Table,
        row: &[String],
        widths: &[f32],
        (style, below): (Style, Colour),
        cell: Option<StructRole>,
    ) {
        let lines = self.lines(row, widths);
        let height = lines.iter().map(Vec::len).max().unwrap_or(1) as f32 * CELL * LEADING;
        self.room(height + 2.0);
        let (top, mut x) = (self.y, MARGIN);
        if cell.is_some() {
            self.tags.open(StructRole::TR, None);
        }
        for (k, (lines, width)) in lines.iter().zip(widths).enumerate() {
            if let Some(role) = cell {
                self.tags.open(role, None);
            }
            for (n, line) in lines.iter().enumerate() {
                let free = width - self.font.width(line, CELL);
                let left = if table.is_text(k) { 0.0 } else { free };
                let at = (x + left, top - CELL - n as f32 * CELL * LEADING);
                match cell {
                    Some(_) => self.write(line, style, at),
                    None => self.decorate(line, style, at),
                }
            }
            if cell.is_some() {
                self.tags.close();
            }
            x += width + GUTTER;
        }
        if cell.is_some() {
            self.tags.close();
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

    /// A picture over the width of the page; `words` stand for it where it is not seen.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn picture(
        &mut self,
        name: &'static str,
        picture: &Picture,
        words: &str,
    ) -> Result<(), Error> {
        let size = picture.units();
        let scale = WIDTH / size.0 as f32;
        let height = size.1 as f32 * scale;
        self.room(height + 2.0 * SMALL.size * LEADING);
        let at = (MARGIN, self.y);
        let page = self.sheets.len().saturating_sub(1);
        self.tags.open(StructRole::Figure, Some(words));
        if let Some(sheet) = self.sheets.last_mut() {
            self.tags.begin(page, &mut sheet.content);
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
            sheet.content.end_marked_content();
        }
        self.tags.close();
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
