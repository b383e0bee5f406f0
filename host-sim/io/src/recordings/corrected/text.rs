//! Replaces numbers in the lines of a text file and leaves all other bytes.

use crate::recordings::read::read_to_cut;
use crate::recordings::session::complain;
use crate::recordings::table::{Cell, Separator, unquoted};
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use nalgebra::{Rotation3, Vector3};
use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;

/// A text file that holds one sample on each line.
#[derive(Debug, Clone)]
pub struct Text {
    /// The file, plain or packed.
    pub file: PathBuf,
    /// Lines before the samples.
    pub skip: usize,
    /// Position of the samples on a line.
    pub columns: SampleColumns,
    separator: Separator,
}

/// Position of the samples on a line, their units and axes.
#[derive(Debug, Clone, Copy)]
pub struct SampleColumns {
    /// Column of the time, counted from 0.
    pub time: usize,
    /// Columns of the gyros x, y, z and of the accelerometers.
    pub columns: [[usize; 3]; 2],
    /// SI value of the number 1, for gyros and accelerometers.
    pub units: [f64; 2],
    /// Turns axes of the file into forward-right-down.
    pub turn: Rotation3<f64>,
}

impl Text {
    pub(crate) fn new(
        file: PathBuf,
        separator: Separator,
        skip: usize,
        columns: SampleColumns,
    ) -> Self {
        Self {
            file,
            skip,
            columns,
            separator,
        }
    }

    /// See [`super::Original::without`].
    pub fn without(&self, taken: &[Increment]) -> Result<Vec<u8>, Error> {
        let bytes = read_to_cut(&self.file)?;
        let mut out = Vec::with_capacity(bytes.len() + bytes.len() / 4);
        let mut taken = taken.iter();
        for (k, line) in lines(&bytes).enumerate() {
            if k < self.skip || !self.has_sample(line) {
                out.extend_from_slice(line); // a missing sample, or a line that is cut
            } else {
                match taken.next() {
                    Some(taken) => self
                        .line(line, taken, &mut out)
                        .ok_or_else(|| self.changed(k))?,
                    // the last line may be cut behind the sample
                    None if !line.ends_with(b"\n") => out.extend_from_slice(line),
                    None => return Err(self.changed(k)),
                }
            }
        }
        match taken.next() {
            None => Ok(out),
            Some(_) => Err(self.changed(0)),
        }
    }

    /// Whether a line has a time and all six numbers, as its reader sees it.
    fn has_sample(&self, line: &[u8]) -> bool {
        let spans = self.spans(line);
        let samples = self.columns.columns.iter().flatten();
        let mut columns = samples.chain([&self.columns.time]);
        columns.all(|column| {
            spans
                .get(*column)
                .is_some_and(|span| number(line, span).is_some())
        })
    }

    /// Appends a line with the correction subtracted. `None`: the line lacks the numbers.
    fn line(&self, line: &[u8], taken: &Increment, out: &mut Vec<u8>) -> Option<()> {
        let spans = self.spans(line);
        let mut changes: Vec<(Range<usize>, String)> = Vec::new();
        let SampleColumns {
            columns,
            units,
            turn,
            ..
        } = &self.columns;
        for ((columns, unit), taken) in columns.iter().zip(units).zip([taken.dtheta, taken.dv]) {
            if taken == Vector3::zeros() {
                continue;
            }
            let taken = turn.inverse() * taken / *unit;
            for (column, taken) in columns.iter().zip(taken.iter()) {
                let span = spans.get(*column)?.clone();
                let old = number(line, &span)?;
                let new = old - taken;
                if new != old {
                    let text = match line[span.clone()].contains(&b',') {
                        true => shortest(new).replace('.', ","), // a decimal comma
                        false => shortest(new),
                    };
                    changes.push((span, text));
                }
            }
        }
        changes.sort_by_key(|(span, _)| span.start);
        let mut at = 0;
        for (span, text) in changes {
            out.extend_from_slice(&line[at..span.start]);
            out.extend_from_slice(text.as_bytes());
            at = span.end;
        }
        out.extend_from_slice(&line[at..]);
        Some(())
    }

    /// Byte ranges of the values of a line, without the blanks around them.
    fn spans(&self, line: &[u8]) -> Vec<Range<usize>> {
        let separates = |byte: &u8| match self.separator {
            Separator::Char(c) => *byte == c,
            Separator::Blank => byte.is_ascii_whitespace(),
            Separator::BlankOrComma => byte.is_ascii_whitespace() || *byte == b',',
        };
        let runs = !matches!(self.separator, Separator::Char(_));
        let mut start = match line.strip_prefix(b"\xef\xbb\xbf") {
            Some(_) => 3,
            None => 0,
        };
        let mut out = Vec::new();
        for value in line[start..].split(separates) {
            let end = start + value.len();
            let from = start + value.len() - value.trim_ascii_start().len();
            let to = from + value.trim_ascii().len();
            if !(runs && value.is_empty()) {
                out.push(unquoted(line, from..to));
            }
            start = end + 1;
        }
        out
    }

    fn changed(&self, line: usize) -> Error {
        let key = format!("line {}", line + 1);
        let problem = "is not the sample that was read before".to_owned();
        let remedy = "do not change the file while it is replayed";
        complain(&self.file, &key, problem, remedy)
    }
}

/// The number in a part of a line.
fn number(line: &[u8], span: &Range<usize>) -> Option<f64> {
    let text = std::str::from_utf8(&line[span.clone()]).ok()?;
    <f64 as Cell>::parse(text).ok()
}

/// The lines of a text with what ends them: a line feed, or a carriage return that stands alone.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = bytes;
    std::iter::from_fn(move || {
        let ends = |k: &usize| match rest[*k] {
            b'\n' => true,
            b'\r' => !matches!(rest.get(k + 1), Some(b'\n' | b'\r')),
            _ => false,
        };
        let length = (0..rest.len()).find(ends).map_or(rest.len(), |k| k + 1);
        let (line, after) = rest.split_at(length);
        rest = after;
        (!line.is_empty()).then_some(line)
    })
}

/// A number in the fewest digits that read back to the same bits. Small ones have an exponent.
pub(crate) fn shortest(x: f64) -> String {
    let mut text = String::new();
    // writing to a string does not fail
    let _ = match x.abs() {
        size if size < 1e-3 => write!(text, "{x:e}"),
        _ => write!(text, "{x}"),
    };
    text
}
