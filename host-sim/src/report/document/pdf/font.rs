//! The font of the PDF: the one that the plots use, embedded whole.

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeMap;
use std::io::Write;
use ttf_parser::{Face, GlyphId};

/// The file of the font.
const FILE: &[u8] = include_bytes!("../../../../assets/DejaVuSans-subset.ttf");
/// Name of the font within the PDF.
const NAME: Name<'_> = Name(b"DejaVuSans");
/// Character that stands for one that the font does not have.
const UNKNOWN: char = '?';

/// Widths and glyphs of the font.
pub(super) struct Font {
    face: Option<Face<'static>>,
    /// Characters of the document by their glyphs.
    used: BTreeMap<u16, char>,
}

impl Font {
    pub fn new() -> Self {
        Self {
            face: Face::parse(FILE, 0).ok(),
            used: BTreeMap::new(),
        }
    }

    fn glyph(&self, c: char) -> u16 {
        let of = |c| self.face.as_ref()?.glyph_index(c);
        of(c)
            .or_else(|| of(plain(c)))
            .or_else(|| of(UNKNOWN))
            .map_or(0, |id| id.0)
    }

    /// Width of a glyph in thousandths of the size.
    fn advance(&self, glyph: u16) -> f32 {
        let face = self.face.as_ref();
        let width = face.and_then(|face| {
            let units = f32::from(face.units_per_em());
            Some(f32::from(face.glyph_hor_advance(GlyphId(glyph))?) * 1000.0 / units)
        });
        width.unwrap_or(600.0)
    }

    /// Width of a text, in the unit of `size`.
    pub fn width(&self, text: &str, size: f32) -> f32 {
        let each = text.chars().map(|c| self.advance(self.glyph(c)));
        each.sum::<f32>() * size / 1000.0
    }

    /// The bytes that show a text.
    pub fn encode(&mut self, text: &str) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(2 * text.len());
        for c in text.chars() {
            let glyph = self.glyph(c);
            self.used.entry(glyph).or_insert(c);
            bytes.extend(glyph.to_be_bytes());
        }
        bytes
    }

    /// Writes the font; `next` gives the numbers of objects.
    pub fn write(&self, pdf: &mut Pdf, id: Ref, next: &mut impl FnMut() -> Ref) {
        let [cid, descriptor, file, cmap] = [next(), next(), next(), next()];
        let system = SystemInfo {
            registry: Str(b"Adobe"),
            ordering: Str(b"Identity"),
            supplement: 0,
        };
        pdf.type0_font(id)
            .base_font(NAME)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(cid)
            .to_unicode(cmap);
        let mut font = pdf.cid_font(cid);
        font.subtype(CidFontType::Type2)
            .base_font(NAME)
            .system_info(system)
            .font_descriptor(descriptor)
            .default_width(0.0)
            .cid_to_gid_map_predefined(Name(b"Identity"));
        let mut widths = font.widths();
        for glyph in self.used.keys() {
            widths.consecutive(*glyph, [self.advance(*glyph)]);
        }
        widths.finish();
        font.finish();
        self.describe(pdf, descriptor, file);
        let mut unicode = UnicodeCmap::new(Name(b"Custom"), system);
        for (glyph, c) in &self.used {
            unicode.pair(*glyph, *c);
        }
        pdf.cmap(cmap, &unicode.finish());
        let packed = packed(FILE);
        let mut stream = pdf.stream(file, &packed);
        stream.filter(Filter::FlateDecode);
        stream.pair(Name(b"Length1"), FILE.len() as i32);
    }

    fn describe(&self, pdf: &mut Pdf, id: Ref, file: Ref) {
        let mut of = pdf.font_descriptor(id);
        of.name(NAME)
            .flags(FontFlags::SYMBOLIC)
            .italic_angle(0.0)
            .stem_v(80.0)
            .font_file2(file);
        if let Some(face) = &self.face {
            let scale = 1000.0 / f32::from(face.units_per_em());
            let to = |x: i16| f32::from(x) * scale;
            let all = face.global_bounding_box();
            of.bbox(Rect::new(
                to(all.x_min),
                to(all.y_min),
                to(all.x_max),
                to(all.y_max),
            ))
            .ascent(to(face.ascender()))
            .descent(to(face.descender()))
            .cap_height(to(face.capital_height().unwrap_or(face.ascender())));
        }
    }
}

/// A character that the font may have in its place.
fn plain(c: char) -> char {
    match c {
        '\u{2011}' | '\u{2010}' | '\u{2013}' | '\u{2212}' => '-',
        '\u{a0}' | '\u{202f}' => ' ',
        '\u{2018}' | '\u{2019}' => '\'',
        '\u{201c}' | '\u{201d}' => '"',
        '\u{2605}' => '*',
        _ => c,
    }
}

/// Bytes in the form of PDF's `FlateDecode`.
pub(super) fn packed(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let written = encoder.write_all(bytes);
    // a vector takes all bytes
    written.and_then(|()| encoder.finish()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_character_that_the_font_lacks_has_another_in_its_place() {
        let mut font = Font::new();
        assert_eq!(font.encode("a\u{4e2d}"), font.encode("a?"));
        assert_eq!(font.encode("a").len(), 2);
        assert!(font.encode("?") != font.encode("a"));
        // DejaVu Sans: "m" is 1995 of 2048 units wide, "i" 569
        assert!((font.width("m", 2048.0) - 1995.0).abs() < 1.0);
        assert!((font.width("mi", 2048.0) - 2564.0).abs() < 1.0);
    }
}
