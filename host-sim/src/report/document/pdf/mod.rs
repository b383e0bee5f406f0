//! A report as a PDF: A4, searchable text in an embedded font, pictures as vectors,
//! a table of contents with links, numbers of pages, and tags that say what each piece is.

mod canvas;
mod font;
mod layout;
mod tags;

use super::{Document, Part};
use crate::error::Error;
use crate::report::palette::RNN;
use font::packed;
use layout::{BODY, BOLD, Layout, MARGIN, PAGE, SMALL, Style};
use pdf_writer::types::{ActionType, AnnotationType, StructRole, TabOrder};
use pdf_writer::writers::StructTreeRoot;
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, TextStr};

/// The program that makes the file.
const MAKER: &str = concat!("host-sim ", env!("CARGO_PKG_VERSION"));

/// Where a part begins: page, and height on it.
type Place = (usize, f32);

/// The file of a document.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn pdf(document: &Document) -> Result<Vec<u8>, Error> {
    let mut layout = Layout::new();
    layout.element(
        StructRole::H1,
        &document.title,
        Style { size: 17.0, ..BOLD },
    );
    layout.gap(2.0);
    if let Some(date) = &document.date {
        layout.element(StructRole::P, date, SMALL);
    }
    layout.gap(6.0);
    for (k, sentence) in document.verdict.iter().enumerate() {
        layout.element(StructRole::P, sentence, if k == 0 { BOLD } else { BODY });
        layout.gap(2.0);
    }
    layout.gap(8.0);
    layout.element(StructRole::P, "Contents", BOLD);
    for (k, part) in document.parts.iter().enumerate() {
        let style = Style {
            colour: RNN,
            ..BODY
        };
        layout.link(&part.title, style, k);
    }
    let mut places = vec![];
    for part in &document.parts {
        layout.gap(14.0);
        layout.room(70.0);
        places.push((layout.sheets.len() - 1, layout.y));
        layout.tags.open(StructRole::Sect, None);
        put(&mut layout, part)?;
        layout.tags.close();
    }
    let pages = layout.sheets.len();
    for page in 0..pages {
        let number = format!("page {} of {pages}", page + 1);
        layout.footer(page, &document.title, &number);
    }
    Ok(written(document, layout, &places))
}

fn put(layout: &mut Layout, part: &Part) -> Result<(), Error> {
    layout.element(StructRole::H2, &part.title, Style { size: 12.5, ..BOLD });
    layout.gap(3.0);
    if let Some(why) = &part.left_out {
        layout.element(StructRole::P, &format!("Left out: {why}"), BODY);
    }
    if !part.sentences.is_empty() {
        layout.tags.open(StructRole::L, None);
        for sentence in &part.sentences {
            layout.item(StructRole::LI, sentence, BODY, "\u{b7}");
            layout.gap(1.5);
        }
        layout.tags.close();
    }
    layout.gap(4.0);
    for table in &part.tables {
        layout.table(table);
    }
    for figure in &part.figures {
        let caption = format!("{}. {}", figure.title, figure.caption);
        layout.picture(figure.name, &figure.picture, &caption)?;
        layout.element(StructRole::Caption, &caption, SMALL);
        layout.gap(8.0);
    }
    for command in &part.commands {
        layout.item(StructRole::Code, command, Style { size: 8.0, ..BODY }, "$");
    }
    Ok(())
}

/// The objects of the file.
fn written(document: &Document, layout: Layout, places: &[Place]) -> Vec<u8> {
    let mut number = 0;
    let mut next = || {
        number += 1;
        Ref::new(number)
    };
    let [catalog, tree, outline, info, font, root, parents] = std::array::from_fn(|_| next());
    let pages: Vec<[Ref; 2]> = layout.sheets.iter().map(|_| [next(), next()]).collect();
    let mut pdf = Pdf::new();
    let mut of = pdf.catalog(catalog);
    of.pages(tree).outlines(outline).lang(TextStr("en"));
    of.pair(Name(b"StructTreeRoot"), root);
    of.mark_info().marked(true);
    of.viewer_preferences().display_doc_title(true);
    of.finish();
    pdf.document_info(info)
        .title(TextStr(&document.title))
        .subject(TextStr(document.subject))
        .creator(TextStr(MAKER))
        .producer(TextStr("pdf-writer"));
    let kids = pages.iter().map(|[page, _]| *page);
    pdf.pages(tree).kids(kids).count(pages.len() as i32);
    let target = |part: usize| {
        let (page, y) = places.get(part).copied().unwrap_or((0, PAGE.1));
        (pages[page.min(pages.len() - 1)][0], y + 6.0)
    };
    outlines(&mut pdf, outline, document, &target, &mut next);
    layout.font.write(&mut pdf, font, &mut next);
    let (tags, mut linked) = (layout.tags, vec![]);
    let count = pages.len();
    for (number, (sheet, [page, content])) in layout.sheets.into_iter().zip(&pages).enumerate() {
        let links: Vec<Ref> = sheet.links.iter().map(|_| next()).collect();
        let mut of = pdf.page(*page);
        of.parent(tree)
            .media_box(Rect::new(0.0, 0.0, PAGE.0, PAGE.1))
            .struct_parents(number as i32)
            .tab_order(TabOrder::StructureOrder)
            .contents(*content);
        if !links.is_empty() {
            of.annotations(links.iter().copied());
        }
        of.resources().fonts().pair(Name(b"F"), font);
        of.finish();
        for (([left, low, right, high], part, element), id) in sheet.links.iter().zip(links) {
            let (left, low, right, high, part) = (*left, *low, *right, *high, *part);
            let title = document.parts.get(part).map_or("", |part| &part.title);
            let mut link = pdf.annotation(id);
            link.subtype(AnnotationType::Link)
                .struct_parent(tags::key(count, linked.len()))
                .contents(TextStr(title))
                .rect(Rect::new(left, low, right, high))
                .border(0.0, 0.0, 0.0, None);
            let (to, y) = target(part);
            link.action()
                .action_type(ActionType::GoTo)
                .destination()
                .page(to)
                .xyz(MARGIN, y, None);
            linked.push((*element, *page, id));
        }
        let bytes = packed(&sheet.content.finish());
        pdf.stream(*content, &bytes).filter(Filter::FlateDecode);
    }
    let pages: Vec<Ref> = pages.iter().map(|[page, _]| *page).collect();
    let whole = tags.write(&mut pdf, (root, parents), &pages, &linked, &mut next);
    let mut of = pdf.indirect(root).start::<StructTreeRoot<'_>>();
    of.child(whole);
    of.pair(Name(b"ParentTree"), parents);
    of.parent_tree_next_key(tags::key(count, linked.len()));
    of.finish();
    pdf.finish()
}

/// The table of contents beside the pages.
fn outlines(
    pdf: &mut Pdf,
    outline: Ref,
    document: &Document,
    target: &impl Fn(usize) -> (Ref, f32),
    next: &mut impl FnMut() -> Ref,
) {
    let items: Vec<Ref> = document.parts.iter().map(|_| next()).collect();
    let (Some(first), Some(last)) = (items.first(), items.last()) else {
        return;
    };
    pdf.outline(outline)
        .first(*first)
        .last(*last)
        .count(items.len() as i32);
    for (k, (part, id)) in document.parts.iter().zip(&items).enumerate() {
        let mut item = pdf.outline_item(*id);
        item.title(TextStr(&part.title)).parent(outline);
        if let Some(before) = k.checked_sub(1).and_then(|k| items.get(k)) {
            item.prev(*before);
        }
        if let Some(after) = items.get(k + 1) {
            item.next(*after);
        }
        let (page, y) = target(k);
        item.dest().page(page).xyz(MARGIN, y, None);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Figure, Table};
    use super::*;
    use crate::report::figures;
    use crate::report::sample;
    use flate2::read::ZlibDecoder;
    use std::io::Read;

    fn document() -> Document {
        let part = |rows: usize| Part {
            sentences: vec!["One.".into(), "Two.".into()],
            tables: vec![Table {
                head: vec!["name".into(), "value".into()],
                rows: (0..rows)
                    .map(|k| vec!["row".into(), k.to_string()])
                    .collect(),
                text: 1,
                ..Table::default()
            }],
            figures: vec![Figure {
                name: "error",
                title: "Errors".into(),
                caption: "What it shows.".into(),
                picture: figures::Figure::Error.picture(&sample::report().curves),
                narrow: None,
            }],
            commands: vec!["host-sim report".into()],
            ..Part::new("part", "A part")
        };
        Document {
            title: "A title".into(),
            verdict: vec!["Verdict: good.".into()],
            parts: vec![part(3), part(90)],
            ..Document::default()
        }
    }

    fn count(bytes: &[u8], part: &str) -> usize {
        bytes
            .windows(part.len())
            .filter(|w| *w == part.as_bytes())
            .count()
    }

    /// The content of all pages.
    fn content(file: &[u8]) -> Vec<u8> {
        let mut all = vec![];
        let starts = file
            .windows(7)
            .enumerate()
            .filter(|(_, w)| *w == b"stream\n");
        for (at, _) in starts {
            let mut text = vec![];
            // the font is no text, and "endstream" begins no stream
            if ZlibDecoder::new(&file[at + 7..])
                .read_to_end(&mut text)
                .is_ok()
                && count(&text, " Tf") > 0
            {
                all.extend(text);
                all.push(b'\n'); // a page does not end with a line
            }
        }
        all
    }

    #[test]
    fn each_piece_is_tagged_or_marked_as_no_content() {
        let file = pdf(&document()).unwrap();
        let content = content(&file);
        let [begun, artifacts, ended] = [" BDC", " BMC", "EMC"].map(|op| count(&content, op));
        assert!(begun > 200 && artifacts > 90, "{begun} {artifacts}");
        assert_eq!(begun + artifacts, ended);
        // as many as the elements refer to, and nothing is shown outside
        assert_eq!(count(&file, "/Type /MCR"), begun);
        let pieces = content
            .split(|byte| *byte == b'\n')
            .fold((0, 0), |(open, lost), line| {
                let of = |op: &str| line.ends_with(op.as_bytes());
                let open = open + i32::from(of(" BDC") || of(" BMC")) - i32::from(of("EMC"));
                (open, lost + i32::from(of(" Tj") && open != 1))
            });
        assert_eq!(pieces, (0, 0));
    }

    #[test]
    fn the_structure_tells_headings_lists_tables_and_pictures() {
        let file = pdf(&document()).unwrap();
        let of = |role: &str| count(&file, &format!("/S /{role}\n"));
        assert_eq!(
            [
                of("H1"),
                of("H2"),
                of("L"),
                of("LI"),
                of("Figure"),
                of("Link")
            ],
            [1, 2, 2, 4, 2, 2]
        );
        // a head that stands on a second page again is no row
        assert_eq!([of("Table"), of("TH"), of("TR"), of("TD")], [2, 4, 95, 186]);
        assert_eq!(count(&file, "/Alt (Errors. What it shows.)"), 2);
        assert_eq!(count(&file, "/Type /OBJR"), 2);
        for part in [
            "/Marked true",
            "/Lang (en)",
            "/ParentTree ",
            "/Scope /Column",
        ] {
            assert!(count(&file, part) > 0, "{part}");
        }
    }
}
