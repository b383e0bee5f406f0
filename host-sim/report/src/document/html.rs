//! The page: one file with its style, its pictures and their script inside. It fetches nothing.
//!
//! The page is readable without the script, which adds zooming and reading of values.

use super::{Document, Figure, Part, Table};
use crate::front;
use crate::html::{fold, frame, sentences};
use crate::text::{prose, unbroken};
use host_chart::picture::Picture;
use host_core::error::Error;
use maud::{Markup, PreEscaped, html};

/// The whole page.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn page(document: &Document) -> Result<String, Error> {
    let parts = document.parts.iter().map(part);
    let parts = parts.collect::<Result<Vec<Markup>, Error>>()?;
    let said = document.verdict.split_first();
    let (sentence, more) = said.map_or(("", &[][..]), |(first, more)| (first, more));
    let opening = match &document.front {
        Some(front) => front.markup(sentence)?,
        None => front::said(sentence),
    };
    let mut figures = document.parts.iter().flat_map(|part| &part.figures);
    let body = html! {
        (opening)
        @if let Some(date) = &document.date { p.sub { (date) } }
        @if !more.is_empty() { (fold("All findings in words", &sentences(more))) }
        @if !document.beside.is_empty() {
            p.sub {
                @for (k, (file, words)) in document.beside.iter().enumerate() {
                    @if k > 0 { ", " }
                    a href=(file) { (words) }
                }
            }
        }
        nav {
            ul {
                @for part in &document.parts {
                    li { a href={ "#" (part.id) } { (part.title) } }
                }
            }
        }
        @for part in parts { (part) }
        style { (PreEscaped(include_str!("document.css"))) }
        @if figures.any(|figure| figure.picture.has_scales()) {
            script { (PreEscaped(include_str!("plots.js"))) }
        }
    };
    Ok(frame(&document.title, &body).into_string())
}

fn part(part: &Part) -> Result<Markup, Error> {
    let figures = part.figures.iter().map(figure);
    let figures = figures.collect::<Result<Vec<Markup>, Error>>()?;
    let body = html! {
        @if let Some(why) = &part.left_out { p.sub { "Left out: " (prose(why)) } }
        @match part.sentences.as_slice() {
            [] => {}
            [only] => p { (prose(only)) }
            all => ul.said { @for sentence in all { li { (prose(sentence)) } } }
        }
        @if !part.explained.is_empty() {
            details.explained {
                summary { "Explanations" }
                ul.said { @for sentence in &part.explained { li { (prose(sentence)) } } }
            }
        }
        @for t in &part.tables { (table(t)) }
        @for figure in figures { (figure) }
        @for command in &part.commands { pre { (command) } }
    };
    Ok(html! {
        section.part id=(part.id) {
            @if part.folded { (fold(&part.title, &body)) } @else { h2 { (part.title) } (body) }
        }
    })
}

/// A text in a cell that is longer gets more room on a telephone.
const LONG: usize = 80;

fn table(table: &Table) -> Markup {
    let text = |column: usize| table.is_text(column);
    let meaning = |row: usize| table.meanings.get(row)?.as_deref();
    html! {
        div.wide {
            table.figures[!table.head.is_empty()].pairs[table.head.is_empty()] {
                @if let Some(caption) = &table.caption { caption { span { (caption) } } }
                @if !table.head.is_empty() {
                    thead {
                        tr {
                            @for (k, name) in table.head.iter().enumerate() {
                                th.text[text(k)] { (name) }
                            }
                        }
                    }
                }
                tbody {
                    @for (line, row) in table.rows.iter().enumerate() {
                        tr {
                            @for (k, cell) in row.iter().enumerate() {
                                td.text[text(k)].long[cell.len() > LONG] {
                                    @match meaning(line).filter(|_| k == 0) {
                                        None => (prose(cell)),
                                        Some(words) => details {
                                            summary { (unbroken(cell)) }
                                            (prose(words))
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn figure(figure: &Figure) -> Result<Markup, Error> {
    let Figure {
        name,
        title,
        picture,
        ..
    } = figure;
    let svg = picture.svg(name, title)?;
    let narrow = figure.narrow.as_ref();
    let narrow = narrow.map(|picture| picture.svg(name, title)).transpose()?;
    Ok(html! {
        section {
            figure.plot {
                div.sheet.broad[narrow.is_some()] { div.wide { (PreEscaped(svg)) } (data(picture)) }
                @if let Some(svg) = narrow { div.narrow { (PreEscaped(svg)) } }
                figcaption { b { (title) ". " } (prose(&figure.caption)) }
            }
        }
    })
}

/// The data by which the script zooms a picture with scales.
fn data(picture: &Picture) -> Markup {
    // '<' would end the script element
    let data = picture
        .has_scales()
        .then(|| picture.data().to_string().replace('<', "\\u003c"));
    html! {
        @if let Some(data) = data {
            script type="application/json" { (PreEscaped(data)) }
        }
    }
}
