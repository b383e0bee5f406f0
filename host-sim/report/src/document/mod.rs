//! A report as text, tables and pictures, and its output: a page and JSON of the same contents.
//!
//! The report of a unit and that of a campaign each fill a [`Document`]. The same document gives
//! the same bytes.

mod html;

use super::front::Front;
use host_chart::picture::Picture;
use host_core::error::Error;
use serde_json::{Value, json};

/// The whole report.
#[derive(Debug, Default)]
pub struct Document {
    pub(super) title: String,
    pub(super) date: Option<String>,
    /// Sentences of the verdict, the shortest answer first.
    pub(super) verdict: Vec<String>,
    /// What the first screen shows under the first of them.
    pub(super) front: Option<Front>,
    /// Files beside the page: the name of each, and its description on the page.
    pub(super) beside: Vec<(&'static str, &'static str)>,
    pub(super) parts: Vec<Part>,
}

/// A part of the report.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// Its name in links and in the JSON.
    pub id: String,
    pub title: String,
    /// Why it is empty.
    pub left_out: Option<String>,
    pub sentences: Vec<String>,
    /// Explanations, folded.
    pub explained: Vec<String>,
    /// Everything but the title is folded.
    pub folded: bool,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
    pub commands: Vec<String>,
    /// The results, for the JSON.
    pub data: Value,
}

/// A table. Its first `text` columns are texts, the others numbers.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub caption: Option<String>,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
    pub text: usize,
    /// Explanations of the first cells of the rows, shown on request. Empty, or one for each row.
    pub meanings: Vec<Option<String>>,
}

/// A picture with its text.
#[derive(Debug)]
pub(super) struct Figure {
    pub name: &'static str,
    pub title: String,
    pub caption: String,
    pub picture: Picture,
    /// The same for a telephone, where the picture would have to be scrolled.
    pub narrow: Option<Picture>,
}

impl Table {
    /// Whether a column contains text, aligned to the left.
    fn is_text(&self, column: usize) -> bool {
        column < self.text
    }

    /// A table of labels and values.
    pub fn of_pairs(pairs: impl IntoIterator<Item = (String, String)>) -> Self {
        Self {
            rows: pairs.into_iter().map(|(a, b)| vec![a, b]).collect(),
            text: 2,
            ..Self::default()
        }
    }
}

impl Part {
    pub fn new(id: impl Into<String>, title: &str) -> Self {
        Self {
            id: id.into(),
            title: title.to_owned(),
            ..Self::default()
        }
    }

    /// An empty part.
    pub fn without(id: &str, title: &str, why: &str) -> Self {
        Self {
            left_out: Some(why.to_owned()),
            ..Self::new(id, title)
        }
    }
}

impl Document {
    /// The verdict, the shortest answer first.
    #[must_use]
    pub fn verdict(&self) -> &[String] {
        &self.verdict
    }

    /// The contents as data.
    #[must_use]
    pub fn json(&self) -> Value {
        let table = |table: &Table| {
            let Table {
                caption,
                head,
                rows,
                ..
            } = table;
            json!({ "caption": caption, "head": head, "rows": rows })
        };
        let figure = |figure: &Figure| {
            json!({
                "title": figure.title, "caption": figure.caption, "picture": figure.picture.data(),
            })
        };
        let part = |part: &Part| {
            let sentences = [&part.sentences[..], &part.explained[..]].concat();
            json!({
                "id": part.id,
                "title": part.title,
                "left_out": part.left_out,
                "sentences": sentences,
                "tables": part.tables.iter().map(table).collect::<Vec<_>>(),
                "figures": part.figures.iter().map(figure).collect::<Vec<_>>(),
                "commands": part.commands,
                "data": part.data,
            })
        };
        json!({
            "title": self.title,
            "date": self.date,
            "verdict": self.verdict,
            "parts": self.parts.iter().map(part).collect::<Vec<_>>(),
        })
    }

    /// The page: one file that fetches nothing.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn page(&self) -> Result<String, Error> {
        html::page(self)
    }
}
