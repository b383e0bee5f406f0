//! Recordings written out again with corrected samples.
//!
//! The file retains its format: only the numbers of the six sensors change, and only where a
//! correction is not zero. Time stamps, gaps, names, further columns, blanks and the ends of lines
//! stay as they are, byte for byte. The samples stay in the axes and units of the file. Numbers are
//! written in the fewest digits that read back to the same bits.

mod text;

pub(crate) use text::shortest;
pub use text::{SampleColumns, Text};

use crate::recordings::novatel::rewrite::Log;
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use std::path::Path;

/// The file that holds the samples of a record, as it can be written again.
#[derive(Debug, Clone)]
pub enum Original {
    /// Lines of numbers.
    Text(Text),
    /// A `NovAtel` binary log.
    Novatel(Log),
}

impl Original {
    /// The file.
    #[must_use]
    pub fn file(&self) -> &Path {
        match self {
            Self::Text(text) => &text.file,
            Self::Novatel(log) => &log.file,
        }
    }

    /// The bytes of the file with the correction subtracted. `taken` has the correction of each
    /// sample in order, body axes forward-right-down, in rad and m/s for increments, in rad/s and
    /// m/s2 for rates.
    ///
    /// # Errors
    /// The file cannot be read, or is not the one that the samples were read from.
    pub fn without(&self, taken: &[Increment]) -> Result<Vec<u8>, Error> {
        match self {
            Self::Text(text) => text.without(taken),
            Self::Novatel(log) => log.without(taken),
        }
    }
}

#[cfg(test)]
mod tests;
