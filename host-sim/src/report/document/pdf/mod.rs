//! A report as a PDF: A4, searchable text in an embedded font, pictures as vectors,
//! a table of contents with links, and numbers of pages.

mod canvas;
mod font;
mod layout;

use super::{Document, Part};
use crate::error::Error;
use crate::report::palette::RNN;
use font::packed;
use layout::{BODY, BOLD, Layout, MARGIN, PAGE, SMALL, Style};
use pdf_writer::types::{ActionType, AnnotationType};
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
    layout.paragraph(&document.title, Style { size: 17.0, ..BOLD }, 0.0, "");
    layout.gap(2.0);
    if let Some(date) = &document.date {
        layout.paragraph(date, SMALL, 0.0, "");
    }
    layout.gap(6.0);
    for (k, sentence) in document.verdict.iter().enumerate() {
        layout.paragraph(sentence, if k == 0 { BOLD } else { BODY }, 0.0, "");
        layout.gap(2.0);
    }
    layout.gap(8.0);
    layout.paragraph("Contents", BOLD, 0.0, "");
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
        put(&mut layout, part)?;
    }
    let pages = layout.sheets.len();
    for page in 0..pages {
        let number = format!("page {} of {pages}", page + 1);
        layout.footer(page, &document.title, &number);
    }
    Ok(written(document, layout, &places))
}

fn put(layout: &mut Layout, part: &Part) -> Result<(), Error> {
    layout.paragraph(&part.title, Style { size: 12.5, ..BOLD }, 0.0, "");
    layout.gap(3.0);
    if let Some(why) = &part.left_out {
        layout.paragraph(&format!("Left out: {why}"), BODY, 0.0, "");
    }
    for sentence in &part.sentences {
        layout.paragraph(sentence, BODY, 11.0, "\u{b7}");
        layout.gap(1.5);
    }
    layout.gap(4.0);
    for table in &part.tables {
        layout.table(table);
    }
    for figure in &part.figures {
        layout.picture(figure.name, &figure.picture)?;
        let caption = format!("{}. {}", figure.title, figure.caption);
        layout.paragraph(&caption, SMALL, 0.0, "");
        layout.gap(8.0);
    }
    for command in &part.commands {
        layout.paragraph(command, Style { size: 8.0, ..BODY }, 11.0, "$");
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
    let [catalog, tree, outline, info, font] = std::array::from_fn(|_| next());
    let pages: Vec<[Ref; 2]> = layout.sheets.iter().map(|_| [next(), next()]).collect();
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(tree).outlines(outline).lang(TextStr("en"));
    root.viewer_preferences().display_doc_title(true);
    root.finish();
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
    for (sheet, [page, content]) in layout.sheets.into_iter().zip(&pages) {
        let links: Vec<Ref> = sheet.links.iter().map(|_| next()).collect();
        let mut of = pdf.page(*page);
        of.parent(tree)
            .media_box(Rect::new(0.0, 0.0, PAGE.0, PAGE.1))
            .contents(*content);
        if !links.is_empty() {
            of.annotations(links.iter().copied());
        }
        of.resources().fonts().pair(Name(b"F"), font);
        of.finish();
        for ([left, low, right, high], (id, part)) in sheet
            .links
            .iter()
            .map(|(area, part)| (*area, *part))
            .zip(&links)
            .map(|((area, part), id)| (area, (*id, part)))
        {
            let mut link = pdf.annotation(id);
            link.subtype(AnnotationType::Link)
                .rect(Rect::new(left, low, right, high))
                .border(0.0, 0.0, 0.0, None);
            let (page, y) = target(part);
            link.action()
                .action_type(ActionType::GoTo)
                .destination()
                .page(page)
                .xyz(MARGIN, y, None);
        }
        let bytes = packed(&sheet.content.finish());
        pdf.stream(*content, &bytes).filter(Filter::FlateDecode);
    }
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
