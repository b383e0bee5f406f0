//! The report of one unit, to be filed: a page, a PDF and JSON of the same contents.
//!
//! [`Contents`] holds what the commands `allan`, `learnability` and `replay` compute, or what a
//! device tells. [`Document`] puts it in words, tables and pictures, and the three files are made
//! from that. The same contents give the same bytes.

mod html;
mod parts;
mod pdf;
mod verdict;

pub use parts::device::Told;

use super::chart::Picture;
use super::page;
use crate::analysis::allan::findings::Findings;
use crate::analysis::learnability::Answer;
use crate::error::Error;
use crate::experiment::outcome::Outcome;
use crate::unit::Unit;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Name of the PDF beside the page.
const PDF: &str = "report.pdf";
/// Name of the weights beside the page.
const WEIGHTS: &str = "weights.bin";

/// What a part holds, or in a sentence why it is left out.
pub type Found<T> = Result<T, String>;

/// What the report is made of.
#[derive(Debug)]
pub struct Contents {
    /// The unit file.
    pub unit: Unit,
    /// What was typed for it; `None`: nothing, and it is only assumed.
    pub unit_name: Option<String>,
    /// Date or note of the user for the head.
    pub date: Option<String>,
    /// Label and value of what is known of the recording or the device.
    pub source: Vec<(String, String)>,
    /// Files that were read, and their SHA-256 in hexadecimal digits.
    pub files: Vec<(String, String)>,
    /// Where the samples contradict what is said of them, and whatever else comes first.
    pub warnings: Vec<String>,
    /// Allan analysis at rest.
    pub noise: Found<Findings>,
    /// What can be learnt on a drive.
    pub learnable: Found<Answer>,
    /// Replays: learnt from one part and judged on another.
    pub outcomes: Found<Vec<Outcome>>,
    /// Time on the recording's clock, s, and temperature, degrees C.
    pub temperatures: Found<Vec<(f64, f64)>>,
    /// What a device tells.
    pub device: Option<Told>,
    /// The commands that made the report, and those that give its parts alone.
    pub commands: Vec<String>,
}

/// The report in words, tables and pictures.
#[derive(Debug)]
pub struct Document {
    title: String,
    date: Option<String>,
    verdict: Vec<String>,
    parts: Vec<Part>,
    /// Image of the weights, if there are any.
    weights: Option<Vec<u8>>,
}

/// A part of the report.
#[derive(Debug, Default)]
struct Part {
    /// Its name in links and in the JSON.
    id: &'static str,
    title: String,
    /// Why there is nothing in it.
    left_out: Option<String>,
    sentences: Vec<String>,
    tables: Vec<Table>,
    figures: Vec<Figure>,
    commands: Vec<String>,
    /// The figures themselves, for the JSON.
    data: Value,
}

/// A table. Its first `text` columns are texts, the others numbers.
#[derive(Debug, Default)]
struct Table {
    caption: Option<String>,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    text: usize,
}

/// A picture with its words.
#[derive(Debug)]
struct Figure {
    name: &'static str,
    title: String,
    caption: String,
    picture: Picture,
}

impl Table {
    /// Whether a column is to be read from the left.
    fn is_text(&self, column: usize) -> bool {
        column < self.text
    }

    /// Labels and values.
    fn of_pairs(pairs: impl IntoIterator<Item = (String, String)>) -> Self {
        Self {
            rows: pairs.into_iter().map(|(a, b)| vec![a, b]).collect(),
            text: 2,
            ..Self::default()
        }
    }
}

impl Part {
    fn new(id: &'static str, title: &str) -> Self {
        Self {
            id,
            title: title.to_owned(),
            ..Self::default()
        }
    }

    /// A part with nothing in it.
    fn without(id: &'static str, title: &str, why: &str) -> Self {
        Self {
            left_out: Some(why.to_owned()),
            ..Self::new(id, title)
        }
    }
}

impl Document {
    /// Puts the contents in words.
    ///
    /// # Errors
    /// [`Error::BadResult`] for results that are not finite.
    pub fn of(contents: &Contents) -> Result<Self, Error> {
        let Contents { unit, .. } = contents;
        let serial = match unit.serial.as_str() {
            "" => "without a serial number".to_owned(),
            serial => format!("serial number {serial}"),
        };
        Ok(Self {
            title: format!("Report of unit {}, {serial}", unit.name),
            date: contents.date.clone(),
            verdict: verdict::sentences(contents),
            parts: parts::all(contents)?,
            weights: parts::weights::image(contents),
        })
    }

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
            json!({
                "id": part.id,
                "title": part.title,
                "left_out": part.left_out,
                "sentences": part.sentences,
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

    /// Writes the page, the PDF and the weights into `dir`, all or nothing. Gives the page's path.
    ///
    /// # Errors
    /// As [`page::write`].
    pub fn write(&self, dir: &Path) -> Result<PathBuf, Error> {
        page::place(dir, || {
            let mut files = vec![
                (page::PAGE, html::page(self)?.into_bytes()),
                (PDF, pdf::pdf(self)?),
            ];
            files.extend(self.weights.clone().map(|image| (WEIGHTS, image)));
            Ok(files)
        })
    }
}

/// SHA-256 in hexadecimal digits, as `sha256sum` prints it.
///
/// # Errors
/// What the reader says.
pub fn hash(mut from: impl Read) -> io::Result<String> {
    let mut digest = Sha256::new();
    let mut piece = [0; 1 << 14];
    loop {
        match from.read(&mut piece)? {
            0 => break,
            len => digest.update(piece.get(..len).unwrap_or_default()),
        }
    }
    let digest = digest.finalize();
    Ok(digest.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The same of bytes in memory.
fn hash_of(bytes: &[u8]) -> String {
    hash(bytes).unwrap_or_default() // a slice can be read
}
