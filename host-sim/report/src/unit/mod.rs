//! The report of one unit, to be filed: a page and JSON of the same contents.
//!
//! [`Contents`] holds the results of the commands `allan`, `learnability` and `replay`, or the
//! state that a device reports. [`Report`] presents them as text, tables and pictures. The same
//! contents give the same bytes.

mod parts;
mod verdict;

pub use parts::device::Readout;

use super::document::{Document, Figure, Part, Table};
use super::front::Front;
use super::{page, replay};
use host_core::error::Error;
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::learnability::Answer;
use host_lab::experiment::outcome::Outcome;
use host_unit::Unit;
use sha2::{Digest, Sha256};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Name of the weights beside the page.
const WEIGHTS: &str = "weights.bin";

/// The contents of a part, or a sentence that says why it is left out.
pub type PartResult<T> = Result<T, String>;

/// The contents of the report.
#[derive(Debug)]
pub struct Contents {
    /// The unit file.
    pub unit: Unit,
    /// The option by which it was given. `None`: not given, so that it is only assumed.
    pub unit_name: Option<String>,
    /// Date or note of the user for the head.
    pub date: Option<String>,
    /// Labels and values of the recording or the device.
    pub source: Vec<(String, String)>,
    /// Files that were read, and their SHA-256 in hexadecimal digits.
    pub files: Vec<(String, String)>,
    /// Contradictions between the samples and their header or unit, and other warnings.
    pub warnings: Vec<String>,
    /// Allan analysis at rest.
    pub noise: PartResult<Findings>,
    /// Bounds of learning on a drive.
    pub learnable: PartResult<Answer>,
    /// Replays: learning on one part and judging on another.
    pub outcomes: PartResult<Vec<Outcome>>,
    /// Time on the recording's clock, s, and temperature, degrees C.
    pub temperatures: PartResult<Vec<(f64, f64)>>,
    /// The state that a device reports.
    pub device: Option<Readout>,
    /// The commands that made the report, and those that make its parts alone.
    pub commands: Vec<String>,
}

/// The report, and the weights beside it.
#[derive(Debug)]
pub struct Report {
    document: Document,
    /// Image of the weights, if there are any.
    weights: Option<Vec<u8>>,
}

impl Report {
    /// Makes the report of these contents.
    ///
    /// # Errors
    /// [`Error::BadResult`] for results that are not finite.
    pub fn of(contents: &Contents) -> Result<Self, Error> {
        let Contents { unit, .. } = contents;
        let serial = match unit.serial.as_str() {
            "" => "without a serial number".to_owned(),
            serial => format!("serial number {serial}"),
        };
        let weights = parts::weights::image(contents);
        let beside = weights.as_ref().map(|_| (WEIGHTS, "weights"));
        let parts = parts::all(contents)?;
        let document = Document {
            title: format!("Report of unit {}, {serial}", unit.name),
            date: contents.date.clone(),
            verdict: verdict::sentences(contents),
            beside: beside.into_iter().collect(),
            front: front(contents, &parts),
            parts,
        };
        Ok(Self { document, weights })
    }

    /// The report in words, tables and pictures.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Writes the page and the weights into `dir`, all or nothing. Returns the page's path.
    ///
    /// # Errors
    /// As [`page::write`].
    pub fn write(&self, dir: &Path) -> Result<PathBuf, Error> {
        page::write_files(dir, || {
            let mut files = vec![(page::PAGE, self.document.page()?.into_bytes())];
            files.extend(self.weights.clone().map(|image| (WEIGHTS, image)));
            Ok(files)
        })
    }
}

/// The first screen: the errors without fixes where there are any, else the first picture.
fn front(contents: &Contents, parts: &[Part]) -> Option<Front> {
    if let Ok(outcomes) = &contents.outcomes {
        return Some(replay::front(outcomes));
    }
    let first = parts.iter().flat_map(|part| &part.figures).next()?;
    Some(Front {
        title: format!("{}. {}", first.title, first.caption),
        pictures: [first.picture.clone(), first.picture.clone()],
        figures: verdict::figures(contents),
    })
}

/// SHA-256 in hexadecimal digits, as `sha256sum` prints it.
///
/// # Errors
/// The reader's errors.
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

/// The SHA-256 of bytes in memory.
fn hash_of(bytes: &[u8]) -> String {
    hash(bytes).unwrap_or_default() // a slice can be read
}
